//! The order in which a reference is drawn so that nearer samples come later, without comparing depths.
//!
//! The target's eye, seen from the reference, is the epipole. A ray of the target is a half line of the reference that
//! starts there and runs from near to far if the eye is in front of the reference; so samples are drawn towards the
//! epipole. If the eye is behind, its image is the far end, and samples are drawn away from it (McMillan 1995). Any
//! order that is monotone along x and along y on either side of the epipole is such an order.

use glam::{DVec3, DVec4};
use resample_core::{Camera, Projection};

/// How rows (or columns) are visited: ranges of indices, each forwards or backwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisOrder {
    /// Where the epipole splits the axis, in pixels of the reference, clamped to its size.
    split: u32,
    size: u32,
    towards: bool,
}

/// The order around the epipole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OcclusionOrder {
    /// Order of columns.
    pub(crate) columns: AxisOrder,
    /// Order of rows.
    pub(crate) rows: AxisOrder,
}

impl OcclusionOrder {
    /// The order of the `size` cells of `reference` for a picture from `target`.
    pub(crate) fn new(reference: &Camera, target: &Camera, size: [u32; 2]) -> Self {
        let (place, weight) = epipole(reference, target);
        let towards = weight >= 0.0;
        let axis = |along: f64, size: u32| {
            // 0/0, without motion along this axis or at all, is NaN: any split will do.
            let at = along / weight.abs() * if towards { 1.0 } else { -1.0 };
            let split = if at.is_nan() {
                0.0
            } else {
                at.clamp(0.0, f64::from(size))
            };
            AxisOrder {
                split: split.round() as u32,
                size,
                towards,
            }
        };
        Self {
            columns: axis(place[0], size[0]),
            rows: axis(place[1], size[1]),
        }
    }
}

impl AxisOrder {
    /// The indices in the order in which they are drawn.
    pub(crate) fn indices(self) -> impl Iterator<Item = u32> + Clone {
        let (split, size, towards) = (self.split, self.size, self.towards);
        // Towards the split: 0.., then size-1 down to it. Away: the reverse of that.
        (0..size).map(move |i| {
            let step = if towards { i } else { size - 1 - i };
            if step < split {
                step
            } else {
                size - 1 - (step - split)
            }
        })
    }
}

/// The target's eye on the reference's screen: homogeneous x and y (px times weight) and the weight, whose sign says
/// whether the eye is in front.
fn epipole(reference: &Camera, target: &Camera) -> ([f64; 2], f64) {
    let to_world = target.camera_from_world.inverse();
    let eye = match target.projection {
        Projection::Perspective => to_world.translation.extend(1.0),
        // Parallel rays come from infinity, against the view direction.
        Projection::Orthographic => (-to_world.matrix3.z_axis).extend(0.0),
    };
    let pose = reference.camera_from_world;
    let direction: DVec3 = pose.matrix3 * eye.truncate() + eye.w * pose.translation;
    // The eyes coincide up to rounding: the direction between them is noise, and any order will do.
    let scale = (pose.matrix3 * eye.truncate()).length() + pose.translation.length();
    let eye: DVec4 = if direction.length() <= 1e-14 * scale {
        DVec4::ZERO
    } else {
        direction.extend(eye.w)
    };
    let weight = match reference.projection {
        Projection::Perspective => eye.z,
        Projection::Orthographic => eye.w,
    };
    (
        [
            reference.fx * eye.x + reference.cx * weight,
            reference.fy * eye.y + reference.cy * weight,
        ],
        weight,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_run_towards_or_away_from_the_split() {
        let order = |split, towards| {
            AxisOrder {
                split,
                size: 5,
                towards,
            }
            .indices()
            .collect::<Vec<_>>()
        };
        assert_eq!(order(2, true), [0, 1, 4, 3, 2], "towards an epipole inside");
        assert_eq!(
            order(2, false),
            [2, 3, 4, 1, 0],
            "away from an epipole inside"
        );
        assert_eq!(
            order(0, true),
            [4, 3, 2, 1, 0],
            "towards an epipole before the picture"
        );
        assert_eq!(
            order(5, true),
            [0, 1, 2, 3, 4],
            "towards an epipole beyond the picture"
        );
        assert_eq!(
            order(0, false),
            [0, 1, 2, 3, 4],
            "away from an epipole before the picture"
        );
    }
}
