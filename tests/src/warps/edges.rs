//! Faults at the edges of a warped picture, in figures: colours out of the reference's range, rims shown where nothing is
//! known, known pixels that change although the eye stays where it is.

use glam::DVec3;
use resample_core::Image;
use warp3d::Reference;

use crate::warps::filtered::filtered_scene;
use crate::warps::scenes::{AnalyticScene, camera};
use crate::warps::truth::{Truth, WarpScene};

/// The room from an eye that is turned by 50 degrees around its middle: every round body shows another limb.
pub fn turned() -> WarpScene {
    let angle = 50f64.to_radians();
    let aside = DVec3::new(-5.0 * angle.sin(), 0.0, 5.0 - 5.0 * angle.cos());
    let from = camera([320, 240], 260.0, DVec3::ZERO, 0.0);
    let to = camera([320, 240], 260.0, aside, -angle);
    filtered_scene("room turned", &AnalyticScene::room(), &from, &to)
}

/// How far the farthest colour of `image` lies outside the range of the reference's, over all channels.
pub fn out_of_range(image: &Image, reference: &Reference) -> f32 {
    let mut worst = 0.0f32;
    for channel in 0..3 {
        let values = || reference.colour.iter().map(|rgb| rgb[channel]);
        let least = values().fold(f32::INFINITY, f32::min);
        let most = values().fold(f32::NEG_INFINITY, f32::max);
        for pixel in image.rgba.iter().filter(|pixel| pixel[3] >= 0.25) {
            let value = pixel[channel] / pixel[3];
            worst = worst.max(value - most).max(least - value);
        }
    }
    worst
}

/// Part of the pixels of which nothing can be known, within 2 px of those of which something can, that are shown, percent.
pub fn rim_fill_percent(image: &Image, truth: &Truth) -> f64 {
    let [width, height] = [image.width, image.height];
    let near_known = |i: usize| {
        let (x, y) = (i % width, i / width);
        let rows = y.saturating_sub(2)..(y + 3).min(height);
        let columns = x.saturating_sub(2)..(x + 3).min(width);
        rows.into_iter()
            .any(|v| columns.clone().any(|u| truth.seen[v * width + u] > 0.0))
    };
    let rim: Vec<usize> = (0..width * height)
        .filter(|&i| truth.seen[i] == 0.0 && near_known(i))
        .collect();
    let shown = rim.iter().filter(|&&i| image.rgba[i][3] >= 0.25).count();
    100.0 * shown as f64 / rim.len().max(1) as f64
}

/// How known pixels change when the eye stays where it is.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// Of the known pixels, how many percent are partly transparent.
    pub transparent_percent: f64,
    /// Largest difference of a channel, alpha included.
    pub largest: f32,
    /// PSNR over the known pixels, on black, dB.
    pub psnr_db: f64,
}

/// Compares the picture from a reference's own camera with the reference.
pub fn changed_at_home(image: &Image, reference: &Reference) -> Change {
    let (mut transparent, mut known, mut largest, mut sum) = (0u32, 0u32, 0.0f32, 0.0f64);
    let samples = reference.colour.iter().zip(&reference.depth);
    for (pixel, (rgb, _)) in image
        .rgba
        .iter()
        .zip(samples)
        .filter(|(_, (_, z))| **z > 0.0)
    {
        known += 1;
        transparent += u32::from(pixel[3] < 0.999);
        let expected = [rgb[0], rgb[1], rgb[2], 1.0];
        for (found, expected) in pixel.iter().zip(expected) {
            largest = largest.max((found - expected).abs());
        }
        let error = pixel.iter().zip(rgb).map(|(a, b)| f64::from(a - b).powi(2));
        sum += error.sum::<f64>();
    }
    Change {
        transparent_percent: 100.0 * f64::from(transparent) / f64::from(known.max(1)),
        largest,
        psnr_db: -10.0 * (sum / f64::from(3 * known.max(1))).log10(),
    }
}

/// `reference` with unknown depth: single samples, blocks, and a rim along the near side of edges, as sensors leave it.
pub fn with_unknown(reference: &Reference) -> Vec<(&'static str, Reference)> {
    let width = reference.camera.width as usize;
    let without = |is_unknown: &dyn Fn(usize, usize) -> bool| {
        let mut reference = reference.clone();
        for (i, z) in reference.depth.iter_mut().enumerate() {
            if is_unknown(i % width, i / width) {
                *z = f32::NAN;
            }
        }
        reference
    };
    let single = |x: usize, y: usize| (x * 7 + y * 13).is_multiple_of(53);
    let blocks = |x: usize, y: usize| x % 40 < 9 && y % 30 < 7;
    let edges = |x: usize, y: usize| {
        let z = |x: usize| reference.depth[y * width + x.min(width - 1)];
        (z(x + 2) - z(x)).abs() > 0.1 * z(x)
    };
    vec![
        ("single samples", without(&single)),
        ("blocks", without(&blocks)),
        ("rims", without(&edges)),
    ]
}
