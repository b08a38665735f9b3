//! Kernels at extremes: a few voxels as splats, against their line integrals in f64.

use super::row::Result;
use glam::{DAffine3, DVec3};
use resample_core::{Camera, Kernel, KernelShape, LookAt, SelectMode};
use volsplat::transfer::{ColourKnot, OpacityKnot};
use volsplat::{Order, RenderOptions, Renderer, SampleOrder, TransferFunction, Volume, Voxels};

use super::row::{Claim, Row};
use super::twin::Ray;

/// Extinction of full opacity is held at this: exp(-87) is the edge of f32.
const MOST_EXTINCTION: f64 = 87.0;

/// Voxels of one opacity, and who looks at them.
pub(super) struct Voxel {
    pub(super) camera: Camera,
    pub(super) placed: DAffine3,
    pub(super) dims: [usize; 3],
    pub(super) opacity: f64,
    pub(super) unit: f64,
}

/// White, of one opacity.
pub(super) fn white(opacity: f64) -> Result<TransferFunction> {
    let colour = ColourKnot {
        value: 0.0,
        rgb: [1.0; 3],
    };
    let knot = OpacityKnot {
        value: 0.0,
        opacity,
    };
    Ok(TransferFunction::new(vec![colour], vec![knot])?)
}

/// A camera that looks at a place, 33x33 pixels.
pub(super) fn eye(position: DVec3, target: DVec3, fov_deg: f64) -> Result<Camera> {
    let up = DVec3::new(0.1, 1.0, 0.05);
    let pose = LookAt {
        position,
        target,
        up,
    };
    Ok(Camera::perspective(&pose, fov_deg.to_radians(), [33, 33])?)
}

impl Voxel {
    /// One voxel of opacity 0.7 at the origin.
    pub(super) fn one(camera: Camera) -> Self {
        Self {
            camera,
            placed: DAffine3::IDENTITY,
            dims: [1; 3],
            opacity: 0.7,
            unit: 1.0,
        }
    }

    /// The options that both kinds of splats are drawn with.
    fn options(&self, order: SampleOrder) -> RenderOptions {
        let mut options = RenderOptions {
            min_transmittance: 0.0,
            opacity_unit: Some(self.unit),
            ..RenderOptions::paper()
        };
        if let Order::Samples(samples) = &mut options.order {
            (samples.order, samples.select) = (order, SelectMode::Splats);
        }
        options
    }

    /// Opacity of each pixel as drawn and as it should be, in both orders; of faint voxels, their red.
    pub(super) fn pairs(&self) -> Result<Vec<[f64; 2]>> {
        let count: usize = self.dims.iter().product();
        let volume = Volume::new(self.dims, Voxels::U8(vec![1; count]), self.placed)?;
        let kernel = Kernel::new(KernelShape::Gaussian);
        let strength = (-(-self.opacity).ln_1p()).min(MOST_EXTINCTION);
        let voxel = |i: usize| {
            let [x, y, _] = self.dims;
            DVec3::new((i % x) as f64, (i / x % y) as f64, (i / (x * y)) as f64)
        };
        let truth = |at: usize| {
            let ray = Ray::new(&self.camera, &self.placed, at);
            let near = self.camera.near;
            let length: f64 = (0..count)
                .map(|i| ray.through_kernel(&kernel, voxel(i), near))
                .sum();
            -(-strength * length / self.unit).exp_m1()
        };
        let truths: Vec<f64> = (0..33 * 33).map(truth).collect();
        // The colour of faint voxels has all digits; 1 less a transmittance near 1 has not.
        let channel = if self.opacity < 1e-6 { 0 } else { 3 };
        let mut pairs = Vec::new();
        for order in [SampleOrder::EverySample, SampleOrder::AxisSheets] {
            let mut renderer = Renderer::new(&volume, &white(self.opacity)?, &self.options(order))?;
            let image = renderer.render(&self.camera)?.image;
            let drawn = image.rgba.iter().map(|pixel| f64::from(pixel[channel]));
            pairs.extend(drawn.zip(&truths).map(|(got, &truth)| [got, truth]));
        }
        Ok(pairs)
    }
}

/// The tabulated footprint's own error, with f32 beside it.
const SPLAT: Claim = Claim {
    quantity: "opacity of splats",
    bound: 1e-3,
    why: "positions are f32 relative to the eye, in spacings; the footprint's table is fine to 4e-4",
};

/// A kernel at the eye is integrated in f64.
const NEAR: Claim = Claim {
    quantity: "opacity of splats at the eye",
    bound: 1e-5,
    why: "kernels that reach the near plane are integrated in f64",
};

/// All rows.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = places()?;
    rows.extend(grids()?);
    rows.extend(opacities()?);
    Ok(rows)
}

fn places() -> Result<Vec<Row>> {
    let radius = Kernel::new(KernelShape::Gaussian).radius();
    let mut rows = Vec::new();
    for (extreme, position, target) in [
        (
            "the eye inside a splat",
            DVec3::new(0.3, 0.2, -0.4),
            DVec3::ZERO,
        ),
        ("the eye exactly on a voxel", DVec3::ZERO, DVec3::Z),
        (
            "a kernel across the eye plane",
            DVec3::X * 1.2,
            DVec3::new(1.2, 0.0, 1.0),
        ),
        (
            "distance 1e-3 of the radius",
            DVec3::Z * -1e-3 * radius,
            DVec3::ZERO,
        ),
    ] {
        let voxel = Voxel::one(eye(position, target, 60.0)?);
        rows.push(NEAR.worst(extreme, voxel.pairs()?));
    }
    for (extreme, distance, fov) in [
        (
            "a cone of 89 degrees around the kernel",
            radius * 1.0002,
            80.0,
        ),
        ("a splat larger than the picture", radius * 1.05, 10.0),
        ("distance 1e4 radii", 1e4 * radius, 0.02),
        ("distance 1e7 radii", 1e7 * radius, 2e-5),
        ("a splat of 1e-4 px", 1e7, 20.0),
    ] {
        let position = DVec3::new(0.0, 0.0, -distance);
        let voxel = Voxel::one(eye(position, DVec3::ZERO, fov)?);
        rows.push(SPLAT.worst(extreme, voxel.pairs()?));
    }
    Ok(rows)
}

fn grids() -> Result<Vec<Row>> {
    let position = DVec3::new(3.0, 2.0, -5.0);
    let mut rows = Vec::new();
    let scaled = |unit: f64| -> Result<Voxel> {
        Ok(Voxel {
            placed: DAffine3::from_scale(DVec3::splat(unit)),
            unit,
            ..Voxel::one(eye(position * unit, DVec3::ZERO, 50.0)?)
        })
    };
    for unit in [2f64.powi(-126), 1e-11, 1e-10, 1e10, 2f64.powi(125)] {
        let extreme = format!("spacing {unit:.1e}");
        rows.push(SPLAT.worst(extreme, scaled(unit)?.pairs()?));
    }
    let far = DVec3::new(1e7, -1e7, 1e7);
    let grid = |extreme: &str, placed: DAffine3, dims: [usize; 3], from: DVec3| -> Result<Row> {
        let voxel = Voxel {
            placed,
            dims,
            ..Voxel::one(eye(from + position, from, 50.0)?)
        };
        Ok(SPLAT.worst(extreme, voxel.pairs()?))
    };
    let axes = DAffine3::from_scale;
    rows.push(grid(
        "a volume 1e7 units from the origin",
        DAffine3::from_translation(far),
        [1; 3],
        far,
    )?);
    rows.push(grid(
        "spacings 1 : 1e-3 : 1",
        axes(DVec3::new(1.0, 1e-3, 1.0)),
        [1; 3],
        DVec3::ZERO,
    )?);
    rows.push(grid(
        "mirrored axes",
        axes(DVec3::new(-1.0, 1.0, 1.0)),
        [3, 2, 4],
        DVec3::ZERO,
    )?);
    rows.push(grid(
        "a volume of 1x40x1 voxels",
        axes(DVec3::splat(0.1)),
        [1, 40, 1],
        DVec3::ZERO,
    )?);
    rows.push(grid(
        "64 voxels at equal depth",
        axes(DVec3::splat(0.5)),
        [8, 8, 1],
        DVec3::ZERO,
    )?);
    Ok(rows)
}

fn opacities() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (opacity, bound) in [(0.0, 0.0), (1e-12, 1e-15), (1.0, 1e-3)] {
        let claim = Claim { bound, ..SPLAT };
        let voxel = Voxel {
            opacity,
            ..Voxel::one(eye(DVec3::Z * -6.0, DVec3::ZERO, 40.0)?)
        };
        rows.push(claim.worst(format!("opacity {opacity:e}"), voxel.pairs()?));
    }
    Ok(rows)
}
