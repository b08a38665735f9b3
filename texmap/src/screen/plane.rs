//! Planes over a tile: quantities linear over the screen, in f32, relative to the tile.

use glam::DVec3;

/// A plane over the tile: value = `[0]` x + `[1]` y + `[2]`, x and y in px from the corner of the tile's border.
pub(crate) type Plane = [f32; 3];

/// A plane of the screen as one of the tile whose border's corner is at `corner_px`, in f64.
#[inline]
pub(crate) fn moved(plane: DVec3, corner_px: [f64; 2]) -> DVec3 {
    DVec3::new(
        plane.x,
        plane.y,
        plane.x * corner_px[0] + plane.y * corner_px[1] + plane.z,
    )
}

#[inline]
pub(crate) fn narrow(plane: DVec3) -> Plane {
    plane.to_array().map(|v| v as f32)
}

#[inline(always)]
pub(crate) fn value(plane: &Plane, at: [f32; 2]) -> f32 {
    plane[0] * at[0] + plane[1] * at[1] + plane[2]
}
