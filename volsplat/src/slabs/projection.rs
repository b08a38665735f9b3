//! Kernels on sheets: the slabs and the tiles that the kernel around a voxel touches.

use glam::{DVec3, Vec3};
use resample_core::tile::{TileGrid, TileRect};
use resample_core::{Camera, GridView, Projection};

use super::settings::{Anchor, SheetSettings};

/// The input for projecting voxels.
#[derive(Clone, Debug)]
pub(crate) struct SheetProjection {
    view: GridView,
    anchor: Anchor,
    grid: TileGrid,
    axes: [Vec3; 3],
    inverse_thickness: f32,
    thickness: f32,
    /// Plane of the anchor, in planes; fractional.
    anchor_plane: f32,
    /// First plane that is seen.
    first_plane: f32,
    reach_z: f32,
    /// Box of all sections: least x, y, greatest x, y, world units.
    reach: [f32; 4],
    near: f32,
}

/// Planes at whose number a voxel is cut off from a frame: beyond this, f32 no longer counts planes one by one.
const MAX_PLANE: f32 = 8_388_608.0;

impl SheetProjection {
    pub(crate) fn new(view: &GridView, camera: &Camera, settings: &SheetSettings) -> Self {
        let m = view.camera_from_grid.matrix3;
        // Slabs before the near plane are not seen; neither are those behind the eye of an orthographic camera.
        let first_plane = (view.near / settings.thickness).floor().max(0.0);
        Self {
            view: *view,
            anchor: settings.anchor,
            grid: TileGrid::new(camera.width as usize, camera.height as usize),
            axes: [m.x_axis.as_vec3(), m.y_axis.as_vec3(), m.z_axis.as_vec3()],
            inverse_thickness: (1.0 / settings.thickness) as f32,
            thickness: settings.thickness as f32,
            anchor_plane: (settings.anchor.camera_z / settings.thickness - 0.5) as f32,
            first_plane: first_plane as f32,
            reach_z: settings.sections.reach_z,
            reach: settings.sections.whole.ends,
            near: view.near as f32,
        }
    }

    /// The pixels first..end, along one axis, that a voxel's sections may touch between two camera z.
    #[inline(always)]
    fn pixels(&self, camera: f32, z: [f32; 2], axis: usize) -> [u16; 2] {
        let (focal, principal) = (
            self.view.focal[axis] as f32,
            self.view.principal_px[axis] as f32,
        );
        let count = if axis == 0 {
            self.grid.width
        } else {
            self.grid.height
        } as f32;
        let scale = match self.view.projection {
            Projection::Perspective => [focal / z[0], focal / z[1]],
            Projection::Orthographic => [focal; 2],
        };
        let at = |offset: f32| [(camera + offset) * scale[0], (camera + offset) * scale[1]];
        let (low, high) = (at(self.reach[axis]), at(self.reach[axis + 2]));
        let first = (low[0].min(low[1]) + principal - 0.5)
            .ceil()
            .clamp(0.0, count);
        let end = ((high[0].max(high[1]) + principal - 0.5).floor() + 1.0).clamp(0.0, count);
        [first as u16, end as u16]
    }

    /// The first plane that cuts the kernel of a voxel (camera space, z relative to the anchor), and the tiles that its
    /// sections touch; `None` where no picture of it is seen.
    #[inline(always)]
    pub(crate) fn cover(&self, camera: Vec3) -> Option<(u32, TileRect)> {
        // Planes first..=last cut the kernel.
        let plane = |z: f32| z * self.inverse_thickness + self.anchor_plane;
        let first = plane(camera.z - self.reach_z).ceil().max(self.first_plane);
        let last = plane(camera.z + self.reach_z).floor();
        if !(last >= first && last < MAX_PLANE) {
            return None;
        }
        // A slab that the near plane cuts begins there.
        let z = [
            (first * self.thickness).max(self.near),
            (last + 1.0) * self.thickness,
        ];
        let rect = self
            .grid
            .rect(self.pixels(camera.x, z, 0), self.pixels(camera.y, z, 1));
        (rect.area() > 0).then_some((first as u32, rect))
    }

    /// Camera space position of a grid position, z relative to the anchor.
    #[inline(always)]
    pub(crate) fn at_corner(&self, corner: DVec3) -> [Vec3; 2] {
        let in_camera = self.view.camera_from_grid.transform_point3(corner);
        [
            (in_camera - self.anchor.camera_z * DVec3::Z).as_vec3(),
            (corner - self.anchor.grid).as_vec3(),
        ]
    }

    /// The camera movement per grid axis.
    pub(crate) fn axes(&self) -> [Vec3; 3] {
        self.axes
    }
}
