//! The first stage of a frame: triangles are projected, and those that cannot be seen are dropped.
//!
//! A corner in homogeneous screen coordinates is h = (w x, w y, w), in pixels, with w the camera z (1 for parallel
//! rays). The line through two corners is h_j x h_k, whatever the signs of w, so a triangle through the eye plane
//! needs no clipping: a screen position p = (x, y, 1) is inside where all three lines give it the same sign, and the
//! near plane is a bound on the depth key (Olano and Greer 1997). Two triangles that share an edge compute its line
//! from the same numbers with opposite sign, so that no position between them is missed or drawn twice.

use glam::DVec3;
use rayon::prelude::*;
use resample_core::tile::TileRect;
use resample_core::{Camera, Projection};
use resample_mesh::scene::Sides;

use crate::prepare::{Prepared, PreparedMesh};
use crate::screen::{REACH_PX, tile_grid};
use crate::stats::FrameStats;

/// Triangles of one task.
const CHUNK: usize = 4096;

/// A triangle in view, as all tiles see it. It is computed from its corners wherever it is needed: a million of them
/// would fill the memory's bandwidth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenTriangle {
    /// The lines opposite each corner, positive inside: at p they are the barycentric coordinate over w, times `det`.
    pub(crate) lines: [DVec3; 3],
    /// Volume of the three corners' homogeneous coordinates; above 0.
    pub(crate) det: f64,
    /// The depth key as a plane over the screen: 1/w, or -z for parallel rays. Larger is nearer.
    pub(crate) key: DVec3,
    /// The part of it that the frame keeps.
    pub(crate) seen: SeenTriangle,
}

/// A triangle in view, as a frame keeps it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenTriangle {
    /// The rectangle of the screen outside which nothing of it is seen, px: low x, low y, high x, high y.
    pub(crate) bounds_px: [f32; 4],
    /// Index into the prepared meshes.
    pub(crate) mesh: u32,
    /// Index into the mesh's triangles.
    pub(crate) triangle: u32,
    /// The side that is seen.
    pub(crate) facing: Facing,
}

/// A side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Facing {
    Front,
    Back,
}

/// The triangles in view and the tiles that each may touch.
#[derive(Clone, Debug, Default)]
pub(crate) struct InView {
    pub(crate) triangles: Vec<SeenTriangle>,
    pub(crate) rects: Vec<TileRect>,
    /// By mesh: its vertices before the camera.
    corners: Vec<Vec<Corner>>,
}

impl InView {
    /// The triangle at a place of the list.
    #[inline]
    pub(crate) fn triangle(
        &self,
        scene: &Prepared,
        projection: Projection,
        place: u32,
    ) -> ScreenTriangle {
        let seen = self.triangles[place as usize];
        let corners = &self.corners[seen.mesh as usize];
        let corners = scene.meshes[seen.mesh as usize].triangles[seen.triangle as usize]
            .map(|i| corners[i as usize]);
        let Shape { lines, det, key } = Shape::new(projection, &corners);
        ScreenTriangle {
            lines,
            det,
            key,
            seen,
        }
    }
}

/// The triangles that one task found in view.
#[derive(Default)]
struct ChunkInView {
    seen: Vec<SeenTriangle>,
    rects: Vec<TileRect>,
    back_facing: u64,
    off_screen: u64,
}

/// Projects every triangle; drops those that face away, lie outside the picture or before the near plane.
pub(crate) fn cull(scene: &Prepared, camera: &Camera, stats: &mut FrameStats) -> InView {
    let mut in_view = InView::default();
    for (index, mesh) in scene.meshes.iter().enumerate() {
        let corners: Vec<Corner> = mesh
            .positions
            .par_iter()
            .with_min_len(CHUNK)
            .map(|pos| Corner::new(camera, mesh.in_world(pos)))
            .collect();
        let sides = scene.materials[mesh.material].sides;
        let found: Vec<ChunkInView> = mesh
            .triangles
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, triangles)| {
                let mut found = ChunkInView::default();
                for (at, triangle) in triangles.iter().enumerate() {
                    let place = TriangleIndex {
                        mesh: index as u32,
                        triangle: (chunk * CHUNK + at) as u32,
                        sides,
                    };
                    let corners = triangle.map(|i| corners[i as usize]);
                    found.add(camera, &corners, &place);
                }
                found
            })
            .collect();
        stats.triangles += mesh.triangles.len() as u64;
        for found in found {
            stats.back_facing += found.back_facing;
            stats.off_screen += found.off_screen;
            in_view.triangles.extend(found.seen);
            in_view.rects.extend(found.rects);
        }
        in_view.corners.push(corners);
    }
    in_view
}

struct TriangleIndex {
    mesh: u32,
    triangle: u32,
    sides: Sides,
}

/// A corner before the camera.
#[derive(Clone, Copy, Debug)]
struct Corner {
    homogeneous: DVec3,
    z: f64,
}

impl Corner {
    fn new(camera: &Camera, pos_in_world: DVec3) -> Self {
        let p = camera.camera_from_world.transform_point3(pos_in_world);
        let w = match camera.projection {
            Projection::Perspective => p.z,
            Projection::Orthographic => 1.0,
        };
        let homogeneous = DVec3::new(
            camera.fx * p.x + camera.cx * w,
            camera.fy * p.y + camera.cy * w,
            w,
        );
        Self {
            homogeneous,
            z: p.z,
        }
    }

    fn mix(self, other: Self, share: f64) -> Self {
        Self {
            homogeneous: self.homogeneous.lerp(other.homogeneous, share),
            z: self.z + share * (other.z - self.z),
        }
    }
}

/// The planes of a triangle over the screen.
struct Shape {
    lines: [DVec3; 3],
    det: f64,
    key: DVec3,
}

impl Shape {
    #[inline(always)]
    fn new(projection: Projection, corners: &[Corner; 3]) -> Self {
        let [a, b, c] = corners.map(|corner| corner.homogeneous);
        let lines = [b.cross(c), c.cross(a), a.cross(b)];
        let det = a.dot(lines[0]);
        let sign = det.signum();
        let lines = lines.map(|line| line * sign);
        let det = det.abs();
        let key = match projection {
            Projection::Perspective => (lines[0] + lines[1] + lines[2]) / det,
            Projection::Orthographic => -(0..3)
                .map(|i| lines[i] * (corners[i].z / det))
                .sum::<DVec3>(),
        };
        Self { lines, det, key }
    }
}

impl ChunkInView {
    fn add(&mut self, camera: &Camera, corners: &[Corner; 3], place: &TriangleIndex) {
        let bounds = bounds_px(camera.near, corners);
        let rect = bounds.and_then(|bounds| Some((bounds, tiles(camera, &bounds)?)));
        let Some((bounds_px, rect)) = rect else {
            self.off_screen += 1;
            return;
        };
        let [a, b, c] = corners.map(|corner| corner.homogeneous);
        let det = a.dot(b.cross(c));
        // Seen from the front, a counter-clockwise triangle turns clockwise on a screen whose y runs down.
        let facing = if det < 0.0 {
            Facing::Front
        } else {
            Facing::Back
        };
        let hidden_side = facing == Facing::Back && place.sides == Sides::Front;
        let degenerate = hidden_side || det == 0.0 || !det.is_finite();
        if degenerate || !Shape::new(camera.projection, corners).key.is_finite() {
            self.back_facing += 1;
            return;
        }
        self.seen.push(SeenTriangle {
            bounds_px: bounds_px.map(|px| px as f32),
            mesh: place.mesh,
            triangle: place.triangle,
            facing,
        });
        self.rects.push(rect);
    }
}

/// The screen rectangle of the part beyond the near plane; `None` if no part lies beyond it.
fn bounds_px(near: f64, corners: &[Corner; 3]) -> Option<[f64; 4]> {
    let mut bounds: Option<[f64; 4]> = None;
    let mut include = |corner: Corner| {
        let h = corner.homogeneous;
        let (x, y) = (h.x / h.z, h.y / h.z);
        let [x0, y0, x1, y1] = bounds.unwrap_or([x, y, x, y]);
        bounds = Some([x0.min(x), y0.min(y), x1.max(x), y1.max(y)]);
    };
    for i in 0..3 {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        if from.z >= near {
            include(from);
        }
        if (from.z >= near) != (to.z >= near) {
            include(from.mix(to, ((near - from.z) / (to.z - from.z)).clamp(0.0, 1.0)));
        }
    }
    bounds.filter(|b| b.iter().all(|v| !v.is_nan()))
}

/// The tiles whose pixels the rectangle can reach through the pixel filter; `None` outside the picture.
fn tiles(camera: &Camera, bounds: &[f64; 4]) -> Option<TileRect> {
    let size = [camera.width, camera.height];
    let range = |axis: usize| {
        let high = f64::from(size[axis]);
        let first = (bounds[axis] - REACH_PX - 1.0).floor().clamp(0.0, high) as u16;
        let last = (bounds[axis + 2] + REACH_PX + 1.0).ceil().clamp(0.0, high) as u16;
        [first, last]
    };
    let (columns, rows) = (range(0), range(1));
    let rect = tile_grid(camera).rect(columns, rows);
    (rect.area() > 0).then_some(rect)
}

impl ScreenTriangle {
    /// The value at p = (x, y, 1) of something given at the corners, over w: a plane over the screen.
    pub(crate) fn plane(&self, at_corners: [f64; 3]) -> DVec3 {
        (self.lines[0] * at_corners[0]
            + self.lines[1] * at_corners[1]
            + self.lines[2] * at_corners[2])
            / self.det
    }

    /// The flat normal in the world of the side that is seen, not normalised.
    pub(crate) fn flat_normal(&self, mesh: &PreparedMesh) -> DVec3 {
        let [a, b, c] = mesh.corners(self.seen.triangle as usize);
        let normal = (b - a).cross(c - a);
        if self.seen.facing == Facing::Front {
            normal
        } else {
            -normal
        }
    }
}
