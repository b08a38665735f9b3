//! A picture and its depth on the pixels of a pinhole camera: depth of another size, lenses with distortion, panoramas.
//!
//! Takes what was read and gives both on the camera's grid. Colour follows the cubic spline that magnification uses.
//! Depth is never blended across an edge: inside a surface its inverse is interpolated, and where the four samples
//! around a place belong to several surfaces, the one is continued whose colour is the place's own.

use glam::{DMat3, DVec2};
use rayon::prelude::*;
use resample_core::image::srgb_from_linear;
use resample_core::{Camera, Projection};
use resample_io::{Picture, Plane};

use super::cameras::Distortion;
use crate::options::SurfaceTolerance;
use crate::surfaces::colours;
use crate::surfaces::surface::{Cell, Surfaces};
use crate::view::panorama;

/// Difference of two colours, in steps of sRGB from 0 to 1, at which the one speaks e^(-1/2) for the other's surface.
/// A guess: the contrast of most outlines is several times as large, noise several times smaller.
const COLOUR_SIGMA: f32 = 0.1;

/// Where the pixels of a pinhole camera lie in a picture as it was taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens<'a> {
    pub(super) camera: &'a Camera,
    pub(super) model: Model<'a>,
    /// Width and height of the picture, px.
    pub(super) size: [usize; 2],
}

/// How a picture was taken.
#[derive(Clone, Copy, Debug)]
pub(super) enum Model<'a> {
    /// By the camera itself.
    Pinhole,
    /// By the camera, through a lens with this distortion.
    Distorted(&'a Distortion),
    /// As a panorama of this size around the same eye, some columns of which are repeated at both ends.
    Panorama {
        panorama_from_camera: DMat3,
        size: [u32; 2],
        repeated: usize,
    },
}

impl Lens<'_> {
    /// Where pixel `index` of the camera is in the picture, px; `None` where the lens shows nothing of it.
    fn pos_in_picture(&self, index: usize) -> Option<DVec2> {
        let width = self.camera.width as usize;
        let pixel = DVec2::new((index % width) as f64, (index / width) as f64) + 0.5;
        let focal = DVec2::new(self.camera.fx, self.camera.fy);
        let centre = DVec2::new(self.camera.cx, self.camera.cy);
        let on_plane = (pixel - centre) / focal;
        let pos = match self.model {
            Model::Pinhole => return Some(pixel),
            Model::Distorted(distortion) => distortion.distort(on_plane)? * focal + centre,
            Model::Panorama {
                panorama_from_camera,
                size,
                repeated,
            } => {
                let towards = panorama_from_camera * on_plane.extend(1.0);
                panorama::position(towards, size) + DVec2::new(repeated as f64, 0.0)
            }
        };
        let size = DVec2::new(self.size[0] as f64, self.size[1] as f64);
        (pos.cmpge(DVec2::ZERO).all() && pos.cmple(size).all()).then_some(pos)
    }

    fn pixels(&self) -> usize {
        self.camera.width as usize * self.camera.height as usize
    }
}

/// The picture as the pinhole sees it. Pixels of which the picture shows nothing are not covered.
pub(super) fn seen(picture: &Picture, lens: &Lens) -> Picture {
    let size = [picture.width, picture.height];
    let coverage = |index: usize| picture.coverage.as_ref().map_or(1.0, |held| held[index]);
    let mut coefficients: Vec<[f32; 4]> = (picture.rgb.iter().enumerate())
        .map(|(index, &[r, g, b])| [r, g, b, coverage(index)])
        .collect();
    // One flat surface: the whole picture is one run along each line.
    let grid = Camera {
        width: size[0] as u32,
        height: size[1] as u32,
        ..*lens.camera
    };
    let flat = Surfaces::new(&grid, vec![1.0; coefficients.len()], SurfaceTolerance::Auto);
    colours::solve(&mut coefficients, &flat);
    let colours: Vec<[f32; 4]> = (0..lens.pixels())
        .into_par_iter()
        .map(|index| match lens.pos_in_picture(index) {
            Some(pos) => spline_at(&coefficients, size, pos),
            None => [0.0; 4],
        })
        .collect();
    Picture {
        width: lens.camera.width as usize,
        height: lens.camera.height as usize,
        rgb: colours.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
        coverage: Some(colours.iter().map(|colour| colour[3].min(1.0)).collect()),
    }
}

/// Distances of the plane's own pixels on those of the lens; `picture` is what the depth belongs to, as it was taken.
pub(super) fn distances(plane: &Plane, picture: &Picture, lens: &Lens) -> Vec<f32> {
    let finder = Finder::new(plane, picture, lens.camera);
    (0..lens.pixels())
        .into_par_iter()
        .map(|index| {
            let pos = lens.pos_in_picture(index);
            pos.map_or(f32::NAN, |pos| finder.distance(pos))
        })
        .collect()
}

/// Finds distances between the samples of a plane.
struct Finder<'a> {
    picture: &'a Picture,
    surfaces: Surfaces,
    projection: Projection,
    /// Samples of the plane for each pixel of the picture, along x and y.
    scale: DVec2,
}

impl<'a> Finder<'a> {
    fn new(plane: &Plane, picture: &'a Picture, camera: &Camera) -> Self {
        // Of the camera, surfaces need the projection and the size of their grid.
        let grid = Camera {
            width: plane.width as u32,
            height: plane.height as u32,
            ..*camera
        };
        Self {
            picture,
            surfaces: Surfaces::new(&grid, plane.values.clone(), SurfaceTolerance::Auto),
            projection: camera.projection,
            scale: DVec2::new(
                plane.width as f64 / picture.width as f64,
                plane.height as f64 / picture.height as f64,
            ),
        }
    }

    /// The distance at a place in the picture, px; NaN where it is unknown.
    fn distance(&self, pos_in_picture: DVec2) -> f32 {
        let [width, height] = self.surfaces.size;
        // A cell lies between the centres of samples; those at the border also reach outward to the picture's end.
        let last = DVec2::new((width - 1).max(1) as f64, (height - 1).max(1) as f64);
        let pos = pos_in_picture * self.scale;
        let cell = (pos + 0.5).floor().clamp(DVec2::ONE, last);
        let (cx, cy) = (cell.x as usize, cell.y as usize);
        let t = pos + 0.5 - cell;
        let corners = self.surfaces.corners(cx, cy);
        let disparity = match self.surfaces.cells[cy * (width + 1) + cx] {
            Cell::Empty => return f32::NAN,
            Cell::MainDiagonal | Cell::AntiDiagonal => self.mean(&corners, &bilinear(t)),
            Cell::Cut => {
                let weights = bilinear(t.clamp(DVec2::ZERO, DVec2::ONE));
                let group = self.own_surface(&corners, &weights, pos_in_picture);
                let Some(group) = group else { return f32::NAN };
                self.continued(&group, pos)
            }
        };
        match self.projection {
            Projection::Perspective if disparity > 0.0 => 1.0 / disparity,
            Projection::Perspective => f32::NAN,
            Projection::Orthographic => disparity,
        }
    }

    fn mean(&self, corners: &[Option<usize>; 4], weights: &[f32; 4]) -> f32 {
        let both = corners.iter().zip(weights);
        both.filter(|(_, weight)| **weight != 0.0)
            .map(|(corner, weight)| {
                corner.map_or(f32::NAN, |i| weight * self.surfaces.disparity[i])
            })
            .sum()
    }

    /// The corners, with their weights, of the surface that speaks loudest; `None` where the nearest sample is unknown.
    fn own_surface(
        &self,
        corners: &[Option<usize>; 4],
        weights: &[f32; 4],
        pos_in_picture: DVec2,
    ) -> Option<Vec<(usize, f32)>> {
        let known =
            |corner: &Option<usize>| corner.filter(|&i| !self.surfaces.disparity[i].is_nan());
        let nearest = (0..4).max_by(|&a, &b| weights[a].total_cmp(&weights[b]))?;
        known(&corners[nearest])?;
        let own = self.colour(pos_in_picture);
        let votes: Vec<(usize, f32)> = (corners.iter().zip(weights))
            .filter_map(|(corner, &weight)| {
                let index = known(corner)?;
                Some((
                    index,
                    weight * likeness(own, self.colour(self.centre_of(index))),
                ))
            })
            .collect();
        let mut groups: Vec<Vec<(usize, f32)>> = Vec::new();
        for vote in votes {
            let linked = |group: &&mut Vec<(usize, f32)>| {
                group.iter().any(|&(other, _)| self.linked(other, vote.0))
            };
            match groups.iter_mut().find(linked) {
                Some(group) => group.push(vote),
                None => groups.push(vec![vote]),
            }
        }
        let loudness = |group: &[(usize, f32)]| group.iter().map(|(_, vote)| vote).sum::<f32>();
        groups
            .into_iter()
            .max_by(|a, b| loudness(a).total_cmp(&loudness(b)))
    }

    /// The disparity at `pos`, samples, of a surface that is continued linearly from some of its samples.
    fn continued(&self, group: &[(usize, f32)], pos: DVec2) -> f32 {
        let width = self.surfaces.size[0];
        let mut sum = [0.0, 0.0];
        for &(index, weight) in group {
            let centre = DVec2::new((index % width) as f64, (index / width) as f64) + 0.5;
            let offset = (pos - centre).as_vec2();
            let [along_x, along_y] = self.surfaces.slope(index);
            let here = self.surfaces.disparity[index] + along_x * offset.x + along_y * offset.y;
            // Weights of nothing still name the surface.
            let weight = weight.max(f32::MIN_POSITIVE);
            sum = [sum[0] + weight * here, sum[1] + weight];
        }
        sum[0] / sum[1]
    }

    fn linked(&self, a: usize, b: usize) -> bool {
        let (first, second) = (a.min(b), a.max(b));
        let beside = second == first + 1 && self.surfaces.linked_on(first, 0);
        beside || (second == first + self.surfaces.size[0] && self.surfaces.linked_on(first, 1))
    }

    /// Where a sample's centre lies in the picture, px.
    fn centre_of(&self, index: usize) -> DVec2 {
        let width = self.surfaces.size[0];
        (DVec2::new((index % width) as f64, (index / width) as f64) + 0.5) / self.scale
    }

    /// The picture's colour at a place, in sRGB: the mean of the four pixels around it.
    fn colour(&self, pos_in_picture: DVec2) -> [f32; 3] {
        let (width, height) = (self.picture.width, self.picture.height);
        let at = |value: f64, count: usize| (value.max(0.0) as usize).min(count - 1);
        let (left, right) = (
            at(pos_in_picture.x - 0.5, width),
            at(pos_in_picture.x, width),
        );
        let (above, below) = (
            at(pos_in_picture.y - 0.5, height),
            at(pos_in_picture.y, height),
        );
        let mut sum = [0.0; 3];
        for (x, y) in [(left, above), (right, above), (left, below), (right, below)] {
            let pixel = self.picture.rgb[y * width + x];
            for (sum, value) in sum.iter_mut().zip(pixel) {
                *sum += 0.25 * srgb_from_linear(value);
            }
        }
        sum
    }
}

/// How much a colour speaks for another's surface, 1 where they are equal.
fn likeness(a: [f32; 3], b: [f32; 3]) -> f32 {
    let apart2: f32 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    (-0.5 * apart2 / (COLOUR_SIGMA * COLOUR_SIGMA)).exp()
}

/// Weights of the four samples around a place `t` from the first to the last.
fn bilinear(t: DVec2) -> [f32; 4] {
    let (x, y) = (t.x as f32, t.y as f32);
    [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y]
}

/// The cubic B-spline of coefficients at a place, px, its border continued; not below 0.
fn spline_at(coefficients: &[[f32; 4]], size: [usize; 2], pos: DVec2) -> [f32; 4] {
    let corner = pos - 0.5;
    let base = corner.floor();
    let [wx, wy] = [corner.x - base.x, corner.y - base.y].map(cubic);
    let at = |base: f64, step: usize, count: usize| {
        (base as i64 + step as i64 - 1).clamp(0, count as i64 - 1) as usize
    };
    let mut sum = [0.0f32; 4];
    for (dy, wy) in wy.into_iter().enumerate() {
        for (dx, wx) in wx.into_iter().enumerate() {
            let index = at(base.y, dy, size[1]) * size[0] + at(base.x, dx, size[0]);
            for (sum, value) in sum.iter_mut().zip(coefficients[index]) {
                *sum += wx * wy * value;
            }
        }
    }
    sum.map(|value| value.max(0.0))
}

/// Weights of the cubic B-spline at `t` from 0 to 1.
fn cubic(t: f64) -> [f32; 4] {
    let (t, s) = (t as f32, 1.0 - t as f32);
    [
        s * s * s / 6.0,
        (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
        (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
        t * t * t / 6.0,
    ]
}

#[cfg(test)]
mod tests {
    use resample_core::LookAt;

    use super::*;
    use resample_io::Stored;

    fn camera(size: [u32; 2]) -> Camera {
        let pose = LookAt {
            position: [0.0; 3].into(),
            target: [0.0, 0.0, 1.0].into(),
            up: [0.0, -1.0, 0.0].into(),
        };
        Camera::perspective(&pose, 0.9, size).expect("a good camera")
    }

    /// The scene at a place: a tilted wall and, left of the line x = -0.1 + 0.1 y, a nearer one. Camera z and
    /// colour.
    fn scene(on_plane: DVec2) -> (f64, [f32; 3]) {
        let is_near = on_plane.x < -0.1 + 0.1 * on_plane.y;
        if is_near {
            (2.0 / (1.0 + 0.3 * on_plane.y), [0.8, 0.3, 0.1])
        } else {
            (
                6.0 / (1.0 - 0.4 * on_plane.x + 0.2 * on_plane.y),
                [0.1, 0.2, 0.5],
            )
        }
    }

    fn on_plane(camera: &Camera, index: usize) -> DVec2 {
        let width = camera.width as usize;
        let pixel = DVec2::new((index % width) as f64, (index / width) as f64) + 0.5;
        (pixel - DVec2::new(camera.cx, camera.cy)) / DVec2::new(camera.fx, camera.fy)
    }

    fn pixels(camera: &Camera) -> usize {
        camera.width as usize * camera.height as usize
    }

    /// The scene's picture; `place` gives the ray on the plane z = 1 of a position of the picture.
    fn picture(camera: &Camera, place: impl Fn(DVec2) -> DVec2) -> Picture {
        Picture {
            width: camera.width as usize,
            height: camera.height as usize,
            rgb: (0..pixels(camera))
                .map(|index| scene(place(on_plane(camera, index))).1)
                .collect(),
            coverage: None,
        }
    }

    fn plane(camera: &Camera, place: impl Fn(DVec2) -> DVec2) -> Plane {
        Plane {
            width: camera.width as usize,
            height: camera.height as usize,
            values: (0..pixels(camera))
                .map(|index| scene(place(on_plane(camera, index))).0 as f32)
                .collect(),
            stored: Stored::Float,
        }
    }

    /// Parts of the pixels whose distance is off by more than 1 %, and the largest error of the others.
    fn wrong(found: &[f32], camera: &Camera) -> (f64, f64) {
        let (mut count, mut worst) = (0, 0.0f64);
        for (index, &z) in found.iter().enumerate() {
            let expected = scene(on_plane(camera, index)).0;
            let error = (f64::from(z) / expected - 1.0).abs();
            if error <= 0.01 {
                worst = worst.max(error);
            } else {
                count += 1;
            }
        }
        (f64::from(count) / found.len() as f64, worst)
    }

    #[test]
    fn depth_of_another_size_has_its_edges_where_the_colours_are() {
        let large = camera([320, 240]);
        let photo = picture(&large, |at| at);
        for size in [[160, 120], [80, 60], [40, 30], [64, 48], [640, 480]] {
            let small = large.resized(size[0], size[1]).expect("a size");
            let lens = Lens {
                camera: &large,
                model: Model::Pinhole,
                size: [320, 240],
            };
            let found = distances(&plane(&small, |at| at), &photo, &lens);
            let (wrong, worst) = wrong(&found, &large);
            // The edge crosses 240 rows: less than a pixel of each may be on the wrong side.
            assert!(
                wrong < 0.5 / 320.0,
                "{size:?}: {wrong} of the pixels are on the other wall"
            );
            // Where the edge meets the border, a sample of the coarsest grid has no neighbour of its own along one axis, and
            // the wall's slope there is unknown.
            let allowed = if size == [40, 30] { 5e-3 } else { 1e-5 };
            assert!(worst < allowed, "{size:?}: planes are off by {worst}");
        }
    }

    #[test]
    fn without_a_difference_in_colour_the_nearest_sample_decides() {
        let large = camera([320, 240]);
        let mut photo = picture(&large, |at| at);
        photo.rgb.fill([0.5; 3]);
        let small = large.resized(80, 60).expect("a size");
        let lens = Lens {
            camera: &large,
            model: Model::Pinhole,
            size: [320, 240],
        };
        let found = distances(&plane(&small, |at| at), &photo, &lens);
        let (wrong, worst) = wrong(&found, &large);
        assert!(
            wrong < 2.0 / 320.0,
            "at most half a sample of four pixels: {wrong}"
        );
        assert!(worst < 1e-5, "no distance between the two walls: {worst}");
    }

    /// The ray that a lens puts at `distorted`, by fixed-point iteration.
    fn undistort(distortion: &Distortion, distorted: DVec2) -> DVec2 {
        let mut at = distorted;
        for _ in 0..100 {
            let put = distortion.distort(at).expect("within reach");
            at += distorted - put;
        }
        at
    }

    #[test]
    fn a_distorted_picture_and_its_depth_become_those_of_the_pinhole() {
        let taken = camera([320, 240]);
        let radial = [-0.12, 0.03, 0.0, 0.0, 0.0, 0.0];
        let distortion = Distortion::new(radial, [0.002, -0.001]).expect("distorted");
        let place = |at: DVec2| undistort(&distortion, at);
        let photo = picture(&taken, place);
        let lens = Lens {
            camera: &taken,
            model: Model::Distorted(&distortion),
            size: [320, 240],
        };
        let found = distances(&plane(&taken, place), &photo, &lens);
        let (wrong, worst) = wrong(&found, &taken);
        assert!(wrong < 1.0 / 320.0, "{wrong} of the pixels");
        assert!(
            worst < 2e-4,
            "planes bend by {worst} in a cell of a curved lens"
        );
        let straight = seen(&photo, &lens);
        let truth = picture(&taken, |at| at);
        let off = |index: &usize| {
            let apart = |c: usize| (straight.rgb[*index][c] - truth.rgb[*index][c]).abs();
            (0..3).any(|c| apart(c) > 1e-3)
        };
        // The picture has one edge; the spline is at most four pixels wide there.
        let changed = (0..pixels(&taken)).filter(off).count();
        assert!(changed < 240 * 14, "{changed} pixels differ");
    }
}
