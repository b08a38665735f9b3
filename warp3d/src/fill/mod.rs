//! Holes: takes the layers of the references, returns one picture.
//!
//! `blend` makes one picture of several references, `holes` fills the pixels that no reference shows, and `extrapolate` those
//! beyond every frame.

pub(crate) mod blend;
pub(crate) mod extrapolate;
pub(crate) mod holes;

use rayon::prelude::*;

use crate::view::layer::{Layer, Mix};

/// Composites `layer` over `hidden`, the background that its views hide.
pub(crate) fn lay_under(layer: &mut Layer, hidden: &Layer) {
    if layer.mixes.is_empty() {
        layer.mixes = vec![Mix::ONE; layer.rgba.len()];
    }
    let shares = layer.resolution.par_iter_mut().zip(&mut layer.mixes);
    let planes = layer.rgba.par_iter_mut().zip(&mut layer.depth).zip(shares);
    planes
        .enumerate()
        .for_each(|(at, ((rgba, depth), (resolution, mix)))| {
            let below = hidden.rgba[at];
            let open = 1.0 - rgba[3].clamp(0.0, 1.0);
            let share = open * below[3];
            if !(share > 0.0) {
                return;
            }
            let all = rgba[3] + share;
            *resolution = (rgba[3] * *resolution + share * hidden.resolution[at]) / all;
            mix.purity = match rgba[3] > 0.0 {
                // The larger share is the main surface.
                true => (mix.purity * rgba[3]).max(hidden.purity(at) * share) / all,
                false => hidden.purity(at),
            };
            if rgba[3] < 0.5 {
                *depth = hidden.depth[at];
            }
            *rgba = std::array::from_fn(|c| rgba[c] + open * below[c]);
        });
}
