//! The usual distance between neighbouring points, from a few places: quick where discs of all points would take long.

use glam::{DVec3, Vec3};

use crate::discs::prepare::prepare;
use crate::points::PointCloud;

/// Points around a place whose spacing is measured, of each of as many places.
const PATCH: usize = 2000;

/// Places whose spacing is measured.
const PLACES: usize = 10;

/// The median spacing around some places, which follow one another in the order of the points; absent where no point has a neighbour.
pub fn usual_spacing(positions: &[[f32; 3]]) -> Option<f64> {
    let mut all: Vec<f32> = Vec::new();
    for place in 0..PLACES.min(positions.len()) {
        let centre = Vec3::from(positions[place * positions.len() / PLACES]);
        all.extend(spacings_around(positions, centre));
    }
    let middle = all.len() / 2;
    (!all.is_empty()).then(|| f64::from(*all.select_nth_unstable_by(middle, f32::total_cmp).1))
}

/// Spacings of the points that are nearest to a place.
fn spacings_around(positions: &[[f32; 3]], centre: Vec3) -> Vec<f32> {
    let mut near: Vec<(f32, u32)> = positions
        .iter()
        .zip(0..)
        .map(|(&at, number)| (Vec3::from(at).distance_squared(centre), number))
        .collect();
    let count = PATCH.min(near.len());
    if count < near.len() {
        near.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }
    let patch = near[..count]
        .iter()
        .map(|&(_, number)| positions[number as usize]);
    let cloud = PointCloud {
        origin_in_world: DVec3::ZERO,
        positions: patch.collect(),
        colours: vec![[0; 3]; count],
    };
    let discs = prepare(&cloud)
        .map(|prepared| prepared.discs)
        .unwrap_or_default();
    discs.iter().map(|disc| disc.spacing).collect()
}
