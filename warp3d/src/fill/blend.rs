//! Several references become one picture.
//!
//! Takes the layers of the references, gives one. At each pixel the references that cover it whole and resolve it well
//! say which surface is in front. Those that show this surface are blended, weighted by how near their direction is to the
//! new one, how well they resolve it, and how whole they cover the pixel. A reference that shows a farther surface
//! counts only as far as the others leave the pixel open.
//!
//! Source: Buehler and others, "Unstructured Lumigraph Rendering" (2001), section 3, for direction and resolution.

use glam::{DAffine3, DVec2, DVec3};
use rayon::prelude::*;
use resample_core::narrow::single;
use resample_core::{Camera, Projection};

use crate::view::layer::{Layer, Mix};

/// Depths within this part of the nearest one are one surface: several tolerances of quantised depth.
const AGREEMENT: f32 = 0.03;

/// Coverage from which on a layer shows all of a pixel, up to the rounding of its sub-pixels.
const WHOLE: f32 = 0.98;

/// Coverage from which on a surface is seen at all in a pixel that no layer shows whole.
const SEEN: f32 = 0.5;

/// A layer that resolves less than this part of the finest one says nothing about which surface is in front: its edges
/// lie where its coarse samples have them. Measured on ray-traced scenes: 0.7 and 0.85 alike, 0 loses 2 dB at edges.
const FINE: f32 = 0.7;

/// Power of coverage in a layer's weight: a layer that shows half of a pixel lacks the surface behind, which another has
/// mixed in, and beside a hole its samples are mixed with what hides the rest. Measured: 16 loses 0.2 dB where two see
/// alike, 4 loses 1 dB at edges, and 64 a tenth on photographs.
const COVERAGE_POWER: i32 = 32;

/// Power of the main surface's share in a layer's weight. Measured: 8 loses 2 dB at edges, 1 half of one.
const PURITY_POWER: i32 = 4;

/// Width of the band in which a reference fades out towards the border of its frame, px of the reference. A guess. The
/// frame cuts surfaces off, so that beside the cut a reference shows a background that the whole surface would hide.
const FRAME_PX: f64 = 8.0;

/// Power, at edges, of the weight that falls with the squared sine of the angle between directions. Measured: with 1 a
/// fourth and a fifth reference lose 0.6 dB, with 2 all lose 0.2.
const EDGE_POWER: f64 = 1.5;

/// Squared sine of the angle to the farthest reference, of which this part is as good as no angle.
const ANGLE_FLOOR: f64 = 0.01;

/// Blends `layers`, one per camera of the `references`.
pub(crate) fn blend(layers: Vec<Layer>, references: &[Camera], target: &Camera) -> Option<Layer> {
    if layers.len() < 2 {
        return layers.into_iter().next();
    }
    let directions = Directions::new(references, target);
    let width = target.width as usize;
    let mut out = Layer::empty(layers[0].rgba.len());
    out.mixes = vec![Mix::ONE; layers[0].rgba.len()];
    let shares = out
        .resolution
        .par_chunks_mut(width)
        .zip(out.mixes.par_chunks_mut(width));
    let colours = out
        .rgba
        .par_chunks_mut(width)
        .zip(out.depth.par_chunks_mut(width));
    colours
        .zip(shares)
        .enumerate()
        .for_each(|(y, ((rgba, depth), (resolution, mixes)))| {
            let mut weights = vec![0.0; layers.len()];
            for x in 0..rgba.len() {
                let at = y * width + x;
                let seen = Seen {
                    layers: &layers,
                    at,
                };
                weights.fill(0.0);
                let Some(nearest) = seen.nearest() else {
                    continue;
                };
                seen.start(&mut weights);
                let power = match seen.is_edge() {
                    true => EDGE_POWER,
                    false => 1.0,
                };
                directions.weigh([x, y], (nearest, power), &mut weights);
                let front = seen.front(nearest, &weights);
                seen.weigh(front, &mut weights);
                if let Some(pixel) = Blended::new(&layers, at, &weights) {
                    (rgba[x], depth[x]) = (pixel.rgba, pixel.depth);
                    (resolution[x], mixes[x]) = (pixel.resolution, pixel.mix);
                }
            }
        });
    Some(out)
}

/// One pixel, as each layer shows it.
struct Seen<'a> {
    layers: &'a [Layer],
    at: usize,
}

impl Seen<'_> {
    /// Layers that cover at least this part of the pixel.
    fn covering(&self, least: f32) -> impl Iterator<Item = &Layer> {
        let at = self.at;
        self.layers.iter().filter(move |l| l.rgba[at][3] >= least)
    }

    /// Layers that cover the pixel whole, and resolve it well.
    fn sound(&self) -> impl Iterator<Item = &Layer> {
        let resolution = |l: &Layer| l.resolution[self.at];
        let finest = self.covering(WHOLE).map(resolution).fold(0.0, f32::max);
        self.covering(WHOLE)
            .filter(move |l| resolution(l) >= FINE * finest)
    }

    /// Camera z of the nearest surface, world units; `None` where no layer shows one.
    fn nearest(&self) -> Option<f32> {
        let front = |l: &Layer| l.front(self.at);
        (self.sound().map(front).reduce(f32::min))
            .or_else(|| self.covering(SEEN).map(front).reduce(f32::min))
            .or_else(|| self.covering(f32::MIN_POSITIVE).map(front).reduce(f32::min))
    }

    /// Returns true if a layer shows several surfaces here.
    fn is_edge(&self) -> bool {
        self.layers
            .iter()
            .any(|l| l.rgba[self.at][3] >= SEEN && l.purity(self.at) < WHOLE)
    }

    /// The weight of each layer before it is known which surface is in front: how well it resolves the pixel.
    fn start(&self, weights: &mut [f32]) {
        for (weight, layer) in weights.iter_mut().zip(self.layers) {
            *weight = layer.resolution[self.at].max(1e-3);
        }
    }

    /// Returns true if a layer shows a surface that is no farther than `z`.
    fn shows(&self, layer: &Layer, z: f32) -> bool {
        layer.front(self.at) <= z * (1.0 + AGREEMENT)
    }

    /// Camera z of the surface in front: `nearest`, unless it is seen at rims alone and the layers without it weigh more.
    fn front(&self, nearest: f32, votes: &[f32]) -> f32 {
        let whole = |l: &Layer| l.rgba[self.at][3] >= WHOLE;
        let is_pure = |l: &Layer| whole(l) && self.shows(l, nearest) && l.purity(self.at) >= WHOLE;
        let vote = |yes: bool| -> f32 {
            let votes = self.layers.iter().zip(votes);
            let voters = votes.filter(|(l, _)| l.rgba[self.at][3] >= SEEN);
            voters
                .filter(|(l, _)| self.shows(l, nearest) == yes)
                .map(|(_, w)| w)
                .sum()
        };
        // A rim may be off by a part of a pixel.
        let main = self.sound().map(|l| l.depth[self.at]).reduce(f32::min);
        match main {
            Some(main) if !self.layers.iter().any(is_pure) && vote(true) < vote(false) => main,
            _ => nearest,
        }
    }

    /// Multiplies the weights of layers that show the surface in front by how much of the pixel they cover; all others become 0.
    fn weigh(&self, front: f32, weights: &mut [f32]) {
        let coverages = self.layers.iter().map(|l| l.rgba[self.at][3]);
        let largest = coverages.fold(f32::MIN_POSITIVE, f32::max);
        for (weight, layer) in weights.iter_mut().zip(self.layers) {
            let coverage = layer.rgba[self.at][3];
            let agrees = coverage < SEEN || self.shows(layer, front);
            *weight *= match agrees {
                // A pixel of one surface is placed better than a mixed one.
                true => {
                    (coverage / largest).powi(COVERAGE_POWER)
                        * layer.purity(self.at).powi(PURITY_POWER)
                }
                false => 0.0,
            };
        }
    }
}

/// A pixel of the blended picture.
struct Blended {
    rgba: [f32; 4],
    depth: f32,
    resolution: f32,
    mix: Mix,
}

impl Blended {
    fn new(layers: &[Layer], at: usize, weights: &[f32]) -> Option<Self> {
        let total: f32 = weights.iter().sum();
        let blended = || layers.iter().zip(weights).filter(|(_, w)| **w > 0.0);
        let (best, _) = blended().max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let (mut open, mut straight) = (1.0, [0.0; 3]);
        let (mut resolution, mut purity) = (0.0, 0.0);
        for (layer, weight) in blended() {
            let (pixel, share) = (layer.rgba[at], weight / total);
            straight = std::array::from_fn(|c| straight[c] + share * pixel[c] / pixel[3]);
            open *= 1.0 - pixel[3].min(1.0);
            resolution += share * layer.resolution[at];
            purity += share * layer.purity(at);
        }
        // Where they leave the pixel open, the surface behind shows.
        let behind = (layers.iter().zip(weights))
            .filter(|(layer, w)| **w <= 0.0 && layer.rgba[at][3] > 0.0)
            .min_by(|(a, _), (b, _)| a.depth[at].total_cmp(&b.depth[at]))
            .map_or([0.0; 4], |(layer, _)| layer.rgba[at]);
        let [r, g, b] = straight.map(|v| v * (1.0 - open));
        let front = [r, g, b, 1.0 - open];
        Some(Self {
            rgba: std::array::from_fn(|c| front[c] + open * behind[c]),
            depth: best.depth[at],
            resolution,
            mix: Mix {
                purity,
                front: best.front(at),
            },
        })
    }
}

/// From where references and the target look at a place.
struct Directions<'a> {
    target: &'a Camera,
    world_from_target: DAffine3,
    references: &'a [Camera],
}

impl<'a> Directions<'a> {
    fn new(references: &'a [Camera], target: &'a Camera) -> Self {
        Self {
            target,
            world_from_target: target.camera_from_world.inverse(),
            references,
        }
    }

    /// Multiplies `weights` by how near each reference's direction to the place at depth `z` of a pixel is to the target's,
    /// the nearest one's 1, and by how far inside its frame the place lies.
    fn weigh(&self, [x, y]: [usize; 2], (z, power): (f32, f64), weights: &mut [f32]) {
        let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let (origin, ray) = self.target.ray_in_camera(pixel);
        // An infinite depth is far enough that all eyes look alike.
        let place = origin + f64::from(z.min(f32::MAX)) * ray;
        let place = self.world_from_target.transform_point3(place);
        let along = (self.world_from_target.transform_vector3(ray)).normalize_or_zero();
        let sine2 = |camera: &Camera| along.cross(direction(camera, place)).length_squared();
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        for camera in self.references {
            let sine2 = sine2(camera);
            (least, most) = (least.min(sine2), most.max(sine2));
        }
        let floor = (ANGLE_FLOOR * most).max(f64::MIN_POSITIVE);
        for (weight, camera) in weights.iter_mut().zip(self.references) {
            let near = (least + floor) / (sine2(camera) + floor);
            *weight *= single(near.powf(power) * inside(camera, place));
        }
    }
}

/// How far a place lies inside the frame of `camera`: 1 from [`FRAME_PX`] on, nearly 0 at the border and outside.
fn inside(camera: &Camera, place: DVec3) -> f64 {
    // Outside counts where nothing else does.
    const OUTSIDE: f64 = 1e-6;
    let pos_in_camera = camera.camera_from_world.transform_point3(place);
    let at = camera.screen_from_camera(pos_in_camera);
    let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    let to_border_px = at.min(size - at).min_element();
    // NaN, a place behind the eye, is outside.
    (to_border_px / FRAME_PX).clamp(OUTSIDE, 1.0).max(OUTSIDE)
}

/// The direction, of length 1, in which `camera` sees a place.
fn direction(camera: &Camera, place: DVec3) -> DVec3 {
    match camera.projection {
        Projection::Perspective => (place - camera.eye_in_world()).normalize_or_zero(),
        Projection::Orthographic => camera.camera_from_world.matrix3.row(2).normalize_or_zero(),
    }
}
