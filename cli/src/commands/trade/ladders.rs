//! The ladders: for every choice of an application, its rungs from fast to exact.
//!
//! One ladder at a time is climbed from the default; the ladders named on the command line are combined with one
//! another as well. A combination that the application refuses, such as a footprint of splats with an order that has
//! none, is no setting and is left out.

use anyhow::{Result, bail};
use clap::ValueEnum;
use resample_core::{FootprintMode, KernelShape, SelectMode};
use volsplat::{Classify, Interpolate, Subpixels};
use warp3d::args::MethodName;
use warp3d::{MixedPixels, Visibility};

use crate::args::{CellsName, Drawing, OrderName, RenderArgs};
use crate::open::setting::Setting;

/// A choice and its rungs.
struct Ladder {
    /// The word of `--settings`.
    name: &'static str,
    rungs: Vec<Setting>,
}

/// A setting to measure.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Named {
    /// Its changes, for people: "slab 0.5, subpixels 2".
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
    order: Option<OrderName>,
    name: &str,
    values: &[V],
    set: fn(&mut RenderArgs, V),
) -> Vec<Setting> {
    let mut names = vec![name];
    names.extend(order.map(|_| "order"));
    let rung = |&value: &V| {
        Setting::volume(&names, |args| {
            args.order = order;
            set(args, value);
        })
    };
    values.iter().map(rung).collect()
}

fn field_ladders() -> Vec<Ladder> {
    let subpixels = [1, 2, 4, 8].map(Subpixels::Fixed);
    vec![
        ladder(
            "order",
            volume(None, "order", OrderName::value_variants(), |args, v| {
                args.order = Some(v);
            }),
        ),
        ladder(
            "slab",
            volume(None, "slab", &[2.0, 1.0, 0.5, 0.25], |args, v| {
                args.field.slab_voxels = v;
            }),
        ),
        ladder(
            "subpixels",
            volume(None, "subpixels", &subpixels, |args, v| args.subpixels = v),
        ),
        ladder(
            "termination",
            volume(
                None,
                "min-transmittance",
                &[1.0 / 32.0, 1.0 / 512.0, 0.0],
                |args, v| args.min_transmittance = v,
            ),
        ),
    ]
}

fn image_sheets_ladders() -> Vec<Ladder> {
    let sheets = Some(OrderName::ImageSheets);
    let interpolated = Interpolate::value_variants().iter().map(|&on| {
        Setting::volume(&["order", "kernel", "interpolate"], |args| {
            args.order = sheets;
            args.samples.kernel = KernelShape::BSpline;
            args.sheets.interpolate = on;
        })
    });
    vec![
        ladder(
            "sheet-kernel",
            volume(
                sheets,
                "kernel",
                KernelShape::value_variants(),
                |args, v| {
                    args.samples.kernel = v;
                },
            ),
        ),
        ladder("interpolate", interpolated),
        ladder(
            "classify",
            volume(sheets, "classify", Classify::value_variants(), |args, v| {
                args.sheets.classify = v;
            }),
        ),
    ]
}

fn samples_ladders() -> Vec<Ladder> {
    let every = Some(OrderName::EverySample);
    let cells = [CellsName::Off, CellsName::Mean, CellsName::Split];
    let subpixels = [1, 2, 4, 8].map(Subpixels::Fixed);
    vec![
        ladder(
            "footprint",
            volume(
                every,
                "footprint",
                FootprintMode::value_variants(),
                |args, v| {
                    args.samples.footprint = v;
                },
            ),
        ),
        ladder(
            "kernel",
            volume(every, "kernel", KernelShape::value_variants(), |args, v| {
                args.samples.kernel = v;
            }),
        ),
        ladder(
            "cells",
            volume(every, "cells", &cells, |args, v| args.cells = v),
        ),
        ladder(
            "cell-error",
            volume(every, "cell-error", &[0.25, 0.0625, 0.015625], |args, v| {
                args.cell_error = v;
            }),
        ),
        ladder(
            "sample-subpixels",
            volume(every, "subpixels", &subpixels, |args, v| args.subpixels = v),
        ),
        ladder(
            "select",
            volume(every, "select", SelectMode::value_variants(), |args, v| {
                args.samples.select = v;
            }),
        ),
        ladder(
            "threshold",
            volume(every, "point-threshold", &[2.0, 1.0, 0.5], |args, v| {
                args.samples.point_threshold_px = v;
            }),
        ),
    ]
}

fn volume_ladders() -> Vec<Ladder> {
    let mut all = field_ladders();
    all.extend(image_sheets_ladders());
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
            "subpixels",
            [1, 2, 4, 8].map(|n| Setting::mesh(&["subpixels"], |options| options.subpixels = n)),
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
        Drawing::Texmap(_) => Setting::mesh(&["method", "subpixels"], |options| {
            options.method = texmap::Method::Hybrid;
            options.subpixels = 8;
        }),
        Drawing::Volsplat(_) => {
            let names = ["order", "slab", "subpixels", "min-transmittance"];
            Setting::volume(&names, |args| {
                args.order = Some(OrderName::Field);
                args.field.slab_voxels = 0.125;
                args.subpixels = Subpixels::Fixed(8);
                // A four-hundredth of a step of an 8-bit picture; 0 would take many times as long.
                args.min_transmittance = 1e-5;
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

    #[test]
    fn ladders_are_climbed_one_by_one_and_combined_where_named() {
        let drawing = Drawing::Volsplat(Box::default());
        let alone = settings(&drawing, &[]).expect("good");
        let rungs: usize = volume_ladders().iter().map(|l| l.rungs.len()).sum();
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
