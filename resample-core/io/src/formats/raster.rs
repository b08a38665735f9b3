//! PNG, JPEG, TIFF, PNM and the other formats that hold a plain picture.
//!
//! Takes a path, gives a linear picture, or the numbers of a grey one, row by row. The size in the header is held
//! against the length of the file before the pixels are decoded. PNG and Radiance (`radiance`) are decoded row by row; the others, and
//! interlaced PNG, are held whole as they are stored; photographs in JPEG and WebP are turned upright. A JPEG is checked to be complete, because decoders draw missing parts in grey. The
//! decoding itself is the crates' `image` and `png`.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use ::png::{BitDepth, ColorType, Decoder, DecodingError, Transformations};
use exif::{In, Tag};
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use resample_core::Error;
use resample_core::image::linear_from_srgb;

use crate::files::{MAX_PIXELS, cannot_read, check_claim, fault, first_bytes, open};
use crate::formats::radiance;
use crate::picture::{Row, Rows, Storage, Stored};
use crate::receiver::{Receiver, Room};

/// Returns true if the file has alpha.
pub(crate) fn decode_colour(path: &Path, room: Room, to: &mut dyn Receiver) -> Result<bool, Error> {
    let mut rows = ColourRows {
        to,
        channels: 0,
        tables: [Vec::new(), Vec::new()],
        row: Vec::new(),
    };
    decode(path, room, &mut rows)?;
    Ok(rows.channels.is_multiple_of(2))
}

/// The stored numbers of a grey picture. Three equal channels count as grey: some tools know no other PNG.
pub(crate) fn decode_depth(
    path: &Path,
    room: Room,
    to: &mut dyn Receiver,
) -> Result<Stored, Error> {
    let mut rows = GreyRows {
        path,
        to,
        channels: 0,
        stored: Stored::Code(255),
        row: Vec::new(),
    };
    decode(path, room, &mut rows)?;
    Ok(rows.stored)
}

/// Width and height, from the header alone.
pub(crate) fn size(path: &Path) -> Result<[u32; 2], Error> {
    let (format, mut decoder) = checked_decoder(path)?;
    Ok(turned_size(format, &mut decoder))
}

/// Half of the diagonal of 35 mm film, 36 mm by 24 mm: equivalent focal lengths have the same diagonal field of view.
const HALF_DIAGONAL_MM: f64 = 21.633;

/// The vertical field of view of a photograph, degrees, from the 35 mm equivalent focal length of its EXIF data.
pub(crate) fn fov_y_deg(path: &Path) -> Result<Option<f64>, Error> {
    let (format, mut decoder) = checked_decoder(path)?;
    let [width, height] = turned_size(format, &mut decoder).map(f64::from);
    let bytes = decoder.exif_metadata().ok().flatten();
    let fields = bytes.and_then(|bytes| exif::Reader::new().read_raw(bytes).ok());
    let focal_mm = fields.and_then(|fields| {
        let field = fields.get_field(Tag::FocalLengthIn35mmFilm, In::PRIMARY)?;
        field.value.get_uint(0)
    });
    // 0 stands for an unknown length.
    let focal_mm = focal_mm.filter(|&length| length > 0).map(f64::from);
    let half = |focal_mm| HALF_DIAGONAL_MM / focal_mm * height / width.hypot(height);
    Ok(focal_mm.map(|focal_mm| 2.0 * half(focal_mm).atan().to_degrees()))
}

/// The EXIF orientation of a photograph. Other formats are stored upright.
fn orientation(format: ImageFormat, decoder: &mut impl ImageDecoder) -> Orientation {
    match format {
        ImageFormat::Jpeg | ImageFormat::WebP => {
            decoder.orientation().unwrap_or(Orientation::NoTransforms)
        }
        _ => Orientation::NoTransforms,
    }
}

/// Width and height of the upright picture.
fn turned_size(format: ImageFormat, decoder: &mut impl ImageDecoder) -> [u32; 2] {
    let (width, height) = decoder.dimensions();
    match orientation(format, decoder) {
        Orientation::Rotate90
        | Orientation::Rotate270
        | Orientation::Rotate90FlipH
        | Orientation::Rotate270FlipH => [height, width],
        Orientation::NoTransforms
        | Orientation::Rotate180
        | Orientation::FlipHorizontal
        | Orientation::FlipVertical => [width, height],
    }
}

/// The memory that reading takes, from the header alone.
pub(crate) fn storage(path: &Path) -> Result<Storage, Error> {
    let (format, mut decoder) = checked_decoder(path)?;
    let colour = decoder.color_type();
    let is_by_rows = match format {
        ImageFormat::Png => !is_interlaced(path)?,
        ImageFormat::Hdr => radiance::is_by_rows(path)?,
        _ => false,
    };
    Ok(Storage {
        size: turned_size(format, &mut decoder),
        channel_bytes: colour.bytes_per_pixel() / colour.channel_count(),
        decoder_bytes: if is_by_rows {
            0
        } else {
            u64::from(colour.bytes_per_pixel()) * buffers(format)
        },
    })
}

/// As many decoded pictures as a decoder's buffers are large: the picture, and the packed file, or a progressive JPEG's
/// coefficients, two bytes for each number.
fn buffers(format: ImageFormat) -> u64 {
    if format == ImageFormat::Jpeg { 3 } else { 2 }
}

/// Rows on their way to linear light.
struct ColourRows<'a> {
    to: &'a mut dyn Receiver,
    channels: usize,
    /// Linear light of each code of 8 and of 16 bits, once one was needed.
    tables: [Vec<f32>; 2],
    row: Vec<f32>,
}

impl Rows for ColourRows<'_> {
    fn begin(&mut self, size: [usize; 2], channels: usize) -> Result<(), Error> {
        self.channels = channels;
        self.to.begin(size)
    }

    fn row(&mut self, y: usize, row: &Row<'_>) -> Result<(), Error> {
        let channels = self.channels;
        self.row.clear();
        match row {
            Row::Bytes(codes) => {
                let table = filled(&mut self.tables[0], u8::MAX.into());
                let pixels = codes.chunks_exact(channels).map(rgba::<u8>);
                self.row
                    .extend(pixels.flat_map(|p| linear(table, p.map(usize::from), 255.0)));
            }
            Row::Words(codes) => {
                let table = filled(&mut self.tables[1], u16::MAX.into());
                let pixels = codes.chunks_exact(channels).map(rgba::<u16>);
                self.row
                    .extend(pixels.flat_map(|p| linear(table, p.map(usize::from), 65_535.0)));
            }
            Row::Floats(values) => self
                .row
                .extend(values.chunks_exact(channels).flat_map(rgba::<f32>)),
        }
        self.to.put([0, y], &self.row)
    }
}

/// The largest number of a type of channel: covered whole.
trait Whole: Copy {
    const WHOLE: Self;
}

impl Whole for u8 {
    const WHOLE: Self = u8::MAX;
}

impl Whole for u16 {
    const WHOLE: Self = u16::MAX;
}

impl Whole for f32 {
    const WHOLE: Self = 1.0;
}

/// One to four channels as four.
fn rgba<T: Whole>(channels: &[T]) -> [T; 4] {
    match *channels {
        [grey] => [grey, grey, grey, T::WHOLE],
        [grey, alpha] => [grey, grey, grey, alpha],
        [r, g, b] => [r, g, b, T::WHOLE],
        [r, g, b, alpha, ..] => [r, g, b, alpha],
        [] => [T::WHOLE; 4],
    }
}

/// The table of linear light for codes up to `largest`.
fn filled(table: &mut Vec<f32>, largest: u32) -> &[f32] {
    if table.is_empty() {
        table.extend((0..=largest).map(|code| linear_from_srgb(code as f32 / largest as f32)));
    }
    table
}

fn linear(table: &[f32], [r, g, b, alpha]: [usize; 4], largest: f32) -> [f32; 4] {
    [table[r], table[g], table[b], alpha as f32 / largest]
}

/// Rows on their way to numbers of a depth.
struct GreyRows<'a> {
    path: &'a Path,
    to: &'a mut dyn Receiver,
    channels: usize,
    stored: Stored,
    row: Vec<f32>,
}

impl Rows for GreyRows<'_> {
    fn begin(&mut self, size: [usize; 2], channels: usize) -> Result<(), Error> {
        self.channels = channels;
        self.to.begin(size)
    }

    fn row(&mut self, y: usize, row: &Row<'_>) -> Result<(), Error> {
        self.row.clear();
        match (row, self.channels) {
            (Row::Bytes(codes), 1) => self.row.extend(codes.iter().map(|&code| f32::from(code))),
            (Row::Words(codes), 1) => {
                self.stored = Stored::Code(65_535);
                self.row.extend(codes.iter().map(|&code| f32::from(code)));
            }
            (Row::Bytes(codes), channels @ (3 | 4)) => {
                let mut pixels = codes.chunks_exact(channels);
                if !pixels.clone().all(|p| p[0] == p[1] && p[1] == p[2]) {
                    return Err(self.not_grey("Rgb8"));
                }
                self.row.extend(pixels.by_ref().map(|p| f32::from(p[0])));
            }
            (Row::Bytes(_), _) => return Err(self.not_grey("La8")),
            (Row::Words(_), channels) => {
                return Err(self.not_grey(if channels == 2 { "La16" } else { "Rgb16" }));
            }
            (Row::Floats(_), _) => return Err(self.not_grey("Rgb32F")),
        }
        self.to.put([0, y], &self.row)
    }
}

impl GreyRows<'_> {
    fn not_grey(&self, found: &str) -> Error {
        fault(
            self.path,
            format!("depth has one number per pixel, this is a picture of type {found}"),
        )
    }
}

/// Gives the rows of a picture from the top.
fn decode(path: &Path, room: Room, rows: &mut dyn Rows) -> Result<(), Error> {
    let (format, mut decoder) = checked_decoder(path)?;
    let is_done = match format {
        ImageFormat::Png => decode_png(path, rows)?,
        ImageFormat::Hdr => radiance::decode(path, rows)?,
        _ => false,
    };
    if is_done {
        return Ok(());
    }
    let (width, height) = decoder.dimensions();
    let bytes = decoder.total_bytes().saturating_mul(buffers(format));
    room.check(
        path,
        bytes,
        &format!("a picture of {width}x{height} pixels in this format"),
    )?;
    let orientation = orientation(format, &mut decoder);
    let mut image =
        DynamicImage::from_decoder(decoder).map_err(|error| not_usable(path, &error))?;
    image.apply_orientation(orientation);
    let (width, height) = (image.width() as usize, image.height() as usize);
    let channels = usize::from(image.color().channel_count());
    rows.begin([width, height], channels)?;
    let row = |y: usize| y * width * channels..(y + 1) * width * channels;
    for y in 0..height {
        if let Some(codes) = image.as_flat_samples_u8() {
            rows.row(y, &Row::Bytes(&codes.samples[row(y)]))?;
        } else if let Some(codes) = image.as_flat_samples_u16() {
            rows.row(y, &Row::Words(&codes.samples[row(y)]))?;
        } else if let Some(values) = image.as_flat_samples_f32() {
            rows.row(y, &Row::Floats(&values.samples[row(y)]))?;
        } else {
            return Err(fault(
                path,
                format!("a picture of type {:?} is not read", image.color()),
            ));
        }
    }
    Ok(())
}

fn not_usable(path: &Path, error: &image::ImageError) -> Error {
    fault(path, format!("not a usable picture: {error}"))
}

/// Most bytes of a colour profile of a PNG. A guess.
const MAX_PROFILE_BYTES: u64 = 64 << 20;

/// A decoder whose claims have been held against the length of the file, and the format.
fn checked_decoder(path: &Path) -> Result<(ImageFormat, impl ImageDecoder + use<>), Error> {
    let (file, length) = open(path)?;
    let mut file: BufReader<File> = BufReader::new(file);
    let guessed = ImageReader::new(&mut file)
        .with_guessed_format()
        .map_err(|source| cannot_read(path, &source))?;
    let Some(format) = guessed.format() else {
        return Err(fault(
            path,
            "no known picture format (the content decides): expected PNG, JPEG, EXR, TIFF, HDR or WebP for colours; depths may also be PFM or .npy",
        ));
    };
    file.rewind().map_err(|source| cannot_read(path, &source))?;
    if format == ImageFormat::Jpeg {
        let mut bytes = Vec::new();
        let read = file.by_ref().take(length).read_to_end(&mut bytes);
        read.map_err(|source| cannot_read(path, &source))?;
        check_whole_jpeg(&bytes).map_err(|what| fault(path, what))?;
        file.rewind().map_err(|source| cannot_read(path, &source))?;
    }
    let mut reader = ImageReader::with_format(file, format);
    let mut limits = Limits::default();
    // Four channels of four bytes, the widest type, and as much again for the decoder's own buffers.
    limits.max_alloc = Some(match format {
        // This decoder takes the limit for what it unpacks beside the pixels: colour profiles, which are not used.
        ImageFormat::Png => MAX_PROFILE_BYTES,
        _ => MAX_PIXELS * 32,
    });
    reader.limits(limits);
    let decoder = reader
        .into_decoder()
        .map_err(|error| not_usable(path, &error))?;
    let (width, height) = decoder.dimensions();
    check_claim(
        width.into(),
        height.into(),
        length,
        most_pixels_per_byte(format),
    )
    .map_err(|what| fault(path, what))?;
    Ok((format, decoder))
}

/// The largest number of pixels that one byte of a format can stand for.
fn most_pixels_per_byte(format: ImageFormat) -> u64 {
    match format {
        // Deflate unpacks a byte to at most 1032, each of up to eight pixels of one bit.
        ImageFormat::Png => 1032 * 8,
        // At least one bit for each block of 8 x 8 pixels.
        ImageFormat::Jpeg => 64 * 8,
        ImageFormat::Pnm | ImageFormat::Tga => 128 * 8,
        // As TIFF's LZW: 2559 bytes for one, each of up to eight pixels of one bit.
        _ => 2560 * 8,
    }
}

/// Returns true if the file is interlaced: the last byte of its header, which begins at byte 16 and has 13.
pub(crate) fn is_interlaced(path: &Path) -> Result<bool, Error> {
    Ok(first_bytes(path, 29)?
        .get(28)
        .is_some_and(|&byte| byte != 0))
}

/// Gives the rows of a PNG from the top; false, without a row, if the file is interlaced.
fn decode_png(path: &Path, rows: &mut dyn Rows) -> Result<bool, Error> {
    let wrong = |error: DecodingError| fault(path, format!("not a usable picture: {error}"));
    let (file, _) = open(path)?;
    // The crate's own limit, 64 MiB, bounds the text and profiles that it unpacks.
    let mut decoder = Decoder::new(BufReader::new(file));
    decoder.set_transformations(Transformations::EXPAND);
    // Neither is used, and a small one may unpack to gigabytes.
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(wrong)?;
    if reader.info().interlaced {
        return Ok(false);
    }
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let (colour, depth) = reader.output_color_type();
    let channels = match colour {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => {
            return Err(fault(
                path,
                "not a usable picture: a palette that was not expanded",
            ));
        }
    };
    rows.begin([width, height], channels)?;
    let mut words = Vec::new();
    for y in 0..height {
        let row = reader.next_row().map_err(wrong)?;
        let row = row.ok_or_else(|| {
            fault(
                path,
                format!("not a usable picture: row {y} of {height} is missing"),
            )
        })?;
        if depth == BitDepth::Sixteen {
            words.clear();
            words.extend(
                row.data()
                    .chunks_exact(2)
                    .map(|two| u16::from_be_bytes([two[0], two[1]])),
            );
            rows.row(y, &Row::Words(&words))?;
        } else {
            rows.row(y, &Row::Bytes(row.data()))?;
        }
    }
    Ok(true)
}

/// Marks of the beginning of data and of the image's end; each follows a byte of ones.
const DATA: u8 = 0xda;
const END: u8 = 0xd9;

/// Refuses a JPEG whose data breaks off. A JPEG without any image data is left to the decoder.
pub(crate) fn check_whole_jpeg(bytes: &[u8]) -> Result<(), String> {
    let Some(data) = data_of(bytes) else {
        return Ok(());
    };
    match data.windows(2).any(|pair| pair == [0xff, END]) {
        true => Ok(()),
        false => Err("the JPEG breaks off: its end is missing".into()),
    }
}

/// The bytes between the last segment and the first data.
fn data_of(bytes: &[u8]) -> Option<&[u8]> {
    let mut rest = bytes.strip_prefix(b"\xff\xd8")?;
    loop {
        let [0xff, kind, after @ ..] = rest else {
            return None;
        };
        match kind {
            // Filling before a mark.
            0xff => rest = &rest[1..],
            &DATA => return Some(after),
            _ => {
                let length = u16::from_be_bytes([*after.first()?, *after.get(1)?]);
                rest = after.get(usize::from(length)..)?;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jpegs_that_break_off_are_refused() {
        let noise = |k: u32| (k.wrapping_mul(0x9e37_79b1) >> 24) as u8;
        let picture = image::RgbImage::from_fn(64, 48, |x, y| {
            image::Rgb([noise(x), noise(y), noise(x + y)])
        });
        let mut file = std::io::Cursor::new(Vec::new());
        let written = picture.write_to(&mut file, ImageFormat::Jpeg);
        written.expect("memory");
        let whole = file.into_inner();
        assert_eq!(check_whole_jpeg(&whole), Ok(()));
        let followed = [whole.as_slice(), b"more"].concat();
        assert_eq!(check_whole_jpeg(&followed), Ok(()), "bytes after the end");
        for length in [whole.len() - 1, whole.len() - 40, whole.len() / 2] {
            let gate = crate::Gate::default();
            let decoded = crate::whole_picture::decode(&whole[..length], None, &gate);
            assert!(
                decoded.is_err_and(|what| what.contains("breaks off")),
                "{length} of {} bytes",
                whole.len()
            );
        }
    }
}
