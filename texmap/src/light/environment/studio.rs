//! The built-in surroundings: a neutral studio, grey walls with soft lamps.
//!
//! A formula, so that it has no file. Every lamp is a smooth step in the angle from its middle, so that a chrome ball shows
//! no jagged rim. Colours are grey: a white matt surface stays white. Sizes and strengths are guesses, chosen by eye on
//! real models and scaled so that white matt surfaces shine 0.4 to 0.9.

use glam::{Quat, Vec3};

use crate::light::around::direction_of_texel;
use crate::light::environment::map::Map;

/// A lamp: a rectangle on the unit cube's face that `towards` points at, with soft edges.
struct Lamp {
    towards: Vec3,
    /// Half of its width and height at distance 1.
    half: [f32; 2],
    /// How far its edge reaches, at distance 1.
    soft: f32,
    radiance: f32,
}

/// A key light from the upper left, a fill from the right, a strip behind, and one overhead.
const LAMPS: [Lamp; 5] = [
    Lamp {
        towards: Vec3::new(-0.65, 0.6, 0.75),
        half: [0.5, 0.4],
        soft: 0.12,
        radiance: 3.6,
    },
    Lamp {
        towards: Vec3::new(1.0, 0.25, 0.4),
        half: [0.3, 0.65],
        soft: 0.15,
        radiance: 1.2,
    },
    Lamp {
        towards: Vec3::new(0.5, 0.45, -1.0),
        half: [0.6, 0.25],
        soft: 0.12,
        radiance: 2.2,
    },
    Lamp {
        towards: Vec3::new(-0.9, 0.1, -0.7),
        half: [0.2, 0.6],
        soft: 0.12,
        radiance: 1.6,
    },
    Lamp {
        towards: Vec3::new(0.05, 1.0, -0.1),
        half: [0.6, 0.6],
        soft: 0.3,
        radiance: 1.3,
    },
];

/// Radiance of the walls at the floor, at the horizon and overhead.
const WALLS: [f32; 3] = [0.12, 0.3, 0.42];

/// The studio on a map, turned.
pub(super) fn map(side: usize, turn: Quat) -> Map {
    let lamps = LAMPS.map(|lamp| lamp.placed());
    let mut map = Map::black(side);
    map.for_each_row(|y, row| {
        for (x, texel) in row.iter_mut().enumerate() {
            let direction = turn * direction_of_texel([x, y], side).normalize();
            *texel = Vec3::splat(radiance(&lamps, direction)).extend(0.0);
        }
    });
    map
}

/// Radiance that comes from a direction of unit length.
fn radiance(lamps: &[PlacedLamp], direction: Vec3) -> f32 {
    let [floor, horizon, ceiling] = WALLS;
    let up = direction.y;
    let walls = if up < 0.0 {
        horizon + (floor - horizon) * smooth(0.0, 0.6, -up)
    } else {
        horizon + (ceiling - horizon) * smooth(0.0, 1.0, up)
    };
    let of_lamps = lamps.iter().map(|lamp| lamp.radiance(direction));
    walls + of_lamps.sum::<f32>()
}

/// A lamp and its axes.
struct PlacedLamp {
    forward: Vec3,
    side: Vec3,
    above: Vec3,
    lamp: Lamp,
}

impl Lamp {
    fn placed(self) -> PlacedLamp {
        let forward = self.towards.normalize();
        let side = if forward.y.abs() > 0.9 {
            Vec3::X
        } else {
            forward.cross(Vec3::Y).normalize()
        };
        PlacedLamp {
            forward,
            side,
            above: side.cross(forward),
            lamp: self,
        }
    }
}

impl PlacedLamp {
    fn radiance(&self, direction: Vec3) -> f32 {
        let depth = direction.dot(self.forward);
        if depth <= 0.0 {
            return 0.0;
        }
        let Lamp { half, soft, .. } = self.lamp;
        let within =
            |at: f32, half: f32| 1.0 - smooth(half - soft, half + soft, (at / depth).abs());
        let across = within(direction.dot(self.side), half[0]);
        if across == 0.0 {
            return 0.0;
        }
        self.lamp.radiance * across * within(direction.dot(self.above), half[1])
    }
}

/// From 0 at `low` to 1 at `high`, flat at both ends.
fn smooth(low: f32, high: f32, at: f32) -> f32 {
    let t = ((at - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
