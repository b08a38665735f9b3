//! Files: opening them, and what their headers may claim.

use std::fs::{File, Metadata};
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

/// The name of the standard input, where a text may come from there.
const STANDARD_INPUT: &str = "-";

/// Largest file of cameras, numbers or lists that is read as text, bytes. A pose takes about 200 bytes.
const MAX_TEXT_BYTES: u64 = 256 << 20;

impl Part {
    /// Splits `FILE#NAME` at the last `#`; a file whose own name holds it wins.
    ///
    /// ```
    /// use resample_io::files::Part;
    ///
    /// let part = Part::from_text("view.exr#depth");
    /// assert_eq!(part.name.as_deref(), Some("depth"));
    /// ```
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
    open_regular(path).map_err(|source| cannot_read(path, &source))
}

/// Opens a regular file and gives its length. Devices and pipes are refused: some have no end, some never begin.
pub fn open_regular(path: &Path) -> std::io::Result<(File, u64)> {
    let is_regular = |metadata: &Metadata| {
        if metadata.is_dir() {
            return Err(std::io::ErrorKind::IsADirectory.into());
        }
        if !metadata.is_file() {
            let what = "it is a device, a pipe or a socket: write its content to a file first";
            return Err(std::io::Error::other(what));
        }
        Ok(())
    };
    // To open a pipe waits for whoever writes to it; once more afterwards, because the name may mean another file by then.
    is_regular(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    is_regular(&metadata)?;
    Ok((file, metadata.len()))
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

/// A whole file of text; `-` is the standard input.
pub fn read_text(path: &Path) -> Result<String, Error> {
    let text =
        |bytes| String::from_utf8(bytes).map_err(|_| std::io::Error::other("it is no UTF-8 text"));
    read_small(path, MAX_TEXT_BYTES)
        .and_then(text)
        .map_err(|source| cannot_read(path, &source))
}

/// All bytes of a regular file: those that were there when it was opened.
pub fn read_whole(path: &Path) -> std::io::Result<Vec<u8>> {
    let (file, held) = open_regular(path)?;
    let mut bytes = Vec::new();
    file.take(held).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The bytes of a JSON file, or JSON that was typed in place of a file's name: a word that begins with a brace or a bracket.
pub fn read_json(word: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    match typed_json(word) {
        Some(text) => Ok(text.as_bytes().to_owned()),
        None => read_small(word, most),
    }
}

/// The JSON that was typed in place of a file's name.
pub fn typed_json(word: &Path) -> Option<&str> {
    let text = word.to_str()?;
    text.starts_with(['{', '[']).then_some(text)
}

/// All bytes of a file that has at most so many; `-` is the standard input.
pub fn read_small(path: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let source: Box<dyn Read> = match path == Path::new(STANDARD_INPUT) {
        true => Box::new(std::io::stdin()),
        false => Box::new(open_regular(path)?.0),
    };
    let mut bytes = Vec::new();
    source.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let what = format!("it has more than the {most} bytes that such a file may have");
        return Err(std::io::Error::other(what));
    }
    Ok(bytes)
}

/// Checks a claimed picture size against [`MAX_PIXELS`] and against what a file of this length can unpack to.
///
/// `most_per_byte` is the largest number of pixels that one byte of the format can stand for.
///
/// ```
/// use resample_io::files::check_claim;
///
/// // A file of 100 bytes whose bytes stand for 1000 pixels at most.
/// assert!(check_claim(100, 100, 100, 1000).is_ok());
/// assert!(check_claim(10_000, 10_000, 100, 1000).is_err());
/// ```
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claims_are_held_against_the_largest_picture_and_the_file() {
        let side = 1 << 14;
        assert_eq!(side * side, MAX_PIXELS, "a square of the largest size");
        let claim = |width, height, file_bytes| check_claim(width, height, file_bytes, 8);
        assert!(claim(side, side, u64::MAX).is_ok(), "as large as may be");
        for (width, height) in [(side, side + 1), (u64::MAX, 2), (0, 5), (5, 0)] {
            assert!(claim(width, height, u64::MAX).is_err(), "{width}x{height}");
        }
        assert!(claim(10, 8, 10).is_ok(), "as much as the file can hold");
        assert!(claim(27, 3, 10).is_err(), "a pixel more");
    }

    #[test]
    fn small_files_are_read_whole_and_larger_ones_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        std::fs::write(&path, "twelve bytes").expect("written");
        assert_eq!(read_small(&path, 12).expect("it fits"), b"twelve bytes");
        assert!(read_small(&path, 11).is_err(), "one byte too many");
        assert_eq!(read_whole(&path).expect("there"), b"twelve bytes");
        assert_eq!(read_text(&path).expect("a text"), "twelve bytes");
        assert_eq!(first_bytes(&path, 6).expect("there"), b"twelve");
        std::fs::write(&path, [0xff, 0xfe]).expect("written");
        let error = read_text(&path).expect_err("no UTF-8").to_string();
        assert!(
            error.contains("UTF-8") && error.contains("a.txt"),
            "{error}"
        );
        assert!(read_whole(folder.path()).is_err(), "a folder");
    }
}
