//! The clip by definition: a position is kept where it satisfies every inequality, as they are written down.
//!
//! Takes a scene and a position in voxel indices; the inequalities of the world are tested in the world.

use glam::{DAffine3, DVec3};
use volsplat::Clip;

use crate::twins::samples::Scene;

/// Returns true if the clip of the scene keeps a position, in the grid, with every half-space `wider` (voxels).
pub fn keeps(scene: &Scene, pos_in_grid: DVec3, wider: f64) -> bool {
    keeps_with(
        &scene.options.clip,
        &scene.volume.world_from_index,
        pos_in_grid,
        wider,
    )
}

/// Returns true if a clip keeps a position in the grid that `map` places in the world.
pub fn keeps_with(clip: &Clip, map: &DAffine3, pos_in_grid: DVec3, wider: f64) -> bool {
    let world = map.transform_point3(pos_in_grid);
    let in_box = |pos: DVec3, ends: Option<[DVec3; 2]>, wider: DVec3| {
        ends.is_none_or(|[low, high]| pos.cmpge(low - wider).all() && pos.cmple(high + wider).all())
    };
    // A voxel along the gradient of normal . p is this long, times the normal's length.
    let grown = |normal: DVec3| wider * (map.matrix3.transpose() * normal).length();
    let in_world = DVec3::from(DVec3::AXES.map(grown));
    in_box(world, clip.crop_in_world, in_world)
        && in_box(pos_in_grid, clip.crop_in_grid, DVec3::splat(wider))
        && clip
            .planes
            .iter()
            .all(|plane| plane.normal.dot(world) >= plane.offset - grown(plane.normal))
}
