//! From what was typed to the options of the libraries, and to the record of what was used.
//!
//! Takes the structs of `args.rs`, gives `LoadOptions`, `RenderOptions` and the `settings` object of the
//! stats file; `transfer.rs` does the same for the transfer function. No file is touched here.

use anyhow::{Result, bail};
use serde_json::{Value, json};
use volsplat::input::RawOptions;
use volsplat::volume::NanPolicy;
use volsplat::{
    Blend, Cells, Classify, DepthPlane, Described, FieldOptions, Interpolate, KernelSheets, Light,
    LoadOptions, Order, RenderOptions, SampleOptions, SampleOrder, Shading, Subpixels,
};

use crate::args::{CellsArg, InterpolateArg, RenderArgs, SampleArgs, VolsplatArgs, VolumeArgs};
use crate::blend;
use crate::choices;
use crate::clip;
use crate::framing;
use crate::order::{self, Order as OrderName, order};
use crate::output::Format;
use crate::plan::{self, Request};
use crate::scene;
use crate::transfer;

pub(crate) mod texmap;

/// How the volume is read.
pub(crate) fn load_options(args: &VolumeArgs) -> LoadOptions {
    // The command line accepts --dims and --type together or not at all.
    let raw = args
        .dims
        .zip(args.voxel_type)
        .map(|(dims, voxel_type)| RawOptions {
            endian: args.endian.unwrap_or_default(),
            skip_bytes: args.skip.unwrap_or(0),
            ..RawOptions::new(dims, voxel_type)
        });
    LoadOptions {
        raw,
        spacing: args.spacing,
        origin: args.origin,
        nan: args.nan_as.map_or(NanPolicy::Refuse, NanPolicy::Replace),
        series: args.series.clone(),
        array: args.array.clone(),
        component: args.component,
        level: args.level,
        time: args.time,
        rescale: args.rescale_values,
    }
}

/// How the volume is drawn. Only an EXR file has a place for depth.
pub(crate) fn render_options(
    args: &RenderArgs,
    opacity_unit: Option<f64>,
    format: Format,
) -> Result<RenderOptions> {
    let default = RenderOptions::default();
    let blend = blend::blend(&args.blend)?;
    // A surface without light is one spot of colour.
    let unasked = if matches!(blend, Blend::Isosurface(_)) {
        Shading::Phong
    } else {
        default.shading
    };
    Ok(RenderOptions {
        order: library_order(args, blend)?,
        clip: clip::clip(&args.clip),
        gradient_opacity: args.gradient_opacity,
        subpixels: args.sheets.subpixel.unwrap_or(default.subpixels),
        shading: args
            .shade
            .map_or(unasked, |shade| choices::SHADE.library(shade)),
        light: args.light.map_or(default.light, Light::Towards),
        opacity: choices::OPACITY.library(args.opacity),
        min_transmittance: args.min_transmittance,
        opacity_unit,
        depth: if format == Format::Exr {
            DepthPlane::Expected
        } else {
            DepthPlane::None
        },
        simd: default.simd,
    })
}

/// The pipeline that was asked for, with its choices.
fn library_order(args: &RenderArgs, blend: Blend) -> Result<Order> {
    let (samples, sheets) = (&args.samples, &args.sheets);
    let name = order(args)?.unwrap_or(OrderName::ImageSheets);
    let classify = sheets
        .classify
        .map(|classify| choices::CLASSIFY.library(classify));
    let kernel = samples.kernel.map(|kernel| choices::KERNEL.library(kernel));
    let slab_voxels = sheets.slab.unwrap_or(FieldOptions::default().slab_voxels);
    // Classified samples are summed with a radial kernel.
    let is_field = name == OrderName::ImageSheets
        && kernel.flatten().is_none()
        && classify != Some(Classify::Pre);
    if is_field {
        if samples.interpolate == Some(InterpolateArg::On) {
            bail!("--interpolate goes with --kernel polynomial, gaussian or b-spline");
        }
        if samples
            .cells
            .is_some_and(|cells| matches!(cells, CellsArg::Mean | CellsArg::Split))
        {
            bail!(
                "cells are classified before they are drawn: use --classify pre, --order every-sample or axis-sheets"
            );
        }
        return Ok(Order::Field(FieldOptions { slab_voxels, blend }));
    }
    if blend != Blend::Emission {
        bail!(
            "this blend mode needs the trilinear kernel, post-classified: leave out --kernel and --classify"
        );
    }
    if kernel == Some(None) {
        bail!(
            "classified samples are summed with a radial kernel: --kernel polynomial, gaussian or b-spline"
        );
    }
    let default = SampleOptions::default();
    Ok(Order::Samples(SampleOptions {
        order: match name {
            OrderName::EverySample => SampleOrder::EverySample,
            OrderName::AxisSheets => SampleOrder::AxisSheets,
            OrderName::ImageSheets => SampleOrder::ImageSheets(KernelSheets {
                slab_voxels,
                classify: classify.unwrap_or(Classify::Post),
                interpolate: samples
                    .interpolate
                    .map_or(Interpolate::Off, |on| choices::INTERPOLATE.library(on)),
            }),
        },
        kernel: kernel.flatten().unwrap_or(default.kernel),
        cells: cells(samples, name),
        footprint: samples
            .footprint
            .map_or(default.footprint, |mode| choices::FOOTPRINT.library(mode)),
        select: samples
            .select
            .map_or(default.select, |select| choices::SELECT.library(select)),
        point_threshold_px: samples
            .point_threshold
            .unwrap_or(default.point_threshold_px),
        sheet_voxels: samples.sheet.unwrap_or(default.sheet_voxels),
        colour_by: samples
            .colour_by
            .map_or(default.colour_by, |by| choices::COLOUR_BY.library(by)),
    }))
}

fn cells(samples: &SampleArgs, order: OrderName) -> Cells {
    let split = samples
        .cell_error
        .map_or(Cells::SPLIT, |error| Cells::Split { error });
    match samples.cells.unwrap_or(CellsArg::Auto) {
        CellsArg::Auto if order == OrderName::EverySample => split,
        CellsArg::Auto => Cells::Auto,
        CellsArg::Off => Cells::Off,
        CellsArg::Mean => Cells::Mean,
        CellsArg::Split => split,
    }
}

/// A single slice has no cell to interpolate in: unless an order was asked for, each of its samples is drawn.
pub(crate) fn suited_to(
    options: RenderOptions,
    args: &RenderArgs,
    volume: &dyn Described,
) -> RenderOptions {
    match args.order {
        None if volume.lattice().dims.contains(&1) => RenderOptions {
            order: Order::Samples(options.samples().cloned().unwrap_or_default()),
            ..options
        },
        _ => options,
    }
}

/// Everything that decided the pictures, for the stats file.
pub(crate) fn record(
    args: &VolsplatArgs,
    request: &Request,
    format: Format,
    (options, volume): (&RenderOptions, &dyn Described),
) -> Value {
    let stance = framing::volume::stance(volume, args.camera.up.map(|axis| axis.direction));
    json!({
        "volume": volume_record(args, volume),
        "transfer": transfer::record(&args.transfer, options.opacity_unit, volume),
        "scene": scene::record(&args.scene),
        "camera": plan::camera_record(request, stance),
        "render": render_record(options),
        "picture": plan::picture_record(request, format),
    })
}

fn volume_record(args: &VolsplatArgs, volume: &dyn Described) -> Value {
    let lattice = volume.lattice();
    json!({
        "file": args.input,
        "dims": lattice.dims,
        "spacing": lattice.spacing(),
        "origin": lattice.world_from_index.translation.to_array(),
        "space": lattice.space,
        "raw_type": args.volume.voxel_type.map(|kind| kind.name()),
        "raw_endian": args.volume.endian.map(|endian| format!("{endian:?}").to_lowercase()),
        "raw_skip_bytes": args.volume.skip,
        "nan_as": args.volume.nan_as,
        "max_memory_bytes": args.volume.max_memory,
        "array": args.volume.array,
        "component": args.volume.component,
        "level": args.volume.level,
        "time": args.volume.time,
        "rescaled_by": args.volume.rescale_values,
        "series": args.volume.series,
    })
}

fn render_record(options: &RenderOptions) -> Value {
    let light = match options.light {
        Light::Headlight => json!("headlight"),
        Light::Towards(direction) => json!(direction.to_array()),
    };
    let subpixels = match options.subpixels {
        Subpixels::Auto => json!("auto"),
        Subpixels::Fixed(n) => json!(n),
    };
    let field = options.field().cloned().unwrap_or_default();
    let samples = options.samples().cloned().unwrap_or_default();
    let sheets = samples.sheets().copied().unwrap_or(KernelSheets {
        slab_voxels: field.slab_voxels,
        ..KernelSheets::default()
    });
    json!({
        "order": choices::ORDER.name(order::of_options(options)),
        "clip": clip::record(&options.clip),
        "blend": blend::record(field.blend),
        "gradient_opacity": options.gradient_opacity,
        "slab_voxels": sheets.slab_voxels,
        "subpixel": subpixels,
        "shade": choices::SHADE.name(options.shading),
        "light": light,
        "kernel": choices::KERNEL.name(options.samples().map(|samples| samples.kernel)),
        "classify": choices::CLASSIFY.name(match options.samples() {
            Some(samples) if samples.sheets().is_none() => Classify::Pre,
            _ => sheets.classify,
        }),
        "interpolate": choices::INTERPOLATE.name(sheets.interpolate),
        "cells": match samples.cells {
            Cells::Auto => "auto",
            Cells::Off => "off",
            Cells::Mean => "mean",
            Cells::Split { .. } => "split",
        },
        "cell_error": match samples.cells {
            Cells::Split { error } => json!(error),
            _ => Value::Null,
        },
        "footprint": choices::FOOTPRINT.name(samples.footprint),
        "opacity": choices::OPACITY.name(options.opacity),
        "select": choices::SELECT.name(samples.select),
        "point_threshold_px": samples.point_threshold_px,
        "sheet_voxels": samples.sheet_voxels,
        "min_transmittance": options.min_transmittance,
        "colour_by": choices::COLOUR_BY.name(samples.colour_by),
        "depth": options.depth == DepthPlane::Expected,
        "simd": format!("{:?}", options.simd).to_lowercase(),
    })
}
