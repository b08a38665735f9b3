//! The vector instructions of the tile kernels, and the few functions on vectors that they share.
//!
//! The kernels are written once, generic over the vector width; the level is chosen at run time by [`dispatch!`](crate::dispatch). Each
//! kernel is compiled three times: for AVX-512, for AVX2 with FMA, and for the baseline of the target. Levels between
//! these would double the time to build and serve only processors from before 2013.
//!
//! All levels compute the same formulas, but only some CPUs fuse a multiplication with the addition that follows:
//! pictures agree between levels to rounding, and are identical bytes on one level.

use fearless_simd::Level;
use fearless_simd::prelude::*;

/// The instruction set that the tile kernels run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum SimdLevel {
    /// The best that this CPU has.
    Auto,
    /// AVX2 and FMA where the CPU has them, else the baseline.
    Avx2,
    /// The instructions that every CPU of the target has: SSE2 on x86-64, NEON on 64-bit Arm.
    Baseline,
}

/// A level that this CPU has, as a kernel takes it.
#[derive(Clone, Copy, Debug)]
pub enum Vectors {
    /// AVX-512 as in Ice Lake.
    #[cfg(target_arch = "x86_64")]
    Avx512(fearless_simd::Avx512),
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2(fearless_simd::Avx2),
    /// The instructions that every CPU of the target has.
    Baseline(Baseline),
}

/// The instructions that every CPU of the target has.
#[cfg(target_arch = "x86_64")]
pub type Baseline = fearless_simd::Sse2;
/// The instructions that every CPU of the target has.
#[cfg(target_arch = "aarch64")]
pub type Baseline = fearless_simd::Neon;
/// The instructions that every CPU of the target has.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub type Baseline = fearless_simd::Fallback;

impl SimdLevel {
    /// Every level.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Avx2, Self::Baseline];

    /// The level, or the best one below it that this CPU has.
    pub fn resolve(self) -> Vectors {
        match self {
            Self::Auto => best(true),
            Self::Avx2 => best(false),
            Self::Baseline => Vectors::Baseline(baseline()),
        }
    }
}

impl Vectors {
    /// The name of the level.
    pub fn name(self) -> &'static str {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => "avx512",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "avx2",
            Self::Baseline(_) => "baseline",
        }
    }
}

#[cfg(target_arch = "x86_64")]
fn best(has_avx512: bool) -> Vectors {
    let level = Level::new();
    match (level.as_avx512().filter(|_| has_avx512), level.as_avx2()) {
        (Some(avx512), _) => Vectors::Avx512(avx512),
        (None, Some(avx2)) => Vectors::Avx2(avx2),
        (None, None) => Vectors::Baseline(baseline()),
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn best(_has_avx512: bool) -> Vectors {
    Vectors::Baseline(baseline())
}

/// The token of the baseline.
#[cfg(target_arch = "x86_64")]
pub fn baseline() -> Baseline {
    Level::baseline()
        .as_sse2()
        .expect("every x86-64 processor has SSE2")
}

/// The token of the baseline.
#[cfg(target_arch = "aarch64")]
pub fn baseline() -> Baseline {
    Level::baseline()
        .as_neon()
        .expect("every 64-bit Arm processor has NEON")
}

/// The token of the baseline.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub fn baseline() -> Baseline {
    Baseline::new()
}

/// Runs an expression with the vector instructions of `level`, a [`Vectors`]: `dispatch!(level, simd => kernel(simd, ..))`.
/// The kernel is marked `#[simd]`, or `#[inline(always)]`, else it runs without the instructions.
#[macro_export]
macro_rules! dispatch {
    ($level:expr, $simd:ident => $kernel:expr) => {{
        use fearless_simd::Simd as _;
        match $level {
            #[cfg(target_arch = "x86_64")]
            $crate::simd::Vectors::Avx512($simd) => $simd.vectorize(
                #[inline(always)]
                || $kernel,
            ),
            #[cfg(target_arch = "x86_64")]
            $crate::simd::Vectors::Avx2($simd) => $simd.vectorize(
                #[inline(always)]
                || $kernel,
            ),
            $crate::simd::Vectors::Baseline($simd) => $simd.vectorize(
                #[inline(always)]
                || $kernel,
            ),
        }
    }};
}

/// 2^f - 1 = f (c0 + c1 f + ... + c4 f^4) for |f| <= 1/2, fitted for the smallest relative error: 4.3e-7.
const EXP2M1: [f32; 5] = [
    std::f32::consts::LN_2,
    0.240_223_5,
    0.055_505,
    0.009_666_245,
    0.001_333_353_3,
];

/// Adding this rounds a float of magnitude under 2^22 to an integer and leaves that integer in the low bits.
const ROUND_MAGIC: f32 = 12_582_912.0;

/// Optical depths beyond this leave no transmittance that f32 can hold as a normal number: 2^-126.
const MAX_LOG2: f32 = 126.0;

/// 1 - exp(-depth) for depth >= 0 (infinity gives 1 - 2^-126), to 1e-6 relative even for tiny depths, where
/// 1 - exp would have lost everything.
#[inline(always)]
pub fn opacity_from_optical_depth<S, F>(simd: S, depth: F) -> F
where
    S: Simd,
    F: SimdFloat<S, Element = f32>,
    F::Bits: SimdInt<S, Element = u32>,
{
    let splat = |x: f32| F::splat(simd, x);
    let log2 = (depth * splat(-std::f32::consts::LOG2_E)).max(splat(-MAX_LOG2));
    let rounded = log2 + splat(ROUND_MAGIC);
    let fraction = log2 - (rounded - splat(ROUND_MAGIC));
    let mut poly = splat(EXP2M1[4]);
    for c in EXP2M1[..4].iter().rev() {
        poly = poly.mul_add(fraction, splat(*c));
    }
    let power = fraction * poly;
    // 2^n, built from the integer that the magic number left in the low bits.
    let scale = F::from_bits((rounded.to_bits() << 23) + F::Bits::splat(simd, 1f32.to_bits()));
    // 1 - scale (1 + power): the first difference is exact, and 0 for tiny depths.
    (splat(1.0) - scale) - scale * power
}

/// 2^x for x <= 0, as 2^-126 below that, to 5e-7 relative.
#[inline(always)]
pub fn exp2<S, F>(simd: S, x: F) -> F
where
    S: Simd,
    F: SimdFloat<S, Element = f32>,
    F::Bits: SimdInt<S, Element = u32>,
{
    let splat = |x: f32| F::splat(simd, x);
    let x = x.max(splat(-MAX_LOG2));
    let rounded = x + splat(ROUND_MAGIC);
    let f = x - (rounded - splat(ROUND_MAGIC));
    let [c0, c1, c2, c3, c4] = EXP2M1;
    let mut poly = f * c4 + splat(c3);
    poly = poly * f + splat(c2);
    poly = poly * f + splat(c1);
    poly = poly * f + splat(c0);
    let scale = F::from_bits((rounded.to_bits() << 23) + F::Bits::splat(simd, 1f32.to_bits()));
    scale + scale * (f * poly)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scalar face of the vector function; applies it to each element.
    fn opacities_from_optical_depths(level: SimdLevel, depths: &[f32]) -> Vec<f32> {
        let mut out = Vec::with_capacity(depths.len());
        for depth in depths {
            out.push(crate::dispatch!(level.resolve(), simd => first_opacity(simd, *depth)));
        }
        out
    }

    #[inline(always)]
    fn first_opacity<S: Simd>(simd: S, depth: f32) -> f32 {
        opacity_from_optical_depth(simd, S::f32s::splat(simd, depth)).as_slice()[0]
    }

    #[test]
    fn powers_of_two_keep_their_relative_error() {
        for level in SimdLevel::ALL {
            for step in 0..=12_600 {
                let x = -0.01 * step as f32;
                let power = crate::dispatch!(level.resolve(), simd => first_power(simd, x));
                let wanted = f64::from(x).exp2();
                let error = (f64::from(power) - wanted).abs() / wanted;
                assert!(error < 5e-7, "2^{x} is {power}, {error:.1e} off");
            }
            let power = crate::dispatch!(level.resolve(), simd => first_power(simd, -1e9));
            assert_eq!(power, f32::MIN_POSITIVE);
        }
    }

    #[inline(always)]
    fn first_power<S: Simd>(simd: S, x: f32) -> f32 {
        exp2(simd, S::f32s::splat(simd, x)).as_slice()[0]
    }

    #[test]
    fn opacity_keeps_its_relative_error_over_the_whole_range() {
        let depths: Vec<f32> = (-300..=60).map(|i| 10f32.powf(i as f32 / 10.0)).collect();
        for level in SimdLevel::ALL {
            for (depth, got) in depths
                .iter()
                .zip(opacities_from_optical_depths(level, &depths))
            {
                let truth = -f64::from(-depth).exp_m1();
                let error = (f64::from(got) - truth).abs() / truth;
                assert!(
                    error < 1e-6,
                    "{level:?}: depth {depth} gives {got}, not {truth}"
                );
            }
        }
    }

    #[test]
    fn the_ends_are_finite() {
        for level in SimdLevel::ALL {
            let got = opacities_from_optical_depths(
                level,
                &[0.0, f32::MIN_POSITIVE, f32::MAX, f32::INFINITY],
            );
            assert_eq!((got[0], got[2], got[3]), (0.0, 1.0, 1.0), "{level:?}");
            assert!(got[1] >= 0.0 && got[1] < 1e-37, "{level:?}: {}", got[1]);
        }
    }
}
