//! Holes: takes the layers of the references, returns one picture.
//!
//! References are blended; `extrapolate` continues colours outside a reference's frame, `holes` fills what no reference shows.

pub(crate) mod extrapolate;
pub(crate) mod holes;

use rayon::prelude::*;
use resample_core::Camera;

use crate::view::layer::Layer;

// Several references become one picture.
//
// At each pixel the references that see the nearest surface are blended, weighted by how close their eyes are to the
// new one, how well they resolve what is seen, and how much of the pixel they cover. A reference that sees a farther
// surface shows only as far as the others leave the pixel open.

/// Depths within this part of the nearest one are one surface: several tolerances of quantised depth.
const AGREEMENT: f32 = 0.03;

/// Blends `layers`, one per camera of the `references`, into the first.
pub(crate) fn blend(layers: Vec<Layer>, references: &[Camera], target: &Camera) -> Option<Layer> {
    if layers.len() < 2 {
        return layers.into_iter().next();
    }
    let baselines = baseline_weights(references, target);
    let mut out = Layer::empty(layers[0].rgba.len());
    out.purity = vec![0.0; layers[0].rgba.len()];
    let shares = out.resolution.par_iter_mut().zip(&mut out.purity);
    let planes = out.rgba.par_iter_mut().zip(&mut out.depth).zip(shares);
    planes
        .enumerate()
        .for_each(|(at, ((rgba, depth), (resolution, purity)))| {
            let seen = |l: &Layer| l.rgba[at][3] >= 0.5;
            let nearest = layers
                .iter()
                .filter(|l| seen(l))
                .map(|l| l.depth[at])
                .fold(f32::INFINITY, f32::min);
            let agrees = |l: &Layer| !seen(l) || l.depth[at] <= nearest * (1.0 + AGREEMENT);
            let weight = |i: usize| {
                let l = &layers[i];
                // The fourth power: a pixel half covered by a rim says little if another reference covers it whole.
                let covered = (l.rgba[at][3] * l.purity(at)).powi(4);
                if agrees(l) {
                    baselines[i] * l.resolution[at].max(1e-3) * covered
                } else {
                    0.0
                }
            };
            let best = (0..layers.len()).max_by(|&i, &j| weight(i).total_cmp(&weight(j)));
            let total: f32 = (0..layers.len()).map(weight).sum();
            if !(total > 0.0) {
                return;
            }
            let mut transmittance = 1.0;
            let mut straight = [0.0; 3];
            for i in (0..layers.len()).filter(|&i| weight(i) > 0.0) {
                let (pixel, share) = (layers[i].rgba[at], weight(i) / total);
                straight = std::array::from_fn(|c| straight[c] + share * pixel[c] / pixel[3]);
                transmittance *= 1.0 - pixel[3].min(1.0);
                *resolution += share * layers[i].resolution[at];
                *purity += share * layers[i].purity(at);
            }
            let alpha = 1.0 - transmittance;
            // Where they leave the pixel open, the surface behind shows.
            let behind = (0..layers.len())
                .filter(|&i| !agrees(&layers[i]))
                .min_by(|&i, &j| layers[i].depth[at].total_cmp(&layers[j].depth[at]))
                .map_or([0.0; 4], |i| layers[i].rgba[at]);
            let front = [
                straight[0] * alpha,
                straight[1] * alpha,
                straight[2] * alpha,
                alpha,
            ];
            *rgba = std::array::from_fn(|c| front[c] + (1.0 - alpha) * behind[c]);
            *depth = if nearest.is_finite() {
                nearest
            } else {
                best.map_or(f32::INFINITY, |i| layers[i].depth[at])
            };
        });
    Some(out)
}

/// Composites `layer` over `hidden`, the background that its views hide.
pub(crate) fn lay_under(layer: &mut Layer, hidden: &Layer) {
    if layer.purity.is_empty() {
        layer.purity = vec![1.0; layer.rgba.len()];
    }
    let shares = layer.resolution.par_iter_mut().zip(&mut layer.purity);
    let planes = layer.rgba.par_iter_mut().zip(&mut layer.depth).zip(shares);
    planes
        .enumerate()
        .for_each(|(at, ((rgba, depth), (resolution, purity)))| {
            let below = hidden.rgba[at];
            let open = 1.0 - rgba[3].clamp(0.0, 1.0);
            let share = open * below[3];
            if !(share > 0.0) {
                return;
            }
            let all = rgba[3] + share;
            *resolution = (rgba[3] * *resolution + share * hidden.resolution[at]) / all;
            *purity = match rgba[3] > 0.0 {
                // The larger share is the main surface.
                true => (*purity * rgba[3]).max(hidden.purity(at) * share) / all,
                false => hidden.purity(at),
            };
            if rgba[3] < 0.5 {
                *depth = hidden.depth[at];
            }
            *rgba = std::array::from_fn(|c| rgba[c] + open * below[c]);
        });
}

/// Weights that fall with the squared distance of the eyes; the nearest one has 1.
fn baseline_weights(references: &[Camera], target: &Camera) -> Vec<f32> {
    let eye = target.eye_in_world();
    let distances2: Vec<f64> = references
        .iter()
        .map(|r| r.eye_in_world().distance_squared(eye))
        .collect();
    let largest = distances2.iter().copied().fold(0.0, f64::max);
    // Within a tenth of the largest baseline one reference is as good as another.
    let floor = (0.01 * largest).max(f64::MIN_POSITIVE);
    let least = distances2.iter().copied().fold(f64::INFINITY, f64::min);
    distances2
        .iter()
        .map(|d| ((least + floor) / (d + floor)) as f32)
        .collect()
}
