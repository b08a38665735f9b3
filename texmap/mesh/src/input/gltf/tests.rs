//! glTF on small documents made here, one feature each: containers, nodes, primitives, cameras.

use std::fmt::Write;

use resample_io::Gate;
use serde_json::{Value, json};

use super::*;
use crate::input::files::nowhere;
use crate::scene::{SceneLens, Sides};

mod compressed;
mod containers;
mod materials;
mod poses;

/// A document in the making: numbers go into its one buffer.
#[derive(Default)]
struct Maker {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

/// Corners of the unit square in the plane z = 0, counter-clockwise from the front.
const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];

const FLOAT: u32 = 5126;

impl Maker {
    fn view(&mut self, bytes: &[u8]) -> usize {
        let start = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.views
            .push(json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() }));
        self.views.len() - 1
    }

    fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.accessors.push(
            json!({ "bufferView": view, "componentType": component, "type": kind, "count": count }),
        );
        self.accessors.len() - 1
    }

    fn floats(&mut self, kind: &str, width: usize, numbers: &[f32]) -> usize {
        let bytes: Vec<u8> = numbers
            .iter()
            .flat_map(|number| number.to_le_bytes())
            .collect();
        self.accessor(kind, FLOAT, numbers.len() / width, &bytes)
    }

    fn indices(&mut self, numbers: &[u16]) -> usize {
        let bytes: Vec<u8> = numbers
            .iter()
            .flat_map(|number| number.to_le_bytes())
            .collect();
        self.accessor("SCALAR", 5123, numbers.len(), &bytes)
    }

    /// The document, with what `rest` adds or replaces.
    fn json(&self, rest: Value) -> Value {
        let mut uri = String::from("data:,");
        self.bytes
            .iter()
            .for_each(|byte| write!(uri, "%{byte:02x}").expect("text"));
        let mut document = json!({
            "asset": { "version": "2.0" },
            "buffers": [{ "byteLength": self.bytes.len(), "uri": uri }],
            "bufferViews": self.views,
            "accessors": self.accessors,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0 }],
        });
        let Value::Object(rest) = rest else {
            panic!("the rest is an object")
        };
        rest.into_iter()
            .for_each(|(key, value)| document[key] = value);
        document
    }

    fn load(&self, rest: Value) -> Result<Scene, String> {
        self.load_with(rest, &LoadOptions::default())
            .map(|(scene, _)| scene)
    }

    fn load_with(&self, rest: Value, options: &LoadOptions) -> Result<(Scene, Notes), String> {
        self.load_noting(rest, options, Notes::default())
    }

    fn load_noting(
        &self,
        rest: Value,
        options: &LoadOptions,
        mut notes: Notes,
    ) -> Result<(Scene, Notes), String> {
        let bytes = self.json(rest).to_string().into_bytes();
        load(&bytes, &nowhere(&Gate::default()), options, &mut notes).map(|scene| (scene, notes))
    }
}

/// A square of two triangles, and its mesh.
fn square(maker: &mut Maker) -> Value {
    let position = maker.floats("VEC3", 3, &SQUARE);
    let indices = maker.indices(&[0, 1, 2, 0, 2, 3]);
    json!([{ "primitives": [{ "attributes": { "POSITION": position }, "indices": indices }] }])
}

/// Twice the area of a mesh's triangles, seen along -z: positive where they face +z.
fn area_along_z(mesh: &Mesh) -> f32 {
    let at = |i: u32| glam::Vec3::from_array(mesh.positions[i as usize]);
    mesh.triangles
        .iter()
        .map(|&[a, b, c]| (at(b) - at(a)).cross(at(c) - at(a)).z)
        .sum()
}

#[test]
fn transforms_go_down_the_hierarchy() {
    // As in OrientationTest: rotation below translation below scale.
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let nodes = json!([
        { "children": [1], "scale": [2, 2, 2] },
        { "children": [2], "translation": [10, 0, 0] },
        { "mesh": 0, "rotation": [0, 0, half, half] },
    ]);
    let scene = maker
        .load(json!({ "meshes": meshes, "nodes": nodes }))
        .expect("a good file");
    // (1, 0, 0), a quarter turn to (0, 1, 0), moved and doubled.
    let [x, y, z] = scene.meshes[0].positions[1];
    assert!(
        (x - 20.0).abs() + (y - 2.0).abs() + z.abs() < 1e-5,
        "the corner lies at {:?}",
        [x, y, z]
    );
    assert!(
        area_along_z(&scene.meshes[0]) > 0.0,
        "a rotation keeps the front in front"
    );
}

#[test]
fn a_mirrored_node_keeps_its_front_and_its_normals() {
    // As in NegativeScaleTest.
    let mut maker = Maker::default();
    let position = maker.floats("VEC3", 3, &SQUARE);
    let normal = maker.floats("VEC3", 3, &[0.0, 0.0, 2.0].repeat(4));
    let indices = maker.indices(&[0, 1, 2, 0, 2, 3]);
    let attributes = json!({ "POSITION": position, "NORMAL": normal });
    let meshes = json!([{ "primitives": [{ "attributes": attributes, "indices": indices }] }]);
    for (scale, front) in [
        ([-1, 1, 1], 1.0),
        ([1, 1, -1], -1.0),
        ([-1, -1, 1], 1.0),
        ([-1, -1, -1], -1.0),
    ] {
        let nodes = json!([{ "mesh": 0, "scale": scale }]);
        let scene = maker
            .load(json!({ "meshes": meshes, "nodes": nodes }))
            .expect("a good file");
        let mesh = &scene.meshes[0];
        assert!(
            area_along_z(mesh) * front > 0.0,
            "{scale:?}: the front looks the other way"
        );
        assert_eq!(
            mesh.normals[0],
            [0.0, 0.0, front],
            "{scale:?}: the normal goes with the front, length 1"
        );
    }
}

#[test]
fn strips_and_fans_become_lists_and_lines_are_left_out() {
    let mut maker = Maker::default();
    let position = maker.floats("VEC3", 3, &SQUARE);
    let strip = maker.indices(&[0, 1, 3, 2]);
    let primitive = |mode: u32, indices: Value| json!([{ "primitives": [{ "attributes": { "POSITION": position }, "mode": mode, "indices": indices }] }]);
    for (mode, indices) in [(4, Value::Null), (5, json!(strip)), (6, Value::Null)] {
        let scene = maker
            .load(json!({ "meshes": primitive(mode, indices) }))
            .expect("a good file");
        let area = area_along_z(&scene.meshes[0]);
        // A list of four corners is one triangle, half of the square.
        let expected = if mode == 4 { 1.0 } else { 2.0 };
        assert!(
            (area - expected).abs() < 1e-6,
            "mode {mode}: twice the area is {area}, expected {expected}"
        );
    }
    let (scene, notes) = maker
        .load_with(
            json!({ "meshes": primitive(1, Value::Null) }),
            &LoadOptions::default(),
        )
        .expect("lines are no error");
    assert!(
        scene.meshes.is_empty() && notes.said.len() == 1,
        "lines are left out, and that is said"
    );
}

#[test]
fn scenes_are_chosen_by_name_or_number() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let rest = json!({
        "meshes": meshes,
        "scenes": [{ "nodes": [0], "name": "near" }, { "nodes": [1], "name": "far" }],
        "scene": 1,
        "nodes": [{ "mesh": 0 }, { "mesh": 0, "translation": [0, 0, -9] }],
    });
    let z = |choice: Option<&str>| {
        let scene = choice.map(|word| super::super::SceneChoice(word.to_owned()));
        let loaded = maker.load_with(
            rest.clone(),
            &LoadOptions {
                scene,
                ..LoadOptions::default()
            },
        );
        loaded.map(|(scene, _)| (scene.meshes.len(), scene.meshes[0].positions[0][2]))
    };
    assert_eq!(z(None), Ok((1, -9.0)), "the file's own");
    assert_eq!(
        (z(Some("near")), z(Some("0"))),
        (Ok((1, 0.0)), Ok((1, 0.0))),
        "by name and by number"
    );
    assert!(
        z(Some("2")).is_err_and(|e| e.contains("0 (near), 1 (far)")),
        "an unknown one lists those there are"
    );
}

#[test]
fn cycles_and_shared_children_are_errors() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let load = |nodes: Value| maker.load(json!({ "meshes": meshes, "nodes": nodes }));
    let cycle = load(json!([{ "children": [1] }, { "children": [0], "mesh": 0 }]));
    assert!(
        cycle.is_err_and(|e| e.contains("cycle")),
        "two nodes below each other"
    );
    let shared = load(json!([{ "children": [1, 2] }, { "children": [2] }, { "mesh": 0 }]));
    assert!(
        shared.is_err_and(|e| e.contains("child of both")),
        "a node with two parents"
    );
    assert!(
        load(json!([{ "children": [7] }])).is_err_and(|e| e.contains("child 7")),
        "a child that is not there"
    );
}

#[test]
fn skins_and_morph_targets_stand_in_their_rest_pose() {
    // As in SimpleSkin and SimpleMorph.
    let mut maker = Maker::default();
    let position = maker.floats("VEC3", 3, &SQUARE);
    let moved = maker.floats("VEC3", 3, &[0.0, 0.0, 4.0].repeat(4));
    let joints = maker.accessor("VEC4", 5121, 4, &[1, 0, 0, 0].repeat(4));
    let weights = maker.floats("VEC4", 4, &[0.5, 0.5, 0.0, 0.0].repeat(4));
    let bind: Vec<f32> = [[0.0f32; 3], [0.0, -1.0, 0.0]]
        .iter()
        .flat_map(|t| glam::Mat4::from_translation(glam::Vec3::from_array(*t)).to_cols_array())
        .collect();
    let bind = maker.floats("MAT4", 16, &bind);
    let attributes = json!({ "POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights });
    let primitive = json!({ "attributes": attributes, "targets": [{ "POSITION": moved }] });
    let rest = json!({
        "meshes": [{ "primitives": [primitive], "weights": [0.25] }],
        "nodes": [
            { "mesh": 0, "skin": 0, "translation": [100, 0, 0] },
            { "translation": [0, 0, 10] },
            { "translation": [0, 3, 0] },
        ],
        "scenes": [{ "nodes": [0, 1, 2] }],
        "skins": [{ "joints": [1, 2], "inverseBindMatrices": bind }],
    });
    let scene = maker.load(rest).expect("a good file");
    // Half of joint 0, 10 along z, and half of joint 1, 3 - 1 along y; the target adds 1 along z. The node does not
    // count.
    assert_eq!(
        scene.meshes[0].positions[1],
        [1.0, 1.0, 6.0],
        "joints and weights"
    );
}

#[test]
fn cameras_stand_where_their_nodes_do_without_scale() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let rest = json!({
        "meshes": meshes,
        "nodes": [
            { "mesh": 0 },
            { "camera": 0, "name": "eye", "translation": [0, 0, 5], "scale": [3, 2, 7] },
            { "camera": 1 },
            { "camera": 2 },
        ],
        "scenes": [{ "nodes": [0, 1, 2, 3] }],
        "cameras": [
            { "type": "perspective", "perspective": { "yfov": 0.8, "aspectRatio": 1.5, "znear": 0.1 } },
            { "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 1, "znear": 0, "zfar": 9 } },
            { "type": "perspective", "perspective": { "yfov": 0, "znear": 0.1 } },
        ],
    });
    let (scene, notes) = maker
        .load_with(rest, &LoadOptions::default())
        .expect("a good file");
    let [eye, flat] = &scene.cameras[..] else {
        panic!("two cameras, not {}", scene.cameras.len())
    };
    assert_eq!(eye.name, "eye", "the node's name");
    assert_eq!(
        eye.world_from_camera.translation,
        DVec3::new(0.0, 0.0, 5.0),
        "its place"
    );
    assert!(
        (eye.world_from_camera.matrix3 - glam::DMat3::IDENTITY)
            .x_axis
            .length()
            < 1e-12,
        "no scale"
    );
    let SceneLens::Perspective {
        fov_y_rad,
        aspect: Some(aspect),
    } = eye.lens
    else {
        panic!("perspective")
    };
    assert!(
        (fov_y_rad - 0.8).abs() < 1e-6 && (aspect - 1.5).abs() < 1e-6,
        "opening {fov_y_rad}, {aspect}"
    );
    assert_eq!(
        flat.lens,
        SceneLens::Orthographic {
            size: glam::DVec2::new(4.0, 2.0)
        },
        "twice the file's halves"
    );
    assert_eq!(
        notes.said.len(),
        1,
        "a camera without opening is left out and told: {:?}",
        notes.said
    );
}
