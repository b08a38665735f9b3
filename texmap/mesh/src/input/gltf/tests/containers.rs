//! Containers, required extensions, files that are not glTF 2.0, and accessors: every layout that is read, every lie that is found out.

use serde_json::{Value, json};

use crate::input::gltf::tests::{FLOAT, Maker, SQUARE, square, *};

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
    for name in ["MSFT_texture_dds", "EXT_texture_avif", "VENDOR_thing"] {
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
        "KHR_materials_anisotropy",
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
        let is_light = name.contains("aniso") || name.contains("irid") || name.contains("lights");
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
    let layer = json!({ "KHR_materials_anisotropy": { "anisotropyStrength": 1.0 } });
    let rest = json!({
        "meshes": meshes,
        "materials": [{ "extensions": layer.clone() }, { "extensions": layer }],
    });
    let (_, notes) = maker
        .load_with(rest, &LoadOptions::default())
        .expect("a good file");
    assert!(
        notes.said.len() == 1 && notes.said[0].contains("KHR_materials_anisotropy"),
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

/// Loads a square whose positions are accessor `position`, and gives them.
fn positions(maker: &Maker, position: usize) -> Result<Vec<[f32; 3]>, String> {
    let meshes = json!([{ "primitives": [{ "attributes": { "POSITION": position } }] }]);
    maker
        .load(json!({ "meshes": meshes }))
        .map(|scene| scene.meshes[0].positions.clone())
}

#[test]
fn sparse_substitutes_lie_over_data_or_over_zeros() {
    // As in SimpleSparseAccessor.
    let mut maker = Maker::default();
    let position = maker.floats("VEC3", 3, &SQUARE);
    let places = maker.view(&[3]);
    let values: Vec<u8> = [7.0f32, 8.0, 9.0]
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect();
    let values = maker.view(&values);
    let sparse = |count: usize| {
        json!({
            "count": count,
            "indices": { "bufferView": places, "componentType": 5121 },
            "values": { "bufferView": values },
        })
    };
    maker.accessors[position]["sparse"] = sparse(1);
    let over_data = positions(&maker, position).expect("a good file");
    assert_eq!(
        (over_data[1], over_data[3]),
        ([1.0, 0.0, 0.0], [7.0, 8.0, 9.0]),
        "only the fourth changes"
    );
    maker
        .accessors
        .push(json!({ "componentType": FLOAT, "type": "VEC3", "count": 4, "sparse": sparse(1) }));
    let over_zeros = positions(&maker, position + 1).expect("a good file");
    assert_eq!(
        (over_zeros[1], over_zeros[3]),
        ([0.0; 3], [7.0, 8.0, 9.0]),
        "zeros elsewhere"
    );
    maker.accessors[position]["sparse"] = sparse(5);
    assert!(
        positions(&maker, position).is_err_and(|e| e.contains("substitutes")),
        "more than there are elements"
    );
    maker.accessors[position]["sparse"] = sparse(1);
    maker.accessors[position]["count"] = json!(3);
    assert!(
        positions(&maker, position).is_err_and(|e| e.contains("sparse index 3")),
        "an index out of range"
    );
}

#[test]
fn interleaved_attributes_are_picked_out() {
    // As in BoxInterleaved: position and coordinates side by side, 20 bytes apart.
    let mut maker = Maker::default();
    let rows = SQUARE
        .chunks(3)
        .flat_map(|p| [p[0], p[1], p[2], p[0] + 10.0, p[1] + 20.0]);
    let bytes: Vec<u8> = rows.flat_map(f32::to_le_bytes).collect();
    let position = maker.accessor("VEC3", FLOAT, 4, &bytes);
    maker.views[0]["byteStride"] = json!(20);
    maker.accessors.push(
        json!({ "bufferView": 0, "byteOffset": 12, "componentType": FLOAT, "type": "VEC2", "count": 4 }),
    );
    let attributes = json!({ "POSITION": position, "TEXCOORD_0": position + 1 });
    let scene = maker.load(json!({ "meshes": [{ "primitives": [{ "attributes": attributes }] }] }));
    let mesh = &scene.expect("a good file").meshes[0];
    assert_eq!(mesh.positions[2], [1.0, 1.0, 0.0], "the third position");
    assert_eq!(mesh.uvs[0][2], [11.0, 21.0], "the third coordinates");
}

#[test]
fn integers_become_fractions_where_they_mean_them() {
    // As in VertexColorTest and in quantised files.
    let mut maker = Maker::default();
    let bytes: Vec<u8> = SQUARE
        .iter()
        .flat_map(|&x| ((x * 100.0) as i16).to_le_bytes())
        .collect();
    let position = maker.accessor("VEC3", 5122, 4, &bytes);
    let colour = maker.accessor("VEC3", 5121, 4, &[255, 0, 51].repeat(4));
    let uv = maker.accessor("VEC2", 5123, 4, &[0xff, 0xff, 0, 0].repeat(4));
    maker.accessors[uv]["normalized"] = json!(true);
    let attributes = json!({ "POSITION": position, "COLOR_0": colour, "TEXCOORD_0": uv });
    let scene = maker.load(json!({ "meshes": [{ "primitives": [{ "attributes": attributes }] }] }));
    let mesh = &scene.expect("a good file").meshes[0];
    assert_eq!(
        mesh.positions[1],
        [100.0, 0.0, 0.0],
        "quantised positions are plain integers"
    );
    assert_eq!(
        mesh.colours[0],
        [1.0, 0.0, 0.2, 1.0],
        "colours are fractions, and opaque without alpha"
    );
    assert_eq!(
        mesh.uvs[0][0],
        [1.0, 0.0],
        "marked coordinates are fractions"
    );
}

#[test]
fn lies_about_counts_types_and_ranges_are_found_out() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let (position, indices) = (0, 1);
    let load = |accessor: usize, key: &str, value: Value| {
        let mut changed = Maker {
            bytes: maker.bytes.clone(),
            views: maker.views.clone(),
            accessors: maker.accessors.clone(),
        };
        changed.accessors[accessor][key] = value;
        changed.load(json!({ "meshes": meshes })).err()
    };
    let lies = [
        (position, "count", json!(5), "do not fit"),
        (position, "count", json!(u64::MAX), "asks for more"),
        (position, "count", json!(100_000_000u64), "do not fit"),
        (position, "byteOffset", json!(u64::MAX), "do not fit"),
        (position, "type", json!("VEC2"), "expected a type"),
        (position, "type", json!("VEC9"), "unknown type"),
        (
            position,
            "componentType",
            json!(5125),
            "expected components",
        ),
        (
            position,
            "bufferView",
            json!(9),
            "buffer view 9 does not exist",
        ),
        (indices, "componentType", json!(5126), "expected components"),
        (indices, "type", json!("VEC3"), "expected a type"),
    ];
    for (accessor, key, value, expected) in lies {
        let error = load(accessor, key, value.clone()).unwrap_or_default();
        assert!(
            error.contains(expected),
            "{key} = {value}: expected '{expected}' in '{error}'"
        );
    }
    maker.views[0]["byteLength"] = json!(1u64 << 40);
    assert!(
        maker
            .load(json!({ "meshes": meshes }))
            .is_err_and(|e| e.contains("takes")),
        "a view beyond its buffer"
    );
    maker.views[0]["byteLength"] = json!(48);
    maker.views[0]["byteStride"] = json!(4);
    assert!(
        maker
            .load(json!({ "meshes": meshes }))
            .is_err_and(|e| e.contains("apart")),
        "elements that overlap"
    );
    maker.views[0]["byteStride"] = json!(12);
    assert!(
        maker.load(json!({ "meshes": meshes })).is_ok(),
        "and the truth is believed"
    );
}

#[test]
fn zeros_from_nothing_are_bounded() {
    let mut maker = Maker::default();
    let _ = square(&mut maker);
    maker
        .accessors
        .push(json!({ "componentType": FLOAT, "type": "VEC3", "count": 100_000_000u64 }));
    assert!(
        positions(&maker, 2).is_err_and(|e| e.contains("without data")),
        "a gigabyte from a few bytes"
    );
}

#[test]
fn attributes_of_another_length_and_indices_out_of_range_are_errors() {
    let mut maker = Maker::default();
    let position = maker.floats("VEC3", 3, &SQUARE);
    let uv = maker.floats("VEC2", 2, &[0.0; 6]);
    let far = maker.indices(&[0, 1, 4]);
    let load = |primitive: Value| maker.load(json!({ "meshes": [{ "primitives": [primitive] }] }));
    let short = load(json!({ "attributes": { "POSITION": position, "TEXCOORD_0": uv } }));
    assert!(
        short.is_err_and(|e| e.contains("3 elements, POSITION has 4")),
        "three coordinates for four positions"
    );
    let range = load(json!({ "attributes": { "POSITION": position }, "indices": far }));
    assert!(
        range.is_err_and(|e| e.contains("index 4 is out of range")),
        "a fifth corner of a square"
    );
    assert!(
        load(json!({ "attributes": {} })).is_err_and(|e| e.contains("POSITION")),
        "no positions at all"
    );
}
