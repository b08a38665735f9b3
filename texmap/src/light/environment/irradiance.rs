//! Irradiance of matt surfaces, in nine spherical harmonics (Ramamoorthi and Hanrahan 2001).

use glam::Vec3;

use crate::light::around::direction_of_texel;
use crate::light::environment::map::Map;

/// Of the mean over the sphere: 1 / (mean of the basis' square) and the cosine's factors 1, 2/3, 1/4.
pub(crate) const FACTORS: [f32; 9] = [
    1.0,
    3.0 * 2.0 / 3.0,
    3.0 * 2.0 / 3.0,
    3.0 * 2.0 / 3.0,
    15.0 / 4.0,
    15.0 / 4.0,
    15.0 / 4.0,
    1.25 / 4.0,
    3.75 / 4.0,
];

/// The nine products of a map with the cosine's own harmonics, over pi.
pub(super) fn irradiance(map: &Map) -> [Vec3; 9] {
    let mut sums = [Vec3::ZERO; 9];
    let mut whole = 0.0;
    for at in 0..map.side * map.side {
        let [x, y] = [at % map.side, at / map.side];
        let place = direction_of_texel([x, y], map.side);
        // The square's area over the sphere's there.
        let solid = place.length().powi(-3);
        let direction = place.normalize();
        let radiance = map.texels[(y + 1) * (map.side + 2) + x + 1].truncate();
        whole += solid;
        for (sum, basis) in sums.iter_mut().zip(basis(direction)) {
            *sum += radiance * (solid * basis);
        }
    }
    let mut scaled = sums;
    for (sum, factor) in scaled.iter_mut().zip(FACTORS) {
        *sum *= factor / whole;
    }
    scaled
}

/// 1, x, y, z, xy, yz, zx, 3 y^2 - 1, z^2 - x^2.
pub(crate) fn basis(d: Vec3) -> [f32; 9] {
    [
        1.0,
        d.x,
        d.y,
        d.z,
        d.x * d.y,
        d.y * d.z,
        d.z * d.x,
        3.0 * d.y * d.y - 1.0,
        d.z * d.z - d.x * d.x,
    ]
}
