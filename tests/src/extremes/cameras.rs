//! Cameras at extremes: fields of view, directions, and cameras that are refused.

use super::row::Result;
use glam::{DAffine3, DMat3, DVec3};
use resample_core::{Camera, LookAt};
use volsplat::{RenderOptions, Renderer, Volume, Voxels};

use super::row::{Claim, Row};
use super::voxels::{Voxel, eye, white};

const VIEW: Claim = Claim {
    quantity: "opacity of splats",
    bound: 1e-3,
    why: "cameras are f64, and the footprint is exact at any angle",
};

const REFUSED: Claim = Claim {
    quantity: "refused before any work",
    bound: 0.0,
    why: "numbers are checked where they come in",
};

/// All rows.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let narrow = eye(DVec3::Z * -1e6, DVec3::ZERO, 1e-4)?;
    rows.push(VIEW.worst("field of view of 1e-4 degrees", Voxel::one(narrow).pairs()?));
    let wide = eye(DVec3::Z * -4.0, DVec3::ZERO, 179.99)?;
    rows.push(VIEW.worst("field of view of 179.99 degrees", Voxel::one(wide).pairs()?));
    // The voxel lies 89.9 degrees off the axis, where such a picture still has pixels.
    let angle = 89.9f64.to_radians();
    let aside = eye(DVec3::ZERO, DVec3::Z, 179.99)?;
    let voxel = Voxel {
        placed: DAffine3::from_translation(9.0 * DVec3::new(angle.sin(), 0.0, angle.cos())),
        ..Voxel::one(aside)
    };
    rows.push(VIEW.worst("a voxel 89.9 degrees off the axis", voxel.pairs()?));
    let pose = LookAt {
        position: DVec3::new(0.0, -6.0, 0.0),
        target: DVec3::ZERO,
        up: DVec3::new(1e-5, 1.0, 0.0),
    };
    let steep = Camera::perspective(&pose, 0.7, [33, 33])?;
    rows.push(VIEW.worst(
        "up 1e-5 from the view direction",
        Voxel::one(steep).pairs()?,
    ));
    let mut skewed = eye(DVec3::new(2.0, 1.0, -6.0), DVec3::ZERO, 40.0)?;
    skewed.camera_from_world.matrix3 *= DMat3::from_diagonal(DVec3::new(1.00004, 1.0, 0.99997));
    rows.push(VIEW.worst("a rotation off by 8e-5", Voxel::one(skewed).pairs()?));
    rows.extend(refusals()?);
    Ok(rows)
}

fn refusals() -> Result<Vec<Row>> {
    let volume = |value: f32, spacing: f64| {
        let placed = DAffine3::from_scale(DVec3::splat(spacing));
        Volume::new([2; 3], Voxels::F32(vec![value; 8]), placed)
    };
    let drawn = |camera: Camera| -> Result<()> {
        let mut renderer =
            Renderer::new(&volume(1.0, 1.0)?, &white(0.5)?, &RenderOptions::default())?;
        renderer.render(&camera)?;
        Ok(())
    };
    let mut flat = eye(DVec3::Z * -6.0, DVec3::ZERO, 40.0)?;
    flat.camera_from_world.matrix3.x_axis = DVec3::ZERO;
    let same = eye(DVec3::ZERO, DVec3::ZERO, 40.0);
    Ok(vec![
        REFUSED.refused("a voxel that is NaN", volume(f32::NAN, 1.0)),
        REFUSED.refused("a voxel that is infinite", volume(f32::INFINITY, 1.0)),
        REFUSED.refused("a spacing of 1e-39", volume(1.0, 1e-39)),
        REFUSED.refused("a spacing of 1e39", volume(1.0, 1e39)),
        REFUSED.refused(
            "an eye 1e30 voxels away",
            drawn(eye(DVec3::Z * -1e30, DVec3::ZERO, 40.0)?),
        ),
        REFUSED.refused("a singular camera", drawn(flat)),
        REFUSED.refused("an eye on its target", same),
    ])
}
