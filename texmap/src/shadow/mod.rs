//! Light that a mesh blocks from itself, and the ground that catches its shadow.
//!
//! Takes a prepared scene, once, from no view; gives the light at places on its surfaces. In the order in which data flow: places (`places`), the light that
//! reaches each (`bake`), and the ground (`ground`).

pub(crate) mod places;
pub(crate) mod bake;
pub(crate) mod ground;

use glam::Vec3;

use crate::light::blocked::BlockedLight;
use crate::light::blocked::bvh::{Blocker, Tree};
use crate::light::blocked::sky::{Sky, directions};
use crate::options::{RenderOptions, Shadows};
use crate::prepare::mip::Pyramid;
use crate::prepare::{MOST_TRANSMITTED, Prepared, PreparedMaterial, PreparedMesh};
use crate::shadow::bake::{bake, mix};
use crate::shadow::ground::{UNLIT, ground};
use crate::shadow::places::{Builder, ROUNDS};
use resample_mesh::scene::{AlphaMode, Scene};

/// Finds the light that reaches the surfaces of a scene, and adds a ground to it, as the options have it; `None` without shadows, or without light of
/// surroundings.
pub(crate) fn block_light(
    scene: &Scene,
    prepared: &mut Prepared,
    options: &RenderOptions,
) -> Option<BlockedLight> {
    let environment = prepared.environment.clone()?;
    let sky = environment.sky.as_ref()?;
    let radiance = |direction| sky.at(direction).truncate();
    let blocked = blocked_light(prepared, &radiance, options);
    if options.shadows == Shadows::Ground {
        let sky = Sky::new(radiance, ground::DIRECTIONS);
        let light = (&blocked, &sky, &environment.suns[..]);
        if let Some(ground) = ground(light, scene.origin_in_world, options.simd.resolve()) {
            prepared.append(Prepared::new(&ground, &UNLIT));
        }
    }
    Some(blocked)
}

fn blocked_light(
    prepared: &Prepared,
    radiance: &dyn Fn(Vec3) -> Vec3,
    options: &RenderOptions,
) -> BlockedLight {
    let level = options.simd.resolve();
    let (meshes, materials) = (&prepared.meshes[..], &prepared.materials[..]);
    let blockers = blockers(meshes, materials, &prepared.pyramids);
    let diagonal = diagonal(&blockers);
    let tree = Tree::new(&blockers);
    let mut builder = Builder::new(meshes, materials, diagonal);
    let sky = Sky::new(radiance, directions(builder.places.len()));
    let (mut lights, mut brightness) = (Vec::new(), Vec::new());
    for round in 0..=ROUNDS {
        let new = bake((&tree, &sky), &builder.places[lights.len()..], level);
        let (of_round, bright): (Vec<_>, Vec<_>) = new.into_iter().unzip();
        lights.extend(of_round);
        brightness.extend::<Vec<f32>>(bright);
        if round == ROUNDS || !builder.divide(&brightness) {
            break;
        }
    }
    let (grids, mixed) = builder.finish(meshes.len());
    mix(&mut lights, &mixed);
    BlockedLight {
        grids,
        lights,
        tree,
        above: 1e-4 * diagonal,
    }
}

/// Every triangle. Materials with holes and translucent ones take the mean of their alpha.
fn blockers(
    meshes: &[PreparedMesh],
    materials: &[PreparedMaterial],
    pyramids: &[Pyramid],
) -> Vec<Blocker> {
    let mut blockers = Vec::new();
    for mesh in meshes {
        let material = &materials[mesh.material];
        let opacity = match material.alpha {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask { .. } | AlphaMode::Blend => {
                let texture = material.base.map_or(1.0, |base| pyramids[base].mean().w);
                let glass = material.physical.and_then(|physical| physical.layers);
                let passed = glass.map_or(0.0, |layers| MOST_TRANSMITTED * layers.glass);
                (material.base_colour.w * texture * (1.0 - passed)).clamp(0.0, 1.0)
            }
        };
        if opacity > 0.0 {
            blockers.extend(mesh.triangles.iter().map(|triangle| Blocker {
                corners: triangle.map(|i| Vec3::from(mesh.positions[i as usize])),
                opacity,
            }));
        }
    }
    blockers
}

fn diagonal(blockers: &[Blocker]) -> f32 {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for corner in blockers.iter().flat_map(|blocker| blocker.corners) {
        (low, high) = (low.min(corner), high.max(corner));
    }
    (high - low).length().max(f32::MIN_POSITIVE)
}
