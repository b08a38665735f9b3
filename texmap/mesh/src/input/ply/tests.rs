//! PLY files of every encoding, and what is wrong with others.

use resample_io::Gate;

use super::*;
use crate::input::Unreadable;
use crate::input::files::nowhere;

const HEADER: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty float z\nproperty uchar red\n\
                      property uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\n\
                      end_header\n";

const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

fn text() -> Vec<u8> {
    let vertices: String = CORNERS
        .iter()
        .map(|[x, y]| format!("{x} {y} 0 255 128 0\n"))
        .collect();
    format!("ply\nformat ascii 1.0\ncomment made here\n{HEADER}{vertices}4 0 1 2 3\n").into_bytes()
}

fn binary(little: bool) -> Vec<u8> {
    let name = if little { "little" } else { "big" };
    let mut bytes = format!("ply\nformat binary_{name}_endian 1.0\n{HEADER}").into_bytes();
    let mut push = |value: &[u8]| {
        let mut value = value.to_vec();
        if !little {
            value.reverse();
        }
        bytes.extend(value);
    };
    for [x, y] in CORNERS {
        push(&(x as f32).to_le_bytes());
        push(&y.to_le_bytes());
        push(&0f32.to_le_bytes());
        [255u8, 128, 0].iter().for_each(|&part| push(&[part]));
    }
    push(&[4]);
    (0..4i32).for_each(|corner| push(&corner.to_le_bytes()));
    bytes
}

fn read(bytes: &[u8]) -> Result<Scene, String> {
    load(bytes, &nowhere(&Gate::default()), &mut Notes::default())
}

#[test]
fn text_and_both_binary_orders_give_the_same_square() {
    for bytes in [text(), binary(true), binary(false)] {
        assert!(looks_like(&bytes));
        let scene = read(&bytes).expect("a good file");
        let mesh = &scene.meshes[0];
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2));
        assert_eq!(mesh.positions[2], [1.0, 1.0, 0.0]);
        let [red, green, blue, alpha] = mesh.colours[0];
        assert_eq!((red, blue, alpha), (1.0, 0.0, 1.0));
        assert!(
            (green - 0.2159).abs() < 1e-3,
            "128 of sRGB is {green} in linear light"
        );
    }
}

#[test]
fn texture_coordinates_stand_at_vertices_or_at_corners_of_faces() {
    let at_vertices = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                       property float s\nproperty float t\nelement face 1\nproperty list uchar uint vertex_index\n\
                       end_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n";
    let scene = read(at_vertices.as_bytes()).expect("a good file");
    assert_eq!(
        scene.meshes[0].uvs,
        [[[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]],
        "v down"
    );
    let at_corners = "ply\nformat ascii 1.0\ncomment TextureFile a b.png\nelement vertex 3\nproperty float x\n\
                      property float y\nproperty float z\nelement face 2\nproperty list uchar int vertex_indices\n\
                      property list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n0 1 0\n\
                      3 0 1 2 6 0 0 1 0 0 1\n3 2 1 0 6 0.5 0.5 1 0 0 1\n";
    let missing = load(
        at_corners.as_bytes(),
        &nowhere(&Gate::default()),
        &mut Notes::default(),
    );
    let error = missing.expect_err("a picture that is not there");
    assert!(error.contains("a b.png"), "{error}");
    let mut notes = Notes::new(Unreadable::Noted);
    let scene = load(
        at_corners.as_bytes(),
        &nowhere(&Gate::default()),
        &mut notes,
    )
    .expect("a good file");
    let mesh = &scene.meshes[0];
    assert_eq!(
        (mesh.positions.len(), mesh.triangles.len()),
        (6, 2),
        "corners of their own"
    );
    assert_eq!(mesh.uvs[0][3], [0.5, 0.5]);
    assert!(
        notes.said[0].contains("a b.png"),
        "a picture that is not there: {:?}",
        notes.said
    );
}

#[test]
fn what_cannot_be_drawn_is_an_error() {
    let good = String::from_utf8(text()).expect("text");
    let refused = |bytes: &[u8], named: &str| {
        let said = read(bytes).expect_err(named);
        assert!(
            said.contains(named) && said.len() < 300,
            "expected '{named}': {said}"
        );
    };
    refused(
        good.replace("3\n4 0 1 2 3", "3\n4 0 1 2 9")
            .replace("0 1 2 3\n", "0 1 2 9\n")
            .as_bytes(),
        "vertex 9",
    );
    refused(
        good.replace("element vertex 4", "element vertex 400000000000")
            .as_bytes(),
        "more than the file",
    );
    refused(
        good.replace("element face 1", "element face 0").as_bytes(),
        "points and no faces",
    );
    refused(good.replace("end_header", "").as_bytes(), "");
    refused(good.replace("0 1 2 3\n", "0 1 two 3\n").as_bytes(), "face");
    let bytes = binary(true);
    refused(&bytes[..bytes.len() - 3], "face");
    let nothing = "ply\nformat binary_little_endian 1.0\nelement vertex 99999999999999\nelement face 1\nend_header\n";
    refused(nothing.as_bytes(), "more than the file");
}
