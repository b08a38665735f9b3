//! STL: triangles without anything else, in text or binary.
//!
//! Takes the bytes of a file, gives a scene of one mesh. The crate `stl_io` reads it; text is written out plainly for it first, since
//! programs write `SOLID`, tabs, no name, several solids or no end. Corners at one place become one vertex. Normals of
//! the file are left out: they are those of the triangles, which follow from the corners.

use std::io::Cursor;

use glam::{DVec3, Vec3};

use crate::input::files::text_of;
use crate::input::finish;
use crate::input::options::Notes;
use crate::scene::{Material, Mesh, Scene, Sides};

/// Bytes before the triangles of a binary file: a free text and a count.
const HEADER_BYTES: usize = 84;
/// Bytes of a binary triangle.
const TRIANGLE_BYTES: usize = 50;

/// Returns true if a file is STL: text that begins so, or a count of triangles that fits the length to the byte, or the beginning of
/// it and what triangles look like.
pub(super) fn looks_like(head: &[u8], length: u64) -> bool {
    is_binary(head, length) || is_text(head) || has_triangles(head, length)
}

/// The bytes that the count of triangles of a binary file asks for.
fn claimed(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(HEADER_BYTES - 4..HEADER_BYTES)?;
    let triangles = u32::from_le_bytes(<[u8; 4]>::try_from(count).ok()?);
    Some(u64::from(triangles) * TRIANGLE_BYTES as u64 + HEADER_BYTES as u64)
}

fn is_binary(bytes: &[u8], length: u64) -> bool {
    claimed(bytes) == Some(length)
}

/// Returns true if the file is longer than its count says, and begins with triangles: finite numbers, normals of length 0 or 1, and
/// a corner away from the first.
fn has_triangles(head: &[u8], length: u64) -> bool {
    let Some(claimed) = claimed(head).filter(|&claimed| claimed < length) else {
        return false;
    };
    let end = head.len().min(claimed as usize);
    let mut triangles = head[HEADER_BYTES..end]
        .chunks_exact(TRIANGLE_BYTES)
        .peekable();
    let looks_so = |triangle: &[u8]| {
        let number = |at: usize| f32::from_le_bytes([0, 1, 2, 3].map(|k| triangle[4 * at + k]));
        let vector = |at: usize| Vec3::new(number(at), number(at + 1), number(at + 2));
        let [normal, a, b, c] = [0, 3, 6, 9].map(vector);
        let long = normal.length();
        // Normals of few digits are off by less.
        let is_normal = long == 0.0 || (long - 1.0).abs() < 0.1;
        let is_finite = [a, b, c].iter().all(|corner| corner.is_finite());
        is_normal && is_finite && (a != b || b != c)
    };
    triangles.peek().is_some() && triangles.all(looks_so)
}

fn is_text(bytes: &[u8]) -> bool {
    let start = text_of(bytes);
    let start = start[..start.len().min(1024)].to_ascii_lowercase();
    let has = |word: &[u8]| start.windows(word.len()).any(|part| part == word);
    let is_named = start
        .strip_prefix(b"solid")
        .is_some_and(|rest| rest.first().is_none_or(u8::is_ascii_whitespace));
    is_named && (has(b"facet") || has(b"endsolid"))
}

/// The text as the crate takes it: one solid, small letters, no normals, an end. Some programs write no end; where the last line
/// has begun, the file is cut.
fn plain_text(bytes: &[u8], notes: &mut Notes) -> Vec<u8> {
    let mut is_ended = false;
    let mut plain = b"solid \n".to_vec();
    for line in text_of(bytes).split(|&byte| byte == b'\n') {
        let line = line.trim_ascii().to_ascii_lowercase();
        let word = line.split(u8::is_ascii_whitespace).next().unwrap_or(&[]);
        match word {
            b"endsolid" => is_ended = true,
            b"" | b"solid" => {}
            b"facet" => plain.extend(b"facet normal 0 0 0\n"),
            _ => {
                plain.extend(&line);
                plain.push(b'\n');
            }
        }
    }
    let is_cut = text_of(bytes).ends_with(b" ") || text_of(bytes).ends_with(b"\t");
    if is_ended || !is_cut {
        plain.extend(b"endsolid\n");
    }
    if !is_ended {
        notes.say("the file has no 'endsolid': its end may be missing".to_owned());
    }
    plain
}

/// Reads a file.
pub(super) fn load(bytes: &[u8], notes: &mut Notes) -> Result<Scene, String> {
    let length = bytes.len() as u64;
    let text = match is_text(bytes) && !is_binary(bytes, length) {
        true => Some(plain_text(bytes, notes)),
        false => None,
    };
    let after = claimed(bytes).filter(|&claimed| text.is_none() && claimed < length);
    if let Some(claimed) = after {
        notes.say(format!(
            "{} bytes after the last triangle are left out",
            length - claimed
        ));
    }
    let mut source = Cursor::new(text.as_deref().unwrap_or(bytes));
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
    finish::set_origin(&mut scene, &[positions.collect()]);
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
            let scene = load(&bytes, &mut Notes::default()).expect("a good file");
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
    fn text_is_read_as_programs_write_it() {
        let (name, end) = ("solid a part\n", "endsolid a part\n");
        let two = format!("{TEXT}{}", TEXT.replace("vertex 0 0 0", "vertex 0 0 5"));
        for (written, triangles) in [
            (TEXT.replace(name, "solid\n"), 2),
            (TEXT.replace(name, "solid\t\n"), 2),
            (TEXT.to_uppercase(), 2),
            (TEXT.replace(' ', "\t"), 2),
            (format!("  \r\n\t{}", TEXT.replace('\n', "\r\n")), 2),
            (TEXT.replace(end, ""), 2),
            (format!("\u{feff}{TEXT}"), 2),
            (TEXT.replace("normal 0 0 1", "normal nan nan nan"), 2),
            (two, 4),
        ] {
            let bytes = written.as_bytes();
            assert!(looks_like(bytes, bytes.len() as u64), "{written:?}");
            let scene = load(bytes, &mut Notes::default()).expect("a good file");
            assert_eq!(scene.meshes[0].triangles.len(), triangles, "{written:?}");
        }
        let latin = [b"solid St\xfcck\n", &TEXT.as_bytes()[name.len()..]].concat();
        assert!(load(&latin, &mut Notes::default()).is_ok(), "Latin-1");
    }

    #[test]
    fn bytes_after_the_triangles_are_left_out_with_a_note() {
        for after in [vec![0; 17], b"COLOR=....".to_vec(), vec![0xff; 4000]] {
            let bytes = [binary(), after.clone()].concat();
            assert!(looks_like(&bytes, bytes.len() as u64));
            let mut notes = Notes::default();
            let scene = load(&bytes, &mut notes).expect("a good file");
            assert_eq!(scene.meshes[0].triangles.len(), 2);
            let said = format!("{} bytes after", after.len());
            assert!(notes.said[0].contains(&said), "{:?}", notes.said);
        }
        let mut other = vec![0; 4096];
        other[80] = 3;
        assert!(!looks_like(&other, 4096), "no triangles");
        other[84..].fill(0x5a);
        assert!(!looks_like(&other, 4096), "normals of no length");
    }

    #[test]
    fn files_that_are_cut_off_or_broken_are_refused() {
        let bytes = binary();
        assert!(
            !looks_like(&bytes, bytes.len() as u64 - 1),
            "a count that does not fit"
        );
        let refused = |bytes: &[u8]| load(bytes, &mut Notes::default()).is_err();
        assert!(refused(&bytes[..bytes.len() - 1]));
        let cut = &TEXT.as_bytes()[..TEXT.len() / 2];
        assert!(looks_like(cut, cut.len() as u64) && refused(cut));
        assert!(refused(TEXT.replace("1 0 0", "1 x 0").as_bytes()));
        assert!(
            !looks_like(b"solid ground\n", 13),
            "a text about something else"
        );
    }
}
