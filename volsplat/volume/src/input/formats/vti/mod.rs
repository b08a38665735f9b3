//! VTK ImageData in XML, `.vti`.
//!
//! Takes a path, gives the parts of a volume. The XML (`head.rs`) says how the image lies and which arrays it has; one
//! array is chosen, and its data (`data.rs`) stands in the XML or in a part appended to it, as text, base64 or plain
//! bytes, compressed by zlib or not. The source is the chapter on XML formats in the VTK User's Guide.
//! Limits: one piece; data at points or in cells (a cell's value stands at its centre); no LZ4 and no LZMA.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use resample_io::Gate;

use crate::Error;
use crate::input::decode::component::chosen;
use crate::input::fault::{Fault, excerpt};
use crate::input::{Parts, decode, open_sized};
use crate::volume::{Lattice, VoxelType, Voxels};

mod base64;
mod data;
mod head;

use head::{Image, Source};

/// The element that holds appended data; everything before it is XML.
const APPENDED: &[u8] = b"<AppendedData";

/// The remark where values stand in cells.
pub(crate) const CELLS_REMARK: &str =
    "its values are those of cells and stand at their centres, half a step beside the points";

/// The remark where a file has several arrays and the caller has not chosen one of them.
pub(crate) fn others_remark(read: &str, arrays: &[String]) -> Option<String> {
    let others: Vec<String> = arrays
        .iter()
        .filter(|name| *name != read)
        .map(|name| excerpt(name))
        .collect();
    (!others.is_empty()).then(|| {
        format!(
            "the array {} is read, there is also {}: FILE#array=NAME names another",
            excerpt(read),
            others.join(", ")
        )
    })
}

/// The caller's choice.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Choice<'a> {
    /// Name of the array.
    pub(crate) array: Option<&'a str>,
    /// Component of each value, counted from 0.
    pub(crate) component: Option<usize>,
}

/// Returns true if a file that begins with `head` is XML of VTK, of any kind of data.
pub(crate) fn begins(head: &[u8]) -> bool {
    let head = head
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(head)
        .trim_ascii_start();
    head.starts_with(b"<") && head.windows(8).any(|window| window == b"<VTKFile")
}

pub(crate) fn load(path: &Path, choice: Choice, gate: &Gate) -> Result<Parts, Error> {
    let (mut file, held) = open_sized(path)?;
    read(&mut file, held, choice, gate).map_err(|fault| fault.at(path))
}

/// How many bytes of colour a voxel has; `None` where it is a number.
pub(crate) fn colours(path: &Path, array: Option<&str>) -> Result<Option<usize>, Error> {
    let (mut file, _) = open_sized(path)?;
    let image = XmlText::read(&mut file)
        .and_then(|text| head::parse(&text.xml, array))
        .map_err(|fault| fault.at(path))?;
    Ok(Some(image.components).filter(|_| image.voxel_type == VoxelType::U8))
}

/// The names of all arrays of a file.
pub(crate) fn array_names(path: &Path) -> Result<Vec<String>, Error> {
    let (mut file, _) = open_sized(path)?;
    XmlText::read(&mut file)
        .and_then(|text| head::array_names(&text.xml))
        .map_err(|fault| fault.at(path))
}

fn read(file: &mut File, held: u64, choice: Choice, gate: &Gate) -> Result<Parts, Fault> {
    let text = XmlText::read(file)?;
    let image = head::parse(&text.xml, choice.array)?;
    let component = chosen(choice.component, image.components)?;
    gate.ask_unpacked(data::bytes(&image)?, held, "the voxels")?;
    if image.is_of_cells {
        gate.remark(CELLS_REMARK.to_owned());
    }
    if choice.array.is_none() {
        others_remark(&image.array, &image.arrays)
            .into_iter()
            .for_each(|remark| gate.remark(remark));
    }
    let voxels = match &image.source {
        Source::Inline(content) => data::inline(content, &image, component)?,
        Source::Appended { offset } => {
            let tag = text
                .appended
                .ok_or_else(|| "format is appended, but there is no AppendedData".to_owned())?;
            let begin = tag.begin.saturating_add(*offset);
            file.seek(SeekFrom::Start(begin))
                .map_err(|error| decode::broken(&error))?;
            let held = held.saturating_sub(begin);
            appended(file, held, &tag.encoding, &image, component)?
        }
    };
    Ok(Parts {
        lattice: Lattice::unnamed(image.dims, image.world_from_index),
        voxels,
    })
}

/// The appended data of an array, `held` bytes from where the file stands.
fn appended(
    file: &mut File,
    held: u64,
    encoding: &str,
    image: &Image,
    component: usize,
) -> Result<Voxels, Fault> {
    let reader = BufReader::new(file);
    match encoding {
        "raw" => data::binary(reader, held, image, component),
        "base64" => {
            let unpacked = base64::Base64Reader::new(reader);
            data::binary(unpacked, held / 4 * 3, image, component)
        }
        other => Err(Fault::Invalid(format!(
            "AppendedData has encoding '{other}': expected raw or base64"
        ))),
    }
}

/// The XML of the file, closed where appended data was cut off.
struct XmlText {
    xml: String,
    appended: Option<AppendedTag>,
}

/// The element of the appended data.
struct AppendedTag {
    encoding: String,
    /// Where the data begins in the file, behind the underscore.
    begin: u64,
}

/// Bytes that are searched at a time. A guess.
const PIECE_BYTES: u64 = 1 << 16;

/// Longest tag `<AppendedData ...>` and white space up to the underscore. A guess far beyond what writers produce.
const MAX_TAG_BYTES: usize = 4096;

impl XmlText {
    /// Reads up to the appended data, or to the end of the file.
    fn read(file: &mut File) -> Result<Self, Fault> {
        let mut bytes = Vec::new();
        let mut found = None;
        while found.is_none() {
            // The word can lie across two pieces.
            let searched = bytes.len().saturating_sub(APPENDED.len());
            let got = (&mut *file).take(PIECE_BYTES).read_to_end(&mut bytes);
            if got.map_err(|error| decode::broken(&error))? == 0 {
                break;
            }
            let behind = &bytes[searched..];
            found = behind
                .windows(APPENDED.len())
                .position(|word| word == APPENDED)
                .map(|at| searched + at);
        }
        let Some(at) = found else {
            return Ok(Self {
                xml: utf8(bytes)?,
                appended: None,
            });
        };
        let read = (&mut *file)
            .take(MAX_TAG_BYTES as u64)
            .read_to_end(&mut bytes);
        read.map_err(|error| decode::broken(&error))?;
        let appended = appended_tag(&bytes[at..], at as u64)?;
        bytes.truncate(at);
        bytes.extend_from_slice(b"</VTKFile>");
        Ok(Self {
            xml: utf8(bytes)?,
            appended: Some(appended),
        })
    }
}

fn utf8(bytes: Vec<u8>) -> Result<String, String> {
    String::from_utf8(bytes).map_err(|_| "the XML is not UTF-8".to_owned())
}

/// `tag` begins with `<AppendedData` and stands at byte `at` of the file.
fn appended_tag(tag: &[u8], at: u64) -> Result<AppendedTag, String> {
    let fault = || "AppendedData is cut off: expected '_' and data behind it".to_owned();
    let tag = &tag[..tag.len().min(MAX_TAG_BYTES)];
    let end = tag
        .iter()
        .position(|&byte| byte == b'>')
        .ok_or_else(fault)?;
    let begin = end
        + 1
        + tag[end + 1..]
            .iter()
            .position(|&byte| byte == b'_')
            .ok_or_else(fault)?
        + 1;
    let attributes = String::from_utf8_lossy(&tag[..end]).into_owned();
    let value = attributes
        .split_once("encoding")
        .and_then(|(_, rest)| rest.split(['"', '\'']).nth(1));
    Ok(AppendedTag {
        encoding: value.unwrap_or("base64").to_owned(),
        begin: at + begin as u64,
    })
}

#[cfg(test)]
mod tests;
