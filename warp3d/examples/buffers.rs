//! Draws a picture with depth, both in memory, as it is seen from another place, to `buffers.ppm`.

use glam::DVec3;
use resample_core::image::srgb_from_linear;
use resample_core::{Camera, CameraError, LookAt};
use warp3d::{Reference, WarpOptions, Warper};

fn camera_at(x: f64) -> Result<Camera, CameraError> {
    let pose = LookAt {
        position: DVec3::new(x, 0.0, 0.0),
        target: DVec3::new(x, 0.0, 1.0),
        up: DVec3::NEG_Y,
    };
    Camera::perspective(&pose, 0.8, [400, 300])
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A chequered wall four units away and a disc before it, two units away.
    let (mut colour, mut depth) = (Vec::new(), Vec::new());
    for (x, y) in (0..300).flat_map(|y: i32| (0..400).map(move |x: i32| (x, y))) {
        let is_disc = (x - 200).pow(2) + (y - 150).pow(2) < 3600;
        let wall = [0.1 + 0.5 * ((x / 25 + y / 25) % 2) as f32; 3];
        colour.push(if is_disc { [0.8, 0.2, 0.1] } else { wall });
        depth.push(if is_disc { 2.0 } else { 4.0 });
    }
    let reference = Reference {
        camera: camera_at(0.0)?,
        colour,
        depth,
    };
    let mut warper = Warper::new(vec![reference], &WarpOptions::default())?;
    let image = warper.render(&camera_at(0.2)?)?.image;

    let mut file = b"P6 400 300 255\n".to_vec();
    for pixel in &image.rgba {
        let code = |channel: f32| (255.0 * srgb_from_linear(channel) + 0.5) as u8;
        file.extend(pixel[..3].iter().map(|&channel| code(channel)));
    }
    Ok(std::fs::write("buffers.ppm", file)?)
}
