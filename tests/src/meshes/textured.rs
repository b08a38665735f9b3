//! Small textured scenes made by formulas: planes, walls, and the textures on them.
//!
//! Gives [`Scene`]s with one material per texture, unlit and opaque unless a test changes them.

use glam::{DMat2, DVec2, DVec3};
use resample_core::{Camera, LookAt};
use texmap::scene::{
    AlphaMode, Lighting, Magnify, Material, Mesh, Sides, Texels, Texture, TextureUse, Wrap,
};
use texmap::{RenderOptions, Renderer, Scene};

/// Straight alpha and linear colour of a texel by column and row.
pub fn texture(size: [usize; 2], colour: impl Fn(usize, usize) -> [f32; 4]) -> Texture {
    let texels = (0..size[0] * size[1])
        .map(|i| colour(i % size[0], i / size[0]))
        .collect();
    Texture {
        name: String::new(),
        width: size[0],
        height: size[1],
        texels: Texels::LinearF32(texels),
    }
}

/// Black and white squares of `square` texels.
pub fn checker(side: usize, square: usize) -> Texture {
    texture([side, side], |x, y| {
        grey(((x / square + y / square) % 2) as f32)
    })
}

/// Rings whose frequency rises from the middle to `limit` cycles per texel at the border.
pub fn zone_plate(side: usize, limit: f64) -> Texture {
    let middle = 0.5 * side as f64;
    texture([side, side], |x, y| {
        let (dx, dy) = (x as f64 + 0.5 - middle, y as f64 + 0.5 - middle);
        let phase = std::f64::consts::PI * limit / middle * (dx * dx + dy * dy);
        grey((0.5 + 0.5 * phase.cos()) as f32)
    })
}

/// Random texels with a spectrum that falls as a photograph's does: sums of value noise.
pub fn photo(side: usize) -> Texture {
    let noise = |x: usize, y: usize, seed: u32| {
        let mut h =
            (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca77) ^ seed;
        h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
        h = (h ^ h >> 12).wrapping_mul(0x297a_2d39);
        (h >> 8) as f32 / 16_777_216.0
    };
    let smooth = |x: usize, y: usize, cell: usize, seed: u32| {
        let (i, j) = (x / cell, y / cell);
        let (s, t) = (
            (x % cell) as f32 / cell as f32,
            (y % cell) as f32 / cell as f32,
        );
        let n = side / cell;
        let at = |i: usize, j: usize| noise(i % n, j % n, seed);
        let top = at(i, j) * (1.0 - s) + at(i + 1, j) * s;
        let low = at(i, j + 1) * (1.0 - s) + at(i + 1, j + 1) * s;
        top * (1.0 - t) + low * t
    };
    texture([side, side], |x, y| {
        let channel = |seed: u32| {
            [32, 16, 8, 4, 2, 1]
                .iter()
                .map(|&cell| smooth(x, y, cell, seed) * cell as f32 / 63.0)
                .sum()
        };
        [channel(1), channel(2), channel(3), 1.0]
    })
}

fn grey(value: f32) -> [f32; 4] {
    [value, value, value, 1.0]
}

/// A use of texture 0 with coordinate set 0.
pub fn texture_use(wrap: Wrap) -> TextureUse {
    TextureUse {
        texture: 0,
        uv_set: 0,
        uv_linear: DMat2::IDENTITY,
        uv_offset: DVec2::ZERO,
        wrap: [wrap; 2],
        magnify: Magnify::Linear,
    }
}

/// An unlit, opaque, two-sided white material.
pub fn material(base_texture: Option<TextureUse>) -> Material {
    Material {
        name: String::new(),
        base_colour: [1.0; 4],
        base_texture,
        emissive: [0.0; 3],
        emissive_texture: None,
        alpha: AlphaMode::Opaque,
        sides: Sides::Both,
        lighting: Lighting::Unlit,
        physical: None,
    }
}

/// Two triangles with corners in order around the quad.
pub fn quad(corners: [[f32; 3]; 4], uvs: [[f32; 2]; 4], material: usize) -> Mesh {
    Mesh {
        positions: corners.to_vec(),
        uvs: vec![uvs.to_vec()],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material,
        ..Mesh::default()
    }
}

/// One textured quad.
pub fn quad_scene(
    corners: [[f32; 3]; 4],
    uvs: [[f32; 2]; 4],
    texture: Texture,
    wrap: Wrap,
) -> Scene {
    Scene {
        origin_in_world: DVec3::ZERO,
        meshes: vec![quad(corners, uvs, 0)],
        materials: vec![material(Some(texture_use(wrap)))],
        textures: vec![texture],
        ..Scene::default()
    }
}

/// An upright square of side 2 around the origin, seen from +z, the texture once.
pub fn wall(texture: Texture) -> Scene {
    let corners = [
        [-1.0, -1.0, 0.0],
        [1.0, -1.0, 0.0],
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
    ];
    quad_scene(
        corners,
        [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
        texture,
        Wrap::Clamp,
    )
}

/// The ground y = 0 from z = 2 to -`depth`, with the texture `repeats` times along its depth.
pub fn ground(texture: Texture, depth: f32, repeats: f32) -> Scene {
    let (near, far, half) = (2.0, -depth, 0.5 * depth);
    let across = repeats * 2.0 * half / (depth + near);
    let corners = [
        [-half, 0.0, near],
        [half, 0.0, near],
        [half, 0.0, far],
        [-half, 0.0, far],
    ];
    let uvs = [[0.0, repeats], [across, repeats], [across, 0.0], [0.0, 0.0]];
    quad_scene(corners, uvs, texture, Wrap::Repeat)
}

/// A tube along a trefoil, of 18 432 triangles: the texture `repeats` times along it and an eighth as often around.
pub fn trefoil(texture: Texture, repeats: f32) -> Scene {
    const ALONG: u32 = 384;
    const AROUND: u32 = 24;
    let curve = |t: f64| {
        let (s, c) = t.sin_cos();
        let (s2, c2) = (2.0 * t).sin_cos();
        DVec3::new(s + 2.0 * s2, c - 2.0 * c2, -(3.0 * t).sin())
    };
    let (mut mesh, mut uv) = (Mesh::default(), Vec::new());
    for vertex in 0..(ALONG + 1) * (AROUND + 1) {
        let along = f64::from(vertex / (AROUND + 1)) / f64::from(ALONG);
        let around = f64::from(vertex % (AROUND + 1)) / f64::from(AROUND);
        let [t, turn] = [along, around].map(|share| share * std::f64::consts::TAU);
        let tangent = (curve(t + 1e-4) - curve(t - 1e-4)).normalize();
        let side = tangent.cross(DVec3::Z).normalize();
        let normal = side * turn.cos() + side.cross(tangent) * turn.sin();
        let position = curve(t) + 0.6 * normal;
        mesh.positions.push(position.as_vec3().to_array());
        uv.push([along as f32 * repeats, around as f32 * 0.125 * repeats]);
    }
    for quad in 0..ALONG * AROUND {
        let a = quad / AROUND * (AROUND + 1) + quad % AROUND;
        let (b, c) = (a + AROUND + 1, a + AROUND + 2);
        mesh.triangles.extend([[a, b, c], [a, c, a + 1]]);
    }
    mesh.uvs.push(uv);
    Scene {
        meshes: vec![mesh],
        materials: vec![material(Some(texture_use(Wrap::Repeat)))],
        textures: vec![texture],
        ..Scene::default()
    }
}

/// The colour in the middle of a picture of 4 units around the origin, seen by a distant camera: red, green, blue, alpha.
pub fn seen_from_afar(scene: &Scene, eye: DVec3) -> [f64; 4] {
    let pose = LookAt {
        position: eye * 50.0,
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    let camera = Camera::orthographic(&pose, 4.0, [8, 8]).expect("a pose with a direction");
    let mut renderer = Renderer::new(scene, &RenderOptions::default()).expect("good options");
    let image = renderer.render(&camera).expect("a valid camera").image;
    image.pixel(4, 4).map(f64::from)
}
