//! From the typed options of drawing, blending and clipping to those of the library, and to those that go with a look.

use anyhow::{Result, bail};
use glam::DVec3;
use volsplat::{
    Blend, Cells, Clip, DepthPlane, Described, FieldOptions, Isosurface, KernelSheets, Light,
    Occlusion, Order, RenderOptions, SampleOptions, SampleOrder, Shading, Shadow,
};

use crate::args::volume::order::order;
use crate::args::{BlendArgs, ClipArgs, Given, OrderName, RayBlend, RenderArgs};
use crate::look::transfer::Suggested;
use crate::output::Format;
use crate::values::word;

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
        clip: clip(&args.clip),
        gradient_filter: args.gradient_filter,
        gradient_opacity: args.gradient_opacity.clone(),
        subpixels: args.subpixels,
        shading: args.shade.unwrap_or(unasked),
        light: args.light.map_or(default.light, Light::Towards),
        shadow: args.shadows.then_some(Shadow {
            light_size_deg: args.light_size,
        }),
        light_grid: args.light_grid,
        occlusion: args.occlusion.map(|radius| Occlusion { radius }),
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
    let blend = blend(&args.blend)?;
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
    Ok(Order::Samples(SampleOptions {
        order: sample_order,
        cells: match args.cells {
            Cells::Auto if name == OrderName::EverySample => Cells::SPLIT,
            typed => typed,
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

/// The value of its ray that a pixel shows.
pub(crate) fn blend(args: &BlendArgs) -> Result<Blend> {
    let surface = |value: f64| {
        Blend::Isosurface(Isosurface {
            value,
            colour: args.iso_colour,
            opacity: args.iso_opacity.unwrap_or(1.0),
        })
    };
    Ok(match (args.blend, args.iso) {
        (None | Some(RayBlend::Isosurface), Some(value)) => surface(value),
        (Some(RayBlend::Isosurface), None) => {
            bail!("--blend isosurface needs --iso VALUE: which surface?")
        }
        (Some(other), Some(_)) => {
            bail!("--iso cannot be combined with --blend {}", word(other))
        }
        (None | Some(RayBlend::Emission), None) => Blend::Emission,
        (Some(RayBlend::Maximum), None) => Blend::Maximum,
        (Some(RayBlend::Minimum), None) => Blend::Minimum,
        (Some(RayBlend::Average), None) => Blend::Average,
    })
}

/// The clip of the volume.
pub(crate) fn clip(args: &ClipArgs) -> Clip {
    let corners = |typed: Option<[[f64; 3]; 2]>| typed.map(|ends| ends.map(DVec3::from));
    Clip {
        crop_in_world: corners(args.crop),
        crop_in_grid: corners(args.crop_voxels),
        planes: args.clip_plane.clone(),
    }
}
