//! Films with truth: bodies and cameras that move, picture by picture, and depth as a network gives it.
//!
//! Gives, for each picture of a film, the view with its exact depth, and the true view of another eye. Three films: a street that is passed by, a
//! face that moves before a wall, and a room seen by a hand that holds the camera. A network's depth is inverse depth, scaled and shifted anew for every
//! picture, blurred, with noise and in 8 bits.
//!
//! Limits: no light, no motion blur; the film cuts nowhere.

use glam::DVec3;
use resample_core::Camera;
use resample_core::narrow::single;
use warp3d::Reference;

use crate::warps::filtered::{filtered, filtered_scene};
use crate::warps::scenes::{AnalyticScene, Body, camera};
use crate::warps::soft::{Numbers, Softening, softened};
use crate::warps::truth::WarpScene;

/// One of the films.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmScene {
    /// A street passes by: walls, a lamp post, a passer-by.
    Street,
    /// A head moves before a wall; the camera rests.
    Face,
    /// A hand holds the camera in a room.
    Room,
}

/// How a network's depth departs from the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Network {
    /// Largest part by which inverse depth is scaled anew in each picture.
    pub scale: f64,
    /// Sigma of the blur, px.
    pub blur_px: f64,
    /// Standard deviation of the noise, of the range of inverse depth.
    pub noise: f64,
    /// The picture moves by so many pixels to the right against its depth.
    pub shift_px: usize,
}

/// Pictures of a second.
const RATE: f64 = 24.0;

impl FilmScene {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Street, Self::Face, Self::Room];

    /// The scene and the camera of picture `number`, `size` px.
    pub fn at(self, number: usize, size: [u32; 2]) -> (AnalyticScene, Camera) {
        let time = number as f64 / RATE;
        let wave =
            |period: f64, phase: f64| (std::f64::consts::TAU * (time / period + phase)).sin();
        let wall = |z: f64| Body::Card(DVec3::new(0.0, 0.0, z), DVec3::X * 40.0, DVec3::Y * 20.0);
        let focal_px = 0.9 * f64::from(size[0]);
        let (scene, eye, yaw) = match self {
            Self::Street => {
                let walks = DVec3::new(-0.8 * time, 0.0, 0.0);
                let at = DVec3::new(1.4, 0.3, 4.0) + walks;
                let passer_by = Body::MovedLeaf(at, DVec3::X * 0.35, DVec3::Y * 0.9, walks);
                let lamp = Body::Card(DVec3::new(-0.7, 0.0, 3.0), DVec3::X * 0.05, DVec3::Y * 4.0);
                let ground = Body::Card(DVec3::new(0.0, 1.3, 7.0), DVec3::X * 30.0, DVec3::Z * 5.0);
                let parts = vec![
                    (wall(9.0), 1.6, [0.8, 0.7, 0.6]),
                    (passer_by, 0.5, [0.2, 0.4, 0.9]),
                    (lamp, 0.9, [0.15, 0.2, 0.15]),
                    (ground, 1.1, [0.5, 0.5, 0.55]),
                ];
                (parts, DVec3::new(0.6 * time, 0.0, 0.0), 0.0)
            }
            Self::Face => {
                let moved = DVec3::new(0.35 * wave(2.0, 0.0), 0.06 * wave(1.1, 0.2), 0.0);
                let head = Body::MovedSphere(DVec3::new(0.0, 0.1, 3.0) + moved, 0.5, moved);
                let body = DVec3::new(0.0, 1.2, 3.2) + moved;
                let body = Body::MovedLeaf(body, DVec3::X * 0.9, DVec3::Y * 0.7, moved);
                let parts = vec![
                    (wall(6.0), 1.1, [0.75, 0.8, 0.85]),
                    (head, 0.4, [0.9, 0.7, 0.6]),
                    (body, 0.5, [0.3, 0.3, 0.5]),
                ];
                (parts, DVec3::ZERO, 0.0)
            }
            Self::Room => {
                let table = Body::Card(DVec3::new(0.2, 0.9, 3.6), DVec3::X * 1.4, DVec3::Z * 0.8);
                let vase = Body::Sphere(DVec3::new(0.5, 0.5, 3.4), 0.35);
                let plant = Body::Leaf(DVec3::new(-0.9, 0.1, 3.0), DVec3::X * 0.25, DVec3::Y * 0.6);
                let parts = vec![
                    (wall(6.5), 1.3, [0.85, 0.8, 0.7]),
                    (table, 0.7, [0.6, 0.4, 0.25]),
                    (vase, 0.35, [0.3, 0.5, 0.9]),
                    (plant, 0.3, [0.3, 0.7, 0.3]),
                ];
                let sway = DVec3::new(
                    0.12 * wave(1.7, 0.0),
                    0.05 * wave(1.2, 0.3),
                    0.04 * wave(2.3, 0.1),
                );
                (parts, sway, 0.01 * wave(1.9, 0.6))
            }
        };
        (AnalyticScene(scene), camera(size, focal_px, eye, yaw))
    }

    /// The view of picture `number` with its exact depth.
    pub fn picture(self, number: usize, size: [u32; 2]) -> Reference {
        let (scene, camera) = self.at(number, size);
        Reference {
            colour: filtered(&scene, &camera),
            ..scene.reference(&camera)
        }
    }

    /// The view of picture `number`, and the true view of an eye `baseline` to the right of it.
    pub fn pair(self, number: usize, size: [u32; 2], baseline: f64) -> WarpScene {
        let (scene, camera) = self.at(number, size);
        let aside = glam::DAffine3::from_translation(DVec3::new(-baseline, 0.0, 0.0));
        let eye = Camera {
            camera_from_world: aside * camera.camera_from_world,
            ..camera
        };
        filtered_scene(&format!("{self:?}"), &scene, &camera, &eye)
    }
}

impl Network {
    /// What networks of 2026 do on video, roughly: a part in twenty of scale, edges of three pixels, a hundredth of noise.
    pub const USUAL: Self = Self {
        scale: 0.05,
        blur_px: 1.2,
        noise: 0.01,
        shift_px: 0,
    };

    /// The depth that it gives for picture `number`: of the same unit as the truth, in which it is right on average.
    pub fn of(&self, exact: &Reference, number: usize) -> Reference {
        let soft = match self.blur_px > 0.0 {
            true => softened(exact, Numbers::Inverse, Softening::Blurred(self.blur_px)),
            false => exact.clone(),
        };
        let width = exact.camera.width as usize;
        let inverse: Vec<f64> = soft.depth.iter().map(|&z| 1.0 / f64::from(z)).collect();
        let largest = exact
            .depth
            .iter()
            .fold(0f64, |most, &z| most.max(1.0 / f64::from(z)));
        let mut random = Random(0x9e37_79b9_7f4a_7c15 ^ (number as u64 + 1) << 20);
        let scale = 1.0 + self.scale * (2.0 * random.next() - 1.0);
        let offset = 0.4 * self.scale * largest * (2.0 * random.next() - 1.0);
        let step = 1.3 * largest / 255.0;
        let value = |index: usize, random: &mut Random| {
            let (x, y) = (index % width, index / width);
            let from = inverse[y * width + x.saturating_sub(self.shift_px)];
            // The sum of twelve is normal enough.
            let noise: f64 = (0..12).map(|_| random.next()).sum::<f64>() - 6.0;
            let found = scale * from + offset + self.noise * largest * noise;
            1.0 / ((found / step).round().max(1.0) * step)
        };
        Reference {
            depth: (0..inverse.len())
                .map(|index| single(value(index, &mut random)))
                .collect(),
            ..exact.clone()
        }
    }
}

/// Numbers from 0 to 1 that look random (xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}
