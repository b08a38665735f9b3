//! A formula for a picture with depth, and for its true view from any other place. Demonstrations and benchmarks draw it where they have no file.

use glam::DVec3;
use resample_core::Image;

/// Size of the picture, px, and its field of view from top to bottom, degrees.
pub const SIZE_PX: [usize; 2] = [320, 240];
/// See [`SIZE_PX`].
pub const FOV_Y_DEG: f64 = 50.0;

/// Rays of a pixel along its side: the picture is a photograph, whose pixels are means.
pub const PHOTOGRAPH_SAMPLES: usize = 4;

/// The place of the new view, world units.
pub const NEW_EYE: DVec3 = DVec3::new(0.15, 0.05, 0.2);

/// The picture and its depth as an eye at a place sees them, each pixel the mean of `samples` by `samples` rays.
///
/// A ball of radius 1 at (0, 0, 4) before the wall z = 6 + 0.3 x, both with a checkerboard; x right, y down, z forward.
pub fn ball_before_wall(eye: DVec3, samples: usize) -> Image {
    let [width, height] = SIZE_PX;
    let focal_px = 0.5 * height as f64 / (0.5 * FOV_Y_DEG.to_radians()).tan();
    let mut image = Image::transparent(width, height);
    let mut depth = vec![0.0; width * height];
    for (index, (pixel, depth)) in image.rgba.iter_mut().zip(&mut depth).enumerate() {
        let ray = |sub: [f64; 2]| {
            let x = ((index % width) as f64 + sub[0] - 0.5 * width as f64) / focal_px;
            let y = ((index / width) as f64 + sub[1] - 0.5 * height as f64) / focal_px;
            DVec3::new(x, y, 1.0)
        };
        // The depth of a pixel is that of its centre.
        *depth = seen(eye, ray([0.5; 2])).1 as f32;
        let weight = 1.0 / (samples * samples) as f32;
        for k in 0..samples * samples {
            let sub = [k % samples, k / samples].map(|i| (i as f64 + 0.5) / samples as f64);
            let colour = seen(eye, ray(sub)).0;
            (0..3).for_each(|c| pixel[c] += weight * colour[c]);
        }
        pixel[3] = 1.0;
    }
    image.depth = Some(depth);
    image
}

/// The colour and the camera z of the point that a ray hits first. The ray's direction has z = 1.
fn seen(eye: DVec3, ray: DVec3) -> ([f32; 3], f64) {
    let wall = (6.0 + 0.3 * eye.x - eye.z) / (1.0 - 0.3 * ray.x);
    let to_ball = DVec3::new(0.0, 0.0, 4.0) - eye;
    let (a, b) = (ray.length_squared(), ray.dot(to_ball));
    let under_root = b * b - a * (to_ball.length_squared() - 1.0);
    let (z, scale) = if under_root > 0.0 {
        ((b - under_root.sqrt()) / a, 4.0)
    } else {
        (wall, 1.5)
    };
    let at = eye + z * ray;
    let odd = ((at.x * scale).floor() + (at.y * scale).floor()).rem_euclid(2.0);
    let light = (0.2 + 0.6 * odd) as f32;
    ([light, 0.6 * light, (0.2 + 0.1 * at.z) as f32 * light], z)
}
