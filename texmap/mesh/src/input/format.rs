//! The format of a mesh file, detected by its content.
//!
//! Takes the bytes of a file, or a path whose beginning is read. A binary glTF and a PLY have a mark, a binary STL has the
//! length that its count says, JSON begins with a brace, and an OBJ is a text of lines that begin with one of its words.

use std::io::Read;
use std::path::Path;

use resample_io::files;

use super::{gltf, obj, ply, stl};
use crate::Error;

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// glTF 2.0, as text or binary.
    Gltf,
    /// OBJ, with its materials beside it.
    Obj,
    /// PLY, as text or binary.
    Ply,
    /// STL, as text or binary.
    Stl,
}

/// Bytes that tell a format: comments at the top of an OBJ can be long.
const HEAD_BYTES: u64 = 1 << 16;

impl Format {
    /// The usual name.
    ///
    /// ```
    /// use resample_mesh::input::Format;
    ///
    /// assert_eq!(Format::Obj.name(), "OBJ");
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            Self::Gltf => "glTF",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
        }
    }

    /// A format that has neither scenes nor animations.
    pub(super) fn plain_name(self) -> Option<&'static str> {
        match self {
            Self::Gltf => None,
            Self::Obj => Some("an OBJ"),
            Self::Ply => Some("a PLY"),
            Self::Stl => Some("an STL"),
        }
    }
}

/// The format of a file; `None` where nothing of a mesh is found.
///
/// # Errors
///
/// [`Error::Input`] where the file cannot be read.
///
/// ```
/// use resample_mesh::input::{Format, format_of};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let path = std::env::temp_dir().join("resample-mesh-format.obj");
/// std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")?;
/// assert_eq!(format_of(&path)?, Some(Format::Obj));
/// # std::fs::remove_file(&path)?;
/// # Ok(())
/// # }
/// ```
pub fn format_of(path: &Path) -> Result<Option<Format>, Error> {
    let (file, length) = files::open(path)?;
    let mut head = Vec::new();
    let read = file.take(HEAD_BYTES).read_to_end(&mut head);
    read.map_err(|error| files::cannot_read(path, &error))?;
    Ok(of_head(&head, length).filter(|&format| format != Format::Gltf || is_gltf(&head)))
}

/// JSON is also the form of cameras and of transfer functions; glTF must state its asset.
fn is_gltf(head: &[u8]) -> bool {
    const WORD: &[u8] = b"\"asset\"";
    gltf::is_binary(head) || head.windows(WORD.len()).any(|part| part == WORD)
}

/// The format of the bytes of a file. The error says what they are instead.
pub(super) fn detect(bytes: &[u8]) -> Result<Format, String> {
    const EXPECTED: &str = "expected glTF 2.0 (.gltf, .glb), OBJ, PLY or STL";
    if let Some(format) = of_head(bytes, bytes.len() as u64) {
        return Ok(format);
    }
    Err(match foreign_mark(bytes) {
        Some(name) => format!("this is {name}: {EXPECTED}"),
        None if text_of(bytes).is_empty() => format!("the file is empty: {EXPECTED}"),
        None => format!("no mesh of a known format: {EXPECTED}"),
    })
}

/// The format of a file of `length` bytes that begins with `head`.
fn of_head(head: &[u8], length: u64) -> Option<Format> {
    if gltf::is_binary(head) {
        return Some(Format::Gltf);
    }
    if ply::looks_like(head) {
        return Some(Format::Ply);
    }
    if foreign_mark(head).is_some() {
        return None;
    }
    if stl::looks_like(head, length) {
        return Some(Format::Stl);
    }
    match text_of(head).first() {
        Some(b'{') => Some(Format::Gltf),
        Some(_) if obj::looks_like(head) => Some(Format::Obj),
        Some(_) | None => None,
    }
}

/// The text behind a byte order mark and white space.
fn text_of(bytes: &[u8]) -> &[u8] {
    bytes
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(bytes)
        .trim_ascii_start()
}

/// Formats that people have and this crate does not read.
fn foreign_mark(bytes: &[u8]) -> Option<&'static str> {
    let marks: [(&[u8], &str); 4] = [
        (b"Kaydara FBX", "an FBX file"),
        (b"PK\x03\x04", "a ZIP archive (unpack it first)"),
        (b"\x89PNG", "a picture"),
        (b"\xff\xd8\xff", "a picture"),
    ];
    marks
        .into_iter()
        .find(|(mark, _)| bytes.starts_with(mark))
        .map(|(_, name)| name)
}
