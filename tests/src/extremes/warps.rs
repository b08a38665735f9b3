//! Depth images at extremes: a plane across the view, seen from its own place and from others.

use super::row::Result;
use glam::{DMat3, DVec3};
use resample_core::{Camera, Image, Intrinsics, PixelCentre};
use warp3d::{Method, Reference, WarpOptions, Warper};

use super::row::{Claim, Row};

/// Pixels along a side.
const SIDE: usize = 33;

const DEPTH: Claim = Claim {
    quantity: "depth of a warped plane over its distance, every method",
    bound: 2e-6,
    why: "the warp is f64; disparities are f32 in a length near the median depth",
};

const ALPHA: Claim = Claim {
    quantity: "most by which alpha leaves 0 to 1",
    bound: 0.0,
    why: "coverage is clamped where it is made",
};

const FINITE: Claim = Claim {
    quantity: "numbers that are NaN, or depths below 0",
    bound: 0.0,
    why: "samples without a finite disparity are unknown; depth behind the eye is none",
};

/// All rows.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for distance in [1e-30, 1e-3, 1.0, 1e9, 1e30] {
        let images = warped(&|_| distance as f32, distance)?;
        let middle = SIDE * SIDE / 2;
        let depth = |image: &Image| {
            let depth = image.depth.as_ref().map_or(f32::NAN, |depth| depth[middle]);
            [f64::from(depth) / distance, 1.0]
        };
        let extreme = format!("a plane at {distance:e}");
        rows.push(DEPTH.worst(extreme, images.iter().map(depth)));
    }
    let decades = |i: usize| 10f64.powf((i * 7919 % 61) as f64 - 30.0) as f32;
    let odd = [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-45, 3.0, f32::MAX];
    let jumps = |i: usize| if (i / 4).is_multiple_of(2) { 1.0 } else { 1e6 };
    for (extreme, depth) in [
        ("depths over 60 decades", &decades as &dyn Fn(usize) -> f32),
        ("depths that are 0, infinite, NaN, denormal", &|i| {
            odd[i % odd.len()]
        }),
        ("depth jumps of 1e6", &jumps),
    ] {
        let images = warped(depth, 1.0)?;
        rows.push(ALPHA.row(
            extreme,
            [images.iter().map(alpha_beyond).fold(0.0, f64::max), 0.0],
        ));
        rows.push(FINITE.row(extreme, [images.iter().map(bad).sum(), 0.0]));
    }
    Ok(rows)
}

/// A camera aside by this.
fn camera(aside: f64, near: f64) -> Result<Camera> {
    let intrinsics = Intrinsics {
        width: SIDE as u32,
        height: SIDE as u32,
        fx: 30.0,
        fy: 30.0,
        cx: 0.5 * SIDE as f64,
        cy: 0.5 * SIDE as f64,
        pixel_centre: PixelCentre::Half,
    };
    let place = DVec3::new(-aside, 0.0, 0.0);
    Ok(Camera::from_intrinsics(
        &intrinsics,
        DMat3::IDENTITY,
        place,
        near,
    )?)
}

/// Depths by pixel, warped a little aside by every method.
fn warped(depth: &dyn Fn(usize) -> f32, distance: f64) -> Result<Vec<Image>> {
    let count = SIDE * SIDE;
    let reference = Reference {
        camera: camera(0.0, 1e-6 * distance)?,
        colour: (0..count).map(|i| [(i % 7) as f32 / 7.0; 3]).collect(),
        depth: (0..count).map(depth).collect(),
    };
    let target = camera(0.1 * distance, 1e-6 * distance)?;
    let draw = |method| {
        let options = WarpOptions::with_method(method);
        let mut warper = Warper::new(vec![reference.clone()], &options)?;
        Ok(warper.render(&target)?.image)
    };
    Method::ALL.into_iter().map(draw).collect()
}

fn alpha_beyond(image: &Image) -> f64 {
    let beyond = |pixel: &[f32; 4]| f64::from((pixel[3] - 1.0).max(-pixel[3]).max(0.0));
    image.rgba.iter().map(beyond).fold(0.0, f64::max)
}

fn bad(image: &Image) -> f64 {
    let colours = image
        .rgba
        .iter()
        .flatten()
        .filter(|v| !v.is_finite())
        .count();
    let depths = image.depth.iter().flatten();
    let depths = depths.filter(|z| z.is_nan() || **z < 0.0).count();
    (colours + depths) as f64
}
