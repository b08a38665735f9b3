//! `resample demo`: built-in volumes to pictures, without any file.
//!
//! Each scene is a formula, a transfer function and a view. The scenes show what the renderer is for: ripples that
//! are hard to reconstruct, soft translucent matter, and a box of opaque cells with sharp edges.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use volsplat::transfer::{ColourKnot, OpacityKnot};
use volsplat::{RenderOptions, Renderer, TransferFunction, Volume, procedural};

use crate::args::DemoArgs;
use crate::background::Background;
use crate::framing::{self, Extent, Lens, View};
use crate::output::{self, Depth, Format};
use crate::picture::{self, Finish};
use crate::progress::Progress;
use crate::report::{self, Verbosity};
use crate::values::{Orbit, Size};

/// A built-in volume and how it is shown.
struct Scene {
    name: &'static str,
    volume: Volume,
    transfer: TransferFunction,
    orbit: Orbit,
}

/// Vertical field of view, degrees: wide enough that near and far voxels differ in size.
const FOV_Y_DEG: f64 = 40.0;

/// Plain PNG over black, so that translucent matter looks the same in every viewer.
const FINISH: Finish = Finish {
    format: Format::Png(Depth::Eight),
    background: Background::Colour([0.0; 3]),
};

/// Renders every scene into the folder and says where the pictures are.
pub(crate) fn run(args: &DemoArgs, verbosity: Verbosity) -> Result<()> {
    let start = Instant::now();
    let scenes = scenes()?;
    output::make_folder(&args.output)?;
    let mut frames = Vec::with_capacity(scenes.len());
    for scene in &scenes {
        let file = args.output.join(format!("{}.png", scene.name));
        output::check_writable(&file)?;
        let frame = draw(scene, args.size, file)?;
        if verbosity == Verbosity::Verbose {
            report::say(&report::stage_line(&frame));
        }
        frames.push(frame);
    }
    if verbosity != Verbosity::Quiet {
        report::say(&report::summary(&frames, start.elapsed().as_secs_f64()));
    }
    Ok(())
}

fn scenes() -> Result<Vec<Scene>> {
    Ok(vec![
        Scene {
            name: "marschner_lobb",
            volume: procedural::marschner_lobb(96)?,
            transfer: ripple_transfer()?,
            orbit: orbit(25.0, 25.0, 1.0),
        },
        Scene {
            name: "blobs",
            volume: procedural::blobs(96)?,
            transfer: blob_transfer()?,
            orbit: orbit(15.0, 20.0, 0.75),
        },
        Scene {
            name: "checker_box",
            volume: procedural::checker_box(100, 10)?,
            transfer: checker_transfer()?,
            orbit: orbit(35.0, 25.0, 1.0),
        },
    ])
}

fn draw(scene: &Scene, size: Size, file: PathBuf) -> Result<report::WrittenFrame> {
    let mut renderer = Renderer::new(&scene.volume, &scene.transfer, &RenderOptions::default())?;
    let bounds = renderer
        .visible_bounds_in_world()
        .unwrap_or_else(|| framing::volume::grid_bounds(&scene.volume));
    let stance = framing::volume::stance(&scene.volume, None);
    let view = View {
        size,
        orbit: scene.orbit,
        stance,
        lens: Lens::Perspective {
            fov_y_deg: FOV_Y_DEG,
        },
    };
    let extent = Extent::of_box(framing::volume::with_kernels(bounds, &scene.volume));
    let camera = framing::frame(&extent, &view)?;
    picture::check_size(&camera)?;
    picture::draw(
        &mut |camera, _| super::volsplat::drawn(&mut renderer, camera, Progress::Hidden),
        &camera,
        0,
        file,
        &FINISH,
    )
}

/// Colours by hand, for looks only.
fn ripple_transfer() -> Result<TransferFunction> {
    let colours = [
        (0.0, [0.01, 0.02, 0.15]),
        (0.1, [0.02, 0.3, 0.4]),
        (0.2, [0.9, 0.75, 0.3]),
        (0.5, [0.8, 0.2, 0.05]),
        (1.0, [0.25, 0.02, 0.1]),
    ];
    transfer(&colours, &[(0.0, 0.3), (0.1, 0.3), (0.2, 0.9)])
}

fn blob_transfer() -> Result<TransferFunction> {
    transfer(
        &[
            (0.0, [0.05, 0.1, 0.5]),
            (1.0, [0.6, 0.1, 0.4]),
            (1.6, [1.0, 0.4, 0.05]),
            (2.2, [1.0, 0.9, 0.5]),
        ],
        &[
            (0.1, 0.0),
            (0.6, 0.015),
            (1.4, 0.04),
            (1.8, 0.3),
            (2.4, 0.8),
        ],
    )
}

fn checker_transfer() -> Result<TransferFunction> {
    let [dark, light] = procedural::CHECKER_VALUES.map(f64::from);
    transfer(
        &[(dark, [0.05, 0.12, 0.35]), (light, [0.9, 0.85, 0.7])],
        &[(dark, 0.9), (light, 0.9)],
    )
}

fn transfer(colours: &[(f64, [f32; 3])], opacities: &[(f64, f64)]) -> Result<TransferFunction> {
    let colours = colours
        .iter()
        .map(|&(value, rgb)| ColourKnot { value, rgb })
        .collect();
    let opacities = opacities
        .iter()
        .map(|&(value, opacity)| OpacityKnot { value, opacity })
        .collect();
    Ok(TransferFunction::new(colours, opacities)?)
}

fn orbit(azimuth_deg: f64, elevation_deg: f64, distance: f64) -> Orbit {
    Orbit {
        azimuth_deg,
        elevation_deg,
        distance,
    }
}
