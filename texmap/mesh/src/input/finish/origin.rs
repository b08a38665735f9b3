//! The origin of a scene: positions of f64 become numbers of f32 that count from a point near them.
//!
//! A model that stands far from the world's origin (a survey in UTM, a part of a plant) would lose its shape in f32. Where
//! that is so, positions count from the middle of the scene; else they stay as they are in the file.

use glam::DVec3;

use crate::scene::Scene;

/// A scene that is farther from the origin than this many of its diagonals counts from its middle. An f32 is then exact
/// to a millionth of the diagonal, a thousandth of a pixel of a picture that shows all of it.
const FAR_DIAGONALS: f64 = 8.0;

/// Gives the meshes their positions, those of each mesh in the world.
pub fn place(scene: &mut Scene, positions: &[Vec<DVec3>]) {
    scene.origin_in_world = origin(positions);
    for (mesh, positions) in scene.meshes.iter_mut().zip(positions) {
        let relative = |pos: &DVec3| (*pos - scene.origin_in_world).as_vec3().to_array();
        mesh.positions = positions.iter().map(relative).collect();
    }
}

fn origin(positions: &[Vec<DVec3>]) -> DVec3 {
    let all = positions.iter().flatten();
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = all.fold(empty, |(low, high), &pos| (low.min(pos), high.max(pos)));
    let (middle, diagonal) = (0.5 * (low + high), (high - low).length());
    if middle.is_finite() && middle.length() > FAR_DIAGONALS * diagonal && diagonal > 0.0 {
        middle
    } else {
        DVec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_far_away_counts_from_its_middle() {
        let at = |x: f64| vec![vec![DVec3::new(x, 0.0, 0.0), DVec3::new(x + 1.0, 0.0, 0.0)]];
        assert_eq!(origin(&at(5.0)), DVec3::ZERO);
        assert_eq!(origin(&at(1e9)), DVec3::new(1e9 + 0.5, 0.0, 0.0));
        assert_eq!(origin(&[]), DVec3::ZERO, "nothing");
        assert_eq!(origin(&at(f64::NAN)), DVec3::ZERO, "refused later");
    }
}
