//! STL: triangles without anything else, in text or binary.
//!
//! Takes the bytes of a file, gives a scene of one mesh. The crate `stl_io` reads it. Corners at one place become one
//! vertex. Normals of the file are left out: they are those of the triangles, which follow from the corners.

use std::io::Cursor;

use glam::DVec3;

use super::origin;
use crate::scene::{Material, Mesh, Scene, Sides};

/// Bytes before the triangles of a binary file: a free text and a count.
const HEADER_BYTES: usize = 84;
/// Bytes of a binary triangle.
const TRIANGLE_BYTES: u64 = 50;

/// Whether a file is STL: text that begins so, or a count of triangles that fits the length to the byte.
pub(super) fn looks_like(head: &[u8], length: u64) -> bool {
    is_binary(head, length) || is_text(head)
}

fn is_binary(bytes: &[u8], length: u64) -> bool {
    let count = bytes.get(HEADER_BYTES - 4..HEADER_BYTES);
    let count = count.and_then(|count| <[u8; 4]>::try_from(count).ok());
    count.is_some_and(|count| {
        let triangles = u64::from(u32::from_le_bytes(count));
        triangles * TRIANGLE_BYTES + HEADER_BYTES as u64 == length
    })
}

fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    let start = &start[..start.len().min(1024)];
    let has = |word: &[u8]| start.windows(word.len()).any(|part| part == word);
    start.starts_with(b"solid") && (has(b"facet") || has(b"endsolid"))
}

/// Reads a file.
pub(super) fn load(bytes: &[u8]) -> Result<Scene, String> {
    let mut source = Cursor::new(bytes);
    let read =
        stl_io::read_stl(&mut source).map_err(|error| format!("no whole STL file: {error}"))?;
    let positions = read.vertices.iter().map(|vertex| {
        let corner: [f32; 3] = (*vertex).into();
        DVec3::from(corner.map(f64::from))
    });
    let triangles = read
        .faces
        .iter()
        .map(|face| face.vertices.map(|corner| corner as u32));
    let mut scene = Scene {
        meshes: vec![Mesh {
            triangles: triangles.collect(),
            ..Mesh::default()
        }],
        materials: vec![Material {
            sides: Sides::Both,
            ..Material::default()
        }],
        ..Scene::default()
    };
    origin::place(&mut scene, &[positions.collect()]);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "solid a part\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   \
                        vertex 0 1 0\n  endloop\n endfacet\n facet normal 0 0 1\n  outer loop\n   vertex 1 0 0\n   \
                        vertex 1 1 0\n   vertex 0 1 0\n  endloop\n endfacet\nendsolid a part\n";

    fn binary() -> Vec<u8> {
        let mut bytes = b"solid is no proof of text".to_vec();
        bytes.resize(80, b' ');
        bytes.extend(2u32.to_le_bytes());
        let corners = [
            [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        ];
        for triangle in corners {
            let numbers = [[0.0, 0.0, 1.0]].into_iter().chain(triangle).flatten();
            bytes.extend(numbers.flat_map(f32::to_le_bytes));
            bytes.extend([0, 0]);
        }
        bytes
    }

    #[test]
    fn text_and_binary_give_the_same_mesh() {
        for bytes in [TEXT.as_bytes().to_vec(), binary()] {
            assert!(looks_like(&bytes, bytes.len() as u64));
            let scene = load(&bytes).expect("a good file");
            let mesh = &scene.meshes[0];
            assert_eq!(
                (mesh.positions.len(), mesh.triangles.len()),
                (4, 2),
                "shared corners"
            );
            let corner = |index: u32| mesh.positions[index as usize];
            let second = mesh.triangles[1].map(corner);
            assert_eq!(second, [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        }
    }

    #[test]
    fn files_that_are_cut_off_or_broken_are_refused() {
        let bytes = binary();
        assert!(
            !looks_like(&bytes, bytes.len() as u64 - 1),
            "a count that does not fit"
        );
        assert!(load(&bytes[..bytes.len() - 1]).is_err());
        let cut = &TEXT.as_bytes()[..TEXT.len() / 2];
        assert!(looks_like(cut, cut.len() as u64) && load(cut).is_err());
        assert!(load(TEXT.replace("1 0 0", "1 x 0").as_bytes()).is_err());
        assert!(
            !looks_like(b"solid ground\n", 13),
            "a text about something else"
        );
    }
}
