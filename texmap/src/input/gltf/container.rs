//! The container: JSON alone or a binary file with JSON and data, and the buffers that they name.
//!
//! Takes the bytes of a .gltf or .glb file, gives the document and its buffers. Extensions that the document requires
//! and that are not decoded end here, with the way out.
//! Source: glTF 2.0, 3.6.1 and 4.4. The JSON is read by the crate `gltf`, but not validated by it: its validation
//! panics on some files and refuses others that are common. Every index is looked up with a check instead.

use std::path::Path;

use gltf::json::Root;

use super::super::files;

/// A document and its data.
pub(super) struct Document {
    pub root: Root,
    pub buffers: Vec<Vec<u8>>,
}

const MAGIC: &[u8; 4] = b"glTF";

/// Extensions that change the picture and are understood here.
const DECODED: [&str; 6] = [
    "EXT_texture_webp",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Extensions that change light on the surface, which is not modelled, and leave colour and shape as they are.
const LIGHT_ALONE: [&str; 5] = [
    "KHR_materials_clearcoat",
    "KHR_materials_ior",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_lights_punctual",
];

/// The extensions that a file requires and that are read over: light on surfaces differs.
pub(super) fn read_over(root: &Root) -> impl Iterator<Item = &String> {
    root.extensions_required
        .iter()
        .filter(|name| LIGHT_ALONE.contains(&name.as_str()))
}

/// Whether a file starts as a binary glTF does.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Reads the document and its buffers; names in it are relative to `folder`.
pub(super) fn open(bytes: &[u8], folder: &Path) -> Result<Document, String> {
    let (json, mut binary) = if is_binary(bytes) {
        chunks(bytes)?
    } else {
        (bytes, None)
    };
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let root: Root = serde_json::from_slice(json).map_err(|error| explained(json, &error))?;
    if !root.asset.version.starts_with("2.") {
        let version = files::excerpt(&root.asset.version);
        return Err(format!(
            "glTF version {version} is not read: convert the file to glTF 2.0"
        ));
    }
    let known = |name: &str| DECODED.contains(&name) || LIGHT_ALONE.contains(&name);
    if let Some(name) = root.extensions_required.iter().find(|name| !known(name)) {
        return Err(undecoded(name));
    }
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (index, buffer) in root.buffers.iter().enumerate() {
        let bytes = match &buffer.uri {
            Some(uri) => from_uri(uri, folder),
            // Only the first buffer may lie in the file itself.
            None => binary
                .take()
                .filter(|_| index == 0)
                .map(<[u8]>::to_vec)
                .ok_or_else(|| "has no data".into()),
        };
        let mut bytes = bytes.map_err(|what| format!("buffer {index}: {what}"))?;
        let length = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
        if bytes.len() < length {
            let have = bytes.len();
            return Err(format!(
                "buffer {index}: {length} bytes are promised, {have} are there: the file is cut"
            ));
        }
        bytes.truncate(length);
        buffers.push(bytes);
    }
    Ok(Document { root, buffers })
}

/// The bytes that a URI stands for: its own, or those of a file beside the document.
pub(super) fn from_uri(uri: &str, folder: &Path) -> Result<Vec<u8>, String> {
    match files::data_uri(uri) {
        Some(bytes) => bytes,
        None => files::read(&files::resolve(folder, uri)?).map_err(|error| error.to_string()),
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

/// Why JSON is not glTF 2.0; glTF 1.0 has objects where 2.0 has lists, and says its version.
fn explained(json: &[u8], error: &serde_json::Error) -> String {
    let value = serde_json::from_slice::<serde_json::Value>(json).ok();
    let version = value
        .as_ref()
        .and_then(|value| value.get("asset")?.get("version")?.as_str());
    match (version, &value) {
        (Some(version), _) if !version.starts_with("2.") => {
            format!(
                "glTF version {} is not read: convert the file to glTF 2.0",
                files::excerpt(version)
            )
        }
        (None, Some(_)) => format!("JSON, but no glTF: it has no asset.version ({error})"),
        _ => format!("no valid glTF 2.0: {error}"),
    }
}

fn undecoded(name: &str) -> String {
    let way_out = match name {
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "export it without mesh compression, or unpack it, for example with 'gltf-transform copy' or 'gltfpack -noq'"
        }
        "KHR_texture_basisu" => "export its textures as PNG, JPEG or WebP instead of KTX2",
        "MSFT_texture_dds" | "EXT_texture_avif" => "export its textures as PNG, JPEG or WebP",
        "EXT_mesh_gpu_instancing" => "export each instance as a node of its own",
        _ => "export it without",
    };
    format!(
        "requires the extension {}, which is not decoded here: {way_out}",
        files::excerpt(name)
    )
}
