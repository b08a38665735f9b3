//! Gaussians as a volume, ray by ray: each Gaussian's optical depth spread along the ray by its profile, light gathered in steps of a
//! tenth of a standard deviation; pixels are means of 8x8 rays, weighted by the pixel's Gaussian.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use resample_core::Camera;
use volsplat::Gaussians;

/// Rays along a pixel's side; they stand over three standard deviations of the pixel's Gaussian to both sides.
const RAYS: usize = 8;

/// Standard deviation of the pixel's Gaussian, px.
const PIXEL_SIGMA_PX: f64 = 0.5;

/// Greatest opacity, so that optical depths are finite.
const MOST_OPACITY: f64 = 1.0 - 1.0 / 1_048_576.0;

/// A Gaussian on a ray.
#[derive(Clone, Copy, Debug)]
struct Met {
    /// Ray parameter of its peak, and its standard deviation there.
    peak: f64,
    sigma: f64,
    /// Its optical depth.
    depth: f64,
    colour: DVec3,
}

/// A Gaussian in the world, in f64.
#[derive(Clone, Copy, Debug)]
struct Solid {
    centre: DVec3,
    /// From the world to standard deviations.
    unit_from_world: DMat3,
    largest: f64,
    opacity: f64,
    colour: DVec3,
}

/// The Gaussians as one camera sees them.
pub struct GaussianTwin<'a> {
    camera: &'a Camera,
    solids: Vec<Solid>,
}

impl<'a> GaussianTwin<'a> {
    /// Prepares all of them; their colours are those towards the eye.
    pub fn new(gaussians: &Gaussians, camera: &'a Camera) -> Self {
        let eye = camera.eye_in_world();
        let solids = (0..gaussians.len()).map(|index| {
            let given = gaussians.get(index);
            let centre = gaussians.origin_in_world + given.centre.as_dvec3();
            let direction = match camera.projection {
                resample_core::Projection::Perspective => (centre - eye).normalize(),
                resample_core::Projection::Orthographic => camera.forward_in_world(),
            };
            let scales = given.scales.as_dvec3().max(DVec3::splat(1e-12));
            let rotation = DMat3::from_quat(given.rotation.as_dquat().normalize());
            Solid {
                centre,
                unit_from_world: DMat3::from_diagonal(1.0 / scales) * rotation.transpose(),
                largest: scales.max_element(),
                opacity: f64::from(given.opacity),
                colour: gaussians
                    .colour_towards(index, direction.as_vec3())
                    .as_dvec3(),
            }
        });
        Self {
            camera,
            solids: solids.collect(),
        }
    }

    /// The pixel in the blend space, times opacity, and its opacity.
    pub fn pixel(&self, x: usize, y: usize) -> [f64; 4] {
        let middle = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let near = self.near_ray(middle);
        let rays: Vec<(DVec2, f64)> = (0..RAYS * RAYS)
            .map(|at| {
                let offset = DVec2::new((at % RAYS) as f64, (at / RAYS) as f64);
                let offset = ((offset + 0.5) / RAYS as f64 * 2.0 - 1.0) * 3.0 * PIXEL_SIGMA_PX;
                let weight = (-0.5 * offset.length_squared() / PIXEL_SIGMA_PX.powi(2)).exp();
                (middle + offset, weight)
            })
            .collect();
        let total: f64 = rays.iter().map(|(_, weight)| weight).sum();
        let seen = rays.par_iter().map(|(pos_in_screen, weight)| {
            self.ray(&near, *pos_in_screen).map(|c| c * weight / total)
        });
        let seen: Vec<_> = seen.collect();
        seen.iter().fold([0.0; 4], |mut sum, ray| {
            for (sum, value) in sum.iter_mut().zip(ray) {
                *sum += value;
            }
            sum
        })
    }

    fn ray_in_world(&self, pos_in_screen: DVec2) -> (DVec3, DVec3) {
        let (origin, direction) = self.camera.ray_in_camera(pos_in_screen);
        let world_from_camera = self.camera.camera_from_world.inverse();
        (
            world_from_camera.transform_point3(origin),
            world_from_camera.transform_vector3(direction),
        )
    }

    /// Those whose sphere of five standard deviations comes near a pixel's rays.
    fn near_ray(&self, pos_in_screen: DVec2) -> Vec<Solid> {
        let (origin, direction) = self.ray_in_world(pos_in_screen);
        let (_, beside) = self.ray_in_world(pos_in_screen + DVec2::new(2.2, 2.2));
        let (side, _) = self.ray_in_world(pos_in_screen + DVec2::new(2.2, 2.2));
        let spread = (beside - direction).length();
        let apart = (side - origin).length();
        let unit = direction.normalize();
        let is_near = |solid: &&Solid| {
            let to_centre = solid.centre - origin;
            let along = to_centre.dot(unit);
            let across = to_centre.cross(unit).length();
            let reach = 5.0 * solid.largest;
            across <= reach + apart + spread * (along.abs() + reach) / direction.length()
        };
        self.solids.iter().filter(is_near).copied().collect()
    }

    fn ray(&self, solids: &[Solid], pos_in_screen: DVec2) -> [f64; 4] {
        let (origin, direction) = self.ray_in_world(pos_in_screen);
        let met: Vec<Met> = solids
            .iter()
            .filter_map(|solid| {
                let to_eye = solid.unit_from_world * (origin - solid.centre);
                let along = solid.unit_from_world * direction;
                let density = along.length_squared();
                let peak = -along.dot(to_eye) / density;
                let q = (to_eye + peak * along).length_squared();
                let opacity = (solid.opacity * (-0.5 * q).exp()).min(MOST_OPACITY);
                (opacity > 1e-5).then(|| Met {
                    peak,
                    sigma: 1.0 / density.sqrt(),
                    depth: -(-opacity).ln_1p(),
                    colour: solid.colour,
                })
            })
            .collect();
        gathered(&met, self.camera.near)
    }
}

/// Light gathered along a ray, from the near plane on.
fn gathered(met: &[Met], near: f64) -> [f64; 4] {
    /// Steps in which a profile is cut, standard deviations, and how far it reaches.
    const STEP: f64 = 0.1;
    const STEPS: i32 = 45;
    const REACH: f64 = 4.5;
    let mut ends: Vec<f64> = met
        .iter()
        .flat_map(|met| (-STEPS..=STEPS).map(|k| met.peak + f64::from(k) * STEP * met.sigma))
        .filter(|z| *z > near)
        .collect();
    ends.push(near);
    ends.sort_by(f64::total_cmp);
    let mut begun: Vec<&Met> = met.iter().collect();
    begun.sort_by(|a, b| f64::total_cmp(&(a.peak - REACH * a.sigma), &(b.peak - REACH * b.sigma)));
    let (mut colour, mut left) = (DVec3::ZERO, 1.0);
    let (mut active, mut next): (Vec<&Met>, usize) = (Vec::new(), 0);
    for pair in ends.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        while next < begun.len() && begun[next].peak - REACH * begun[next].sigma <= from {
            active.push(begun[next]);
            next += 1;
        }
        active.retain(|met| met.peak + REACH * met.sigma > from);
        let (mut depth, mut emitted) = (0.0, DVec3::ZERO);
        for met in &active {
            let before = |z: f64| 0.5 * libm::erfc(-(z - met.peak) / met.sigma * 0.5f64.sqrt());
            let part = met.depth * (before(to) - before(from));
            depth += part;
            emitted += part * met.colour;
        }
        if depth > 0.0 {
            let opacity = -(-depth).exp_m1();
            colour += left * opacity / depth * emitted;
            left *= 1.0 - opacity;
            if left < 1e-5 {
                break;
            }
        }
    }
    [colour.x, colour.y, colour.z, 1.0 - left]
}
