//! The planes beside colour: depth, normal, coverage, selection, texel density.
//!
//! All of them speak of the nearest surface at each sub-pixel, whatever its alpha, and weigh it by the pixel's filter.

use resample_core::{Image, Plane, Projection};

use crate::accumulate::centre_px;
use crate::fragments::{Fragment, collect};
use crate::options::{PlaneKind, RenderOptions};
use crate::plane::value;
use crate::span::TILE_PX;
use crate::surface::Surface;
use crate::tile::{Cell, PixelPlanes, Tile, TileImage, TileWork};

impl Tile<'_> {
    /// Fills the planes of every pixel that shows something.
    pub(crate) fn fill_planes(&self, work: &mut TileWork, image: &mut TileImage) {
        image.planes = vec![
            PixelPlanes {
                points: true,
                ..PixelPlanes::default()
            };
            TILE_PX * TILE_PX
        ];
        work.from_subpixels
            .iter()
            .for_each(|&pixel| image.planes[usize::from(pixel)].points = false);
        let mut nearest = work.visibility.ids.clone();
        // Layers are sorted, the nearest last.
        work.visibility
            .layers
            .iter()
            .for_each(|layer| nearest[layer.subpixel as usize] = layer.id);
        for (index, planes) in image.planes.iter_mut().enumerate() {
            let pixel = [index % TILE_PX, index / TILE_PX];
            match work.seen[index] {
                Cell::Empty => continue,
                Cell::Plane(id) => {
                    work.fragments.clear();
                    work.fragments.push(Fragment {
                        id,
                        weight: 1.0,
                        at: centre_px(pixel),
                    });
                }
                _ => collect(
                    self.frame.filter,
                    &nearest,
                    &work.edges,
                    pixel,
                    &mut work.fragments,
                ),
            }
            for fragment in &work.fragments {
                if let Some(surface) = &work.surfaces[fragment.id as usize] {
                    self.add(surface, fragment, planes);
                }
            }
        }
    }

    fn add(&self, surface: &Surface, fragment: &Fragment, planes: &mut PixelPlanes) {
        let Fragment { weight, at, id } = *fragment;
        planes.coverage += weight;
        planes.depth += weight * self.camera_z(id, at);
        let normal = surface.normal_at(at).to_array();
        planes
            .normal
            .iter_mut()
            .zip(normal)
            .for_each(|(sum, n)| *sum += weight * n);
        if let Some(base) = &surface.base {
            let [ux, uy, vx, vy] = surface.uv_at(base, at).jacobian;
            planes.texels += weight * (ux * vy - uy * vx).abs();
        }
    }

    fn camera_z(&self, id: u32, at: [f32; 2]) -> f32 {
        let key = value(&self.key_plane(id), at);
        match self.frame.camera.projection {
            Projection::Perspective => 1.0 / key,
            Projection::Orthographic => -key,
        }
    }
}

/// Adds to the picture the planes that the options ask for; `pixel` gives what a tile holds.
pub(crate) fn add_planes<'a>(
    image: &mut Image,
    options: &RenderOptions,
    pixel: impl Fn(usize, usize) -> Option<&'a PixelPlanes>,
) {
    let (width, height) = (image.width, image.height);
    let gather = |read: &dyn Fn(&PixelPlanes) -> f32, empty: f32| -> Vec<f32> {
        let at = |i: usize| pixel(i % width, i / width).filter(|p| p.coverage > 0.0);
        (0..width * height)
            .map(|i| at(i).map_or(empty, read))
            .collect()
    };
    for kind in PlaneKind::ALL.into_iter().filter(|&kind| options.has(kind)) {
        let mut add = |name: &str, values: Vec<f32>| {
            image.planes.push(Plane {
                name: name.into(),
                values,
            })
        };
        match kind {
            PlaneKind::Depth => {
                image.depth = Some(gather(&|p| p.depth / p.coverage, f32::INFINITY))
            }
            PlaneKind::Normal => {
                for (k, name) in ["normal.X", "normal.Y", "normal.Z"].into_iter().enumerate() {
                    add(name, gather(&|p| p.normal[k], 0.0));
                }
            }
            PlaneKind::Coverage => add("coverage", gather(&|p| p.coverage.min(1.0), 0.0)),
            PlaneKind::Selection => {
                add("selection", gather(&|p| f32::from(u8::from(p.points)), 0.0))
            }
            PlaneKind::Texels => add("texels", gather(&|p| p.texels / p.coverage, 0.0)),
        }
    }
}
