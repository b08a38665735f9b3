//! The container: JSON alone or a binary file with JSON and data, and the buffers that they name.
//!
//! Takes the bytes of a .gltf or .glb file, gives the document and its buffers.
//! Source: glTF 2.0, 3.6.1 and 4.4. The JSON is read by the crate `gltf`, but not validated by it: its validation
//! panics on some files and refuses others that are common. Every index is looked up with a check instead.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use gltf::json::Root;
use serde_json::Value;

use super::super::files;
use super::super::files::Names;
use super::document::{Json, Transform};
use super::{document, extensions};

/// A document and its data.
pub(super) struct Document {
    pub root: Root,
    /// From each node to its parent.
    pub transforms: Vec<Transform>,
    /// As they are written.
    pub animations: Vec<Value>,
    pub buffers: Vec<Vec<u8>>,
}

const MAGIC: &[u8; 4] = b"glTF";

/// Returns true if a file starts as a binary glTF does.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Reads the document and its buffers; names in it count from `names`.
pub(super) fn open(bytes: &[u8], names: &Names) -> Result<Document, String> {
    let (json, mut binary) = if is_binary(bytes) {
        chunks(bytes)?
    } else {
        (bytes, None)
    };
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let Json {
        root,
        transforms,
        animations,
    } = document::read(json)?;
    extensions::check(&root)?;
    let mut buffers = Vec::with_capacity(root.buffers.len());
    // Several buffers may name one file, which is read once.
    let mut files: BTreeMap<&str, Vec<u8>> = BTreeMap::new();
    let (mut held, mut kept) = (bytes.len() as u64, 0u64);
    for (index, buffer) in root.buffers.iter().enumerate() {
        let bytes = match &buffer.uri {
            Some(uri) => match files.entry(uri.as_str()) {
                Entry::Occupied(file) => Ok(file.into_mut().as_slice()),
                Entry::Vacant(file) => from_uri(uri, names).map(|bytes| {
                    held += bytes.len() as u64;
                    file.insert(bytes).as_slice()
                }),
            },
            // Only the first buffer may lie in the file itself.
            None => binary
                .take()
                .filter(|_| index == 0)
                .ok_or_else(|| "has no data".into()),
        };
        let bytes = bytes.map_err(|what| format!("buffer {index}: {what}"))?;
        let length = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
        if bytes.len() < length {
            let have = bytes.len();
            return Err(format!(
                "buffer {index}: {length} bytes are promised, {have} are there: the file is cut"
            ));
        }
        kept += length as u64;
        names.gate.ask_unpacked(kept, held, "the buffers")?;
        buffers.push(bytes[..length].to_vec());
    }
    Ok(Document {
        root,
        transforms,
        animations,
        buffers,
    })
}

/// The bytes that a URI stands for: its own, or those of a file beside the document.
pub(super) fn from_uri(uri: &str, names: &Names) -> Result<Vec<u8>, String> {
    match files::data_uri(uri) {
        Some(bytes) => bytes,
        None => files::read(&files::resolve(names, uri)?).map_err(|error| error.to_string()),
    }
}

/// The JSON and the data of a binary file.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
    };
    let cut = "the binary file is cut short";
    let version = word(4).ok_or(cut)?;
    if version != 2 {
        return Err(format!(
            "binary glTF of version {version} is not read: convert the file to glTF 2.0"
        ));
    }
    let chunk = |at: usize| -> Result<(u32, &[u8], usize), String> {
        let (length, kind) = word(at).zip(word(at + 4)).ok_or(cut)?;
        let end = (at + 8).checked_add(length as usize).ok_or(cut)?;
        Ok((kind, bytes.get(at + 8..end).ok_or(cut)?, end))
    };
    // The kinds are the words "JSON" and "BIN" with a zero.
    let (kind, json, mut next) = chunk(12)?;
    if kind != u32::from_le_bytes(*b"JSON") {
        return Err("the first chunk of the binary file is not JSON".into());
    }
    while next < bytes.len() {
        let (kind, data, end) = chunk(next)?;
        if kind == u32::from_le_bytes(*b"BIN\0") {
            return Ok((json, Some(data)));
        }
        next = end;
    }
    Ok((json, None))
}
