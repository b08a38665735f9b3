//! Many samples in one pixel, and grids of more voxels than 32 bits count.

use std::sync::Arc;

use super::row::Result;
use glam::{DAffine3, DVec3};
use resample_core::{Camera, Kernel, KernelShape, LookAt, SelectMode};
use volsplat::large::{Region, VoxelSource};
use volsplat::{
    LargeVolume, Lattice, Order, RenderOptions, Renderer, Subpixels, Volume, VoxelType, Voxels,
};

use super::row::{Claim, Row};
use super::voxels::white;

/// All rows; those of many samples have 1/`share` of them.
pub(super) fn rows(share: usize) -> Result<Vec<Row>> {
    Ok(vec![
        layers_of_splats(1_000_000 / share, 1e-6)?,
        layers_of_splats(1_000_000 / share, 1e-5)?,
        layers_of_splats(120, 0.9)?,
        layers_of_field(1_000_000 / share)?,
        points_in_a_pixel(share)?,
        field_in_a_pixel(share)?,
        beyond_32_bits(share)?,
    ])
}

/// Parallel rays along z; the picture is `height` world units high.
fn along_z(height: f64, size: [u32; 2], middle: DVec3) -> Result<Camera> {
    let pose = LookAt {
        position: middle - DVec3::Z * (middle.z + 5.0),
        target: middle,
        up: DVec3::Y,
    };
    Ok(Camera::orthographic(&pose, height, size)?)
}

fn samples(select: SelectMode) -> RenderOptions {
    let mut options = RenderOptions {
        min_transmittance: 0.0,
        ..RenderOptions::paper()
    };
    if let Order::Samples(samples) = &mut options.order {
        samples.select = select;
    }
    options
}

fn layers_of_splats(count: usize, opacity: f64) -> Result<Row> {
    // Each layer of a short list rounds by 2^-25 at most.
    let rounded = if count > 32_768 { 0.0 } else { count as f64 };
    let claim = Claim {
        quantity: "transmittance of layers of splats",
        bound: 1e-5 + rounded * 2f64.powi(-25),
        why: "what rounding takes from a long list's sums is kept for the next layer; the rest is the footprint's own error",
    };
    let row = Volume::new(
        [1, 1, count],
        Voxels::U8(vec![1; count]),
        DAffine3::IDENTITY,
    )?;
    let mut renderer = Renderer::new(&row, &white(opacity)?, &samples(SelectMode::Splats))?;
    let image = renderer.render(&along_z(3.0, [3, 3], DVec3::ZERO)?)?.image;
    let depth = -(-opacity).ln_1p() * Kernel::new(KernelShape::Gaussian).line_integral(0.0);
    let truth = (-depth * count as f64).exp();
    let got = 1.0 - f64::from(image.pixel(1, 1)[3]);
    Ok(claim.row(
        format!("{count} layers of opacity {opacity:e}"),
        [got, truth],
    ))
}

fn layers_of_field(count: usize) -> Result<Row> {
    let claim = Claim {
        quantity: "transmittance of planes of a field",
        bound: 2e-3,
        why: "bricks of one colour are one step, and each of 62,500 steps rounds by 2^-25 at most",
    };
    let long = Volume::new(
        [2, 2, count],
        Voxels::U8(vec![1; 4 * count]),
        DAffine3::IDENTITY,
    )?;
    let options = RenderOptions {
        min_transmittance: 0.0,
        subpixels: Subpixels::Fixed(1),
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&long, &white(1e-6)?, &options)?;
    let middle = DVec3::new(0.5, 0.5, 0.0);
    let image = renderer.render(&along_z(9.0, [1, 1], middle)?)?.image;
    // Planes at odd quarters of a voxel: two for each voxel but the last.
    let planes = 2.0 * (count - 1) as f64;
    let truth = (planes * 0.5 * (-1e-6f64).ln_1p()).exp();
    let got = 1.0 - f64::from(image.pixel(0, 0)[3]);
    Ok(claim.row(
        format!("{planes} planes of opacity 1e-6 a voxel"),
        [got, truth],
    ))
}

/// Side of a cube of 10^7 voxels, or of a share of it.
fn side(share: usize) -> usize {
    (1e7 / share as f64).cbrt().ceil() as usize
}

/// A cube of ones.
fn cube(side: usize) -> Result<Volume> {
    let ones = Voxels::U8(vec![1; side.pow(3)]);
    Ok(Volume::new([side; 3], ones, DAffine3::IDENTITY)?)
}

fn points_in_a_pixel(share: usize) -> Result<Row> {
    let claim = Claim {
        quantity: "optical depth of points, over the screen",
        bound: 1e-3,
        why: "a sheet of points is summed before it is composited: f32 sums of one sheet, 215 of them in a row",
    };
    let side = side(share);
    let cube = cube(side)?;
    let opacity = 1e-3;
    let mut renderer = Renderer::new(&cube, &white(opacity)?, &samples(SelectMode::Points))?;
    let middle = DVec3::splat(0.5 * (side - 1) as f64);
    // A pixel is as large as the cube's face.
    let camera = along_z(9.0 * side as f64, [9, 9], middle)?;
    let image = renderer.render(&camera)?.image;
    let depth = |pixel: &[f32; 4]| -(1.0 - f64::from(pixel[3])).ln();
    let got: f64 = image.rgba.iter().map(depth).sum();
    let truth = -(-opacity).ln_1p() * side as f64;
    Ok(claim.row(format!("{} points", side.pow(3)), [got / truth, 1.0]))
}

fn field_in_a_pixel(share: usize) -> Result<Row> {
    let claim = Claim {
        quantity: "opacity of a field",
        bound: 2e-5,
        why: "planes of one colour are counted, not added",
    };
    let side = side(share);
    let cube = cube(side)?;
    let options = RenderOptions {
        min_transmittance: 0.0,
        subpixels: Subpixels::Fixed(1),
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&cube, &white(1e-3)?, &options)?;
    let middle = DVec3::splat(0.5 * (side - 1) as f64);
    let camera = along_z(0.5 * side as f64, [1, 1], middle)?;
    let got = renderer.render(&camera)?.image.pixel(0, 0)[3];
    let truth = -((side - 1) as f64 * (-1e-3f64).ln_1p()).exp_m1();
    let extreme = format!("{} voxels in a pixel", side.pow(3));
    Ok(claim.row(extreme, [got.into(), truth]))
}

/// Voxels made where they are asked for: the last two rows are 1, all others 0.
#[derive(Debug)]
struct Made {
    dims: [usize; 3],
}

impl VoxelSource for Made {
    fn dims(&self) -> [usize; 3] {
        self.dims
    }

    fn voxel_type(&self) -> VoxelType {
        VoxelType::U8
    }

    fn read(&self, region: &Region) -> Result<Voxels, volsplat::Error> {
        let mut voxels = Vec::with_capacity(region.size.iter().product());
        for _ in 0..region.size[2] {
            for y in 0..region.size[1] {
                let value = u8::from(region.first[1] + y + 2 >= self.dims[1]);
                voxels.resize(voxels.len() + region.size[0], value);
            }
        }
        Ok(Voxels::U8(voxels))
    }
}

fn beyond_32_bits(share: usize) -> Result<Row> {
    let claim = Claim {
        quantity: "opacity of a field from a source",
        bound: 1e-4,
        why: "voxels are counted in 64 bits, and read brick by brick",
    };
    let dims = [32_768, 32_770 / share.min(128), 2];
    let lattice = Lattice {
        dims,
        world_from_index: DAffine3::IDENTITY,
        up_hint: None,
        space: None,
        modality: None,
        unit: None,
        window: None,
    };
    let source = Arc::new(Made { dims });
    let volume = LargeVolume::new(lattice, source, 1 << 31, &mut |_| {})?;
    let mut seen = white(0.5)?.opacity_knots().to_vec();
    seen[0].value = 1.0;
    seen.insert(
        0,
        volsplat::transfer::OpacityKnot {
            value: 0.0,
            opacity: 0.0,
        },
    );
    let seen = volsplat::TransferFunction::new(white(0.5)?.colour_knots().to_vec(), seen)?;
    let options = RenderOptions {
        min_transmittance: 0.0,
        subpixels: Subpixels::Fixed(1),
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::from_file(&volume, &seen, &options, &mut |_| {})?;
    // The middle of the last row of cells but a quarter of a voxel, at the far end of x.
    let corner = DVec3::new(dims[0] as f64 - 1.5, dims[1] as f64 - 1.5, 0.0);
    let image = renderer.render(&along_z(0.25, [1, 1], corner)?)?.image;
    let extreme = format!("{} voxels", dims.iter().product::<usize>());
    Ok(claim.row(extreme, [image.pixel(0, 0)[3].into(), 0.5]))
}
