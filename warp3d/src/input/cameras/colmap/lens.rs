//! COLMAP's lens models: from a model's name and parameters to a lens and its distortion.
//!
//! Limits: the thin prism of THIN_PRISM_FISHEYE, FOV and newer models are not read.

use resample_core::camera::PixelCentre;

use crate::input::cameras::distortion::Distortion;
use crate::input::cameras::entry::{Lens, LensModel};

/// Number, name and parameter count of the models that are read, as COLMAP's sources list them.
const MODELS: [(i32, &str, usize); 9] = [
    (0, "SIMPLE_PINHOLE", 3),
    (1, "PINHOLE", 4),
    (2, "SIMPLE_RADIAL", 4),
    (3, "RADIAL", 5),
    (4, "OPENCV", 8),
    (5, "OPENCV_FISHEYE", 8),
    (6, "FULL_OPENCV", 12),
    (8, "SIMPLE_RADIAL_FISHEYE", 4),
    (9, "RADIAL_FISHEYE", 5),
];

/// Name and parameter count of the model with this number.
pub(super) fn by_number(number: i32) -> Result<(&'static str, usize), String> {
    let found = MODELS.iter().find(|(own, _, _)| *own == number);
    found
        .map(|&(_, name, count)| (name, count))
        .ok_or_else(|| not_read(&format!("number {number}")))
}

/// The lens of a model's parameters.
pub(super) fn model(name: &str, size: [u32; 2], parameters: &[f64]) -> Result<LensModel, String> {
    let (_, _, count) = MODELS
        .iter()
        .find(|(_, own, _)| *own == name)
        .ok_or_else(|| not_read(name))?;
    if parameters.len() != *count || parameters.iter().any(|value| !value.is_finite()) {
        return Err(format!(
            "the lens model {name} has {} parameters, expected {count} finite numbers",
            parameters.len()
        ));
    }
    let has_two_focals = matches!(
        name,
        "PINHOLE" | "OPENCV" | "OPENCV_FISHEYE" | "FULL_OPENCV"
    );
    let (focals, rest) = parameters.split_at(1 + usize::from(has_two_focals));
    let (centre, coefficients) = rest.split_at(2);
    Ok(LensModel {
        lens: Lens {
            fx: focals[0],
            fy: focals[focals.len() - 1],
            cx: centre[0],
            cy: centre[1],
            pixel_centre: PixelCentre::Half,
        },
        size,
        distortion: if name.ends_with("FISHEYE") {
            Some(fish_eye(coefficients))
        } else {
            distortion(coefficients)
        },
    })
}

/// The coefficients in COLMAP's order: k1, k2, p1, p2, k3, k4, k5, k6, as far as the model has them.
fn distortion(coefficients: &[f64]) -> Option<Distortion> {
    let mut k = [0.0; 8];
    k[..coefficients.len()].copy_from_slice(coefficients);
    Distortion::new([k[0], k[1], k[4], k[5], k[6], k[7]], [k[2], k[3]])
}

/// The coefficients of a fish eye: k1 to k4, as far as the model has them.
fn fish_eye(coefficients: &[f64]) -> Distortion {
    let mut k = [0.0; 4];
    k[..coefficients.len()].copy_from_slice(coefficients);
    Distortion::fish_eye(k)
}

fn not_read(model: &str) -> String {
    let names: Vec<_> = MODELS.iter().map(|(_, name, _)| *name).collect();
    format!(
        "the lens model {model} is not read, only {}: undistort the pictures first (colmap image_undistorter)",
        names.join(", ")
    )
}
