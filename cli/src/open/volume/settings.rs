//! From the typed options to those of the libraries, and to their record in the stats file.
//!
//! Takes the structs of `args.rs`, gives `RenderOptions` and the `settings` object of the
//! stats file; `transfer.rs` does the same for the transfer function. No file is touched here.

use anyhow::Result;
use serde_json::{Value, json};
use volsplat::{
    Blend, Cells, DepthPlane, Described, FieldOptions, KernelSheets, Light, Order, RenderOptions,
    SampleOptions, SampleOrder, Shading,
};

use crate::args::volume::order::order;
use crate::args::{CellsName, Given, OrderName, RenderArgs, VolsplatArgs};
use crate::cameras::framing;
use crate::look::suggested::Suggested;
use crate::look::{blend, clip, transfer};
use crate::open::volume::scene;
use crate::output::Format;
use crate::plan;
use crate::plan::Request;
use crate::process::report;

/// How the volume is drawn. Only an EXR file has a place for depth.
pub(crate) fn render_options(
    given: &Given<RenderArgs>,
    opacity_unit: Option<f64>,
    format: Format,
) -> Result<RenderOptions> {
    let args = &given.options;
    let default = RenderOptions::default();
    let order = library_order(given)?;
    // A surface without light is one spot of colour.
    let unasked = match &order {
        Order::Field(field) if matches!(field.blend, Blend::Isosurface(_)) => Shading::Phong,
        Order::Field(_) | Order::Samples(_) => default.shading,
    };
    Ok(RenderOptions {
        order,
        clip: clip::clip(&args.clip),
        gradient_opacity: args.gradient_opacity,
        subpixels: args.subpixels,
        shading: args.shade.unwrap_or(unasked),
        light: args.light.map_or(default.light, Light::Towards),
        opacity: args.opacity,
        min_transmittance: args.min_transmittance,
        opacity_unit,
        depth: if format == Format::Exr {
            DepthPlane::Expected
        } else {
            DepthPlane::None
        },
        simd: args.vector_level,
    })
}

/// The pipeline that was asked for, with its choices.
fn library_order(given: &Given<RenderArgs>) -> Result<Order> {
    let args = &given.options;
    let name = order(given)?.unwrap_or(OrderName::Field);
    let blend = blend::blend(&args.blend)?;
    let sample_order = match name {
        OrderName::Field => {
            return Ok(Order::Field(FieldOptions {
                blend,
                ..args.field.clone()
            }));
        }
        OrderName::EverySample => SampleOrder::EverySample,
        OrderName::AxisSheets => SampleOrder::AxisSheets,
        OrderName::ImageSheets => SampleOrder::ImageSheets(KernelSheets {
            slab_voxels: args.field.slab_voxels,
            ..args.sheets
        }),
    };
    let split = Cells::Split {
        error: args.cell_error,
    };
    Ok(Order::Samples(SampleOptions {
        order: sample_order,
        cells: match args.cells {
            CellsName::Auto if name == OrderName::EverySample => split,
            CellsName::Auto => Cells::Auto,
            CellsName::Off => Cells::Off,
            CellsName::Mean => Cells::Mean,
            CellsName::Split => split,
        },
        ..args.samples.clone()
    }))
}

/// Fills options that were not set with those the preset suggests.
///
/// A single slice has no cell to interpolate in: unless an order was asked for, each of its samples is drawn, without light.
pub(crate) fn suited_to(
    options: RenderOptions,
    args: &RenderArgs,
    volume: &dyn Described,
    suggested: &Suggested,
) -> RenderOptions {
    if !volume.lattice().dims.contains(&1) {
        return suggested.fill(options, args);
    }
    match args.order {
        None => RenderOptions {
            order: Order::Samples(options.samples().cloned().unwrap_or_default()),
            ..options
        },
        Some(_) => options,
    }
}

/// Everything that decided the pictures, for the stats file.
pub(crate) fn record(
    args: &VolsplatArgs,
    request: &Request,
    format: Format,
    options: &RenderOptions,
    (volume, suggested): (&dyn Described, &Suggested),
) -> Value {
    let stance = framing::volume::stance(volume, args.camera.up.map(|axis| axis.direction));
    json!({
        "volume": volume_record(args, volume),
        "transfer": transfer::record(&args.transfer, options.opacity_unit, volume, suggested),
        "scene": scene::record(&args.scene),
        "camera": plan::camera_record(request, stance),
        "render": options,
        "picture": plan::picture_record(request, format),
    })
}

fn volume_record(args: &VolsplatArgs, volume: &dyn Described) -> Value {
    let lattice = volume.lattice();
    json!({
        "file": report::name(&args.input.path),
        "part": args.input.part,
        "dims": lattice.dims,
        "spacing": lattice.spacing(),
        "origin": lattice.world_from_index.translation.to_array(),
        "space": lattice.space,
        "raw_type": args.volume.voxel_type.map(|kind| kind.name()),
        "raw_endian": args.volume.endian.map(|endian| format!("{endian:?}").to_lowercase()),
        "raw_skip_bytes": args.volume.skip,
        "nan_as": args.volume.nan_as,
        "max_memory_bytes": args.volume.reading.max_memory,
        "rescaled_by": args.volume.rescale_values,
    })
}
