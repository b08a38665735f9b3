//! The order of compositing that the given options select.
//!
//! Takes the options, gives the order; an option that does nothing in that order is an error, never ignored. An option's
//! orders follow from the group of options that it belongs to; the exceptions are listed here.

use anyhow::{Result, bail};
use volsplat::{KernelSheets, Layer, SampleOptions};

use crate::args::OrderName::{AxisSheets, EverySample, Field, ImageSheets};
use crate::args::{BlendArgs, Given, OrderName, RayBlend, RenderArgs, names_of};

/// Orders of samples, the one that an option selects when it comes alone first.
const SAMPLES: &[OrderName] = &[EverySample, AxisSheets, ImageSheets];

/// Options that belong to fewer or more orders than their group.
const EXCEPTIONS: [(&str, &[OrderName]); 5] = [
    ("slab", &[Field, ImageSheets]),
    ("footprint", &[EverySample, AxisSheets]),
    ("colour-by", &[EverySample, AxisSheets]),
    ("sheet", &[EverySample]),
    ("cells", SAMPLES),
];

/// An option that is given, and the orders that have it.
struct Chooser {
    name: String,
    orders: &'static [OrderName],
}

/// The order that was asked for, or that the options given belong to; `None` leaves the default.
pub(crate) fn order(given: &Given<RenderArgs>) -> Result<Option<OrderName>> {
    let choosers = choosers(given);
    let fits = |order: OrderName, option: &Chooser| option.orders.contains(&order);
    if let Some(order) = given.options.order {
        return match choosers.iter().find(|option| !fits(order, option)) {
            Some(option) => bail!(
                "--{} belongs to {} and does nothing in {}: drop one of them",
                option.name,
                names(option),
                order.name()
            ),
            None => Ok(Some(order)),
        };
    }
    let Some(first) = choosers.first() else {
        return Ok(None);
    };
    let all_fit = |order: &&OrderName| choosers.iter().all(|option| fits(**order, option));
    if let Some(&order) = first.orders.iter().find(all_fit) {
        let selects = |option: &Chooser| option.orders.first() == Some(&order);
        return match choosers.iter().any(selects) {
            true => Ok(Some(order)),
            false => bail!(
                "--{} and --{} require --order {}; add it",
                first.name,
                choosers.last().unwrap_or(first).name,
                order.name()
            ),
        };
    }
    // Some two of them share no order, or three do not.
    let apart = |option: &&Chooser| !option.orders.iter().any(|&order| fits(order, first));
    match choosers.iter().find(apart).or(choosers.last()) {
        Some(other) => bail!(
            "--{} belongs to {} and --{} to {}: drop one of them",
            first.name,
            names(first),
            other.name,
            names(other)
        ),
        None => Ok(None),
    }
}

fn names(option: &Chooser) -> String {
    let names: Vec<String> = option
        .orders
        .iter()
        .map(|order| format!("--order {}", order.name()))
        .collect();
    names.join(" or ")
}

/// The options given that not every order has.
fn choosers(given: &Given<RenderArgs>) -> Vec<Chooser> {
    let mut all: Vec<(String, &'static [OrderName])> = Vec::new();
    let mut group = |names: Vec<String>, orders| {
        all.extend(names.into_iter().map(|name| (name, orders)));
    };
    group(names_of::<KernelSheets>(), &[ImageSheets]);
    group(names_of::<SampleOptions>(), SAMPLES);
    group(names_of::<BlendArgs>(), &[Field]);
    all.retain(|(name, _)| EXCEPTIONS.iter().all(|(other, _)| other != name));
    all.extend(EXCEPTIONS.map(|(name, orders)| (name.to_owned(), orders)));
    all.into_iter()
        .filter(|(name, _)| given.has(name) && !is_neutral(name, &given.options))
        .map(|(name, orders)| {
            let orders = match &given.options.blend.layers {
                Some(layers) if name == "layers" && *layers == [Layer::Selection] => {
                    &[EverySample, AxisSheets]
                }
                _ => orders,
            };
            Chooser { name, orders }
        })
        .collect()
}

/// Returns true if an option asks for what every order does.
fn is_neutral(name: &str, args: &RenderArgs) -> bool {
    name == "blend" && args.blend.blend == Some(RayBlend::Emission)
}
