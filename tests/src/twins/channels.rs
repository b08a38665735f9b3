//! The reference for scenes in image sheets: channels, labels, masks and the ramp over the gradient, in f64.
//!
//! Takes what the renderer takes, gives pixels with the most by which a channel may differ. A ray is followed plane by plane
//! as in `sheet_reference.rs`; at each sample every reading that the renderer may take for the true one (the table's
//! rounding, a position on the other side of a face) is tried, and what it changes is added to the slack.
//! Limits: extinction; a fixed number of sub-pixels; no shading.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::Camera;
use volsplat::{Channel, Look, RenderOptions, Scene, Subpixels};

use crate::choices::field;
use crate::twins::clip::keeps_with;
use crate::twins::field::extinction;
use crate::twins::rays::{Ray, RaySource};
use crate::twins::sheets::SheetPixel;
use crate::twins::trilinear::{gradient, last, nearest, scalar, weighted};

/// Scalars in the renderer's table.
const TABLE_ENTRIES: f64 = 4096.0;

/// Error of a position, voxels: a few roundings of numbers up to 32 in f32 (4e-6 each at most).
const POSITION_ERROR: f64 = 2e-5;

/// Colour times extinction, and extinction.
type Mixed = ([f64; 3], f64);

/// Values shared by all rays.
struct Setup<'a> {
    scene: &'a Scene<'a>,
    options: &'a RenderOptions,
    camera: &'a Camera,
    rays: RaySource,
    thickness: f64,
    unit: f64,
    subpixels: u32,
}

/// Renders a picture, row by row; `depth` is not filled in.
///
/// # Panics
/// Where the options ask for automatic sub-pixels.
pub fn render(scene: &Scene, camera: &Camera, options: &RenderOptions) -> Vec<SheetPixel> {
    let Subpixels::Fixed(subpixels) = options.subpixels else {
        panic!("the reference wants a fixed number of sub-pixels");
    };
    let grid = scene.grid();
    let smallest = DVec3::from(grid.spacing()).min_element();
    let setup = Setup {
        scene,
        options,
        camera,
        rays: RaySource::new(camera, &grid.world_from_index),
        thickness: field(options).slab_voxels * smallest,
        unit: options.opacity_unit.unwrap_or(smallest),
        subpixels,
    };
    let (width, height) = (camera.width as usize, camera.height as usize);
    (0..width * height)
        .into_par_iter()
        .map(|i| setup.pixel([i % width, i / width]))
        .collect()
}

impl Setup<'_> {
    fn pixel(&self, [x, y]: [usize; 2]) -> SheetPixel {
        let n = self.subpixels;
        let mut sum = SheetPixel::default();
        for part in 0..n * n {
            let inside =
                DVec2::new(f64::from(part % n) + 0.5, f64::from(part / n) + 0.5) / f64::from(n);
            let add = self.ray(&self.rays.ray(DVec2::new(x as f64, y as f64) + inside));
            let share = 1.0 / f64::from(n * n);
            for (sum, add) in sum.rgb.iter_mut().zip(add.rgb) {
                *sum += share * add;
            }
            sum.transmittance += share * add.transmittance;
            sum.slack += share * add.slack;
        }
        sum
    }

    fn ray(&self, ray: &Ray) -> SheetPixel {
        let mut sum = SheetPixel {
            transmittance: 1.0,
            ..SheetPixel::default()
        };
        // The most that may be left where the renderer's samples are all as faint as they may be.
        let mut most_left = 1.0;
        for k in self.planes(ray) {
            let at = ray.origin + (k + 0.5) * self.thickness * ray.direction;
            let composited = |(rgb, strength): Mixed| {
                let opacity = -(-strength * self.thickness * ray.world_per_z / self.unit).exp_m1();
                let share = if strength > 0.0 {
                    opacity / strength
                } else {
                    0.0
                };
                (rgb.map(|c| share * c), opacity)
            };
            let (rgb, opacity) =
                composited(self.mixed(at, 0.0, &vec![0.0; self.scene.channels.len() + 1]));
            let (mut change, mut faintest) = (0.0f64, opacity);
            for (other_rgb, other) in self.candidates(at).into_iter().map(composited) {
                let colour = rgb
                    .iter()
                    .zip(other_rgb)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                // What is behind shows through by as much more or less.
                change = change.max(colour + (opacity - other).abs());
                faintest = faintest.min(other);
            }
            sum.slack += most_left * change;
            most_left *= 1.0 - faintest;
            let before = sum.transmittance;
            for (sum, c) in sum.rgb.iter_mut().zip(rgb) {
                *sum += before * c;
            }
            sum.transmittance -= before * opacity;
        }
        sum
    }

    /// The numbers of the planes, from the near plane on, on which the ray is in or next to the volume.
    fn planes(&self, ray: &Ray) -> impl Iterator<Item = f64> + use<> {
        let (mut first, mut end) = (self.camera.near, f64::INFINITY);
        for axis in 0..3 {
            let ends = [-0.01, last(self.scene.grid())[axis] + 0.01]
                .map(|side| (side - ray.origin[axis]) / ray.direction[axis]);
            first = first.max(ends[0].min(ends[1]));
            end = end.min(ends[0].max(ends[1]));
        }
        let first_plane = (first / self.thickness - 0.5).ceil();
        let last_plane = (end / self.thickness - 0.5).floor();
        let count = if last_plane >= first_plane {
            (last_plane - first_plane) as u64 + 1
        } else {
            0
        };
        (0..count).map(move |i| first_plane + i as f64)
    }

    /// The values that the renderer may use for a sample: scalars within half a step of their tables, the ramp within the error of a
    /// gradient, either side of what a position may be taken for.
    fn candidates(&self, at: DVec3) -> Vec<Mixed> {
        let count = self.scene.channels.len() + 1;
        let errors = (0..1usize << count).map(|signs| {
            (0..count)
                .map(|i| if signs >> i & 1 == 0 { 1.0 } else { -1.0 })
                .collect::<Vec<f64>>()
        });
        let mut found: Vec<Mixed> = errors.map(|signs| self.mixed(at, 0.0, &signs)).collect();
        let still = vec![0.0; count];
        found.extend([POSITION_ERROR, -POSITION_ERROR].map(|wider| self.mixed(at, wider, &still)));
        for signs in 0..8 {
            let by = |axis: usize| {
                if signs >> axis & 1 == 0 {
                    POSITION_ERROR
                } else {
                    -POSITION_ERROR
                }
            };
            found.push(self.mixed(at + DVec3::new(by(0), by(1), by(2)), 0.0, &still));
        }
        found
    }

    /// The sum of the channels at a grid position; the volume and the clip are `wider` on all sides, and the scalars
    /// and, last, the ramp are off by their errors times `signs`.
    fn mixed(&self, at: DVec3, wider: f64, signs: &[f64]) -> Mixed {
        let grid = self.scene.grid();
        let outside = at.cmplt(DVec3::splat(-wider)).any() || at.cmpgt(last(grid) + wider).any();
        if outside || !keeps_with(&self.options.clip, &grid.world_from_index, at, wider) {
            return ([0.0; 3], 0.0);
        }
        let at = at.clamp(DVec3::ZERO, last(grid));
        if self.scene.mask.is_some_and(|mask| nearest(mask, at) == 0.0) {
            return ([0.0; 3], 0.0);
        }
        let mut sum = ([0.0; 3], 0.0);
        for (channel, sign) in self.scene.channels.iter().zip(signs) {
            let (rgb, strength) = self.channel(channel, at, [*sign, signs[signs.len() - 1]]);
            for (sum, c) in sum.0.iter_mut().zip(rgb) {
                *sum += strength * f64::from(c);
            }
            sum.1 += strength;
        }
        for (sum, factor) in sum.0.iter_mut().zip(self.tint(at, signs)) {
            *sum *= factor;
        }
        sum
    }

    /// The sum of the tints at a grid position; 1 where the scene has none.
    fn tint(&self, at: DVec3, signs: &[f64]) -> [f64; 3] {
        let weights = self
            .scene
            .channels
            .iter()
            .find_map(|channel| match channel.look {
                Look::Transfer(_) => Some(channel.volume),
                Look::Labels(_) | Look::Tint(_) => None,
            });
        let tints = self
            .scene
            .channels
            .iter()
            .zip(signs)
            .filter_map(|(channel, sign)| {
                let Look::Tint(transfer) = channel.look else {
                    return None;
                };
                let value = match weights {
                    Some(weights) => weighted(channel.volume, weights, at),
                    None => scalar(channel.volume, at),
                };
                let value = value + sign * scalar_error(channel, None);
                Some(transfer.sample(value).0.map(f64::from))
            });
        tints
            .reduce(|a, b| std::array::from_fn(|k| a[k] + b[k]))
            .unwrap_or([1.0; 3])
    }

    fn channel(&self, channel: &Channel, at: DVec3, signs: [f64; 2]) -> ([f32; 3], f64) {
        match channel.look {
            Look::Labels(labels) => {
                let look = labels.look(nearest(channel.volume, at) as i64);
                (look.rgb, extinction(look.opacity))
            }
            Look::Tint(_) => ([0.0; 3], 0.0),
            Look::Transfer(transfer) => {
                let error = scalar_error(channel, transfer.visible_range());
                let (rgb, opacity) = transfer.sample(scalar(channel.volume, at) + signs[0] * error);
                (rgb, self.ramp(channel, at, signs[1]) * extinction(opacity))
            }
        }
    }

    /// The factor of the extinction that follows the gradient: the largest that it may be for a `sign` of 1, the least for -1, and its own for 0.
    fn ramp(&self, channel: &Channel, at: DVec3, sign: f64) -> f64 {
        let Some(curve) = &self.options.gradient_opacity else {
            return 1.0;
        };
        let (least, most) = channel.volume.value_range();
        // Differences between neighbouring gradients are at most twice the range over the spacing.
        let steepest = (most - least) / DVec3::from(channel.volume.spacing()).min_element();
        let error = 6.0 * POSITION_ERROR * steepest;
        let length = gradient(channel.volume, at).length();
        if sign == 0.0 {
            return curve.at(length);
        }
        let knots = curve.knots.iter().map(|knot| knot[0]);
        let inside = knots.filter(|knot| (knot - length).abs() <= error);
        let lengths = inside.chain([length - error, length, length + error]);
        let factors = lengths.map(|length| sign * curve.at(length));
        sign * factors.fold(f64::NEG_INFINITY, f64::max)
    }
}

/// The largest error of the renderer's scalar: half a step of its table over the visible range, and the error of the position.
fn scalar_error(channel: &Channel, shown: Option<(f64, f64)>) -> f64 {
    let (low, high) = channel.volume.value_range();
    let shown = shown.unwrap_or((low, high));
    let span = (shown.1.min(high) - shown.0.max(low)).max(0.0);
    0.5 * span / (TABLE_ENTRIES - 1.0) + (3.0 * POSITION_ERROR + 1e-6) * (high - low)
}
