//! Settings shared by every tile of a frame: the slabs, the light, and how each channel is read and classified.
//!
//! Slabs are parallel to the image plane and equally thick; the plane of slab k is at camera z = (k + 1/2) thickness,
//! fixed to the eye, so that nothing pops when the view turns.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use resample_core::composite::DepthRule;
use resample_core::simd::Vectors;
use resample_core::{Camera, GridView, OpacityMode};

use crate::Error;
use crate::light::{GradientCurve, ShadeSettings};
use crate::look::options::{Blend, DepthPlane, RenderOptions};
use crate::look::palette::Palette;
use crate::look::scene::{Channel, Look, Scene};
use crate::look::transfer::TransferFunction;
use crate::slabs::table::TransferTable;

/// Boxes on the screen and along the view are wider than what they hold by this much, in pixels and in voxels, so that
/// the rounding of their ends never drops a sample that lies on them: f32 counts 2^17 pixels to 1/128.
pub(crate) const BOX_MARGIN: f64 = 1.0 / 64.0;

/// A point in the middle of the field. Positions on planes and of voxels are taken relative to it, in f64 once per
/// plane and once per brick, so that the weights of a cell sum to 1 however far the eye is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anchor {
    /// A whole grid position: voxels are then whole numbers away.
    pub(crate) grid: DVec3,
    /// Its camera z, world units.
    pub(crate) camera_z: f64,
}

/// The slabs of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slabs {
    pub(crate) anchor: Anchor,
    /// The length in which the picture counts, world units.
    pub(crate) length: f64,
    /// Along camera z, in that length.
    pub(crate) thickness: f64,
    /// Over which opacity is meant, in that length.
    pub(crate) opacity_unit: f64,
}

/// How far a kernel reaches from its centre in camera space, world units. All kernels of a grid reach equally far, whatever the
/// perspective.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KernelReach {
    /// Least x and y, greatest x and y: for one vector of four.
    pub(crate) ends: [f32; 4],
    /// Half its extent along camera z.
    pub(crate) z: f32,
}

impl KernelReach {
    /// That of the box -1..1 of a grid whose axes are the columns of `camera_from_grid`: the trilinear kernel.
    pub(crate) fn of_cube(camera_from_grid: DMat3) -> Self {
        Self::of([0, 1, 2].map(|axis| camera_from_grid.row(axis).abs().element_sum()))
    }

    /// That of the ball of this radius of such a grid, on slabs of this thickness.
    pub(crate) fn of_ball(camera_from_grid: DMat3, radius: f64, thickness: f64) -> Self {
        let [x, y, z] = [0, 1, 2].map(|axis| radius * camera_from_grid.row(axis).length());
        Self::of([x, y, z + 0.5 * thickness])
    }

    fn of([x, y, z]: [f64; 3]) -> Self {
        // One step of f32 outwards: rounding never cuts the box.
        let [x, y] = [x, y].map(|end| (end as f32).next_up());
        Self {
            ends: [-x, -y, x, y],
            z: z as f32,
        }
    }
}

/// Settings shared by every tile of a frame.
#[derive(Clone, Debug)]
pub(crate) struct SheetSettings {
    pub(crate) level: Vectors,
    pub(crate) table: TransferTable,
    pub(crate) reach: KernelReach,
    pub(crate) anchor: Anchor,
    /// Slab thickness along camera z, world units.
    pub(crate) thickness: f64,
    /// Planes that are open at a time: a power of two, and at least what one kernel may span.
    pub(crate) ring_len: usize,
    /// Where extinction follows the gradient: how.
    pub(crate) gradient_curve: Option<GradientCurve>,
    /// World length over which the transfer function's opacity is meant.
    pub(crate) unit_in_world: f64,
    pub(crate) opacity: OpacityMode,
    /// Where samples are lit: how.
    pub(crate) shade: Option<ShadeSettings>,
    pub(crate) world_from_camera: DMat3,
    pub(crate) depth: DepthRule,
    pub(crate) min_transmittance: f32,
}

impl Anchor {
    /// The anchor at a place of the grid.
    pub(crate) fn new(grid: DVec3, view: &GridView) -> Self {
        let camera_z = view.camera_from_grid.transform_point3(grid).z;
        Self { grid, camera_z }
    }
}

impl SheetSettings {
    /// The settings of a frame.
    pub(crate) fn new(
        options: &RenderOptions,
        camera: &Camera,
        reach: KernelReach,
        table: &TransferTable,
        slabs: Slabs,
    ) -> Self {
        Self {
            level: options.simd.resolve(),
            table: table.clone(),
            gradient_curve: options
                .gradient_opacity
                .as_ref()
                .map(|curve| GradientCurve::new(curve, slabs.length)),
            ring_len: Self::ring_len(&reach, slabs.thickness),
            reach,
            thickness: slabs.thickness,
            unit_in_world: slabs.opacity_unit,
            anchor: slabs.anchor,
            opacity: options.opacity,
            shade: ShadeSettings::new(options, camera),
            world_from_camera: camera.camera_from_world.matrix3.transpose(),
            depth: match options.depth {
                DepthPlane::None => DepthRule::Skip,
                DepthPlane::Expected => DepthRule::Expected,
            },
            min_transmittance: options.min_transmittance,
        }
    }

    /// Returns true if the picture depends on the gradient.
    pub(crate) fn needs_gradients(&self) -> bool {
        self.shade.is_some() || self.gradient_curve.is_some()
    }

    /// The slab, fractional, whose plane lies at a camera z.
    pub(crate) fn plane_from_z(&self, z: f64) -> f64 {
        z / self.thickness - 0.5
    }

    /// The margin of a box along camera z, world units: as far as its corners move when it grows by the margin.
    pub(crate) fn margin_z(&self) -> f64 {
        BOX_MARGIN * f64::from(self.reach.z)
    }

    /// Length of the ring: a power of two that holds the planes that a kernel may span.
    pub(crate) fn ring_len(reach: &KernelReach, thickness: f64) -> usize {
        ((2.0 * f64::from(reach.z) / thickness).floor() as usize + 2).next_power_of_two()
    }
}

/// How one channel becomes colour and extinction.
#[derive(Clone, Debug)]
pub(crate) struct ChannelSettings {
    pub(crate) table: TransferTable,
    pub(crate) reading: Reading,
    pub(crate) role: Role,
    /// Least and greatest scalar of the volume; of labels, 0.
    pub(crate) value_range: (f64, f64),
}

/// The part of a channel in a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// Extinction, and the colour that it shines in.
    Extinction,
    /// A factor of the colour.
    Tint,
}

/// How a sample is read from the voxels around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reading {
    /// Interpolated.
    Trilinear,
    /// That of the nearest voxel.
    Nearest,
}

impl ChannelSettings {
    /// The settings of scalars in this range.
    pub(crate) fn of_transfer(
        transfer: &TransferFunction,
        range: (f64, f64),
        opacity: OpacityMode,
    ) -> Self {
        let table = TransferTable::new(transfer, opacity, range);
        Self {
            table,
            reading: Reading::Trilinear,
            role: Role::Extinction,
            value_range: range,
        }
    }

    /// The settings of a channel; an error where its labels are too many.
    pub(crate) fn new(channel: &Channel, opacity: OpacityMode) -> Result<Self, Error> {
        Ok(match channel.look {
            Look::Transfer(transfer) => {
                Self::of_transfer(transfer, channel.volume.voxels.finite_range(), opacity)
            }
            Look::Labels(labels) => Self {
                table: TransferTable::of_entries(
                    &Palette::new(channel.volume, labels)?.entries(opacity),
                ),
                reading: Reading::Nearest,
                role: Role::Extinction,
                value_range: (0.0, 0.0),
            },
            Look::Tint(transfer) => Self {
                role: Role::Tint,
                ..Self::of_transfer(
                    &transfer.opaque(),
                    channel.volume.voxels.finite_range(),
                    opacity,
                )
            },
        })
    }
}

/// The channel by which tints are weighted between voxels, and its least scalar; `None` where all others are labels.
#[inline(always)]
pub(crate) fn weights_of_tints(channels: &[ChannelSettings]) -> Option<(usize, f32)> {
    let holds = |channel: &ChannelSettings| {
        channel.role == Role::Extinction && channel.reading == Reading::Trilinear
    };
    let number = channels.iter().position(holds)?;
    Some((number, channels[number].value_range.0 as f32))
}

/// The tables of a scene's channels; an error where the channels do not suit the options.
pub(crate) fn channels(
    scene: &Scene,
    options: &RenderOptions,
) -> Result<Arc<[ChannelSettings]>, Error> {
    let channels: Arc<[ChannelSettings]> = scene
        .channels
        .iter()
        .map(|channel| ChannelSettings::new(channel, options.opacity))
        .collect::<Result<_, _>>()?;
    check(&channels, options)?;
    Ok(channels)
}

/// An error where the channels do not suit the options.
pub(crate) fn check(channels: &[ChannelSettings], options: &RenderOptions) -> Result<(), Error> {
    let has_labels = channels
        .iter()
        .any(|channel| channel.reading == Reading::Nearest);
    let refuse = |what: &str| Err(Error::Option(what.into()));
    match options.blend() {
        Blend::Isosurface(_) if channels.len() > 1 => refuse(
            "an isosurface is drawn of one channel, and there are more: leave out the others",
        ),
        Blend::Emission => Ok(()),
        _ if has_labels => {
            refuse("labels have no greatest, no mean and no surface: draw them by emission")
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_point_of_a_kernel_lies_beyond_its_reach() {
        let map = DMat3::from_cols(
            DVec3::new(1.0, 0.2, -0.3),
            DVec3::new(-0.4, 0.7, 0.9),
            DVec3::new(0.1, -0.5, 2.0),
        );
        let ball = KernelReach::of_ball(map, 1.8, 0.5);
        let cube = KernelReach::of_cube(map);
        for i in 0..20_000 {
            // A spiral over the sphere.
            let height = 1.0 - 2.0 * (f64::from(i) + 0.5) / 20_000.0;
            let angle = f64::from(i) * 2.4;
            let across = (1.0 - height * height).sqrt();
            let p = DVec3::new(across * angle.cos(), across * angle.sin(), height);
            let on_cube = p / p.abs().max_element();
            for (reach, p, slab) in [(ball, 1.8 * p, 0.25), (cube, on_cube, 0.0)] {
                let p = (map * p).as_vec3();
                let [x0, y0, x1, y1] = reach.ends;
                assert!(p.x >= x0 && p.x <= x1 && p.y >= y0 && p.y <= y1, "{p}");
                assert!(p.z.abs() + slab <= reach.z * (1.0 + 1e-6), "{p}");
            }
        }
    }
}
