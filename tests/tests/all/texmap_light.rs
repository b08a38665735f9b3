//! The light of surroundings: held to sums over many directions, on balls of metal and roughness, and on a bumpy plane that
//! goes away, where highlights must neither sparkle nor fade.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, LookAt};
use resample_tests::meshes::surroundings::{Reflector, lamps, reflected};
use resample_tests::meshes::textured::{material, quad, texture_use};
use texmap::scene::{Lighting, Material, Mesh, Physical, Surroundings, Texels, Texture, Wrap};
use texmap::{RenderOptions, Renderer, Scene};

/// Balls along each side of the grid.
const BALLS: usize = 5;

fn base(column: usize) -> [f32; 4] {
    let share = column as f32 / (BALLS - 1) as f32;
    [0.9, 0.6 + 0.2 * share, 0.3 + 0.3 * share, 1.0]
}

/// Metal by column, roughness by row.
fn physical(column: usize, row: usize) -> Physical {
    Physical {
        metal: column as f32 / (BALLS - 1) as f32,
        roughness: 0.1 + 0.9 * row as f32 / (BALLS - 1) as f32,
        ..Physical::default()
    }
}

pub(super) fn lit(base_colour: [f32; 4], physical: Physical) -> Material {
    Material {
        base_colour,
        lighting: Lighting::Lit,
        physical: Some(physical),
        ..material(None)
    }
}

/// A ball of radius 1 with exact normals.
fn ball(centre: DVec2, material: usize) -> Mesh {
    let (around, down) = (96, 48);
    let (mut normals, mut triangles) = (Vec::new(), Vec::new());
    for j in 0..=down {
        for i in 0..=around {
            let (a, b) = (
                f64::from(i) / f64::from(around) * std::f64::consts::TAU,
                f64::from(j) / f64::from(down) * std::f64::consts::PI,
            );
            normals.push(DVec3::new(b.sin() * a.sin(), b.cos(), b.sin() * a.cos()));
        }
    }
    let stride = around + 1;
    for j in 0..down {
        for i in 0..around {
            let at = j * stride + i;
            triangles.push([at, at + stride, at + stride + 1]);
            triangles.push([at, at + stride + 1, at + 1]);
        }
    }
    let positions = normals.iter().map(|n| (*n + centre.extend(0.0)).as_vec3());
    Mesh {
        positions: positions.map(|p| p.to_array()).collect(),
        normals: normals.iter().map(|n| n.as_vec3().to_array()).collect(),
        triangles,
        material,
        ..Mesh::default()
    }
}

fn parallel_camera(towards: DVec3, height: f64, size: [u32; 2]) -> Camera {
    let pose = LookAt {
        position: towards * 50.0,
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    Camera::orthographic(&pose, height, size).expect("a pose with a direction")
}

fn psnr_db(pairs: impl Iterator<Item = ([f32; 4], DVec3)>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for (seen, truth) in pairs {
        for k in 0..3 {
            sum += (f64::from(seen[k]) - truth[k]).powi(2);
            count += 1;
        }
    }
    -10.0 * (sum / f64::from(count)).log10()
}

#[test]
fn balls_of_metal_and_roughness() {
    let surroundings = lamps(128);
    let mut scene = Scene {
        surroundings: Some(Arc::new(surroundings.clone())),
        ..Scene::default()
    };
    let centre = |k: usize| 2.2 * (k as f64 - 0.5 * (BALLS - 1) as f64);
    for at in 0..BALLS * BALLS {
        let (column, row) = (at % BALLS, at / BALLS);
        scene
            .materials
            .push(lit(base(column), physical(column, row)));
        scene
            .meshes
            .push(ball(DVec2::new(centre(column), -centre(row)), at));
    }
    let side = 480;
    let height = 2.2 * BALLS as f64;
    let camera = parallel_camera(DVec3::Z, height, [side, side]);
    let options = RenderOptions::default();
    let mut renderer = Renderer::new(&scene, &options).expect("good options");
    let image = renderer.render(&camera).expect("a valid camera").image;
    let of_ball = |at: usize| {
        let (column, row) = (at % BALLS, at / BALLS);
        let physical = physical(column, row);
        let [r, g, b, _] = base(column).map(f64::from);
        let surface = Reflector {
            base: DVec3::new(r, g, b),
            metal: physical.metal.into(),
            roughness: physical.roughness.into(),
        };
        let px = height / f64::from(side);
        let middle = DVec2::new(centre(column), -centre(row));
        // Every fifth pixel along each side.
        let pixels: Vec<_> = (0..side / 5 * (side / 5))
            .into_par_iter()
            .filter_map(|pixel| {
                let (x, y) = (5 * (pixel % (side / 5)), 5 * (pixel / (side / 5)));
                let at = |k: u32| (f64::from(k) + 0.5) * px - 0.5 * height;
                let p = DVec2::new(at(x), -at(y)) - middle;
                // Outlines are another test's; the filter reaches two pixels.
                if p.length() > 1.0 - 2.0 * px {
                    return None;
                }
                let normal = p.extend((1.0 - p.length_squared()).sqrt());
                let truth = reflected(&surroundings, &surface, (normal, DVec3::Z), 2048);
                Some((image.pixel(x as usize, y as usize), truth))
            })
            .collect();
        psnr_db(pixels.into_iter())
    };
    let found: Vec<f64> = (0..BALLS * BALLS).map(of_ball).collect();
    for row in found.chunks(BALLS) {
        println!("{row:5.1?}");
    }
    let worst = found.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(worst >= 35.0, "a ball is {worst:.1} dB from its truth");
}

/// A height field as a normal map, `side` texels: random, with a spectrum from one texel on.
pub(super) fn bumps(side: usize) -> (Texture, Vec<DVec3>) {
    let random = |k: usize| {
        let mut h = (k as u32).wrapping_mul(0x9e37_79b1) ^ 0x51ed_270b;
        h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
        h = (h ^ h >> 12).wrapping_mul(0x297a_2d39);
        f64::from(h >> 8) / 16_777_216.0 - 0.5
    };
    let texels: Vec<[u8; 4]> = (0..side * side)
        .map(|at| {
            let slope = DVec2::new(random(2 * at), random(2 * at + 1)) * 0.7;
            let n = DVec3::new(slope.x, slope.y, 1.0).normalize();
            let code = |v: f64| ((v * 0.5 + 0.5) * 255.0).round() as u8;
            [code(n.x), code(n.y), code(n.z), 255]
        })
        .collect();
    let normals = texels.iter().map(|&[x, y, z, _]| {
        (DVec3::new(x.into(), y.into(), z.into()) / 127.5 - DVec3::ONE).normalize()
    });
    let normals = normals.collect();
    let texture = Texture {
        name: String::new(),
        width: side,
        height: side,
        texels: Texels::Srgb8(Arc::new(texels)),
    };
    (texture, normals)
}

/// What a bumpy plane reflects by its normal, in a table: the eye is far away.
struct Table {
    light: Vec<DVec3>,
}

/// Nodes of the table along each slope.
const NODES: usize = 64;

impl Table {
    fn new(from: &Surroundings, surface: &Reflector, eye: DVec3) -> Self {
        let slope = |k: usize| k as f64 / (NODES - 1) as f64 - 0.5;
        let light = (0..NODES * NODES)
            .into_par_iter()
            .map(|at| {
                let n = DVec3::new(slope(at % NODES), slope(at / NODES), 1.0).normalize();
                reflected(from, surface, (n, eye), 1024)
            })
            .collect();
        Self { light }
    }

    fn at(&self, n: DVec3) -> DVec3 {
        let place = |slope: f64| ((slope + 0.5) * (NODES - 1) as f64).clamp(0.0, 62.999);
        let (x, y) = (place(n.x / n.z), place(n.y / n.z));
        let first = y as usize * NODES + x as usize;
        let row = |at: usize| self.light[at].lerp(self.light[at + 1], x.fract());
        row(first).lerp(row(first + NODES), y.fract())
    }
}

#[test]
fn a_bumpy_plane_neither_sparkles_nor_fades_as_it_goes_away() {
    const SIDE: usize = 128;
    let surroundings = lamps(64);
    let (normal_map, normals) = bumps(SIDE);
    let repeats = 8.0;
    let corners = [
        [-8.0, -8.0, 0.0],
        [8.0, -8.0, 0.0],
        [8.0, 8.0, 0.0],
        [-8.0, 8.0, 0.0],
    ];
    let uvs = [[0.0, repeats], [repeats; 2], [repeats, 0.0], [0.0; 2]];
    let size = 24;
    for roughness in [0.15, 0.3, 0.6] {
        let surface = Reflector {
            base: DVec3::new(0.9, 0.7, 0.4),
            metal: 1.0,
            roughness,
        };
        let physical = Physical {
            metal: 1.0,
            roughness: roughness as f32,
            normal_texture: Some(texture_use(Wrap::Repeat)),
            ..Physical::default()
        };
        let scene = Scene {
            meshes: vec![quad(corners, uvs, 0)],
            materials: vec![lit([0.9, 0.7, 0.4, 1.0], physical)],
            textures: vec![normal_map.clone()],
            surroundings: Some(Arc::new(surroundings.clone())),
            ..Scene::default()
        };
        let eye = DVec3::new(0.35, 0.25, 0.8).normalize();
        let table = Table::new(&surroundings, &surface, eye);
        let mut renderer = Renderer::new(&scene, &RenderOptions::default()).expect("good options");
        let mut line = Vec::new();
        for texels_per_px in [0.5, 1.0, 1.5, 2.0, 4.0, 8.0] {
            let height = f64::from(size) * texels_per_px * 2.0 / SIDE as f64;
            let camera = parallel_camera(eye, height, [size, size]);
            let image = renderer.render(&camera).expect("a valid camera").image;
            let pixels: Vec<_> = (0..size * size)
                .into_par_iter()
                .map(|pixel| {
                    let at = [pixel % size, pixel / size];
                    let truth = mean(&camera, at, &|p| {
                        let uv = DVec2::new(p.x + 8.0, 8.0 - p.y) * (SIDE as f64 / 2.0);
                        table.at(bilinear(&normals, SIDE, uv))
                    });
                    (image.pixel(at[0] as usize, at[1] as usize), truth)
                })
                .collect();
            line.push(psnr_db(pixels.into_iter()));
        }
        println!("roughness {roughness}: {line:5.1?} dB");
        let worst = line.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(
            worst >= 38.5,
            "roughness {roughness}: {worst:.1} dB from the truth"
        );
    }
}

/// The Gaussian mean over a pixel of what rays see of the plane z = 0.
pub(super) fn mean(camera: &Camera, at: [u32; 2], seen: &(dyn Fn(DVec3) -> DVec3 + Sync)) -> DVec3 {
    let world_from_camera = camera.camera_from_world.inverse();
    let rays = 40;
    let (mut sum, mut whole) = (DVec3::ZERO, 0.0);
    for k in 0..rays * rays {
        let offset = |k: usize| ((k as f64 + 0.5) / rays as f64 - 0.5) * 4.0;
        let (dx, dy) = (offset(k % rays), offset(k / rays));
        let weight = (-2.0 * (dx * dx + dy * dy)).exp();
        let screen = DVec2::new(f64::from(at[0]) + 0.5 + dx, f64::from(at[1]) + 0.5 + dy);
        let (origin, direction) = camera.ray_in_camera(screen);
        let start = world_from_camera.transform_point3(origin);
        let along = world_from_camera.transform_vector3(direction);
        let hit = start - along * (start.z / along.z);
        sum += seen(hit) * weight;
        whole += weight;
    }
    sum / whole
}

/// The map's normal between its texels, made one long.
pub(super) fn bilinear(normals: &[DVec3], side: usize, uv: DVec2) -> DVec3 {
    let at = uv - 0.5;
    let (i, j) = (at.x.floor() as i64, at.y.floor() as i64);
    let texel = |i: i64, j: i64| {
        let wrapped = |k: i64| k.rem_euclid(side as i64) as usize;
        normals[wrapped(j) * side + wrapped(i)]
    };
    let (s, t) = (at.x - at.x.floor(), at.y - at.y.floor());
    let row = |j: i64| texel(i, j) * (1.0 - s) + texel(i + 1, j) * s;
    (row(j) * (1.0 - t) + row(j + 1) * t).normalize()
}
