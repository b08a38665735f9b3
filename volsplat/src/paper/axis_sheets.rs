//! The axis-sheets order: slices of the grid, summed within and composited front to back (Westover).
//!
//! The samples of a slice of voxels are summed on the screen, whatever their depths, and the slices are composited one
//! over another. The slices stand across the grid axis that looks most nearly along the view, so when the view turns
//! past 45 degrees the slices change, and with them what is summed and what hides what: the picture jumps. The order
//! exists to be measured against; everything but order and sums is shared with [`crate::paper::every_sample`].
//! Source: L. Westover, "Footprint Evaluation for Volume Rendering", SIGGRAPH 1990.
//!
//! Limits: samples that the near plane cuts are composited one by one, in front of all slices.

use resample_core::{GridView, Projection};

use crate::grid::{Bounds, place};

/// The slices of a frame and their order, nearest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SliceOrder {
    /// The grid axis that the slices stand across.
    pub(crate) axis: usize,
    /// The first slice behind the eye's place on that axis; slices are counted from here in both directions.
    first: i64,
    /// Each slice holds samples of 2 to this layers.
    halvings: u32,
}

impl SliceOrder {
    /// The order for a view of a grid of `dims` voxels.
    pub(crate) fn new(view: &GridView, dims: [usize; 3]) -> Self {
        let axis = facing_axis(view);
        let end = dims[axis] as i64;
        let first = match view.projection {
            // No ray meets slices on both sides of the eye, so that their order among one another is free.
            Projection::Perspective => (view.origin[axis].ceil() as i64).clamp(0, end),
            Projection::Orthographic if view.w0[axis] > 0.0 => 0,
            Projection::Orthographic => end,
        };
        Self {
            axis,
            first,
            halvings: 0,
        }
    }

    /// The same slices, for samples whose lattice halves them this often.
    pub(crate) fn halved(self, halvings: u32) -> Self {
        Self { halvings, ..self }
    }

    /// The sorting key of the slice of a sample at a packed place of a brick.
    #[inline(always)]
    pub(crate) fn key(&self, bounds: &Bounds, packed: u16) -> u32 {
        let layer = i64::from(bounds.corner[self.axis]) + i64::from(place(packed)[self.axis]);
        self.key_of(layer >> self.halvings)
    }

    /// The sorting key of a slice: its distance from the eye in slices, twice, and odd on the near side of `first`.
    #[inline(always)]
    fn key_of(&self, slice: i64) -> u32 {
        let steps = slice - self.first;
        (if steps >= 0 {
            2 * steps
        } else {
            -2 * steps - 1
        }) as u32
    }
}

/// The axis whose slices face the view most squarely: the normal of a slice is a row of the inverse map.
fn facing_axis(view: &GridView) -> usize {
    let grid_from_camera = view.camera_from_grid.matrix3.inverse();
    let facing = |axis: usize| view.w0[axis].abs() / grid_from_camera.row(axis).length();
    (1..3).fold(0, |best, axis| {
        if facing(axis) > facing(best) {
            axis
        } else {
            best
        }
    })
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3};
    use resample_core::{Camera, LookAt};

    use super::*;

    fn order(position: DVec3, target: DVec3) -> SliceOrder {
        let pose = LookAt {
            position,
            target,
            up: DVec3::new(0.1, 1.0, 0.2),
        };
        let camera = Camera::perspective(&pose, 0.8, [32, 32]).expect("valid");
        SliceOrder::new(
            &GridView::new(&camera, &DAffine3::from_scale(DVec3::new(1.0, 1.0, 2.0))),
            [10, 10, 10],
        )
    }

    #[test]
    fn slices_face_the_view_and_come_nearest_first() {
        let along_x = order(DVec3::new(-20.0, 5.0, 8.0), DVec3::new(5.0, 6.0, 9.0));
        assert_eq!(along_x.axis, 0, "the view looks along x");
        let keys: Vec<u32> = (0..10).map(|slice| along_x.key_of(slice)).collect();
        assert!(keys.is_sorted(), "from the front: {keys:?}");
        let from_behind = order(DVec3::new(5.0, 6.0, 50.0), DVec3::new(5.0, 5.0, 9.0));
        assert_eq!(from_behind.axis, 2, "the view looks along z");
        let keys: Vec<u32> = (0..10)
            .rev()
            .map(|slice| from_behind.key_of(slice))
            .collect();
        assert!(keys.is_sorted(), "from behind: {keys:?}");
    }

    #[test]
    fn slices_on_both_sides_of_the_eye_are_told_apart() {
        let inside = order(DVec3::new(4.5, 5.0, 8.0), DVec3::new(9.0, 5.5, 8.5));
        let mut keys: Vec<u32> = (0..10).map(|slice| inside.key_of(slice)).collect();
        assert_eq!((keys[5], keys[4]), (0, 1), "the two slices beside the eye");
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), 10, "no two slices share a key");
    }
}
