//! From what was typed to the options of the libraries, and to the record of what was used.
//!
//! Takes the structs of `args.rs`, gives `LoadOptions`, `RenderOptions` and the `settings` object of the
//! stats file; `transfer.rs` does the same for the transfer function. No file is touched here.

use anyhow::Result;
use serde_json::{Value, json};
use volsplat::input::RawOptions;
use volsplat::volume::NanPolicy;
use volsplat::{
    Blend, Classify, DepthPlane, Described, Light, LoadOptions, Order, RenderOptions, Shading,
    SheetKernel, Subpixels,
};

use crate::args::{RenderArgs, VolsplatArgs, VolumeArgs};
use crate::blend;
use crate::choices;
use crate::clip;
use crate::framing;
use crate::order::order;
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
    let (samples, sheets) = (&args.samples, &args.sheets);
    let default = RenderOptions::default();
    let kernel = samples.kernel.map_or(default.sheet_kernel, |kernel| {
        choices::KERNEL.library(kernel)
    });
    let blend = blend::blend(&args.blend)?;
    // A surface without light is one spot of colour.
    let unasked = if matches!(blend, Blend::Isosurface(_)) {
        Shading::Phong
    } else {
        default.shading
    };
    Ok(RenderOptions {
        order: order(args)?.unwrap_or(default.order),
        clip: clip::clip(&args.clip),
        blend,
        gradient_opacity: args.gradient_opacity,
        slab_voxels: sheets.slab.unwrap_or(default.slab_voxels),
        subpixels: sheets.subpixel.unwrap_or(default.subpixels),
        interpolate: samples
            .interpolate
            .map_or(default.interpolate, |on| choices::INTERPOLATE.library(on)),
        cells: samples
            .cells
            .map_or(default.cells, |cells| choices::CELLS.library(cells)),
        cell_error: samples.cell_error.unwrap_or(default.cell_error),
        lod_error: sheets.lod_error.unwrap_or(default.lod_error),
        sheet_sums: sheets
            .sheet_sums
            .map_or(default.sheet_sums, |sums| choices::SHEET_SUMS.library(sums)),
        shading: args
            .shade
            .map_or(unasked, |shade| choices::SHADE.library(shade)),
        light: args.light.map_or(default.light, Light::Towards),
        kernel: match kernel {
            SheetKernel::Radial(shape) => shape,
            SheetKernel::Trilinear => default.kernel,
        },
        sheet_kernel: kernel,
        classify: sheets.classify.map_or(default.classify, |classify| {
            choices::CLASSIFY.library(classify)
        }),
        footprint: samples
            .footprint
            .map_or(default.footprint, |mode| choices::FOOTPRINT.library(mode)),
        opacity: args
            .opacity
            .map_or(default.opacity, |opacity| choices::OPACITY.library(opacity)),
        select: samples
            .select
            .map_or(default.select, |select| choices::SELECT.library(select)),
        point_threshold_px: samples
            .point_threshold
            .unwrap_or(default.point_threshold_px),
        sheet_voxels: samples.sheet.unwrap_or(default.sheet_voxels),
        min_transmittance: args.min_transmittance.unwrap_or(default.min_transmittance),
        opacity_unit,
        colour_by: samples
            .colour_by
            .map_or(default.colour_by, |by| choices::COLOUR_BY.library(by)),
        depth: if format == Format::Exr {
            DepthPlane::Expected
        } else {
            DepthPlane::None
        },
        simd: default.simd,
    })
}

/// A single slice has no cell to interpolate in: unless an order was asked for, each of its samples is drawn.
pub(crate) fn suited_to(
    options: RenderOptions,
    args: &RenderArgs,
    volume: &dyn Described,
) -> RenderOptions {
    match args.order {
        None if volume.lattice().dims.contains(&1) => RenderOptions {
            order: Order::EverySample,
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
    json!({
        "order": choices::ORDER.name(options.order),
        "clip": clip::record(&options.clip),
        "blend": blend::record(options.blend),
        "gradient_opacity": options.gradient_opacity,
        "slab_voxels": options.slab_voxels,
        "subpixel": subpixels,
        "shade": choices::SHADE.name(options.shading),
        "light": light,
        "lod_error": options.lod_error,
        "sheet_sums": choices::SHEET_SUMS.name(options.sheet_sums),
        "kernel": choices::KERNEL.name(match options.order {
            Order::ImageSheets => options.sheet_kernel,
            Order::EverySample | Order::AxisSheets => SheetKernel::Radial(options.kernel),
        }),
        "classify": choices::CLASSIFY.name(match options.order {
            Order::ImageSheets => options.classify,
            Order::EverySample | Order::AxisSheets => Classify::Pre,
        }),
        "interpolate": choices::INTERPOLATE.name(options.interpolate),
        "cells": choices::CELLS.name(options.cells),
        "cell_error": options.cell_error,
        "footprint": choices::FOOTPRINT.name(options.footprint),
        "opacity": choices::OPACITY.name(options.opacity),
        "select": choices::SELECT.name(options.select),
        "point_threshold_px": options.point_threshold_px,
        "sheet_voxels": options.sheet_voxels,
        "min_transmittance": options.min_transmittance,
        "colour_by": choices::COLOUR_BY.name(options.colour_by),
        "depth": options.depth == DepthPlane::Expected,
        "simd": format!("{:?}", options.simd).to_lowercase(),
    })
}
