//! Files that are written: checked before any work, written whole or not at all.
//!
//! Takes pictures and text, gives files. Everything goes to a temporary file in the target's own folder, which is
//! renamed when it is complete: a reader never sees half a picture, and what stood there before stays until then.
//! The format of a picture follows from its extension.

mod exr;
mod film;
mod names;
mod png;
mod video;
mod webp;

use std::fs;
use std::io::{BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use resample_core::Image;
use tempfile::NamedTempFile;

use crate::interrupt::{self, Listed};

pub use film::{DEFAULT_FPS, Film, FilmKind, FilmPlan, kind_of};
pub use names::FrameNames;
pub use png::Depth;

/// How a picture is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    /// sRGB, straight alpha.
    Png(Depth),
    /// Linear light, premultiplied, 32-bit floating point.
    Exr,
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

/// The format that the extension of `path` asks for.
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
        _ => bail!(
            "{}: unknown picture format: the name must end in .png or .exr (animations: .apng, .webp, .mp4, .webm, .mkv)",
            path.display()
        ),
    }
}

/// Checks that a file can be made at `path`: the folder is there and can be written to, and only a file has
/// that name already.
pub fn check_writable(path: &Path) -> Result<()> {
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
    temporary_file(folder).with_context(|| {
        format!(
            "{}: cannot write to the folder {}",
            path.display(),
            folder.display()
        )
    })?;
    Ok(())
}

/// Checks that writing `output` would not replace a file that is read.
pub fn check_not_input(output: &Path, inputs: &[&Path]) -> Result<()> {
    let Ok(written) = output.canonicalize() else {
        return Ok(());
    };
    match inputs
        .iter()
        .find(|input| input.canonicalize().is_ok_and(|read| read == written))
    {
        Some(_) => bail!(
            "{}: would be replaced, but is read as well: choose another name",
            output.display()
        ),
        None => Ok(()),
    }
}

/// Writes a picture and gives the size of the file in bytes.
pub fn write_picture(path: &Path, format: Format, image: &Image) -> Result<u64> {
    write_whole(path, |file| match format {
        Format::Png(depth) => png::write(file, image, depth),
        Format::Exr => exr::write(file, image),
    })
}

/// Writes one plane of numbers as a grey picture, in the format of its name: 0 to 1 become the codes of a PNG as they
/// are, without the sRGB curve; EXR keeps every number in a channel Y.
pub fn write_grey(path: &Path, size: [usize; 2], values: &[f32]) -> Result<u64> {
    let format = format_of(path, None)?;
    write_whole(path, |file| match format {
        Format::Png(_) => png::write_grey(file, size, values),
        Format::Exr => exr::write_grey(file, size, values),
    })
}

/// Writes text and gives the size of the file in bytes.
pub fn write_text(path: &Path, text: &str) -> Result<u64> {
    write_whole(path, |file| Ok(file.write_all(text.as_bytes())?))
}

/// Writes bytes and gives their number.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<u64> {
    write_whole(path, |file| Ok(file.write_all(bytes)?))
}

/// Writes a file through a temporary one.
fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<NamedTempFile>) -> Result<()>,
) -> Result<u64> {
    let written = || -> Result<u64> {
        let (file, _listed) = temporary_file(folder_of(path))?;
        let mut buffered = BufWriter::new(file);
        write(&mut buffered)?;
        let mut file = buffered
            .into_inner()
            .map_err(std::io::IntoInnerError::into_error)?;
        let bytes = file.seek(std::io::SeekFrom::End(0))?;
        file.persist(path)?;
        Ok(bytes)
    };
    written().with_context(|| WriteFailure {
        path: path.to_owned(),
    })
}

fn temporary_file(folder: &Path) -> std::io::Result<(NamedTempFile, Listed)> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".resample-").suffix(".tmp");
    // A temporary file is private by default; a picture has the permissions of any other new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    interrupt::listed(
        || builder.tempfile_in(folder),
        |file| file.path().to_owned(),
    )
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

#[cfg(test)]
mod tests;
