//! Surfaces by formula: their points at random, and their antialiased pictures in f64.

use glam::{DVec2, DVec3};
use resample_core::image::srgb_from_linear;
use resample_core::point::PIXEL_SIGMA_PX;
use resample_core::{Camera, Image, Projection};

use crate::PointCloud;

/// A surface around the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    /// z = 0, x and y in -1..1.
    Plane,
    /// Radius 1.
    Sphere,
}

/// A surface with a smooth texture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene {
    pub(super) shape: Shape,
    /// Waves of the texture per 2 world units.
    pub(super) waves: f64,
}

/// How a picture differs from the truth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// Of premultiplied colour where the truth is opaque, dB of the full range.
    pub(super) inside_db: f64,
    /// Of premultiplied colour and alpha in the whole picture.
    pub(super) whole_db: f64,
    /// Pixels that are opaque in truth and not in the picture.
    pub(super) holes: usize,
    /// Coverage outside the truth's, over the truth's whole coverage.
    pub(super) false_fill: f64,
    /// Coverage that lacks inside the truth's, over the same.
    pub(super) lacking: f64,
}

/// Pseudo-random numbers in 0..1 (SplitMix64).
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }
}

impl Scene {
    /// Linear colour at a place of the surface.
    pub(super) fn colour(&self, p: DVec3) -> DVec3 {
        let w = std::f64::consts::PI * self.waves;
        let wave = DVec3::new(
            (w * p.x).sin() * (w * p.y).cos(),
            (w * (p.x + 0.5 * p.y)).cos(),
            (0.5 * w * (p.z + p.y)).sin(),
        );
        0.5 + 0.3 * wave
    }

    /// Where a ray first meets the surface.
    fn hit(&self, origin: DVec3, direction: DVec3) -> Option<DVec3> {
        match self.shape {
            Shape::Plane => {
                let place = origin - direction * (origin.z / direction.z);
                (place.x.abs() <= 1.0 && place.y.abs() <= 1.0).then_some(place)
            }
            Shape::Sphere => {
                let (a, b) = (direction.length_squared(), origin.dot(direction));
                let root = b * b - a * (origin.length_squared() - 1.0);
                (root >= 0.0).then(|| origin - direction * ((b + root.sqrt()) / a))
            }
        }
    }

    /// The unit normal, towards the eye, of the surface at a pixel's centre.
    pub(super) fn normal(&self, camera: &Camera, pixel: [usize; 2]) -> Option<DVec3> {
        let at = DVec2::new(pixel[0] as f64 + 0.5, pixel[1] as f64 + 0.5);
        let world_from_camera = camera.camera_from_world.inverse();
        let (origin, direction) = camera.ray_in_camera(at);
        let direction = world_from_camera.transform_vector3(direction);
        let hit = self.hit(world_from_camera.transform_point3(origin), direction)?;
        let normal = match self.shape {
            Shape::Plane => DVec3::Z,
            Shape::Sphere => hit,
        };
        Some(-normal * normal.dot(direction).signum())
    }

    /// Points at random: as many as a picture has pixels per area, seen from the front at the origin's distance, times `per_px`.
    pub(super) fn sampled(&self, per_px: f64, camera: &Camera) -> PointCloud {
        let distance = camera.eye_in_world().length();
        let px = match camera.projection {
            Projection::Perspective => distance / camera.fx,
            Projection::Orthographic => 1.0 / camera.fx,
        };
        let spacing = px / per_px.sqrt();
        let mut random = Random(7);
        let places: Vec<DVec3> = match self.shape {
            Shape::Plane => {
                let side = (2.0 / spacing).round() as usize;
                let cell = |random: &mut Random, i: usize| {
                    -1.0 + 2.0 * (i as f64 + random.next()) / side as f64
                };
                (0..side * side)
                    .map(|i| {
                        DVec3::new(
                            cell(&mut random, i % side),
                            cell(&mut random, i / side),
                            0.0,
                        )
                    })
                    .collect()
            }
            Shape::Sphere => {
                let count = (4.0 * std::f64::consts::PI / (spacing * spacing)).round() as usize;
                let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
                let place = |i: usize| {
                    let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
                    let (sin, cos) = (golden * i as f64).sin_cos();
                    let r = (1.0 - z * z).sqrt();
                    let mut jitter = || (random.next() - 0.5) * spacing;
                    (DVec3::new(r * cos, r * sin, z) + DVec3::new(jitter(), jitter(), jitter()))
                        .normalize()
                };
                (0..count).map(place).collect()
            }
        };
        self.cloud(&places)
    }

    pub(super) fn cloud(&self, places: &[DVec3]) -> PointCloud {
        let code = |c: f64| (255.0 * srgb_from_linear(c as f32)).round() as u8;
        PointCloud {
            origin_in_world: DVec3::ZERO,
            positions: places.iter().map(|p| p.as_vec3().to_array()).collect(),
            colours: places
                .iter()
                .map(|&p| self.colour(p).to_array().map(code))
                .collect(),
        }
    }
}

/// The picture of a scene: rays a quarter pixel apart, weighted by the pixel's Gaussian to two pixels.
pub(super) fn truth(scene: &Scene, camera: &Camera) -> Image {
    const SUB: i32 = 4;
    let (width, height) = (camera.width as i32, camera.height as i32);
    let world_from_camera = camera.camera_from_world.inverse();
    let margin = 2;
    let columns = (width + 2 * margin) * SUB;
    let ray = |i: i32| {
        let at = DVec2::new(f64::from(i % columns) + 0.5, f64::from(i / columns) + 0.5);
        let at = at / f64::from(SUB) - f64::from(margin);
        let (origin, direction) = camera.ray_in_camera(at);
        let origin = world_from_camera.transform_point3(origin);
        let hit = scene.hit(origin, world_from_camera.transform_vector3(direction));
        hit.map_or([0.0; 4], |p| scene.colour(p).extend(1.0).to_array())
    };
    let rays: Vec<[f64; 4]> = (0..columns * (height + 2 * margin) * SUB)
        .map(ray)
        .collect();
    let reach = 2 * margin * SUB + SUB;
    let weight = |i: i32| {
        let d = (f64::from(i) + 0.5 - 0.5 * f64::from(reach)) / (f64::from(SUB) * PIXEL_SIGMA_PX);
        (-0.5 * d * d).exp()
    };
    let weights: Vec<f64> = (0..reach).map(weight).collect();
    let total: f64 = weights.iter().sum::<f64>().powi(2);
    let mut image = Image::transparent(width as usize, height as usize);
    for (i, pixel) in image.rgba.iter_mut().enumerate() {
        let (x, y) = (i as i32 % width * SUB, i as i32 / width * SUB);
        let mut sum = [0.0; 4];
        for (row, wy) in weights.iter().enumerate() {
            let start = ((y + row as i32) * columns + x) as usize;
            for (ray, wx) in rays[start..].iter().zip(&weights) {
                for channel in 0..4 {
                    sum[channel] += wx * wy * ray[channel];
                }
            }
        }
        *pixel = sum.map(|s| (s / total) as f32);
    }
    image
}

pub(super) fn against(image: &Image, truth: &Image) -> Found {
    let (mut inside, mut whole, mut count) = (0.0, 0.0, 0.0);
    let (mut holes, mut extra, mut lacking, mut area) = (0, 0.0, 0.0, 0.0);
    for (found, expected) in image.rgba.iter().zip(&truth.rgba) {
        let square = |c: usize| f64::from(found[c] - expected[c]).powi(2);
        let colour = (0..3).map(square).sum::<f64>() / 3.0;
        if expected[3] > 0.9999 {
            (inside, count) = (inside + colour, count + 1.0);
            holes += usize::from(found[3] < 0.98);
        }
        whole += 0.75 * colour + 0.25 * square(3);
        extra += f64::from((found[3] - expected[3]).max(0.0));
        lacking += f64::from((expected[3] - found[3]).max(0.0));
        area += f64::from(expected[3]);
    }
    let db = |square: f64| -10.0 * square.log10();
    Found {
        inside_db: db(inside / count),
        whole_db: db(whole / truth.rgba.len() as f64),
        holes,
        false_fill: extra / area,
        lacking: lacking / area,
    }
}
