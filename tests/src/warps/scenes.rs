//! Analytic scenes for depth-image warping: flat cards and spheres with a smooth pattern, ray-traced in f64.
//!
//! A scene gives a reference view and true views from any camera: one ray a pixel centre, or several over the pixel's
//! Gaussian. The pattern varies slowly against the references that the tests take, so that what a test measures is
//! geometry and not the pattern's aliasing.
//!
//! Limits: no light, no shadow; a view misses empty space only, which is NaN in depth and black.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, Image, Intrinsics, PixelCentre};
use warp3d::Reference;

use crate::warps::truth::Truth;

/// A body.
#[derive(Clone, Copy, Debug)]
pub enum Body {
    /// A flat card: centre, half axes.
    Card(DVec3, DVec3, DVec3),
    /// A flat ellipse: centre, half axes.
    Leaf(DVec3, DVec3, DVec3),
    /// A sphere: centre, radius.
    Sphere(DVec3, f64),
    /// A flat ellipse that has moved by the last vector, and its pattern with it.
    MovedLeaf(DVec3, DVec3, DVec3, DVec3),
    /// A sphere that has moved by the last vector, and its pattern with it.
    MovedSphere(DVec3, f64, DVec3),
}

/// Bodies with the period of their pattern, world units, and their tint.
#[derive(Clone, Debug)]
pub struct AnalyticScene(pub Vec<(Body, f64, [f64; 3])>);

/// The surface that a ray meets.
#[derive(Clone, Copy, Debug)]
struct Met {
    camera_z: f64,
    pos_in_world: DVec3,
    rgb: [f64; 3],
    moves: bool,
}

/// A camera of `size` px with focal length `focal_px` at `eye`, turned by `yaw_rad` about the vertical axis.
pub fn camera(size: [u32; 2], focal_px: f64, eye: DVec3, yaw_rad: f64) -> Camera {
    let intrinsics = Intrinsics {
        width: size[0],
        height: size[1],
        fx: focal_px,
        fy: focal_px,
        cx: 0.5 * f64::from(size[0]),
        cy: 0.5 * f64::from(size[1]),
        pixel_centre: PixelCentre::Half,
    };
    let rotation = DMat3::from_rotation_y(yaw_rad);
    Camera::from_intrinsics(&intrinsics, rotation, rotation * -eye, 1e-3).expect("a camera")
}

impl AnalyticScene {
    /// A wall, a card before it, a ball, a thin pole and slanted ground.
    pub fn room() -> Self {
        let wall = Body::Card(DVec3::new(0.0, 0.0, 9.0), DVec3::X * 12.0, DVec3::Y * 9.0);
        let card = Body::Card(
            DVec3::new(-1.2, -0.3, 5.0),
            DVec3::new(0.8, 0.0, 0.3),
            DVec3::Y * 0.9,
        );
        let pole = Body::Card(DVec3::new(0.1, 0.0, 4.0), DVec3::X * 0.03, DVec3::Y * 3.0);
        let ground = Body::Card(DVec3::new(0.0, 1.6, 6.0), DVec3::X * 8.0, DVec3::Z * 3.5);
        let ball = Body::Sphere(DVec3::new(1.3, 0.2, 5.0), 0.8);
        Self(vec![
            (wall, 2.0, [0.8, 0.8, 0.75]),
            (card, 0.5, [0.9, 0.5, 0.2]),
            (pole, 0.8, [0.2, 0.3, 0.9]),
            (ground, 1.0, [0.3, 0.7, 0.3]),
            (ball, 0.6, [0.7, 0.3, 0.6]),
        ])
    }

    /// One wall across the view, turned by `yaw_rad`.
    pub fn wall(yaw_rad: f64) -> Self {
        let across = DVec3::new(yaw_rad.cos(), 0.0, yaw_rad.sin()) * 20.0;
        Self(vec![(
            Body::Card(DVec3::Z * 5.0, across, DVec3::Y * 20.0),
            3.0,
            [0.8, 0.7, 0.6],
        )])
    }

    /// The view of a camera: one ray a pixel centre.
    pub fn reference(&self, camera: &Camera) -> Reference {
        let seen = self.rays(camera, |met| met);
        Reference {
            camera: *camera,
            colour: seen
                .iter()
                .map(|m| m.map_or([0.0; 3], |m| m.rgb.map(|v| v as f32)))
                .collect(),
            depth: seen
                .iter()
                .map(|m| m.map_or(f32::NAN, |m| m.camera_z as f32))
                .collect(),
        }
    }

    /// The true view of `target`, and what of it `reference` sees.
    pub fn truth(&self, target: &Camera, reference: &Camera) -> Truth {
        let seen = self.rays(target, |met| met);
        let mut image = Image::transparent(target.width as usize, target.height as usize);
        for (pixel, met) in image.rgba.iter_mut().zip(&seen) {
            let [r, g, b] = met.map_or([0.0; 3], |m| m.rgb.map(|v| v as f32));
            *pixel = [r, g, b, 1.0];
        }
        Truth {
            depth: seen
                .iter()
                .map(|m| m.map_or(f32::INFINITY, |m| m.camera_z as f32))
                .collect(),
            seen: self.seen(target, reference),
            image,
        }
    }

    /// For each pixel centre of `target`, 1 if `reference` sees the same point, else 0.
    pub(crate) fn seen(&self, target: &Camera, reference: &Camera) -> Vec<f32> {
        let sees = |m: Option<Met>| m.is_some_and(|m| self.sees(reference, m.pos_in_world));
        self.rays(target, |met| f32::from(u8::from(sees(met))))
    }

    /// For each pixel centre of `camera`, the place that it shows, if that belongs to a body that has not moved.
    pub fn places(&self, camera: &Camera) -> Vec<Option<DVec3>> {
        self.rays(camera, |met| {
            met.filter(|met| !met.moves).map(|met| met.pos_in_world)
        })
    }

    /// Returns true if `camera` sees the place.
    pub fn sees(&self, camera: &Camera, pos_in_world: DVec3) -> bool {
        let pos = camera.camera_from_world.transform_point3(pos_in_world);
        let at = camera.screen_from_camera(pos);
        let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
        let inside = pos.z > 0.0 && at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all();
        inside
            && self
                .ray(camera, at)
                .is_some_and(|met| met.camera_z > pos.z * (1.0 - 1e-6))
    }

    fn rays<T: Send>(&self, camera: &Camera, of: impl Fn(Option<Met>) -> T + Sync) -> Vec<T> {
        let width = camera.width as usize;
        let pixel = |i: usize| DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        (0..width * camera.height as usize)
            .into_par_iter()
            .map(|i| of(self.ray(camera, pixel(i))))
            .collect()
    }

    fn ray(&self, camera: &Camera, pos_in_screen: DVec2) -> Option<Met> {
        let (_, direction) = camera.ray_in_camera(pos_in_screen);
        let eye = camera.eye_in_world();
        let direction = camera.camera_from_world.matrix3.transpose() * direction;
        let hits = self.0.iter().filter_map(|(body, period, tint)| {
            let camera_z = body.hit(eye, direction)?;
            let pos_in_world = eye + camera_z * direction;
            Some(Met {
                camera_z,
                pos_in_world,
                moves: matches!(body, Body::MovedLeaf(..) | Body::MovedSphere(..)),
                rgb: pattern((pos_in_world - body.moved_by()) / *period, *tint),
            })
        });
        hits.min_by(|a, b| a.camera_z.total_cmp(&b.camera_z))
    }
}

impl Body {
    /// How far it has moved from where its pattern was painted.
    fn moved_by(&self) -> DVec3 {
        match *self {
            Self::MovedLeaf(.., by) | Self::MovedSphere(.., by) => by,
            Self::Card(..) | Self::Leaf(..) | Self::Sphere(..) => DVec3::ZERO,
        }
    }

    fn hit(&self, eye: DVec3, direction: DVec3) -> Option<f64> {
        // How far along the two half axes a plane is met, in parts of these.
        let on_plane = |centre: DVec3, u: DVec3, v: DVec3| {
            let normal = u.cross(v);
            let t = normal.dot(centre - eye) / normal.dot(direction);
            let offset = eye + t * direction - centre;
            let part = |axis: DVec3| offset.dot(axis) / axis.length_squared();
            (t, part(u), part(v))
        };
        match *self {
            Self::Card(centre, u, v) => {
                let (t, along, across) = on_plane(centre, u, v);
                (t > 1e-6 && along.abs() <= 1.0 && across.abs() <= 1.0).then_some(t)
            }
            Self::Leaf(centre, u, v) | Self::MovedLeaf(centre, u, v, _) => {
                let (t, along, across) = on_plane(centre, u, v);
                (t > 1e-6 && along.hypot(across) <= 1.0).then_some(t)
            }
            Self::Sphere(centre, radius) | Self::MovedSphere(centre, radius, _) => {
                let to = eye - centre;
                let (a, b) = (direction.length_squared(), to.dot(direction));
                let root = (b * b - a * (to.length_squared() - radius * radius)).sqrt();
                let t = (-b - root) / a;
                (t > 1e-6).then_some(t)
            }
        }
    }
}

fn pattern(p: DVec3, tint: [f64; 3]) -> [f64; 3] {
    let wave = |v: f64| (std::f64::consts::TAU * v).sin();
    let level = 0.6 + 0.2 * wave(p.x) * wave(p.y + 0.25) + 0.15 * wave(p.z + 0.3 * p.x);
    tint.map(|t| t * level)
}
