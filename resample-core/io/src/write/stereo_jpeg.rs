//! JPEG files of one view, and of the two of a stereo photograph.
//!
//! A multi-picture file (`.mpo`, CIPA DC-007) is two whole JPEGs one after the other, the left eye's first; a segment in the first one says
//! where the second begins. A stereo JPEG (`.jps`) is one picture with the right eye's view on the left, as crossed eyes see it, and a
//! segment that says so (JPEG Stereoscopic Format 1.2).

use std::io;
use std::io::Write;

use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use resample_core::Image;
use resample_core::narrow::index32;
use serde::{Deserialize, Serialize};

use super::png::{Depth, opaque_bytes};

/// The views of a JPEG file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Views {
    /// The picture is one view.
    One,
    /// The left half of the picture is the left eye's view, the right half the right eye's: two pictures in one file, `.mpo`.
    Two,
    /// The same in one picture, the right eye's view on the left, `.jps`.
    Crossed,
}

/// Quality, 1 to 100: at 92, errors are below what most people see. A guess.
const QUALITY: u8 = 92;

/// Writes `image` to `file`, its alpha left out.
pub(super) fn write(file: &mut impl Write, image: &Image, views: Views) -> io::Result<()> {
    let mut opaque = image.clone();
    opaque.rgba.iter_mut().for_each(|pixel| pixel[3] = 1.0);
    let bytes = opaque_bytes(&opaque, Depth::Eight);
    let row = 3 * image.width.max(1);
    let half = row / 2;
    let halves = |right: bool| -> Vec<u8> {
        let of = |row: &[u8]| match right {
            true => row[half..].to_vec(),
            false => row[..half].to_vec(),
        };
        bytes.chunks_exact(row).flat_map(of).collect()
    };
    match views {
        Views::One => file.write_all(&encoded(&bytes, [image.width, image.height])?),
        Views::Two => {
            let size = [image.width / 2, image.height];
            let [left, right] = [
                encoded(&halves(false), size)?,
                encoded(&halves(true), size)?,
            ];
            file.write_all(&multi_picture(&left, &right))
        }
        Views::Crossed => {
            let crossed = |row: &[u8]| [&row[half..], &row[..half]].concat();
            let bytes: Vec<u8> = bytes.chunks_exact(row).flat_map(crossed).collect();
            let jpeg = encoded(&bytes, [image.width, image.height])?;
            file.write_all(&with_segment(&jpeg, &crossed_segment()))
        }
    }
}

fn encoded(bytes: &[u8], size: [usize; 2]) -> io::Result<Vec<u8>> {
    let [width, height] = size.map(index32);
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
        .encode(bytes, width, height, ExtendedColorType::Rgb8)
        .map_err(io::Error::other)?;
    Ok(jpeg)
}

/// The place in a JPEG behind the mark of its beginning and the segment JFIF.
fn place_of_segments(jpeg: &[u8]) -> usize {
    match jpeg {
        [_, _, 0xff, 0xe0, high, low, ..] => 4 + usize::from(u16::from_be_bytes([*high, *low])),
        _ => 2,
    }
}

/// A JPEG with one more segment.
fn with_segment(jpeg: &[u8], segment: &[u8]) -> Vec<u8> {
    let (before, behind) = jpeg.split_at(place_of_segments(jpeg));
    [before, segment, behind].concat()
}

/// A segment of a JPEG: its mark and its length, which counts itself, go before its content.
fn segment(mark: u8, content: &[u8]) -> Vec<u8> {
    let length = 2 + content.len() as u16;
    [&[0xff, mark], &length.to_be_bytes()[..], content].concat()
}

/// The segment of a stereo JPEG: stereo, side by side, whole height and width, the right eye's view first, no gap and no comment.
fn crossed_segment() -> Vec<u8> {
    let content = [b"_JPSJPS_".as_slice(), &[0, 4], &[0, 0, 2, 1], &[0, 0]].concat();
    segment(0xe3, &content)
}

/// Types of fields of a directory.
const LONG: u16 = 4;
const UNDEFINED: u16 = 7;
const RATIONAL: u16 = 5;
const SIGNED_RATIONAL: u16 = 10;

/// Bytes of the header of a directory's block, up to its first directory.
const HEADER: u32 = 8;

/// A picture of two of the kind "disparity", and the one that stands for both.
const DISPARITY: u32 = 0x0002_0002;
const REPRESENTATIVE: u32 = 0x2000_0000;

/// A fraction that says that a length or an angle is unknown.
const UNKNOWN: [u8; 8] = [0xff; 8];

/// A field of a directory, whose value is stored in it or in the block at a place.
fn field(tag: u16, kind: u16, count: u32, value: [u8; 4]) -> Vec<u8> {
    [
        &tag.to_le_bytes()[..],
        &kind.to_le_bytes(),
        &count.to_le_bytes(),
        &value,
    ]
    .concat()
}

/// A directory, without the values that it points to.
fn directory(fields: &[Vec<u8>], next: u32) -> Vec<u8> {
    let count = fields.len() as u16;
    [
        &count.to_le_bytes()[..],
        &fields.concat(),
        &next.to_le_bytes(),
    ]
    .concat()
}

/// The directory of one of the two pictures, `at` in its block: its number from the left, and the first as the base of both.
fn attributes(number: u32, at: u32, has_version: bool) -> Vec<u8> {
    let version = has_version.then(|| field(0xb000, UNDEFINED, 4, *b"0100"));
    let count = 4 + u32::from(has_version);
    // Behind the fields and the place of a next directory.
    let values = at + 2 + 12 * count + 4;
    let fields: Vec<Vec<u8>> = (version.into_iter())
        .chain([
            field(0xb101, LONG, 1, number.to_le_bytes()),
            field(0xb204, LONG, 1, 1u32.to_le_bytes()),
            field(0xb205, SIGNED_RATIONAL, 1, values.to_le_bytes()),
            field(0xb206, RATIONAL, 1, (values + 8).to_le_bytes()),
        ])
        .collect();
    [directory(&fields, 0), UNKNOWN.to_vec(), UNKNOWN.to_vec()].concat()
}

/// A segment of a multi-picture file around its directories.
fn directories(content: &[u8]) -> Vec<u8> {
    let header = [b"MPF\0II*\0".as_slice(), &HEADER.to_le_bytes()].concat();
    segment(0xe2, &[&header, content].concat())
}

/// The two views as one file.
fn multi_picture(left: &[u8], right: &[u8]) -> Vec<u8> {
    let right = with_segment(right, &directories(&attributes(2, HEADER, true)));
    // The index has three fields; two entries of 16 bytes follow, and the first picture's own directory.
    let entries_at = HEADER + 2 + 3 * 12 + 4;
    let attributes_at = entries_at + 2 * 16;
    let first = |entries: &[u8]| {
        let index = [
            field(0xb000, UNDEFINED, 4, *b"0100"),
            field(0xb001, LONG, 1, 2u32.to_le_bytes()),
            field(0xb002, UNDEFINED, 2 * 16, entries_at.to_le_bytes()),
        ];
        let own = attributes(1, attributes_at, false);
        let content = [&directory(&index, attributes_at)[..], entries, &own].concat();
        with_segment(left, &directories(&content))
    };
    let size = index32(first(&[0; 32]).len());
    // Places are counted from the header inside the first picture's segment: mark, length and name come before it.
    let header_at = index32(place_of_segments(left)) + 8;
    let entry =
        |kind: u32, bytes: u32, at: u32| [kind, bytes, at, 0].map(u32::to_le_bytes).concat();
    let entries = [
        entry(DISPARITY | REPRESENTATIVE, size, 0),
        entry(DISPARITY, index32(right.len()), size - header_at),
    ]
    .concat();
    [first(&entries), right].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture whose left half is red and whose right half is blue.
    fn pair() -> Image {
        let mut image = Image::transparent(32, 16);
        for (i, pixel) in image.rgba.iter_mut().enumerate() {
            *pixel = if i % 32 < 16 {
                [1.0, 0.0, 0.0, 1.0]
            } else {
                [0.0, 0.0, 1.0, 1.0]
            };
        }
        image
    }

    fn written(views: Views) -> Vec<u8> {
        let mut file = Vec::new();
        write(&mut file, &pair(), views).expect("written");
        file
    }

    fn decoded(jpeg: &[u8]) -> image::RgbImage {
        let format = image::ImageFormat::Jpeg;
        let picture = image::load_from_memory_with_format(jpeg, format);
        picture.expect("a JPEG").to_rgb8()
    }

    #[test]
    fn a_multi_picture_file_holds_both_views_where_its_index_says() {
        let file = written(Views::Two);
        let header = file
            .windows(4)
            .position(|w| w == b"MPF\0")
            .expect("a segment")
            + 4;
        let number = |at: usize| {
            let bytes = file[header + at..header + at + 4].try_into();
            u32::from_le_bytes(bytes.expect("four bytes")) as usize
        };
        assert_eq!(&file[header..header + 4], b"II*\0");
        // The third field of the index points to the entries.
        let entries = number(8 + 2 + 2 * 12 + 8);
        assert_eq!(number(entries), 0x2002_0002);
        let [size, second_size, second] = [
            number(entries + 4),
            number(entries + 20),
            number(entries + 24),
        ];
        assert_eq!(number(entries + 8), 0, "the first picture begins the file");
        assert_eq!(header + second, size);
        assert_eq!(size + second_size, file.len());
        assert_eq!(&file[size..size + 2], &[0xff, 0xd8]);
        assert_eq!(&file[size - 2..size], &[0xff, 0xd9]);
        let [left, right] = [decoded(&file), decoded(&file[size..])];
        assert_eq!([left.dimensions(), right.dimensions()], [(16, 16); 2]);
        let [red, blue] = [left.get_pixel(8, 8).0, right.get_pixel(8, 8).0];
        assert!(red[0] > 250 && red[2] < 5, "{red:?}");
        assert!(blue[2] > 250 && blue[0] < 5, "{blue:?}");
    }

    #[test]
    fn a_stereo_jpeg_has_the_right_eye_s_view_on_the_left() {
        let file = written(Views::Crossed);
        let mark = file
            .windows(8)
            .position(|w| w == b"_JPSJPS_")
            .expect("a segment");
        assert_eq!(&file[mark - 4..mark], &[0xff, 0xe3, 0, 18]);
        assert_eq!(&file[mark + 8..mark + 16], &[0, 4, 0, 0, 2, 1, 0, 0]);
        let picture = decoded(&file);
        assert_eq!(picture.dimensions(), (32, 16));
        assert!(picture.get_pixel(4, 8).0[2] > 250 && picture.get_pixel(28, 8).0[0] > 250);
    }

    #[test]
    fn one_view_is_a_plain_jpeg() {
        let file = written(Views::One);
        assert_eq!(decoded(&file).dimensions(), (32, 16));
        assert!(!file.windows(4).any(|w| w == b"MPF\0"));
    }
}
