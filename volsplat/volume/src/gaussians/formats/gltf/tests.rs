//! Files made by code: text and binary, every degree, quantised numbers, nodes, and what is refused.

use std::path::Path;

use glam::{DMat3, DQuat, DVec3, Quat, Vec3};
use resample_io::{Gate, Outside};
use serde_json::{Value, json};

use super::super::test_files::{Dir, check_damage, known, same, same_within};
use super::*;

/// The bytes of the numbers, one attribute after another, and the document without its buffer's place.
struct Made {
    json: Value,
    data: Vec<u8>,
}

impl Made {
    fn new(degree: usize) -> Self {
        let node = json!({ "mesh": 0 });
        let json = json!({
            "asset": { "version": "2.0" },
            "extensionsUsed": [EXTENSION],
            "accessors": [],
            "bufferViews": [],
            "nodes": [node],
            "scenes": [{ "nodes": [0] }],
            "meshes": [{ "primitives": [{
                "mode": 0,
                "attributes": {},
                "extensions": { EXTENSION: { "kernel": "ellipse", "colorSpace": "lin_rec709_display" } },
            }] }],
        });
        let mut made = Self {
            json,
            data: Vec::new(),
        };
        let all = known(degree);
        let floats = |value: &dyn Fn(&Stored, &[f32]) -> Vec<f32>| {
            let vectors = all.iter().flat_map(|(stored, rest)| value(stored, rest));
            vectors.flat_map(f32::to_le_bytes).collect::<Vec<u8>>()
        };
        let float = (5126, false);
        made.add(
            "POSITION",
            "VEC3",
            float,
            floats(&|s, _| s.centre.as_vec3().to_array().into()),
        );
        made.add(
            &prefixed("ROTATION"),
            "VEC4",
            float,
            floats(&|s, _| s.rotation.to_array().into()),
        );
        made.add(
            &prefixed("SCALE"),
            "VEC3",
            float,
            floats(&|s, _| s.scales.to_array().into()),
        );
        made.add(
            &prefixed("OPACITY"),
            "SCALAR",
            float,
            floats(&|s, _| vec![s.opacity]),
        );
        made.add(
            &harmonic(0, 0),
            "VEC3",
            float,
            floats(&|s, _| ((s.colour - 0.5) / C0).to_array().into()),
        );
        let mut place = 0;
        for degree in 1..=degree {
            for number in 0..=2 * degree {
                let values = floats(&|_, rest| rest[3 * place..3 * place + 3].to_vec());
                made.add(&harmonic(degree, number), "VEC3", float, values);
                place += 1;
            }
        }
        made
    }

    /// Adds an attribute, or puts another in its place.
    fn add(
        &mut self,
        name: &str,
        shape: &str,
        (component, normalized): (u32, bool),
        bytes: Vec<u8>,
    ) {
        let views = self.json["bufferViews"].as_array_mut().expect("a list");
        let number = views.len();
        views
            .push(json!({ "buffer": 0, "byteOffset": self.data.len(), "byteLength": bytes.len() }));
        self.data.extend(bytes);
        let accessors = self.json["accessors"].as_array_mut().expect("a list");
        accessors.push(json!({
            "bufferView": number, "componentType": component, "normalized": normalized, "count": known(0).len(), "type": shape,
        }));
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(number);
    }

    fn with(mut self, pointer: &str, value: Value) -> Self {
        let (parent, name) = pointer.rsplit_once('/').expect("a path");
        self.json.pointer_mut(parent).expect("there")[name] = value;
        self
    }

    fn text(&self) -> Vec<u8> {
        let mut uri = String::from("data:application/octet-stream,");
        self.data
            .iter()
            .for_each(|byte| uri += &format!("%{byte:02x}"));
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "uri": uri, "byteLength": self.data.len() }]);
        json.to_string().into_bytes()
    }

    fn binary(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "byteLength": self.data.len() }]);
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let chunk =
            |kind: &[u8], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes(), kind, bytes].concat();
        let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &self.data)].concat();
        let length = 12 + chunks.len() as u32;
        [MAGIC, &2u32.to_le_bytes(), &length.to_le_bytes(), &chunks].concat()
    }
}

fn read(bytes: &[u8]) -> Result<(Gaussians, Vec<String>), String> {
    let dir = Dir::new();
    let path = dir.write("a", bytes);
    assert!(may_begin(bytes));
    let mut notes = Vec::new();
    let read = load(&path, &Gate::default(), &mut notes);
    read.map(|all| (all, notes)).map_err(|why| why.to_string())
}

#[test]
fn text_and_binary_of_every_degree_read_back() {
    for degree in 0..=3 {
        for bytes in [Made::new(degree).text(), Made::new(degree).binary()] {
            let dir = Dir::new();
            assert!(begins(&dir.write("a", &bytes)));
            let (all, notes) = read(&bytes).expect("a good file");
            assert!(notes.is_empty(), "{notes:?}");
            assert_eq!(all.degree(), degree);
            assert_eq!(all.blend_space, BlendSpace::Linear);
            same(&all, &known(degree), 2e-6);
        }
    }
}

#[test]
fn buffers_beside_the_file_and_base64_are_read() {
    let made = Made::new(1);
    let dir = Dir::new();
    dir.write("the data.bin", &made.data);
    let mut json = made.json.clone();
    json["buffers"] = json!([{ "uri": "the%20data.bin", "byteLength": made.data.len() }]);
    let path = dir.write("a.gltf", json.to_string().as_bytes());
    let all = load(&path, &Gate::default(), &mut Vec::new()).expect("a good file");
    same(&all, &known(1), 2e-6);
    json["buffers"][0]["uri"] = json!("../elsewhere.bin");
    let path = dir.write("b.gltf", json.to_string().as_bytes());
    let why = load(&path, &Gate::default(), &mut Vec::new()).expect_err("outside");
    assert!(why.to_string().contains("--allow-outside"), "{why}");
    json["buffers"][0] = json!({ "uri": "data:;base64,AAECAwQ=", "byteLength": 6 });
    let why = read(json.to_string().as_bytes()).expect_err("short");
    assert!(
        why.contains("buffer 0: it has 5 bytes, expected 6"),
        "{why}"
    );
}

#[test]
fn quantised_attributes_are_decoded() {
    let mut made = Made::new(0);
    let all = known(0);
    let code = |part: f32, largest: f32| (part * largest).round();
    let rotations = all
        .iter()
        .flat_map(|(stored, _)| stored.rotation.to_array());
    let rotations = rotations.flat_map(|part| (code(part, 32_767.0) as i16).to_le_bytes());
    made.add(
        &prefixed("ROTATION"),
        "VEC4",
        (5122, true),
        rotations.collect(),
    );
    let scales = all.iter().flat_map(|(stored, _)| stored.scales.to_array());
    let scales = scales.flat_map(|part| (code(part, 65_535.0) as u16).to_le_bytes());
    made.add(&prefixed("SCALE"), "VEC3", (5123, true), scales.collect());
    let opacities = all
        .iter()
        .map(|(stored, _)| code(stored.opacity, 255.0) as u8);
    made.add(
        &prefixed("OPACITY"),
        "SCALAR",
        (5121, true),
        opacities.collect(),
    );
    let (read, notes) = read(&made.binary()).expect("a good file");
    assert!(notes.is_empty(), "{notes:?}");
    same_within(&read, &all, [1e-6, 1e-4, 1e-3, 0.002, 0.0]);
}

#[test]
fn scales_of_drafts_are_logarithms() {
    let mut made = Made::new(0);
    let scales = known(0);
    let scales = scales
        .iter()
        .flat_map(|(stored, _)| stored.scales.to_array());
    let bytes = scales.flat_map(|scale| scale.ln().to_le_bytes()).collect();
    made.add(&prefixed("SCALE"), "VEC3", (5126, false), bytes);
    let (read, notes) = read(&made.binary()).expect("a good file");
    assert!(notes[0].contains("logarithms"), "{notes:?}");
    same(&read, &known(0), 1e-5);
}

#[test]
fn nodes_turn_scale_and_shift_and_colours_turn_along() {
    let rotation = DQuat::from_xyzw(0.1, -0.5, 0.3, 0.6).normalize();
    let mut made = Made::new(3)
        .with("/nodes/0/rotation", json!(rotation.to_array()))
        .with("/nodes/0/scale", json!([2.0, 2.0, 2.0]))
        .with("/scenes/0/nodes", json!([1]));
    made.json["nodes"] =
        json!([made.json["nodes"][0], { "children": [0], "translation": [1.0, 2.0, 3.0] }]);
    let (placed, _) = read(&made.binary()).expect("a good file");
    let (plain, _) = read(&Made::new(3).binary()).expect("a good file");
    let expected = known(3).into_iter().map(|(stored, _)| Stored {
        centre: rotation * (2.0 * stored.centre) + DVec3::new(1.0, 2.0, 3.0),
        rotation: rotation.as_quat() * stored.rotation,
        scales: 2.0 * stored.scales,
        ..stored
    });
    for (index, expected) in expected.enumerate() {
        let got = placed.get(index);
        assert!((got.centre.as_dvec3() - expected.centre).length() < 1e-5);
        assert!(got.rotation.dot(expected.rotation).abs() > 1.0 - 1e-6);
        assert!((got.scales - expected.scales).abs().max_element() < 1e-5);
        for direction in [
            Vec3::X,
            Vec3::new(0.6, 0.0, -0.8),
            Vec3::new(0.48, 0.64, 0.6),
        ] {
            let before = plain.colour_towards(index, direction);
            let after = placed.colour_towards(index, rotation.as_quat() * direction);
            let off = (before - after).abs().max_element();
            assert!(off < 0.02, "{index}: {before} became {after}");
        }
    }
}

#[test]
fn uneven_scales_and_mirrors_keep_the_covariance() {
    let covariance = |rotation: Quat, scales: Vec3, node: DMat3| {
        let axes = node * DMat3::from_quat(rotation.as_dquat().normalize());
        let axes = axes * DMat3::from_diagonal(scales.as_dvec3());
        axes * axes.transpose()
    };
    for scale in [[1.0, 3.0, 0.5], [-1.0, 1.0, 1.0], [1.0, 2.0, -0.01]] {
        let made = Made::new(0).with("/nodes/0/scale", json!(scale));
        let (all, _) = read(&made.binary()).expect("a good file");
        let node = DMat3::from_diagonal(DVec3::from_array(scale));
        for (index, (stored, _)) in known(0).into_iter().enumerate() {
            let got = all.get(index);
            let expected = covariance(stored.rotation, stored.scales, node);
            let got = covariance(got.rotation, got.scales, DMat3::IDENTITY);
            assert!(
                got.abs_diff_eq(expected, 1e-5),
                "{got}, expected {expected}"
            );
        }
    }
}

#[test]
fn what_is_not_read_is_refused_with_its_reason() {
    let refused = |pointer: &str, value: Value, reason: &str| {
        let made = Made::new(1).with(pointer, value);
        let why = read(&made.binary()).expect_err(reason);
        assert!(why.contains(reason), "{why}");
    };
    let primitive = "/meshes/0/primitives/0";
    let extension = format!("{primitive}/extensions/{EXTENSION}");
    let spz = json!({ "KHR_gaussian_splatting_compression_spz_2": { "bufferView": 0 } });
    refused(&format!("{extension}/extensions"), spz, "or as SPZ or PLY");
    refused(
        "/extensionsRequired",
        json!(["EXT_meshopt_compression"]),
        "EXT_meshopt_compression",
    );
    refused(&format!("{extension}/kernel"), json!("box"), "kernel 'box'");
    refused(
        &format!("{extension}/colorSpace"),
        json!("lab"),
        "colour space 'lab'",
    );
    refused(&format!("{primitive}/mode"), json!(4), "mode 4");
    let attributes = format!("{primitive}/attributes");
    refused(&attributes, json!({ "POSITION": 0 }), "no attribute");
    refused(&format!("{attributes}/POSITION"), json!(99), "accessor 99");
    refused("/accessors/1/count", json!(2), "2 and 3 vectors");
    refused("/accessors/0/count", json!(1u64 << 60), "do not fit");
    refused("/accessors/0/type", json!("VEC2"), "type VEC2");
    refused("/accessors/0/sparse", json!({}), "sparse");
    refused(
        "/bufferViews/0/byteLength",
        json!(1_000_000),
        "buffer view 0",
    );
    refused("/nodes/0/children", json!([0]), "below itself");
    refused("/nodes/0/mesh", json!(7), "mesh 7");
    refused("/nodes/0/scale", json!([0, 1, 1]), "flattens");
    refused("/scene", json!(3), "scene 3");
    refused("/scenes/0/nodes", json!([]), "expected Gaussians");
    refused("/asset/version", json!("1.0"), "version '1.0'");
    let small = Gate::new(Outside::Refused, Some(1000));
    let dir = Dir::new();
    let path = dir.write("a", &Made::new(1).binary());
    let why = load(&path, &small, &mut Vec::new()).expect_err("too large");
    assert!(why.to_string().contains("--max-memory"), "{why}");
    assert!(load(Path::new("absent.glb"), &small, &mut Vec::new()).is_err());
    check_damage(&Made::new(1).binary(), load);
    check_damage(&Made::new(0).text(), load);
}
