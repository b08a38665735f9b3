//! The ladders: for every choice of an application, its rungs from fast to exact.
//!
//! One ladder at a time is climbed from the default; the ladders named on the command line are combined with one
//! another as well. A combination that the application refuses, such as a footprint of splats with an order that has
//! none, is no setting and is left out.

use anyhow::{Result, bail};
use clap::ValueEnum;
use resample_cloud::Blend;
use resample_core::{FootprintMode, KernelShape, SelectMode};
use volsplat::{Cells, Classify, Interpolate, LightGrid, PixelSamples, Subpixels};
use warp3d::Visibility;
use warp3d::args::MethodName;

use crate::args::{Drawing, OrderName, RenderArgs};
use crate::open::setting::{
    Choice, Choices, DepthChoice, GaussianChoice, MeshChoice, PointsChoice, VolumeChoice,
};

/// A choice and its rungs.
struct Ladder {
    /// The word of `--settings`.
    name: &'static str,
    rungs: Vec<Choices>,
}

/// A setting to measure.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Named {
    /// Its changes, for people: "slab 0.5, subpixels 2".
    pub(super) name: String,
    /// Its ladder; "default", "exact" and "combined" stand for none.
    pub(super) group: &'static str,
    pub(super) choices: Choices,
}

/// A ladder whose rungs set one option.
fn ladder<T: Into<Choice>, V>(
    name: &'static str,
    values: impl IntoIterator<Item = V>,
    choice: fn(V) -> T,
) -> Ladder {
    let rungs = values.into_iter().map(|value| Choices::of([choice(value)]));
    Ladder {
        name,
        rungs: rungs.collect(),
    }
}

/// A ladder whose rungs set one option of an order of compositing.
fn in_order<V>(
    order: OrderName,
    name: &'static str,
    values: impl IntoIterator<Item = V>,
    choice: fn(V) -> VolumeChoice,
) -> Ladder {
    let rung = |value| Choices::of([VolumeChoice::Order(order), choice(value)]);
    Ladder {
        name,
        rungs: values.into_iter().map(rung).collect(),
    }
}

/// Every value of an option, in the order of the help.
fn all<V: ValueEnum + 'static>() -> impl Iterator<Item = V> {
    V::value_variants().iter().cloned()
}

const SUBPIXELS: [u32; 4] = [1, 2, 4, 8];

fn field_ladders() -> Vec<Ladder> {
    let subpixels = SUBPIXELS.map(Subpixels::Fixed);
    let slabs = [2.0, 1.0, 0.5, 0.25];
    let least = [1.0 / 32.0, 1.0 / 512.0, 0.0];
    vec![
        ladder("order", all::<OrderName>(), VolumeChoice::Order),
        ladder("slab", slabs, VolumeChoice::Slab),
        ladder("subpixels", subpixels, VolumeChoice::Subpixels),
        ladder("termination", least, VolumeChoice::MinTransmittance),
    ]
}

fn image_sheets_ladders() -> Vec<Ladder> {
    let sheets = OrderName::ImageSheets;
    let interpolated = |on| {
        Choices::of([
            VolumeChoice::Order(sheets),
            VolumeChoice::Kernel(KernelShape::BSpline),
            VolumeChoice::Interpolate(on),
        ])
    };
    vec![
        in_order(
            sheets,
            "sheet-kernel",
            all::<KernelShape>(),
            VolumeChoice::Kernel,
        ),
        Ladder {
            name: "interpolate",
            rungs: all::<Interpolate>().map(interpolated).collect(),
        },
        in_order(
            sheets,
            "classify",
            all::<Classify>(),
            VolumeChoice::Classify,
        ),
    ]
}

fn samples_ladders() -> Vec<Ladder> {
    let every = OrderName::EverySample;
    let cells = [
        Cells::Off,
        Cells::Mean,
        Cells::Split { error: 0.25 },
        Cells::SPLIT,
        Cells::Split { error: 0.015625 },
    ];
    let subpixels = SUBPIXELS.map(Subpixels::Fixed);
    let radii_px = [2.0, 1.0, 0.5];
    vec![
        in_order(
            every,
            "footprint",
            all::<FootprintMode>(),
            VolumeChoice::Footprint,
        ),
        in_order(every, "kernel", all::<KernelShape>(), VolumeChoice::Kernel),
        in_order(every, "cells", cells, VolumeChoice::Cells),
        in_order(
            every,
            "sample-subpixels",
            subpixels,
            VolumeChoice::Subpixels,
        ),
        in_order(every, "select", all::<SelectMode>(), VolumeChoice::Select),
        in_order(every, "threshold", radii_px, VolumeChoice::PointThreshold),
    ]
}

fn volume_ladders(setting: &RenderArgs) -> Vec<Ladder> {
    let mut all = field_ladders();
    if setting.blocks_light() {
        let grids = [8, 4, 2, 1].map(LightGrid::Every);
        all.push(ladder("light-grid", grids, VolumeChoice::LightGrid));
    }
    all.extend(image_sheets_ladders());
    all.extend(samples_ladders());
    all
}

fn gaussian_ladders() -> Vec<Ladder> {
    let errors = [1.0, 0.3, 0.06, 0.02, 0.005];
    let least = [1.0 / 32.0, 1.0 / 256.0, 0.0];
    vec![
        ladder("slab-error", errors, GaussianChoice::SlabError),
        ladder("samples", all::<PixelSamples>(), GaussianChoice::Samples),
        ladder("termination", least, GaussianChoice::MinTransmittance),
    ]
}

fn mesh_ladders() -> Vec<Ladder> {
    let methods = [
        texmap::Method::Point,
        texmap::Method::BackwardNearest,
        texmap::Method::BackwardBilinear,
        texmap::Method::BackwardTrilinear,
        texmap::Method::BackwardEwa,
        texmap::Method::Hybrid,
    ];
    vec![
        ladder("method", methods, MeshChoice::Method),
        ladder("subpixels", SUBPIXELS, MeshChoice::Subpixels),
    ]
}

fn depth_ladders() -> Vec<Ladder> {
    let visibility = [Visibility::ZBuffer, Visibility::OcclusionOrder].map(|visibility| {
        Choices::of([
            DepthChoice::Method(MethodName::Nearest),
            DepthChoice::Visibility(visibility),
        ])
    });
    vec![
        ladder("method", MethodName::FOR_ANY_CAMERA, DepthChoice::Method),
        Ladder {
            name: "visibility",
            rungs: visibility.to_vec(),
        },
        ladder("subpixels", SUBPIXELS, DepthChoice::Subpixels),
    ]
}

fn points_ladders() -> Vec<Ladder> {
    vec![
        ladder("blend", all::<Blend>(), PointsChoice::Blend),
        ladder("every", [16, 8, 4, 2, 1], PointsChoice::Every),
        ladder("subpixels", SUBPIXELS, PointsChoice::Subpixels),
    ]
}

/// The slowest, most exact setting of an application.
pub(super) fn exact(drawing: &Drawing) -> Choices {
    match drawing {
        Drawing::Texmap(_) => Choices::of([
            MeshChoice::Method(texmap::Method::Hybrid),
            MeshChoice::Subpixels(8),
        ]),
        Drawing::Volsplat(_) => Choices::of([
            VolumeChoice::Order(OrderName::Field),
            VolumeChoice::Slab(0.125),
            VolumeChoice::Subpixels(Subpixels::Fixed(8)),
            VolumeChoice::MinTransmittance(1e-5),
        ]),
        Drawing::Gaussians(_) => Choices::of([
            GaussianChoice::SlabError(0.005),
            GaussianChoice::Samples(PixelSamples::Four),
            GaussianChoice::MinTransmittance(1e-5),
        ]),
        Drawing::Warp3d(_) => Choices::of([
            DepthChoice::Method(MethodName::Hybrid),
            DepthChoice::Subpixels(8),
        ]),
        Drawing::Points(_) => Choices::of([
            PointsChoice::Blend(Blend::Linear),
            PointsChoice::Every(1),
            PointsChoice::Subpixels(8),
        ]),
    }
}

/// The most exact setting, the default, one ladder at a time, and the combinations of the `named` ladders.
pub(super) fn settings(drawing: &Drawing, named: &[String]) -> Result<Vec<Named>> {
    let ladders = match drawing {
        Drawing::Texmap(_) => mesh_ladders(),
        Drawing::Volsplat(args) => volume_ladders(&args.render.options),
        Drawing::Gaussians(_) => gaussian_ladders(),
        Drawing::Warp3d(_) => depth_ladders(),
        Drawing::Points(_) => points_ladders(),
    };
    let of = |name: &str, group, choices| Named {
        name: name.to_owned(),
        group,
        choices,
    };
    let mut settings = vec![
        of("exact", "exact", exact(drawing)),
        of("default", "default", Choices::default()),
    ];
    for ladder in &ladders {
        for rung in &ladder.rungs {
            settings.push(of(&rung.name(), ladder.name, rung.clone()));
        }
    }
    let mut combined = vec![Choices::default()];
    for name in named {
        let Some(ladder) = ladders.iter().find(|ladder| ladder.name == name) else {
            let names: Vec<&str> = ladders.iter().map(|ladder| ladder.name).collect();
            bail!(
                "--settings {name}: no such ladder, expected some of {}",
                names.join(", ")
            );
        };
        let mut longer = Vec::with_capacity(combined.len() * ladder.rungs.len());
        for choices in &combined {
            for rung in &ladder.rungs {
                longer.push(choices.with(rung));
            }
        }
        combined = longer;
    }
    if named.len() > 1 {
        for choices in combined {
            settings.push(of(&choices.name(), "combined", choices));
        }
    }
    settings.dedup_by(|a, b| a.choices == b.choices);
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ladders_are_climbed_one_by_one_and_combined_where_named() {
        let drawing = Drawing::Volsplat(Box::default());
        let alone = settings(&drawing, &[]).expect("good");
        let Drawing::Volsplat(args) = &drawing else {
            panic!("not a volume");
        };
        let rungs: usize = volume_ladders(&args.render.options)
            .iter()
            .map(|l| l.rungs.len())
            .sum();
        assert_eq!(alone.len(), 2 + rungs, "exact, default and every rung");
        let both = settings(&drawing, &["slab".into(), "subpixels".into()]).expect("good");
        assert_eq!(both.len(), alone.len() + 16, "four by four combinations");
        assert!(
            both.iter()
                .any(|s| s.name == "slab 2, subpixels 8" && s.group == "combined")
        );
        let bad = settings(&drawing, &["colour".into()]);
        assert!(bad.is_err(), "no such ladder");
    }
}
