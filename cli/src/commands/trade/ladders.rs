//! The ladders: for every choice of an application, its rungs from fast to exact.
//!
//! One ladder at a time is climbed from the default; the ladders named on the command line are combined with one
//! another as well. A combination that the application refuses, such as a footprint of splats with an order that has
//! none, is no setting and is left out.

use anyhow::{Result, bail};

/// A choice and its rungs.
pub(super) struct Ladder {
    /// What `--settings` calls it.
    pub(super) name: &'static str,
    /// Words of each rung, names and values in turn.
    pub(super) rungs: &'static [&'static [&'static str]],
}

/// What is measured of one application.
pub(super) struct Application {
    pub(super) ladders: &'static [Ladder],
    /// Words of the slowest, most exact setting.
    pub(super) exact: &'static [&'static str],
}

/// A setting to measure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Setting {
    /// What it changes, for people; empty is the default.
    pub(super) name: String,
    /// The ladder that it belongs to; "default", "exact" and "combined" stand for none.
    pub(super) group: String,
    /// Words, names and values in turn.
    pub(super) words: Vec<String>,
}

const VOLSPLAT: Application = Application {
    ladders: &[
        Ladder {
            name: "order",
            rungs: &[
                &["--order", "image-sheets"],
                &["--order", "every-sample"],
                &["--order", "axis-sheets"],
            ],
        },
        Ladder {
            name: "slab",
            rungs: &[
                &["--slab", "2"],
                &["--slab", "1"],
                &["--slab", "0.5"],
                &["--slab", "0.25"],
            ],
        },
        Ladder {
            name: "subpixel",
            rungs: &[
                &["--subpixel", "1"],
                &["--subpixel", "2"],
                &["--subpixel", "4"],
                &["--subpixel", "8"],
            ],
        },
        Ladder {
            name: "termination",
            rungs: &[
                &["--min-transmittance", "0.03125"],
                &["--min-transmittance", "0.001953125"],
                &["--min-transmittance", "0"],
            ],
        },
        Ladder {
            name: "footprint",
            rungs: &[
                &["--order", "every-sample", "--footprint", "affine-approx"],
                &["--order", "every-sample", "--footprint", "affine"],
                &["--order", "every-sample", "--footprint", "table"],
                &["--order", "every-sample", "--footprint", "exact"],
            ],
        },
        Ladder {
            name: "kernel",
            rungs: &[
                &["--order", "every-sample", "--kernel", "polynomial"],
                &["--order", "every-sample", "--kernel", "gaussian"],
                &["--order", "every-sample", "--kernel", "b-spline"],
            ],
        },
        Ladder {
            name: "sheet-kernel",
            rungs: &[
                &["--order", "image-sheets", "--kernel", "polynomial"],
                &["--order", "image-sheets", "--kernel", "gaussian"],
                &["--order", "image-sheets", "--kernel", "b-spline"],
                &["--order", "image-sheets", "--kernel", "trilinear"],
            ],
        },
        Ladder {
            name: "interpolate",
            rungs: &[
                &[
                    "--order",
                    "image-sheets",
                    "--kernel",
                    "b-spline",
                    "--interpolate",
                    "off",
                ],
                &[
                    "--order",
                    "image-sheets",
                    "--kernel",
                    "b-spline",
                    "--interpolate",
                    "on",
                ],
            ],
        },
        Ladder {
            name: "classify",
            rungs: &[&["--classify", "pre"], &["--classify", "post"]],
        },
        Ladder {
            name: "cells",
            rungs: &[
                &["--order", "every-sample", "--cells", "off"],
                &["--order", "every-sample", "--cells", "mean"],
                &["--order", "every-sample", "--cells", "split"],
            ],
        },
        Ladder {
            name: "cell-error",
            rungs: &[
                &["--order", "every-sample", "--cell-error", "0.25"],
                &["--order", "every-sample", "--cell-error", "0.0625"],
                &["--order", "every-sample", "--cell-error", "0.015625"],
            ],
        },
        Ladder {
            name: "sample-subpixel",
            rungs: &[
                &["--order", "every-sample", "--subpixel", "1"],
                &["--order", "every-sample", "--subpixel", "2"],
                &["--order", "every-sample", "--subpixel", "4"],
                &["--order", "every-sample", "--subpixel", "8"],
            ],
        },
        Ladder {
            name: "select",
            rungs: &[
                &["--order", "every-sample", "--select", "points"],
                &["--order", "every-sample", "--select", "hybrid"],
                &["--order", "every-sample", "--select", "splats"],
                &["--order", "every-sample", "--select", "ewa"],
            ],
        },
        Ladder {
            name: "threshold",
            rungs: &[
                &["--order", "every-sample", "--point-threshold", "2"],
                &["--order", "every-sample", "--point-threshold", "1"],
                &["--order", "every-sample", "--point-threshold", "0.5"],
            ],
        },
    ],
    // A transmittance of 1e-5 is a four-hundredth of a step of an 8-bit picture; 0 would take many times as long.
    exact: &[
        "--order",
        "image-sheets",
        "--slab",
        "0.125",
        "--subpixel",
        "8",
        "--min-transmittance",
        "0.00001",
    ],
};

const TEXMAP: Application = Application {
    ladders: &[
        Ladder {
            name: "method",
            rungs: &[
                &["--method", "point"],
                &["--method", "backward-nearest"],
                &["--method", "backward-bilinear"],
                &["--method", "backward-trilinear"],
                &["--method", "backward-ewa"],
                &["--method", "hybrid"],
            ],
        },
        Ladder {
            name: "subpixel",
            rungs: &[
                &["--subpixel", "1"],
                &["--subpixel", "2"],
                &["--subpixel", "4"],
                &["--subpixel", "8"],
            ],
        },
    ],
    exact: &["--method", "hybrid", "--subpixel", "8"],
};

const WARP3D: Application = Application {
    ladders: &[
        Ladder {
            name: "method",
            rungs: &[
                &["--method", "nearest"],
                &["--method", "points"],
                &["--method", "splats"],
                &["--method", "hybrid"],
            ],
        },
        Ladder {
            name: "subpixels",
            rungs: &[
                &["--subpixels", "1"],
                &["--subpixels", "2"],
                &["--subpixels", "4"],
                &["--subpixels", "8"],
            ],
        },
        Ladder {
            name: "mixed",
            rungs: &[&["--mixed", "keep"], &["--mixed", "unmix"]],
        },
    ],
    exact: &["--method", "hybrid", "--subpixels", "8"],
};

/// The application that a command line begins with.
pub(super) fn application(words: &[String]) -> Result<&'static Application> {
    match words.first().map(String::as_str) {
        Some("volsplat") => Ok(&VOLSPLAT),
        Some("texmap") => Ok(&TEXMAP),
        Some("warp3d") => Ok(&WARP3D),
        Some(other) => bail!("{other}: expected volsplat, texmap or warp3d after trade"),
        None => bail!("expected volsplat, texmap or warp3d after trade"),
    }
}

impl Application {
    /// The most exact setting, the default, one ladder at a time, and the combinations of the `named` ladders.
    pub(super) fn settings(&self, named: &[String]) -> Result<Vec<Setting>> {
        let mut settings = vec![
            setting("exact", "exact", self.exact),
            Setting {
                name: "default".into(),
                group: "default".into(),
                words: Vec::new(),
            },
        ];
        for ladder in self.ladders {
            settings.extend(
                ladder
                    .rungs
                    .iter()
                    .map(|rung| setting(&name(rung), ladder.name, rung)),
            );
        }
        let mut combined = vec![Vec::new()];
        for name in named {
            let ladder = self.ladders.iter().find(|ladder| ladder.name == name);
            let Some(ladder) = ladder else {
                let names: Vec<&str> = self.ladders.iter().map(|ladder| ladder.name).collect();
                bail!(
                    "--settings {name}: no such ladder, expected some of {}",
                    names.join(", ")
                );
            };
            combined = combined
                .iter()
                .flat_map(|words| {
                    ladder
                        .rungs
                        .iter()
                        .map(|rung| crate::words::with(words, &owned(rung)))
                })
                .collect();
        }
        if named.len() > 1 {
            let of = |words: Vec<String>| Setting {
                name: name(&words),
                group: "combined".into(),
                words,
            };
            settings.extend(combined.into_iter().map(of));
        }
        settings.dedup_by(|a, b| a.words == b.words);
        Ok(settings)
    }
}

fn setting(name: &str, group: &str, words: &[&str]) -> Setting {
    Setting {
        name: name.into(),
        group: group.into(),
        words: owned(words),
    }
}

fn owned(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
}

/// Words without their dashes: "slab 0.5, subpixel 2".
fn name<T: AsRef<str>>(words: &[T]) -> String {
    let pairs = words.chunks(2).map(|pair| {
        let [name, value] = [0, 1].map(|k| pair.get(k).map_or("", |word| word.as_ref()));
        format!("{} {value}", name.trim_start_matches("--"))
    });
    pairs.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ladders_are_climbed_one_by_one_and_combined_where_named() {
        let alone = VOLSPLAT.settings(&[]).expect("good");
        let rungs: usize = VOLSPLAT
            .ladders
            .iter()
            .map(|ladder| ladder.rungs.len())
            .sum();
        assert_eq!(alone.len(), 2 + rungs, "exact, default and every rung");
        let both = VOLSPLAT
            .settings(&["slab".into(), "subpixel".into()])
            .expect("good");
        assert_eq!(both.len(), alone.len() + 16, "four by four combinations");
        assert!(
            both.iter()
                .any(|s| s.name == "slab 2, subpixel 8" && s.group == "combined")
        );
        assert!(
            VOLSPLAT.settings(&["colour".into()]).is_err(),
            "no such ladder"
        );
    }

    #[test]
    fn every_rung_can_be_typed() {
        let inputs: [(&Application, &[&str]); 3] = [
            (&VOLSPLAT, &["volsplat", "a.nrrd"]),
            (&TEXMAP, &["texmap", "a.glb"]),
            (
                &WARP3D,
                &[
                    "warp3d",
                    "a.png",
                    "a.pfm",
                    "--from",
                    "fov:50",
                    "--to",
                    "shift:0,0,0",
                ],
            ),
        ];
        for (application, input) in inputs {
            let words: Vec<String> = owned(input)
                .into_iter()
                .chain(owned(&["-o", "a.exr"]))
                .collect();
            for setting in application.settings(&[]).expect("good") {
                let typed = crate::words::with(&words, &setting.words);
                assert!(
                    crate::words::parsed(&typed).is_ok(),
                    "{}",
                    crate::words::typed(&typed)
                );
            }
        }
    }
}
