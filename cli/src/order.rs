//! Which order of compositing the options ask for, and which options it has.
//!
//! Takes what was typed, gives the order; an option that does nothing in that order is an error, never ignored. Each
//! option lists its orders, the one that it stands for when it comes alone first.

use anyhow::{Result, bail};
use volsplat::{RenderOptions, SampleOrder};

use crate::args::{
    ClassifyArg, InterpolateArg, KernelArg, RayBlendArg, RenderArgs, VolumeLayerArg,
};
use crate::choices;

/// `--order`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// The field, or with a radial kernel sums of kernels.
    ImageSheets,
    /// Each sample over those behind it.
    EverySample,
    /// Slices of samples.
    AxisSheets,
}

/// The order that options draw in.
pub(crate) fn of_options(options: &RenderOptions) -> Order {
    match options.samples().map(|samples| samples.order) {
        None | Some(SampleOrder::ImageSheets(_)) => Order::ImageSheets,
        Some(SampleOrder::EverySample) => Order::EverySample,
        Some(SampleOrder::AxisSheets) => Order::AxisSheets,
    }
}

const IMAGE: &[Order] = &[Order::ImageSheets];
/// All, image sheets first.
const ANY: &[Order] = &[Order::ImageSheets, Order::EverySample, Order::AxisSheets];
const SAMPLES: &[Order] = &[Order::EverySample, Order::AxisSheets];
const ALL: &[Order] = &[Order::EverySample, Order::AxisSheets, Order::ImageSheets];
const EVERY: &[Order] = &[Order::EverySample];

/// An option that was given, and the orders that have it.
#[derive(Clone, Copy)]
struct Given {
    name: &'static str,
    orders: &'static [Order],
}

/// The order that was asked for, or that the options given belong to; `None` leaves the default.
pub(crate) fn order(args: &RenderArgs) -> Result<Option<Order>> {
    let given = given(args);
    let fits = |order: &Order, option: &Given| option.orders.contains(order);
    if let Some(order) = args.order.map(|order| choices::ORDER.library(order)) {
        return match given.iter().find(|option| !fits(&order, option)) {
            Some(option) => bail!(
                "{} belongs to {} and does nothing in {}: drop one of them",
                option.name,
                names(option),
                choices::ORDER.name(order)
            ),
            None => Ok(Some(order)),
        };
    }
    let Some(first) = given.first() else {
        return Ok(None);
    };
    let common = first
        .orders
        .iter()
        .find(|order| given.iter().all(|option| fits(order, option)));
    if let Some(&order) = common {
        return Ok(Some(order));
    }
    // Some two of them share no order, or three do not.
    let other = given
        .iter()
        .find(|option| !option.orders.iter().any(|order| fits(order, first)));
    match other.or(given.last()) {
        Some(other) => bail!(
            "{} belongs to {} and {} to {}: drop one of them",
            first.name,
            names(first),
            other.name,
            names(other)
        ),
        None => Ok(None),
    }
}

fn names(option: &Given) -> String {
    let names: Vec<String> = option
        .orders
        .iter()
        .map(|&order| format!("--order {}", choices::ORDER.name(order)))
        .collect();
    names.join(" or ")
}

/// The options given that not every order has.
fn given(args: &RenderArgs) -> Vec<Given> {
    let (samples, sheets) = (&args.samples, &args.sheets);
    let kernel = samples.kernel;
    let kernel_orders = if kernel == Some(KernelArg::Trilinear) {
        IMAGE
    } else {
        ALL
    };
    // Sheets of trilinear samples have neither points nor splats.
    let select_orders = if kernel.is_some_and(|kernel| kernel != KernelArg::Trilinear) {
        ALL
    } else {
        SAMPLES
    };
    // Pre-classification is what the other orders do anyway.
    let classify_orders = if sheets.classify == Some(ClassifyArg::Pre) {
        ANY
    } else {
        IMAGE
    };
    // Cells are classified before they are drawn, so that image sheets have them with --classify pre.
    let cells_orders = if sheets.classify == Some(ClassifyArg::Pre) {
        ALL
    } else {
        SAMPLES
    };
    let layers = args.blend.layers.as_deref().unwrap_or_default();
    let layer_orders = if layers == [VolumeLayerArg::Selection] {
        SAMPLES
    } else {
        IMAGE
    };
    let all = [
        ("--classify", sheets.classify.is_some(), classify_orders),
        ("--footprint", samples.footprint.is_some(), SAMPLES),
        ("--kernel", kernel.is_some(), kernel_orders),
        ("--select", samples.select.is_some(), select_orders),
        (
            "--point-threshold",
            samples.point_threshold.is_some(),
            select_orders,
        ),
        ("--sheet", samples.sheet.is_some(), EVERY),
        ("--colour-by", samples.colour_by.is_some(), SAMPLES),
        (
            "--interpolate",
            samples.interpolate.is_some_and(|i| i == InterpolateArg::On),
            IMAGE,
        ),
        ("--cells", samples.cells.is_some(), cells_orders),
        ("--cell-error", samples.cell_error.is_some(), cells_orders),
        ("--slab", sheets.slab.is_some(), IMAGE),
        ("--subpixel", sheets.subpixel.is_some(), ANY),
        ("--shade", args.shade.is_some(), ANY),
        (
            "--blend",
            args.blend
                .blend
                .is_some_and(|blend| blend != RayBlendArg::Emission),
            IMAGE,
        ),
        ("--iso", args.blend.iso.is_some(), IMAGE),
        ("--layers", args.blend.layers.is_some(), layer_orders),
        ("--gradient-opacity", args.gradient_opacity.is_some(), ANY),
    ];
    all.into_iter()
        .filter(|option| option.1)
        .map(|(name, _, orders)| Given { name, orders })
        .collect()
}
