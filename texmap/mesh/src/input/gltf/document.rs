//! The document: JSON as programs write it, mended where the crate `gltf` is stricter than the specification.
//!
//! Takes JSON, gives the crate's document and the nodes' own transforms in f64, which the crate reads as f32. Whole numbers
//! may be written as `1.0`, a scene may have no nodes, and animations stay JSON, so that nothing in them refuses a model that
//! is not posed by them.

use glam::{DMat4, DQuat, DVec3, DVec4};
use gltf::json::Root;
use serde_json::{Number, Value, json};

use super::super::files;

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
            let version = files::excerpt(version);
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
