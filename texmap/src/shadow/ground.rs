//! A ground that shows nothing but the shadow of what stands on it.
//!
//! It is a square below the scene, black, whose alpha is the share of light that the scene takes from it. That is a texture: found at places of a
//! square grid that is divided where light changes, mixed between them. Limits: the ground lies level, at the lowest point of the scene;
//! its shadow fades to nothing at its border; it takes no light from the scene.

use std::collections::HashMap;

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::{DMat2, DVec2, DVec3, Vec3};
use resample_core::dispatch;
use resample_core::simd::{SimdLevel, Vectors};

use crate::light::blocked::BlockedLight;
use crate::light::blocked::bvh::{Tree, Vector};
use crate::light::blocked::sky::Sky;
use crate::light::blocked::sun_rays::sun_visible;
use crate::light::suns::Sun;
use crate::options::{Method, RenderOptions, Shade, Shadows, ToneMap};
use crate::project::cull::Facing;
use crate::screen::{LANES, Lanes};
use crate::shadow::bake::brightness;
use crate::shadow::places::Place;
use resample_mesh::scene::{
    AlphaMode, Lighting, Magnify, Material, Mesh, Scene, Sides, Texels, Texture, TextureUse, Wrap,
};

/// Directions of light: on an even ground every step of a shadow is seen.
pub(super) const DIRECTIONS: usize = 2048;

/// Texels along its side.
const SIDE: usize = 512;

/// Texels from place to place of the first grid: a power of 2.
const FIRST_STEP: usize = 16;

/// Shares of light between the corners of a square, from which on it is divided: what a square leaves out is a quarter of it, and less
/// than an 8-bit picture shows.
const DIFFERENCE: f32 = 0.012;

/// The ground reaches so many heights of the scene beyond it, and its shadow fades over the last part of its half. Guesses: a lamp that stands 45
/// degrees high throws a shadow as long as the scene is high.
const HEIGHTS: f32 = 1.5;
const FADING: f32 = 0.25;

/// How the ground is drawn.
pub(super) const UNLIT: RenderOptions = RenderOptions {
    method: Method::Hybrid,
    shade: Shade::Unlit,
    environment_turn_deg: 0.0,
    light: DVec3::Y,
    shadows: Shadows::None,
    subpixels: 4,
    exposure: 0.0,
    tone_map: ToneMap::None,
    planes: Vec::new(),
    background: [1.0; 3],
    simd: SimdLevel::Auto,
};

/// The ground as a scene, or nothing where there is nothing to stand on it.
pub(super) fn ground(
    light: (&BlockedLight, &Sky, &[Sun]),
    origin_in_world: DVec3,
    level: Vectors,
) -> Option<Scene> {
    let blocked = light.0;
    let [low, high] = blocked.tree.bounds()?;
    let (middle, size) = (0.5 * (low + high), high - low);
    let half = 0.5 * size.x.max(size.z) + HEIGHTS * size.y.max(0.1 * size.x.max(size.z));
    // A little lower, so that what lies flat on the ground is seen.
    let height = low.y - blocked.above;
    let corner = |x: f32, z: f32| [middle.x + x * half, height, middle.z + z * half];
    let square = Square {
        corner: Vec3::from(corner(-1.0, -1.0)),
        texel: 2.0 * half / SIDE as f32,
    };
    let alphas = square.alphas(light, level);
    Some(Scene {
        meshes: vec![Mesh {
            positions: vec![
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ],
            uvs: vec![vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]],
            triangles: vec![[0, 2, 1], [0, 3, 2]],
            ..Mesh::default()
        }],
        origin_in_world,
        materials: vec![Material {
            base_texture: Some(TextureUse {
                texture: 0,
                uv_set: 0,
                uv_linear: DMat2::IDENTITY,
                uv_offset: DVec2::ZERO,
                wrap: [Wrap::Clamp; 2],
                magnify: Magnify::Linear,
            }),
            alpha: AlphaMode::Blend,
            sides: Sides::Front,
            lighting: Lighting::Unlit,
            ..Material::default()
        }],
        textures: vec![Texture {
            name: String::new(),
            width: SIDE,
            height: SIDE,
            texels: Texels::LinearF32(
                alphas
                    .into_iter()
                    .map(|alpha| [0.0, 0.0, 0.0, alpha])
                    .collect(),
            ),
        }],
        ..Scene::default()
    })
}

/// The square of the texture.
struct Square {
    /// Where its first texel begins.
    corner: Vec3,
    texel: f32,
}

/// A square of places: its first column and row, and how many texels it is wide.
type Cell = ([usize; 2], usize);

impl Square {
    /// The share of light that is taken from each texel.
    fn alphas(&self, light: (&BlockedLight, &Sky, &[Sun]), level: Vectors) -> Vec<f32> {
        let first = SIDE / FIRST_STEP;
        let mut cells: Vec<Cell> = (0..first * first)
            .map(|at| {
                (
                    [at % first * FIRST_STEP, at / first * FIRST_STEP],
                    FIRST_STEP,
                )
            })
            .collect();
        let mut known: HashMap<[usize; 2], f32> = HashMap::new();
        let mut alphas = vec![0.0; SIDE * SIDE];
        while !cells.is_empty() {
            let mut new: Vec<[usize; 2]> = cells.iter().flat_map(corners).collect();
            new.sort_unstable();
            new.dedup();
            new.retain(|at| !known.contains_key(at));
            known.extend(new.iter().copied().zip(self.taken(&new, light, level)));
            let mut divided = Vec::new();
            for cell in cells {
                let at_corners = corners(&cell).map(|at| known[&at]);
                let ([x, y], step) = cell;
                let spread = at_corners.iter().fold(0.0_f32, |most, a| most.max(*a))
                    - at_corners.iter().fold(1.0_f32, |least, a| least.min(*a));
                if step > 1 && spread > DIFFERENCE {
                    let half = step / 2;
                    let quarters = [[x, y], [x + half, y], [x, y + half], [x + half, y + half]];
                    divided.extend(quarters.map(|at| (at, half)));
                } else {
                    fill(&mut alphas, cell, at_corners);
                }
            }
            cells = divided;
        }
        alphas
    }

    /// The share of light that is taken from places, by their column and row.
    fn taken(
        &self,
        at: &[[usize; 2]],
        (blocked, sky, all_suns): (&BlockedLight, &Sky, &[Sun]),
        level: Vectors,
    ) -> Vec<f32> {
        let place = |[x, y]: &[usize; 2]| Place {
            position: self.corner + Vec3::new(*x as f32, 0.0, *y as f32) * self.texel,
            normal: Vec3::Y,
            side: Facing::Front,
        };
        let places: Vec<Place> = at.iter().map(place).collect();
        let arriving = brightness((&blocked.tree, sky), &places, level);
        let mut suns = vec![0.0; places.len()];
        let mut whole = sky.even(Vec3::Y);
        let per_mean = sky.per_mean();
        for sun in all_suns {
            let power = sun.power.element_sum() * sun.direction.y.max(0.0) / std::f32::consts::PI;
            whole += power * per_mean;
            for (places, suns) in places.chunks(LANES).zip(suns.chunks_mut(LANES)) {
                let mut visible = [0.0; LANES];
                dispatch!(level, simd => reached(simd, &blocked.tree, sun, places, &mut visible));
                for (sum, visible) in suns.iter_mut().zip(visible) {
                    *sum += visible * power * per_mean;
                }
            }
        }
        let taken = |((at, sky), sun): ((&[usize; 2], f32), f32)| {
            let share = 1.0 - (sky + sun) / whole.max(f32::MIN_POSITIVE);
            share.clamp(0.0, 1.0) * fading(*at)
        };
        at.iter().zip(arriving).zip(suns).map(taken).collect()
    }
}

/// The share of a sun's light that reaches up to sixteen places.
#[simd]
fn reached<S: Simd>(simd: S, tree: &Tree, sun: &Sun, places: &[Place], out: &mut Lanes) {
    let mut position = [[0.0; LANES]; 3];
    for (lane, place) in places.iter().enumerate() {
        for (axis, lanes) in position.iter_mut().enumerate() {
            lanes[lane] = place.position[axis];
        }
    }
    sun_visible(simd, tree, sun, Vector::load(simd, &position)).store_slice(out);
}

/// From 1 inside to 0 on the border.
fn fading(at: [usize; 2]) -> f32 {
    let away = at.map(|k| 2.0 * k as f32 / SIDE as f32 - 1.0);
    let away = (away[0] * away[0] + away[1] * away[1]).sqrt();
    let share = ((1.0 - away) / FADING).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

fn corners(&([x, y], step): &Cell) -> [[usize; 2]; 4] {
    [[x, y], [x + step, y], [x, y + step], [x + step, y + step]]
}

/// Fills the texels of a square with the mix of its corners.
fn fill(alphas: &mut [f32], ([x, y], step): Cell, [a, b, c, d]: [f32; 4]) {
    for row in 0..step {
        for column in 0..step {
            let [s, t] = [column, row].map(|k| (k as f32 + 0.5) / step as f32);
            let (upper, lower) = (a + (b - a) * s, c + (d - c) * s);
            alphas[(y + row) * SIDE + x + column] = upper + (lower - upper) * t;
        }
    }
}
