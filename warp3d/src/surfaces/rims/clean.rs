//! Samples beside softened edges get the colour of their own surface.
//!
//! A soft edge is a pixel or two off, and photographs are soft themselves: what lies on one side by its depth may be of the
//! other's colour, and would stay behind as a speck when the two move apart. The two samples next to a cut are held against
//! the third, which counts as pure: as far as they are between its colour and that of the other side, they are taken apart, and
//! where they are more of the other side's, they become as the third.
//!
//! Limits: what is more than two samples off stays; a texture that is like the other side loses two samples.

use super::{LARGEST_SHARE, LEAST_CONTRAST2, SMOOTH2, cut_after, difference, dot, without};
use crate::surfaces::surface::Surfaces;

/// Least share of the other side that is taken out: less is texture and noise.
const LEAST_SHARE: f32 = 0.2;

/// Gives the unmixed `samples` beside cuts of softened depth the colours of their own surfaces.
pub(crate) fn clean(surfaces: &Surfaces, samples: &mut [[f32; 3]]) {
    // The colours stay as they are until all are found.
    let mut found: Vec<(usize, f32, [f32; 3])> = Vec::new();
    let beside = (0..samples.len()).filter(|&index| surfaces.clearance[index] == 0);
    for (index, axis) in beside.flat_map(|index| [(index, 0), (index, 1)]) {
        let Some(cut) = cut_after(surfaces, index, axis) else {
            continue;
        };
        let sides = [cut.nearer, cut.farther];
        let pure = sides.map(|side| side.deeper.unwrap_or(side.samples[1]));
        for (side, (own, other)) in sides.iter().zip([(pure[0], pure[1]), (pure[1], pure[0])]) {
            let between = difference(samples[other], samples[own]);
            let contrast2 = dot(between, between);
            if contrast2 < LEAST_CONTRAST2 {
                continue;
            }
            for sample in side.samples.into_iter().filter(|&sample| sample != own) {
                let off = difference(samples[sample], samples[own]);
                let share = dot(off, between) / contrast2;
                let aside2 = dot(off, off) - share * share * contrast2;
                if share > LEAST_SHARE && aside2 <= SMOOTH2 * contrast2 {
                    let colour = if share > LARGEST_SHARE {
                        samples[own]
                    } else {
                        without(samples[sample], samples[other], share)
                    };
                    found.push((sample, share, colour));
                }
            }
        }
    }
    // The worst edge decides the colour.
    found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for (sample, _, colour) in found {
        samples[sample] = colour;
    }
}
