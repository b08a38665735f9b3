//! The headers of an EXR file, their claims held against the length of the file.

use std::panic::catch_unwind;
use std::path::Path;

use ::exr::meta::MetaData;
use ::exr::meta::header::Header;
use ::exr::prelude::Compression;

use crate::files::{MAX_PIXELS, fault, open};
use resample_core::Error;

/// Largest display window that a file may ask for whatever its data window has, px: 4096 x 4096.
const FREE_DISPLAY_PIXELS: u64 = 1 << 24;

/// Beyond that, a display window may have this many times the pixels of the data. A guess, far above what cropped
/// renderings have.
const MOST_DISPLAY_PER_DATA: u64 = 64;

/// A channel and the layer it lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct At {
    pub(crate) layer: usize,
    pub(crate) channel: usize,
}

/// The headers of all parts, their claims held against the length of the file.
pub(crate) fn headers(path: &Path) -> Result<Vec<Header>, Error> {
    let (_, length) = open(path)?;
    let meta = catch_unwind(|| MetaData::read_from_file(path, false))
        .map_err(|_| fault(path, "not a usable EXR file: its header makes no sense"))?
        .map_err(|error| fault(path, format!("not a usable EXR file: {error}")))?;
    check_sizes(&meta.headers, length).map_err(|what| fault(path, what))?;
    Ok(meta.headers.into_vec())
}

/// Holds the claims of all parts against the length of the file.
fn check_sizes(headers: &[Header], file_bytes: u64) -> Result<(), String> {
    let (mut all_bytes, mut all_pixels) = (0u64, 0u64);
    for header in headers {
        let [width, height] = [
            header.layer_size.width() as u64,
            header.layer_size.height() as u64,
        ];
        let pixels = width.saturating_mul(height);
        let per_pixel = header.channels.bytes_per_pixel as u64;
        if pixels > MAX_PIXELS {
            return Err(format!(
                "{width}x{height} pixels, more than the {MAX_PIXELS} that are read"
            ));
        }
        // Deflate unpacks a byte to at most 1032, the other codecs to less; DWA packs runs of 128 before deflate.
        let expansion = match header.compression {
            Compression::Uncompressed => 1,
            Compression::DWAA(_) | Compression::DWAB(_) => 1032 * 128,
            _ => 1032,
        };
        let needed = pixels.saturating_mul(per_pixel);
        if needed > file_bytes.saturating_mul(expansion) {
            return Err(format!(
                "the header says {width}x{height} pixels, more than a file of {file_bytes} bytes can hold"
            ));
        }
        all_bytes = all_bytes.saturating_add(needed);
        all_pixels = all_pixels.max(pixels);
    }
    let most = MAX_PIXELS * 16;
    if all_bytes > most {
        return Err(format!(
            "its parts unpack to {all_bytes} bytes, more than the {most} that are read"
        ));
    }
    let window = headers
        .first()
        .map(|header| header.shared_attributes.display_window.size);
    let (width, height) = window.map_or((0, 0), |size| (size.width() as u64, size.height() as u64));
    let display = width.saturating_mul(height);
    let allowed = FREE_DISPLAY_PIXELS
        .max(all_pixels.saturating_mul(MOST_DISPLAY_PER_DATA))
        .min(MAX_PIXELS);
    if display == 0 || display > allowed {
        return Err(format!(
            "the display window has {width}x{height} pixels, which the data cannot fill"
        ));
    }
    Ok(())
}
