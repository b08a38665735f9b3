//! Extensions: which are decoded, which a picture can do without, and which end the reading.
//!
//! One rule: what changes only the light on surfaces and its colours, or nothing that is seen, is left out with a note; what
//! changes shape, or is needed to read the file, is refused where the file requires it.

use std::collections::HashSet;

use gltf::json::Root;

use super::super::files::excerpt;
use super::super::notes::Notes;

/// Extensions that change what is seen and are understood here.
const DECODED: [&str; 8] = [
    super::instances::NAME,
    "EXT_texture_webp",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
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
    if DECODED.contains(&name) {
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
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "export it without mesh compression, or unpack it, for example with 'gltf-transform copy' or 'gltfpack -noq'"
        }
        "KHR_texture_basisu" => "export its textures as PNG, JPEG or WebP instead of KTX2",
        "MSFT_texture_dds" | "EXT_texture_avif" => "export its textures as PNG, JPEG or WebP",
        _ => "export it without",
    };
    format!(
        "requires the extension {}, which is not decoded here: {way_out}",
        excerpt(name)
    )
}
