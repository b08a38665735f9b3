//! Look-ups of a sub-pixel near the border of its chart: on this side of it, sixteen at a time.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::Vec4;

use crate::prepare::charts::Borders;
use crate::prepare::mip::Pyramid;
use crate::project::surface::UvAt;
use crate::screen::lanes::{IOTA, LANES};
use crate::texture::lookup::LEVEL_REACH;
use crate::texture::taps::Taps;

/// Most look-ups along each axis of a sub-pixel: up to 16 texels a sub-pixel, some 66 a pixel, single texels are
/// looked at. Beyond, look-ups in a coarser level keep a distance from the border that costs accuracy: 44.3 dB in place
/// of 46.0 on a helmet of 96 px, with 8 look-ups.
const MAX_LOOKUPS: f32 = 16.0;

/// The means of alike textures over a sub-pixel, each look-up moved so far inside the borders that its level sees nothing of
/// what lies across; in lane `lane` of their colours.
#[inline(always)]
pub(crate) fn look_up_at_borders<S: Simd>(
    simd: S,
    pyramids: &[(usize, &Pyramid)],
    (at, side_px, borders): (&UvAt, f32, &Borders),
    (colours, lane): (&mut [[Vec4; LANES]], usize),
) {
    let splat = |x: f32| f32x16::splat(simd, x);
    let [ux, uy, vx, vy] = at.jacobian.map(|j| j * side_px);
    let lengths = [ux.hypot(vx), uy.hypot(vy)];
    // A bilinear look-up spans two texels: one for each of them leaves none out.
    let texel = (lengths[0].max(lengths[1]) / MAX_LOOKUPS).max(1.0);
    let counts = lengths.map(|length| (length / texel).ceil().clamp(1.0, MAX_LOOKUPS));
    let lod = texel.log2();
    let margin = LEVEL_REACH * (lod.ceil().exp2() - 1.0);
    let count = (counts[0] * counts[1]) as usize;
    let mut taps = Taps::default();
    let mut first = 0;
    while first < count {
        let number = f32x16::from_slice(simd, &IOTA) + splat(first as f32);
        // The half keeps rounding clear of the next whole number.
        let row = ((number + splat(0.5)) * splat(1.0 / counts[1])).floor();
        let column = number - row * splat(counts[1]);
        let s = (row + splat(0.5)) * splat(1.0 / counts[0]) - splat(0.5);
        let t = (column + splat(0.5)) * splat(1.0 / counts[1]) - splat(0.5);
        let place = [
            splat(at.u) + s * splat(ux) + t * splat(uy),
            splat(at.v) + s * splat(vx) + t * splat(vy),
        ];
        let place = borders.moved_inside(simd, [at.u, at.v], place, margin);
        let active = (1 << (count - first).min(LANES)) - 1;
        add_trilinear(
            simd,
            pyramids,
            (lod, place),
            (&mut taps, active),
            (&mut *colours, lane),
        );
        first += LANES;
    }
    for (slot, _) in pyramids {
        colours[*slot][lane] /= count as f32;
    }
}

/// Adds the look-ups whose bits are set: each in the two levels beside `lod`.
#[inline(always)]
fn add_trilinear<S: Simd>(
    simd: S,
    pyramids: &[(usize, &Pyramid)],
    (lod, place): (f32, [f32x16<S>; 2]),
    (taps, active): (&mut Taps, u64),
    (colours, lane): (&mut [[Vec4; LANES]], usize),
) {
    let Some((_, pyramid)) = pyramids.first() else {
        return;
    };
    let last = pyramid.levels.len() - 1;
    let lod = lod.clamp(0.0, last as f32);
    let level = lod as usize;
    let share = lod - level as f32;
    for (index, weight) in [(level, 1.0 - share), ((level + 1).min(last), share)] {
        if weight == 0.0 {
            continue;
        }
        taps.set(simd, &pyramid.levels[index], place);
        for (slot, pyramid) in pyramids {
            let mut sums = [Vec4::ZERO; LANES];
            let weight = f32x16::splat(simd, weight);
            taps.add_level(simd, (pyramid, index), weight, active, &mut sums);
            colours[*slot][lane] += sums.iter().sum::<Vec4>();
        }
    }
}
