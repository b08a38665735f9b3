//! The look-ups of a batch of sub-pixels in textures: places in vectors, then the four texels of each look-up.
//!
//! Takes [`LookupPlan`], adds to colours. Alike textures share places and weights. Texels that stand beside each other in memory
//! are read together; only those beyond a border of the picture are wrapped, one by one.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, i32x16, u16x8};
use glam::Vec4;
use resample_mesh::scene::Wrap;

use crate::prepare::charts::Borders;
use crate::prepare::level::wrapped;
use crate::prepare::mip::{Level, LevelTexels, Pyramid, UNIT, linear};
use crate::project::surface::UvAt;
use crate::screen::{IOTA, LANES, Lanes};
use crate::texture::lookup::{LEVEL_REACH, LookupPlan};

/// Texels of one kind.
pub(crate) trait Kind: Copy {
    /// The factor of a number of this kind.
    const SCALE: f32;

    /// A level's texels, if they are of this kind.
    fn of(level: &Level) -> &[Self];

    /// The texel at a place.
    fn one<S: Simd>(simd: S, texels: &[Self], place: usize) -> f32x4<S>;

    /// The texels at a place and behind it.
    fn two<S: Simd>(simd: S, texels: &[Self], place: usize) -> [f32x4<S>; 2];
}

impl Kind for [u16; 4] {
    const SCALE: f32 = 1.0 / UNIT;

    #[inline(always)]
    fn of(level: &Level) -> &[Self] {
        match &level.texels {
            LevelTexels::Unorm16(texels) => texels,
            _ => &[],
        }
    }

    #[inline(always)]
    fn one<S: Simd>(simd: S, texels: &[Self], place: usize) -> f32x4<S> {
        let [r, g, b, a] = texels[place];
        f32x4::simd_from(
            simd,
            [f32::from(r), f32::from(g), f32::from(b), f32::from(a)],
        )
    }

    #[inline(always)]
    fn two<S: Simd>(simd: S, texels: &[Self], place: usize) -> [f32x4<S>; 2] {
        let pair = u16x8::from_slice(simd, texels[place..place + 2].as_flattened());
        let (left, right) = pair.widen();
        let (left, right): (fearless_simd::i32x4<S>, fearless_simd::i32x4<S>) =
            (left.bitcast(), right.bitcast());
        [left.to_float(), right.to_float()]
    }
}

impl Kind for Vec4 {
    const SCALE: f32 = 1.0;

    #[inline(always)]
    fn of(level: &Level) -> &[Self] {
        match &level.texels {
            LevelTexels::Float(texels) => texels,
            _ => &[],
        }
    }

    #[inline(always)]
    fn one<S: Simd>(simd: S, texels: &[Self], place: usize) -> f32x4<S> {
        f32x4::simd_from(simd, texels[place].to_array())
    }

    #[inline(always)]
    fn two<S: Simd>(simd: S, texels: &[Self], place: usize) -> [f32x4<S>; 2] {
        let pair = &texels[place..place + 2];
        [
            f32x4::simd_from(simd, pair[0].to_array()),
            f32x4::simd_from(simd, pair[1].to_array()),
        ]
    }
}

impl Kind for [u8; 4] {
    const SCALE: f32 = 1.0;

    #[inline(always)]
    fn of(level: &Level) -> &[Self] {
        match &level.texels {
            LevelTexels::Srgb8(texels) => texels,
            _ => &[],
        }
    }

    #[inline(always)]
    fn one<S: Simd>(simd: S, texels: &[Self], place: usize) -> f32x4<S> {
        f32x4::simd_from(simd, linear(texels[place]).to_array())
    }

    #[inline(always)]
    fn two<S: Simd>(simd: S, texels: &[Self], place: usize) -> [f32x4<S>; 2] {
        [
            Self::one(simd, texels, place),
            Self::one(simd, texels, place + 1),
        ]
    }
}

/// Adds the look-ups of the first `count` sub-pixels to `texels`, texture by texture; those of places with a count of 0 are
/// left out. All pyramids are alike.
#[inline(always)]
pub(crate) fn look_up<S: Simd>(
    simd: S,
    pyramids: &[(usize, &Pyramid)],
    (places, count): (&LookupPlan, usize),
    texels: &mut [[Vec4; LANES]],
) {
    let load = |lanes: &Lanes| f32x16::from_slice(simd, lanes);
    let (u, v) = (load(&places.u), load(&places.v));
    let along = [load(&places.along[0]), load(&places.along[1])];
    let (times, share) = (load(&places.count), load(&places.share));
    let levels = i32x16::from_slice(simd, &places.level);
    let zero = f32x16::splat(simd, 0.0);
    let mut left = times.simd_gt(zero).to_bitmask() & ((1 << count) - 1);
    let each = f32x16::splat(simd, 1.0) / times;
    let weights = [each - each * share, each * share];
    let mixed = share.simd_gt(zero).to_bitmask();
    let mut taps = Taps::default();
    while left != 0 {
        let index = places.level[left.trailing_zeros() as usize];
        let group = left & levels.simd_eq(i32x16::splat(simd, index)).to_bitmask();
        left &= !group;
        for (next, weight) in weights.iter().enumerate() {
            let mut active = if next == 0 { group } else { group & mixed };
            let mut k = 0.0;
            while active != 0 {
                let t = f32x16::splat(simd, k + 0.5) / times - f32x16::splat(simd, 0.5);
                let index = index as usize + next;
                let alike = &pyramids[0].1.levels[index];
                taps.set(simd, alike, [u + t * along[0], v + t * along[1]]);
                for (slot, pyramid) in pyramids {
                    let out = &mut texels[*slot];
                    taps.add_level(simd, (pyramid, index), *weight, active, out);
                }
                k += 1.0;
                active &= times.simd_gt(f32x16::splat(simd, k)).to_bitmask();
            }
        }
    }
}

/// Sixteen look-ups, such as one for each sub-pixel of a batch.
#[derive(Default)]
pub(crate) struct Taps {
    /// The upper left texel: column, row, and place in the level.
    column: [i32; LANES],
    row: [i32; LANES],
    place: [i32; LANES],
    /// Bits of look-ups whose four texels all lie in the picture.
    inside: u64,
    /// Shares of the right and of the lower ones.
    right: [f32; LANES],
    lower: [f32; LANES],
    weight: [f32; LANES],
}

impl Taps {
    /// Finds the texels of look-ups in a level, and of those alike.
    #[inline(always)]
    pub(crate) fn set<S: Simd>(&mut self, simd: S, level: &Level, [u, v]: [f32x16<S>; 2]) {
        let half = f32x16::splat(simd, 0.5);
        let u = u * f32x16::splat(simd, level.scale[0]) - half;
        let v = v * f32x16::splat(simd, level.scale[1]) - half;
        let (u0, v0) = (u.floor(), v.floor());
        (u - u0).store_slice(&mut self.right);
        (v - v0).store_slice(&mut self.lower);
        let (column, row): (i32x16<S>, i32x16<S>) = (u0.to_int_precise(), v0.to_int_precise());
        column.store_slice(&mut self.column);
        row.store_slice(&mut self.row);
        let [width, height] = [level.size[0] as i32, level.size[1] as i32];
        let within = |at: i32x16<S>, count: i32| {
            at.simd_ge(i32x16::splat(simd, 0)) & at.simd_lt(i32x16::splat(simd, count - 1))
        };
        self.inside = (within(column, width) & within(row, height)).to_bitmask();
        (row * i32x16::splat(simd, level.stride as i32) + column).store_slice(&mut self.place);
    }

    /// Adds the look-ups of a level whose bits are set, each to its own colour.
    #[inline(always)]
    fn add_level<S: Simd>(
        &mut self,
        simd: S,
        (pyramid, index): (&Pyramid, usize),
        weight: f32x16<S>,
        active: u64,
        out: &mut [Vec4; LANES],
    ) {
        let level = (&pyramid.levels[index], pyramid.wrap);
        match level.0.texels {
            LevelTexels::Unorm16(_) => self.add::<S, [u16; 4]>(simd, level, weight, active, out),
            LevelTexels::Srgb8(_) => self.add::<S, [u8; 4]>(simd, level, weight, active, out),
            LevelTexels::Float(_) => self.add::<S, Vec4>(simd, level, weight, active, out),
        }
    }

    /// Adds the look-ups whose bits are set.
    #[inline(always)]
    fn add<S: Simd, K: Kind>(
        &mut self,
        simd: S,
        (level, wrap): (&Level, [Wrap; 2]),
        weight: f32x16<S>,
        mut active: u64,
        out: &mut [Vec4; LANES],
    ) {
        (weight * f32x16::splat(simd, K::SCALE)).store_slice(&mut self.weight);
        let texels = K::of(level);
        while active != 0 {
            let lane = active.trailing_zeros() as usize;
            active &= active - 1;
            let [upper, lower] = if self.inside >> lane & 1 == 1 {
                let place = self.place[lane] as usize;
                [
                    K::two(simd, texels, place),
                    K::two(simd, texels, place + level.stride),
                ]
            } else {
                self.wrapped(simd, texels, (level, wrap), lane)
            };
            let down = f32x4::splat(simd, self.lower[lane]);
            let left = (lower[0] - upper[0]).mul_add(down, upper[0]);
            let right = (lower[1] - upper[1]).mul_add(down, upper[1]);
            let mean = (right - left).mul_add(f32x4::splat(simd, self.right[lane]), left);
            let sum = f32x4::simd_from(simd, out[lane].to_array());
            let sum = mean.mul_add(f32x4::splat(simd, self.weight[lane]), sum);
            out[lane] = Vec4::from_slice(sum.as_slice());
        }
    }

    /// The four texels of a look-up at a border of the picture.
    #[inline(always)]
    fn wrapped<S: Simd, K: Kind>(
        &self,
        simd: S,
        texels: &[K],
        (level, wrap): (&Level, [Wrap; 2]),
        lane: usize,
    ) -> [[f32x4<S>; 2]; 2] {
        let (column, row) = (self.column[lane], self.row[lane]);
        let columns = [
            wrapped(column, level.size[0], wrap[0]),
            wrapped(column.saturating_add(1), level.size[0], wrap[0]),
        ];
        let rows = [
            level.row_start(row, wrap[1]),
            level.row_start(row.saturating_add(1), wrap[1]),
        ];
        let at = |row: usize, column: usize| K::one(simd, texels, rows[row] + columns[column]);
        [[at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]]
    }
}

// Look-ups of a sub-pixel near the border of its chart: on this side of it, sixteen at a time.

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
