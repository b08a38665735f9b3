//! How near the most exact setting of `--max-error` is to the truth, on six scenes, as a Markdown table.
//!
//! `cargo run --release -p resample-tests --example exact_setting [-- SCENE...]`. A scene is a window of 12x12 pixels where
//! much is seen; its truth is the trilinear field in f64. The truth counts as converged where twice as many rays along a
//! side and twice as many steps give the same to 66 dB. Says "skipped" where the data is absent.

use glam::DVec3;
use resample_core::metrics::{Mask, compare};
use resample_core::{Camera, Image};
use resample_tests::choices::with_field;
use resample_tests::twins::channels;
use resample_tests::volumes::analytic_fields::AnalyticField;
use resample_tests::volumes::area_truth::AreaTruth;
use resample_tests::volumes::lod_scenes::real;
use resample_tests::volumes::peer_scenes::{Distance, Scene as View, Subject};
use resample_tests::volumes::shells::Shell;
use volsplat::{
    Light, RenderOptions, Renderer, Scene, Shading, Subpixels, TransferFunction, Volume,
};

const PROGRAM: &str = "exact_setting";

/// Side of a window, px.
const WINDOW_PX: u32 = 12;

/// Slab in voxels and sub-pixels of the settings.
const SETTINGS: [(f64, u32); 4] = [(0.125, 8), (0.0625, 8), (0.125, 16), (0.0625, 16)];

struct Case {
    name: String,
    volume: Volume,
    look: TransferFunction,
    camera: Camera,
    options: RenderOptions,
    /// Rays along a pixel's side, steps a voxel, and steps through the visible range, of the coarser truth.
    fineness: (usize, f64, f64),
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let columns = SETTINGS.map(|(slab, subpixels)| format!(" {slab}, {subpixels}x{subpixels} |"));
    println!("| scene | truth agrees to |{}", columns.concat());
    println!("|---|---|{}", "---|".repeat(SETTINGS.len()));
    for case in cases() {
        if wanted.is_empty() || wanted.iter().any(|name| case.name.contains(name)) {
            print_row(&case);
        }
    }
}

/// A window of a picture around its middle, or beside it by parts of its side.
fn window(camera: &Camera, beside: [f64; 2]) -> Camera {
    let corner =
        |side: u32, by: f64| ((0.5 + by) * f64::from(side)).round() - 0.5 * f64::from(WINDOW_PX);
    Camera {
        width: WINDOW_PX,
        height: WINDOW_PX,
        cx: camera.cx - corner(camera.width, beside[0]),
        cy: camera.cy - corner(camera.height, beside[1]),
        ..*camera
    }
}

fn cases() -> Vec<Case> {
    let case = |name: &str, volume: Volume, look: TransferFunction, camera: Camera| Case {
        name: name.into(),
        volume,
        look,
        camera,
        options: RenderOptions::default(),
        fineness: (12, 6.0, 0.0),
    };
    let mut all = Vec::new();
    let views = [
        (
            "Engine, close",
            Subject::Engine,
            Distance::Close,
            [0.0, 0.1],
        ),
        ("Engine, far", Subject::Engine, Distance::Far, [0.0, 0.02]),
        (
            "Aneurism, mixed",
            Subject::Aneurism,
            Distance::Mixed,
            [0.0, 0.0],
        ),
    ];
    for (name, subject, distance, beside) in views {
        if let Some(volume) = subject.volume(PROGRAM) {
            let camera = View { subject, distance }.pose().camera();
            let far = distance == Distance::Far;
            all.push(Case {
                fineness: (if far { 16 } else { 12 }, 6.0, 0.0),
                ..case(name, volume, subject.transfer(), window(&camera, beside))
            });
        }
    }
    for subject in real(PROGRAM)
        .into_iter()
        .filter(|subject| subject.name == "lobster")
    {
        let camera = subject.camera(0.5, 3);
        all.push(case(
            "Lobster",
            subject.volume,
            subject.transfer,
            window(&camera, [0.1, 0.1]),
        ));
    }
    let blobs = AnalyticField::Blobs;
    all.push(Case {
        options: RenderOptions {
            shading: Shading::Phong,
            light: Light::Towards(DVec3::new(0.3, 1.0, -0.4)),
            ..RenderOptions::default()
        },
        fineness: (5, 8.0, 0.0),
        ..case(
            "blobs, Phong",
            blobs.volume(),
            blobs.look(),
            window(&blobs.camera(1.0), [0.0, 0.0]),
        )
    });
    for (shell, beside) in [(Shell::Sphere, [0.2, 0.2]), (Shell::Torus, [0.15, 0.1])] {
        let look = shell.look(0.02, 0.95);
        let camera = window(&shell.camera(1.0), beside);
        all.push(Case {
            fineness: (20, 6.0, 24.0),
            ..case(
                &format!("{}, shell", shell.name()),
                shell.volume(),
                look,
                camera,
            )
        });
    }
    all
}

fn print_row(case: &Case) {
    let (rays, steps, through) = case.fineness;
    let truth = truth(case, (2 * rays, 2.0 * steps, 2.0 * through));
    let coarse = self::truth(case, case.fineness);
    let inside = Mask::from_alpha(&truth);
    let psnr_db = |image: &Image| {
        compare(image, &truth, Some(&inside))
            .expect("pictures of one size")
            .psnr_db
    };
    let columns = SETTINGS.map(|setting| format!(" {:.1} |", psnr_db(&drawn(case, setting))));
    println!(
        "| {} | {:.1} |{}",
        case.name,
        psnr_db(&coarse),
        columns.concat()
    );
}

fn with(case: &Case, slab_voxels: f64, subpixels: u32) -> RenderOptions {
    let options = RenderOptions {
        subpixels: Subpixels::Fixed(subpixels),
        min_transmittance: 1e-5,
        ..case.options.clone()
    };
    with_field(options, |field| field.slab_voxels = slab_voxels)
}

fn drawn(case: &Case, (slab_voxels, subpixels): (f64, u32)) -> Image {
    let options = with(case, slab_voxels, subpixels);
    let mut renderer = Renderer::new(&case.volume, &case.look, &options).expect("valid options");
    renderer.render(&case.camera).expect("a valid camera").image
}

fn truth(case: &Case, (rays, steps, through): (usize, f64, f64)) -> Image {
    if case.options.shading == Shading::None {
        let mut truth = AreaTruth::new(&case.volume, &case.look);
        (
            truth.rays_per_side,
            truth.steps_per_voxel,
            truth.steps_per_range,
        ) = (rays, steps, through);
        return truth.render(&case.camera);
    }
    let options = with(case, 1.0 / steps, rays as u32);
    let scene = Scene::new(&case.volume, &case.look);
    let pixels = channels::render(&scene, &case.camera, &options);
    let mut image = Image::transparent(case.camera.width as usize, case.camera.height as usize);
    for (pixel, truth) in image.rgba.iter_mut().zip(pixels) {
        let [r, g, b] = truth.rgb.map(|value| value as f32);
        *pixel = [r, g, b, (1.0 - truth.transmittance) as f32];
    }
    image
}
