//! Draws thin opaque shells and prints their error and their cost beside those of a ramp, as a Markdown table.
//!
//! `cargo run --release -p resample-tests --example shells`. A shell is a peak of the transfer function, 2 % of the volume's
//! range wide, with an opacity of 0.95 over a voxel. Truths: the formula of the field where it has one, else the trilinear
//! field in f64, with 24 steps through the peak and 100 (far: 144) rays a pixel. A ramp rises to 0.3 over 40 % of the range
//! around the peak. Time is process-CPU time of one frame: the least of four. Says "skipped" where the data is absent.

use glam::{DAffine3, DVec3};
use resample_core::metrics::{Mask, compare};
use resample_core::{Camera, Image, LookAt};
use resample_tests::data::data_file;
use resample_tests::volumes::area_truth::AreaTruth;
use resample_tests::volumes::peer_scenes::Subject;
use resample_tests::volumes::scenes::transfer;
use resample_tests::volumes::shells::Shell;
use volsplat::{LoadOptions, RenderOptions, Renderer, TransferFunction, Volume};

const PROGRAM: &str = "shells";

/// Width of the peak as a part of the range, and its opacity over a voxel.
const WIDTH: f64 = 0.02;
const OPACITY: f64 = 0.95;

/// Side of the pictures of real volumes, px.
const SIDE_PX: u32 = 200;

/// A volume and where its peak lies, as a part of its range.
struct Scene {
    name: String,
    volume: Volume,
    centre: f64,
}

fn main() {
    println!("| shell | view | PSNR | CPU ms | of the ramp |\n|---|---|---|---|---|");
    for shell in Shell::ALL {
        let (volume, look) = (shell.volume(), shell.look(WIDTH, OPACITY));
        for (view, voxel_px) in [("close", 3.0), ("far", 0.5)] {
            let camera = shell.camera(voxel_px);
            let truth = shell.truth(&look, &camera);
            let (low, high) = volume.value_range();
            let centre = (look.opacity_knots()[1].value - low) / (high - low);
            let ramp = ramp(&volume, centre);
            print_row(
                shell.name(),
                view,
                &truth,
                [&look, &ramp],
                (&volume, &camera),
            );
        }
    }
    for scene in real_scenes() {
        let look = peak(&scene.volume, scene.centre);
        let ramp = ramp(&scene.volume, scene.centre);
        for (view, rays) in [("close", 10), ("far", 12)] {
            let camera = camera(scene.volume.dims, view);
            let mut truth = AreaTruth::new(&scene.volume, &look);
            (truth.rays_per_side, truth.steps_per_voxel) = (rays, 8.0);
            truth.steps_per_range = 24.0;
            let truth = truth.render(&camera);
            print_row(
                &scene.name,
                view,
                &truth,
                [&look, &ramp],
                (&scene.volume, &camera),
            );
        }
    }
}

fn real_scenes() -> Vec<Scene> {
    let mut scenes = Vec::new();
    let mut add = |name: &str, volume: Volume, centres: [f64; 2]| {
        scenes.extend(centres.map(|centre| Scene {
            name: format!("{name}, {:.0} % of the range", 100.0 * centre),
            volume: volume.clone(),
            centre,
        }));
    };
    if let Some(volume) = Subject::Engine.volume(PROGRAM) {
        add("Engine", volume, [0.35, 0.6]);
    }
    if let Some(path) = data_file(PROGRAM, "volumes/mhd/bonsai_small.mhd") {
        let bonsai = volsplat::load(&path, &LoadOptions::default()).expect("a readable volume");
        let volume = Volume::new(bonsai.dims, bonsai.voxels, DAffine3::IDENTITY);
        add("bonsai", volume.expect("a valid volume"), [0.2, 0.35]);
    }
    scenes
}

fn peak(volume: &Volume, centre: f64) -> TransferFunction {
    let (low, high) = volume.value_range();
    let at = |part: f64| low + part * (high - low);
    let ends = [at(centre - 0.5 * WIDTH), at(centre + 0.5 * WIDTH)];
    transfer(
        &[(ends[0], [0.9, 0.3, 0.2]), (ends[1], [1.0, 0.8, 0.3])],
        &[(ends[0], 0.0), (at(centre), OPACITY), (ends[1], 0.0)],
    )
}

fn ramp(volume: &Volume, centre: f64) -> TransferFunction {
    let (low, high) = volume.value_range();
    let at = |part: f64| low + part * (high - low);
    transfer(
        &[(low, [0.9, 0.5, 0.3])],
        &[(at(centre - 0.1), 0.0), (at(centre + 0.3), 0.3)],
    )
}

/// Close, the whole volume fills the picture; far, a voxel in its middle is half a pixel large.
fn camera(dims: [usize; 3], view: &str) -> Camera {
    let extent = DVec3::from(dims.map(|n| (n - 1) as f64));
    let fov_y_rad = 30f64.to_radians();
    let focal_px = 0.5 * f64::from(SIDE_PX) / (0.5 * fov_y_rad).tan();
    let away = if view == "far" {
        2.0 * focal_px
    } else {
        (0.45 * focal_px).max(0.62 * extent.length())
    };
    let target = 0.5 * extent;
    let look_at = LookAt {
        position: target + away * DVec3::new(0.62, 0.38, 0.69).normalize(),
        target,
        up: DVec3::Y,
    };
    Camera::perspective(&look_at, fov_y_rad, [SIDE_PX; 2]).expect("a pose with a direction")
}

fn print_row(
    name: &str,
    view: &str,
    truth: &Image,
    looks: [&TransferFunction; 2],
    (volume, camera): (&Volume, &Camera),
) {
    let [(image, shell_ms), (_, ramp_ms)] = looks.map(|look| drawn(volume, look, camera));
    let inside = Mask::from_alpha(truth);
    let psnr_db = compare(&image, truth, Some(&inside))
        .expect("pictures of one size")
        .psnr_db;
    println!(
        "| {name} | {view} | {psnr_db:.1} dB | {shell_ms:.1} | {:.2} |",
        shell_ms / ramp_ms
    );
}

/// The picture, and the least CPU time of four frames.
fn drawn(volume: &Volume, look: &TransferFunction, camera: &Camera) -> (Image, f64) {
    let mut renderer =
        Renderer::new(volume, look, &RenderOptions::default()).expect("valid options");
    let mut frame = || renderer.render(camera).expect("a valid camera");
    let first = frame();
    let least = (0..3)
        .map(|_| frame().stats.cpu_ms)
        .fold(first.stats.cpu_ms, f64::min);
    (first.image, least)
}
