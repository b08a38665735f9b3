//! How far apart the views of a pair show things, and how far apart is comfortable.
//!
//! The disparity of a thing is its place in the right view less that in the left one, in per cent of the width: negative before the
//! screen, where eyes cross, positive behind it. Limits: a line of views along the camera's x axis, as [`Layout`] has it.

use glam::DVec2;
use resample_core::{Camera, Image};

use super::{Layout, Places};

/// Most samples that depths are taken from; a thousandth of a rank is as good as any.
const SAMPLES: usize = 100_000;

/// One of so many samples at each end may lie beyond the nearest and the farthest depth: edges that are off.
const BEYOND: usize = 200;

/// Depths that a camera sees, camera z, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenDepths {
    /// Nearer are 0.5 % of the samples.
    pub nearest: f64,
    /// Nearer are half of the samples.
    pub median: f64,
    /// Farther are 0.5 % of the samples.
    pub farthest: f64,
}

/// Every how many samples of a reference's camera one counts for the depths that are seen.
pub fn depth_step(reference: &Camera) -> usize {
    (reference.width as usize * reference.height as usize / SAMPLES).max(1)
}

/// The depths at which `camera` sees samples of a reference, given by number and camera z; `None` where all are behind it.
pub fn seen_depths(
    reference: &Camera,
    samples: impl Iterator<Item = (usize, f32)>,
    camera: &Camera,
) -> Option<SeenDepths> {
    let width = reference.width as usize;
    let camera_from_reference = camera.camera_from_world * reference.camera_from_world.inverse();
    let known = samples.filter(|(_, z)| !z.is_nan());
    let seen = known.map(|(index, z)| {
        let pos_in_screen = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
        let (origin, direction) = reference.ray_in_camera(pos_in_screen);
        camera_from_reference
            .transform_point3(origin + f64::from(z) * direction)
            .z
    });
    let mut depths: Vec<f64> = seen.filter(|&z| z > 0.0).collect();
    let beyond = depths.len() / BEYOND;
    let last = depths.len().checked_sub(1)?;
    let mut at = |rank: usize| *depths.select_nth_unstable_by(rank, f64::total_cmp).1;
    Some(SeenDepths {
        nearest: at(beyond),
        median: at(last.div_ceil(2)),
        farthest: at(last - beyond),
    })
}

/// The disparity of a thing at depth `z` in views `baseline` apart that agree at `convergence`, per cent of the width of `view`.
pub fn disparity_percent(baseline: f64, view: &Camera, convergence: f64, z: f64) -> f64 {
    100.0 * baseline * view.fx / f64::from(view.width) * (1.0 / convergence - 1.0 / z)
}

/// The largest baseline up to `baseline` at which things at `depths` have at most `limit` per cent of disparity.
pub fn comfortable_baseline(
    baseline: f64,
    view: &Camera,
    convergence: f64,
    depths: [f64; 2],
    limit: f64,
) -> f64 {
    let disparity = |z| disparity_percent(baseline, view, convergence, z).abs();
    let most = depths.into_iter().map(disparity).fold(0.0, f64::max);
    baseline * (limit / most).min(1.0)
}

impl Layout {
    /// The distance of the eyes of a pair, world units; `None` of all else.
    pub fn baseline(&self) -> Option<f64> {
        match *self {
            Self::Stereo(baseline, _)
            | Self::Anaglyph(baseline, _)
            | Self::Hemispheres(baseline, _) => Some(baseline),
            Self::Single | Self::ColourAndDepth(_) | Self::Quilt(..) | Self::Equirectangular(_) => {
                None
            }
        }
    }

    /// The same layout of a pair whose eyes are `baseline` apart.
    pub fn with_baseline(self, baseline: f64) -> Self {
        match self {
            Self::Stereo(_, places) => Self::Stereo(baseline, places),
            Self::Anaglyph(_, kind) => Self::Anaglyph(baseline, kind),
            Self::Hemispheres(_, half) => Self::Hemispheres(baseline, half),
            other => other,
        }
    }

    /// Blackens the outer `percent` of the width of the two views of a pair, in the order of [`Layout::views`]: the frame then floats
    /// before the screen, and things that stand there are not cut off by what lies behind them.
    pub fn float_window(&self, views: &mut [Image], percent: f64) {
        let [first, second] = views else { return };
        let (left, right) = match self {
            Self::Stereo(_, Places::CrossEye) => (second, first),
            _ => (first, second),
        };
        let bar = |view: &Image| {
            let width_px = 0.01 * percent * view.width as f64;
            (0..view.width)
                .take_while(|&x| (x as f64 + 0.5) < width_px)
                .count()
        };
        let (bar_left, width) = (bar(left), left.width);
        for row in left.rgba.chunks_mut(width) {
            row[..bar_left].fill([0.0, 0.0, 0.0, 1.0]);
        }
        let (bar_right, width) = (bar(right), right.width);
        for row in right.rgba.chunks_mut(width) {
            row[width - bar_right..].fill([0.0, 0.0, 0.0, 1.0]);
        }
    }
}
