//! Directions on a square: the octahedral map, whose pole is +y.
//!
//! A direction divided by the sum of its parts' sizes lies on an octahedron; the upper half of it unfolds to a diamond, the
//! lower half to the four corners of the square around it (Engelhardt and Dachsbacher 2008). Neighbours on the sphere are
//! neighbours on the square, except at its border, where one side continues on itself turned round.

use glam::Vec3;

/// Where a direction lies on the square, -1..=1 along both sides.
#[inline(always)]
pub(crate) fn square_from_direction(d: Vec3) -> [f32; 2] {
    let size = d.x.abs() + d.y.abs() + d.z.abs();
    let (x, z) = (d.x / size, d.z / size);
    if d.y >= 0.0 {
        [x, z]
    } else {
        [(1.0 - z.abs()).copysign(x), (1.0 - x.abs()).copysign(z)]
    }
}

/// The direction at a place of the square, in any length.
pub(crate) fn direction_from_square([x, z]: [f32; 2]) -> Vec3 {
    let y = 1.0 - x.abs() - z.abs();
    if y >= 0.0 {
        Vec3::new(x, y, z)
    } else {
        Vec3::new((1.0 - z.abs()).copysign(x), y, (1.0 - x.abs()).copysign(z))
    }
}

/// The direction at the centre of texel (x, y) of `side` times `side`.
pub(crate) fn direction_of_texel([x, y]: [usize; 2], side: usize) -> Vec3 {
    let place = |k: usize| (2 * k + 1) as f32 / side as f32 - 1.0;
    direction_from_square([place(x), place(y)])
}

/// The texel inside the square that continues it at (x, y), which may lie one texel outside.
pub(crate) fn folded([x, y]: [isize; 2], side: usize) -> [usize; 2] {
    let last = side as isize - 1;
    let (mut x, mut y) = (x, y);
    if x < 0 || x > last {
        (x, y) = (x.clamp(0, last), last - y);
    }
    if y < 0 || y > last {
        (x, y) = (last - x, y.clamp(0, last));
    }
    [x as usize, y as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_come_back() {
        for side in [2, 5, 16] {
            for at in 0..side * side {
                let texel = [at % side, at / side];
                let direction = direction_of_texel(texel, side);
                let [x, y] = square_from_direction(direction.normalize());
                let back = [x, y].map(|p| ((p + 1.0) * 0.5 * side as f32) as usize);
                assert_eq!(back, texel, "of {side}");
            }
        }
    }

    #[test]
    fn the_border_continues_on_the_sphere() {
        let side = 64;
        for k in 0..64_isize {
            for (outside, beside) in [
                ([-1, k], [0, k]),
                ([64, k], [63, k]),
                ([k, -1], [k, 0]),
                ([k, 64], [k, 63]),
            ] {
                let inside = direction_of_texel(beside.map(|at| at as usize), side).normalize();
                let next = direction_of_texel(folded(outside, side), side).normalize();
                assert!(
                    inside.dot(next) > 0.99,
                    "{outside:?} is far from {beside:?}: {inside} {next}"
                );
            }
        }
    }
}
