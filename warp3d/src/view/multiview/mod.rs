//! Several views in one picture, and cameras that sway: stereo pairs, anaglyphs, quilts, panoramas.
//!
//! Takes one camera, gives those of the single views, and puts their pictures together. The views of a stereo pair or a
//! quilt stand on a line along the camera's x axis and look in the same direction; a shift of the principal point makes
//! them agree at one distance, the convergence, without turning the cameras, so that no vertical parallax arises. A
//! sheet is described by a camera whose picture has the size of the whole sheet: what draws pictures then needs to know
//! one size only. Source: the order of a quilt's tiles is that of Looking Glass's.

mod comfort;
mod hemisphere;
mod panorama;
#[cfg(test)]
mod tests;

use glam::{DAffine3, DMat3, DVec3};
use resample_core::image::linear_from_srgb;
use resample_core::{Camera, Image, Plane};

use crate::Error;

pub use comfort::{SeenDepths, comfortable_baseline, depth_step, disparity_percent, seen_depths};
pub use hemisphere::Hemisphere;

/// Columns and rows of a quilt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Views beside each other.
    pub columns: u32,
    /// Views above each other.
    pub rows: u32,
}

/// Where the two views of a stereo pair lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Places {
    /// The left eye's on the left
    SideBySide,
    /// The left eye's on the left, each of half its width, as 3-D screens expect it
    HalfSideBySide,
    /// The left eye's above
    TopBottom,
    /// The left eye's above, each of half its height
    HalfTopBottom,
    /// The right eye's on the left, to be seen with crossed eyes
    CrossEye,
}

/// How views lie in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// One view.
    Single,
    /// Left and right eye beside or above each other, this far apart in the world.
    Stereo(f64, Places),
    /// Left and right eye in one red-cyan picture, this far apart in the world.
    Anaglyph(f64, Anaglyph),
    /// A grid of views within a cone of this angle, degrees.
    Quilt(Grid, f64),
    /// The picture on the left, its inverse depth as grey on the right, white at this distance, world units.
    ColourAndDepth(f64),
    /// Left and right eye beside each other, each with the directions ahead, longitude along x and latitude along y.
    Hemispheres(f64, Hemisphere),
    /// All directions, longitude along x and latitude along y, in a picture of this size or of the camera's scale.
    Equirectangular(Option<[u32; 2]>),
}

impl Layout {
    /// The camera that stands for a whole sheet of views from around `camera`.
    pub fn sheet(&self, camera: &Camera) -> Camera {
        let Camera { width, height, .. } = *camera;
        let [width, height] = match *self {
            Self::Single | Self::Anaglyph(..) => [width, height],
            Self::Stereo(_, Places::SideBySide | Places::CrossEye) | Self::ColourAndDepth(_) => {
                [2 * width, height]
            }
            Self::Stereo(_, Places::TopBottom) => [width, 2 * height],
            // Halves are whole pixels.
            Self::Stereo(_, Places::HalfSideBySide) => [width.next_multiple_of(2), height],
            Self::Stereo(_, Places::HalfTopBottom) => [width, height.next_multiple_of(2)],
            Self::Quilt(grid, _) => [width * grid.columns, height * grid.rows],
            Self::Hemispheres(_, half) => [2 * half.side_px, half.side_px],
            Self::Equirectangular(size) => panorama::size(camera, size),
        };
        Camera {
            width,
            height,
            ..*camera
        }
    }

    /// The cameras of the views of a sheet, in the order of [`Layout::put_together`].
    pub fn views(&self, sheet: &Camera, convergence: f64) -> Vec<Camera> {
        let Grid { columns, rows } = self.grid();
        let (width, height) = (sheet.width / columns, sheet.height / rows);
        let mut camera = Camera {
            width,
            height,
            ..*sheet
        };
        match *self {
            Self::Stereo(_, Places::HalfSideBySide) => {
                (camera.fx, camera.cx) = (0.5 * camera.fx, 0.5 * camera.cx);
            }
            Self::Stereo(_, Places::HalfTopBottom) => {
                (camera.fy, camera.cy) = (0.5 * camera.fy, 0.5 * camera.cy);
            }
            Self::Hemispheres(_, half) => camera = half.camera(sheet),
            Self::Equirectangular(_) => return panorama::faces(sheet),
            _ => {}
        }
        let offsets: Vec<f64> = match *self {
            Self::Single | Self::ColourAndDepth(_) | Self::Equirectangular(_) => {
                return vec![camera];
            }
            Self::Stereo(baseline, Places::CrossEye) => vec![0.5 * baseline, -0.5 * baseline],
            Self::Stereo(baseline, _)
            | Self::Anaglyph(baseline, _)
            | Self::Hemispheres(baseline, _) => {
                vec![-0.5 * baseline, 0.5 * baseline]
            }
            Self::Quilt(Grid { columns, rows }, cone_deg) => {
                let half = convergence * (0.5 * cone_deg).to_radians().tan();
                let last = (columns * rows).saturating_sub(1).max(1);
                (0..columns * rows)
                    .map(|view| half * (2.0 * f64::from(view) / f64::from(last) - 1.0))
                    .collect()
            }
        };
        offsets
            .into_iter()
            .map(|offset| beside(&camera, offset, convergence))
            .collect()
    }

    /// One picture of the pictures of the views.
    pub fn put_together(&self, sheet: &Camera, mut views: Vec<Image>) -> Image {
        match self {
            Self::Single => return views.remove(0),
            Self::Anaglyph(_, kind) => return anaglyph(&views, *kind),
            Self::Hemispheres(_, half) => {
                views = views.iter().map(|view| half.rolled(view)).collect();
            }
            Self::Equirectangular(_) => return panorama::put_together(sheet, &views),
            Self::ColourAndDepth(nearest) => {
                let depth = inverse_depth(&views[0], *nearest);
                views.push(depth);
            }
            Self::Stereo(..) | Self::Quilt(..) => {}
        }
        let grid = self.grid();
        let mut whole = blank_like(&views[0], [sheet.width as usize, sheet.height as usize]);
        for (index, view) in (0..).zip(&views) {
            let (column, row) = (index % grid.columns, index / grid.columns);
            // A quilt goes from the bottom left, row by row upwards.
            let row = match self {
                Self::Quilt(..) => grid.rows - 1 - row,
                _ => row,
            };
            paste(
                &mut whole,
                view,
                [column as usize * view.width, row as usize * view.height],
            );
        }
        whole
    }

    /// Returns true if the depth of the convergence decides where the views stand.
    pub fn needs_convergence(&self) -> bool {
        matches!(
            self,
            Self::Stereo(..) | Self::Anaglyph(..) | Self::Quilt(..)
        )
    }

    fn grid(&self) -> Grid {
        let [columns, rows] = match *self {
            Self::Single | Self::Anaglyph(..) | Self::Equirectangular(_) => [1, 1],
            Self::Stereo(_, Places::TopBottom | Places::HalfTopBottom) => [1, 2],
            Self::Stereo(..) | Self::Hemispheres(..) | Self::ColourAndDepth(_) => [2, 1],
            Self::Quilt(grid, _) => return grid,
        };
        Grid { columns, rows }
    }
}

/// Cameras that go once around an ellipse on the sphere around `camera`'s pivot, looking at it.
///
/// The pivot lies straight ahead at `distance`. The cameras go up to `angle_deg` to either side and, because they start
/// at `camera` itself, up to that angle upwards.
///
/// # Errors
/// A camera that lies too far out for its numbers.
pub fn sway(
    camera: &Camera,
    distance: f64,
    angle_deg: f64,
    steps: u32,
) -> Result<Vec<Camera>, Error> {
    let pivot = DVec3::new(0.0, 0.0, distance);
    let at = |step: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(step) / f64::from(steps)).sin_cos();
        let angle_rad = angle_deg.to_radians();
        let turn = DMat3::from_rotation_y(angle_rad * sin)
            * DMat3::from_rotation_x(0.5 * angle_rad * (cos - 1.0));
        // The world turns about the pivot, in the camera's own axes.
        let swayed = DAffine3 {
            matrix3: turn,
            translation: pivot - turn * pivot,
        };
        let camera = Camera {
            camera_from_world: swayed * camera.camera_from_world,
            ..*camera
        };
        camera.validated().map_err(|e| Error::Option(e.to_string()))
    };
    (0..steps).map(at).collect()
}

/// A camera moved along its x axis that sees what is at the distance `convergence` where `camera` sees it.
fn beside(camera: &Camera, offset: f64, convergence: f64) -> Camera {
    let moved =
        DAffine3::from_translation(DVec3::new(-offset, 0.0, 0.0)) * camera.camera_from_world;
    // With convergence at infinity the views are parallel.
    Camera {
        camera_from_world: moved,
        cx: camera.cx + camera.fx * offset / convergence,
        ..*camera
    }
}

/// A grey picture of inverse depth: its sRGB value falls as 1/z from 1 at `nearest`, world units; 0 where nothing is.
fn inverse_depth(view: &Image, nearest: f64) -> Image {
    let mut grey = blank_like(view, [view.width, view.height]);
    let depth = view.depth.as_deref().unwrap_or_default();
    for (pixel, &z) in grey.rgba.iter_mut().zip(depth) {
        let value = linear_from_srgb((nearest as f32 / z).clamp(0.0, 1.0));
        *pixel = [value, value, value, 1.0];
    }
    grey
}

fn blank_like(view: &Image, [width, height]: [usize; 2]) -> Image {
    let mut whole = Image::transparent(width, height);
    whole.depth = view
        .depth
        .as_ref()
        .map(|_| vec![f32::INFINITY; width * height]);
    let blank = |plane: &Plane| Plane {
        name: plane.name.clone(),
        values: vec![0.0; width * height],
    };
    whole.planes = view.planes.iter().map(blank).collect();
    whole
}

fn paste(whole: &mut Image, view: &Image, [left, top]: [usize; 2]) {
    for y in 0..view.height {
        let from = y * view.width..(y + 1) * view.width;
        let start = (top + y) * whole.width + left;
        let to = start..start + view.width;
        whole.rgba[to.clone()].copy_from_slice(&view.rgba[from.clone()]);
        if let (Some(whole), Some(view)) = (&mut whole.depth, &view.depth) {
            whole[to.clone()].copy_from_slice(&view[from.clone()]);
        }
        for (whole, view) in whole.planes.iter_mut().zip(&view.planes) {
            whole.values[to.clone()].copy_from_slice(&view.values[from.clone()]);
        }
    }
}

/// How two views become one red-cyan picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Anaglyph {
    /// Least-squares colours for red-cyan glasses, little ghosting
    Dubois,
    /// Red of the left view, green and blue of the right
    Colour,
    /// Luminance alone
    Grey,
}

/// Dubois' least-squares matrix for red-cyan glasses, linear light: rows are red, green and blue of the anaglyph,
/// columns red, green and blue of the left and then of the right view.
const DUBOIS: [[f32; 6]; 3] = [
    [
        0.456_1,
        0.500_484,
        0.176_381,
        -0.043_470_6,
        -0.087_938_8,
        -0.001_555_29,
    ],
    [
        -0.040_082_2,
        -0.037_824_6,
        -0.015_758_9,
        0.378_476,
        0.733_64,
        -0.018_450_3,
    ],
    [
        -0.015_216_1,
        -0.020_597_1,
        -0.005_468_56,
        -0.072_152_7,
        -0.112_961,
        1.226_4,
    ],
];

/// Luminance of linear Rec. 709 red, green and blue.
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Left and right view in one picture. It has no depth: there are two.
fn anaglyph(views: &[Image], kind: Anaglyph) -> Image {
    let [left, right] = views else {
        return Image::transparent(1, 1);
    };
    let grey = |[r, g, b, _]: [f32; 4]| LUMINANCE[0] * r + LUMINANCE[1] * g + LUMINANCE[2] * b;
    let mut both = Image::transparent(left.width, left.height);
    for ((pixel, &l), &r) in both.rgba.iter_mut().zip(&left.rgba).zip(&right.rgba) {
        let [red, green, blue] = match kind {
            Anaglyph::Colour => [l[0], r[1], r[2]],
            Anaglyph::Grey => [grey(l), grey(r), grey(r)],
            Anaglyph::Dubois => DUBOIS.map(|row| {
                let parts = row[..3].iter().zip(l).chain(row[3..].iter().zip(r));
                parts
                    .map(|(weight, channel)| weight * channel)
                    .sum::<f32>()
                    .max(0.0)
            }),
        };
        *pixel = [red, green, blue, l[3].max(r[3])];
    }
    both
}
