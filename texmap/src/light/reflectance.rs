//! The reflectance of a rough surface, in a table by the cosine between normal and eye, and by roughness.
//!
//! The microfacet model of glTF 2.0, appendix B: GGX with Smith's height-correlated shadowing and Schlick's Fresnel term. Of
//! light from all sides such a surface reflects f0 * scale + offset (Karis 2013). Its lobe is then replaced by two that are
//! seen along their normals, in the plane of incidence. What is reflected is summed at the table's nodes over half
//! vectors on a fixed lattice; look-ups are bilinear.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::screen::LANES;

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
            let looks = lobe_pair(share(node / SIDE), share(node % SIDE));
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

// The lobes of rough surfaces seen at an angle, each as two lobes that are seen along their normals.
//
// Seen at an angle a lobe is long in the plane of incidence, narrow across, and cut off at the horizon. One round lobe with its mean direction and
// spread is off by up to a third of the light where lamps are as wide as lobes are. Two in the plane of incidence come three times as near.
//
// The table was found by a fit: for each node the directions, the roughnesses and the shares of two lobes for which the mean square of the
// difference in random surroundings is least. These have no direction of their own, and in the harmonics of degree l the power
// (2 l + 1) / (l (l + 1))^1.2, up to degree 120: lamps of all sizes, the large ones a little stronger. Lobes are zonal harmonics times those of their directions,
// so that the difference is a sum over degrees (Ramamoorthi and Hanrahan 2001). The fit is that of Nelder and Mead, from node to node, with a pull
// towards the neighbour that keeps the numbers smooth. Against sums over half vectors in a room of three lamps, over nodes and between them, the root mean square
// of the error is 0.2 to 0.6 of that with one lobe, from angles of 0.4 on.

/// Nodes along each side.
const LOBE_SIDE: usize = 12;

/// A look at blurred surroundings.
#[derive(Clone, Copy, Debug)]
struct LobeLook {
    /// Where it lies between the normal (0) and the mirrored eye (1), or beyond.
    pub(super) turn: f32,
    /// Roughness of the lobe that blurs.
    pub(super) roughness: f32,
}

/// The two looks that stand for a lobe.
struct LobePair {
    pub(super) looks: [LobeLook; 2],
    /// The weight of the second; the first has the rest.
    pub(super) part_of_second: f32,
}

/// The looks for a roughness and a cosine between normal and eye, bilinear between nodes.
fn lobe_pair(roughness: f32, cosine: f32) -> LobePair {
    let last = (LOBE_SIDE - 1) as f32;
    let [row, column] = [roughness, cosine].map(|at| at.clamp(0.0, 1.0) * last);
    let (i, j) = (
        (row as usize).min(LOBE_SIDE - 2),
        (column as usize).min(LOBE_SIDE - 2),
    );
    let (down, right) = (row - i as f32, column - j as f32);
    let [turn, rough, other_turn, other_rough, part] = [0, 1, 2, 3, 4].map(|k: usize| {
        let across = |i: usize| TABLE[i][j][k] + (TABLE[i][j + 1][k] - TABLE[i][j][k]) * right;
        across(i) + (across(i + 1) - across(i)) * down
    });
    let look = |turn, roughness| LobeLook { turn, roughness };
    LobePair {
        looks: [look(turn, rough), look(other_turn, other_rough)],
        part_of_second: part,
    }
}

/// By roughness 0, 1/11, ..., 1, then by cosine 0, 1/11, ..., 1: turn and roughness of the first look and of the second, and the part of the
/// second. Without roughness both are the mirror, and along the normal both are the lobe itself.
const TABLE: [[[f32; 5]; LOBE_SIDE]; LOBE_SIDE] = [
    [
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
        [1.000, 0.0, 1.000, 0.0, 0.300],
    ],
    [
        [0.980, 0.040, 0.952, 0.136, 0.535],
        [1.000, 0.064, 0.981, 0.068, 0.172],
        [1.002, 0.066, 0.982, 0.067, 0.205],
        [1.006, 0.066, 0.985, 0.065, 0.319],
        [1.001, 0.071, 0.980, 0.077, 0.149],
        [1.001, 0.071, 0.979, 0.083, 0.159],
        [1.007, 0.073, 0.984, 0.073, 0.336],
        [1.012, 0.076, 0.986, 0.072, 0.441],
        [1.005, 0.077, 0.976, 0.087, 0.271],
        [1.013, 0.079, 0.978, 0.084, 0.384],
        [1.001, 0.088, 0.977, 0.093, 0.112],
        [1.001, 0.091, 0.977, 0.091, 0.112],
    ],
    [
        [0.943, 0.083, 0.853, 0.238, 0.616],
        [1.000, 0.098, 0.925, 0.145, 0.425],
        [1.012, 0.113, 0.935, 0.134, 0.370],
        [1.016, 0.124, 0.945, 0.133, 0.365],
        [1.012, 0.137, 0.939, 0.135, 0.268],
        [1.013, 0.143, 0.936, 0.143, 0.251],
        [1.019, 0.147, 0.938, 0.150, 0.298],
        [1.025, 0.155, 0.948, 0.153, 0.343],
        [1.020, 0.163, 0.948, 0.163, 0.306],
        [1.031, 0.169, 0.944, 0.165, 0.352],
        [1.025, 0.174, 0.929, 0.179, 0.272],
        [1.025, 0.182, 0.929, 0.182, 0.272],
    ],
    [
        [0.876, 0.146, 0.691, 0.364, 0.544],
        [0.952, 0.142, 0.785, 0.271, 0.443],
        [0.992, 0.160, 0.826, 0.237, 0.385],
        [1.006, 0.177, 0.847, 0.227, 0.338],
        [1.023, 0.191, 0.856, 0.221, 0.330],
        [1.024, 0.206, 0.855, 0.229, 0.292],
        [1.032, 0.217, 0.861, 0.237, 0.298],
        [1.038, 0.227, 0.875, 0.247, 0.319],
        [1.050, 0.239, 0.878, 0.247, 0.335],
        [1.048, 0.251, 0.876, 0.258, 0.314],
        [1.049, 0.258, 0.835, 0.274, 0.264],
        [1.049, 0.273, 0.835, 0.273, 0.264],
    ],
    [
        [0.810, 0.201, 0.537, 0.473, 0.538],
        [0.883, 0.198, 0.622, 0.399, 0.482],
        [0.935, 0.203, 0.683, 0.349, 0.438],
        [0.975, 0.222, 0.709, 0.332, 0.393],
        [1.001, 0.239, 0.727, 0.327, 0.365],
        [1.024, 0.257, 0.740, 0.325, 0.349],
        [1.044, 0.274, 0.748, 0.329, 0.344],
        [1.052, 0.292, 0.748, 0.338, 0.319],
        [1.065, 0.308, 0.757, 0.347, 0.325],
        [1.084, 0.326, 0.761, 0.351, 0.329],
        [1.098, 0.339, 0.719, 0.366, 0.312],
        [1.098, 0.364, 0.719, 0.364, 0.312],
    ],
    [
        [0.732, 0.273, 0.364, 0.604, 0.511],
        [0.799, 0.261, 0.445, 0.515, 0.482],
        [0.857, 0.261, 0.503, 0.471, 0.457],
        [0.908, 0.272, 0.542, 0.449, 0.434],
        [0.949, 0.291, 0.567, 0.439, 0.406],
        [0.990, 0.306, 0.582, 0.433, 0.394],
        [1.019, 0.324, 0.586, 0.436, 0.374],
        [1.038, 0.351, 0.574, 0.443, 0.332],
        [1.065, 0.370, 0.591, 0.455, 0.336],
        [1.102, 0.390, 0.601, 0.461, 0.353],
        [1.147, 0.410, 0.558, 0.474, 0.357],
        [1.147, 0.455, 0.558, 0.455, 0.357],
    ],
    [
        [0.668, 0.347, 0.168, 0.731, 0.501],
        [0.719, 0.333, 0.249, 0.625, 0.472],
        [0.773, 0.332, 0.298, 0.584, 0.458],
        [0.822, 0.338, 0.340, 0.568, 0.447],
        [0.872, 0.349, 0.375, 0.549, 0.434],
        [0.926, 0.356, 0.402, 0.545, 0.439],
        [0.960, 0.382, 0.392, 0.544, 0.399],
        [0.999, 0.406, 0.343, 0.548, 0.358],
        [1.035, 0.429, 0.338, 0.562, 0.347],
        [1.102, 0.448, 0.363, 0.571, 0.378],
        [1.147, 0.476, 0.374, 0.589, 0.388],
        [1.147, 0.545, 0.374, 0.545, 0.388],
    ],
    [
        [0.614, 0.419, -0.010, 0.879, 0.523],
        [0.652, 0.405, 0.048, 0.731, 0.490],
        [0.690, 0.405, 0.085, 0.702, 0.474],
        [0.736, 0.409, 0.124, 0.677, 0.463],
        [0.776, 0.415, 0.147, 0.667, 0.452],
        [0.836, 0.417, 0.202, 0.656, 0.474],
        [0.872, 0.446, 0.156, 0.656, 0.422],
        [0.923, 0.463, 0.148, 0.660, 0.413],
        [0.991, 0.476, 0.181, 0.673, 0.438],
        [1.048, 0.507, 0.102, 0.682, 0.405],
        [1.122, 0.544, 0.024, 0.700, 0.388],
        [1.122, 0.636, 0.024, 0.636, 0.388],
    ],
    [
        [0.593, 0.488, -0.124, 0.975, 0.582],
        [0.611, 0.458, -0.052, 0.840, 0.573],
        [0.638, 0.458, 0.0, 0.807, 0.567],
        [0.678, 0.461, 0.030, 0.778, 0.562],
        [0.703, 0.475, 0.031, 0.776, 0.536],
        [0.762, 0.473, 0.086, 0.767, 0.565],
        [0.798, 0.492, 0.081, 0.770, 0.548],
        [0.862, 0.507, 0.088, 0.772, 0.550],
        [0.962, 0.510, 0.141, 0.764, 0.603],
        [0.961, 0.559, 0.051, 0.803, 0.520],
        [0.977, 0.632, -0.271, 0.808, 0.367],
        [0.977, 0.727, -0.271, 0.727, 0.367],
    ],
    [
        [0.588, 0.577, -0.282, 1.000, 0.624],
        [0.594, 0.510, -0.064, 1.000, 0.696],
        [0.607, 0.506, -0.021, 0.953, 0.696],
        [0.636, 0.504, 0.010, 0.912, 0.702],
        [0.680, 0.508, 0.011, 0.872, 0.696],
        [0.684, 0.527, 0.033, 0.895, 0.687],
        [0.748, 0.526, 0.058, 0.875, 0.710],
        [0.793, 0.544, 0.063, 0.870, 0.709],
        [0.959, 0.536, 0.085, 0.845, 0.757],
        [0.927, 0.595, 0.035, 0.883, 0.691],
        [0.765, 0.696, -0.221, 0.993, 0.455],
        [0.765, 0.818, -0.221, 0.818, 0.455],
    ],
    [
        [0.657, 0.656, -0.336, 1.000, 0.709],
        [0.658, 0.573, -0.136, 0.999, 0.789],
        [0.619, 0.606, -0.149, 1.000, 0.758],
        [0.639, 0.587, -0.043, 1.000, 0.814],
        [0.649, 0.585, -0.011, 1.000, 0.827],
        [0.649, 0.597, -0.011, 1.000, 0.818],
        [0.671, 0.586, 0.012, 1.000, 0.836],
        [0.703, 0.609, 0.0, 0.990, 0.821],
        [0.745, 0.634, 0.0, 0.976, 0.820],
        [0.761, 0.722, -0.035, 0.966, 0.765],
        [0.489, 0.835, -0.246, 0.995, 0.450],
        [0.489, 0.909, -0.246, 0.909, 0.450],
    ],
    [
        [0.827, 0.809, -0.343, 1.000, 0.781],
        [0.745, 0.682, -0.299, 1.000, 0.814],
        [0.772, 0.744, -0.176, 1.000, 0.865],
        [0.758, 0.779, -0.150, 1.000, 0.873],
        [0.790, 0.814, -0.116, 1.000, 0.894],
        [0.762, 0.858, -0.095, 1.000, 0.903],
        [0.248, 0.999, -0.292, 1.000, 0.518],
        [0.229, 1.000, -0.258, 1.000, 0.511],
        [0.234, 1.000, -0.252, 1.000, 0.509],
        [0.235, 0.997, -0.295, 1.000, 0.465],
        [0.166, 0.992, -0.221, 0.998, 0.431],
        [0.166, 1.000, -0.221, 1.000, 0.431],
    ],
];

#[cfg(test)]
mod tests {
    use resample_core::dispatch;
    use resample_core::simd::SimdLevel;

    use super::*;

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
