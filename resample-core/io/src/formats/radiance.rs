//! Radiance pictures (`.hdr`), row by row.
//!
//! Takes a path whose header has been checked, gives its rows as linear red, green and blue: each pixel is three bytes that
//! share an exponent, packed by runs. Whole, such a picture would be held twice, and 8 MB of runs can be 130 million
//! pixels. Source: Ward, "Real Pixels" (Graphics Gems II), and the format's description in the Radiance manual.
//! Limits: rows from the top and pixels from the left; other orders are left to the decoder of whole pictures.

use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use crate::files::{fault, open};
use crate::picture::{Row, Rows};
use resample_core::Error;

/// Most bytes of a line of the header. A guess.
const LINE_BYTES: u64 = 1 << 16;

/// Widths that rows packed channel by channel can have.
const PACKED_WIDTHS: std::ops::Range<usize> = 8..1 << 15;

/// A pixel: red, green, blue, exponent.
type Pixel = [u8; 4];

/// Returns true if rows come from the top and pixels from the left.
pub(crate) fn is_by_rows(path: &Path) -> Result<bool, Error> {
    let (file, _) = open(path)?;
    let found = size(&mut BufReader::new(file));
    Ok(found.is_ok_and(|size| size.is_some()))
}

/// Gives the rows from the top; false, without a row, if pixels come in another order.
pub(crate) fn decode(path: &Path, rows: &mut dyn Rows) -> Result<bool, Error> {
    let wrong = |error: io::Error| fault(path, format!("not a usable picture: {error}"));
    let (file, _) = open(path)?;
    let mut file = BufReader::new(file);
    let Some([width, height]) = size(&mut file).map_err(wrong)? else {
        return Ok(false);
    };
    rows.begin([width, height], 3)?;
    let mut pixels: Vec<Pixel> = vec![[0; 4]; width];
    let mut linear = Vec::with_capacity(3 * width);
    for y in 0..height {
        unpack(&mut file, &mut pixels).map_err(|error| {
            fault(
                path,
                format!("not a usable picture: row {y} of {height}: {error}"),
            )
        })?;
        linear.clear();
        linear.extend(pixels.iter().flat_map(|&pixel| rgb(pixel)));
        rows.row(y, &Row::Floats(&linear))?;
    }
    Ok(true)
}

/// Reads the header: width and height, px, if rows come from the top and pixels from the left.
fn size(file: &mut impl BufRead) -> io::Result<Option<[usize; 2]>> {
    let mut line = Vec::new();
    let mut next = |line: &mut Vec<u8>| {
        line.clear();
        file.take(LINE_BYTES).read_until(b'\n', line)
    };
    // An empty line ends what is said about the picture.
    loop {
        if next(&mut line)? == 0 {
            return Ok(None);
        }
        if line == b"\n" {
            break;
        }
    }
    next(&mut line)?;
    let text = String::from_utf8_lossy(&line);
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    Ok(match words[..] {
        ["-Y", height, "+X", width] => {
            let sides = width.parse().ok().zip(height.parse().ok());
            sides.map(|(width, height)| [width, height])
        }
        _ => None,
    })
}

fn unpack(file: &mut impl Read, row: &mut [Pixel]) -> io::Result<()> {
    let mut first = [0; 4];
    file.read_exact(&mut first)?;
    let [two, also_two, high, low] = first;
    let is_packed = [two, also_two] == [2, 2]
        && high < 128
        && PACKED_WIDTHS.contains(&row.len())
        && usize::from(high) * 256 + usize::from(low) == row.len();
    if is_packed {
        (0..4).try_for_each(|channel| unpack_channel(file, row, channel))
    } else {
        unpack_pixels(file, row, first)
    }
}

/// A channel of a row: runs of one byte, and bytes as they are.
fn unpack_channel(file: &mut impl Read, row: &mut [Pixel], channel: usize) -> io::Result<()> {
    let mut at = 0;
    let mut bytes = [0; 128];
    while at < row.len() {
        let mut count = [0];
        file.read_exact(&mut count)?;
        let is_run = count[0] > 128;
        let count = usize::from(if is_run { count[0] - 128 } else { count[0] });
        if count == 0 || at + count > row.len() {
            return Err(io::Error::other("its runs do not fill its width"));
        }
        if is_run {
            file.read_exact(&mut bytes[..1])?;
            bytes = [bytes[0]; 128];
        } else {
            file.read_exact(&mut bytes[..count])?;
        }
        for (pixel, &byte) in row[at..at + count].iter_mut().zip(&bytes) {
            pixel[channel] = byte;
        }
        at += count;
    }
    Ok(())
}

/// A row of whole pixels, of which 1, 1, 1, N repeats the last one N times; several in a row are the digits of N.
fn unpack_pixels(file: &mut impl Read, row: &mut [Pixel], first: Pixel) -> io::Result<()> {
    let (mut at, mut shift, mut pixel) = (0, 0u32, first);
    loop {
        if pixel[..3] == [1, 1, 1] {
            let count = usize::from(pixel[3])
                .checked_shl(shift)
                .unwrap_or(usize::MAX);
            if at == 0 || count > row.len() - at {
                return Err(io::Error::other("its runs do not fill its width"));
            }
            let last = row[at - 1];
            row[at..at + count].fill(last);
            (at, shift) = (at + count, shift + 8);
        } else {
            row[at] = pixel;
            (at, shift) = (at + 1, 0);
        }
        if at == row.len() {
            return Ok(());
        }
        file.read_exact(&mut pixel)?;
    }
}

/// Linear light: bytes times two to the power of exponent - 136; an exponent of 0 is black.
fn rgb([red, green, blue, exponent]: Pixel) -> [f32; 3] {
    let scale = match exponent {
        0 => 0.0,
        exponent => 2f64.powi(i32::from(exponent) - 136) as f32,
    };
    [red, green, blue].map(|channel| scale * f32::from(channel))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use crate::{Part, colour};

    const HEAD: &str = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";

    fn file_of(folder: &tempfile::TempDir, bytes: &[u8]) -> PathBuf {
        let path = folder.path().join("a.hdr");
        std::fs::write(&path, bytes).expect("written");
        path
    }

    fn read(bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = file_of(&folder, bytes);
        let part = Part::from_text(&path.display().to_string());
        colour::read(&part)
            .map(|picture| picture.rgb)
            .map_err(|error| error.to_string())
    }

    /// Rows of bytes that a picture may have, and the same as `image` has them.
    fn twin(bytes: &[u8]) -> Vec<[f32; 3]> {
        let picture = image::load_from_memory_with_format(bytes, image::ImageFormat::Hdr);
        picture
            .expect("a picture")
            .into_rgb32f()
            .pixels()
            .map(|pixel| pixel.0)
            .collect()
    }

    #[test]
    fn packed_rows_and_plain_ones_are_as_the_decoder_of_whole_pictures_has_them() {
        let mut packed = format!("{HEAD}-Y 2 +X 200\n").into_bytes();
        for exponent in [129, 1] {
            packed.extend([2, 2, 0, 200]);
            for byte in [7, 250, 90, exponent] {
                packed.extend([128 + 127, byte, 3, 9, 8, byte, 128 + 70, byte]);
            }
        }
        assert_eq!(read(&packed), Ok(twin(&packed)));
        let mut plain = format!("{HEAD}-Y 2 +X 5\n").into_bytes();
        plain.extend([3, 4, 5, 128, 1, 1, 1, 3, 9, 9, 9, 140]);
        plain.extend([
            2, 2, 200, 5, 9, 1, 1, 0, 0, 0, 0, 0, 8, 8, 8, 141, 1, 1, 1, 1,
        ]);
        assert_eq!(read(&plain), Ok(twin(&plain)));
    }

    #[test]
    fn rows_that_do_not_fit_are_refused() {
        let head = format!("{HEAD}-Y 1 +X 200\n").into_bytes();
        let with = |tail: &[u8]| [head.clone(), tail.to_vec()].concat();
        for tail in [
            &[2, 2, 0, 200, 255, 9, 255, 9][..],
            &[2, 2, 0, 200, 0, 0, 0, 0],
            &[2, 2, 0, 200, 255, 9],
            &[1, 1, 1, 9],
            &[5, 5, 5, 5, 1, 1, 1, 255, 1, 1, 1, 255],
            &[],
        ] {
            let error = read(&with(tail)).expect_err("refused");
            assert!(error.contains("row 0 of 1"), "{tail:?}: {error}");
        }
    }
}
