//! The cost model of this machine: measured on built-in scenes, kept in the user's cache folder.
//!
//! Scenes that are made by formulas are drawn in several sizes and settings, so that the counts vary independently; the
//! fastest of a few frames counts. The file is named with version, machine and threads, and is not used for another. Without it,
//! a quick calibration of one application is made, with a line that says so.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::ValueEnum;
use resample_core::Camera;
use serde::{Deserialize, Serialize};

use super::found::Found;
use super::ladder::{self, Ladder};
use super::model::{Model, Sample, Work, counts};
use super::windows::part;
use crate::args::{Drawing, OrderName, SceneArg};
use crate::built_in::{self, DepthSize, Texture, Triangles};
use crate::machine;
use crate::measure;
use crate::opened::Opened;
use crate::plan::Purpose;
use crate::report::{self, Verbosity};
use crate::setting::Setting;

/// A model and where it comes from.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct Calibration {
    /// Version, date, machine, threads.
    pub(crate) described: String,
    /// Coefficients.
    pub(crate) model: Model,
}

/// Larger pictures of a setting are left out once one would take longer than this, ms: smaller ones predict them
/// well.
const MOST_MS: f64 = 100.0;

/// Least part of the windows' time that is taken to grow with their content. A guess, for disturbed clocks.
const LEAST_GROWING: f64 = 0.1;

/// Sides of the pictures, px.
const SIDES_PX: [u32; 3] = [48, 96, 160];

/// Side of a part of a picture, px, as the pilot draws them.
const PART_PX: u32 = 32;

impl Calibration {
    /// The one that comes with the program: it compares settings with one another, the same everywhere.
    pub(super) fn built_in() -> Result<Self> {
        serde_json::from_str(include_str!("built_in.json"))
            .context("the built-in calibration is damaged")
    }

    /// The cached one, or a quick one.
    pub(super) fn of_this_machine(application: &str) -> Result<Self> {
        if let Some(cached) = cache_file().and_then(|path| std::fs::read_to_string(path).ok()) {
            // A damaged file is as good as none.
            if let Ok(calibration) = serde_json::from_str(&cached) {
                return Ok(calibration);
            }
        }
        report::say(
            "this machine is not calibrated: measuring quickly; `resample calibrate` does it once and better",
        );
        measured(Some(application), 1)
    }

    /// Elapsed time of a whole picture: the time of the windows without their fixed cost, grown as the model's time grows to
    /// that of the picture, so that the cost of a scene beyond its counts is in it.
    pub(super) fn wall_ms(&self, found: &Found, (view, frame): (usize, &Work)) -> f64 {
        let (frame_ms, windows_ms) = (
            self.model.growing_ms(frame),
            self.model.growing_ms(&found.windows_work),
        );
        let cpu_ms = if self.model.knows(&frame.kind) && windows_ms > 0.0 {
            let fixed_ms = found.fixed_cpu_ms;
            let grown_ms = found.windows_cpu_ms - found.windows as f64 * fixed_ms;
            fixed_ms + frame_ms / windows_ms * grown_ms.max(LEAST_GROWING * found.windows_cpu_ms)
        } else {
            found.frames_cpu_ms[view]
        };
        cpu_ms * self.model.wall_per_cpu(&frame.kind)
    }
}

/// The file in the user's cache folder; `None` where there is no such folder.
pub(crate) fn cache_file() -> Option<PathBuf> {
    let name = format!(
        "calibration-{}-{}.json",
        env!("CARGO_PKG_VERSION"),
        machine::file_name()
    );
    Some(dirs::cache_dir()?.join("resample").join(name))
}

/// The calibration as text.
pub(crate) fn saved(calibration: &Calibration) -> Result<String> {
    Ok(serde_json::to_string_pretty(calibration)? + "\n")
}

/// Measures this machine, for all applications or for one.
pub(crate) fn measured(application: Option<&str>, reps: u16) -> Result<Calibration> {
    let folder =
        tempfile::tempdir().context("no temporary folder for the scenes of the calibration")?;
    let mut samples = Vec::new();
    for drawing in scenes(folder.path())? {
        if application.is_none_or(|name| drawing.name() == name) {
            add_samples(drawing, (reps, &mut samples))?;
        }
    }
    Ok(Calibration {
        described: machine::heading(),
        model: Model::fitted(&samples),
    })
}

fn scenes(folder: &Path) -> Result<Vec<Drawing>> {
    let mut all = Vec::new();
    for &scene in SceneArg::value_variants() {
        all.push(Drawing::Volsplat(Box::new(built_in::volume(
            scene, folder,
        )?)));
    }
    for (texture, triangles) in [
        (Texture::Fine, Triangles::Few),
        (Texture::Coarse, Triangles::Few),
        (Texture::Fine, Triangles::Many),
    ] {
        let mesh = built_in::mesh(folder, texture, triangles)?;
        all.push(Drawing::Texmap(Box::new(mesh)));
    }
    for size in [DepthSize::Full, DepthSize::Half] {
        let depth = built_in::depth_image(folder, size)?;
        all.push(Drawing::Warp3d(Box::new(depth)));
    }
    Ok(all)
}

/// The settings of an application whose counts differ: all rungs of its ladders.
fn settings(drawing: &Drawing) -> Result<Vec<Setting>> {
    let own = drawing.setting();
    let mut bases = vec![own.clone()];
    if let Setting::Volume(_) = own {
        bases.push(Setting::volume(&["order"], |args| {
            args.order = Some(OrderName::EverySample);
        }));
    }
    let mut all = Vec::new();
    for base in bases {
        let ladder = Ladder::of(&base, None)?;
        let rungs = ladder.rungs.into_iter().map(|rung| rung.setting);
        for setting in rungs.chain([ladder.exact]) {
            all.push(base.with(&setting)?);
        }
    }
    Ok(all)
}

fn add_samples(drawing: Drawing, (reps, samples): (u16, &mut Vec<Sample>)) -> Result<()> {
    let settings = settings(&drawing)?;
    let mut opened = Opened::read(drawing, Purpose::Compare, Verbosity::Quiet)?;
    let cameras = cameras(&opened)?;
    for setting in settings {
        opened.set(&setting)?;
        let kind = ladder::kind(&setting);
        // Time per pixel of the last picture.
        let mut ms_per_pixel = 0.0;
        for camera in &cameras {
            let pixels = f64::from(camera.width) * f64::from(camera.height);
            if ms_per_pixel * pixels > MOST_MS {
                continue;
            }
            let mut best: Option<Sample> = None;
            for _ in 0..reps {
                let rendered = measure::rendered(&mut opened, camera)?;
                let fastest = best.as_ref().map_or(f64::INFINITY, |best| best.time.cpu_ms);
                if rendered.time.cpu_ms < fastest {
                    best = Some(Sample {
                        work: Work {
                            kind: kind.clone(),
                            counts: counts(&rendered.keys, pixels),
                        },
                        time: rendered.time,
                    });
                }
            }
            ms_per_pixel = best.as_ref().map_or(0.0, |best| best.time.cpu_ms / pixels);
            samples.extend(best);
        }
    }
    Ok(())
}

/// Whole pictures of several sizes, a nearer view, and parts.
fn cameras(opened: &Opened) -> Result<Vec<Camera>> {
    let first = opened
        .cameras()
        .first()
        .context("a built-in scene has no camera")?;
    let mut cameras = Vec::new();
    for side in SIDES_PX {
        cameras.push(first.resized(side, side)?);
    }
    let middle = SIDES_PX[SIDES_PX.len() - 1];
    let large = first.resized(middle, middle)?;
    cameras.push(
        Camera {
            fx: 2.0 * large.fx,
            fy: 2.0 * large.fy,
            ..large
        }
        .validated()?,
    );
    cameras.push(part(&large, [64, 64], PART_PX));
    cameras.push(part(&large, [48, 80], PART_PX));
    Ok(cameras)
}
