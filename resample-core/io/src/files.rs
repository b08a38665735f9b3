//! Files: opening them, and what their headers may claim.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use resample_core::Error;

/// A file and, behind a `#`, the channel or layer of it: `ref.exr#Z`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The file.
    pub path: PathBuf,
    /// Channel, layer or part inside the file.
    pub name: Option<String>,
}

/// Most pixels of a picture that is read: 16384 x 16384.
///
/// A colour picture of that size takes 3 GiB in memory and its depth 1 GiB; a forged header must not be able to ask
/// for more.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Largest file of cameras, numbers or lists that is read as text, bytes. A pose takes about 200 bytes.
const MAX_TEXT_BYTES: u64 = 256 << 20;

impl Part {
    /// Splits `FILE#NAME` at the last `#`; a file whose own name holds it wins.
    pub fn from_text(text: &str) -> Self {
        match text.rsplit_once('#') {
            Some((path, name))
                if !path.is_empty() && !name.is_empty() && !Path::new(text).exists() =>
            {
                Self {
                    path: PathBuf::from(path),
                    name: Some(name.to_owned()),
                }
            }
            _ => Self {
                path: PathBuf::from(text),
                name: None,
            },
        }
    }
}

/// An error that names the file.
pub fn fault(path: &Path, what: impl std::fmt::Display) -> Error {
    Error::Input(format!("{}: {what}", path.display()))
}

/// The error for a file that the system cannot read.
pub fn cannot_read(path: &Path, source: &std::io::Error) -> Error {
    fault(path, format!("cannot read: {source}"))
}

/// Opens a file and gives its length; a folder is an error here, not later.
pub fn open(path: &Path) -> Result<(File, u64), Error> {
    let opened = || -> std::io::Result<(File, u64)> {
        let file = File::open(path)?;
        let metadata = file.metadata()?;
        if metadata.is_dir() {
            return Err(std::io::ErrorKind::IsADirectory.into());
        }
        Ok((file, metadata.len()))
    };
    opened().map_err(|source| cannot_read(path, &source))
}

/// The first bytes of a file, at most `count`.
pub fn first_bytes(path: &Path, count: u64) -> Result<Vec<u8>, Error> {
    let (file, _) = open(path)?;
    let mut bytes = Vec::new();
    file.take(count)
        .read_to_end(&mut bytes)
        .map_err(|source| cannot_read(path, &source))?;
    Ok(bytes)
}

/// A whole file of text.
pub fn read_text(path: &Path) -> Result<String, Error> {
    let (file, _) = open(path)?;
    let mut text = String::new();
    // The limit is on the bytes read, not on the size of the file: a pipe or a device has no size.
    file.take(MAX_TEXT_BYTES + 1)
        .read_to_string(&mut text)
        .map_err(|source| cannot_read(path, &source))?;
    if text.len() as u64 > MAX_TEXT_BYTES {
        return Err(fault(
            path,
            format!("more than {MAX_TEXT_BYTES} bytes, more than any list of cameras"),
        ));
    }
    Ok(text)
}

/// Checks a claimed picture size against [`MAX_PIXELS`] and against what a file of this length can unpack to.
///
/// `most_per_byte` is the largest number of pixels that one byte of the format can stand for.
pub fn check_claim(
    width: u64,
    height: u64,
    file_bytes: u64,
    most_per_byte: u64,
) -> Result<(), String> {
    let pixels = width.saturating_mul(height);
    if pixels == 0 {
        return Err(format!(
            "the header says {width}x{height} pixels: there is nothing to show"
        ));
    }
    if pixels > MAX_PIXELS {
        return Err(format!(
            "{width}x{height} pixels, more than the {MAX_PIXELS} that are read"
        ));
    }
    if pixels > file_bytes.saturating_mul(most_per_byte) {
        return Err(format!(
            "the header says {width}x{height} pixels, more than a file of {file_bytes} bytes can hold"
        ));
    }
    Ok(())
}
