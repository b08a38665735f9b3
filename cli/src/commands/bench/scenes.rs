//! Published tables over built-in scenes: footprints, orders, texture filters, warps.
//!
//! The tables of `docs/results` need real data or long runs; these are their short sisters: scenes made by formulas, the
//! same columns, on the user's machine. Errors are taken against the most exact setting, or, for warps, against the
//! true picture.

use anyhow::Result;
use resample_core::Camera;

use super::settings::{Against, Bench, Measured, Motion};
use crate::args::{BenchSceneArgs, SceneArg};
use crate::built_in::{self, DepthSize, Texture, Triangles};
use crate::machine;
use crate::report::Verbosity;

/// Steps of a shimmer: sixteen of a sixteenth of a pixel are one pixel.
const SHIMMER_STEPS: u32 = 16;

/// Degrees by which the view turns in the table of orders, and its steps: across 45 degrees, where slices change over.
const TURN_DEG: [f64; 2] = [40.0, 50.0];
const TURN_STEPS: u32 = 40;

/// A temporary folder and the words that its files are drawn with.
struct Scene {
    name: &'static str,
    words: Vec<String>,
    /// Removed with its files when the table is made.
    folder: tempfile::TempDir,
}

fn folder() -> Result<tempfile::TempDir> {
    Ok(tempfile::tempdir()?)
}

impl Scene {
    fn volume(name: &'static str, scene: SceneArg, camera: &str) -> Result<Self> {
        let folder = folder()?;
        let mut words = built_in::volume(scene, folder.path())?;
        words.extend(camera.split_whitespace().map(str::to_owned));
        Ok(Self {
            name,
            words,
            folder,
        })
    }

    fn bench(
        &self,
        size: Option<&BenchSceneArgs>,
        settings: Vec<&'static str>,
        reps: u16,
    ) -> Bench {
        let mut words = self.words.clone();
        if let Some(args) = size {
            words.extend([
                "--size".to_owned(),
                format!("{}x{}", args.size.width, args.size.height),
            ]);
        }
        words.extend([
            "-o".to_owned(),
            self.folder.path().join("picture.exr").display().to_string(),
        ]);
        Bench {
            words,
            settings,
            reps,
        }
    }
}

/// Footprint modes and kernels.
pub(super) fn footprint(args: &BenchSceneArgs, verbosity: Verbosity) -> Result<String> {
    let settings = vec![
        "--order every-sample --footprint affine-approx",
        "--order every-sample --footprint affine",
        "--order every-sample --footprint table",
        "--order every-sample --footprint exact",
        "--order every-sample --kernel polynomial",
        "--order every-sample --kernel b-spline",
    ];
    let mut text = heading(
        args,
        "errors against `--order every-sample --footprint exact` with the Gaussian",
    );
    // Near and wide, where cones are wide and slant.
    let views = [
        (
            "blobs, near, 60 degrees",
            "--orbit 30,20,0.6 --fov 60 --select splats",
        ),
        (
            "blobs, near, 100 degrees",
            "--orbit 30,20,0.6 --fov 100 --select splats",
        ),
    ];
    for (name, camera) in views {
        let scene = Scene::volume(name, SceneArg::Blobs, camera)?;
        let bench = scene.bench(Some(args), settings.clone(), args.reps);
        let exact = Against::Setting("--order every-sample --footprint exact");
        text += &table(
            scene.name,
            &bench.measured(exact, &Motion::Still, verbosity)?,
        );
    }
    Ok(text)
}

/// Orders of compositing.
pub(super) fn orders(args: &BenchSceneArgs, verbosity: Verbosity) -> Result<String> {
    let settings = vec![
        "--order image-sheets",
        "--order image-sheets --slab 1 --subpixel 1",
        "--order image-sheets --slab 0.25 --subpixel 4",
        "--order every-sample",
        "--order axis-sheets",
    ];
    let mut text = heading(
        args,
        "errors against `--slab 0.125 --subpixel 8`; jump: largest over median change while the view turns from 40 to 50 degrees",
    );
    for (name, scene) in [
        ("checker box", SceneArg::CheckerBox),
        ("Marschner-Lobb", SceneArg::MarschnerLobb),
        ("blobs", SceneArg::Blobs),
    ] {
        let scene = Scene::volume(name, scene, "--orbit 45,0")?;
        let bench = scene.bench(Some(args), settings.clone(), args.reps);
        let exact = Against::Setting("--slab 0.125 --subpixel 8 --min-transmittance 0.00001");
        text += &table(
            scene.name,
            &bench.measured(exact, &Motion::Even(turned), verbosity)?,
        );
    }
    Ok(text)
}

/// Texture filters.
pub(super) fn texture(args: &BenchSceneArgs, verbosity: Verbosity) -> Result<String> {
    let settings = vec![
        "--method backward-nearest",
        "--method backward-bilinear",
        "--method backward-trilinear",
        "--method backward-ewa",
        "--method point",
        "--method hybrid --subpixel 2",
        "--method hybrid",
        "--method hybrid --subpixel 8",
    ];
    let folder = folder()?;
    let mut words = built_in::mesh(folder.path(), Texture::Fine, Triangles::Few)?;
    words.extend(["--orbit", "20,12,0.35"].map(str::to_owned));
    let scene = Scene {
        name: "ball on a ground",
        words,
        folder,
    };
    let bench = scene.bench(Some(args), settings, args.reps);
    let rows = bench.measured(
        Against::Setting("--method hybrid --subpixel 8"),
        &Motion::Shimmer(shifted),
        verbosity,
    )?;
    let what = "errors against `--method hybrid --subpixel 8`; shimmer: error of the change over sixteen steps of a \
                sixteenth of a pixel";
    Ok(heading(args, what) + &table(scene.name, &rows))
}

/// Methods of warping.
pub(super) fn warp(args: &BenchSceneArgs, verbosity: Verbosity) -> Result<String> {
    let settings = vec![
        "--method nearest",
        "--method points",
        "--method splats",
        "--method hybrid",
        "--method hybrid --mixed keep",
        "--method hybrid --fill background",
    ];
    let folder = folder()?;
    let words = built_in::depth_image(folder.path(), DepthSize::Full)?;
    let scene = Scene {
        name: "ball before a wall, 320x240",
        words,
        folder,
    };
    let bench = scene.bench(None, settings, args.reps);
    let truth = built_in::ball_before_wall(built_in::NEW_EYE, 2 * built_in::DEPTH_IMAGE_SAMPLES);
    let rows = bench.measured(Against::Picture(truth), &Motion::Still, verbosity)?;
    let what = "errors against the true picture, holes included";
    Ok(heading(args, what) + &table(scene.name, &rows))
}

fn heading(args: &BenchSceneArgs, what: &str) -> String {
    format!(
        "{}\n{}x{} pixels, CPU times are medians of {} frames that take turns; {what}\n",
        machine::heading(),
        args.size.width,
        args.size.height,
        args.reps
    )
}

fn table(name: &str, rows: &[Measured]) -> String {
    let mut text = format!(
        "\n{name}\n\n| setting | PSNR dB | largest | SSIM | FLIP | CPU ms | points | splats | pixels touched |"
    );
    let moves = rows.iter().any(|row| row.jump.is_some());
    let shimmers = rows.iter().any(|row| row.flicker.is_some());
    text += if moves { " jump |" } else { "" };
    text += if shimmers { " shimmer |" } else { "" };
    text += &format!(
        "\n|{}\n",
        "---|".repeat(9 + usize::from(moves) + usize::from(shimmers))
    );
    for row in rows {
        let c = &row.comparison;
        let psnr = if c.psnr_db.is_finite() {
            format!("{:.1}", c.psnr_db)
        } else {
            "same".into()
        };
        let [points, splats, touched] = row.counts;
        text += &format!(
            "| `{}` | {psnr} | {:.3} | {:.4} | {:.4} | {:.1} | {points} | {splats} | {touched} |",
            row.setting, c.max_abs, c.ssim, c.flip.mean, row.cpu_ms
        );
        text += &row
            .jump
            .map_or(String::new(), |jump| format!(" {jump:.2} |"));
        text += &row
            .flicker
            .map_or(String::new(), |flicker| format!(" {flicker:.6} |"));
        text += "\n";
    }
    text
}

/// The camera turned about the middle of what it looks at, in even steps.
fn turned(camera: &Camera) -> Vec<Camera> {
    let step = |k: u32| {
        let share = f64::from(k) / f64::from(TURN_STEPS) - 0.5;
        let angle_rad = ((TURN_DEG[1] - TURN_DEG[0]) * share).to_radians();
        around_axis(camera, angle_rad)
    };
    (0..=TURN_STEPS).map(step).collect()
}

/// The camera after the world has turned about the picture's up axis through the middle of a built-in volume.
fn around_axis(camera: &Camera, angle_rad: f64) -> Camera {
    let pose = camera.camera_from_world;
    // The built-in volumes have about 96 voxels a side, and their corner at the origin.
    let middle = pose.transform_point3(glam::DVec3::splat(0.5 * 95.0));
    let turn = glam::DAffine3::from_translation(middle)
        * glam::DAffine3::from_rotation_y(angle_rad)
        * glam::DAffine3::from_translation(-middle);
    Camera {
        camera_from_world: turn * pose,
        ..*camera
    }
}

/// The camera moved by fractions of a pixel.
fn shifted(camera: &Camera) -> Vec<Camera> {
    let moved = |step: u32| Camera {
        cx: camera.cx + f64::from(step) / f64::from(SHIMMER_STEPS),
        ..*camera
    };
    (0..=SHIMMER_STEPS).map(moved).collect()
}
