//! Accessors: every layout that is read, and every lie that is found out.

use serde_json::{Value, json};

use super::{FLOAT, Maker, SQUARE, square};

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
