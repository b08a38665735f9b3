//! From the typed options to those of the library, and to those that go with a look.

use anyhow::Result;
use volsplat::{
    Blend, Cells, DepthPlane, Described, FieldOptions, KernelSheets, Light, Order, RenderOptions,
    SampleOptions, SampleOrder, Shading,
};

use crate::args::volume::order::order;
use crate::args::{CellsName, Given, OrderName, RenderArgs};
use crate::look::suggested::Suggested;
use crate::look::{blend, clip};
use crate::output::Format;

/// How the volume is drawn. Only an EXR file has a place for depth.
pub(super) fn typed(
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

/// The options with those that go with the look, where they were not set.
///
/// A single slice has no cell to interpolate in: unless an order was asked for, each of its samples is drawn, without light.
pub(super) fn with_suggested(
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
