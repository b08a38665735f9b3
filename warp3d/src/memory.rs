//! How much memory a warp takes, from the sizes of its pictures alone, so that too large a job is refused before it begins.
//!
//! Counted are the buffers that are in use together when most are: while references are prepared, and while a frame is
//! drawn. Small ones (tables by segment, what belongs to depth edges) are covered by a tenth on top.

use crate::Error;
use crate::options::{Method, WarpOptions};

/// Bytes a pixel of a picture while it is read: decoded in four channels of four bytes, split into planes, joined again.
const READING: u64 = 48;

/// Bytes a pixel that every reference keeps: colour and depth.
const REFERENCE: u64 = 16;

/// Bytes a sample of surfaces (disparity, slopes, links, cells, clearance), colours, coefficients and edges.
const PREPARED: u64 = 4 + 8 + 1 + 1 + 1 + 16 + 16 + 2;

/// Bytes a sample that are let go once a reference is prepared: two more sets of colours while the spline is solved.
const PREPARING: u64 = 32;

/// Bytes a pixel of the new picture: a layer, the picture with its planes, and its bytes as they are written.
const PICTURE: u64 = 28 + 24 + 8;

/// Bytes that drawing `references` of these sizes into a picture of `target` takes at most.
pub fn bytes_needed(references: &[[u32; 2]], target: [u32; 2], options: &WarpOptions) -> u64 {
    let pixels = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
    let samples: u64 = references.iter().copied().map(pixels).sum();
    let largest = references.iter().copied().map(pixels).max().unwrap_or(0);
    let target = pixels(target);
    let prepared = PREPARED * samples + PREPARING * largest;
    // By sample and by pixel: where samples fall, their outlines or triangles, and what pixels see.
    let (kept, by_sample, by_pixel) = match options.method {
        Method::Nearest => (0, 8, 4),
        // Screen position and nearness; nearness, piece, rim and slot, and a finer lattice at a tenth of the pixels.
        Method::Hybrid => (prepared, 12, 16 + 13),
        Method::Points | Method::Splats | Method::Ewa => (prepared, 104, 16),
        // Two triangles a sample, built from a triangulation with six half edges a sample.
        Method::Mesh => (prepared + 24 * samples, 12 + 120, 8),
    };
    let layers = references.len().max(1) as u64;
    let drawing = kept + by_sample * largest + (by_pixel + PICTURE + 28 * (layers - 1)) * target;
    let most = REFERENCE * samples + drawing.max(READING * largest);
    most + most / 10
}

/// Refuses a warp that takes more than `max_bytes`.
///
/// # Errors
/// What is needed, what is allowed, and what to do.
pub fn check_memory(
    references: &[[u32; 2]],
    target: [u32; 2],
    options: &WarpOptions,
    max_bytes: u64,
) -> Result<(), Error> {
    let needed = bytes_needed(references, target, options);
    if needed <= max_bytes {
        return Ok(());
    }
    let sizes: Vec<String> = references.iter().map(|[w, h]| format!("{w}x{h}")).collect();
    let nearest = bytes_needed(references, target, &WarpOptions::with_method(Method::Nearest));
    let way_out = if nearest <= max_bytes && options.method != Method::Nearest {
        "allow more, make the pictures smaller, or use --method nearest, which fits"
    } else {
        "allow more, or make the pictures smaller"
    };
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    Err(Error::Option(format!(
        "warping {} takes up to {} MiB, --max-memory allows {} MiB: {way_out}",
        sizes.join(" and "),
        mib(needed),
        mib(max_bytes)
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_allowed_is_kept_and_what_is_not_says_what_it_takes() {
        let (large, small) = ([16_384, 16_384], [640, 480]);
        let hybrid = WarpOptions::default();
        let needed = bytes_needed(&[large], small, &hybrid);
        assert!((24 << 30..48 << 30).contains(&needed), "16k x 16k takes {needed} bytes");
        assert!(check_memory(&[large], small, &hybrid, needed).is_ok(), "just enough");
        let error = check_memory(&[large], small, &hybrid, 20 << 30).expect_err("too little").to_string();
        assert!(error.contains("16384x16384") && error.contains("--method nearest"), "{error}");
        let nearest = WarpOptions::with_method(Method::Nearest);
        assert!(check_memory(&[large], small, &nearest, 20 << 30).is_ok(), "nearest fits, as the error says");
        let error = check_memory(&[large], small, &nearest, 1 << 20).expect_err("too little").to_string();
        assert!(!error.contains("nearest"), "no way out that is none: {error}");
        assert!(bytes_needed(&[small, small], small, &hybrid) > bytes_needed(&[small], small, &hybrid));
    }
}
