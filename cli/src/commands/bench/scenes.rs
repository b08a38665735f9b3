//! Published tables over built-in scenes: footprints, orders, texture filters, warps.
//!
//! The tables of `docs/results` need real data or long runs; these are their short sisters: scenes made by formulas, the
//! same columns, on the user's machine. Errors are taken against the most exact setting, or, for warps, against the
//! true picture.

use anyhow::Result;
use resample_core::{Camera, FootprintMode, KernelShape, SelectMode};
use tempfile::TempDir;
use volsplat::Subpixels;
use warp3d::Fill;
use warp3d::args::MethodName;

use super::settings::{Against, Bench, Compared, Measured, Motion};
use crate::args::{
    BenchSceneArgs, CameraArgs, Drawing, OrderName, SceneArg, TexmapArgs, VolsplatArgs,
};
use crate::commands::built_in;
use crate::measure;
use crate::open::setting::{Choices, DepthChoice, MeshChoice, VolumeChoice};
use crate::process::machine;
use crate::process::report::Verbosity;
use crate::values::Orbit;
use warp3d::input::procedural::{NEW_EYE, PHOTOGRAPH_SAMPLES, ball_before_wall};

/// Degrees by which the view turns in the table of orders, and its steps: across 45 degrees, where slices change over.
const TURN_DEG: [f64; 2] = [40.0, 50.0];
const TURN_STEPS: u32 = 40;

/// A built-in scene whose files lie in a temporary folder.
struct BenchScene {
    name: &'static str,
    drawing: Drawing,
    /// Removed with its files when the table is made.
    _folder: TempDir,
}

impl BenchScene {
    fn volume(name: &'static str, scene: SceneArg, camera: CameraArgs) -> Result<Self> {
        let folder = tempfile::tempdir()?;
        let args = VolsplatArgs {
            camera,
            ..built_in::volume(scene, folder.path())?
        };
        Ok(Self {
            name,
            drawing: Drawing::Volsplat(Box::new(args)),
            _folder: folder,
        })
    }

    fn table(
        &self,
        settings: &[Choices],
        reps: u16,
        compared: Compared,
        verbosity: Verbosity,
    ) -> Result<String> {
        let bench = Bench {
            drawing: self.drawing.clone(),
            settings: settings.to_vec(),
            reps,
        };
        Ok(table(self.name, &bench.measured(compared, verbosity)?))
    }
}

/// The options of the table's own camera.
fn camera(
    args: &BenchSceneArgs,
    azimuth_deg: f64,
    elevation_deg: f64,
    distance: f64,
) -> CameraArgs {
    CameraArgs {
        orbit: Some(Orbit {
            azimuth_deg,
            elevation_deg,
            distance,
        }),
        size: Some(args.size),
        ..CameraArgs::default()
    }
}

/// Footprint modes and kernels.
pub(super) fn footprint(args: &BenchSceneArgs, verbosity: Verbosity) -> Result<String> {
    let of = |choice| {
        Choices::of([
            VolumeChoice::Order(OrderName::EverySample),
            choice,
            VolumeChoice::Select(SelectMode::Splats),
        ])
    };
    let footprint = |mode| of(VolumeChoice::Footprint(mode));
    let kernel = |shape| of(VolumeChoice::Kernel(shape));
    let exact = footprint(FootprintMode::Exact);
    let settings = [
        footprint(FootprintMode::AffineApprox),
        footprint(FootprintMode::Affine),
        footprint(FootprintMode::Table),
        exact.clone(),
        kernel(KernelShape::Gaussian),
        kernel(KernelShape::BSpline),
    ];
    let mut text = heading(
        args,
        "errors against `--order every-sample --footprint exact` with the default kernel",
    );
    // Near and wide, where cones are wide and slant.
    for (name, fov) in [
        ("blobs, near, 60 degrees", 60.0),
        ("blobs, near, 100 degrees", 100.0),
    ] {
        let camera = CameraArgs {
            fov,
            ..camera(args, 30.0, 20.0, 0.6)
        };
        let scene = BenchScene::volume(name, SceneArg::Blobs, camera)?;
        let against = Against::Setting(exact.clone());
        text += &scene.table(
            &settings,
            args.reps,
            Compared {
                against,
                motion: Motion::Still,
            },
            verbosity,
        )?;
    }
    Ok(text)
}

/// Orders of compositing.
pub(super) fn orders(args: &BenchSceneArgs, verbosity: Verbosity) -> Result<String> {
    let order = |order| Choices::of([VolumeChoice::Order(order)]);
    let field = |slab, subpixels| {
        Choices::of([
            VolumeChoice::Slab(slab),
            VolumeChoice::Subpixels(Subpixels::Fixed(subpixels)),
        ])
    };
    let exact = field(0.125, 8).with(&Choices::of([VolumeChoice::MinTransmittance(1e-5)]));
    let settings = [
        order(OrderName::Field),
        field(1.0, 1),
        field(0.25, 4),
        order(OrderName::EverySample),
        order(OrderName::AxisSheets),
    ];
    let mut text = heading(
        args,
        "errors against `--slab 0.125 --subpixels 8`; jump: largest over median change while the view turns from 40 to 50 degrees",
    );
    for (name, scene) in [
        ("checker box", SceneArg::CheckerBox),
        ("Marschner-Lobb", SceneArg::MarschnerLobb),
        ("blobs", SceneArg::Blobs),
    ] {
        let scene = BenchScene::volume(name, scene, camera(args, 45.0, 0.0, 1.0))?;
        let against = Against::Setting(exact.clone());
        text += &scene.table(
            &settings,
            args.reps,
            Compared {
                against,
                motion: Motion::Even(turned),
            },
            verbosity,
        )?;
    }
    Ok(text)
}

/// Texture filters.
pub(super) fn texture(args: &BenchSceneArgs, verbosity: Verbosity) -> Result<String> {
    let method = |method| Choices::of([MeshChoice::Method(method)]);
    let hybrid = |subpixels| {
        Choices::of([
            MeshChoice::Method(texmap::Method::Hybrid),
            MeshChoice::Subpixels(subpixels),
        ])
    };
    let settings = [
        method(texmap::Method::Point),
        method(texmap::Method::BackwardNearest),
        method(texmap::Method::BackwardBilinear),
        method(texmap::Method::BackwardTrilinear),
        method(texmap::Method::BackwardEwa),
        hybrid(2),
        method(texmap::Method::Hybrid),
        hybrid(8),
    ];
    let folder = tempfile::tempdir()?;
    let mesh = TexmapArgs {
        camera: camera(args, 20.0, 12.0, 0.35),
        ..built_in::mesh(folder.path())?
    };
    let scene = BenchScene {
        name: "ball on a ground",
        drawing: Drawing::Texmap(Box::new(mesh)),
        _folder: folder,
    };
    let against = Against::Setting(hybrid(8));
    let rows = scene.table(
        &settings,
        args.reps,
        Compared {
            against,
            motion: Motion::Shimmer(measure::sub_pixel_steps),
        },
        verbosity,
    )?;
    let about = "errors against `--method hybrid --subpixels 8`; shimmer: error of the change over sixteen steps of a sixteenth \
                 of a pixel";
    Ok(heading(args, about) + &rows)
}

/// Methods of warping.
pub(super) fn warp(args: &BenchSceneArgs, verbosity: Verbosity) -> Result<String> {
    let method = |method| Choices::of([DepthChoice::Method(method)]);
    let settings = [
        method(MethodName::Nearest),
        method(MethodName::Points),
        method(MethodName::Splats),
        method(MethodName::Hybrid),
        Choices::of([DepthChoice::Subpixels(8)]),
        Choices::of([DepthChoice::Fill(Fill::Background)]),
    ];
    let folder = tempfile::tempdir()?;
    let depth = built_in::depth_image(folder.path())?;
    let scene = BenchScene {
        name: "ball before a wall, 320x240",
        drawing: Drawing::Warp3d(Box::new(depth)),
        _folder: folder,
    };
    let truth = ball_before_wall(NEW_EYE, 2 * PHOTOGRAPH_SAMPLES);
    let rows = scene.table(
        &settings,
        args.reps,
        Compared {
            against: Against::Picture(truth),
            motion: Motion::Still,
        },
        verbosity,
    )?;
    Ok(heading(args, "errors against the true picture, holes included") + &rows)
}

fn heading(args: &BenchSceneArgs, about: &str) -> String {
    format!(
        "{}\n{}x{} pixels, CPU times are medians of {} frames beside frames of the first setting; {about}\n",
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
