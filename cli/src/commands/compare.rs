//! `resample compare`: how far a picture, or an animation, is from its reference.
//!
//! Every pair of pictures is compared by the metrics of `resample_core::metrics`, in linear light with premultiplied
//! alpha; of an animation the worst picture is printed beside the mean, and the flicker: how much more, or less, each
//! pixel changes from picture to picture than in the reference. The result goes to stdout; a bound that is broken
//! makes the exit code 1.

use std::path::Path;

use anyhow::{Context, Result, bail};
use resample_core::metrics::{Comparison, Mask, flip};
use resample_core::{Image, metrics};
use resample_io::rendered::{self, Pictures};
use serde_json::{Value, json};

use crate::args::CompareArgs;
use crate::measure::figures;
use crate::measure::figures::{Better, FLICKER, METRICS};
use crate::output;
use crate::output::{Depth, Format};
use crate::process::report;

/// Pictures were compared, and are farther apart than a bound: of `--fail-above`, or of a table.
#[derive(Debug)]
pub(crate) struct TooFar {
    pub(crate) what: String,
}

impl std::fmt::Display for TooFar {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.what)
    }
}

impl std::error::Error for TooFar {}

/// All figures of a run.
struct Findings {
    /// One per pair of pictures.
    pictures: Vec<Comparison>,
    /// The pair with the largest FLIP error, and the map of its errors.
    worst: usize,
    worst_map: metrics::ScalarMap,
    /// RMS over pixels and steps of the difference between the changes of picture and reference.
    flicker: Option<f64>,
}

/// Compares, prints, and checks the bounds.
pub(crate) fn run(args: &CompareArgs) -> Result<()> {
    check_bounds(args)?;
    if let Some(path) = &args.heatmap {
        output::check_writable(path)?;
        output::check_not_input(path, &[args.picture.as_path(), args.reference.as_path()])?;
    }
    let findings = compared(args)?;
    let text = if args.json {
        format!("{}\n", serde_json::to_string_pretty(&findings.json())?)
    } else {
        findings.text()
    };
    report::print(&text)?;
    if let Some(path) = &args.heatmap {
        output::write_picture(
            path,
            Format::Png(Depth::Eight),
            &figures::heatmap(&findings.worst_map),
        )?;
    }
    findings.hold(&args.bounds)
}

fn check_bounds(args: &CompareArgs) -> Result<()> {
    let known = |name: &str| name == FLICKER || METRICS.iter().any(|metric| metric.0 == name);
    match args.bounds.iter().find(|(name, _)| !known(name)) {
        None => Ok(()),
        Some((name, _)) => {
            let names: Vec<&str> = METRICS
                .iter()
                .map(|metric| metric.0)
                .chain([FLICKER])
                .collect();
            bail!(
                "--fail-above {name}: no such figure, expected one of {}",
                names.join(", ")
            )
        }
    }
}

fn compared(args: &CompareArgs) -> Result<Findings> {
    let mask = args.within.as_deref().map(light_parts).transpose()?;
    let (mut pictures, mut references) = (
        Pictures::open(&args.picture)?,
        Pictures::open(&args.reference)?,
    );
    let mut findings: Option<Findings> = None;
    let mut steps = metrics::Flicker::default();
    loop {
        let (picture, reference) = match (pictures.next_picture()?, references.next_picture()?) {
            (Some(picture), Some(reference)) => (picture, reference),
            (None, None) => break,
            (picture, _) => {
                let (short, long) = if picture.is_none() {
                    (&args.picture, &args.reference)
                } else {
                    (&args.reference, &args.picture)
                };
                bail!(
                    "{}: has fewer pictures than {}",
                    short.display(),
                    long.display()
                );
            }
        };
        let inside = args.inside.then(|| Mask::from_alpha(&reference));
        let mask = inside.as_ref().or(mask.as_ref());
        add(&mut findings, &picture, &reference, mask).with_context(|| {
            format!(
                "{} against {}",
                args.picture.display(),
                args.reference.display()
            )
        })?;
        steps.add(picture, reference, mask);
    }
    let mut findings =
        findings.with_context(|| format!("{}: holds no picture", args.picture.display()))?;
    findings.flicker = steps.rms();
    Ok(findings)
}

/// Compares one pair and keeps its figures; the map only of the worst.
fn add(
    findings: &mut Option<Findings>,
    picture: &Image,
    reference: &Image,
    mask: Option<&Mask>,
) -> Result<()> {
    let comparison = metrics::compare(picture, reference, mask)?;
    let is_worst = findings
        .as_ref()
        .is_none_or(|f| comparison.flip.mean > f.pictures[f.worst].flip.mean);
    let found = findings.get_or_insert_with(|| Findings {
        pictures: Vec::new(),
        worst: 0,
        worst_map: metrics::ScalarMap {
            width: 0,
            height: 0,
            values: Vec::new(),
        },
        flicker: None,
    });
    if is_worst {
        found.worst = found.pictures.len();
        found.worst_map = flip::map(picture, reference, flip::DEFAULT_PIXELS_PER_DEGREE)?;
    }
    found.pictures.push(comparison);
    Ok(())
}

impl Findings {
    /// The mean of a figure over all pictures, and the worst.
    fn mean_and_worst(&self, better: Better, of: fn(&Comparison) -> f64) -> (f64, f64) {
        let values = self.pictures.iter().map(of);
        let mean = values.clone().sum::<f64>() / self.pictures.len() as f64;
        let worst = match better {
            Better::Less => values.fold(f64::NEG_INFINITY, f64::max),
            Better::More => values.fold(f64::INFINITY, f64::min),
        };
        (mean, worst)
    }

    fn text(&self) -> String {
        let several = self.pictures.len() > 1;
        let mut text = String::new();
        if several {
            text += &format!(
                "{} pictures, the worst is number {}\n",
                self.pictures.len(),
                self.worst
            );
            text += &format!("{:<12}{:>12}{:>12}\n", "", "mean", "worst");
        }
        for (name, better, of) in METRICS {
            let (mean, worst) = self.mean_and_worst(better, of);
            text += &format!("{name:<12}{:>12}", short(mean));
            text += &if several {
                format!("{:>12}\n", short(worst))
            } else {
                "\n".into()
            };
        }
        if let Some(flicker) = self.flicker {
            text += &format!("{FLICKER:<12}{:>12}\n", short(flicker));
        }
        text += &format!("{:<12}{:>12}\n", "pixels", self.pictures[0].pixel_count);
        text
    }

    fn json(&self) -> Value {
        let mut all = json!({"pictures": self.pictures.iter().map(figures::record).collect::<Vec<_>>(), "worst": self.worst});
        if let Some(flicker) = self.flicker {
            all[FLICKER] = json!(flicker);
        }
        all
    }

    /// Checks the bounds against the worst picture.
    fn hold(&self, bounds: &[(String, f64)]) -> Result<()> {
        for (name, bound) in bounds {
            let metric = METRICS.iter().find(|metric| metric.0 == name);
            let (better, value) = match metric {
                Some(&(_, better, of)) => (better, self.mean_and_worst(better, of).1),
                None => match self.flicker {
                    Some(flicker) => (Better::Less, flicker),
                    None => bail!(
                        "--fail-above {name}: one picture does not flicker, expected an animation"
                    ),
                },
            };
            let (broken, relation) = match better {
                Better::Less => (value > *bound, "above"),
                Better::More => (value < *bound, "below"),
            };
            if broken {
                let what = format!("{name} is {}, {relation} the bound {bound}", short(value));
                return Err(TooFar { what }.into());
            }
        }
        Ok(())
    }
}

/// Four significant digits; endless where there is no difference.
fn short(value: f64) -> String {
    if value.is_infinite() {
        return "inf".into();
    }
    if value == 0.0 || (1e-3..1e4).contains(&value.abs()) {
        let digits = if value.abs() >= 10.0 { 2 } else { 5 };
        format!("{value:.digits$}")
    } else {
        format!("{value:.3e}")
    }
}

/// Where a picture is lighter than middle grey, and not transparent.
fn light_parts(path: &Path) -> Result<Mask> {
    let picture = rendered::read(path)?;
    // Rec. 709 luminance of the picture on black; 0.2140 is the linear light of the sRGB code 0.5.
    let light = |p: &[f32; 4]| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2] > 0.2140;
    let inside: Vec<bool> = picture.rgba.iter().map(light).collect();
    if !inside.contains(&true) {
        bail!(
            "{}: it selects no pixel: it is lighter than middle grey nowhere",
            path.display()
        );
    }
    Ok(Mask::new(picture.width, picture.height, inside)?)
}
