//! How much memory a warp takes, from the sizes of its pictures alone.
//!
//! Counted are the buffers that are in use together when most are: while references are prepared, and while a frame is
//! drawn. Small ones (tables by segment, what belongs to depth edges) are covered by a tenth on top, and the program
//! itself by a constant.

use crate::Error;
use crate::options::{Fill, Method, WarpOptions};
use crate::surfaces::surface::Cell;
use crate::view::layer::Mix;

const F32: u64 = size_of::<f32>() as u64;
const RGB: u64 = size_of::<[f32; 3]>() as u64;
const RGBA: u64 = size_of::<[f32; 4]>() as u64;

/// Bytes a pixel that every reference has when it was read: colour and depth.
const REFERENCE: u64 = RGB + F32;

/// Bytes a pixel beside its colour and its coverage while the depth is read: the numbers of its file, and camera z.
const READING_DEPTH: u64 = 2 * F32;

/// Bytes a sample of surfaces (disparity, links, clearance) and coefficients. Slopes are kept beside cuts alone.
const PREPARED: u64 = F32 + 1 + 1 + RGB;

/// Bytes a sample that are let go once a reference is prepared: how cells are joined, where edges lie along two axes, and how
/// well that is known.
const PREPARING: u64 = size_of::<Cell>() as u64 + 2 + 2;

/// Bytes a sample of how cells are drawn, and of where they lie on the screen: by segment of 32, in whole bytes.
const SEGMENTS: u64 = 1;
const ON_SCREEN: u64 = 1;

/// Bytes a pixel of one more layer: colour, depth, resolution and mix.
const LAYER: u64 = RGBA + 2 * F32 + size_of::<Mix>() as u64;

/// Bytes a pixel of the new picture: a layer, the two planes and the depths that the picture takes beside it, and its
/// bytes as they are written.
const PICTURE: u64 = LAYER + RGBA + 2 * F32 + 8;

/// Bytes of the program, its threads and its tables.
const PROGRAM: u64 = 32 << 20;

/// The size of a reference, known before its pixels are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReferenceSize {
    /// Width and height, px.
    pub size: [u32; 2],
    /// Bytes of a channel in its file: 1, 2, or 4 for any number.
    pub channel_bytes: u8,
    /// Bytes a pixel that the file's decoder holds at most.
    pub decoder_bytes: u64,
}

impl ReferenceSize {
    /// A picture in memory whose colours are any numbers.
    pub fn of_floats(size: [u32; 2]) -> Self {
        Self {
            size,
            channel_bytes: 4,
            decoder_bytes: 0,
        }
    }

    fn samples(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }
}

/// Samples of a reference, and the bytes of each of their channels.
#[derive(Clone, Copy, Debug)]
struct Samples {
    count: u64,
    channel_bytes: u64,
}

/// Bytes that a method takes: kept of each sample beside its own colour, of each sample of one reference while it is prepared
/// and while it is drawn, and of each pixel.
struct Taken {
    prepared: u64,
    preparing: u64,
    drawing: u64,
    by_pixel: u64,
}

impl Taken {
    fn new(method: Method) -> Self {
        let (prepared, preparing, drawing, by_pixel) = match method {
            Method::Nearest { .. } => (F32, 0, 8, 4),
            // Nearness, piece, rim and slot, and a finer lattice at a fifth of the pixels: sixteen places of eight bytes, and
            // as much as half of it again for the surfaces that they see.
            Method::Hybrid { .. } => (PREPARED, PREPARING, SEGMENTS + ON_SCREEN, 16 + 40),
            // Depth as it was given, disparity, coefficients, two reaches and the number of a surface beside the colour.
            Method::Rows { .. } => (2 * F32 + RGBA + 3 * F32, F32 + 1, 0, 0),
            Method::Points { .. } | Method::Splats { .. } => {
                (PREPARED, PREPARING, SEGMENTS + 104, 16)
            }
        };
        Self {
            prepared,
            preparing,
            drawing,
            by_pixel,
        }
    }

    /// Bytes that samples keep: colours are numbers of as many values as a channel of their file has.
    fn kept(&self, samples: &Samples, method: Method) -> u64 {
        let colour = match method {
            Method::Nearest { .. } | Method::Rows { .. } => RGB,
            _ => 3 * samples.channel_bytes,
        };
        (self.prepared + colour) * samples.count
    }
}

/// Bytes for each pixel of a picture whose holes are filled: what is met along eight directions, what lies behind,
/// and what lies beyond.
fn filling(fill: Fill) -> u64 {
    match fill {
        Fill::None => 0,
        Fill::Background | Fill::Film => 8 * 12 + 20 + 28,
        Fill::Natural => 8 * 12 + 20 + 28 + 20 + 9,
    }
}

/// A tenth more.
fn with_small_buffers(bytes: u64) -> u64 {
    bytes + bytes / 10 + PROGRAM
}

/// Bytes that drawing `references` of these sizes into a picture of `target` takes at most.
///
/// ```
/// use warp3d::WarpOptions;
/// use warp3d::memory::{ReferenceSize, bytes_needed};
///
/// let needed = |side| {
///     let size = ReferenceSize::of_floats([side, side]);
///     bytes_needed(&[size], [640, 480], &WarpOptions::default())
/// };
/// assert!(needed(4096) > needed(1024));
/// ```
pub fn bytes_needed(references: &[ReferenceSize], target: [u32; 2], options: &WarpOptions) -> u64 {
    let of = |reference: &ReferenceSize| Samples {
        count: reference.samples(),
        channel_bytes: reference.channel_bytes.into(),
    };
    let samples: Vec<Samples> = references.iter().map(of).collect();
    let target = u64::from(target[0]) * u64::from(target[1]);
    let working = working_bytes(&samples, target, options)
        + (PICTURE - LAYER + filling(options.fill)) * target;
    // Coverage is as large as a depth.
    let beside = |r: &ReferenceSize| r.samples() * r.decoder_bytes.max(READING_DEPTH);
    let read = samples.iter().map(|s| REFERENCE * s.count).sum::<u64>();
    with_small_buffers(working.max(read + references.iter().map(beside).max().unwrap_or(0)))
}

/// Bytes of references of so many `samples`, prepared and drawn into layers of so many `pixels`.
fn working_bytes(samples: &[Samples], pixels: u64, options: &WarpOptions) -> u64 {
    let taken = Taken::new(options.method);
    let kept: u64 = samples.iter().map(|s| taken.kept(s, options.method)).sum();
    let largest = samples.iter().map(|s| s.count).max().unwrap_or(0);
    // One layer a reference, and one that they are blended into.
    let layers = if samples.len() > 1 {
        samples.len() as u64 + 1
    } else {
        1
    };
    let drawing = taken.drawing * largest + (taken.by_pixel + LAYER * layers) * pixels;
    kept + drawing.max(taken.preparing * largest)
}

/// Refuses a warp that takes more than `max_bytes`.
///
/// # Errors
/// The memory needed, the memory allowed, and a way out.
pub fn check_memory(
    references: &[ReferenceSize],
    target: [u32; 2],
    options: &WarpOptions,
    max_bytes: u64,
) -> Result<(), Error> {
    let needed = bytes_needed(references, target, options);
    if needed <= max_bytes {
        return Ok(());
    }
    let size = |reference: &ReferenceSize| format!("{}x{}", reference.size[0], reference.size[1]);
    let sizes: Vec<String> = references.iter().map(size).collect();
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
        assert_eq!(
            [REFERENCE, READING_DEPTH, PREPARED, PREPARING],
            [16, 8, 18, 5]
        );
        assert_eq!([LAYER, PICTURE], [32, 64]);
    }

    /// A JPEG of 8 bits a channel.
    fn jpeg(size: [u32; 2]) -> ReferenceSize {
        ReferenceSize {
            size,
            channel_bytes: 1,
            decoder_bytes: 9,
        }
    }

    #[test]
    fn a_sample_takes_what_its_file_tells() {
        let small = [640, 480];
        let per_sample = |channel_bytes: u8, decoder_bytes: u64| {
            let reference = ReferenceSize {
                size: [16_384, 16_384],
                channel_bytes,
                decoder_bytes,
            };
            bytes_needed(&[reference], small, &WarpOptions::default()) / reference.samples()
        };
        assert_eq!(per_sample(1, 0), 28, "26 and a tenth");
        assert_eq!(per_sample(1, 9), 28, "reading takes less than preparing");
        assert_eq!(per_sample(2, 0), 32);
        assert_eq!(per_sample(4, 0), 38);
        assert_eq!(per_sample(4, 32), 52, "four channels of f32, twice");
    }

    #[test]
    fn what_is_allowed_is_kept_and_what_is_not_says_what_it_takes() {
        let (large, small) = (jpeg([16_384, 16_384]), [640, 480]);
        let hybrid = WarpOptions::default();
        let needed = bytes_needed(&[large], small, &hybrid);
        assert!(
            (7 << 30..8 << 30).contains(&needed),
            "16k x 16k takes {needed} bytes"
        );
        assert!(
            check_memory(&[large], small, &hybrid, needed).is_ok(),
            "just enough"
        );
        let nearest = WarpOptions::with_method(Method::NEAREST);
        let floats = ReferenceSize::of_floats(large.size);
        let [most, least] =
            [&hybrid, &nearest].map(|method| bytes_needed(&[floats; 2], small, method));
        assert!(least < most, "{least} bytes, {most} bytes");
        let between = least.midpoint(most);
        let error = check_memory(&[floats; 2], small, &hybrid, between)
            .expect_err("too little")
            .to_string();
        assert!(
            error.contains("16384x16384") && error.contains("the method nearest"),
            "{error}"
        );
        assert!(
            check_memory(&[floats; 2], small, &nearest, between).is_ok(),
            "nearest fits, as the error says"
        );
        let error = check_memory(&[large], small, &nearest, 1 << 20)
            .expect_err("too little")
            .to_string();
        assert!(
            !error.contains("nearest"),
            "no way out that is none: {error}"
        );
        let small = jpeg(small);
        assert!(
            bytes_needed(&[small, small], small.size, &hybrid)
                > bytes_needed(&[small], small.size, &hybrid)
        );
    }
}
