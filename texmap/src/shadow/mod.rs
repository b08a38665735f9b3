//! Light that a mesh blocks from itself, and the ground that catches its shadow.
//!
//! In the order in which data flow: triangles that block light (`bvh`), directions of light (`sky`), places on surfaces (`places`), the light
//! that reaches each (`bake`), what pixels take of it (`look`), small bright lights that each pixel follows by itself (`suns`), and the ground
//! (`ground`). Places are found once for a scene, from no view.

pub(crate) mod bvh;
pub(crate) mod sky;
pub(crate) mod places;
pub(crate) mod bake;
pub(crate) mod look;
pub(crate) mod suns;
pub(crate) mod ground;

use glam::Vec3;
use resample_core::simd::Vectors;

use crate::light::environment::Map;
use crate::prepare::mip::Pyramid;
use crate::prepare::{PreparedMaterial, PreparedMesh};
use crate::shadow::bake::{PlaceLight, bake, mix};
use crate::shadow::bvh::{Blocker, Tree};
use crate::shadow::places::{Builder, Grids, ROUNDS};
use crate::shadow::sky::{Sky, directions};
use resample_mesh::scene::AlphaMode;

/// The light on a scene whose triangles block it.
#[derive(Clone, Debug)]
pub(crate) struct BlockedLight {
    pub(crate) grids: Grids,
    pub(crate) lights: Vec<PlaceLight>,
    pub(crate) tree: Tree,
    /// Rays begin this far from surfaces, world units.
    pub(crate) above: f32,
}

impl BlockedLight {
    pub(crate) fn new(
        (meshes, materials, pyramids): (&[PreparedMesh], &[PreparedMaterial], &[Pyramid]),
        sky: &Map,
        level: Vectors,
    ) -> Self {
        let blockers = blockers(meshes, materials, pyramids);
        let diagonal = diagonal(&blockers);
        let tree = Tree::new(&blockers);
        let mut builder = Builder::new(meshes, materials, diagonal);
        let directions = directions(builder.places.len());
        let sky = Sky::new(|direction| sky.at(direction).truncate(), directions);
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
        Self {
            grids,
            lights,
            tree,
            above: 1e-4 * diagonal,
        }
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
                (material.base_colour.w * texture).clamp(0.0, 1.0)
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
