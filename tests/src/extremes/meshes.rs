//! Textured triangles at extremes: sizes, depths, textures.

use super::row::Result;
use glam::{DMat2, DVec2, DVec3};
use resample_core::{Camera, Image, LookAt};
use texmap::scene::{
    AlphaMode, Lighting, Magnify, Material, Mesh, Sides, Texels, Texture, TextureUse, Wrap,
};
use texmap::{Method, PlaneKind, RenderOptions, Renderer, Scene};

use super::row::{Claim, Row};

const COVERED: Claim = Claim {
    quantity: "opacity of a triangle, every method",
    bound: 1e-6,
    why: "edges are f64 in homogeneous coordinates; weights of a whole pixel are normalised",
};

const DEPTH: Claim = Claim {
    quantity: "depth of a mesh over its distance",
    bound: 1e-6,
    why: "depth is a plane over the screen in f64, written as f32",
};

const COLOUR: Claim = Claim {
    quantity: "red of a texture, every method",
    bound: 2e-3,
    why: "a texel's weights are normalised; minified texels come from levels that are means",
};

/// All rows.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    // A right angle of this side: its area is half the square.
    for (extreme, side) in [
        ("area 1e-20", 1.4e-10),
        ("area 1e20", 1.4e10),
        ("area 0.5", 1.0),
    ] {
        let images = drawn(&wall(side, texture([1, 1], |_| 1.0)), &front(side)?)?;
        // Inside and outside, away from the edges.
        let alphas = images.iter().flat_map(|image| {
            let alpha = |x, y| f64::from(image.pixel(x, y)[3]);
            [[alpha(16, 16), 1.0], [alpha(1, 16), 0.0]]
        });
        rows.push(COVERED.worst(extreme, alphas));
        let depths = images
            .iter()
            .map(|image| [depth(image, 16, 16) / (3.0 * side), 1.0]);
        rows.push(DEPTH.worst(extreme, depths));
    }
    rows.extend(textures()?);
    rows.push(two_walls()?);
    rows.extend(degenerate()?);
    Ok(rows)
}

fn depth(image: &Image, x: usize, y: usize) -> f64 {
    let plane = image.depth.as_ref();
    plane.map_or(f64::NAN, |plane| plane[y * image.width + x].into())
}

/// A camera three sides away, whose view is two sides high.
fn front(side: f64) -> Result<Camera> {
    let pose = LookAt {
        position: DVec3::new(0.0, 0.0, 3.0 * side),
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    let fov = 2.0 * (1.0f64 / 3.0).atan();
    Ok(Camera::perspective(&pose, fov, [33, 33])?)
}

fn texture(size: [usize; 2], red: impl Fn(usize) -> f32) -> Texture {
    let texel = |i: usize| [red(i), 0.5, 0.5, 1.0];
    Texture {
        name: String::new(),
        width: size[0],
        height: size[1],
        texels: Texels::LinearF32((0..size[0] * size[1]).map(texel).collect()),
    }
}

/// A square of this side before the camera, its texture once.
fn wall(side: f64, texture: Texture) -> Scene {
    let half = (0.5 * side) as f32;
    let positions = vec![
        [-half, -half, 0.0],
        [half, -half, 0.0],
        [half, half, 0.0],
        [-half, half, 0.0],
    ];
    let uvs = vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    Scene {
        meshes: vec![Mesh {
            positions,
            uvs: vec![uvs],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }],
        materials: vec![Material {
            base_texture: Some(TextureUse {
                texture: 0,
                uv_set: 0,
                uv_linear: DMat2::IDENTITY,
                uv_offset: DVec2::ZERO,
                wrap: [Wrap::Repeat; 2],
                magnify: Magnify::Linear,
            }),
            alpha: AlphaMode::Opaque,
            sides: Sides::Both,
            lighting: Lighting::Unlit,
            ..Material::default()
        }],
        textures: vec![texture],
        ..Scene::default()
    }
}

/// The picture of each method; points have holes where texels are larger than pixels.
fn drawn(scene: &Scene, camera: &Camera) -> Result<Vec<Image>> {
    let methods = Method::ALL
        .into_iter()
        .filter(|method| *method != Method::Point);
    let draw = |method| {
        let options = RenderOptions {
            method,
            planes: vec![PlaneKind::Depth],
            ..RenderOptions::default()
        };
        Ok(Renderer::new(scene, &options)?.render(camera)?.image)
    };
    methods.map(draw).collect()
}

fn textures() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let stripes = |i: usize| (i % 2) as f32;
    for (extreme, texture, truth) in [
        ("a texture of one texel", texture([1, 1], |_| 0.25), 0.25),
        (
            "a texture of 1x16384 equal texels",
            texture([1, 16_384], |_| 0.75),
            0.75,
        ),
        (
            "a texture of 16384x1 equal texels",
            texture([16_384, 1], |_| 0.75),
            0.75,
        ),
    ] {
        let images = drawn(&wall(1.0, texture), &front(1.0)?)?;
        let reds = images
            .iter()
            .map(|image| [image.pixel(16, 16)[0].into(), truth]);
        rows.push(COLOUR.worst(extreme, reds));
    }
    let claim = Claim {
        quantity: "red of a texture, hybrid",
        ..COLOUR
    };
    let images = drawn(&wall(1.0, texture([1, 16_384], stripes)), &front(1.0)?)?;
    rows.push(claim.row(
        "16384 stripes in 16 pixels",
        [images[0].pixel(16, 16)[0].into(), 0.5],
    ));
    Ok(rows)
}

/// A wall at 3, half of the view, before one at 3e9.
fn two_walls() -> Result<Row> {
    let mut scene = wall(1.0, texture([1, 1], |_| 0.5));
    let mut behind = wall(4e9, texture([1, 1], |_| 0.5)).meshes.remove(0);
    for position in &mut behind.positions {
        position[2] = -3e9;
    }
    for position in &mut scene.meshes[0].positions {
        position[0] += 0.5;
    }
    scene.meshes.push(behind);
    let pairs = drawn(&scene, &front(1.0)?)?.into_iter().flat_map(|image| {
        [
            [depth(&image, 20, 16) / 3.0, 1.0],
            [depth(&image, 4, 16) / 3.000_000_003e9, 1.0],
        ]
    });
    Ok(DEPTH.worst("depths of 3 and 3e9 in one picture", pairs))
}

fn degenerate() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let mut scene = wall(1.0, texture([1, 1], |_| 0.5));
    scene.meshes[0]
        .triangles
        .extend([[0, 0, 0], [0, 1, 1], [2, 0, 2]]);
    let alpha = |image: Image| [f64::from(image.pixel(16, 16)[3]), 1.0];
    let images = drawn(&scene, &front(1.0)?)?;
    rows.push(COVERED.worst(
        "triangles without area among others",
        images.into_iter().map(alpha),
    ));
    let mut scene = wall(1.0, texture([2, 1], |i| i as f32));
    scene.meshes[0].uvs = vec![vec![[0.25, 0.5]; 4]];
    let images = drawn(&scene, &front(1.0)?)?;
    rows.push(
        COLOUR.worst(
            "texture coordinates without area",
            images
                .iter()
                .map(|image| [image.pixel(16, 16)[0].into(), 0.0]),
        ),
    );
    Ok(rows)
}
