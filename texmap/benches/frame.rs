//! How long one frame takes at default settings, one thread: a checkerboard plane, a fine mesh, and translucent quads.
//!
//! Items are pixels. Compare the column of the fastest frame: on a busy machine the others say little.

use divan::Bencher;
use divan::counter::ItemsCount;
use glam::{DMat2, DVec2, DVec3};
use rayon::ThreadPoolBuilder;
use resample_core::{Camera, LookAt};
use texmap::scene::{AlphaMode, Magnify, Material, Mesh, Texels, Texture, TextureUse, Wrap};
use texmap::{RenderOptions, Renderer, Scene};

/// Width and height of the picture, px.
const SIDE: u32 = 320;

/// Texels along each side of the texture.
const TEXELS: usize = 256;

fn main() {
    divan::Divan::default()
        .max_time(std::time::Duration::from_secs(2))
        .config_with_args()
        .main();
}

/// Two triangles to the horizon, the texture repeated 20 times.
#[divan::bench]
fn plane(bencher: Bencher) {
    let corner = |x: f32, z: f32| ([20.0 * x, -1.0, 20.0 * z], [10.0 * x, 10.0 * z]);
    let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    let mesh = mesh(corners.map(|(x, z)| corner(x, z)), [[0, 1, 2], [0, 2, 3]]);
    frame(bencher, &scene(vec![mesh], AlphaMode::Opaque));
}

/// A sphere of 32 768 triangles.
#[divan::bench]
fn sphere(bencher: Bencher) {
    const ROWS: u32 = 128;
    let vertex = |at: u32| {
        let (u, v) = (at % (ROWS + 1), at / (ROWS + 1));
        let [u, v] = [u, v].map(|k| k as f32 / ROWS as f32);
        let (turn, tilt) = (std::f32::consts::TAU * u, std::f32::consts::PI * v);
        let position = [
            tilt.sin() * turn.cos(),
            tilt.cos(),
            -tilt.sin() * turn.sin(),
        ];
        (position, [4.0 * u, 2.0 * v])
    };
    let vertices = (0..(ROWS + 1) * (ROWS + 1)).map(vertex);
    let quads = (0..ROWS * ROWS).map(|quad| quad / ROWS * (ROWS + 1) + quad % ROWS);
    let triangles = quads.flat_map(|a| {
        let (b, c) = (a + 1, a + ROWS + 1);
        [[a, c, b], [b, c, c + 1]]
    });
    let mesh = mesh(vertices, triangles);
    frame(bencher, &scene(vec![mesh], AlphaMode::Opaque));
}

/// Eight translucent quads behind one another.
#[divan::bench]
fn layers(bencher: Bencher) {
    let quad = |layer: u8| {
        let z = 0.1 * f32::from(layer);
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let vertices = corners.map(|[x, y]| ([x, y, z], [x, y]));
        mesh(vertices, [[0, 1, 2], [0, 2, 3]])
    };
    frame(
        bencher,
        &scene((0..8).map(quad).collect(), AlphaMode::Blend),
    );
}

fn mesh(
    vertices: impl IntoIterator<Item = ([f32; 3], [f32; 2])>,
    triangles: impl IntoIterator<Item = [u32; 3]>,
) -> Mesh {
    let (positions, uv) = vertices.into_iter().unzip();
    Mesh {
        positions,
        uvs: vec![uv],
        triangles: triangles.into_iter().collect(),
        ..Mesh::default()
    }
}

/// Meshes of one material, whose texture is a checkerboard of 16 texels a square, half translucent.
fn scene(meshes: Vec<Mesh>, alpha: AlphaMode) -> Scene {
    let square = |at: usize| (at % TEXELS / 16 + at / TEXELS / 16).is_multiple_of(2);
    let texel = |at: usize| {
        if square(at) {
            [230, 200, 90, 128]
        } else {
            [20, 40, 60, 128]
        }
    };
    let texels: Vec<[u8; 4]> = (0..TEXELS * TEXELS).map(texel).collect();
    let base = TextureUse {
        texture: 0,
        uv_set: 0,
        uv_linear: DMat2::IDENTITY,
        uv_offset: DVec2::ZERO,
        wrap: [Wrap::Repeat; 2],
        magnify: Magnify::Linear,
    };
    let material = Material {
        base_texture: Some(base),
        alpha,
        ..Material::default()
    };
    let texture = Texture {
        name: String::new(),
        width: TEXELS,
        height: TEXELS,
        texels: Texels::Srgb8(texels.into()),
    };
    Scene {
        meshes,
        materials: vec![material],
        textures: vec![texture],
        ..Scene::default()
    }
}

fn frame(bencher: Bencher, scene: &Scene) {
    let pose = LookAt {
        position: DVec3::new(0.0, 0.4, 3.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    let camera = Camera::perspective(&pose, 0.8, [SIDE, SIDE]).expect("a camera");
    let mut renderer = Renderer::new(scene, &RenderOptions::default()).expect("good options");
    let pool = ThreadPoolBuilder::new().num_threads(1).build();
    let pool = pool.expect("a thread can be started");
    bencher
        .counter(ItemsCount::new(SIDE * SIDE))
        .bench_local(|| {
            pool.install(|| renderer.render(&camera))
                .expect("a picture")
                .stats
                .drawn
        });
}
