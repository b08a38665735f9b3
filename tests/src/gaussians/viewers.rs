//! Gaussians as other viewers draw them, pixel by pixel: every Gaussian's affine footprint in the order of the centres, in f64.

use glam::{DMat3, DVec3};
use resample_core::Camera;
use volsplat::{GaussianModel, Gaussians};

/// A Gaussian's ellipse on the screen.
struct Ellipse {
    z: f64,
    centre: [f64; 2],
    /// xx, xy, yy, px squared.
    covariance: [f64; 3],
    opacity: f64,
    colour: DVec3,
}

/// The Gaussians as one perspective camera sees them.
pub struct ViewerTwin {
    ellipses: Vec<Ellipse>,
    most_opacity: f64,
    least_opacity: f64,
}

impl ViewerTwin {
    /// Prepares all of them.
    pub fn new(gaussians: &Gaussians, camera: &Camera, model: GaussianModel) -> Self {
        let all = (0..gaussians.len()).filter_map(|at| ellipse(gaussians, at, camera, model));
        let mut ellipses: Vec<Ellipse> = all.collect();
        ellipses.sort_by(|a, b| a.z.total_cmp(&b.z));
        let [most_opacity, least_opacity] = match model {
            GaussianModel::Khr => [1.0, 0.0],
            _ => [0.99, 1.0 / 255.0],
        };
        Self {
            ellipses,
            most_opacity,
            least_opacity,
        }
    }

    /// The pixel in the blend space, times opacity, and its opacity.
    pub fn pixel(&self, x: usize, y: usize) -> [f64; 4] {
        let (mut colour, mut left) = (DVec3::ZERO, 1.0);
        for ellipse in &self.ellipses {
            let dx = x as f64 + 0.5 - ellipse.centre[0];
            let dy = y as f64 + 0.5 - ellipse.centre[1];
            let [a, b, c] = ellipse.covariance;
            let q = (c * dx * dx - 2.0 * b * dx * dy + a * dy * dy) / (a * c - b * b);
            let opacity = (ellipse.opacity * (-0.5 * q).exp()).min(self.most_opacity);
            if opacity >= self.least_opacity {
                colour += left * opacity * ellipse.colour;
                left *= 1.0 - opacity;
            }
        }
        [colour.x, colour.y, colour.z, 1.0 - left]
    }
}

fn ellipse(
    gaussians: &Gaussians,
    at: usize,
    camera: &Camera,
    model: GaussianModel,
) -> Option<Ellipse> {
    let given = gaussians.get(at);
    let in_world = gaussians.origin_in_world + given.centre.as_dvec3();
    let m = camera.camera_from_world.transform_point3(in_world);
    if m.z <= camera.near {
        return None;
    }
    let rotation = DMat3::from_quat(given.rotation.as_dquat().normalize());
    let axes =
        camera.camera_from_world.matrix3 * rotation * DMat3::from_diagonal(given.scales.as_dvec3());
    let covariance = axes * axes.transpose();
    let (mut u, mut v) = (m.x / m.z, m.y / m.z);
    if model != GaussianModel::Khr {
        // The scenes' cameras have their principal point in the middle.
        let bound = |size: u32, focal: f64| 1.3 * 0.5 * f64::from(size) / focal;
        u = u.clamp(
            -bound(camera.width, camera.fx),
            bound(camera.width, camera.fx),
        );
        v = v.clamp(
            -bound(camera.height, camera.fy),
            bound(camera.height, camera.fy),
        );
    }
    let rows = [
        DVec3::new(camera.fx / m.z, 0.0, -camera.fx * u / m.z),
        DVec3::new(0.0, camera.fy / m.z, -camera.fy * v / m.z),
    ];
    let entry = |i: usize, k: usize| rows[i].dot(covariance * rows[k]);
    let [a, b, c] = [entry(0, 0), entry(0, 1), entry(1, 1)];
    let (wider, keeps_light) = match model {
        GaussianModel::Inria => (0.3, false),
        GaussianModel::Mip => (0.1, true),
        GaussianModel::Khr | GaussianModel::Volume => (0.0, false),
    };
    let (wide_a, wide_c) = (a + wider, c + wider);
    let ratio = (a * c - b * b) / (wide_a * wide_c - b * b);
    let kept = if keeps_light {
        ratio.max(0.0).sqrt()
    } else {
        1.0
    };
    let direction = (in_world - camera.eye_in_world()).normalize();
    Some(Ellipse {
        z: m.z,
        centre: [
            camera.fx * m.x / m.z + camera.cx,
            camera.fy * m.y / m.z + camera.cy,
        ],
        covariance: [wide_a, b, wide_c],
        opacity: f64::from(given.opacity) * kept,
        colour: gaussians.colour_towards(at, direction.as_vec3()).as_dvec3(),
    })
}
