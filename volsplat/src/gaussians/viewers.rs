//! Gaussians as other viewers draw them: flat ellipses on the screen, composited in the order of their centres.
//!
//! For conformance, not for pictures: the footprint is the affine approximation about the centre (Zwicker et al., "EWA splatting",
//! 2002, equation 24), each pixel has one sample, and the order jumps as the camera moves. [`Rules`] hold where the viewers differ.
//! Limits: a clip keeps or drops a Gaussian by its centre. The published code cuts footprints by whole tiles at three standard
//! deviations; here an opacity below the least one is nowhere drawn.

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;
use resample_core::camera::Projection;
use resample_core::narrow::{pixel, side, single};
use resample_core::sort::{depth_key, entry_index};
use resample_core::tile::{ChunkBins, MAX_CHUNK_LEN, TILE_AREA, TILE_PX, TileGrid};
use resample_core::{Camera, Stop};
use resample_volume::Gaussians;

use crate::gaussians::options::{GaussianModel, GaussianOptions};
use crate::gaussians::project::{CHUNK, View};
use crate::gaussians::tile::BlendPixel;

/// A model's numbers.
#[derive(Clone, Copy, Debug)]
struct Rules {
    /// Variance that is added to the footprint along both axes, px squared.
    widening_px2: f64,
    /// Opacity is multiplied by the root of the areas' ratio before and after widening.
    keeps_light: bool,
    /// The slope x / z at which the Jacobian is taken is kept within this many times the half picture's; 0 for no bound.
    slope_bound: f64,
    /// Opacities in a pixel are at most this, and skipped below this.
    most_opacity: f32,
    least_opacity: f32,
    /// A pixel ends before its transmittance would fall below this.
    min_transmittance: f32,
}

impl Rules {
    fn of(model: GaussianModel) -> Option<Self> {
        // Kerbl et al. 2023, their published code.
        let inria = Self {
            widening_px2: 0.3,
            keeps_light: false,
            slope_bound: 1.3,
            most_opacity: 0.99,
            least_opacity: 1.0 / 255.0,
            min_transmittance: 1e-4,
        };
        match model {
            GaussianModel::Volume => None,
            GaussianModel::Inria => Some(inria),
            // Yu et al. 2024, equation 10 and their published code.
            GaussianModel::Mip => Some(Self {
                widening_px2: 0.1,
                keeps_light: true,
                ..inria
            }),
            // The standard names none of these numbers: what hundreds together do not show in 8 bits is skipped.
            GaussianModel::Khr => Some(Self {
                widening_px2: 0.0,
                keeps_light: false,
                slope_bound: 0.0,
                most_opacity: 1.0,
                least_opacity: 1.0 / 65536.0,
                min_transmittance: 1e-4,
            }),
        }
    }
}

/// A flat ellipse on the screen.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Footprint {
    /// Its centre, px.
    centre: [f32; 2],
    /// Inverse of its covariance: xx, xy, yy, 1/px squared.
    conic: [f32; 3],
    opacity: f32,
    colour: [f32; 3],
    /// Camera z of the centre.
    z: f32,
    /// First and last pixel column and row, the last exclusive.
    columns: [u16; 2],
    rows: [u16; 2],
}

/// The ellipses of a frame, by tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct Footprints {
    chunks: Vec<ChunkBins<Footprint>>,
}

impl Footprints {
    /// Projects all Gaussians for one camera.
    pub(crate) fn fill(
        &mut self,
        gaussians: &Gaussians,
        camera: &Camera,
        options: &GaussianOptions,
    ) {
        let Some(rules) = Rules::of(options.model) else {
            return;
        };
        let clip = options.clip.in_grid(&DAffine3::IDENTITY);
        let count = gaussians.len().div_ceil(CHUNK);
        self.chunks.resize_with(count, ChunkBins::default);
        let grid = TileGrid::new(camera.width as usize, camera.height as usize);
        let view = View::new(gaussians, camera);
        let chunks = self.chunks.par_iter_mut().enumerate();
        chunks.for_each(|(number, bins)| {
            bins.clear();
            let first = number * CHUNK;
            for index in first..(first + CHUNK).min(gaussians.len()) {
                let centre = gaussians.origin_in_world + gaussians.get(index).centre.as_dvec3();
                if !clip.is_whole() && !clip.keeps(centre) {
                    continue;
                }
                if let Some(footprint) = footprint(&view, gaussians, index, &rules) {
                    let rect = grid.rect(footprint.columns, footprint.rows);
                    bins.push(footprint, depth_key(footprint.z), rect);
                }
            }
            bins.bin(number);
        });
    }

    /// Gaussians in view, and the same times the tiles that each may touch.
    pub(crate) fn counts(&self) -> [u64; 2] {
        let sum = |count: fn(&ChunkBins<Footprint>) -> usize| {
            self.chunks.iter().map(|chunk| count(chunk) as u64).sum()
        };
        [sum(|chunk| chunk.primitives.len()), sum(ChunkBins::pairs)]
    }

    /// The pixels of the tiles at these places; tiles that nothing touches, and those after a stop, have none.
    pub(crate) fn draw(
        &self,
        places: &[[usize; 2]],
        model: GaussianModel,
        stop: &Stop,
    ) -> Vec<Vec<BlendPixel>> {
        let Some(rules) = Rules::of(model) else {
            return Vec::new();
        };
        let tiles = places.par_iter().map_init(Vec::new, |entries, place| {
            if stop.is_asked() {
                return Vec::new();
            }
            self.tile(*place, &rules, entries)
        });
        tiles.collect()
    }

    fn tile(
        &self,
        [column, row]: [usize; 2],
        rules: &Rules,
        entries: &mut Vec<u64>,
    ) -> Vec<BlendPixel> {
        entries.clear();
        for chunk in &self.chunks {
            entries.extend_from_slice(chunk.tile(side(column), side(row)));
        }
        if entries.is_empty() {
            return Vec::new();
        }
        // All bits of the depth: viewers that sort f32 depths tell neighbours apart that a coarser key does not.
        entries.sort_unstable();
        let mut canvas = Canvas::new([column * TILE_PX, row * TILE_PX]);
        for entry in entries.iter() {
            let index = entry_index(*entry) as usize;
            let footprint = &self.chunks[index / MAX_CHUNK_LEN].primitives[index % MAX_CHUNK_LEN];
            canvas.lay(footprint, rules);
        }
        canvas.finished()
    }
}

/// The pixels of a tile, on which ellipses are composited front to back.
struct Canvas {
    first: [usize; 2],
    pixels: Vec<BlendPixel>,
    transmittances: [f32; TILE_AREA],
    ended: [bool; TILE_AREA],
}

impl Canvas {
    fn new(first: [usize; 2]) -> Self {
        Self {
            first,
            pixels: vec![BlendPixel::default(); TILE_AREA],
            transmittances: [1.0; TILE_AREA],
            ended: [false; TILE_AREA],
        }
    }

    fn lay(&mut self, footprint: &Footprint, rules: &Rules) {
        let [x0, y0] = self.first;
        let within = |[from, to]: [u16; 2], first: usize| {
            usize::from(from).max(first)..usize::from(to).min(first + TILE_PX)
        };
        for y in within(footprint.rows, y0) {
            for x in within(footprint.columns, x0) {
                let at = (y - y0) * TILE_PX + x - x0;
                if !self.ended[at] {
                    self.lay_pixel(at, [x as f32 + 0.5, y as f32 + 0.5], footprint, rules);
                }
            }
        }
    }

    fn lay_pixel(&mut self, at: usize, [x, y]: [f32; 2], footprint: &Footprint, rules: &Rules) {
        let (dx, dy) = (x - footprint.centre[0], y - footprint.centre[1]);
        let [a, b, c] = footprint.conic;
        let power = -0.5 * (a * dx * dx + c * dy * dy) - b * dx * dy;
        let opacity = (footprint.opacity * power.exp()).min(rules.most_opacity);
        if power > 0.0 || opacity < rules.least_opacity {
            return;
        }
        let before = self.transmittances[at];
        let after = before * (1.0 - opacity);
        if after < rules.min_transmittance && rules.most_opacity < 1.0 {
            self.ended[at] = true;
            return;
        }
        let weight = before * opacity;
        let pixel = &mut self.pixels[at];
        for (sum, colour) in pixel.rgba.iter_mut().zip(footprint.colour) {
            *sum += weight * colour;
        }
        pixel.depth += weight * footprint.z;
        if before > 0.5 && after <= 0.5 {
            (pixel.median, pixel.halved) = (footprint.z, 1.0);
        }
        self.transmittances[at] = after;
        self.ended[at] = after < rules.min_transmittance;
    }

    fn finished(mut self) -> Vec<BlendPixel> {
        for (pixel, left) in self.pixels.iter_mut().zip(self.transmittances) {
            pixel.rgba[3] = 1.0 - left;
        }
        self.pixels
    }
}

/// The ellipse of a Gaussian; `None` where nothing of it is seen.
fn footprint(view: &View, gaussians: &Gaussians, index: usize, rules: &Rules) -> Option<Footprint> {
    let camera = view.camera;
    let placed = view.placed(gaussians, index);
    let centre = placed.centre;
    if !(centre.z > camera.near) {
        return None;
    }
    let [xx, xy, yy] = screen_covariance(camera, centre, &placed.axes, rules);
    let before = xx * yy - xy * xy;
    let (xx, yy) = (xx + rules.widening_px2, yy + rules.widening_px2);
    let determinant = xx * yy - xy * xy;
    if !(determinant > 0.0) {
        return None;
    }
    let kept = if rules.keeps_light {
        (before / determinant).max(0.0).sqrt()
    } else {
        1.0
    };
    let opacity = placed.opacity * kept;
    let reach2 = 2.0 * (opacity / f64::from(rules.least_opacity)).ln();
    if !(reach2 > 0.0) {
        return None;
    }
    let pos_in_screen = camera.screen_from_camera(centre);
    let columns = pixels(pos_in_screen.x, (reach2 * xx).sqrt(), camera.width)?;
    let rows = pixels(pos_in_screen.y, (reach2 * yy).sqrt(), camera.height)?;
    Some(Footprint {
        centre: [single(pos_in_screen.x), single(pos_in_screen.y)],
        conic: [yy, -xy, xx].map(|c| single(c / determinant)),
        opacity: single(opacity),
        colour: placed.colour.to_array(),
        z: single(centre.z),
        columns,
        rows,
    })
}

/// Covariance on the screen, px squared: xx, xy, yy.
fn screen_covariance(camera: &Camera, centre: DVec3, axes: &DMat3, rules: &Rules) -> [f64; 3] {
    let (fx, fy) = (camera.fx, camera.fy);
    let [row_x, row_y] = match camera.projection {
        Projection::Orthographic => [DVec3::X * fx, DVec3::Y * fy],
        Projection::Perspective => {
            let (z, mut u, mut v) = (centre.z, centre.x / centre.z, centre.y / centre.z);
            if rules.slope_bound > 0.0 {
                let [least, most] = slopes(camera.width, fx, camera.cx, rules.slope_bound);
                u = u.clamp(least, most);
                let [least, most] = slopes(camera.height, fy, camera.cy, rules.slope_bound);
                v = v.clamp(least, most);
            }
            [
                DVec3::new(1.0, 0.0, -u) * (fx / z),
                DVec3::new(0.0, 1.0, -v) * (fy / z),
            ]
        }
    };
    let (x, y) = (axes.transpose() * row_x, axes.transpose() * row_y);
    [x.dot(x), x.dot(y), y.dot(y)]
}

/// Least and greatest slope along an axis of the picture.
fn slopes(size: u32, focal: f64, principal: f64, bound: f64) -> [f64; 2] {
    let size = f64::from(size);
    let beyond = (bound - 1.0) * 0.5 * size / focal;
    [
        -principal / focal - beyond,
        (size - principal) / focal + beyond,
    ]
}

/// The pixels whose centres lie within `reach` of a place, along one axis of the picture.
fn pixels(middle: f64, reach: f64, size: u32) -> Option<[u16; 2]> {
    let first = (middle - reach - 0.5).ceil().max(0.0);
    let end = ((middle + reach - 0.5).floor() + 1.0).min(f64::from(size));
    (first < end).then_some([pixel(first), pixel(end)])
}
