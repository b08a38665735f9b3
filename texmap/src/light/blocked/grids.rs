//! Grids of places on triangles, by which the light of a scene is stored.

use glam::Vec3;

/// The places on a triangle: `(steps + 1) (steps + 2) / 2` in rows, from corner 2 towards corner 0, rows towards corner 1.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Grid {
    /// The first of its indices.
    pub(crate) start: u32,
    pub(crate) steps: u32,
}

/// The grids of a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeshGrids {
    /// By side, the front first, and by triangle; empty where the side takes no light.
    pub(crate) grids: [Vec<Grid>; 2],
}

/// The grids of all meshes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Grids {
    pub(crate) meshes: Vec<MeshGrids>,
    /// Places by grid.
    pub(crate) indices: Vec<u32>,
}

/// Index of the place `i` steps towards corner 0 and `j` towards corner 1.
#[inline(always)]
pub(crate) fn at(steps: u32, i: u32, j: u32) -> u32 {
    j * (2 * steps + 3 - j) / 2 + i
}

/// How far a place of a triangle lies below the curved surface that its normals mean (Hanika 2021): else triangles that curve outwards would
/// shade themselves where light grazes.
#[inline(always)]
pub(crate) fn lift(position: Vec3, corners: [(Vec3, Vec3); 3], shares: [f32; 3]) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for ((corner, normal), share) in corners.into_iter().zip(shares) {
        sum -= normal * ((position - corner).dot(normal).min(0.0) * share);
    }
    sum
}
