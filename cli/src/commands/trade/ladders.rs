//! The ladders: for every choice of an application, its rungs from fast to exact.
//!
//! One ladder at a time is climbed from the default; the ladders named on the command line are combined with one
//! another as well. A combination that the application refuses, such as a footprint of splats with an order that has
//! none, is no setting and is left out.

use anyhow::{Result, bail};
use clap::ValueEnum;
use volsplat::Subpixels;
use warp3d::args::MethodName;
use warp3d::{MixedPixels, Visibility};

use crate::args::{
    CellsArg, ClassifyArg, Drawing, FootprintArg, InterpolateArg, KernelArg, OrderArg, RenderArgs,
    SelectArg,
};
use crate::setting::Setting;

/// A choice and its rungs.
struct Ladder {
    /// The word of `--settings`.
    name: &'static str,
    rungs: Vec<Setting>,
}

/// A setting to measure.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Named {
    /// Its changes, for people: "slab 0.5, subpixel 2".
    pub(super) name: String,
    /// Its ladder; "default", "exact" and "combined" stand for none.
    pub(super) group: &'static str,
    pub(super) setting: Setting,
}

fn ladder(name: &'static str, rungs: impl IntoIterator<Item = Setting>) -> Ladder {
    Ladder {
        name,
        rungs: rungs.into_iter().collect(),
    }
}

/// Rungs that set an option of a volume, in an order if one is given.
fn volume<V: Copy>(
    (order, name): (Option<OrderArg>, &str),
    values: &[V],
    set: fn(&mut RenderArgs, V),
) -> Vec<Setting> {
    let mut names = vec![name];
    if order.is_some() {
        names.push("order");
    }
    let rung = |&value: &V| {
        Setting::volume(&names, |args| {
            args.order = order.or(args.order);
            set(args, value);
        })
    };
    values.iter().map(rung).collect()
}

fn sheets_ladders() -> Vec<Ladder> {
    let sheets = Some(OrderArg::ImageSheets);
    let radial = [
        KernelArg::Polynomial,
        KernelArg::Gaussian,
        KernelArg::BSpline,
        KernelArg::Trilinear,
    ];
    let interpolates = [InterpolateArg::Off, InterpolateArg::On].map(|on| {
        Setting::volume(&["order", "kernel", "interpolate"], |args| {
            args.order = sheets;
            args.samples.kernel = Some(KernelArg::BSpline);
            args.samples.interpolate = Some(on);
        })
    });
    let subpixels = [1, 2, 4, 8].map(Subpixels::Fixed);
    let errors = [1.0 / 32.0, 1.0 / 512.0, 0.0];
    vec![
        ladder(
            "slab",
            volume((None, "slab"), &[2.0, 1.0, 0.5, 0.25], |args, slab| {
                args.sheets.slab = Some(slab);
            }),
        ),
        ladder(
            "subpixel",
            volume((None, "subpixel"), &subpixels, |args, n| {
                args.sheets.subpixel = Some(n)
            }),
        ),
        ladder(
            "termination",
            volume((None, "min-transmittance"), &errors, |args, t| {
                args.min_transmittance = Some(t)
            }),
        ),
        ladder(
            "lod",
            volume((None, "lod-error"), &errors, |args, e| {
                args.sheets.lod_error = Some(e)
            }),
        ),
        ladder(
            "sheet-kernel",
            volume((sheets, "kernel"), &radial, |args, kernel| {
                args.samples.kernel = Some(kernel);
            }),
        ),
        ladder("interpolate", interpolates),
        ladder(
            "classify",
            volume(
                (None, "classify"),
                &[ClassifyArg::Pre, ClassifyArg::Post],
                |args, c| {
                    args.sheets.classify = Some(c);
                },
            ),
        ),
    ]
}

fn samples_ladders() -> Vec<Ladder> {
    let every = Some(OrderArg::EverySample);
    let footprints = [
        FootprintArg::AffineApprox,
        FootprintArg::Affine,
        FootprintArg::Table,
        FootprintArg::Exact,
    ];
    let kernels = [
        KernelArg::Polynomial,
        KernelArg::Gaussian,
        KernelArg::BSpline,
    ];
    let selects = [
        SelectArg::Points,
        SelectArg::Hybrid,
        SelectArg::Splats,
        SelectArg::Ewa,
    ];
    let cells = [CellsArg::Off, CellsArg::Mean, CellsArg::Split];
    let subpixels = [1, 2, 4, 8].map(Subpixels::Fixed);
    vec![
        ladder(
            "footprint",
            volume((every, "footprint"), &footprints, |args, mode| {
                args.samples.footprint = Some(mode);
            }),
        ),
        ladder(
            "kernel",
            volume((every, "kernel"), &kernels, |args, kernel| {
                args.samples.kernel = Some(kernel);
            }),
        ),
        ladder(
            "cells",
            volume((every, "cells"), &cells, |args, cells| {
                args.samples.cells = Some(cells);
            }),
        ),
        ladder(
            "cell-error",
            volume(
                (every, "cell-error"),
                &[0.25, 0.0625, 0.015625],
                |args, error| {
                    args.samples.cell_error = Some(error);
                },
            ),
        ),
        ladder(
            "sample-subpixel",
            volume((every, "subpixel"), &subpixels, |args, n| {
                args.sheets.subpixel = Some(n)
            }),
        ),
        ladder(
            "select",
            volume((every, "select"), &selects, |args, select| {
                args.samples.select = Some(select);
            }),
        ),
        ladder(
            "threshold",
            volume((every, "point-threshold"), &[2.0, 1.0, 0.5], |args, px| {
                args.samples.point_threshold = Some(px);
            }),
        ),
    ]
}

fn volume_ladders() -> Vec<Ladder> {
    let orders = [
        OrderArg::ImageSheets,
        OrderArg::EverySample,
        OrderArg::AxisSheets,
    ];
    let mut all = vec![ladder(
        "order",
        volume((None, "order"), &orders, |args, order| {
            args.order = Some(order)
        }),
    )];
    all.extend(sheets_ladders());
    all.extend(samples_ladders());
    all
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
        ladder(
            "method",
            methods.map(|method| Setting::mesh(&["method"], |options| options.method = method)),
        ),
        ladder(
            "subpixel",
            [1, 2, 4, 8].map(|n| Setting::mesh(&["subpixel"], |options| options.subpixels = n)),
        ),
    ]
}

fn depth_ladders() -> Vec<Ladder> {
    let visibility = [Visibility::ZBuffer, Visibility::OcclusionOrder].map(|visibility| {
        Setting::depth(&["method", "visibility"], |args| {
            args.method = MethodName::Nearest;
            args.visibility = Some(visibility);
        })
    });
    vec![
        ladder(
            "method",
            MethodName::value_variants()
                .iter()
                .map(|&method| Setting::depth(&["method"], |args| args.method = method)),
        ),
        ladder("visibility", visibility),
        ladder(
            "subpixels",
            [1, 2, 4, 8].map(|n| Setting::depth(&["subpixels"], |args| args.subpixels = Some(n))),
        ),
        ladder(
            "mixed",
            [MixedPixels::Keep, MixedPixels::Unmix]
                .map(|mixed| Setting::depth(&["mixed"], |args| args.mixed = Some(mixed))),
        ),
    ]
}

/// The slowest, most exact setting of an application.
pub(super) fn exact(drawing: &Drawing) -> Setting {
    match drawing {
        Drawing::Texmap(_) => Setting::mesh(&["method", "subpixel"], |options| {
            options.method = texmap::Method::Hybrid;
            options.subpixels = 8;
        }),
        Drawing::Volsplat(_) => {
            let names = [
                "order",
                "slab",
                "subpixel",
                "min-transmittance",
                "lod-error",
            ];
            Setting::volume(&names, |args| {
                args.order = Some(OrderArg::ImageSheets);
                args.sheets.slab = Some(0.125);
                args.sheets.subpixel = Some(Subpixels::Fixed(8));
                // A four-hundredth of a step of an 8-bit picture; 0 would take many times as long.
                args.min_transmittance = Some(1e-5);
                args.sheets.lod_error = Some(0.0);
            })
        }
        Drawing::Warp3d(_) => Setting::depth(&["method", "subpixels"], |args| {
            args.method = MethodName::Hybrid;
            args.subpixels = Some(8);
        }),
    }
}

/// The most exact setting, the default, one ladder at a time, and the combinations of the `named` ladders.
pub(super) fn settings(drawing: &Drawing, named: &[String]) -> Result<Vec<Named>> {
    let (ladders, default) = match drawing {
        Drawing::Texmap(_) => (mesh_ladders(), Setting::mesh(&[], |_| ())),
        Drawing::Volsplat(_) => (volume_ladders(), Setting::volume(&[], |_| ())),
        Drawing::Warp3d(_) => (depth_ladders(), Setting::depth(&[], |_| ())),
    };
    let of = |name: &str, group, setting| Named {
        name: name.to_owned(),
        group,
        setting,
    };
    let mut settings = vec![
        of("exact", "exact", exact(drawing)),
        of("default", "default", default.clone()),
    ];
    for ladder in &ladders {
        for rung in &ladder.rungs {
            settings.push(of(&rung.name()?, ladder.name, rung.clone()));
        }
    }
    let mut combined = vec![default];
    for name in named {
        let Some(ladder) = ladders.iter().find(|ladder| ladder.name == name) else {
            let names: Vec<&str> = ladders.iter().map(|ladder| ladder.name).collect();
            bail!(
                "--settings {name}: no such ladder, expected some of {}",
                names.join(", ")
            );
        };
        let mut longer = Vec::with_capacity(combined.len() * ladder.rungs.len());
        for setting in &combined {
            for rung in &ladder.rungs {
                longer.push(setting.with(rung)?);
            }
        }
        combined = longer;
    }
    if named.len() > 1 {
        for setting in combined {
            settings.push(of(&setting.name()?, "combined", setting));
        }
    }
    settings.dedup_by(|a, b| a.setting == b.setting);
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::VolsplatArgs;

    #[test]
    fn ladders_are_climbed_one_by_one_and_combined_where_named() {
        let drawing = Drawing::Volsplat(Box::new(VolsplatArgs::default()));
        let alone = settings(&drawing, &[]).expect("good");
        let rungs: usize = volume_ladders().iter().map(|l| l.rungs.len()).sum();
        assert_eq!(alone.len(), 2 + rungs, "exact, default and every rung");
        let both = settings(&drawing, &["slab".into(), "subpixel".into()]).expect("good");
        assert_eq!(both.len(), alone.len() + 16, "four by four combinations");
        assert!(
            both.iter()
                .any(|s| s.name == "slab 2, subpixel 8" && s.group == "combined")
        );
        let bad = settings(&drawing, &["colour".into()]);
        assert!(bad.is_err(), "no such ladder");
    }
}
