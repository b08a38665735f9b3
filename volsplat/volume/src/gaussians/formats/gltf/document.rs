//! The parts of a glTF file that Gaussians need: its container, some of its JSON, and its buffers.
//!
//! Takes the bytes of a `.gltf` or `.glb` file, gives lists and bytes; every index is looked up with a check later.
//! Source: glTF 2.0, 3.6.1 and 4.4.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use resample_io::Gate;
use serde::Deserialize;
use serde_json::Value;

use crate::input::{Fault, unsupported};

/// The extension that makes points Gaussians.
pub(super) const EXTENSION: &str = "KHR_gaussian_splatting";

/// The first bytes of a binary file.
pub(super) const MAGIC: &[u8] = b"glTF";

/// Bytes before the JSON of a binary file.
pub(super) const JSON_AT: usize = 20;

/// Extensions beside it that a file may require: they change nothing here, or are read.
const HARMLESS: [&str; 4] = [
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
];

/// The lists of a document.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Root {
    asset: Asset,
    extensions_required: Vec<String>,
    buffers: Vec<Stored>,
    pub(super) buffer_views: Vec<View>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) nodes: Vec<Node>,
    pub(super) scenes: Vec<Scene>,
    pub(super) scene: Option<usize>,
}

#[derive(Default, Deserialize)]
struct Asset {
    version: String,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Stored {
    uri: Option<String>,
    byte_length: u64,
}

/// A stretch of a buffer.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: Option<u64>,
}

/// Numbers in a stretch.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) shape: String,
    pub(super) sparse: Option<serde::de::IgnoredAny>,
}

/// Primitives that a node shows together.
#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) primitives: Vec<Primitive>,
}

/// Points, if its mode is 0.
#[derive(Deserialize)]
pub(super) struct Primitive {
    pub(super) mode: Option<u32>,
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, usize>,
    #[serde(default)]
    pub(super) extensions: BTreeMap<String, Value>,
}

/// A place in the scene.
#[derive(Deserialize)]
pub(super) struct Node {
    #[serde(default)]
    pub(super) children: Vec<usize>,
    pub(super) mesh: Option<usize>,
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
    pub(super) translation: Option<[f64; 3]>,
    #[serde(default)]
    pub(super) extensions: BTreeMap<String, serde::de::IgnoredAny>,
}

/// Nodes that are shown together.
#[derive(Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub(super) nodes: Vec<usize>,
}

/// A document and its data.
pub(super) struct Document<'a> {
    pub(super) root: Root,
    pub(super) buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> Document<'a> {
    /// Reads the JSON and the buffers; names in it count from `folder`.
    pub(super) fn open(bytes: &'a [u8], folder: &Path, gate: &Gate) -> Result<Self, Fault> {
        let (json, mut binary) = match bytes.starts_with(MAGIC) {
            true => chunks(bytes)?,
            false => (bytes, None),
        };
        let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
        let root: Result<Root, _> = serde_json::from_slice(json);
        let root = root.map_err(|error| Fault::Invalid(format!("it is no glTF 2.0: {error}")))?;
        root.check()?;
        let mut held = bytes.len() as u64;
        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (number, stored) in root.buffers.iter().enumerate() {
            let located = |what: String| Fault::Invalid(format!("buffer {number}: {what}"));
            let data = match &stored.uri {
                Some(uri) => {
                    let data = from_uri(uri, folder, (held, gate)).map_err(located)?;
                    held += data.len() as u64;
                    Cow::Owned(data)
                }
                // Only the first buffer may lie in the file itself.
                None => {
                    let data = binary.take().filter(|_| number == 0);
                    Cow::Borrowed(data.ok_or_else(|| located("it has no data".to_owned()))?)
                }
            };
            if (data.len() as u64) < stored.byte_length {
                let (have, length) = (data.len(), stored.byte_length);
                return Err(located(format!(
                    "it has {have} bytes, expected {length}: the file is cut off"
                )));
            }
            buffers.push(data);
        }
        Ok(Self { root, buffers })
    }
}

impl Root {
    fn check(&self) -> Result<(), Fault> {
        let version = &self.asset.version;
        if !version.starts_with("2.") {
            return Err(Fault::Invalid(format!(
                "glTF of version '{version}': expected 2.0; convert the file"
            )));
        }
        let is_read = |name: &str| {
            name == EXTENSION || HARMLESS.iter().any(|harmless| name.starts_with(harmless))
        };
        let required = self.extensions_required.iter();
        match required.into_iter().find(|name| !is_read(name)) {
            Some(name) => Err(not_read(name)),
            None => Ok(()),
        }
    }
}

/// Gaussians that need more than their extension.
pub(super) fn not_read(extension: &str) -> Fault {
    unsupported(format!(
        "its Gaussians need the extension '{extension}': only {EXTENSION} with plain attributes is read; write them without it, \
         or as SPZ or PLY"
    ))
}

/// The JSON and the data of a binary file.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    let cut = || Fault::Invalid("the binary glTF file is cut off".to_owned());
    let word = |at: usize| {
        let word = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
    };
    let version = word(4).ok_or_else(cut)?;
    if version != 2 {
        return Err(Fault::Invalid(format!(
            "binary glTF of version {version}: expected 2; convert the file"
        )));
    }
    let chunk = |at: usize| {
        let (length, kind) = word(at).zip(word(at + 4))?;
        let end = (at + 8).checked_add(length as usize)?;
        Some((kind, bytes.get(at + 8..end)?, end))
    };
    let (kind, json, mut next) = chunk(JSON_AT - 8).ok_or_else(cut)?;
    if kind != u32::from_le_bytes(*b"JSON") {
        return Err(Fault::Invalid(
            "the first chunk of the binary glTF file is not JSON".to_owned(),
        ));
    }
    while next < bytes.len() {
        let (kind, data, end) = chunk(next).ok_or_else(cut)?;
        if kind == u32::from_le_bytes(*b"BIN\0") {
            return Ok((json, Some(data)));
        }
        next = end;
    }
    Ok((json, None))
}

/// The bytes that a URI stands for: its own, or those of a file beside the document; `held` bytes are in memory already.
fn from_uri(uri: &str, folder: &Path, (held, gate): (u64, &Gate)) -> Result<Vec<u8>, String> {
    let scheme = uri.get(..5).unwrap_or_default();
    if scheme.eq_ignore_ascii_case("data:") {
        let (head, data) = uri.split_once(',').ok_or("a data URI without a comma")?;
        gate.ask(held.saturating_add(data.len() as u64), "the buffers")?;
        return match head.ends_with(";base64") {
            true => from_base64(data).ok_or_else(|| "a data URI that is no base64".to_owned()),
            false => Ok(percent_decoded(data)),
        };
    }
    // A name with a percent sign of its own is tried as it stands.
    let name = match folder.join(uri).is_file() {
        true => uri.to_owned(),
        false => String::from_utf8_lossy(&percent_decoded(uri)).into_owned(),
    };
    let path = gate.named_file(&name, folder, folder)?;
    let unreadable = |error| format!("{}: cannot read: {error}", path.display());
    let (_, bytes) = resample_io::files::open_regular(&path).map_err(unreadable)?;
    gate.ask(held.saturating_add(bytes), "the buffers")?;
    resample_io::files::read_whole(&path).map_err(unreadable)
}

fn percent_decoded(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let digits = bytes
            .get(at + 1..at + 3)
            .filter(|digits| bytes[at] == b'%' && digits.iter().all(u8::is_ascii_hexdigit))
            .and_then(|digits| std::str::from_utf8(digits).ok());
        let code = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        decoded.push(code.unwrap_or(bytes[at]));
        at += if code.is_some() { 3 } else { 1 };
    }
    decoded
}

/// Base64 with the usual or the URL alphabet; padding and white space are skipped.
fn from_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0u32, 0);
    for byte in text.bytes().filter(|byte| !b"= \n\r\t".contains(byte)) {
        let six = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(six);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    Some(bytes)
}
