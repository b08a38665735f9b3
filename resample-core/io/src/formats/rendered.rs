//! Pictures as the writers leave them: PNG, animated PNG, JPEG and OpenEXR, brought to linear light with premultiplied alpha.
//!
//! Takes the name of a file, or a pattern such as `out/a_%04d.png` that stands for numbered pictures, and gives one
//! [`Image`] after another, so that an animation never lies in memory as a whole. The content decides the format.
//! Limits: colour and alpha only, except tiles of a picture (`planes`); 8 bits in an animated PNG; no video.

use std::fmt::Display;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use ::exr::prelude::{
    FlatSamples, MetaData, read_first_flat_layer_from_file, read_first_rgba_layer_from_file,
};
use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::PngDecoder;
use image::{AnimationDecoder, DynamicImage, Frames, ImageDecoder, Limits};
use resample_core::image::{Plane, linear_from_srgb};
use resample_core::{Error, Image};

use crate::camera_file::MAX_PIXELS;
use crate::files::{self, fault};
use crate::formats::exr;
use crate::gate::Gate;
use crate::names::FrameNames;
use crate::write::png::Depth;
use crate::write::{self, Format};

/// Most bytes of a part of a PNG that holds no pixels, such as a colour profile. A guess.
const MAX_CHUNK_BYTES: u64 = 64 << 20;

/// Bytes that a pixel takes while it is read: as it is stored, in floating point, and as it is given.
const PIXEL_BYTES: u64 = 8 + 16 + 16;

/// The pictures of a file or of a numbered row of files, in order.
pub struct Pictures {
    source: Source,
    /// Pictures that were given.
    given: usize,
}

enum Source {
    /// One file that holds one picture.
    Still(PathBuf),
    /// Files, numbered from 0, until one is missing.
    Numbered(FrameNames),
    /// An animated PNG.
    Frames(PathBuf, Frames<'static>),
}

impl Pictures {
    /// Opens `path`; errors in later pictures show when they are read.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let names = FrameNames::single(path)?;
        if matches!(names, FrameNames::Numbered { .. }) {
            return Ok(Self {
                source: Source::Numbered(names),
                given: 0,
            });
        }
        let source = match content_of(path)? {
            Content::Exr | Content::Jpeg => Source::Still(path.to_owned()),
            Content::Png | Content::Png8 => {
                let decoder = png(path)?;
                if decoder.is_apng().map_err(|error| broken(path, error))? {
                    let frames = decoder
                        .apng()
                        .map_err(|error| broken(path, error))?
                        .into_frames();
                    Source::Frames(path.to_owned(), frames)
                } else {
                    Source::Still(path.to_owned())
                }
            }
        };
        Ok(Self { source, given: 0 })
    }

    /// The next picture, `None` after the last.
    pub fn next_picture(&mut self) -> Result<Option<Image>, Error> {
        let index = self.given;
        self.given += 1;
        match &mut self.source {
            Source::Still(path) if index == 0 => read(path).map(Some),
            Source::Still(_) => Ok(None),
            Source::Numbered(names) => {
                let file = names.frame(index);
                // The first must be there; the first that is missing ends the row.
                if index > 0 && !file.exists() {
                    Ok(None)
                } else {
                    read(&file).map(Some)
                }
            }
            Source::Frames(path, frames) => match frames.next() {
                None => Ok(None),
                Some(frame) => {
                    let frame =
                        frame.map_err(|error| fault(path, format!("picture {index}: {error}")))?;
                    Ok(Some(linear(&DynamicImage::ImageRgba8(frame.into_buffer()))))
                }
            },
        }
    }
}

/// The one picture of a file.
pub fn read(path: &Path) -> Result<Image, Error> {
    match content_of(path)? {
        Content::Exr => read_exr(path),
        Content::Jpeg => read_jpeg(path),
        Content::Png | Content::Png8 => {
            let decoded =
                DynamicImage::from_decoder(png(path)?).map_err(|error| broken(path, error))?;
            Ok(linear(&decoded))
        }
    }
}

/// The content of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// 8 bits a channel.
    Png8,
    /// 16 bits a channel, or fewer than 8.
    Png,
    /// OpenEXR.
    Exr,
    /// JPEG, 8 bits.
    Jpeg,
}

impl Content {
    /// The content that a format has.
    pub fn of(format: Format) -> Self {
        match format {
            Format::Png(Depth::Eight) => Self::Png8,
            Format::Png(Depth::Sixteen) => Self::Png,
            Format::Exr => Self::Exr,
            Format::Jpeg(_) => Self::Jpeg,
        }
    }
}

impl Display for Content {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Png8 => "a PNG of 8 bits",
            Self::Png => "a PNG of 16 bits",
            Self::Exr => "an EXR",
            Self::Jpeg => "a JPEG",
        })
    }
}

/// A picture that could be decoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// Its format.
    pub content: Content,
    /// Width and height, px.
    pub size: [usize; 2],
    /// The mark that [`write::write_marked_picture`] left in it.
    pub mark: Option<String>,
}

impl Display for Description {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [width, height] = self.size;
        write!(f, "{} of {width}x{height} pixels", self.content)
    }
}

/// Decodes a picture, and tells what is known of it.
pub fn description(path: &Path) -> Result<Description, Error> {
    let (content, mark) = match content_of(path)? {
        Content::Exr => (Content::Exr, write::exr::mark(path)),
        Content::Jpeg => (Content::Jpeg, None),
        Content::Png | Content::Png8 => {
            let colour = png(path)?.color_type();
            let has_eight = colour.bytes_per_pixel() == colour.channel_count();
            let content = if has_eight {
                Content::Png8
            } else {
                Content::Png
            };
            (content, write::png::mark(path))
        }
    };
    let picture = read(path)?;
    Ok(Description {
        content,
        size: [picture.width, picture.height],
        mark,
    })
}

fn content_of(path: &Path) -> Result<Content, Error> {
    match files::first_bytes(path, 8)?.as_slice() {
        [0x89, b'P', b'N', b'G', ..] => Ok(Content::Png),
        [0x76, 0x2f, 0x31, 0x01, ..] => Ok(Content::Exr),
        [0xff, 0xd8, 0xff, ..] => Ok(Content::Jpeg),
        _ => Err(fault(path, "expected a PNG, a JPEG or an OpenEXR picture")),
    }
}

/// A decoder that refuses more pixels than a picture may have.
fn png(path: &Path) -> Result<PngDecoder<BufReader<File>>, Error> {
    let (file, held) = files::open(path)?;
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_CHUNK_BYTES);
    let decoder = PngDecoder::with_limits(BufReader::new(file), limits)
        .map_err(|error| broken(path, error))?;
    let (width, height) = decoder.dimensions();
    check_pixels(path, u64::from(width), u64::from(height))?;
    let gate = Gate::default();
    let asked = gate.ask_unpacked(decoder.total_bytes(), held, "the pixels");
    asked.map_err(|what| fault(path, what))?;
    ask_floats(path, [width, height], held)?;
    Ok(decoder)
}

/// Asks for the memory of the pixels of a file that has `held` bytes.
fn ask_floats(path: &Path, [width, height]: [u32; 2], held: u64) -> Result<(), Error> {
    let floats = u64::from(width) * u64::from(height) * PIXEL_BYTES;
    let asked = Gate::default().ask_unpacked(floats, held, "the pixels");
    asked.map_err(|what| fault(path, what))
}

fn read_jpeg(path: &Path) -> Result<Image, Error> {
    let (file, held) = files::open(path)?;
    let decoder = JpegDecoder::new(BufReader::new(file)).map_err(|error| broken(path, error))?;
    let (width, height) = decoder.dimensions();
    check_pixels(path, u64::from(width), u64::from(height))?;
    ask_floats(path, [width, height], held)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(|error| broken(path, error))?;
    Ok(linear(&decoded))
}

/// Checks that an EXR file is whole and has no more pixels than a picture may have.
fn check_exr(path: &Path) -> Result<(), Error> {
    let unreadable = |error: ::exr::error::Error| broken(path, error);
    let (file, _) = files::open(path)?;
    exr::check_all(BufReader::new(file)).map_err(|what| broken(path, what))?;
    for header in &MetaData::read_from_file(path, false)
        .map_err(unreadable)?
        .headers
    {
        check_pixels(
            path,
            header.layer_size.width() as u64,
            header.layer_size.height() as u64,
        )?;
    }
    Ok(())
}

fn read_exr(path: &Path) -> Result<Image, Error> {
    check_exr(path)?;
    let unreadable = |error: ::exr::error::Error| broken(path, error);
    let read = read_first_rgba_layer_from_file(
        path,
        |size, _| Image::transparent(size.width(), size.height()),
        |image, at, (red, green, blue, alpha): (f32, f32, f32, f32)| {
            let index = at.y() * image.width + at.x();
            image.rgba[index] = [red, green, blue, alpha];
        },
    );
    Ok(read.map_err(unreadable)?.layer_data.channel_data.pixels)
}

fn check_pixels(path: &Path, width: u64, height: u64) -> Result<(), Error> {
    if width
        .checked_mul(height)
        .is_none_or(|pixels| pixels > MAX_PIXELS)
    {
        return Err(fault(
            path,
            format!("{width}x{height} are more than {MAX_PIXELS} pixels"),
        ));
    }
    Ok(())
}

fn broken(path: &Path, error: impl Display) -> Error {
    fault(path, format!("not a picture that can be read: {error}"))
}

/// From sRGB and straight alpha.
fn linear(picture: &DynamicImage) -> Image {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let straight = picture.to_rgba32f();
    let premultiplied = straight.pixels().map(|pixel| {
        let [r, g, b, alpha] = pixel.0;
        let [r, g, b] = [r, g, b].map(|encoded| linear_from_srgb(encoded) * alpha);
        [r, g, b, alpha]
    });
    Image {
        width,
        height,
        rgba: premultiplied.collect(),
        depth: None,
        planes: Vec::new(),
    }
}

/// The picture in full precision.
pub fn read_planes(path: &Path) -> Result<Image, Error> {
    check_exr(path)?;
    let layer = read_first_flat_layer_from_file(path)
        .map_err(|error| broken(path, error))?
        .layer_data;
    let mut image = Image::transparent(layer.size.width(), layer.size.height());
    for channel in layer.channel_data.list {
        let FlatSamples::F32(values) = channel.sample_data else {
            return Err(broken(path, "expected floating point of 32 bits"));
        };
        if values.len() != image.rgba.len() {
            return Err(broken(path, "its channels have unlike sizes"));
        }
        let name = channel.name.to_string();
        match ["R", "G", "B", "A"].iter().position(|known| *known == name) {
            Some(index) => {
                for (pixel, value) in image.rgba.iter_mut().zip(values) {
                    pixel[index] = value;
                }
            }
            None if name == "Z" => image.depth = Some(values),
            None => image.planes.push(Plane { name, values }),
        }
    }
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Image {
        let mut image = Image::transparent(3, 2);
        image.rgba[0] = [0.25, 0.5, 1.0, 1.0];
        image.rgba[4] = [0.1, 0.05, 0.0, 0.2];
        image
    }

    #[test]
    fn what_is_written_comes_back() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, format, tolerance) in [
            ("a.exr", Format::Exr, 0.0),
            ("a.png", Format::Png(Depth::Sixteen), 1e-4),
            ("b.png", Format::Png(Depth::Eight), 5e-3),
        ] {
            let path = folder.path().join(name);
            write::write_picture(&path, format, &picture()).expect("written");
            let back = read(&path).expect("read");
            assert_eq!((back.width, back.height), (3, 2), "{name}");
            for (a, b) in back
                .rgba
                .iter()
                .flatten()
                .zip(picture().rgba.iter().flatten())
            {
                assert!((a - b).abs() <= tolerance, "{name}: {a} against {b}");
            }
        }
    }

    #[test]
    fn rows_of_an_exr_run_from_the_top() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("small.exr");
        let value = |x: usize, y: usize| (x as f32, y as f32 + 0.25, -1.5, 1.0 / 3.0);
        ::exr::prelude::write_rgba_file(&path, 3, 2, value).expect("written");
        let image = read(&path).expect("read");
        assert_eq!((image.width, image.height), (3, 2), "size");
        assert_eq!(image.pixel(2, 1), [2.0, 1.25, -1.5, 1.0 / 3.0]);
        assert_eq!(image.pixel(1, 0), [1.0, 0.25, -1.5, 1.0 / 3.0]);
        let absent = folder.path().join("absent.exr");
        let complaint = read(&absent).expect_err("it is not there").to_string();
        assert!(complaint.contains("absent.exr"), "{complaint}");
    }

    #[test]
    fn a_row_of_files_ends_where_one_is_missing() {
        let folder = tempfile::tempdir().expect("a folder");
        for index in [0, 1, 3] {
            let path = folder.path().join(format!("f{index}.png"));
            write::write_picture(&path, Format::Png(Depth::Eight), &picture()).expect("written");
        }
        let mut pictures = Pictures::open(&folder.path().join("f%d.png")).expect("a pattern");
        let mut count = 0;
        while pictures.next_picture().expect("good").is_some() {
            count += 1;
        }
        assert_eq!(count, 2, "0 and 1; 3 is not next");
    }

    #[test]
    fn other_files_are_refused_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        std::fs::write(&path, b"text").expect("written");
        let complaint = read(&path).expect_err("no picture").to_string();
        assert!(
            complaint.contains("a.png") && complaint.contains("expected a PNG"),
            "{complaint}"
        );
        std::fs::write(&path, b"\x89PNG\r\n\x1a\n").expect("written");
        assert!(read(&path).is_err(), "a PNG without a header");
    }
}
