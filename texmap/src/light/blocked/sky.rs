//! The light of the surroundings as a list of directions, each of which stands for a part of the sky.
//!
//! Cells of the octahedral square are walked along a Hilbert curve, and cut into parts of equal importance: half of it is solid angle, so that
//! everything around a place is seen, and half is light, so that a lamp is many directions and its shadow soft. A part keeps
//! the exact sums of its light; an error arises only where one part is neither wholly visible nor wholly hidden.

use glam::Vec3;

use crate::light::around::direction_of_texel;
use crate::light::blocked::place::{HARMONICS, SIDES, cell_of};
use crate::light::environment::irradiance::{FACTORS, basis};
use resample_core::narrow::single;

/// Directions for places on a mesh, at least and at most: each carries at most two of so many parts of all light. With 256, pictures of balls and plates are 2 dB
/// farther from the truth than with 384, with 1024 2 to 6 dB nearer.
const DIRECTIONS: [usize; 2] = [384, 1024];

/// Rays to all places of a mesh, about: a second and a half of one thread.
const RAYS: usize = 20_000_000;

/// Directions for so many places.
pub(crate) fn directions(places: usize) -> usize {
    let [least, most] = DIRECTIONS;
    (RAYS / places.max(1)).clamp(least, most)
}

/// Cells along the square's side: a power of 2.
const SIDE: usize = 128;

/// The sky.
#[derive(Clone, Debug)]
pub(crate) struct Sky {
    pub(crate) parts: Vec<Part>,
    /// Directions of the cells of the sharpest map of visibility.
    pub(crate) cells: Vec<Vec3>,
}

/// A part of the sky.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Part {
    /// Of length 1.
    pub(crate) direction: Vec3,
    /// Radiance times solid angle, over pi.
    pub(crate) light: Vec3,
    /// Its part of the irradiance over pi, in the basis of the environment's: red, green, blue of each harmonic, and 0.
    pub(crate) harmonics: [[f32; 4]; HARMONICS],
    /// Importance of the part where visibility is averaged.
    pub(crate) weight: f32,
    /// The cell of the sharpest map of visibility that it lies in.
    pub(crate) cell: usize,
}

impl Sky {
    /// The sky of a map of radiance, which is asked by direction, in so many parts.
    pub(crate) fn new(radiance: impl Fn(Vec3) -> Vec3, count: usize) -> Self {
        let cells: Vec<Cell> = (0..SIDE * SIDE)
            .map(|at| Cell::new(on_curve(at), &radiance))
            .collect();
        let whole_solid: f32 = cells.iter().map(|cell| cell.solid).sum();
        let whole_light: f32 = cells.iter().map(Cell::brightness).sum();
        let per_solid = 4.0 * std::f32::consts::PI / whole_solid;
        let mut parts = vec![Part::default(); count];
        let (mut at, mut index) = (0.0_f64, 0);
        for cell in &cells {
            let mut importance = 0.5 * cell.solid / whole_solid;
            importance += match whole_light > 0.0 {
                true => 0.5 * cell.brightness() / whole_light,
                false => importance,
            };
            let end = at + f64::from(importance) * count as f64;
            let whole = end - at;
            while at < end {
                if index + 1 < count && at >= (index + 1) as f64 {
                    index += 1;
                }
                let to = if index == count - 1 {
                    end
                } else {
                    end.min((index + 1) as f64)
                };
                let share = single((to - at) / whole);
                parts[index].add(cell, share * per_solid, single(to - at));
                at = to;
            }
        }
        for part in &mut parts {
            part.direction = part.direction.normalize_or(Vec3::Y);
            part.cell = cell_of(part.direction);
        }
        let side = SIDES[0];
        let cell = |at: usize| direction_of_texel([at % side, at / side], side).normalize();
        Self {
            parts,
            cells: (0..side * side).map(cell).collect(),
        }
    }
}

impl Sky {
    /// One over the irradiance of a place in even light as bright as this, red, green and blue together.
    pub(crate) fn per_mean(&self) -> f32 {
        let whole: Vec3 = self.parts.iter().map(|part| part.light).sum();
        4.0 / whole.element_sum().max(f32::MIN_POSITIVE)
    }

    /// The light on a place from which nothing is blocked, as a part of that.
    pub(crate) fn even(&self, normal: Vec3) -> f32 {
        let light = |part: &Part| part.light.element_sum() * part.direction.dot(normal).max(0.0);
        self.parts.iter().map(light).sum::<f32>() * self.per_mean()
    }
}

/// A cell of the square.
struct Cell {
    direction: Vec3,
    radiance: Vec3,
    solid: f32,
}

impl Cell {
    fn new(place: [usize; 2], radiance: &impl Fn(Vec3) -> Vec3) -> Self {
        let at = direction_of_texel(place, SIDE);
        let direction = at.normalize();
        Self {
            direction,
            radiance: radiance(direction),
            solid: at.length().powi(-3),
        }
    }

    fn brightness(&self) -> f32 {
        self.solid * self.radiance.element_sum()
    }
}

impl Part {
    /// Adds a share of a cell, whose solid angle is its own times `solid`.
    fn add(&mut self, cell: &Cell, solid: f32, importance: f32) {
        let solid = cell.solid * solid;
        self.direction += cell.direction * importance;
        self.weight += importance;
        let light = cell.radiance * solid;
        self.light += light / std::f32::consts::PI;
        // The factors belong to means over the sphere.
        let mean = light / (4.0 * std::f32::consts::PI);
        for ((sum, basis), factor) in self
            .harmonics
            .iter_mut()
            .zip(basis(cell.direction))
            .zip(FACTORS)
        {
            let part = mean * (basis * factor);
            (0..3).for_each(|k| sum[k] += part[k]);
        }
    }
}

/// The cell at a place of the Hilbert curve through the square.
fn on_curve(at: usize) -> [usize; 2] {
    let [mut x, mut y] = [0, 0];
    let (mut rest, mut side) = (at, 1);
    while side < SIDE {
        let right = rest / 2 % 2;
        let up = (rest ^ right) % 2;
        if up == 0 {
            if right == 1 {
                (x, y) = (side - 1 - x, side - 1 - y);
            }
            (x, y) = (y, x);
        }
        x += side * right;
        y += side * up;
        rest /= 4;
        side *= 2;
    }
    [x, y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_visits_every_cell_and_goes_on_beside_the_last() {
        let mut seen = vec![false; SIDE * SIDE];
        let mut last = on_curve(0);
        for at in 0..SIDE * SIDE {
            let [x, y] = on_curve(at);
            assert!(last[0].abs_diff(x) + last[1].abs_diff(y) <= 1);
            assert!(!std::mem::replace(&mut seen[y * SIDE + x], true));
            last = [x, y];
        }
    }

    #[test]
    fn parts_hold_all_light() {
        let lamp = Vec3::new(0.3, 0.8, -0.5).normalize();
        let sky = Sky::new(
            |d| Vec3::splat(if d.dot(lamp) > 0.97 { 9.0 } else { 0.5 }),
            512,
        );
        let sum: f32 = sky.parts.iter().map(|part| part.light.x).sum();
        // The cap's solid angle is 2 pi 0.03; cells cut its rim.
        let expected = 4.0 * 0.5 + 2.0 * 0.03 * 8.5;
        assert!((sum / expected - 1.0).abs() < 0.01, "{sum} {expected}");
        let harmonics: f32 = sky.parts.iter().map(|part| part.harmonics[0][0]).sum();
        assert!((harmonics / (sum / 4.0) - 1.0).abs() < 1e-3);
        let most = sky
            .parts
            .iter()
            .map(|part| part.light.x)
            .fold(0.0, f32::max);
        assert!(most < 2.1 * sum / 512.0, "{most}");
        let in_lamp = sky
            .parts
            .iter()
            .filter(|part| part.direction.dot(lamp) > 0.97);
        assert!(in_lamp.count() > 50);
    }
}
