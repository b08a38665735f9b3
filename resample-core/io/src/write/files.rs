//! Pictures, text and bytes as whole files: they appear complete or not at all.
//!
//! The format of a picture follows from its extension.

use std::io;
use std::io::{BufWriter, Seek, Write};
use std::path::Path;

use resample_core::image::linear_from_srgb;
use resample_core::{Error, Image};
use serde::{Deserialize, Serialize};
use tempfile::NamedTempFile;

use super::failure::WriteFailure;
use super::png::Depth;
use super::stereo_jpeg::{self, Views};
use super::temporary::{folder_of, is_stdout, temporary_file};
use super::{exr, png};

/// How a picture is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// sRGB, straight alpha.
    Png(Depth),
    /// Linear light, premultiplied, 32-bit floating point.
    Exr,
    /// sRGB, 8 bits, lossy and opaque; of one view, or of the two of a stereo photograph.
    Jpeg(Views),
}

/// The format that the extension of `path` asks for; PNG on the standard output, `-`.
///
/// `bits` is 8 or 16 if asked for; only a PNG can take it.
pub fn format_of(path: &Path, bits: Option<u8>) -> Result<Format, Error> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match (extension.as_deref(), bits) {
        (Some("png"), Some(16)) => Ok(Format::Png(Depth::Sixteen)),
        (Some("png"), _) => Ok(Format::Png(Depth::Eight)),
        (Some("exr"), None) => Ok(Format::Exr),
        (Some("exr"), Some(_)) => refused(format!(
            "{}: an EXR file always has 32 bits per channel: leave --bits out",
            path.display()
        )),
        (Some("jpg" | "jpeg"), None | Some(8)) => Ok(Format::Jpeg(Views::One)),
        (Some("mpo"), None | Some(8)) => Ok(Format::Jpeg(Views::Two)),
        (Some("jps"), None | Some(8)) => Ok(Format::Jpeg(Views::Crossed)),
        (Some("jpg" | "jpeg" | "mpo" | "jps"), Some(_)) => refused(format!(
            "{}: a JPEG has 8 bits per channel: leave --bits out",
            path.display()
        )),
        (None, Some(16)) if is_stdout(path) => Ok(Format::Png(Depth::Sixteen)),
        (None, _) if is_stdout(path) => Ok(Format::Png(Depth::Eight)),
        _ => refused(format!(
            "{}: unknown picture format: the name must end in .png, .jpg or .exr (stereo pairs: .mpo, .jps; animations: .apng, .webp, .gif, .mp4, .webm, .mkv)",
            path.display()
        )),
    }
}

/// Writes a picture and gives the size of the file in bytes.
pub fn write_picture(path: &Path, format: Format, image: &Image) -> Result<u64, WriteFailure> {
    write_marked_picture(path, format, image, None)
}

/// As [`write_picture`], with a short text in the file that `png_mark` and `exr_mark` find again.
pub fn write_marked_picture(
    path: &Path,
    format: Format,
    image: &Image,
    mark: Option<&str>,
) -> Result<u64, WriteFailure> {
    write_whole(path, |file| match format {
        Format::Png(depth) => png::write(file, image, depth, mark),
        Format::Exr => exr::write(file, image, mark),
        Format::Jpeg(views) => stereo_jpeg::write(file, image, views),
    })
}

/// Writes a tile of a picture of the size `whole`, from column and row `first` on, in full precision, and a mark.
pub fn write_tile(
    path: &Path,
    tile: &Image,
    place: ([usize; 2], [usize; 2]),
    mark: &str,
) -> Result<u64, WriteFailure> {
    write_whole(path, |file| exr::write_window(file, tile, place, mark))
}

/// The bytes of the PNG file of a picture, 8 bits a channel.
pub fn png_file(image: &Image) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    png::write(&mut bytes, image, Depth::Eight, None)?;
    Ok(bytes)
}

/// The codes of a PNG: red, green, blue and alpha of each pixel, 8 bits in sRGB, straight.
pub fn png_codes(image: &Image) -> Vec<u8> {
    png::bytes(image, Depth::Eight)
}

/// Writes one plane of numbers as a grey picture, in the format of its name: 0 to 1 become the codes of a PNG as they
/// are, without the sRGB curve; EXR keeps every number in a channel Y.
pub fn write_grey(
    path: &Path,
    format: Format,
    size: [usize; 2],
    values: &[f32],
) -> Result<u64, WriteFailure> {
    write_whole(path, |file| match format {
        Format::Png(_) => png::write_grey(file, size, values),
        Format::Exr => exr::write_grey(file, size, values),
        Format::Jpeg(views) => stereo_jpeg::write(file, &grey(size, values), views),
    })
}

/// A plane as a grey picture, as dark as the codes of [`png::write_grey`].
fn grey([width, height]: [usize; 2], values: &[f32]) -> Image {
    let mut image = Image::transparent(width, height);
    for (pixel, &value) in image.rgba.iter_mut().zip(values) {
        let light = linear_from_srgb(value);
        *pixel = [light, light, light, 1.0];
    }
    image
}

/// Writes text and gives the size of the file in bytes.
pub fn write_text(path: &Path, text: &str) -> Result<u64, WriteFailure> {
    write_whole(path, |file| file.write_all(text.as_bytes()))
}

/// Writes bytes and gives their number.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<u64, WriteFailure> {
    write_whole(path, |file| file.write_all(bytes))
}

/// Writes a file through a temporary one, or the standard output once all of it is there.
pub(super) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<NamedTempFile>) -> io::Result<()>,
) -> Result<u64, WriteFailure> {
    let written = || -> io::Result<u64> {
        let folder = if is_stdout(path) {
            std::env::temp_dir()
        } else {
            folder_of(path).to_owned()
        };
        let (file, _listed) = temporary_file(&folder)?;
        let mut buffered = BufWriter::new(file);
        write(&mut buffered)?;
        let mut file = buffered
            .into_inner()
            .map_err(io::IntoInnerError::into_error)?;
        let bytes = file.seek(io::SeekFrom::End(0))?;
        if is_stdout(path) {
            file.rewind()?;
            io::copy(&mut file, &mut io::stdout().lock())?;
        } else {
            file.persist(path)?;
        }
        Ok(bytes)
    };
    written().map_err(WriteFailure::of(path))
}

fn refused(text: String) -> Result<Format, Error> {
    Err(Error::Input(text))
}
