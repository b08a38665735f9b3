//! Light on a sample, and differences of fourth order, in f64 and by definition.
//!
//! Takes what the options say of light and gradients; gives what they make of a colour and an extinction. The constants are
//! those of the shading's documentation. Source: B. T. Phong, Communications of the ACM 18(6), 1975.

use glam::{DMat3, DVec3};
use resample_core::Camera;
use volsplat::{Light, RenderOptions, Shading, Volume};

/// Ambient and diffuse share, highlight and its exponent.
const AMBIENT: f64 = 0.3;
const DIFFUSE: f64 = 0.7;
const SPECULAR: f64 = 0.2;
const POWER: i32 = 20;

/// Returns true if the options need gradients.
pub fn needs_gradients(options: &RenderOptions) -> bool {
    options.shading != Shading::None || options.gradient_opacity.is_some()
}

/// Red, green, blue of a sample as light leaves them.
pub fn lit(
    options: &RenderOptions,
    camera: &Camera,
    rgb: [f64; 3],
    (gradient, ray): (DVec3, DVec3),
) -> [f64; 3] {
    if options.shading == Shading::None {
        return rgb;
    }
    let light = match options.light {
        Light::Headlight => -camera.forward_in_world(),
        Light::Towards(direction) => direction,
    };
    let (light, normal) = (light.normalize(), gradient.normalize_or_zero());
    let body = AMBIENT + DIFFUSE * normal.dot(light).abs();
    let mirrored = 2.0 * normal.dot(light) * normal - light;
    let shines = options.shading == Shading::Phong && normal != DVec3::ZERO;
    let highlight = if shines {
        SPECULAR * (-mirrored.dot(ray.normalize())).max(0.0).powi(POWER)
    } else {
        0.0
    };
    rgb.map(|c| c * body + highlight)
}

/// The factor of the extinction that follows the gradient.
pub fn ramp(options: &RenderOptions, gradient: DVec3) -> f64 {
    let curve = options.gradient_opacity.as_ref();
    curve.map_or(1.0, |curve| curve.at(gradient.length()))
}

/// The gradient, in the world, at a place between voxels: the mean over the voxels around it, which is the voxel's own at a
/// voxel. `values` stand for the voxels, x fastest; what lies beyond the volume is the nearest inside.
pub fn gradient_of(volume: &Volume, values: &[f64], at: DVec3) -> DVec3 {
    let dims = volume.dims.map(|n| n as i64);
    let value = |place: [i64; 3]| {
        let [x, y, z] = [0, 1, 2].map(|axis| place[axis].clamp(0, dims[axis] - 1));
        values[(x + dims[0] * (y + dims[1] * z)) as usize]
    };
    let at_voxel = |voxel: [i64; 3]| {
        let along = |axis: usize| {
            let moved = |by: i64| {
                let mut place = [0, 1, 2].map(|axis| voxel[axis].clamp(0, dims[axis] - 1));
                place[axis] += by;
                value(place)
            };
            (moved(-2) - 8.0 * moved(-1) + 8.0 * moved(1) - moved(2)) / 12.0
        };
        DVec3::new(along(0), along(1), along(2))
    };
    let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
    for corner in 0..8i64 {
        let voxel = [0, 1, 2].map(|axis| at[axis].floor() as i64 + (corner >> axis & 1));
        let near = |axis: usize| 1.0 - (voxel[axis] as f64 - at[axis]).abs();
        let weight = near(0) * near(1) * near(2);
        sum += weight * at_voxel(voxel);
        weights += weight;
    }
    let world_from_gradient: DMat3 = volume.world_from_index.matrix3.inverse().transpose();
    world_from_gradient * (sum / weights)
}
