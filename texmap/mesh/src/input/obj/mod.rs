//! OBJ: positions, texture coordinates, normals and polygons, with materials from MTL files.
//!
//! Takes the bytes of a file, gives a scene. Each line is read on its own, so that an error can name it; a polygon of any
//! shape becomes triangles (`finish`), and corners that agree in all their indices become one vertex. v counts from
//! the bottom of the picture here and from its top afterwards. The crate `tobj` is not used, because it shifts texture
//! coordinates where only some corners have them, and cannot name the line of an error; tests compare with it.
//! Source: the Wavefront format as the programs of today write it. Limits: no curves, no lines and points.

mod lines;
mod map;
mod mtl;

use std::collections::HashMap;

use glam::DVec3;

use super::files::{Names, excerpt};
use crate::input::finish;
use crate::input::options::Notes;
use crate::scene::{Mesh, Scene};
use lines::{Line, decode_text, lines, numbers};
use mtl::Library;

/// Largest number of polygon corners in all: more do not fit into 32-bit indices.
const MAX_CORNERS: usize = u32::MAX as usize / 2;

/// Returns true if a file looks like an OBJ: one of its first lines begins with a word of the format.
pub(super) fn looks_like(bytes: &[u8]) -> bool {
    // Comments at the top can be long.
    const LOOKED_AT: usize = 1 << 16;
    let text = decode_text(&bytes[..bytes.len().min(LOOKED_AT)]);
    let words = [
        "v", "vt", "vn", "vp", "f", "o", "g", "s", "mtllib", "usemtl", "l", "p",
    ];
    let known = |line: &Line| words.contains(&line.word);
    // A file of comments is an OBJ; that it has no triangles is reported later.
    lines(&text).next().is_none_or(|first| known(&first))
}

/// Reads an OBJ file; names in it count from `names`.
pub(super) fn load(bytes: &[u8], names: &Names, notes: &mut Notes) -> Result<Scene, String> {
    let text = decode_text(bytes);
    let mut reading = Reading::new(names);
    reading.use_material("");
    for line in lines(&text) {
        reading
            .line(&line, notes)
            .map_err(|what| format!("line {}: {what}", line.number))?;
    }
    reading.into_scene(notes)
}

/// A corner of a polygon: position, texture coordinates and normal, each by its place in the file.
type Corner = (u32, Option<u32>, Option<u32>);

struct Reading<'a> {
    positions: Vec<DVec3>,
    /// Per position, if the file has colours at all.
    colours: Vec<Option<[f32; 3]>>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    library: Library<'a>,
    /// One group of polygons for each material that was named, and whether its corners have coordinates and normals.
    groups: Vec<Group>,
    by_name: HashMap<(String, bool, bool), usize>,
    material: String,
    corners: usize,
}

impl<'a> Reading<'a> {
    fn new(names: &'a Names<'a>) -> Self {
        Self {
            positions: Vec::new(),
            colours: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            library: Library::new(names),
            groups: Vec::new(),
            by_name: HashMap::new(),
            material: String::new(),
            corners: 0,
        }
    }
}

/// Polygons of one material.
#[derive(Default)]
struct Group {
    material: String,
    vertices: HashMap<Corner, u32>,
    corners: Vec<Corner>,
    triangles: Vec<[u32; 3]>,
}

impl Reading<'_> {
    fn line(&mut self, line: &Line, notes: &mut Notes) -> Result<(), String> {
        match line.word {
            "v" => self.position(line.rest),
            "vt" => {
                let [u, v] = numbers(line.rest, [None, Some(0.0)])?;
                self.uvs.push([u, v]);
                Ok(())
            }
            "vn" => {
                self.normals.push(numbers(line.rest, [None; 3])?);
                Ok(())
            }
            "f" | "fo" => self.polygon(line.rest, notes),
            "usemtl" => {
                self.use_material(line.rest);
                Ok(())
            }
            "mtllib" => self.library.read(line.rest, notes),
            "l" | "p" => {
                notes.say("points and lines are left out: only triangles are drawn".to_owned());
                Ok(())
            }
            "curv" | "curv2" | "surf" => {
                notes.say(
                    "curves and free-form surfaces are left out: only polygons are drawn"
                        .to_owned(),
                );
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// x, y, z, then nothing, a weight, or a colour.
    fn position(&mut self, rest: &str) -> Result<(), String> {
        let count = rest.split_ascii_whitespace().count();
        let position = numbers(rest, [None; 3])?;
        self.positions.push(DVec3::from_array(position));
        let colour = match count {
            0..=5 => None,
            _ => {
                let [_, _, _, r, g, b]: [f32; 6] = numbers(rest, [None; 6])?;
                Some([r, g, b])
            }
        };
        if colour.is_some() || !self.colours.is_empty() {
            self.colours.resize(self.positions.len() - 1, None);
            self.colours.push(colour);
        }
        Ok(())
    }

    fn use_material(&mut self, name: &str) {
        name.clone_into(&mut self.material);
    }

    fn polygon(&mut self, rest: &str, notes: &mut Notes) -> Result<(), String> {
        let corners: Vec<Corner> = rest
            .split_ascii_whitespace()
            .map(|word| self.corner(word, notes))
            .collect::<Result<_, _>>()?;
        if corners.len() < 3 {
            notes.say("polygons of less than three corners are left out".to_owned());
            return Ok(());
        }
        finish::check(corners.len())?;
        self.corners += corners.len();
        if self.corners > MAX_CORNERS {
            return Err(format!("more than {MAX_CORNERS} corners"));
        }
        let shape: Vec<DVec3> = corners
            .iter()
            .map(|corner| self.positions[corner.0 as usize])
            .collect();
        let triangles = finish::triangles(&shape);
        let key = (
            self.material.clone(),
            corners.iter().all(|c| c.1.is_some()),
            corners.iter().all(|c| c.2.is_some()),
        );
        let material = self.material.clone();
        let group = *self.by_name.entry(key).or_insert_with(|| {
            self.groups.push(Group {
                material,
                ..Group::default()
            });
            self.groups.len() - 1
        });
        let group = &mut self.groups[group];
        for triangle in triangles {
            let vertices = triangle.map(|at| group.vertex(corners[at]));
            if vertices[0] != vertices[1]
                && vertices[1] != vertices[2]
                && vertices[2] != vertices[0]
            {
                group.triangles.push(vertices);
            }
        }
        Ok(())
    }

    /// `7`, `7/2`, `7//3` or `7/2/3`; numbers count from 1, or from the end where they are negative. Coordinates and
    /// normals of a file that has none at all are left out.
    fn corner(&self, word: &str, notes: &mut Notes) -> Result<Corner, String> {
        let mut parts = word.split('/');
        let mut part = |name: &str, count: usize| match parts.next() {
            None | Some("") => Ok(None),
            Some(_) if count == 0 && name != "v" => {
                notes.say(format!(
                    "polygons point to {name} lines, but there are none"
                ));
                Ok(None)
            }
            Some(number) => place(number, count).map(Some).ok_or_else(|| {
                format!(
                    "corner '{}': there is no {name} {} among {count}",
                    excerpt(word),
                    excerpt(number)
                )
            }),
        };
        let position = part("v", self.positions.len())?;
        let (uv, normal) = (part("vt", self.uvs.len())?, part("vn", self.normals.len())?);
        Ok((
            position.ok_or_else(|| format!("corner '{}' has no position", excerpt(word)))?,
            uv,
            normal,
        ))
    }

    fn into_scene(self, notes: &mut Notes) -> Result<Scene, String> {
        let Self {
            positions,
            colours,
            uvs,
            normals,
            groups,
            mut library,
            ..
        } = self;
        let (mut scene, mut in_world) = (Scene::default(), Vec::new());
        let is_drawn = |group: &&Group| !group.triangles.is_empty();
        let drawn = groups.iter().filter(is_drawn);
        library.decode_ahead(drawn.map(|group| group.material.as_str()));
        for group in groups
            .into_iter()
            .filter(|group| !group.triangles.is_empty())
        {
            let mut mesh = Mesh {
                name: group.material.clone(),
                triangles: group.triangles,
                ..Mesh::default()
            };
            let corners = &group.corners;
            let position = |corner: &Corner| positions[corner.0 as usize];
            in_world.push(corners.iter().map(position).collect());
            let set: Option<Vec<_>> = corners
                .iter()
                .map(|corner| Some(v_from_top(uvs[corner.1? as usize])))
                .collect();
            mesh.uvs = set.into_iter().collect();
            let normals: Option<Vec<_>> = corners
                .iter()
                .map(|corner| unit(normals[corner.2? as usize]))
                .collect();
            mesh.normals = normals.unwrap_or_default();
            if corners
                .iter()
                .any(|corner| colours.get(corner.0 as usize).is_some_and(Option::is_some))
            {
                mesh.colours = corners
                    .iter()
                    .map(|corner| colour(&colours, corner.0))
                    .collect();
            }
            mesh.material = library.place(&group.material, &mut scene.materials, notes)?;
            scene.meshes.push(mesh);
        }
        finish::set_origin(&mut scene, &in_world);
        scene.textures = library.into_textures();
        Ok(scene)
    }
}

impl Group {
    fn vertex(&mut self, corner: Corner) -> u32 {
        let next = self.corners.len() as u32;
        *self.vertices.entry(corner).or_insert_with(|| {
            self.corners.push(corner);
            next
        })
    }
}

/// The place that a number means among `count`, from 0.
fn place(number: &str, count: usize) -> Option<u32> {
    let number: i64 = number.parse().ok()?;
    let place = if number < 0 {
        count as i64 + number
    } else {
        number - 1
    };
    u32::try_from(place)
        .ok()
        .filter(|&place| (place as usize) < count)
}

fn v_from_top([u, v]: [f32; 2]) -> [f32; 2] {
    [u, 1.0 - v]
}

/// A normal of length 1; none if it has no direction.
fn unit(normal: [f32; 3]) -> Option<[f32; 3]> {
    let normal = DVec3::from_array(normal.map(f64::from));
    Some(normal.try_normalize()?.as_vec3().to_array())
}

/// Vertex colours are written as on a screen; a vertex without one is white.
fn colour(colours: &[Option<[f32; 3]>], place: u32) -> [f32; 4] {
    let colour = colours
        .get(place as usize)
        .copied()
        .flatten()
        .unwrap_or([1.0; 3]);
    // NaN stays, so that the last check finds it.
    let linear = |c: f32| {
        if c.is_nan() {
            c
        } else {
            resample_core::image::linear_from_srgb(c)
        }
    };
    let [r, g, b] = colour.map(linear);
    [r, g, b, 1.0]
}

#[cfg(test)]
mod tests;
