//! The document of a file and its data: the container, JSON as programs write it, and the extensions that it names.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, HashSet};

use glam::{DMat4, DQuat, DVec3, DVec4};
use gltf::json::Root;
use serde_json::{Number, Value, json};

use crate::input::files::{self, Names, excerpt};
use crate::input::gltf::{compressed, layers};
use crate::input::options::Notes;

// The container: JSON alone or a binary file with JSON and data, and the buffers that they name.
//
// Takes the bytes of a .gltf or .glb file, gives the document and its buffers.
// Source: glTF 2.0, 3.6.1 and 4.4. The JSON is read by the crate `gltf`, but not validated by it: its validation
// panics on some files and refuses others that are common. Every index is looked up with a check instead.

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
        mut root,
        transforms,
        animations,
    } = read(json)?;
    check(&root)?;
    let mut buffers = Vec::with_capacity(root.buffers.len());
    // Several buffers may name one file, which is read once.
    let mut files: BTreeMap<&str, Vec<u8>> = BTreeMap::new();
    let (mut held, mut kept) = (bytes.len() as u64, 0u64);
    for (index, buffer) in root.buffers.iter().enumerate() {
        if buffer.uri.is_none() && compressed::is_fallback(buffer) {
            buffers.push(Vec::new());
            continue;
        }
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
    compressed::unpack(&mut root, &mut buffers, held, names.gate)?;
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

// The document: JSON as programs write it, mended where the crate `gltf` is stricter than the specification.
//
// Takes JSON, gives the crate's document and the nodes' own transforms in f64, which the crate reads as f32. Whole numbers
// may be written as `1.0`, a scene may have no nodes, and animations stay JSON, so that nothing in them refuses a model that
// is not posed by them.

/// The JSON of a document.
pub(super) struct Json {
    pub root: Root,
    /// From each node to its parent.
    pub transforms: Vec<Transform>,
    /// As they are written.
    pub animations: Vec<Value>,
}

/// A node's own transform, to its parent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transform {
    /// Instead of the other three.
    pub matrix: Option<DMat4>,
    pub translation: DVec3,
    pub rotation: DQuat,
    pub scale: DVec3,
}

impl Transform {
    /// The transform as a matrix.
    pub(super) fn parent_from_node(&self) -> DMat4 {
        self.matrix.unwrap_or_else(|| {
            DMat4::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
        })
    }
}

/// Numbers of this size and more are never indices or counts.
const LARGEST_WHOLE: f64 = 9_007_199_254_740_992.0;

/// Reads a document.
pub(super) fn read(json: &[u8]) -> Result<Json, String> {
    let mut value: Value =
        serde_json::from_slice(json).map_err(|error| format!("no valid glTF 2.0: {error}"))?;
    check_version(&value)?;
    let animations = match value
        .as_object_mut()
        .and_then(|all| all.remove("animations"))
    {
        Some(Value::Array(list)) => list,
        _ => Vec::new(),
    };
    for scene in list_mut(&mut value, "scenes") {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| json!([]));
        }
    }
    let transforms = list_mut(&mut value, "nodes")
        .iter()
        .map(transform)
        .collect();
    mend_whole_numbers(&mut value);
    let root = serde_json::from_value(value).map_err(|error| {
        // The text again, because only its errors name a line.
        let located = serde_json::from_slice::<Root>(json).err();
        format!("no valid glTF 2.0: {}", located.unwrap_or(error))
    })?;
    Ok(Json {
        root,
        transforms,
        animations,
    })
}

/// glTF 1.0 has objects where 2.0 has lists, and says its version.
fn check_version(value: &Value) -> Result<(), String> {
    let text = |key: &str| value.get("asset")?.get(key)?.as_str();
    let Some(version) = text("version") else {
        return Err("JSON, but no glTF: it has no asset.version".into());
    };
    let needed = text("minVersion").unwrap_or("2.0");
    let is_newer = |text: &str| text.split_once('.').is_none_or(|(_, minor)| minor != "0");
    for (version, newer) in [(version, false), (needed, is_newer(needed))] {
        if !version.starts_with("2.") || newer {
            let version = excerpt(version);
            return Err(format!(
                "glTF version {version} is not read: convert the file to glTF 2.0"
            ));
        }
    }
    Ok(())
}

fn list_mut<'a>(value: &'a mut Value, key: &str) -> &'a mut [Value] {
    let list = value.get_mut(key).and_then(Value::as_array_mut);
    list.map_or(&mut [], Vec::as_mut_slice)
}

/// Writes `1.0` as `1`.
fn mend_whole_numbers(value: &mut Value) {
    match value {
        Value::Array(list) => list.iter_mut().for_each(mend_whole_numbers),
        Value::Object(map) => map.values_mut().for_each(mend_whole_numbers),
        Value::Number(number) if number.is_f64() => {
            let whole = number
                .as_f64()
                .filter(|x| x.fract() == 0.0 && x.abs() < LARGEST_WHOLE);
            match whole {
                Some(x) if x > 0.0 || x.to_bits() == 0 => *number = Number::from(x as u64),
                Some(x) if x < 0.0 => *number = Number::from(x as i64),
                _ => {}
            }
        }
        _ => {}
    }
}

/// A node's own transform. What has another form is refused when the document is read.
fn transform(node: &Value) -> Transform {
    let vector = |key: &str, default: f64| {
        numbers(node, key).map_or(DVec3::splat(default), DVec3::from_array)
    };
    // Quaternions in files are unit only to their digits.
    let rotation = numbers(node, "rotation").map_or(DVec4::W, DVec4::from_array);
    let rotation = rotation.try_normalize().unwrap_or(DVec4::W);
    Transform {
        matrix: numbers::<16>(node, "matrix").map(|matrix| DMat4::from_cols_array(&matrix)),
        translation: vector("translation", 0.0),
        rotation: DQuat::from_vec4(rotation),
        scale: vector("scale", 1.0),
    }
}

fn numbers<const N: usize>(node: &Value, key: &str) -> Option<[f64; N]> {
    let list = node.get(key)?.as_array()?;
    let list: Vec<f64> = list.iter().filter_map(Value::as_f64).collect();
    list.try_into().ok()
}

// Extensions: which are decoded, which a picture can do without, and which end the reading.
//
// One rule: what changes only the light on surfaces and its colours, or nothing that is seen, is left out with a note; what
// changes shape, or is needed to read the file, is refused where the file requires it.

/// The extension with which a node has instances of its mesh.
pub(super) const INSTANCES: &str = "EXT_mesh_gpu_instancing";

/// Extensions that change what is seen and are understood here.
const DECODED: [&str; 15] = [
    INSTANCES,
    compressed::MESHOPT[0],
    compressed::MESHOPT[1],
    layers::IOR,
    layers::SPECULAR,
    layers::CLEARCOAT,
    layers::SHEEN,
    "EXT_texture_webp",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    layers::TRANSMISSION,
    layers::VOLUME,
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Beginnings of the names of those that change light on surfaces beyond what is modelled.
const LIGHT: [&str; 4] = [
    "KHR_materials_",
    "KHR_lights_",
    "EXT_lights_",
    "ADOBE_materials_",
];

/// Extensions for animation, for other looks than the one that is shown, and about the file itself.
const UNSEEN: [&str; 7] = [
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "KHR_animation_pointer",
    "KHR_interactivity",
    "KHR_materials_variants",
    "KHR_xmp",
    "KHR_xmp_json_ld",
];

/// The effect of an extension on the picture.
enum Effect {
    Decoded,
    Light,
    Unseen,
    Unknown,
}

fn effect(name: &str) -> Effect {
    let is_compressed = matches!(name, compressed::DRACO | "KHR_texture_basisu");
    if DECODED.contains(&name) || cfg!(feature = "compressed") && is_compressed {
        Effect::Decoded
    } else if UNSEEN.contains(&name) {
        Effect::Unseen
    } else if LIGHT.iter().any(|start| name.starts_with(start)) {
        Effect::Light
    } else {
        Effect::Unknown
    }
}

/// Refuses a file that requires what is not decoded.
pub(super) fn check(root: &Root) -> Result<(), String> {
    let unknown = |name: &&String| matches!(effect(name), Effect::Unknown);
    match root.extensions_required.iter().find(unknown) {
        Some(name) => Err(undecoded(name)),
        None => Ok(()),
    }
}

/// Names each extension that is left out, once, whether the file lists it or not.
pub(super) fn tell(root: &Root, notes: &mut Notes) {
    let listed = root.extensions_required.iter().chain(&root.extensions_used);
    let mut seen = HashSet::new();
    for name in listed
        .chain(unlisted(root))
        .filter(|name| seen.insert(*name))
    {
        let what = match effect(name) {
            Effect::Decoded => continue,
            Effect::Light => {
                "not modelled: light on surfaces and its colours differ, shapes do not"
            }
            Effect::Unseen => "left out: what the file shows first is drawn without it",
            Effect::Unknown => "not decoded: what it adds to the picture is left out",
        };
        notes.say(format!("{} is {what}", excerpt(name)));
    }
}

/// The extensions of what is drawn.
fn unlisted(root: &Root) -> impl Iterator<Item = &String> {
    let materials = root.materials.iter().filter_map(|m| m.extensions.as_ref());
    let textures = root.textures.iter().filter_map(|t| t.extensions.as_ref());
    let nodes = root.nodes.iter().filter_map(|n| n.extensions.as_ref());
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let primitives = primitives.filter_map(|p| p.extensions.as_ref());
    (materials.flat_map(|of| of.others.keys()))
        .chain(textures.flat_map(|of| of.others.keys()))
        .chain(nodes.flat_map(|of| of.others.keys()))
        .chain(primitives.flat_map(|of| of.others.keys()))
}

fn undecoded(name: &str) -> String {
    let way_out = match name {
        compressed::DRACO => {
            "export it without mesh compression, or build with the feature 'compressed'"
        }
        "KHR_texture_basisu" => {
            "export its textures as PNG, JPEG or WebP, or build with the feature 'compressed'"
        }
        "MSFT_texture_dds" | "EXT_texture_avif" => "export its textures as PNG, JPEG or WebP",
        _ => "export it without",
    };
    format!(
        "requires the extension {}, which is not decoded here: {way_out}",
        excerpt(name)
    )
}

/// The one of some things that a word names: by its name, or else by its number.
pub(super) fn position_of(names: &[Option<&str>], word: &str) -> Option<usize> {
    let by_name = names.iter().position(|name| *name == Some(word));
    by_name.or_else(|| word.parse().ok())
}

/// The numbers and names of the first of some things: more would not be read.
pub(super) fn list_of(names: &[Option<&str>]) -> String {
    const LISTED: usize = 10;
    let named = |(index, name): (usize, &Option<&str>)| match name {
        Some(name) => format!("{index} ({})", excerpt(name)),
        None => index.to_string(),
    };
    let list: Vec<_> = names.iter().enumerate().take(LISTED).map(named).collect();
    list.join(", ")
}
