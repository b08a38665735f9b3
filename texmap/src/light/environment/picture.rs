//! The surroundings of an equirectangular picture on the octahedral square.

use std::borrow::Cow;
use std::f32::consts::{PI, TAU};

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, i32x16};
use fearless_simd_macros::simd;
use glam::{Vec3, Vec4};
use resample_core::dispatch;
use resample_core::simd::Vectors;
use resample_mesh::scene::Surroundings;

use crate::light::environment::map::{Map, blocks, centre, centres, directions_on_square};
use crate::screen::LANES;

/// Texels along the side of the sharpest map, at least and at most: finer than a screen shows of a mirrored room.
const SIDES: [usize; 2] = [64, 512];

/// Looks at the picture in a texel, along each side.
const LOOKS: usize = 2;

/// A picture with a border of one pixel.
pub(super) struct Equirect {
    width: usize,
    height: usize,
    /// Rows of `width` + 2 pixels; those at the poles are repeated.
    pixels: Vec<[f32; 4]>,
    /// About +y, in turns.
    turn: f32,
    /// Texels along the side of its map.
    side: usize,
}

/// A part of the sky.
pub(super) struct Disc {
    /// Towards its middle, of length 1.
    pub(super) direction: Vec3,
    pub(super) radius_rad: f32,
}

impl Equirect {
    /// The picture, turned about +y by an angle in radians.
    pub(super) fn new(picture: &Surroundings, turn_rad: f32) -> Self {
        let [least, most] = SIDES;
        let side = (2 * picture.height.next_power_of_two()).clamp(least, most);
        let (width, height) = (picture.width, picture.height);
        let mut pixels = Vec::with_capacity((width + 2) * (height + 2));
        for row in 0..height + 2 {
            let row = row.clamp(1, height) - 1;
            let row = &picture.rgb[row * width..][..width];
            let around = [&row[width - 1..], row, &row[..1]];
            pixels.extend(around.concat().iter().map(|&[r, g, b]| [r, g, b, 0.0]));
        }
        Self {
            width,
            height,
            pixels,
            turn: turn_rad / TAU,
            side,
        }
    }

    /// Changes a pixel, and its copies in the border.
    pub(super) fn change(&mut self, pixel: usize, new: impl Fn(Vec3) -> Vec3) {
        let (x, y) = (pixel % self.width, pixel / self.width);
        let stride = self.width + 2;
        let [r, g, b, _] = self.pixels[(y + 1) * stride + x + 1];
        let [r, g, b] = new(Vec3::new(r, g, b)).to_array();
        for row in [
            Some(y + 1),
            (y == 0).then_some(0),
            (y + 1 == self.height).then_some(y + 2),
        ] {
            let columns = [
                Some(x + 1),
                (x == 0).then_some(self.width + 1),
                (x + 1 == self.width).then_some(0),
            ];
            for column in columns {
                if let (Some(row), Some(column)) = (row, column) {
                    self.pixels[row * stride + column] = [r, g, b, 0.0];
                }
            }
        }
    }

    /// Its map.
    pub(super) fn map(&self, vectors: Vectors) -> Map {
        let mut map = Map::black(self.side);
        self.draw(&mut map, None, vectors);
        map
    }

    /// Draws the map anew where parts of the sky are.
    pub(super) fn redraw(&self, map: &mut Map, parts: &[Disc], vectors: Vectors) {
        self.draw(map, Some(parts), vectors);
    }

    fn draw(&self, map: &mut Map, parts: Option<&[Disc]>, vectors: Vectors) {
        map.for_each_row(|y, row| {
            dispatch!(vectors, simd => draw_row(simd, (self, parts), y, row));
        });
    }

    /// The radiance in directions of any length, bilinear.
    #[inline(always)]
    fn add_seen<S: Simd>(&self, simd: S, [x, y, z]: &[f32x16<S>; 3], sums: &mut [f32x4<S>; LANES]) {
        let splat = |v: f32| f32x16::splat(simd, v);
        let (zero, one, half) = (splat(0.0), splat(1.0), splat(0.5));
        let (width, height) = (splat(self.width as f32), splat(self.height as f32));
        let turns = angle(simd, *x, zero - *z) * splat(1.0 / TAU) + splat(0.5 + self.turn);
        // With the border, the first pixel's centre lies at 1.5.
        let across = (turns - turns.floor()) * width + half;
        let level = (*x * *x + *z * *z).sqrt();
        let down = angle(simd, level, *y) * splat(1.0 / PI) * height + half;
        let (column, row) = (
            across.floor().min(width),
            down.floor().max(zero).min(height),
        );
        let stride = width + splat(2.0);
        let place: i32x16<S> = (row * stride + column).to_int_precise();
        let (mut right, mut lower) = ([0.0; LANES], [0.0; LANES]);
        (across - column).store_slice(&mut right);
        (down - row).min(one).store_slice(&mut lower);
        let stride = self.width + 2;
        for lane in 0..LANES {
            let first = place[lane] as usize;
            let pixel = |at: usize| f32x4::from_slice(simd, &self.pixels[at]);
            let (a, b) = (pixel(first), pixel(first + 1));
            let (c, d) = (pixel(first + stride), pixel(first + stride + 1));
            let right = f32x4::splat(simd, right[lane]);
            let top = (b - a).mul_add(right, a);
            let low = (d - c).mul_add(right, c);
            sums[lane] += (low - top).mul_add(f32x4::splat(simd, lower[lane]), top);
        }
    }
}

/// The picture, no finer than the looks at it.
pub(super) fn reduced(picture: &Surroundings) -> Cow<'_, Surroundings> {
    let mut reduced = Cow::Borrowed(picture);
    while reduced.height > LOOKS * SIDES[1] {
        reduced = Cow::Owned(halved(&reduced));
    }
    reduced
}

/// The mean of two by two pixels.
fn halved(picture: &Surroundings) -> Surroundings {
    let (width, height) = (picture.width / 2, picture.height / 2);
    let mean = |at: usize| {
        let first = 2 * (at / width) * picture.width + 2 * (at % width);
        let below = first + picture.width;
        let four = [first, first + 1, below, below + 1].map(|at| Vec3::from(picture.rgb[at]));
        (0.25 * four.iter().sum::<Vec3>()).to_array()
    };
    Surroundings {
        width,
        height,
        rgb: (0..width * height).map(mean).collect(),
    }
}

/// Fills a row, or those blocks of it that a part of the sky reaches.
#[simd]
fn draw_row<S: Simd>(
    simd: S,
    (picture, parts): (&Equirect, Option<&[Disc]>),
    y: usize,
    row: &mut [Vec4],
) {
    let side = row.len();
    let step = 2.0 / (side * LOOKS) as f32;
    let away = |k: usize| (k as f32 + 0.5 - 0.5 * LOOKS as f32) * step;
    for (texels, out) in blocks(row) {
        let x = centres(simd, texels.start, side);
        if let Some(parts) = parts {
            let middle = directions_on_square(simd, x, centre(y, side));
            if !is_near(simd, parts, &middle, TEXEL * 2.0 / side as f32) {
                continue;
            }
        }
        let mut sums = [f32x4::splat(simd, 0.0); LANES];
        for k in 0..LOOKS * LOOKS {
            let x = x + f32x16::splat(simd, away(k % LOOKS));
            let towards = directions_on_square(simd, x, centre(y, side) + away(k / LOOKS));
            picture.add_seen(simd, &towards, &mut sums);
        }
        for (sum, texel) in sums.iter().zip(out) {
            *texel = Vec4::new(sum[0], sum[1], sum[2], 0.0) / (LOOKS * LOOKS) as f32;
        }
    }
}

/// A texel's width on the sphere over that on the square, at most, and its looks: they reach over half of it.
const TEXEL: f32 = 2.0;

/// Returns true if one of sixteen directions lies in a part of the sky, or as near to it.
#[inline(always)]
fn is_near<S: Simd>(simd: S, parts: &[Disc], towards: &[f32x16<S>; 3], slack_rad: f32) -> bool {
    let splat = |v: f32| f32x16::splat(simd, v);
    let [x, y, z] = *towards;
    let length = (x * x + y * y + z * z).sqrt();
    for part in parts {
        let along =
            x * splat(part.direction.x) + y * splat(part.direction.y) + z * splat(part.direction.z);
        let least = (part.radius_rad + slack_rad).min(PI).cos();
        if along.simd_ge(length * splat(least)).any_true() {
            return true;
        }
    }
    false
}

/// The angle of (x, y) from the y axis, as `atan2` gives it, to 1e-5.
#[inline(always)]
fn angle<S: Simd>(simd: S, x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
    let splat = |v: f32| f32x16::splat(simd, v);
    let (zero, tiny) = (splat(0.0), splat(f32::MIN_POSITIVE));
    let (across, along) = (x.abs(), y.abs());
    let ratio = across.min(along) / across.max(along).max(tiny);
    let square = ratio * ratio;
    // Abramowitz and Stegun 1964, 4.4.49.
    let mut series = splat(0.020_835_1);
    for factor in [-0.085_133, 0.180_141, -0.330_299_5, 0.999_866] {
        series = series * square + splat(factor);
    }
    let first = series * ratio;
    let eighth = across.simd_gt(along).select(splat(0.5 * PI) - first, first);
    let quarter = y.simd_lt(zero).select(splat(PI) - eighth, eighth);
    x.simd_lt(zero).select(zero - quarter, quarter)
}

#[cfg(test)]
mod tests {
    use resample_core::simd::SimdLevel;

    use super::*;

    #[test]
    fn pixels_stand_in_the_middle_of_their_parts_of_the_sky() {
        let (width, height) = (64, 32);
        // Longitude about +y from -z, and the angle from +y.
        let angles = |pixel: usize| {
            let longitude = ((pixel % width) as f32 + 0.5) / width as f32 - 0.5;
            let from_up = ((pixel / width) as f32 + 0.5) / height as f32;
            (TAU * longitude, PI * from_up)
        };
        let colour = |pixel: usize| {
            let (longitude, from_up) = angles(pixel);
            [longitude.sin(), longitude.cos(), from_up.cos()].map(|part| 1.0 + part)
        };
        let picture = Surroundings {
            width,
            height,
            rgb: (0..width * height).map(colour).collect(),
        };
        let map = Equirect::new(&picture, 0.0).map(SimdLevel::Auto.resolve());
        // Off the poles, where columns lie close together.
        for pixel in (8 * width..24 * width).step_by(37) {
            let (longitude, from_up) = angles(pixel);
            let level = from_up.sin();
            let towards = Vec3::new(
                level * longitude.sin(),
                from_up.cos(),
                -level * longitude.cos(),
            );
            let seen = map.at(towards).truncate();
            // Half of a pixel changes a colour by up to 0.05, bilinear mixes by 0.002.
            let change = (seen - Vec3::from(colour(pixel))).abs().max_element();
            assert!(change < 0.01, "pixel {pixel}: {seen}, off by {change}");
        }
    }
}
