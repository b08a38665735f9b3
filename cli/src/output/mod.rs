//! Files that are written: checked before any work, written whole or not at all.
//!
//! Takes pictures and text, gives files. Everything goes to a temporary file in the target's own folder, which is
//! renamed when it is complete: a reader never sees half a picture, and what stood there before stays until then.
//! The format of a picture follows from its extension.

mod film;
#[cfg(test)]
mod tests;

use std::collections::HashSet;
use std::fs;
use std::io::{BufWriter, ErrorKind, Seek, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use resample_core::Image;
use resample_core::image::linear_from_srgb;
use resample_io::write::png::opaque_bytes;
use resample_io::write::{exr, png};
use tempfile::NamedTempFile;

use crate::process::interrupt;
use crate::process::interrupt::Listed;
use crate::values::word;

pub use crate::output::film::{DEFAULT_FPS, Film, FilmKind, FilmPlan, kind_of};
pub use resample_io::names::FrameNames;
pub(crate) use resample_io::write::exr::mark as exr_mark;
pub use resample_io::write::png::Depth;
pub(crate) use resample_io::write::png::mark as png_mark;

/// The beginning of every temporary file's name.
const PREFIX: &str = ".resample-";

/// The end of every temporary file's name.
const SUFFIX: &str = ".tmp";

/// How a picture is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    /// sRGB, straight alpha.
    Png(Depth),
    /// Linear light, premultiplied, 32-bit floating point.
    Exr,
    /// sRGB, 8 bits, lossy and opaque.
    Jpeg,
}

impl Format {
    /// The planes that `--layers` asks for. Only an EXR file has a place for them.
    pub(crate) fn layers<L: ValueEnum + Copy + PartialEq>(
        self,
        asked: Option<&Vec<L>>,
    ) -> Result<Vec<L>> {
        let Some(layers) = asked else {
            return Ok(Vec::new());
        };
        if self != Self::Exr {
            bail!("--layers: only a name that ends in .exr has a place for them");
        }
        let repeated = |&(index, layer): &(usize, &L)| layers[..index].contains(layer);
        if let Some((_, layer)) = layers.iter().enumerate().find(repeated) {
            bail!("--layers: {} is named twice", word(*layer));
        }
        Ok(layers.clone())
    }
}

/// Something that could not be written although all checks passed, such as a full disk. It is not bad input.
#[derive(Debug)]
pub struct WriteFailure {
    path: PathBuf,
}

impl std::fmt::Display for WriteFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: cannot write", self.path.display())
    }
}

/// Returns true if a name means the standard output.
fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

/// The format that the extension of `path` asks for; PNG on the standard output, `-`.
///
/// `bits` is 8 or 16 if asked for; only a PNG can take it.
pub fn format_of(path: &Path, bits: Option<u8>) -> Result<Format> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match (extension.as_deref(), bits) {
        (Some("png"), Some(16)) => Ok(Format::Png(Depth::Sixteen)),
        (Some("png"), _) => Ok(Format::Png(Depth::Eight)),
        (Some("exr"), None) => Ok(Format::Exr),
        (Some("exr"), Some(_)) => {
            bail!(
                "{}: an EXR file always has 32 bits per channel: leave --bits out",
                path.display()
            )
        }
        (Some("jpg" | "jpeg"), None | Some(8)) => Ok(Format::Jpeg),
        (Some("jpg" | "jpeg"), Some(_)) => {
            bail!(
                "{}: a JPEG has 8 bits per channel: leave --bits out",
                path.display()
            )
        }
        (None, Some(16)) if is_stdout(path) => Ok(Format::Png(Depth::Sixteen)),
        (None, _) if is_stdout(path) => Ok(Format::Png(Depth::Eight)),
        _ => bail!(
            "{}: unknown picture format: the name must end in .png, .jpg or .exr (animations: .apng, .webp, .gif, .mp4, .webm, .mkv)",
            path.display()
        ),
    }
}

/// Checks that a file can be made at `path`: the folder is there and can be written to, and only a file has
/// that name already.
pub fn check_writable(path: &Path) -> Result<()> {
    if is_stdout(path) {
        return Ok(());
    }
    check_name(path)?;
    // A device or a pipe would be replaced by the renaming, like a file.
    if path.exists() && !path.is_file() {
        bail!(
            "{}: is a folder or a device, expected the name of a file to write",
            path.display()
        );
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        bail!(
            "{}: cannot write: the folder {} does not exist",
            path.display(),
            folder.display()
        );
    }
    sweep(folder);
    temporary_file(folder).with_context(|| {
        format!(
            "{}: cannot write to the folder {}",
            path.display(),
            folder.display()
        )
    })?;
    Ok(())
}

/// Refuses names that the file system does not allow, such as names that are too long.
pub(crate) fn check_name(path: &Path) -> Result<()> {
    match path.symlink_metadata() {
        Err(error) if error.kind() == ErrorKind::InvalidFilename => {
            bail!(
                "{}: cannot write: {error}: choose a shorter name",
                path.display()
            )
        }
        // Other errors are those of the folder.
        _ => Ok(()),
    }
}

/// Checks that writing `path` would replace nothing, not even a link that leads nowhere.
pub(crate) fn check_new(path: &Path) -> Result<()> {
    if path.symlink_metadata().is_ok() {
        bail!("{} exists: choose another name", path.display());
    }
    Ok(())
}

/// Checks that writing `output` would not replace a file that is read.
pub fn check_not_input(output: &Path, inputs: &[&Path]) -> Result<()> {
    check_not_inputs([output].into_iter(), inputs)
}

/// Checks that writing `outputs` would not replace a file that is read, or one in a folder that is read.
///
/// Files are compared, and not their names: links and other spellings mean the same file.
pub fn check_not_inputs<'a>(
    outputs: impl Iterator<Item = &'a Path>,
    inputs: &[&Path],
) -> Result<()> {
    // To open a pipe would wait for whoever writes to it.
    let is_file = |path: &&Path| path.is_file();
    let handle = |path: &Path| {
        Some(path)
            .filter(is_file)
            .map(same_file::Handle::from_path)?
            .ok()
    };
    let (folders, files): (Vec<&Path>, Vec<&Path>) = inputs.iter().partition(|path| path.is_dir());
    let files: HashSet<_> = files.into_iter().filter_map(handle).collect();
    let folders: Vec<_> = folders
        .into_iter()
        .filter_map(|folder| folder.canonicalize().ok())
        .collect();
    for output in outputs {
        // An output that does not exist yet overwrites no input.
        let Some(written) = handle(output) else {
            continue;
        };
        let is_inside = |folder: &PathBuf| {
            output
                .canonicalize()
                .is_ok_and(|written| written.starts_with(folder))
        };
        if files.contains(&written) || folders.iter().any(is_inside) {
            bail!(
                "{}: would be replaced, but is read as well: choose another name",
                output.display()
            );
        }
    }
    Ok(())
}

/// Writes a picture and gives the size of the file in bytes.
pub fn write_picture(path: &Path, format: Format, image: &Image) -> Result<u64> {
    write_marked_picture(path, format, image, None)
}

/// As [`write_picture`], with a short text in the file that `png_mark` and `exr_mark` find again.
pub fn write_marked_picture(
    path: &Path,
    format: Format,
    image: &Image,
    mark: Option<&str>,
) -> Result<u64> {
    write_whole(path, |file| match format {
        Format::Png(depth) => Ok(png::write(file, image, depth, mark)?),
        Format::Exr => Ok(exr::write(file, image, mark)?),
        Format::Jpeg => write(file, image),
    })
}

/// Writes a tile of a picture of the size `whole`, from column and row `first` on, in full precision, and a mark.
pub(crate) fn write_tile(
    path: &Path,
    tile: &Image,
    place: ([usize; 2], [usize; 2]),
    mark: &str,
) -> Result<u64> {
    write_whole(path, |file| Ok(exr::write_window(file, tile, place, mark)?))
}

/// The bytes of the PNG file of a picture, 8 bits a channel.
pub fn png_file(image: &Image) -> Result<Vec<u8>> {
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
pub fn write_grey(path: &Path, size: [usize; 2], values: &[f32]) -> Result<u64> {
    let format = format_of(path, None)?;
    write_whole(path, |file| match format {
        Format::Png(_) => Ok(png::write_grey(file, size, values)?),
        Format::Exr => Ok(exr::write_grey(file, size, values)?),
        Format::Jpeg => write(file, &grey(size, values)),
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
pub fn write_text(path: &Path, text: &str) -> Result<u64> {
    write_whole(path, |file| Ok(file.write_all(text.as_bytes())?))
}

/// Writes bytes and gives their number.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<u64> {
    write_whole(path, |file| Ok(file.write_all(bytes)?))
}

/// Writes a file through a temporary one, or the standard output once all of it is there.
fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<NamedTempFile>) -> Result<()>,
) -> Result<u64> {
    let written = || -> Result<u64> {
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
            .map_err(std::io::IntoInnerError::into_error)?;
        let bytes = file.seek(std::io::SeekFrom::End(0))?;
        if is_stdout(path) {
            file.rewind()?;
            std::io::copy(&mut file, &mut std::io::stdout().lock())?;
        } else {
            file.persist(path)?;
        }
        Ok(bytes)
    };
    written().with_context(|| WriteFailure {
        path: path.to_owned(),
    })
}

/// A temporary file in a folder, removed also by a run that is interrupted.
pub(crate) fn temporary_file(folder: &Path) -> std::io::Result<(NamedTempFile, Listed)> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    // A temporary file is private by default; a picture has the permissions of any other new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    interrupt::listed(
        || {
            let file = builder.tempfile_in(folder)?;
            // The lock says that somebody still writes to it. Where the system knows no locks, nothing is swept up.
            let _ = file.as_file().try_lock();
            Ok(file)
        },
        |file| file.path().to_owned(),
    )
}

/// Removes temporary files that killed runs have left in a folder: those that nobody has locked.
fn sweep(folder: &Path) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_ours = |name: &str| name.starts_with(PREFIX) && name.ends_with(SUFFIX);
    for entry in entries.filter(|entry| entry.file_name().to_str().is_some_and(is_ours)) {
        let path = entry.path();
        // To open a pipe would wait for whoever writes to it.
        if !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let is_left = fs::File::open(&path).is_ok_and(|file| file.try_lock().is_ok());
        if is_left {
            // It may be gone already, which is as good.
            let _ = fs::remove_file(path);
        }
    }
}

/// The folder of a path; a bare name lies in the current one.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Makes a folder if it is not there; its parent must be.
pub fn make_folder(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    fs::create_dir(path).with_context(|| format!("{}: cannot make the folder", path.display()))
}

/// Quality, 1 to 100: at 92, errors are below what most people see. A guess.
const QUALITY: u8 = 92;

/// Writes `image` to `file`.
fn write(file: impl Write, image: &Image) -> Result<()> {
    let mut opaque = image.clone();
    opaque.rgba.iter_mut().for_each(|pixel| pixel[3] = 1.0);
    let (width, height) = (u32::try_from(image.width)?, u32::try_from(image.height)?);
    let bytes = opaque_bytes(&opaque, Depth::Eight);
    JpegEncoder::new_with_quality(file, QUALITY).encode(
        &bytes,
        width,
        height,
        ExtendedColorType::Rgb8,
    )?;
    Ok(())
}
