//! How much memory a warp takes, from the sizes of its pictures alone.
//!
//! Counted are the buffers that are in use together when most are: while references are prepared, and while a frame is
//! drawn. Small ones (tables by segment, what belongs to depth edges) are covered by a tenth on top, and the program
//! itself by a constant. References that do not fit stay in a file (`large`), and the same counts say how large a part
//! of them is worked on at once.

use crate::Error;
use crate::options::{Fill, Method, WarpOptions};
#[cfg(feature = "input")]
use crate::raster::Quarter;
use crate::surface::Cell;

const F32: u64 = size_of::<f32>() as u64;
const RGB: u64 = size_of::<[f32; 3]>() as u64;
const RGBA: u64 = size_of::<[f32; 4]>() as u64;

/// Bytes a pixel of a picture while it is read: decoded whole in four channels, twice where the decoder has buffers of
/// its own, colours and coverage. PNG, EXR, PFM and `.npy`, which are read row by row, take half of it.
const READING: u64 = 2 * RGBA + RGB + F32;

/// Bytes a pixel that every reference keeps: colour and depth.
const REFERENCE: u64 = RGB + F32;

/// Bytes a sample of surfaces (disparity, links, clearance) and coefficients. Slopes are kept beside cuts alone.
const PREPARED: u64 = F32 + 1 + 1 + RGBA;

/// Bytes a sample that are let go once a reference is prepared: edges, and how cells are joined.
const PREPARING: u64 = 2 + size_of::<Cell>() as u64;

/// Bytes of a cut cell: four quarters, gathered by segment, kept, their corners on the screen, and the slopes there.
#[cfg(feature = "input")]
const CUT_CELL: u64 =
    4 * (2 * size_of::<Quarter>() + size_of::<[[f32; 3]; 4]>() + size_of::<[[f32; 2]; 2]>()) as u64;

/// Bytes a pixel of one more layer: colour, depth, resolution and purity.
const LAYER: u64 = RGBA + 3 * F32;

/// Bytes a pixel of the new picture: a layer, the two planes and the depths that the picture takes beside it, and its
/// bytes as they are written.
const PICTURE: u64 = LAYER + RGBA + 2 * F32 + 8;

/// Bytes of the program, its threads and its tables.
const PROGRAM: u64 = 32 << 20;

/// What a method takes: kept of each sample, of each sample of the reference at hand, and of each pixel.
struct Taken {
    prepared: u64,
    by_sample: u64,
    by_pixel: u64,
}

impl Taken {
    fn new(method: Method) -> Self {
        let (prepared, by_sample, by_pixel) = match method {
            Method::Nearest { .. } => (0, 8, 4),
            // Screen position and nearness; nearness, piece, rim and slot, and a finer lattice at a fifth of the pixels:
            // sixteen places of eight bytes, and as much as half of it again for the surfaces that they see.
            Method::Hybrid { .. } => (PREPARED, 13, 16 + 40),
            Method::Points { .. } | Method::Splats { .. } => (PREPARED, 104, 16),
        };
        Self {
            prepared,
            by_sample,
            by_pixel,
        }
    }
}

/// Bytes for each pixel of a picture whose holes are filled: what is met along eight directions, what lies behind,
/// and what lies beyond.
fn filling(fill: Fill) -> u64 {
    match fill {
        Fill::None => 0,
        Fill::Background => 8 * 12 + 20 + 28,
        Fill::Natural => 8 * 12 + 20 + 28 + 20 + 9,
    }
}

/// A tenth more.
fn with_small_buffers(bytes: u64) -> u64 {
    bytes + bytes / 10 + PROGRAM
}

/// Bytes that drawing `references` of these sizes into a picture of `target` takes at most.
pub fn bytes_needed(references: &[[u32; 2]], target: [u32; 2], options: &WarpOptions) -> u64 {
    let pixels = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
    let samples: Vec<u64> = references.iter().copied().map(pixels).collect();
    let largest = samples.iter().max().copied().unwrap_or(0);
    let target = pixels(target);
    let working = working_bytes(&samples, target, options)
        + (PICTURE - LAYER + filling(options.fill)) * target;
    with_small_buffers(working.max(REFERENCE * samples.iter().sum::<u64>() + READING * largest))
}

/// Bytes of references of so many `samples`, prepared and drawn into layers of so many `pixels`.
fn working_bytes(samples: &[u64], pixels: u64, options: &WarpOptions) -> u64 {
    let Taken {
        prepared,
        by_sample,
        by_pixel,
    } = Taken::new(options.method);
    let (sum, largest) = (
        samples.iter().sum::<u64>(),
        samples.iter().max().copied().unwrap_or(0),
    );
    let preparing = if matches!(options.method, Method::Nearest { .. }) {
        0
    } else {
        PREPARING * largest
    };
    // One layer a reference, and one that they are blended into.
    let layers = if samples.len() > 1 {
        samples.len() as u64 + 1
    } else {
        1
    };
    let drawing = by_sample * largest + (by_pixel + LAYER * layers) * pixels;
    (REFERENCE + prepared) * sum + preparing.max(drawing)
}

/// Bytes of parts of references while a window is drawn from them, with what hangs on so many `cuts` cut cells.
#[cfg(feature = "input")]
pub(crate) fn window_bytes(samples: &[u64], cuts: u64, pixels: u64, options: &WarpOptions) -> u64 {
    working_bytes(samples, pixels, options) + CUT_CELL * cuts
}

/// Bytes that `max_bytes` leave for windows of a picture of so many `pixels` from references with so many `blocks`; 0
/// where the picture alone takes more.
#[cfg(feature = "input")]
pub(crate) fn left_for_windows(
    max_bytes: u64,
    pixels: u64,
    blocks: u64,
    options: &WarpOptions,
) -> u64 {
    let allowed = max_bytes.saturating_sub(PROGRAM);
    (allowed - allowed / 11).saturating_sub(around_windows(pixels, blocks, options))
}

/// Bytes to allow so that [`left_for_windows`] leaves `windows` of them.
#[cfg(feature = "input")]
pub(crate) fn allowed_for_windows(
    windows: u64,
    pixels: u64,
    blocks: u64,
    options: &WarpOptions,
) -> u64 {
    with_small_buffers(windows + around_windows(pixels, blocks, options))
}

/// Bytes of a whole picture of so many `pixels`, and of the tables of so many `blocks`.
#[cfg(feature = "input")]
fn around_windows(pixels: u64, blocks: u64, options: &WarpOptions) -> u64 {
    // Ranges, counts, and places on the screen.
    (PICTURE + filling(options.fill)) * pixels + (8 + 8 + 16) * blocks
}

/// Bytes that looking once through a reference of this size takes when it does not stay in memory: one second difference
/// of disparity for each seventh sample, two bits a sample, and a band of rows with what is proposed for its soft edges.
#[cfg(feature = "input")]
pub(crate) fn survey_bytes([width, height]: [usize; 2], band_rows: usize) -> u64 {
    let samples = width as u64 * height as u64;
    samples * 4 / 7 + samples / 4 + (width * band_rows) as u64 * 40 + PROGRAM
}

/// Refuses a warp that takes more than `max_bytes`.
///
/// # Errors
/// The memory needed, the memory allowed, and a way out.
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
    let nearest = bytes_needed(
        references,
        target,
        &WarpOptions::with_method(Method::NEAREST),
    );
    let is_nearest = matches!(options.method, Method::Nearest { .. });
    let way_out = if nearest <= max_bytes && !is_nearest {
        "allow more, make the pictures smaller, or use the method nearest, which fits"
    } else {
        "allow more, or make the pictures smaller"
    };
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    Err(Error::Option(format!(
        "warping {} takes up to {} MiB, {} MiB are allowed: {way_out}",
        sizes.join(" and "),
        mib(needed),
        mib(max_bytes)
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_those_of_the_types() {
        assert_eq!([READING, REFERENCE, PREPARED, PREPARING], [48, 16, 22, 3]);
        assert_eq!([LAYER, PICTURE], [28, 60]);
        #[cfg(feature = "input")]
        assert_eq!(CUT_CELL, 352);
    }

    #[test]
    fn what_is_allowed_is_kept_and_what_is_not_says_what_it_takes() {
        let (large, small) = ([16_384, 16_384], [640, 480]);
        let hybrid = WarpOptions::default();
        let needed = bytes_needed(&[large], small, &hybrid);
        assert!(
            (16 << 30..20 << 30).contains(&needed),
            "16k x 16k takes {needed} bytes"
        );
        assert!(
            check_memory(&[large], small, &hybrid, needed).is_ok(),
            "just enough"
        );
        // Of one alone, reading takes the most, whatever the method; of two, the method does.
        let nearest = WarpOptions::with_method(Method::NEAREST);
        let [most, least] =
            [&hybrid, &nearest].map(|method| bytes_needed(&[large; 2], small, method));
        assert!(least < most, "{least} bytes, {most} bytes");
        let between = least.midpoint(most);
        let error = check_memory(&[large; 2], small, &hybrid, between)
            .expect_err("too little")
            .to_string();
        assert!(
            error.contains("16384x16384") && error.contains("the method nearest"),
            "{error}"
        );
        assert!(
            check_memory(&[large; 2], small, &nearest, between).is_ok(),
            "nearest fits, as the error says"
        );
        let error = check_memory(&[large], small, &nearest, 1 << 20)
            .expect_err("too little")
            .to_string();
        assert!(
            !error.contains("nearest"),
            "no way out that is none: {error}"
        );
        assert!(
            bytes_needed(&[small, small], small, &hybrid) > bytes_needed(&[small], small, &hybrid)
        );
    }
}
