//! The content of a glTF document beside the drawn scene: its scenes, animations and cameras by name.

use serde_json::Value;

use super::super::files::Names;
use super::accessor::Numbers;
use crate::input::gltf::container;
use crate::input::gltf::pose::animation;

/// The content of a mesh file beside the drawn scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contents {
    /// Names of the scenes; empty where one has none.
    pub scenes: Vec<String>,
    /// The animations.
    pub animations: Vec<Animation>,
}

/// An animation.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    /// Its name, where it has one.
    pub name: Option<String>,
    /// Time of its last key, s.
    pub length_s: f64,
}

/// Reads a document; names in it count from `names`.
pub(crate) fn read(bytes: &[u8], names: &Names) -> Result<Contents, String> {
    let document = container::open(bytes, names)?;
    let numbers = Numbers::new(&document.root, &document.buffers);
    let of = |animation: &Value| Animation {
        name: animation
            .get("name")
            .and_then(Value::as_str)
            .map(str::to_owned),
        length_s: animation::length_s(animation, &numbers),
    };
    let scenes = document.root.scenes.iter();
    Ok(Contents {
        scenes: scenes
            .map(|scene| scene.name.clone().unwrap_or_default())
            .collect(),
        animations: document.animations.iter().map(of).collect(),
    })
}
