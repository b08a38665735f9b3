//! The edges of a tile: its triangles as a surface to walk over.

use crate::prepare::{LightKind, PreparedMesh};
use crate::tile::task::Tile;
use crate::tile::visible::Visible;
use crate::visibility::edges::Edges;
use crate::visibility::walk::{NextTriangle, crossing};
use crate::visibility::{RasterTriangle, walk};

/// Finds the edges between sub-pixels across which colour may jump.
pub(crate) fn find_edges<'a>(tile: &Tile, visible: &Visible, edges: &'a mut Edges) -> &'a Edges {
    let Visible {
        subpixels, rasters, ..
    } = visible;
    if subpixels.alone.is_some() {
        edges.clear();
        return edges;
    }
    let mesh = TileMesh { tile, rasters };
    let seen_by = (tile.frame.filter, tile.frame.simd);
    edges.find(seen_by, &subpixels.ids, |pair| crossing(&mesh, pair));
    edges
}

/// The triangles of a tile as a surface to walk over.
struct TileMesh<'a> {
    tile: &'a Tile<'a>,
    rasters: &'a [Option<RasterTriangle>],
}

impl walk::Mesh for TileMesh<'_> {
    fn triangle(&self, id: u32) -> Option<&RasterTriangle> {
        self.rasters.get(id as usize)?.as_ref()
    }

    fn meet(&self, [a, b]: [u32; 2]) -> bool {
        let tile = self.tile;
        let (Some(&of_a), Some(&of_b)) = (tile.list.get(a as usize), tile.list.get(b as usize))
        else {
            return false;
        };
        let triangles = &tile.frame.in_view.triangles;
        let (a, b) = (&triangles[of_a as usize], &triangles[of_b as usize]);
        let mesh = &tile.frame.scene.meshes[a.mesh as usize];
        if a.mesh != b.mesh || a.facing != b.facing || tile.is_flat(mesh) {
            return false;
        }
        let [x, y, z] = mesh.triangles[a.triangle as usize];
        let others = mesh.triangles[b.triangle as usize];
        others.contains(&x) | others.contains(&y) | others.contains(&z)
    }

    fn beyond(&self, id: u32, corner: usize, expected: u32) -> Option<NextTriangle> {
        let seen = self.tile.seen(id);
        let mesh = &self.tile.frame.scene.meshes[seen.mesh as usize];
        let next = mesh.neighbours[seen.triangle as usize][corner]?;
        let id = self.tile.place(seen.mesh, next.triangle, expected)?;
        let line = |triangle: u32, corner: usize| {
            let corners = mesh.triangles[triangle as usize];
            [corners[(corner + 1) % 3], corners[(corner + 2) % 3]]
        };
        let [a, b] = line(seen.triangle, corner);
        let jumps = self.tile.is_flat(mesh)
            || ![[a, b], [b, a]].contains(&line(next.triangle, next.corner()));
        Some(NextTriangle {
            id,
            corner: next.corner(),
            jumps,
        })
    }
}

impl Tile<'_> {
    /// Returns true if each triangle of a mesh has a light of its own.
    fn is_flat(&self, mesh: &PreparedMesh) -> bool {
        mesh.normals.is_empty()
            && self.frame.scene.materials[mesh.material].light != LightKind::None
    }

    /// Place in the tile's list of a triangle of the scene; likely it is `expected`.
    fn place(&self, mesh: u32, triangle: u32, expected: u32) -> Option<u32> {
        let key = |&index: &u32| {
            let seen = &self.frame.in_view.triangles[index as usize];
            (seen.mesh, seen.triangle)
        };
        let wanted = (mesh, triangle);
        if self.list.get(expected as usize).map(key) == Some(wanted) {
            return Some(expected);
        }
        // Lists keep the order of the scene.
        let place = self.list.binary_search_by_key(&wanted, key).ok()?;
        Some(place as u32)
    }
}
