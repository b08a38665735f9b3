//! Where meshes stand: instances, and nodes far from the origin.

use glam::DVec3;
use serde_json::json;

use super::{Maker, area_along_z, square};

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
