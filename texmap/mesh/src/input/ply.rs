//! PLY: vertices and polygons, in text or binary, with normals, colours and texture coordinates.
//!
//! Takes the bytes of a file, gives a scene of one mesh. The crate `ply-rs-bw` reads it; every count of the header is
//! checked against the bytes of the file first. Colours are sRGB, as every program writes them. Texture coordinates stand
//! at the vertices (`s`, `t` or `u`, `v`) or at the corners of faces (`texcoord`), v upwards; `comment TextureFile NAME`
//! names the picture, as MeshLab does. Source: the format's description by G. Turk, 1994. Limits: point clouds and
//! triangle strips are not drawn.

use glam::DVec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};
use resample_core::image::linear_from_srgb;

use crate::input::files::{self, Names, excerpt};
use crate::input::finish;
use crate::input::options::Notes;
use crate::input::pictures::load_picture;
use crate::scene::{Material, Mesh, Scene, Sides};

/// Returns true if a file starts as PLY does.
pub(super) fn looks_like(bytes: &[u8]) -> bool {
    bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r")
}

/// Reads a file; the picture that it names is looked for by `names`.
pub(super) fn load(bytes: &[u8], names: &Names, notes: &mut Notes) -> Result<Scene, String> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Vertex>::new()
        .read_header(&mut reader)
        .map_err(|error| format!("no whole PLY file: {}", short(&error)))?;
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for element in header.elements.values() {
        check_count(element, &header, bytes.len() as u64)?;
        match element.name.as_str() {
            "vertex" => vertices = payload(&mut reader, element, &header)?,
            "face" => faces = payload(&mut reader, element, &header)?,
            _ => drop(payload::<Other>(&mut reader, element, &header)?),
        }
    }
    if faces.is_empty() && !vertices.is_empty() {
        return Err("holds points and no faces: resample points draws them".into());
    }
    let (mesh, positions) = Builder::new(&header, &vertices).mesh(&faces)?;
    let mut scene = Scene {
        meshes: vec![mesh],
        // Scans are not closed, and programs disagree on which side of a face is its front.
        materials: vec![Material {
            sides: Sides::Both,
            ..Material::default()
        }],
        ..Scene::default()
    };
    finish::set_origin(&mut scene, &[positions]);
    if let Some(name) = texture_name(&header) {
        bind(&mut scene, name, names, notes)?;
    }
    Ok(scene)
}

fn payload<E: PropertyAccess>(
    reader: &mut Reader<&[u8]>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, String> {
    let read = Parser::<E>::new().read_payload_for_element(reader, element, header);
    read.map_err(|error| format!("element '{}': {}", excerpt(&element.name), short(&error)))
}

/// The first line of an error of the crate, which quotes the file at length.
fn short(error: &impl std::fmt::Display) -> String {
    let text = error.to_string();
    excerpt(text.lines().next().unwrap_or_default())
}

/// A count must not exceed what the file's bytes can hold: an element of text takes a line.
fn check_count(element: &ElementDef, header: &Header, bytes: u64) -> Result<(), String> {
    let least_of = |scalar: &ScalarType| match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let least: u64 = match header.encoding {
        Encoding::Ascii => 1,
        _ => (element.properties.values())
            .map(|property| match &property.data_type {
                PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => least_of(scalar),
            })
            .sum(),
    };
    if (element.count as u64).saturating_mul(least.max(1)) > bytes {
        return Err(format!(
            "its header claims {} elements '{}', more than the file's {bytes} bytes can hold",
            element.count,
            excerpt(&element.name)
        ));
    }
    Ok(())
}

/// The picture that a comment names.
fn texture_name(header: &Header) -> Option<&str> {
    let named = |comment: &'_ String| -> Option<usize> {
        let word = comment.split_whitespace().next()?;
        word.eq_ignore_ascii_case("texturefile")
            .then_some(word.len())
    };
    header.comments.iter().find_map(|comment| {
        let length = named(comment)?;
        let name = comment.trim_start().get(length..)?.trim();
        (!name.is_empty()).then_some(name)
    })
}

fn bind(scene: &mut Scene, name: &str, names: &Names, notes: &mut Notes) -> Result<(), String> {
    let left_out = |what: &str| format!("the texture '{}' is left out: {what}", excerpt(name));
    let picture = files::resolve(names, name)
        .and_then(|path| load_picture(&path, names.gate).map_err(|error| error.to_string()));
    match picture.map(|picture| finish::bind_texture(scene, picture)) {
        Ok(Ok(())) => {}
        Ok(Err(what)) => notes.say(left_out(&what)),
        Err(what) => {
            let what = format!("the texture '{}': {what}", excerpt(name));
            notes.unreadable(&what, "surfaces are plain")?;
        }
    }
    Ok(())
}

/// One vertex as it is stored; colours as parts of their largest value.
#[derive(Clone, Copy, Debug, Default)]
struct Vertex {
    position: [f64; 3],
    normal: [f64; 3],
    uv: [f64; 2],
    colour: [f64; 4],
}

impl Vertex {
    fn set(&mut self, name: &str, value: f64, largest: f64) -> PropertyAccessResult {
        let part = value / largest;
        match name {
            "x" => self.position[0] = value,
            "y" => self.position[1] = value,
            "z" => self.position[2] = value,
            "nx" => self.normal[0] = value,
            "ny" => self.normal[1] = value,
            "nz" => self.normal[2] = value,
            "s" | "u" | "texture_u" => self.uv[0] = value,
            "t" | "v" | "texture_v" => self.uv[1] = value,
            "red" | "r" | "diffuse_red" => self.colour[0] = part,
            "green" | "g" | "diffuse_green" => self.colour[1] = part,
            "blue" | "b" | "diffuse_blue" => self.colour[2] = part,
            "alpha" | "a" => self.colour[3] = part,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self {
            colour: [1.0; 4],
            ..Self::default()
        }
    }
    fn set_char(&mut self, name: &str, value: i8) -> PropertyAccessResult {
        self.set(name, value.into(), 127.0)
    }
    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        self.set(name, value.into(), 255.0)
    }
    fn set_short(&mut self, name: &str, value: i16) -> PropertyAccessResult {
        self.set(name, value.into(), 32_767.0)
    }
    fn set_ushort(&mut self, name: &str, value: u16) -> PropertyAccessResult {
        self.set(name, value.into(), 65_535.0)
    }
    fn set_int(&mut self, name: &str, value: i32) -> PropertyAccessResult {
        self.set(name, value.into(), 255.0)
    }
    fn set_uint(&mut self, name: &str, value: u32) -> PropertyAccessResult {
        self.set(name, value.into(), 255.0)
    }
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value.into(), 1.0)
    }
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value, 1.0)
    }
}

/// One face: its corners, and perhaps a texture coordinate for each.
#[derive(Clone, Debug, Default)]
struct Face {
    corners: Vec<u32>,
    uvs: Vec<f64>,
}

impl Face {
    fn set<T: Copy>(
        &mut self,
        name: &str,
        values: &[T],
        number: impl Fn(T) -> f64,
    ) -> PropertyAccessResult {
        match name {
            "vertex_indices" | "vertex_index" => {
                // A negative number is out of range like one that is too large.
                let index = |value: &T| {
                    let value = number(*value);
                    if value >= 0.0 { value as u32 } else { u32::MAX }
                };
                self.corners = values.iter().map(index).collect();
            }
            "texcoord" => self.uvs = values.iter().map(|&value| number(value)).collect(),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }
    fn set_list_char(&mut self, name: &str, values: Vec<i8>) -> PropertyAccessResult {
        self.set(name, &values, f64::from)
    }
    fn set_list_uchar(&mut self, name: &str, values: Vec<u8>) -> PropertyAccessResult {
        self.set(name, &values, f64::from)
    }
    fn set_list_short(&mut self, name: &str, values: Vec<i16>) -> PropertyAccessResult {
        self.set(name, &values, f64::from)
    }
    fn set_list_ushort(&mut self, name: &str, values: Vec<u16>) -> PropertyAccessResult {
        self.set(name, &values, f64::from)
    }
    fn set_list_int(&mut self, name: &str, values: Vec<i32>) -> PropertyAccessResult {
        self.set(name, &values, f64::from)
    }
    fn set_list_uint(&mut self, name: &str, values: Vec<u32>) -> PropertyAccessResult {
        self.set(name, &values, f64::from)
    }
    fn set_list_float(&mut self, name: &str, values: Vec<f32>) -> PropertyAccessResult {
        self.set(name, &values, f64::from)
    }
    fn set_list_double(&mut self, name: &str, values: Vec<f64>) -> PropertyAccessResult {
        self.set(name, &values, |value| value)
    }
}

/// An element that is passed over.
struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Self
    }
}

/// Puts vertices and faces together.
struct Builder<'a> {
    vertices: &'a [Vertex],
    has_normals: bool,
    has_colours: bool,
    has_uvs: bool,
}

impl<'a> Builder<'a> {
    fn new(header: &Header, vertices: &'a [Vertex]) -> Self {
        let properties = header
            .elements
            .get("vertex")
            .map(|vertex| &vertex.properties);
        let has = |names: &[&str]| {
            properties.is_some_and(|held| names.iter().any(|name| held.contains_key(*name)))
        };
        Self {
            vertices,
            has_normals: has(&["nx"]),
            has_colours: has(&["red", "r", "diffuse_red"]),
            has_uvs: has(&["s", "u", "texture_u"]),
        }
    }

    /// The mesh and its positions in the world. Corners with coordinates of their own become vertices of their own.
    fn mesh(&self, faces: &[Face]) -> Result<(Mesh, Vec<DVec3>), String> {
        let has_corner_uvs = faces.iter().any(|face| !face.uvs.is_empty());
        let mut mesh = Mesh::default();
        let mut uvs = Vec::new();
        let mut positions = Vec::new();
        if !has_corner_uvs {
            for vertex in self.vertices {
                self.push(vertex, &mut mesh, &mut positions);
                uvs.push(vertex.uv);
            }
        }
        for (number, face) in faces
            .iter()
            .enumerate()
            .filter(|(_, face)| face.corners.len() > 2)
        {
            let corners = self
                .corners(face)
                .map_err(|what| format!("face {number}: {what}"))?;
            let shape: Vec<DVec3> = corners
                .iter()
                .map(|vertex| vertex.position.into())
                .collect();
            let first = positions.len() as u32;
            if has_corner_uvs {
                if face.uvs.len() != 2 * corners.len() {
                    return Err(format!(
                        "face {number}: {} texture coordinates for {} corners",
                        face.uvs.len(),
                        corners.len()
                    ));
                }
                for (vertex, uv) in corners.iter().zip(face.uvs.chunks(2)) {
                    self.push(vertex, &mut mesh, &mut positions);
                    uvs.push([uv[0], uv[1]]);
                }
            }
            let place = |corner: usize| {
                if has_corner_uvs {
                    first + corner as u32
                } else {
                    face.corners[corner]
                }
            };
            finish::check(shape.len())?;
            let triangles = finish::triangles(&shape);
            mesh.triangles
                .extend(triangles.into_iter().map(|triangle| triangle.map(place)));
        }
        if has_corner_uvs || self.has_uvs {
            // v counts upwards in the file.
            let down = |[u, v]: [f64; 2]| [u as f32, (1.0 - v) as f32];
            mesh.uvs = vec![uvs.into_iter().map(down).collect()];
        }
        Ok((mesh, positions))
    }

    fn corners(&self, face: &Face) -> Result<Vec<Vertex>, String> {
        let vertex = |&index: &u32| {
            let vertex = self.vertices.get(index as usize).copied();
            vertex
                .ok_or_else(|| format!("vertex {index} of {} does not exist", self.vertices.len()))
        };
        face.corners.iter().map(vertex).collect()
    }

    fn push(&self, vertex: &Vertex, mesh: &mut Mesh, positions: &mut Vec<DVec3>) {
        positions.push(vertex.position.into());
        if self.has_normals {
            let normal = DVec3::from(vertex.normal).normalize_or_zero();
            mesh.normals.push(normal.as_vec3().to_array());
        }
        if self.has_colours {
            let [red, green, blue, alpha] = vertex.colour.map(|part| part.clamp(0.0, 1.0) as f32);
            let linear = [red, green, blue].map(linear_from_srgb);
            mesh.colours.push([linear[0], linear[1], linear[2], alpha]);
        }
    }
}

#[cfg(test)]
mod tests {
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
        format!("ply\nformat ascii 1.0\ncomment made here\n{HEADER}{vertices}4 0 1 2 3\n")
            .into_bytes()
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
}
