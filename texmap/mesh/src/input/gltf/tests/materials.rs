//! Materials and textures: factors, samplers, transforms, alpha, pictures of any size.

use std::io::Cursor;

use glam::DVec2;
use serde_json::{Value, json};

use super::{Maker, SQUARE, square};
use crate::input::{LoadOptions, Notes, Unreadable};
use crate::scene::{
    AlphaMode, CoatNormals, Lighting, Magnify, Material, Scene, Sides, Texels, TextureUse, Wrap,
};

/// A square with two sets of coordinates and one material; `rest` adds textures and the like.
fn load(maker: &mut Maker, material: Value, rest: Value) -> Result<(Scene, Notes), String> {
    load_with(maker, material, rest, Notes::default())
}

fn load_with(
    maker: &mut Maker,
    material: Value,
    rest: Value,
    notes: Notes,
) -> Result<(Scene, Notes), String> {
    let position = maker.floats("VEC3", 3, &SQUARE);
    let first = maker.floats("VEC2", 2, &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let second = maker.floats("VEC2", 2, &[0.25; 8]);
    let attributes = json!({ "POSITION": position, "TEXCOORD_0": first, "TEXCOORD_1": second });
    let mut document = json!({
        "meshes": [{ "primitives": [{ "attributes": attributes, "material": 0 }] }],
        "materials": [material],
    });
    let Value::Object(rest) = rest else {
        panic!("the rest is an object")
    };
    rest.into_iter()
        .for_each(|(key, value)| document[key] = value);
    maker.load_noting(document, &LoadOptions::default(), notes)
}

/// A PNG of that many texels, all of one colour.
fn png(width: u32, height: u32) -> Vec<u8> {
    let picture = image::RgbaImage::from_pixel(width, height, image::Rgba([1, 2, 3, 4]));
    let mut file = Cursor::new(Vec::new());
    picture
        .write_to(&mut file, image::ImageFormat::Png)
        .expect("memory");
    file.into_inner()
}

/// One picture in the buffer, and one texture of it.
fn one_texture(maker: &mut Maker, sampler: Value) -> Value {
    let view = maker.view(&png(3, 5));
    json!({
        "images": [{ "bufferView": view, "mimeType": "image/png" }],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [sampler],
    })
}

fn textured(info: Value) -> Value {
    json!({ "pbrMetallicRoughness": { "baseColorTexture": info } })
}

fn base_use(maker: &mut Maker, info: Value, sampler: Value) -> TextureUse {
    let rest = one_texture(maker, sampler);
    let (scene, _) = load(maker, textured(info), rest).expect("a good file");
    scene.materials[0].base_texture.expect("a texture")
}

fn only_material(material: Value) -> Material {
    let (scene, _) = load(&mut Maker::default(), material, json!({})).expect("a good file");
    scene.materials[0].clone()
}

#[test]
fn coordinates_count_from_the_top_of_a_picture_of_any_size() {
    // As in TextureCoordinateTest and BoxTexturedNonPowerOfTwo.
    let mut maker = Maker::default();
    let rest = one_texture(&mut maker, json!({}));
    let (scene, _) = load(&mut maker, textured(json!({ "index": 0 })), rest).expect("a good file");
    assert_eq!(
        scene.meshes[0].uvs[0][3],
        [0.0, 0.0],
        "the file's own coordinates, v down"
    );
    let texture = &scene.textures[0];
    assert_eq!(
        (texture.width, texture.height),
        (3, 5),
        "no power of two is asked for"
    );
    let Texels::Srgb8(texels) = &texture.texels else {
        panic!("8 bits stay")
    };
    assert_eq!(
        texels[..],
        [[1, 2, 3, 4]; 15],
        "texels as they are in the file"
    );
}

#[test]
fn samplers_say_what_lies_beyond_the_border() {
    // As in TextureSettingsTest.
    let settings = |sampler: Value| {
        let used = base_use(&mut Maker::default(), json!({ "index": 0 }), sampler);
        (used.wrap, used.magnify)
    };
    assert_eq!(
        settings(json!({})),
        ([Wrap::Repeat; 2], Magnify::Linear),
        "the defaults"
    );
    let sampler = json!({ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 });
    assert_eq!(
        settings(sampler),
        ([Wrap::Clamp, Wrap::Mirror], Magnify::Nearest),
        "clamp, mirror, nearest"
    );
    let mut maker = Maker::default();
    let rest = one_texture(&mut maker, json!({ "wrapS": 7 }));
    assert!(
        load(&mut maker, textured(json!({ "index": 0 })), rest).is_err_and(|e| e.contains("wrap")),
        "unknown"
    );
    assert_eq!(
        only_material(json!({ "doubleSided": true })).sides,
        Sides::Both,
        "both sides"
    );
}

#[test]
fn texture_transforms_scale_then_turn_then_move() {
    // As in TextureTransformTest. A quarter turn counter-clockwise takes u, to the right, to -v, up in the picture.
    let quarter = std::f64::consts::FRAC_PI_2;
    let transform = json!({ "offset": [0.1, 0.2], "rotation": quarter, "scale": [2, 3] });
    let info = json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } });
    let used = base_use(&mut Maker::default(), info, json!({}));
    for (uv, expected) in [
        ((0.0, 0.0), (0.1, 0.2)),
        ((1.0, 0.0), (0.1, -1.8)),
        ((0.0, 1.0), (3.1, 0.2)),
    ] {
        let found = used.uv_linear * DVec2::from(uv) + used.uv_offset;
        assert!(
            (found - DVec2::from(expected)).length() < 1e-6,
            "{uv:?} goes to {found}, expected {expected:?}"
        );
    }
}

#[test]
fn textures_choose_their_set_of_coordinates() {
    // As in MultiUVTest; a transform may choose another set than the texture.
    let set = |info: Value| base_use(&mut Maker::default(), info, json!({})).uv_set;
    assert_eq!(set(json!({ "index": 0 })), 0, "the first");
    assert_eq!(set(json!({ "index": 0, "texCoord": 1 })), 1, "the second");
    let info = json!({ "index": 0, "texCoord": 0, "extensions": { "KHR_texture_transform": { "texCoord": 1 } } });
    assert_eq!(set(info), 1, "the transform's word counts");
}

#[test]
fn a_set_that_is_missing_leaves_the_plain_colour() {
    let mut maker = Maker::default();
    let rest = one_texture(&mut maker, json!({}));
    let (scene, mut notes) = load(
        &mut maker,
        textured(json!({ "index": 0, "texCoord": 5 })),
        rest,
    )
    .expect("a good file");
    let scene = crate::input::finish::scene(scene, &mut notes).expect("a good scene");
    let material = &scene.materials[scene.meshes[0].material];
    assert!(material.base_texture.is_none(), "there is no sixth set");
    assert!(
        notes.said.iter().any(|note| note.contains("coordinates")),
        "and that is said: {:?}",
        notes.said
    );
}

#[test]
fn alpha_modes_and_factors_are_the_files() {
    // As in AlphaBlendModeTest.
    assert_eq!(
        only_material(json!({})).alpha,
        AlphaMode::Opaque,
        "the default"
    );
    assert_eq!(
        only_material(json!({ "alphaMode": "MASK" })).alpha,
        AlphaMode::Mask { cutoff: 0.5 },
        "half"
    );
    let mask = json!({ "alphaMode": "MASK", "alphaCutoff": 0.75 });
    assert_eq!(
        only_material(mask).alpha,
        AlphaMode::Mask { cutoff: 0.75 },
        "its own cutoff"
    );
    assert_eq!(
        only_material(json!({ "alphaMode": "BLEND" })).alpha,
        AlphaMode::Blend,
        "blend"
    );
    let material = only_material(json!({
        "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 1, 0.125] },
        "emissiveFactor": [0.5, 0, 1],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 4 }, "KHR_materials_unlit": {} },
    }));
    assert_eq!(
        material.base_colour,
        [0.5, 0.25, 1.0, 0.125],
        "linear as it stands"
    );
    assert_eq!(material.emissive, [2.0, 0.0, 4.0], "times its strength");
    assert_eq!(material.lighting, Lighting::Unlit, "unlit");
}

#[test]
fn a_picture_that_cannot_be_had_is_an_error_or_leaves_its_factor_and_a_note() {
    let missing = json!({ "uri": "nothing.png" });
    let broken = json!({ "uri": "data:image/png,abc" });
    let outside = json!({ "uri": "http://host/a.png" });
    for image in [missing, broken, outside, json!({})] {
        let rest = json!({ "images": [image], "textures": [{ "source": 0 }] });
        let read = |unreadable: Unreadable| {
            let (maker, notes) = (&mut Maker::default(), Notes::new(unreadable));
            load_with(maker, textured(json!({ "index": 0 })), rest.clone(), notes)
        };
        let error = read(Unreadable::Refused).expect_err("a white surface is no picture of it");
        assert!(
            error.contains("texture") && error.contains("--textures left-out"),
            "{error}"
        );
        let (scene, notes) = read(Unreadable::Noted).expect("the mesh can be had");
        assert!(
            scene.materials[0].base_texture.is_none() && scene.textures.is_empty(),
            "{image}: no texture"
        );
        assert_eq!(
            notes.said.len(),
            1,
            "{image}: one note, not {:?}",
            notes.said
        );
    }
}

#[test]
fn webp_and_the_older_material_model_are_read() {
    let mut maker = Maker::default();
    let view = maker.view(&png(2, 2));
    let rest = json!({
        "images": [{ "uri": "nothing.ktx2" }, { "bufferView": view, "mimeType": "image/png" }],
        "textures": [{ "source": 0, "extensions": { "EXT_texture_webp": { "source": 1 } } }],
        "extensionsRequired": ["EXT_texture_webp", "KHR_materials_pbrSpecularGlossiness"],
    });
    let old = json!({ "diffuseFactor": [0.5, 0.5, 0.5, 1], "diffuseTexture": { "index": 0 } });
    let material = json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": old } });
    let (scene, notes) = load(&mut maker, material, rest).expect("a good file");
    assert_eq!(
        scene.materials[0].base_colour,
        [0.5, 0.5, 0.5, 1.0],
        "the diffuse factor"
    );
    assert!(
        scene.materials[0].base_texture.is_some(),
        "its picture, by the extension: {:?}",
        notes.said
    );
}

#[test]
fn glass_passes_light_and_the_older_model_reflects_in_its_colour() {
    let of = |name: &str, value: Value| {
        let extension = json!({ name: value });
        load(
            &mut Maker::default(),
            json!({ "extensions": extension }),
            json!({}),
        )
        .expect("good")
    };
    let (scene, notes) = of(
        "KHR_materials_transmission",
        json!({ "transmissionFactor": 0.5 }),
    );
    let material = &scene.materials[0];
    assert_eq!(material.alpha, AlphaMode::Blend);
    let glass = material.physical.and_then(|physical| physical.glass);
    assert_eq!(
        glass.map(|glass| (glass.amount, glass.thickness)),
        Some((0.5, 0.0))
    );
    assert!(
        notes.said.iter().any(|note| note.contains("transmission")),
        "{:?}",
        notes.said
    );
    let (scene, notes) = of("KHR_materials_transmission", json!({}));
    assert_eq!(
        scene.materials[0].alpha,
        AlphaMode::Opaque,
        "by default nothing goes through"
    );
    assert!(notes.said.is_empty(), "{:?}", notes.said);
    let gold = json!({ "diffuseFactor": [0, 0, 0, 1], "specularFactor": [1.0, 0.7, 0.3], "glossinessFactor": 0.75 });
    let (scene, notes) = of("KHR_materials_pbrSpecularGlossiness", gold);
    let physical = scene.materials[0].physical.expect("it is lit");
    assert_eq!(scene.materials[0].base_colour, [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(physical.dielectric.reflectance(), [1.0, 0.7, 0.3]);
    assert_eq!((physical.metal, physical.roughness), (0.0, 0.25));
    assert!(notes.said.is_empty(), "{:?}", notes.said);
}

#[test]
fn layers_are_read_with_their_pictures() {
    let with = |extensions: Value| {
        let mut maker = Maker::default();
        let material = json!({ "extensions": extensions });
        load(&mut maker, material, json!({}))
    };
    let read = |extensions: Value| {
        let (scene, notes) = with(extensions).expect("good");
        (scene.materials[0].physical.expect("it is lit"), notes.said)
    };
    let (physical, notes) = read(json!({
        "KHR_materials_ior": { "ior": 1.8 },
        "KHR_materials_specular": { "specularFactor": 0.5, "specularColorFactor": [1, 0.5, 0.25] },
        "KHR_materials_clearcoat": { "clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.25 },
        "KHR_materials_sheen": { "sheenColorFactor": [0.1, 0.2, 0.3], "sheenRoughnessFactor": 0.4 },
        "KHR_materials_volume": { "thicknessFactor": 2 },
    }));
    let dielectric = physical.dielectric;
    assert_eq!((dielectric.ior, dielectric.specular), (1.8, 0.5));
    assert_eq!(dielectric.colour, [1.0, 0.5, 0.25]);
    let coat = physical.coat.expect("a coat");
    assert_eq!(
        (coat.amount, coat.roughness, coat.normals),
        (0.75, 0.25, CoatNormals::Smooth)
    );
    let sheen = physical.sheen.expect("sheen");
    assert_eq!((sheen.colour, sheen.roughness), ([0.1, 0.2, 0.3], 0.4));
    assert_eq!(
        physical.glass, None,
        "a body without transmission shows nothing"
    );
    assert!(notes.is_empty(), "{notes:?}");
    let (physical, _) = read(json!({
        "KHR_materials_clearcoat": {}, "KHR_materials_sheen": { "sheenRoughnessFactor": 0.4 },
    }));
    assert_eq!(
        (physical.coat, physical.sheen),
        (None, None),
        "by default there is neither"
    );
    for (extension, key, value) in [
        ("KHR_materials_ior", "ior", json!("glass")),
        (
            "KHR_materials_specular",
            "specularColorFactor",
            json!([1, 2]),
        ),
        ("KHR_materials_clearcoat", "clearcoatFactor", json!([])),
        ("KHR_materials_sheen", "sheenColorFactor", json!(1)),
        (
            "KHR_materials_transmission",
            "transmissionFactor",
            json!("all"),
        ),
    ] {
        let error = with(json!({ extension: { key: value } }))
            .map(|_| ())
            .expect_err("no number");
        assert!(error.contains(extension) && error.contains(key), "{error}");
    }
}

#[test]
fn bodies_are_as_thick_as_their_nodes_are_large() {
    let mut maker = Maker::default();
    let mut meshes = square(&mut maker);
    meshes[0]["primitives"][0]["material"] = json!(0);
    let scene = maker.load(json!({
        "meshes": meshes,
        "materials": [{ "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": {
                "thicknessFactor": 2, "attenuationDistance": 0.5, "attenuationColor": [0.5, 1, 1],
            },
        } }],
        "nodes": [{ "mesh": 0 }, { "mesh": 0, "scale": [3, 3, 3] }, { "mesh": 0, "scale": [3, 3, 3] }],
        "scenes": [{ "nodes": [0, 1, 2] }],
    }));
    let scene = scene.expect("three squares");
    let glass = |mesh: usize| {
        let material = &scene.materials[scene.meshes[mesh].material];
        material
            .physical
            .and_then(|physical| physical.glass)
            .expect("glass")
    };
    assert_eq!(
        [0, 1, 2].map(|mesh| glass(mesh).thickness.round()),
        [2.0, 6.0, 6.0]
    );
    assert_eq!(glass(1).attenuation_distance, 0.5, "world units already");
    assert_eq!(scene.materials.len(), 2, "one for each scale");
}
