//! The reflectance of a rough surface, in a table by the cosine between normal and eye, and by roughness.
//!
//! The microfacet model of glTF 2.0, appendix B: GGX with Smith's height-correlated shadowing and Schlick's Fresnel term. Of
//! light from all sides such a surface reflects f0 * scale + offset (Karis 2013). Its lobe is then replaced by two that are
//! seen along their normals, in the plane of incidence (`stretched`). What is reflected is summed at the table's nodes over half
//! vectors on a fixed lattice; look-ups are bilinear.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::stretched;
use crate::screen::lanes::LANES;

/// Nodes along each side.
pub(crate) const SIDE: usize = 32;

/// Half vectors of one node.
const SAMPLES: usize = 512;

/// The reflectance of rough surfaces.
#[derive(Clone, Debug)]
pub(crate) struct Reflectance {
    /// By roughness, then by the cosine: scale, offset, and the part of the second look; then where each look lies between the normal (0)
    /// and the mirrored eye (1), and the roughness of its lobe; one number to make eight.
    pub(crate) table: Vec<[f32; 8]>,
    /// By roughness: how far the lobe along the normal spreads, the logarithm of one over its mean direction's length; its
    /// fourth root, which is nearly a line.
    spread: Vec<f32>,
    /// By that root, up to the widest: roughness.
    roughness: Vec<f32>,
}

impl Reflectance {
    pub(crate) fn new() -> Self {
        let rough = |row: usize| (row as f32 / (SIDE - 1) as f32).max(0.01);
        let nodes: Vec<Lobe> = (0..SIDE * SIDE)
            .into_par_iter()
            .map(|node| {
                let cosine = (node % SIDE) as f32 / (SIDE - 1) as f32;
                Lobe::new(cosine.max(1e-3), rough(node / SIDE))
            })
            .collect();
        let of_row = |row: &[Lobe]| row[SIDE - 1].spread.sqrt().sqrt();
        let mut spread: Vec<f32> = nodes.chunks(SIDE).map(of_row).collect();
        spread[0] = 0.0;
        let inverse = |node: usize| {
            let wanted = node as f32 / (INVERSE - 1) as f32 * spread[SIDE - 1];
            let row = spread.partition_point(|&s| s < wanted).clamp(1, SIDE - 1);
            let share = (wanted - spread[row - 1]) / (spread[row] - spread[row - 1]);
            (row as f32 - 1.0 + share) / (SIDE - 1) as f32
        };
        let mut reflectance = Self {
            table: Vec::new(),
            roughness: (0..INVERSE).map(inverse).collect(),
            spread,
        };
        for (node, lobe) in nodes.iter().enumerate() {
            let share = |k: usize| k as f32 / (SIDE - 1) as f32;
            let looks = stretched::lobe_pair(share(node / SIDE), share(node % SIDE));
            let [one, other] = looks.looks;
            reflectance.table.push([
                lobe.scale,
                lobe.offset,
                looks.part_of_second,
                one.turn,
                one.roughness,
                other.turn,
                other.roughness,
                0.0,
            ]);
        }
        reflectance
    }

    /// The roughness of lobes that normals of these variances (mean square distance from their mean) spread further: mirrored
    /// directions turn by twice the angle, and where spreads are independent they add up.
    #[inline(always)]
    pub(crate) fn widened<S: Simd>(
        &self,
        simd: S,
        roughness: f32x16<S>,
        variance: f32x16<S>,
    ) -> f32x16<S> {
        let root = all_between(simd, &self.spread, roughness);
        let square = root * root;
        let spread = square * square + variance + variance;
        let share = spread.sqrt().sqrt() * f32x16::splat(simd, 1.0 / self.spread[SIDE - 1]);
        all_between(simd, &self.roughness, share)
    }
}

/// Nodes from spread back to roughness.
const INVERSE: usize = 128;

/// The values at shares of the way through equally spaced nodes, each as `between` gives it in the tests.
#[inline(always)]
fn all_between<S: Simd>(simd: S, nodes: &[f32], share: f32x16<S>) -> f32x16<S> {
    let splat = |x: f32| f32x16::splat(simd, x);
    let at = share.max(splat(0.0)).min(splat(1.0)) * splat((nodes.len() - 1) as f32);
    let first = at.floor().min(splat((nodes.len() - 2) as f32));
    let places: i32x16<S> = first.to_int_precise();
    let (mut low, mut high) = ([0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        let pair = &nodes[places[lane] as usize..][..2];
        (low[lane], high[lane]) = (pair[0], pair[1]);
    }
    let [low, high] = [low, high].map(|lanes| f32x16::from_slice(simd, &lanes));
    low + (high - low) * (at - first)
}

/// The value at a share of the way through equally spaced nodes.
#[cfg(test)]
fn between(nodes: &[f32], share: f32) -> f32 {
    let at = share.clamp(0.0, 1.0) * (nodes.len() - 1) as f32;
    let first = (at as usize).min(nodes.len() - 2);
    nodes[first] + (nodes[first + 1] - nodes[first]) * (at - first as f32)
}

/// The light that reaches the eye.
struct Lobe {
    scale: f32,
    offset: f32,
    /// The logarithm of one over the mean direction's length.
    spread: f32,
}

impl Lobe {
    fn new(cosine: f32, roughness: f32) -> Self {
        let alpha = roughness * roughness;
        let eye = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        let (mut scale, mut offset, mut mean) = (0.0f64, 0.0f64, DVec3::ZERO);
        for k in 0..SAMPLES {
            let half = half_vector(k, SAMPLES, alpha);
            let to_half = eye.dot(half);
            let light = 2.0 * to_half * half - eye;
            if light.z <= 0.0 || to_half <= 0.0 {
                continue;
            }
            // Reflected light over the density of the half vectors: 4 V (n.l) (v.h) / (n.h).
            let visible = 4.0 * visibility(light.z, cosine, alpha) * light.z * to_half / half.z;
            let fresnel = (1.0 - to_half).powi(5);
            scale += f64::from(visible * (1.0 - fresnel));
            offset += f64::from(visible * fresnel);
            mean += light.as_dvec3() * f64::from(visible);
        }
        let mean = mean / (scale + offset).max(1e-12);
        let of_mean = |sum: f64| (sum / SAMPLES as f64) as f32;
        Self {
            scale: of_mean(scale),
            offset: of_mean(offset),
            spread: -(mean.length().min(1.0).ln()) as f32,
        }
    }
}

/// Smith's height-correlated visibility: shadowing over 4 (n.l) (n.v).
pub(crate) fn visibility(to_light: f32, to_eye: f32, alpha: f32) -> f32 {
    let alpha2 = alpha * alpha;
    let one = to_light * (to_eye * to_eye * (1.0 - alpha2) + alpha2).sqrt();
    let other = to_eye * (to_light * to_light * (1.0 - alpha2) + alpha2).sqrt();
    0.5 / (one + other).max(1e-7)
}

/// The k-th of `count` half vectors around +z, as dense as GGX times the cosine.
pub(crate) fn half_vector(k: usize, count: usize, alpha: f32) -> Vec3 {
    let (u, v) = (
        (k as f32 + 0.5) / count as f32,
        (k as u32).reverse_bits() as f32 / 4_294_967_296.0,
    );
    let cosine2 = (1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u);
    let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
    let sine = (1.0 - cosine2).max(0.0).sqrt();
    Vec3::new(sine * cos, sine * sin, cosine2.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use resample_core::dispatch;
    use resample_core::simd::SimdLevel;

    #[test]
    fn values_between_nodes_are_those_of_each_share_alone() {
        let nodes = [0.0, 1.0, 4.0, 9.0, 16.0];
        let shares: [f32; LANES] = std::array::from_fn(|k| k as f32 / 12.0 - 0.1);
        for simd in SimdLevel::ALL.map(SimdLevel::resolve) {
            let mut found = [0.0; LANES];
            dispatch!(simd, simd => all_between(simd, &nodes, f32x16::from_slice(simd, &shares)).store_slice(&mut found));
            for (share, found) in shares.into_iter().zip(found) {
                assert!(
                    (found - between(&nodes, share)).abs() < 1e-5,
                    "at {share}: {found}"
                );
            }
        }
    }
}
