//! Magnified texels around a pixel: the pixel's Gaussian, applied to the tents that reconstruct the texture.
//!
//! A texel weighs as much as its tent along u times its tent along v is under the Gaussian, on the mean. Along one axis that is the second difference of
//! the Gaussian, integrated twice. Along the other it is so for each line of texels by itself: under the tent of that line a footprint that is
//! oblique on the texture has another mean and a smaller variance, which follow from the Gaussian's own moments there. So
//! weights add up to 1, and bilinear reconstruction is integrated to 3e-4 of what texels differ by.
//!
//! Limits: footprints of a few texels on one plane, with little perspective inside; textures that are reconstructed by tents.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16};
use fearless_simd_macros::simd;
use glam::Vec4;
use resample_core::dispatch;
use resample_core::narrow::cell;
use resample_core::simd::{Vectors, exp2};
use resample_mesh::scene::{Magnify, Wrap};

use crate::prepare::level::wrapped;
use crate::prepare::mip::{Level, LevelTexels, Pyramid};
use crate::screen::{IOTA, LANES};
use crate::texture::ellipse::{Laid, PIXEL_VARIANCE, PixelOnTexture};
use crate::texture::taps::Kind;

/// Most texels along an axis: two differences of sixteen.
const MOST: usize = LANES - 2;

/// Where the Gaussian is cut, standard deviations.
const CUT: f32 = 3.25;

/// The least deviation of a Gaussian, texels: less is a place.
const LEAST_SIGMA: f32 = 1e-3;

/// The largest relative change of 1/w from pixel to pixel. Perspective makes a Gaussian skew in texels, and only its mean follows here, at a cost of 0.15
/// times this change. A plane that is tilted by 30 degrees has 5e-4, in a picture of 1000 pixels and 50 degrees.
const MOST_PERSPECTIVE: f32 = 0.0015;

/// The least weight of a line of texels: moments under it are quotients.
const LEAST_WEIGHT: f32 = 1e-6;

/// A pixel on the lattice of texels.
struct Footprint {
    /// The first texel along u and v, and how many there are.
    first: [i32; 2],
    count: [usize; 2],
    /// The pixel's mean place less that of the first texel.
    centre: [f32; 2],
    /// Covariance (uu, uv, vv).
    covariance: [f32; 3],
}

impl Footprint {
    /// `None` where the footprint holds more texels than there is room for.
    fn new(pixel: &PixelOnTexture) -> Option<Self> {
        let [ux, uy, vx, vy] = pixel.at.jacobian;
        let [gx, gy] = pixel.over_w_slope;
        if pixel.pyramid.magnify != Magnify::Linear || gx.abs().max(gy.abs()) > MOST_PERSPECTIVE {
            return None;
        }
        let covariance = [
            (ux * ux + uy * uy) * PIXEL_VARIANCE,
            (ux * vx + uy * vy) * PIXEL_VARIANCE,
            (vx * vx + vy * vy) * PIXEL_VARIANCE,
        ];
        // The mean differs from the place of the middle by half the second derivative times the variance: that derivative is -2 times the
        // slope times the change of 1/w.
        let bent = [gx * PIXEL_VARIANCE, gy * PIXEL_VARIANCE];
        let places = [
            (pixel.at.u - ux * bent[0] - uy * bent[1], covariance[0]),
            (pixel.at.v - vx * bent[0] - vy * bent[1], covariance[2]),
        ];
        let mut footprint = Self {
            first: [0; 2],
            count: [0; 2],
            centre: [0.0; 2],
            covariance,
        };
        for (axis, (place, variance)) in places.into_iter().enumerate() {
            let (middle, reach) = (place - 0.5, 1.0 + CUT * variance.sqrt());
            let (first, last) = ((middle - reach).ceil(), (middle + reach).floor());
            // Not so where one of them is no number, or far beyond what whole numbers of 32 bits hold.
            if !(last - first < MOST as f32 && middle.abs() < 1e6) {
                return None;
            }
            footprint.first[axis] = first as i32;
            footprint.count[axis] = cell(last - first) + 1;
            footprint.centre[axis] = middle - first;
        }
        Some(footprint)
    }

    /// The axis, u or v, along which it is longer: lines of texels lie across.
    #[inline(always)]
    fn long(&self) -> usize {
        usize::from(self.covariance[0] < self.covariance[2])
    }
}

/// Returns true if magnified textures are gathered at a pixel.
pub(crate) fn is_small(pixel: &PixelOnTexture) -> bool {
    Footprint::new(pixel).is_some()
}

/// The means of alike textures under a pixel, and how many texels were looked at.
pub(crate) fn gather(
    pixel: &PixelOnTexture,
    pyramids: &[&Pyramid],
    vectors: Vectors,
    colours: &mut [Vec4],
) -> Option<Laid> {
    let footprint = Footprint::new(pixel)?;
    dispatch!(vectors, simd => gather_weighted(simd, &footprint, pyramids, colours));
    let [columns, rows] = footprint.count;
    Some(Laid {
        points: 0,
        splats: (columns * rows * pyramids.len()) as u64,
    })
}

/// By line of texels, and texel of the line.
type Weights = [[f32; LANES]; LANES];

#[simd]
fn gather_weighted<S: Simd>(
    simd: S,
    footprint: &Footprint,
    pyramids: &[&Pyramid],
    colours: &mut [Vec4],
) {
    let mut weights = [[0.0; LANES]; LANES];
    let whole = weigh(simd, footprint, &mut weights);
    for (colour, pyramid) in colours.iter_mut().zip(pyramids) {
        let level = (&pyramid.levels[0], pyramid.wrap);
        let window = (footprint, &weights);
        let sum = match level.0.texels {
            LevelTexels::Unorm16(_) => sum::<S, [u16; 4]>(simd, level, window),
            LevelTexels::Srgb8(_) => sum::<S, [u8; 4]>(simd, level, window),
            LevelTexels::Float(_) => sum::<S, Vec4>(simd, level, window),
        };
        *colour = sum / whole;
    }
}

/// A Gaussian at sixteen places one apart.
struct Integrals<S: Simd> {
    /// Its density times its deviation.
    density: f32x16<S>,
    /// The integral of its density, and the integral of that.
    once: f32x16<S>,
    twice: f32x16<S>,
}

impl<S: Simd> Integrals<S> {
    /// Places from `first` on, from the Gaussian's middle.
    #[inline(always)]
    fn new(simd: S, first: f32, sigma: f32) -> Self {
        let splat = |v: f32| f32x16::splat(simd, v);
        let (zero, one) = (splat(0.0), splat(1.0));
        let x = f32x16::from_slice(simd, &IOTA) + splat(first);
        let z = x * splat(1.0 / sigma);
        let away = z.abs();
        let bell = exp2(simd, z * z * splat(-0.5 * std::f32::consts::LOG2_E));
        // Abramowitz and Stegun 1964, 7.1.26, of z over the root of 2.
        let t = one / (away * splat(0.327_591_1 * std::f32::consts::FRAC_1_SQRT_2) + one);
        let mut series = splat(1.061_405_4);
        for factor in [-1.453_152, 1.421_413_7, -0.284_496_74, 0.254_829_6] {
            series = series * t + splat(factor);
        }
        let tail = series * t * bell * splat(0.5);
        let once = z.simd_lt(zero).select(tail, one - tail);
        // One over the root of 2 pi.
        let density = bell * splat(0.398_942_3);
        Self {
            density,
            once,
            twice: x * once + density * splat(sigma),
        }
    }
}

/// The second difference around each place but the first; those of the last two mean nothing.
#[inline(always)]
fn difference<S: Simd>(simd: S, values: f32x16<S>) -> f32x16<S> {
    let mut moved = [0.0; LANES + 2];
    values.store_slice(&mut moved[..LANES]);
    let next = f32x16::from_slice(simd, &moved[1..=LANES]);
    let second = f32x16::from_slice(simd, &moved[2..]);
    values - (next + next) + second
}

/// Computes the weights of all texels, line by line, and their sum.
#[inline(always)]
fn weigh<S: Simd>(simd: S, footprint: &Footprint, weights: &mut Weights) -> f32 {
    let Footprint {
        count,
        centre,
        covariance: [uu, uv, vv],
        ..
    } = *footprint;
    let long = footprint.long();
    let (along, across) = if long == 0 { (uu, vv) } else { (vv, uu) };
    let short = 1 - long;
    let slope = if along > 0.0 { uv / along } else { 0.0 };
    let rest = (across - slope * uv).max(0.0);
    let sigma = along.sqrt().max(LEAST_SIGMA);
    let lines = Integrals::new(simd, -1.0 - centre[long], sigma);
    // Under a tent at a, with K(a) the weight, the Gaussian has the mean -s^2 K'/K and the mean square s^2 + s^4 K''/K.
    let splat = |v: f32| f32x16::splat(simd, v);
    let of_lines = difference(simd, lines.twice).max(splat(LEAST_WEIGHT));
    let per_line = splat(1.0) / of_lines;
    let mean = splat(0.0 - sigma * sigma) * difference(simd, lines.once) * per_line;
    let bend = splat(sigma * sigma * sigma) * difference(simd, lines.density) * per_line;
    let variance = (splat(sigma * sigma) + bend - mean * mean).max(splat(0.0));
    let own_sigma = (variance * splat(slope * slope) + splat(rest)).sqrt();
    let (mut of_line, mut first, mut sigmas) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    of_lines.store_slice(&mut of_line);
    (mean * splat(0.0 - slope) - splat(1.0 + centre[short])).store_slice(&mut first);
    own_sigma.max(splat(LEAST_SIGMA)).store_slice(&mut sigmas);
    let is_wanted = f32x16::from_slice(simd, &IOTA).simd_lt(splat(count[short] as f32));
    let mut whole = splat(0.0);
    let mut own = splat(0.0);
    for line in 0..count[long] {
        // Lines of an upright footprint are alike.
        if line == 0 || slope != 0.0 {
            let integrals = Integrals::new(simd, first[line], sigmas[line]);
            own = difference(simd, integrals.twice).max(splat(0.0));
            own = is_wanted.select(own, splat(0.0));
        }
        let of_line = own * splat(of_line[line]);
        of_line.store_slice(&mut weights[line]);
        whole += of_line;
    }
    whole.reduce_sum()
}

/// The weighted sum of a level's texels.
#[inline(always)]
fn sum<S: Simd, K: Kind>(
    simd: S,
    (level, wrap): (&Level, [Wrap; 2]),
    (footprint, weights): (&Footprint, &Weights),
) -> Vec4 {
    let texels = K::of(level);
    let [first_column, first_row] = footprint.first;
    let [columns, rows] = footprint.count;
    let is_inside = first_column >= 0 && first_column as usize + columns < level.size[0];
    let is_by_column = footprint.long() == 0;
    let weight = |row: usize, column: usize| {
        f32x4::splat(
            simd,
            match is_by_column {
                true => weights[column][row],
                false => weights[row][column],
            },
        )
    };
    let mut sum = f32x4::splat(simd, 0.0);
    for row in 0..rows {
        let start = level.row_start(first_row + row as i32, wrap[1]);
        if is_inside {
            let start = start + first_column as usize;
            for column in (0..columns).step_by(2) {
                let [left, right] = K::two(simd, texels, start + column);
                sum = left.mul_add(weight(row, column), sum);
                sum = right.mul_add(weight(row, column + 1), sum);
            }
        } else {
            for column in 0..columns {
                let place = wrapped(first_column + column as i32, level.size[0], wrap[0]);
                let texel = K::one(simd, texels, start + place);
                sum = texel.mul_add(weight(row, column), sum);
            }
        }
    }
    Vec4::from_slice(sum.as_slice()) * K::SCALE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::texel_use::TexelUse;
    use crate::project::surface::UvAt;
    use resample_core::simd::SimdLevel;
    use resample_mesh::scene::{Texels, Texture};

    /// Noise of 32x32 texels.
    fn noise() -> Pyramid {
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        };
        let texels = (0..32 * 32).map(|_| [(); 4].map(|()| random())).collect();
        let texture = Texture {
            name: String::new(),
            width: 32,
            height: 32,
            texels: Texels::LinearF32(texels),
        };
        let wrap = [Wrap::Repeat, Wrap::Mirror];
        Pyramid::new((&[texture], 0), TexelUse::Weighted, wrap, Magnify::Linear)
    }

    /// The bilinear texture under the Gaussian, summed over many places.
    fn by_sum(pyramid: &Pyramid, (at, over_w_slope): (&UvAt, [f32; 2])) -> Vec4 {
        let steps = 160;
        let sigma = f64::from(PIXEL_VARIANCE).sqrt();
        let (mut sum, mut whole) = (glam::DVec4::ZERO, 0.0);
        for k in 0..steps * steps {
            let place = |k: i32| (f64::from(k) + 0.5) / f64::from(steps) * 9.0 - 4.5;
            let (x, y) = (place(k % steps), place(k / steps));
            let weight = (-0.5 * (x * x + y * y)).exp();
            let [gx, gy] = over_w_slope.map(|slope| f64::from(slope) * sigma);
            let w = 1.0 / (1.0 + gx * x + gy * y);
            let [ux, uy, vx, vy] = at.jacobian.map(|j| f64::from(j) * sigma * w);
            let u = f64::from(at.u) + ux * x + uy * y;
            let v = f64::from(at.v) + vx * x + vy * y;
            let (level, wrap) = (&pyramid.levels[0], pyramid.wrap);
            let texel = crate::texture::lookup::bilinear(level, wrap, u as f32, v as f32);
            sum += texel.as_dvec4() * weight;
            whole += weight;
        }
        (sum / whole).as_vec4()
    }

    #[test]
    fn a_magnified_texture_is_integrated_under_the_pixel() {
        let pyramid = noise();
        for (case, jacobian) in [
            [0.02, 0.0, 0.0, 0.02],
            [0.3, 0.1, -0.1, 0.3],
            [0.8, 0.3, -0.4, 0.7],
            [1.1, 0.0, 0.0, 1.1],
            [0.7, 0.7, -0.1, 0.1],
            [0.1, 0.0, 0.9, 0.2],
            [1.5, 1.2, 0.3, 0.1],
            [0.2, -0.1, 1.6, -1.0],
        ]
        .into_iter()
        .enumerate()
        {
            for (u, v) in [(5.3, 9.7), (31.8, 0.2), (16.5, 31.9), (7.0, 12.0)] {
                let at = UvAt { u, v, jacobian };
                // Upright, and as oblique as they may be.
                let over_w_slope = [[0.0; 2], [0.0015, -0.0015]][case % 2];
                let pixel = PixelOnTexture {
                    pyramid: &pyramid,
                    at,
                    over_w_slope,
                };
                let truth = by_sum(&pyramid, (&at, over_w_slope));
                for simd in SimdLevel::ALL.map(SimdLevel::resolve) {
                    let mut found = [Vec4::ZERO];
                    let texels = gather(&pixel, &[&pyramid], simd, &mut found);
                    assert!(texels.is_some(), "case {case}");
                    let error = (found[0] - truth).abs().max_element();
                    assert!(error < 3e-4, "case {case} at {u}, {v}: {error}");
                }
            }
        }
    }

    #[test]
    fn large_footprints_and_what_is_no_number_are_left_to_others() {
        let pyramid = noise();
        for jacobian in [[9.0, 0.0, 0.0, 0.1], [f32::NAN; 4], [f32::INFINITY; 4]] {
            let pixel = PixelOnTexture {
                pyramid: &pyramid,
                at: UvAt {
                    u: 3.0,
                    v: 4.0,
                    jacobian,
                },
                over_w_slope: [0.0; 2],
            };
            assert!(!is_small(&pixel), "{jacobian:?}");
        }
    }
}
