//! What this machine needs for the counts of a picture: measured on built-in scenes, kept in the user's cache folder.
//!
//! Scenes that are made by formulas are drawn in several sizes and settings, so that the counts vary independently; the
//! fastest of a few frames counts. The file is named with version, machine and threads, and is not used for another. Without it,
//! a quick calibration of one application is made, and said.

use std::path::PathBuf;

use anyhow::{Context, Result};
use resample_core::Camera;
use serde::{Deserialize, Serialize};

use super::ladders;
use super::model::{Counts, Model, Sample, counts, milliseconds};
use super::pilot::Found;
use super::windows::part;
use crate::args::SceneArg;
use crate::built_in::{self, DepthSize, Texture, Triangles};
use crate::commands::Opened;
use crate::machine;
use crate::report::{self, Verbosity};
use crate::words;

/// A model and where it comes from.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct Calibration {
    /// Version, date, machine, threads.
    pub(crate) described: String,
    /// Coefficients.
    pub(crate) model: Model,
}

/// Larger pictures of a setting are left out once one would take longer than this, ms: what takes long is told well by
/// smaller ones.
const MOST_MS: f64 = 100.0;

/// Least part of the windows' time that is taken to grow with what they show. A guess, for disturbed clocks.
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
    pub(super) fn of_this_machine(command: &[String]) -> Result<Self> {
        if let Some(cached) = cache_file().and_then(|path| std::fs::read_to_string(path).ok()) {
            // A damaged file is as good as none.
            if let Ok(calibration) = serde_json::from_str(&cached) {
                return Ok(calibration);
            }
        }
        report::say(
            "this machine is not calibrated: measuring quickly; `resample calibrate` does it once and better",
        );
        measured(command.first().map(String::as_str), 1)
    }

    /// Elapsed time of a whole picture: the model says how the time of the windows, without what each of them takes in any
    /// case, grows to that of the picture, so that what a scene costs beyond its counts is in it.
    pub(super) fn wall_ms(&self, found: &Found, (view, frame): (usize, &Counts)) -> f64 {
        let growing = |counts: &Counts| {
            self.model
                .knows(&found.path)
                .then(|| self.model.growing_ms(&found.path, counts))
        };
        let cpu_ms = match (growing(frame), growing(&found.windows_counts)) {
            (Some(frame), Some(windows)) if windows > 0.0 => {
                let fixed_ms = found.fixed_cpu_ms;
                let grown_ms = found.windows_cpu_ms - found.windows as f64 * fixed_ms;
                fixed_ms + frame / windows * grown_ms.max(LEAST_GROWING * found.windows_cpu_ms)
            }
            _ => found.frames_cpu_ms[view],
        };
        cpu_ms * self.model.wall_per_cpu(&found.path)
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
    for (scene, settings) in scenes(folder.path())? {
        if application.is_none_or(|name| scene[0] == name) {
            measure(&scene, &settings, (reps, &mut samples))?;
        }
    }
    Ok(Calibration {
        described: machine::heading(),
        model: Model::fitted(&samples),
    })
}

/// Words of the scenes, each with its settings.
type Scenes = Vec<(Vec<String>, Vec<Vec<String>>)>;

fn scenes(folder: &std::path::Path) -> Result<Scenes> {
    let list = |texts: &[String]| -> Vec<Vec<String>> {
        texts
            .iter()
            .map(|text| text.split_whitespace().map(str::to_owned).collect())
            .collect()
    };
    let mut volumes: Vec<String> = Vec::new();
    for subpixel in [1, 2, 4, 8] {
        volumes
            .extend([2.0, 0.5, 0.125].map(|slab| format!("--slab {slab} --subpixel {subpixel}")));
    }
    volumes.extend(
        ["exact", "affine", "table"].map(|f| format!("--order every-sample --footprint {f}")),
    );
    let mut meshes: Vec<String> = Vec::new();
    for method in [
        "backward-nearest",
        "backward-bilinear",
        "backward-trilinear",
        "backward-ewa",
        "point",
        "hybrid",
    ] {
        meshes.extend([1, 2, 4, 8].map(|n| format!("--method {method} --subpixel {n}")));
    }
    let plain = ["nearest", "points", "splats"].map(|method| format!("--method {method}"));
    let hybrid = [1, 2, 4, 8].map(|n| format!("--method hybrid --subpixels {n}"));
    let warps: Vec<String> = plain.into_iter().chain(hybrid).collect();
    let mut all = Vec::new();
    for scene in [
        SceneArg::CheckerBox,
        SceneArg::MarschnerLobb,
        SceneArg::Blobs,
    ] {
        all.push((built_in::volume(scene, folder)?, list(&volumes)));
    }
    for (texture, triangles) in [
        (Texture::Fine, Triangles::Few),
        (Texture::Coarse, Triangles::Few),
        (Texture::Fine, Triangles::Many),
    ] {
        all.push((built_in::mesh(folder, texture, triangles)?, list(&meshes)));
    }
    for size in [DepthSize::Full, DepthSize::Half] {
        all.push((built_in::depth_image(folder, size)?, list(&warps)));
    }
    Ok(all)
}

fn measure(
    scene: &[String],
    settings: &[Vec<String>],
    (reps, samples): (u16, &mut Vec<Sample>),
) -> Result<()> {
    let mut all = scene.to_vec();
    // The picture is never written; the name only has to be good.
    all.extend([
        "-o".to_owned(),
        std::env::temp_dir()
            .join("resample-calibrate.exr")
            .display()
            .to_string(),
    ]);
    let mut opened = Opened::read(&words::parsed(&all)?.command, Verbosity::Quiet)?;
    let cameras = cameras(&opened)?;
    for setting in settings {
        let command = words::parsed(&words::with(&all, setting))?.command;
        let path = ladders::path(&command);
        // Time per pixel of the last picture.
        let mut ms_per_pixel = 0.0;
        for camera in &cameras {
            let pixels = f64::from(camera.width) * f64::from(camera.height);
            if ms_per_pixel * pixels > MOST_MS {
                continue;
            }
            let mut best: Option<Sample> = None;
            for _ in 0..reps {
                let keys = opened.draw(&command, camera)?.account.keys;
                let sample = Sample {
                    path: path.clone(),
                    counts: counts(&keys, pixels),
                    cpu_ms: milliseconds(&keys, "cpu_ms"),
                    wall_ms: milliseconds(&keys, "wall_ms"),
                };
                if best.as_ref().is_none_or(|best| sample.cpu_ms < best.cpu_ms) {
                    best = Some(sample);
                }
            }
            ms_per_pixel = best.as_ref().map_or(0.0, |best| best.cpu_ms / pixels);
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
