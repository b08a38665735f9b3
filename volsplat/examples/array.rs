//! A volume from an array in memory: `cargo run --release -p volsplat --example array` writes `array.ppm`.

use std::error::Error;

use glam::{DAffine3, DVec3};
use resample_core::Framing;
use volsplat::{ColourMap, Described, RenderOptions, Renderer, TransferFunction, Volume, Voxels};

fn main() -> Result<(), Box<dyn Error>> {
    // A ball with a wave on it, x fastest.
    let side = 96;
    let value = |i: usize| {
        let at = DVec3::new(
            (i % side) as f64,
            (i / side % side) as f64,
            (i / side / side) as f64,
        );
        let from_middle = at - 0.5 * side as f64;
        (1.0 - from_middle.length() / 45.0 + 0.1 * (0.4 * at.x).sin()).max(0.0) as f32
    };
    let voxels = Voxels::F32((0..side * side * side).map(value).collect());
    let volume = Volume::new([side; 3], voxels, DAffine3::IDENTITY)?;

    let transfer = TransferFunction::automatic(&volume.histogram(), ColourMap::default());
    let mut renderer = Renderer::new(&volume, &transfer, &RenderOptions::default())?;
    let bounds = renderer
        .visible_bounds_in_world()
        .ok_or("nothing is visible")?;
    let framing = Framing {
        towards_eye: DVec3::new(0.5, 0.4, 1.0),
        up: DVec3::Y,
        fov_y_rad: 0.5,
    };
    let frame = renderer.render(&framing.camera(bounds, [640, 480])?)?;

    let image = frame.image.over_background([1.0; 3]);
    let mut file = format!("P6 {} {} 255\n", image.width, image.height).into_bytes();
    file.extend(image.srgb8().as_flattened());
    Ok(std::fs::write("array.ppm", file)?)
}
