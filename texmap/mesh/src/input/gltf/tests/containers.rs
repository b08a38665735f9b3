//! Containers, required extensions, and files that are not glTF 2.0.

use serde_json::json;

use super::*;

#[test]
fn binary_files_hold_their_buffer_and_cut_ones_are_refused() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let mut json = maker.json(json!({ "meshes": meshes }));
    json["buffers"] = json!([{ "byteLength": maker.bytes.len() }]);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |number: usize| (number as u32).to_le_bytes();
    let length = 12 + 8 + text.len() + 8 + maker.bytes.len();
    let parts: [&[u8]; 8] = [
        b"glTF",
        &word(2),
        &word(length),
        &word(text.len()),
        b"JSON",
        &text,
        &word(maker.bytes.len()),
        b"BIN\0",
    ];
    let mut file = parts.concat();
    file.extend_from_slice(&maker.bytes);
    let load = |bytes: &[u8]| {
        load(
            bytes,
            &nowhere(&Gate::default()),
            &LoadOptions::default(),
            &mut Notes::default(),
        )
    };
    assert_eq!(
        load(&file).expect("a good file").meshes[0].triangles.len(),
        2,
        "the square"
    );
    for end in (0..file.len()).step_by(7) {
        assert!(
            load(&file[..end]).is_err(),
            "the first {end} bytes alone are no file"
        );
    }
}

#[test]
fn required_extensions_that_are_not_decoded_name_a_way_out() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let load = |name: &str| maker.load(json!({ "meshes": meshes, "extensionsRequired": [name] }));
    for name in [
        "KHR_draco_mesh_compression",
        "EXT_meshopt_compression",
        "KHR_texture_basisu",
        "VENDOR_thing",
    ] {
        let error = load(name).expect_err("not decoded");
        assert!(error.contains(name) && error.contains("export"), "{error}");
    }
    assert!(
        load("KHR_mesh_quantization").is_ok(),
        "what is decoded may be required"
    );
    assert!(
        load("KHR_materials_unlit").is_ok_and(|scene| scene.materials[0].sides == Sides::Front),
        "unlit too"
    );
}

#[test]
fn extensions_that_are_left_out_are_named_once() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let left_out = [
        "KHR_materials_sheen",
        "KHR_materials_iridescence",
        "KHR_lights_punctual",
        "KHR_animation_pointer",
        "KHR_materials_variants",
    ];
    let rest =
        json!({ "meshes": meshes, "extensionsRequired": left_out, "extensionsUsed": left_out });
    let notes_of = |rest| {
        maker
            .load_with(rest, &LoadOptions::default())
            .expect("a good file")
            .1
            .said
    };
    let notes = notes_of(rest);
    for name in left_out {
        let count = notes.iter().filter(|note| note.contains(name)).count();
        assert_eq!(count, 1, "{name}: {notes:?}");
        let note = notes.iter().find(|note| note.contains(name));
        let colours = note.is_some_and(|note| note.contains("colours differ"));
        let is_light = name.contains("sheen") || name.contains("irid") || name.contains("lights");
        assert_eq!(colours, is_light, "{note:?}");
    }
    let rest = json!({ "meshes": meshes, "extensionsUsed": ["MSFT_lod", "KHR_materials_unlit"] });
    let notes = notes_of(rest);
    assert!(
        notes.len() == 1 && notes[0].contains("MSFT_lod"),
        "{notes:?}"
    );
}

#[test]
fn extensions_that_a_file_has_and_does_not_list_are_named() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let clearcoat = json!({ "KHR_materials_clearcoat": { "clearcoatFactor": 1.0 } });
    let rest = json!({
        "meshes": meshes,
        "materials": [{ "extensions": clearcoat.clone() }, { "extensions": clearcoat }],
    });
    let (_, notes) = maker
        .load_with(rest, &LoadOptions::default())
        .expect("a good file");
    assert!(
        notes.said.len() == 1 && notes.said[0].contains("KHR_materials_clearcoat"),
        "{:?}",
        notes.said
    );
}

#[test]
fn what_the_specification_allows_is_read() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let load = |rest| maker.load_with(rest, &LoadOptions::default());
    let animations = json!([{ "samplers": [], "channels": [{ "sampler": 0, "target": { "path": "pointer" } }] }]);
    let (_, notes) = load(json!({ "meshes": meshes, "animations": animations })).expect("no node");
    assert!(
        notes.said.iter().any(|note| note.contains("animations")),
        "{:?}",
        notes.said
    );
    let scenes = json!([{ "name": "nothing" }, { "nodes": [0.0] }]);
    load(json!({ "meshes": meshes, "scenes": scenes, "scene": 1.0 }))
        .expect("whole numbers with a point");
    assert!(
        load(json!({ "meshes": meshes, "scenes": [{ "name": "nothing" }] }))
            .is_ok_and(|(scene, _)| scene.meshes.is_empty()),
        "a scene without nodes"
    );
}

#[test]
fn a_file_for_later_versions_is_refused() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let of = |needed: &str| {
        let asset = json!({ "version": "2.0", "minVersion": needed });
        maker.load(json!({ "meshes": meshes, "asset": asset }))
    };
    assert!(of("2.0").is_ok());
    assert!(of("2.1").is_err_and(|e| e.contains("version 2.1")));
}

#[test]
fn older_and_foreign_json_is_told_apart() {
    let load = |text: &str| {
        load(
            text.as_bytes(),
            &nowhere(&Gate::default()),
            &LoadOptions::default(),
            &mut Notes::default(),
        )
    };
    let old = r#"{ "asset": { "version": "1.0" }, "accessors": { "a": {} } }"#;
    assert!(
        load(old).is_err_and(|e| e.contains("version 1.0")),
        "glTF 1.0 has objects for lists"
    );
    assert!(
        load(r#"{ "a": 1 }"#).is_err_and(|e| e.contains("no glTF")),
        "JSON of something else"
    );
    assert!(
        load("{ ").is_err_and(|e| e.contains("line 1")),
        "broken JSON names its line"
    );
}
