//! How a volume is framed: what of it is shown, and which way it stands.
//!
//! Takes a volume, gives a box in the world and a stance. The box is that of the voxel centres, widened by the
//! kernels around them.

use glam::DVec3;
use volsplat::Described;

use super::Stance;

/// The stance of a volume: `up` if asked for, else what the file says, else y.
///
/// Azimuth 0 has the world's x axis to the right (y, if x is up). A medical volume whose y axis points to the
/// patient's front is seen from there instead, so that azimuth 0 always shows the face.
pub fn stance(volume: &dyn Described, up: Option<DVec3>) -> Stance {
    let lattice = volume.lattice();
    let up = up.or(lattice.up_hint).unwrap_or(DVec3::Y);
    let space = lattice.space.as_deref().unwrap_or("").to_lowercase();
    let y_is_front = space.split('-').nth(1) == Some("anterior");
    if y_is_front {
        Stance::facing(up, DVec3::NEG_X)
    } else {
        Stance::upright(up)
    }
}

/// Two corners of the box, along the world's axes, around all voxels of a volume.
pub fn grid_bounds(volume: &dyn Described) -> [DVec3; 2] {
    let lattice = volume.lattice();
    let last = DVec3::from_array(lattice.dims.map(|n| (n - 1) as f64));
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
    let in_world = |i: u32| lattice.world_from_index.transform_point3(corner(i) * last);
    (1..8)
        .map(in_world)
        .fold([in_world(0); 2], |[low, high], pos| {
            [low.min(pos), high.max(pos)]
        })
}

/// The box of voxel centres, widened by the kernels around them.
///
/// A kernel reaches about two spacings from its voxel and has all but faded after one, so one is added.
pub fn with_kernels(bounds: [DVec3; 2], volume: &dyn Described) -> [DVec3; 2] {
    let reach = volume.lattice().spacing().into_iter().fold(0.0, f64::max);
    [bounds[0] - reach, bounds[1] + reach]
}
