//! The last steps of every format: makes the promises of a scene true.
//!
//! Polygons are cut into triangles, a distant model is moved near zero, and every number and index is checked.

use std::collections::HashMap;

use glam::{DMat2, DVec2, DVec3};

use crate::input::files::excerpt;
use crate::input::options::Notes;
use crate::scene::{Magnify, Material, Mesh, Scene, Texels, Texture, TextureUse, Wrap};

// The last check of a scene, the same for every format.
//
// Checks a reader's output and makes it keep the promises of [`Scene`]: numbers that are not finite are an error,
// and a texture whose coordinates a mesh lacks is taken away from that mesh. Empty meshes go.

/// Largest world coordinate. Squares of distances then stay far from the end of single precision.
const MAX_COORDINATE: f64 = 1e15;

/// Largest texture coordinate: beyond 2^24 neighbouring numbers of a file are whole textures apart.
const MAX_UV: f32 = 16_777_216.0;

/// Checks a scene.
pub(crate) fn scene(mut scene: Scene, notes: &mut Notes) -> Result<Scene, String> {
    scene.meshes.retain(|mesh| !mesh.triangles.is_empty());
    if scene.meshes.is_empty() {
        return Err("holds no triangles: there is nothing to draw".into());
    }
    for mesh in &scene.meshes {
        check_numbers(mesh, scene.origin_in_world)
            .map_err(|what| format!("mesh '{}': {what}", excerpt(&mesh.name)))?;
    }
    drop_unusable_textures(&mut scene, notes);
    Ok(scene)
}

/// Gives a picture to every material without one, as far as its meshes have texture coordinates.
pub(crate) fn bind_texture(scene: &mut Scene, texture: Texture) -> Result<(), String> {
    let has_uvs = |mesh: &Mesh| !mesh.uvs.is_empty() && !mesh.triangles.is_empty();
    if !scene.meshes.iter().any(has_uvs) {
        return Err("no mesh has texture coordinates, so that no texture can be laid on it".into());
    }
    let wants =
        |mesh: &Mesh| has_uvs(mesh) && scene.materials[mesh.material].base_texture.is_none();
    if !scene.meshes.iter().any(wants) {
        return Err("every mesh that can have a texture has one already: leave it out".into());
    }
    scene.textures.push(texture);
    let bound = TextureUse {
        texture: scene.textures.len() - 1,
        uv_set: 0,
        uv_linear: DMat2::IDENTITY,
        uv_offset: DVec2::ZERO,
        wrap: [Wrap::Repeat; 2],
        magnify: Magnify::Linear,
    };
    for material in scene
        .materials
        .iter_mut()
        .filter(|material| material.base_texture.is_none())
    {
        material.base_texture = Some(bound);
    }
    Ok(())
}

fn check_numbers(mesh: &Mesh, origin: DVec3) -> Result<(), String> {
    let in_world = |pos: &[f32; 3]| origin + DVec3::from(pos.map(f64::from));
    let far = mesh.positions.iter().position(|pos| {
        !in_world(pos)
            .to_array()
            .iter()
            .all(|x| x.abs() <= MAX_COORDINATE)
    });
    if let Some(at) = far {
        let pos = in_world(&mesh.positions[at]).to_array();
        return Err(format!(
            "vertex {at} lies at {pos:?} in the world: expected finite numbers up to {MAX_COORDINATE:e}"
        ));
    }
    let uvs = mesh.uvs.iter().flatten();
    if let Some(uv) = uvs.clone().find(|uv| !uv.iter().all(|x| x.abs() <= MAX_UV)) {
        return Err(format!(
            "a texture coordinate is {uv:?}: expected finite numbers up to {MAX_UV}"
        ));
    }
    if !mesh
        .normals
        .iter()
        .flatten()
        .all(|number| number.is_finite())
    {
        return Err("a normal is not finite".into());
    }
    if !mesh
        .colours
        .iter()
        .flatten()
        .all(|number| number.is_finite())
    {
        return Err("a vertex colour is not finite".into());
    }
    Ok(())
}

/// Where a mesh lacks the coordinates that its material's texture wants, it gets a material without that texture.
fn drop_unusable_textures(scene: &mut Scene, notes: &mut Notes) {
    let mut without: HashMap<(usize, Vec<bool>), usize> = HashMap::new();
    for mesh in &mut scene.meshes {
        let material = &scene.materials[mesh.material];
        let lacks = |used: TextureUse| used.uv_set >= mesh.uvs.len();
        let uses = material.textures().into_iter();
        let lacking: Vec<bool> = uses.map(|used| used.is_some_and(lacks)).collect();
        if !lacking.contains(&true) {
            continue;
        }
        notes.say(format!(
            "mesh '{}' has no coordinates for the texture of material '{}': it shows the plain colour",
            excerpt(&mesh.name),
            excerpt(&material.name)
        ));
        let key = (mesh.material, lacking);
        let place = match without.get(&key) {
            Some(&place) => place,
            None => {
                let plain = without_textures(&scene.materials[mesh.material], &key.1);
                scene.materials.push(plain);
                without.insert(key, scene.materials.len() - 1);
                scene.materials.len() - 1
            }
        };
        mesh.material = place;
    }
}

fn without_textures(material: &Material, lacking: &[bool]) -> Material {
    let mut material = material.clone();
    for (used, lacks) in material.textures_mut().into_iter().zip(lacking) {
        *used = used.filter(|_| !lacks);
    }
    material
}

/// Checks the indices of a scene that a program made: each points at something that is there.
///
/// Readers of files check theirs where they read them, and can name the place in the file.
pub(crate) fn indices(scene: &Scene) -> Result<(), String> {
    for mesh in &scene.meshes {
        mesh_indices(mesh, scene.materials.len()).map_err(|what| match mesh.name.as_str() {
            "" => what,
            name => format!("mesh '{name}': {what}"),
        })?;
    }
    let used = scene.materials.iter().flat_map(Material::textures);
    if let Some(used) = used
        .flatten()
        .find(|used| used.texture >= scene.textures.len())
    {
        return Err(format!("there is no texture {}", used.texture));
    }
    for texture in &scene.textures {
        let count = match &texture.texels {
            Texels::Srgb8(texels) => texels.len(),
            Texels::LinearF32(texels) => texels.len(),
        };
        let expected = texture.width * texture.height;
        if count == 0 || count != expected {
            return Err(format!(
                "a texture of {}x{} texels holds {count}",
                texture.width, texture.height
            ));
        }
    }
    Ok(())
}

fn mesh_indices(mesh: &Mesh, materials: usize) -> Result<(), String> {
    let vertices = mesh.positions.len();
    let corners = mesh.triangles.iter().flatten();
    if let Some(corner) = corners.max().filter(|&&corner| corner as usize >= vertices) {
        return Err(format!(
            "a triangle has the corner {corner}, but there are {vertices} vertices"
        ));
    }
    if mesh.material >= materials {
        return Err(format!("there is no material {}", mesh.material));
    }
    let lists = [
        ("normals", mesh.normals.len()),
        ("colours", mesh.colours.len()),
        ("tangents", mesh.tangents.len()),
    ];
    let coordinates = mesh
        .uvs
        .iter()
        .map(|set| ("texture coordinates", set.len()));
    let mut given = lists
        .into_iter()
        .filter(|(_, count)| *count > 0)
        .chain(coordinates);
    match given.find(|(_, count)| *count != vertices) {
        None => Ok(()),
        Some((what, count)) => Err(format!(
            "there are {count} {what} for {vertices} vertices: expected one for each"
        )),
    }
}

// The origin of a scene: positions of f64 become numbers of f32 that count from a point near them.
//
// A model that stands far from the world's origin (a survey in UTM, a part of a plant) would lose its shape in f32. Where
// that is so, positions count from the middle of the scene; else they stay as they are in the file.

/// A scene that is farther from the origin than this many of its diagonals counts from its middle. An f32 is then exact
/// to a millionth of the diagonal, a thousandth of a pixel of a picture that shows all of it.
const FAR_DIAGONALS: f64 = 8.0;

/// Gives the meshes their positions, those of each mesh in the world.
pub fn set_origin(scene: &mut Scene, positions: &[Vec<DVec3>]) {
    scene.origin_in_world = origin(positions);
    for (mesh, positions) in scene.meshes.iter_mut().zip(positions) {
        let relative = |pos: &DVec3| (*pos - scene.origin_in_world).as_vec3().to_array();
        mesh.positions = positions.iter().map(relative).collect();
    }
}

fn origin(positions: &[Vec<DVec3>]) -> DVec3 {
    let all = positions.iter().flatten();
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = all.fold(empty, |(low, high), &pos| (low.min(pos), high.max(pos)));
    let (middle, diagonal) = (0.5 * (low + high), (high - low).length());
    if middle.is_finite() && middle.length() > FAR_DIAGONALS * diagonal && diagonal > 0.0 {
        middle
    } else {
        DVec3::ZERO
    }
}

// Polygons to triangles, concave ones included.
//
// Takes the corners of a polygon in space, gives triples of corner numbers that wind as the polygon does. The polygon is
// laid into the plane of its mean normal (Newell's), and its ears are cut off one by one. An ear is a corner whose triangle turns the
// right way and holds no other corner.
// Limits: a polygon that crosses itself has no such division; its remainder becomes a fan. So does one of more
// than [`MAX_EARS`] corners, because the time grows with the cube of their number in the worst case.

/// Most corners that are cut ear by ear: 512^3 steps are a tenth of a second.
const MAX_EARS: usize = 512;

/// Most corners of a polygon that is read; real ones have some hundred. As a fan, more of them would lie over one another.
pub(crate) const MAX_CORNERS: usize = 1 << 16;

/// Refuses a polygon of more corners than any program writes.
pub(crate) fn check(corners: usize) -> Result<(), String> {
    if corners <= MAX_CORNERS {
        return Ok(());
    }
    Err(format!(
        "a polygon of {corners} corners: at most {MAX_CORNERS} are read"
    ))
}

/// Triangles of a polygon of at least three corners.
pub(crate) fn triangles(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let mut triangles = Vec::with_capacity(corners.len().saturating_sub(2));
    if corners.len() > 3 && corners.len() <= MAX_EARS {
        let flat = in_plane(corners);
        // To cut an ear changes its neighbours: the search goes on at the one before it.
        let mut start = 0;
        while left.len() > 3 {
            let mut places = (0..left.len()).map(|step| (start + step) % left.len());
            let Some(ear) = places.find(|&at| is_ear(&flat, &left, at)) else {
                break;
            };
            triangles.push(around(&left, ear));
            left.remove(ear);
            start = ear.saturating_sub(1);
        }
    }
    triangles.extend((2..left.len()).map(|at| [left[0], left[at - 1], left[at]]));
    triangles
}

/// The corners in the plane of the mean normal, so that the polygon winds counter-clockwise.
fn in_plane(corners: &[DVec3]) -> Vec<DVec2> {
    let origin = corners[0];
    let points: Vec<DVec3> = corners.iter().map(|corner| corner - origin).collect();
    let next = points.iter().cycle().skip(1);
    let normal: DVec3 = points.iter().zip(next).map(|(a, b)| a.cross(*b)).sum();
    let normal = normal.try_normalize().unwrap_or(DVec3::Z);
    let (right, up) = normal.any_orthonormal_pair();
    points
        .iter()
        .map(|point| DVec2::new(point.dot(right), point.dot(up)))
        .collect()
}

fn around(left: &[usize], at: usize) -> [usize; 3] {
    let count = left.len();
    [
        left[(at + count - 1) % count],
        left[at],
        left[(at + 1) % count],
    ]
}

fn is_ear(flat: &[DVec2], left: &[usize], at: usize) -> bool {
    let corners = around(left, at);
    let [a, b, c] = corners.map(|corner| flat[corner]);
    let turns_left = (b - a).perp_dot(c - b) > 0.0;
    let inside = |point: DVec2| {
        (b - a).perp_dot(point - a) >= 0.0
            && (c - b).perp_dot(point - b) >= 0.0
            && (a - c).perp_dot(point - c) >= 0.0
    };
    // A corner at the place of one of the three, as at a slit, is not in the way.
    let in_the_way = |&corner: &usize| {
        let point = flat[corner];
        !corners.contains(&corner) && point != a && point != b && point != c && inside(point)
    };
    turns_left && !left.iter().any(in_the_way)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Scene {
        Scene {
            meshes: vec![Mesh {
                positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            }],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    #[test]
    fn indices_point_at_what_is_there() {
        assert_eq!(indices(&triangle()), Ok(()));
        let mut wrong = triangle();
        wrong.meshes[0].triangles[0][2] = 3;
        let what = indices(&wrong).expect_err("there is no vertex 3");
        assert!(what.contains("corner 3"), "{what}");
        let mut wrong = triangle();
        wrong.meshes[0].uvs = vec![vec![[0.0; 2]; 2]];
        let what = indices(&wrong).expect_err("one is missing");
        assert!(
            what.contains("2 texture coordinates for 3 vertices"),
            "{what}"
        );
        let mut wrong = triangle();
        wrong.meshes[0].material = 1;
        assert!(indices(&wrong).is_err());
        for (width, held, is_right) in [(2, 4, true), (2, 3, false), (0, 0, false)] {
            let mut scene = triangle();
            scene.textures = vec![Texture {
                name: String::new(),
                width,
                height: 2,
                texels: Texels::LinearF32(vec![[0.0; 4]; held]),
            }];
            assert_eq!(indices(&scene).is_ok(), is_right, "{held} texels");
        }
    }

    #[test]
    fn only_what_is_far_away_counts_from_its_middle() {
        let at = |x: f64| vec![vec![DVec3::new(x, 0.0, 0.0), DVec3::new(x + 1.0, 0.0, 0.0)]];
        assert_eq!(origin(&at(5.0)), DVec3::ZERO);
        assert_eq!(origin(&at(1e9)), DVec3::new(1e9 + 0.5, 0.0, 0.0));
        assert_eq!(origin(&[]), DVec3::ZERO, "nothing");
        assert_eq!(origin(&at(f64::NAN)), DVec3::ZERO, "refused later");
    }

    fn area(corners: &[[f32; 3]], triangles: &[[usize; 3]]) -> (f64, f64) {
        let at = |i: usize| DVec3::from_array(corners[i].map(f64::from));
        let signed = triangles
            .iter()
            .map(|&[a, b, c]| 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).z);
        signed.fold((0.0, 0.0), |(sum, absolute), area| {
            (sum + area, absolute + area.abs())
        })
    }

    fn in_space(polygon: &[[f32; 3]]) -> Vec<DVec3> {
        polygon
            .iter()
            .map(|corner| DVec3::from_array(corner.map(f64::from)))
            .collect()
    }

    #[test]
    fn concave_polygons_are_covered_once() {
        let arrow = [
            [0.0, 0.0, 0.0],
            [2.0, -1.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 1.0, 0.0],
        ];
        let comb: Vec<[f32; 3]> = (0..40)
            .map(|i| [i as f32, if i % 2 == 0 { 5.0 } else { 1.0 }, 0.0])
            .chain([[40.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
            .rev()
            .collect();
        for polygon in [arrow.to_vec(), comb] {
            let triangles = triangles(&in_space(&polygon));
            assert_eq!(
                triangles.len(),
                polygon.len() - 2,
                "as many triangles as a polygon has"
            );
            let (signed, absolute) = area(&polygon, &triangles);
            assert!(
                (signed.abs() - absolute).abs() < 1e-9,
                "all wind one way: {signed} against {absolute}"
            );
        }
    }

    #[test]
    fn hopeless_polygons_still_give_triangles() {
        let line = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [3.0, 0.0, 0.0],
        ];
        let bow = [
            [0.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        for polygon in [line, bow, [[f32::NAN; 3]; 4]] {
            assert_eq!(
                triangles(&in_space(&polygon)).len(),
                2,
                "{polygon:?} has four corners"
            );
        }
        let many: Vec<[f32; 3]> = (0..100_000)
            .map(|i| [(i as f32).sin(), (i as f32).cos(), 0.0])
            .collect();
        assert_eq!(
            triangles(&in_space(&many)).len(),
            many.len() - 2,
            "a polygon of any size ends"
        );
    }
}
