//! Shared by readers of TIFF files: the mark of a file, and the most that a file of some length can unpack to.

/// Returns true if a file that begins with `head` is a TIFF or BigTIFF file.
///
/// ```
/// assert!(resample_io::tiff::begins(b"II*\0"));
/// assert!(!resample_io::tiff::begins(b"RIFF"));
/// ```
pub fn begins(head: &[u8]) -> bool {
    [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"]
        .iter()
        .any(|mark| head.starts_with(*mark))
}

/// The most bytes that one byte of any packing here expands to: a code of LZW has at most 12 bits and stands for at most
/// 3838 bytes, which is 2559 times as many; deflate and PackBits stay below. JPEG needs at least 2 bits for 64 pixels.
pub const GREATEST_EXPANSION: u64 = 2560;
