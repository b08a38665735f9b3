//! The first stage of a frame: triangles are projected, and those that cannot be seen are dropped.
//!
//! A corner in homogeneous screen coordinates is h = (w x, w y, w), in pixels, with w the camera z (1 for parallel
//! rays). The line through two corners is h_j x h_k, whatever the signs of w, so a triangle through the eye plane
//! needs no clipping: a screen position p = (x, y, 1) is inside where all three lines give it the same sign, and the
//! near plane is a bound on the depth key (Olano and Greer 1997). Two triangles that share an edge compute its line
//! from the same numbers with opposite sign, so that no position between them is missed or drawn twice.

use glam::DVec3;
use rayon::prelude::*;
use resample_core::tile::{TileGrid, TileRect};
use resample_core::{Camera, Projection};

use crate::prepare::{Prepared, PreparedMesh};
use crate::scene::Sides;
use crate::span::REACH_PX;
use crate::stats::FrameStats;

/// Triangles of one task.
const CHUNK: usize = 4096;

/// A triangle in view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenTriangle {
    /// The lines opposite each corner, positive inside: at p they are the barycentric coordinate over w, times `det`.
    pub(crate) lines: [DVec3; 3],
    /// Volume of the three corners' homogeneous coordinates; above 0.
    pub(crate) det: f64,
    /// The depth key as a plane over the screen: 1/w, or -z for parallel rays. Larger is nearer.
    pub(crate) key: DVec3,
    /// The rectangle of the screen outside which nothing of it is seen, px: low x, low y, high x, high y.
    pub(crate) bounds_px: [f64; 4],
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

/// What became of one triangle.
enum Fate {
    Seen(ScreenTriangle, TileRect),
    BackFacing,
    OffScreen,
}

/// The triangles in view and the tiles that each may touch.
#[derive(Clone, Debug, Default)]
pub(crate) struct InView {
    pub(crate) triangles: Vec<ScreenTriangle>,
    pub(crate) rects: Vec<TileRect>,
}

/// Projects every triangle; drops those that face away, lie outside the picture or before the near plane.
pub(crate) fn cull(scene: &Prepared, camera: &Camera, stats: &mut FrameStats) -> InView {
    let mut in_view = InView::default();
    for (index, mesh) in scene.meshes.iter().enumerate() {
        let sides = scene.materials[mesh.material].sides;
        let project = |corner: DVec3| Corner::new(camera, corner);
        let fates: Vec<Fate> = (0..mesh.triangles.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|t| {
                let place = Place {
                    mesh: index as u32,
                    triangle: t as u32,
                    sides,
                };
                fate(camera, &mesh.corners(t).map(project), &place)
            })
            .collect();
        stats.triangles += mesh.triangles.len() as u64;
        for fate in fates {
            match fate {
                Fate::BackFacing => stats.back_facing += 1,
                Fate::OffScreen => stats.off_screen += 1,
                Fate::Seen(triangle, rect) => {
                    in_view.triangles.push(triangle);
                    in_view.rects.push(rect);
                }
            }
        }
    }
    in_view
}

struct Place {
    mesh: u32,
    triangle: u32,
    sides: Sides,
}

/// A corner before the camera.
#[derive(Clone, Copy)]
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

fn fate(camera: &Camera, corners: &[Corner; 3], place: &Place) -> Fate {
    let Some(bounds_px) = bounds_px(camera.near, corners) else {
        return Fate::OffScreen;
    };
    let Some(rect) = tiles(camera, &bounds_px) else {
        return Fate::OffScreen;
    };
    let [a, b, c] = corners.map(|corner| corner.homogeneous);
    let lines = [b.cross(c), c.cross(a), a.cross(b)];
    let det = a.dot(lines[0]);
    // Seen from the front, a counter-clockwise triangle turns clockwise on a screen whose y runs down.
    let facing = if det < 0.0 {
        Facing::Front
    } else {
        Facing::Back
    };
    let hidden_side = facing == Facing::Back && place.sides == Sides::Front;
    if hidden_side || det == 0.0 || !det.is_finite() {
        return Fate::BackFacing;
    }
    let sign = det.signum();
    let lines = lines.map(|line| line * sign);
    let det = det.abs();
    let key = match camera.projection {
        Projection::Perspective => (lines[0] + lines[1] + lines[2]) / det,
        Projection::Orthographic => -(0..3)
            .map(|i| lines[i] * (corners[i].z / det))
            .sum::<DVec3>(),
    };
    if !key.is_finite() {
        return Fate::BackFacing;
    }
    let Place { mesh, triangle, .. } = *place;
    Fate::Seen(
        ScreenTriangle {
            lines,
            det,
            key,
            bounds_px,
            mesh,
            triangle,
            facing,
        },
        rect,
    )
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
    let grid = TileGrid {
        width: camera.width as usize,
        height: camera.height as usize,
    };
    let rect = grid.rect(columns, rows);
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
        let [a, b, c] = mesh.corners(self.triangle as usize);
        let normal = (b - a).cross(c - a);
        if self.facing == Facing::Front {
            normal
        } else {
            -normal
        }
    }
}
