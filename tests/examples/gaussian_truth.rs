//! Pixels of the truth of a file of Gaussians, to compare other programs with: random ones that are covered, a line each with column,
//! row, red, green, blue and opacity in the blend space, times opacity.
//!
//! `cargo run --release -p resample-tests --example gaussian_truth FILE CAMERA.json [PIXELS]`; the camera has width, height, fx, fy,
//! cx, cy, R and t.

use std::path::Path;

use glam::{DMat3, DVec3};
use resample_core::{Camera, Intrinsics, PixelCentre};
use resample_tests::gaussians::scenes::Numbers;
use resample_tests::gaussians::twin::GaussianTwin;
use volsplat::GaussianLoadOptions;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [file, camera, pixels @ ..] = words.as_slice() else {
        return Err("expected FILE CAMERA.json [PIXELS]".into());
    };
    let count: usize = pixels.first().map_or(Ok(200), |word| word.parse())?;
    let (gaussians, _) =
        volsplat::load_gaussians(Path::new(file), &GaussianLoadOptions::default())?;
    let camera = camera_of(&std::fs::read_to_string(camera)?)?;
    let twin = GaussianTwin::new(&gaussians, &camera);
    let mut numbers = Numbers(7);
    let mut found = 0;
    for _ in 0..40 * count {
        if found == count {
            break;
        }
        let x = (numbers.uniform() * f64::from(camera.width)) as usize;
        let y = (numbers.uniform() * f64::from(camera.height)) as usize;
        let [r, g, b, opacity] = twin.pixel(x, y);
        if opacity > 0.05 {
            println!("{x} {y} {r:.6} {g:.6} {b:.6} {opacity:.6}");
            found += 1;
        }
    }
    Ok(())
}

fn camera_of(text: &str) -> Result<Camera, Box<dyn std::error::Error>> {
    let json: serde_json::Value = serde_json::from_str(text)?;
    let number = |name: &str| json[name].as_f64().ok_or_else(|| format!("no {name}"));
    let numbers = |name: &str| -> Vec<f64> {
        let values = json[name].as_array().into_iter().flatten();
        values.filter_map(serde_json::Value::as_f64).collect()
    };
    let rows: [f64; 9] = numbers("R")
        .try_into()
        .map_err(|_| "R has not nine numbers")?;
    let t: [f64; 3] = numbers("t")
        .try_into()
        .map_err(|_| "t has not three numbers")?;
    let intrinsics = Intrinsics {
        width: number("width")? as u32,
        height: number("height")? as u32,
        fx: number("fx")?,
        fy: number("fy")?,
        cx: number("cx")?,
        cy: number("cy")?,
        pixel_centre: PixelCentre::Half,
    };
    let rotation = DMat3::from_cols_array(&rows).transpose();
    Ok(Camera::from_intrinsics(
        &intrinsics,
        rotation,
        DVec3::from(t),
        1e-3,
    )?)
}
