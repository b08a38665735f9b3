//! Gaussians by formula: a knot covered with discs as training leaves them, a soft ball, a room with large and small ones.

use glam::{DVec3, Quat, Vec3};
use resample_core::narrow::single;
use resample_core::{Camera, LookAt};
use volsplat::{Gaussian, Gaussians};

/// Numbers that look random, 0 to 1.
#[derive(Clone, Copy, Debug)]
pub struct Numbers(pub u64);

impl Numbers {
    /// The next one.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A normal deviate.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().max(1e-300).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// A trefoil knot of radius 1 and a bit, covered with `count` discs of many sizes and opacities, with a pattern of colours.
pub fn knot(count: usize, seed: u64) -> Gaussians {
    let mut numbers = Numbers(seed);
    let mut all = Gaussians::with_capacity(1, count);
    // Discs overlap about three times over.
    let spacing = (2.0 * 10.0 * 0.25 * std::f64::consts::TAU / count as f64).sqrt();
    for _ in 0..count {
        let t = std::f64::consts::TAU * numbers.uniform();
        let angle = std::f64::consts::TAU * numbers.uniform();
        let (centre, normal) = tube(t, angle);
        let centre = centre + normal * 0.3 * spacing * numbers.normal();
        let tilt = DVec3::new(numbers.normal(), numbers.normal(), numbers.normal()) * 0.15;
        let towards = (normal + tilt).normalize();
        let rotation = Quat::from_rotation_arc(Vec3::Z, towards.as_vec3())
            * Quat::from_rotation_z(single(std::f64::consts::TAU * numbers.uniform()));
        let size = spacing * (0.5 * numbers.normal()).exp();
        let long = (0.4 * numbers.normal()).exp();
        let scales = DVec3::new(size * long, size / long, 0.15 * size);
        let pattern = 0.5 + 0.4 * (24.0 * t).sin() * (6.0 * angle).sin();
        let hue = DVec3::new(pattern, 0.3 + 0.4 * numbers.uniform(), 1.0 - pattern);
        // Opacities as training leaves them: many near 1, many faint.
        let opacity = 1.0 / (1.0 + (-2.0 * numbers.normal() - 0.5).exp());
        let coefficients: Vec<f32> = (0..9).map(|_| single(0.08 * numbers.normal())).collect();
        let gaussian = Gaussian {
            centre: centre.as_vec3(),
            rotation,
            scales: scales.as_vec3(),
            opacity: single(opacity),
            colour: hue.as_vec3(),
        };
        all.push(&gaussian, &coefficients).expect("finite numbers");
    }
    all
}

fn tube(t: f64, angle: f64) -> (DVec3, DVec3) {
    let curve = |t: f64| {
        DVec3::new(
            t.sin() + 2.0 * (2.0 * t).sin(),
            t.cos() - 2.0 * (2.0 * t).cos(),
            -(3.0 * t).sin(),
        ) / 3.0
    };
    let along = (curve(t + 1e-4) - curve(t - 1e-4)).normalize();
    let side = along.cross(DVec3::new(0.3, 0.2, 1.0)).normalize();
    let normal = angle.cos() * side + angle.sin() * along.cross(side);
    (curve(t) + 0.25 * normal, normal)
}

/// A soft ball of `count` round Gaussians that overlap in depth everywhere.
pub fn ball(count: usize, seed: u64) -> Gaussians {
    let mut numbers = Numbers(seed);
    let mut all = Gaussians::with_capacity(0, count);
    for _ in 0..count {
        let centre = 0.4 * DVec3::new(numbers.normal(), numbers.normal(), numbers.normal());
        let size = 0.12 * (0.4 * numbers.normal()).exp();
        let scales = DVec3::new(
            size * (0.5 * numbers.normal()).exp(),
            size * (0.5 * numbers.normal()).exp(),
            size * (0.5 * numbers.normal()).exp(),
        );
        let rotation = Quat::from_xyzw(
            single(numbers.normal()),
            single(numbers.normal()),
            single(numbers.normal()),
            single(numbers.normal()),
        );
        let gaussian = Gaussian {
            centre: centre.as_vec3(),
            rotation,
            scales: scales.as_vec3(),
            opacity: single(0.02 + 0.6 * numbers.uniform() * numbers.uniform()),
            colour: DVec3::new(numbers.uniform(), numbers.uniform(), numbers.uniform()).as_vec3(),
        };
        all.push(&gaussian, &[]).expect("finite numbers");
    }
    all
}

/// A camera that looks at the origin.
pub fn camera(position: DVec3, fov_y_deg: f64, size: [u32; 2]) -> Camera {
    let pose = LookAt {
        position,
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    Camera::perspective(&pose, fov_y_deg.to_radians(), size).expect("a camera")
}
