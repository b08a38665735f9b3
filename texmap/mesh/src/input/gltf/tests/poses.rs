//! The pose of a scene: instances, nodes far from the origin, and animations at a moment.

use glam::DVec3;
use serde_json::{Value, json};

use super::{Maker, area_along_z, square};
use crate::input::{LoadOptions, Pose};
use crate::scene::Mesh;

fn at(time_s: f64, animation: Option<&str>) -> LoadOptions {
    LoadOptions {
        pose: Some(Pose {
            time_s,
            animation: animation.map(str::to_owned),
        }),
        ..LoadOptions::default()
    }
}

/// A square whose node is animated by one sampler; `keys` are its times.
struct Animated {
    maker: Maker,
    rest: Value,
}

impl Animated {
    fn new(path: &str, interpolation: &str, shape: &str, width: usize, values: &[f32]) -> Self {
        let mut maker = Maker::default();
        let meshes = square(&mut maker);
        let input = maker.floats("SCALAR", 1, &[1.0, 3.0]);
        let output = maker.floats(shape, width, values);
        let sampler = json!({ "input": input, "output": output, "interpolation": interpolation });
        let channel = json!({ "sampler": 0, "target": { "node": 0, "path": path } });
        let still = json!({ "name": "still", "samplers": [], "channels": [] });
        let moves = json!({ "name": "moves", "samplers": [sampler], "channels": [channel] });
        let rest =
            json!({ "meshes": meshes, "nodes": [{ "mesh": 0 }], "animations": [moves, still] });
        Self { maker, rest }
    }

    fn mesh(&self, time_s: f64) -> Mesh {
        let loaded = self.maker.load_with(self.rest.clone(), &at(time_s, None));
        let (scene, notes) = loaded.expect("a good file");
        assert!(notes.said.is_empty(), "{:?}", notes.said);
        scene.meshes[0].clone()
    }
}

fn close(found: [f32; 3], expected: [f32; 3]) -> bool {
    found
        .iter()
        .zip(expected)
        .all(|(a, b)| (a - b).abs() < 1e-6)
}

#[test]
fn a_node_moves_from_key_to_key_and_stands_before_and_behind() {
    let values = [0.0, 0.0, 0.0, 4.0, 2.0, 0.0];
    let linear = Animated::new("translation", "LINEAR", "VEC3", 3, &values);
    for (time_s, along) in [(0.0, 0.0), (1.0, 0.0), (1.5, 0.25), (3.0, 1.0), (9.0, 1.0)] {
        let corner = linear.mesh(time_s).positions[0];
        assert!(
            close(corner, [4.0 * along, 2.0 * along, 0.0]),
            "{time_s} s: {corner:?}"
        );
    }
    let step = Animated::new("translation", "STEP", "VEC3", 3, &values);
    assert!(
        close(step.mesh(2.9).positions[0], [0.0; 3]),
        "until the next key"
    );
    assert!(
        close(step.mesh(3.0).positions[0], [4.0, 2.0, 0.0]),
        "at the next key"
    );
}

#[test]
fn splines_have_tangents_in_units_a_second() {
    // Values 0 and 1, tangents 0.5 a second behind the first key and before the second: a straight line.
    let zero = [0.0; 3];
    let keys = [
        zero,
        zero,
        [0.5, 0.0, 0.0],
        [0.5, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        zero,
    ];
    let spline = Animated::new("translation", "CUBICSPLINE", "VEC3", 3, keys.as_flattened());
    for time_s in [1.0, 1.3, 2.0, 2.9, 3.0] {
        let corner = spline.mesh(time_s).positions[0];
        let expected = (time_s - 1.0) as f32 / 2.0;
        assert!(
            close(corner, [expected, 0.0, 0.0]),
            "{time_s} s: {corner:?}"
        );
    }
}

#[test]
fn turns_go_along_the_shorter_arc() {
    let half = std::f32::consts::FRAC_PI_4;
    // A quarter turn about z, the second key with the other sign of the same rotation.
    let values = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -half.sin(), -half.cos()];
    let turned = Animated::new("rotation", "LINEAR", "VEC4", 4, &values).mesh(2.0);
    let (sin, cos) = half.sin_cos();
    // The square's second corner is at x = 1: after an eighth turn it is on the diagonal.
    let corner = turned.positions[1];
    let expected = [cos * 1.0, sin * 1.0, 0.0];
    assert!(
        close(corner, expected),
        "{corner:?} instead of {expected:?}"
    );
}

#[test]
fn an_animation_is_chosen_by_name_or_number_and_its_absence_is_told() {
    let values = [0.0, 0.0, 0.0, 4.0, 2.0, 0.0];
    let file = Animated::new("translation", "LINEAR", "VEC3", 3, &values);
    let x = |name: Option<&str>| {
        let loaded = file.maker.load_with(file.rest.clone(), &at(3.0, name));
        loaded.map(|(scene, _)| scene.meshes[0].positions[0][0])
    };
    assert_eq!(
        (x(None), x(Some("moves")), x(Some("0"))),
        (Ok(4.0), Ok(4.0), Ok(4.0))
    );
    assert_eq!((x(Some("still")), x(Some("1"))), (Ok(0.0), Ok(0.0)));
    let said = x(Some("runs")).expect_err("absent");
    assert!(said.contains("0 (moves), 1 (still)"), "{said}");
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let none = maker.load_with(json!({ "meshes": meshes }), &at(0.0, None));
    assert!(none.is_err_and(|what| what.contains("no animations")));
}

#[test]
fn keys_that_do_not_fit_are_errors() {
    let mut short = Animated::new("translation", "CUBICSPLINE", "VEC3", 3, &[0.0; 6]);
    let load = |file: &Animated| file.maker.load_with(file.rest.clone(), &at(2.0, None));
    assert!(load(&short).is_err_and(|what| what.contains("expected 6")));
    short.rest["animations"][0]["channels"][0]["sampler"] = json!(7);
    assert!(load(&short).is_err_and(|what| what.contains("sampler does not exist")));
    short.rest["animations"][0]["channels"][0] =
        json!({ "sampler": 0, "target": { "node": 9, "path": "scale" } });
    assert!(load(&short).is_err_and(|what| what.contains("node 9")));
}

#[test]
fn each_instance_of_a_mesh_is_drawn() {
    let mut maker = Maker::default();
    let meshes = square(&mut maker);
    let translations = maker.floats("VEC3", 3, &[0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, -2.0]);
    let scales = maker.floats("VEC3", 3, &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0]);
    let nodes = |scale: usize| {
        let attributes = json!({ "TRANSLATION": translations, "SCALE": scale });
        let extension = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
        json!([{ "mesh": 0, "translation": [0, 10, 0], "extensions": extension }])
    };
    let name = ["EXT_mesh_gpu_instancing"];
    let rest = json!({ "meshes": meshes, "nodes": nodes(scales), "extensionsRequired": name });
    let scene = maker.load(rest).expect("a good file");
    assert_eq!(scene.meshes.len(), 3, "one of many is not enough");
    let at = |mesh: usize| scene.meshes[mesh].positions[2];
    assert_eq!(
        [at(0), at(1), at(2)],
        [[1.0, 11.0, 0.0], [5.0, 12.0, 0.0], [1.0, 11.0, -2.0]]
    );
    let uneven = maker.floats("VEC3", 3, &[1.0; 6]);
    let rest = json!({ "meshes": meshes, "nodes": nodes(uneven) });
    assert!(
        maker
            .load(rest)
            .is_err_and(|e| e.contains("different counts"))
    );
}

#[test]
fn nodes_far_from_the_origin_keep_their_shape() {
    for offset in [1e5, 1e6, 1e7, 1e9] {
        let mut maker = Maker::default();
        let meshes = square(&mut maker);
        // No f32 holds a quarter at 1e7.
        let nodes = json!([{ "mesh": 0, "translation": [offset + 0.25, -offset, 0.0] }]);
        let scene = maker
            .load(json!({ "meshes": meshes, "nodes": nodes }))
            .expect("a good file");
        let world = |corner: usize| {
            let position = scene.meshes[0].positions[corner].map(f64::from);
            scene.origin_in_world + DVec3::from_array(position)
        };
        let expected = DVec3::new(offset + 1.25, 1.0 - offset, 0.0);
        assert!(
            (world(2) - expected).length() < 1e-6,
            "{offset}: {}",
            world(2)
        );
        assert!(
            (area_along_z(&scene.meshes[0]) - 2.0).abs() < 1e-6,
            "{offset}: its shape"
        );
    }
}
