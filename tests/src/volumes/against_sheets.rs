//! A rendered picture against the f64 reference of image sheets, pixel by pixel.
//!
//! Takes a scene, gives the largest difference beyond what the reference admits for the pixel (table and faces).

use crate::twins::samples::Scene;
use crate::twins::sheets::{SheetPixel, render as reference};
use crate::volumes::scenes::render;

/// Rounding of f32 sums over up to a few hundred slabs, beside what a reference admits.
pub const ROUNDING: f64 = 1e-5;

/// How a picture compares with its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The largest difference of a channel.
    pub worst: f64,
    /// The largest difference beyond what its pixel admits.
    pub beyond: f64,
    /// Pixels that show something: an opacity above 0.1.
    pub seen: usize,
}

/// Renders the scene and compares it with its reference.
pub fn compare(scene: &Scene) -> Comparison {
    let image = render(scene.volume, scene.transfer, scene.options, scene.camera);
    compared(&image, &reference(scene))
}

/// Compares a picture with reference pixels, row by row.
pub fn compared(image: &resample_core::Image, truth: &[SheetPixel]) -> Comparison {
    let mut result = Comparison {
        worst: 0.0,
        beyond: 0.0,
        seen: 0,
    };
    for (got, truth) in image.rgba.iter().zip(truth) {
        let [r, g, b] = truth.rgb;
        let pairs = got.iter().zip([r, g, b, 1.0 - truth.transmittance]);
        let error = pairs
            .map(|(got, expected)| (f64::from(*got) - expected).abs())
            .fold(0.0, f64::max);
        result.worst = result.worst.max(error);
        result.beyond = result.beyond.max(error - truth.slack);
        result.seen += usize::from(truth.transmittance < 0.9);
    }
    result
}

/// Prints how the scene compares, and fails where more is off than is admitted or where nothing is seen.
///
/// # Panics
/// Where the picture differs.
pub fn hold(name: &str, scene: &Scene) {
    let Comparison {
        worst,
        beyond,
        seen,
    } = compare(scene);
    println!("{name}: off by {worst:.1e}, {beyond:.1e} beyond what is admitted; {seen} px seen");
    assert!(seen > 0, "{name}: nothing is seen, so nothing is tested");
    assert!(
        beyond < ROUNDING,
        "{name}: {beyond:.1e} more than is admitted"
    );
}
