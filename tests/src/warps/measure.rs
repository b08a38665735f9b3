//! How far a warped picture is from the truth: inside surfaces, near depth edges, in holes and where nothing can be
//! known.
//!
//! Takes a picture with alpha and a truth, and gives the figures of the tables. A pixel counts as shown from a
//! quarter of coverage on; its colour is compared without alpha, so that a rim of a hole is not counted as darkness. Visible is what the reference sees wholly. Pixels that
//! are not shown are black.

use resample_core::Image;
use resample_core::image::srgb_from_linear;
use resample_core::metrics::{Mask, compare};

use crate::warps::truth::Truth;

/// Coverage from which on a pixel is shown: less is a hole. An edge misplaced by a quarter of a pixel opens no hole.
const SHOWN: f32 = 0.25;

/// How far the edge band reaches to either side of a depth edge, px.
const BAND_PX: usize = 3;

/// Departure of 1/z from linearity, relative, from which on two neighbours have an edge between them.
const EDGE: f32 = 0.02;

/// The figures of one picture.
#[derive(Clone, Copy, Debug)]
pub struct WarpFigures {
    /// PSNR over visible pixels, dB.
    pub psnr_db: f64,
    /// PSNR over visible pixels of the colours after the sRGB curve, as photographs are stored, dB.
    pub srgb_db: f64,
    /// PSNR over visible pixels away from depth edges, dB.
    pub interior_db: f64,
    /// PSNR over visible pixels near depth edges, dB.
    pub edge_db: f64,
    /// PSNR over all pixels of which the reference sees more than half, dB: what it does not see is in the true pixel, and
    /// no warper can know it.
    pub half_seen_db: f64,
    /// PSNR over visible pixels whose eight neighbours are visible too, dB: for masks that are off by a pixel.
    pub clear_db: f64,
    /// Part of the visible pixels that are not shown, percent.
    pub holes_percent: f64,
    /// Part of the pixels of which nothing can be known, more than 2 px from those of which something can, that are shown, percent.
    pub false_fill_percent: f64,
    /// SSIM over visible pixels.
    pub ssim: f64,
    /// Mean FLIP over visible pixels.
    pub flip: f64,
}

/// Compares `image` with `truth`.
///
/// # Panics
/// If the sizes differ or no pixel is visible.
pub fn measure(image: &Image, truth: &Truth) -> WarpFigures {
    let shown: Vec<bool> = image.rgba.iter().map(|p| p[3] >= SHOWN).collect();
    let mut straight = image.clone();
    for pixel in &mut straight.rgba {
        let alpha = if pixel[3] >= SHOWN {
            pixel[3]
        } else {
            f32::INFINITY
        };
        *pixel = [pixel[0] / alpha, pixel[1] / alpha, pixel[2] / alpha, 1.0];
    }
    let size = [image.width, image.height];
    let mut band = edge_band(&truth.depth, size);
    // The rim of what the reference sees is an edge of the reference.
    let visible = truth.visible();
    let unseen: Vec<bool> = visible.iter().map(|v| !v).collect();
    let near_unseen = grown(&unseen, size, 1);
    for (band, rim) in band.iter_mut().zip(grown(&unseen, size, BAND_PX)) {
        *band |= rim;
    }
    let over = |keep: &dyn Fn(usize) -> bool| {
        let inside = (0..shown.len()).map(keep).collect();
        let mask = Mask::new(size[0], size[1], inside).expect("a mask of the picture's size");
        (mask.count() > 0)
            .then(|| compare(&straight, &truth.image, Some(&mask)).expect("finite pictures"))
    };
    let all = over(&|i| visible[i]).expect("something is visible");
    let psnr = |keep: &dyn Fn(usize) -> bool| over(keep).map_or(f64::NAN, |c| c.psnr_db);
    let near_known = grown(
        &truth
            .seen
            .iter()
            .map(|&share| share > 0.0)
            .collect::<Vec<_>>(),
        size,
        2,
    );
    let share = |of: &dyn Fn(usize) -> bool, what: &dyn Fn(usize) -> bool| {
        let of: Vec<usize> = (0..shown.len()).filter(|&i| of(i)).collect();
        let count = of.iter().filter(|&&i| what(i)).count();
        if of.is_empty() {
            0.0
        } else {
            100.0 * count as f64 / of.len() as f64
        }
    };
    WarpFigures {
        psnr_db: all.psnr_db,
        srgb_db: srgb_psnr(&straight, truth, &visible),
        interior_db: psnr(&|i| visible[i] && !band[i]),
        edge_db: psnr(&|i| visible[i] && band[i]),
        half_seen_db: psnr(&|i| truth.seen[i] > 0.5),
        clear_db: psnr(&|i| !near_unseen[i]),
        holes_percent: share(&|i| visible[i], &|i| !shown[i]),
        false_fill_percent: share(&|i| !near_known[i], &|i| shown[i]),
        ssim: all.ssim,
        flip: all.flip.mean,
    }
}

/// PSNR over visible pixels after the sRGB curve, dB.
fn srgb_psnr(straight: &Image, truth: &Truth, visible: &[bool]) -> f64 {
    let pairs = straight
        .rgba
        .iter()
        .zip(&truth.image.rgba)
        .zip(visible)
        .filter(|(_, v)| **v);
    let (mut sum, mut count) = (0.0f64, 0u64);
    for ((a, b), _) in pairs {
        for (a, b) in a.iter().zip(b).take(3) {
            sum += f64::from(srgb_from_linear(*a) - srgb_from_linear(*b)).powi(2);
            count += 1;
        }
    }
    -10.0 * (sum / count.max(1) as f64).log10()
}

/// Pixels near a place where 1/z is not linear.
fn edge_band(depth: &[f32], size: [usize; 2]) -> Vec<bool> {
    let [width, height] = size;
    let inverse = |i: usize| {
        if depth[i].is_finite() {
            1.0 / depth[i]
        } else {
            0.0
        }
    };
    let bends = |i: usize, place: usize, count: usize, step: usize| {
        let inside = place > 0 && place + 1 < count;
        inside && {
            let (a, b, c) = (inverse(i - step), inverse(i), inverse(i + step));
            (a - 2.0 * b + c).abs() > EDGE * a.max(b).max(c)
        }
    };
    let edges: Vec<bool> = (0..depth.len())
        .map(|i| bends(i, i % width, width, 1) || bends(i, i / width, height, width))
        .collect();
    grown(&edges, size, BAND_PX)
}

fn grown(flags: &[bool], size: [usize; 2], by: usize) -> Vec<bool> {
    let [width, height] = size;
    let mut out = vec![false; flags.len()];
    for i in (0..flags.len()).filter(|&i| flags[i]) {
        let (x, y) = (i % width, i / width);
        for v in y.saturating_sub(by)..(y + by + 1).min(height) {
            out[v * width + x.saturating_sub(by)..v * width + (x + by + 1).min(width)].fill(true);
        }
    }
    out
}
