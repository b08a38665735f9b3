//! Renders the scenes of the texture comparison with every method and prints error and cost as Markdown tables.
//!
//! `cargo run --release -p resample-tests --example texture_views [-- FOLDER]`. Errors are against the Gaussian truth, over
//! the pixels that it covers, both laid over the truth's grey background. Time is the least process-CPU time of a
//! frame on one thread, the methods taking turns frame by frame. With FOLDER, the checkerboard plane by three methods
//! and its truth are written there as PNG. Says "skipped" and succeeds where the data is absent.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use glam::DVec3;
use rayon::{ThreadPool, ThreadPoolBuilder};
use resample_core::image::srgb_from_linear;
use resample_core::metrics::{Comparison, Mask, compare};
use resample_core::{Camera, Image};
use resample_tests::data::data_file;
use resample_tests::texture_scenes::{TextureScene, TruthFilter, looking_camera};
use resample_tests::textured::{ground, photo};
use texmap::{FrameStats, LoadOptions, Method, RenderOptions, Renderer, Scene};

/// Timed frames of each setting.
const FRAMES: usize = 5;

/// The background of the truths, linear light.
const BACKGROUND: [f32; 3] = [0.5; 3];

/// Steps of the shimmer test, across one pixel.
const STEPS: usize = 16;

/// What skip lines call this program.
const PROGRAM: &str = "texture_views";

fn main() -> ExitCode {
    let folder = std::env::args().nth(1).map(PathBuf::from);
    let pool = ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("one thread can be started");
    for scene in TextureScene::ALL {
        print_scene(scene, &pool, folder.as_deref());
    }
    print_speed(&pool);
    print_repeats(&pool);
    print_shimmer(&pool);
    ExitCode::SUCCESS
}

/// A setting and what its renderer has shown.
struct Entrant {
    name: String,
    renderer: Renderer,
    image: Image,
    stats: FrameStats,
    least_cpu_ms: f64,
}

impl Entrant {
    fn new(name: &str, scene: &Scene, options: &RenderOptions) -> Self {
        let renderer = Renderer::new(scene, options).expect("options within their ranges");
        let image = Image::transparent(0, 0);
        Self {
            name: name.into(),
            renderer,
            image,
            stats: FrameStats::default(),
            least_cpu_ms: f64::INFINITY,
        }
    }
}

fn draw(entrants: &mut [Entrant], camera: &Camera, pool: &ThreadPool) {
    for _ in 0..FRAMES {
        for entrant in entrants.iter_mut() {
            let frame = pool
                .install(|| entrant.renderer.render(camera))
                .expect("a valid camera");
            entrant.least_cpu_ms = entrant.least_cpu_ms.min(frame.stats.cpu_ms);
            (entrant.image, entrant.stats) = (frame.image, frame.stats);
        }
    }
}

fn settings() -> Vec<(String, RenderOptions)> {
    let default = RenderOptions::default;
    let mut rows: Vec<_> = Method::ALL
        .iter()
        .map(|&method| {
            (
                name(method),
                RenderOptions {
                    method,
                    ..default()
                },
            )
        })
        .collect();
    for subpixels in [2, 8] {
        rows.push((
            format!("hybrid, {subpixels} sub-pixels"),
            RenderOptions {
                subpixels,
                ..default()
            },
        ));
    }
    rows
}

fn name(method: Method) -> String {
    match method {
        Method::Hybrid => "hybrid",
        Method::Point => "point",
        Method::BackwardNearest => "backward-nearest",
        Method::BackwardBilinear => "backward-bilinear",
        Method::BackwardTrilinear => "backward-trilinear",
        Method::BackwardEwa => "backward-ewa",
    }
    .into()
}

fn print_scene(which: TextureScene, pool: &ThreadPool, folder: Option<&Path>) {
    let (Some(scene), Some(camera)) = (which.scene(PROGRAM), which.camera(PROGRAM)) else {
        return;
    };
    let Some(truth) = which.truth(PROGRAM, TruthFilter::Gaussian) else {
        return;
    };
    let settings = settings();
    let mut entrants: Vec<Entrant> = settings
        .iter()
        .map(|(name, options)| Entrant::new(name, &scene, options))
        .collect();
    draw(&mut entrants, &camera, pool);
    println!("### {}\n", which.name());
    println!("| setting | PSNR | PSNR inside outlines | SSIM | FLIP | CPU ms | points | splats |");
    println!("|---|---|---|---|---|---|---|---|");
    for entrant in &entrants {
        let image = entrant.image.clone().over_background(BACKGROUND);
        let (whole, inner) = (
            against(&image, &truth, 1.0 / 255.0),
            against(&image, &truth, 0.9999),
        );
        println!(
            "| {} | {:.1} | {:.1} | {:.5} | {:.4} | {:.1} | {} | {} |",
            entrant.name,
            whole.psnr_db,
            inner.psnr_db,
            whole.ssim,
            whole.flip.mean,
            entrant.least_cpu_ms,
            entrant.stats.points,
            entrant.stats.splats
        );
    }
    println!();
    if let (Some(folder), TextureScene::CheckerPlane) = (folder, which) {
        for (entrant, file) in [
            (1, "figure5a-point.png"),
            (0, "figure5b-hybrid.png"),
            (4, "figure5c-backward.png"),
        ] {
            let image = entrants[entrant].image.clone().over_background(BACKGROUND);
            write_png(&folder.join(file), &image);
        }
        write_png(&folder.join("figure5-truth.png"), &truth);
    }
}

/// The comparison over the pixels whose coverage in the truth is above `least`.
fn against(image: &Image, truth: &Image, least: f32) -> Comparison {
    let inside = truth.rgba.iter().map(|pixel| pixel[3] > least).collect();
    let mask = Mask::new(truth.width, truth.height, inside).expect("one flag a pixel");
    compare(image, truth, Some(&mask)).expect("finite pictures of one size")
}

/// Hybrid against EWA on real meshes at 1024 x 1024.
fn print_speed(pool: &ThreadPool) {
    println!("### Meshes at 1024 x 1024\n");
    println!("| mesh | hybrid CPU ms | backward-ewa CPU ms | ratio |\n|---|---|---|---|");
    let files = [
        ("Avocado", "glTF/Avocado.gltf"),
        ("DamagedHelmet", "glTF-Binary/DamagedHelmet.glb"),
    ];
    for (mesh, file) in files {
        let Some(path) = data_file(PROGRAM, &format!("meshes/khronos/{mesh}/{file}")) else {
            continue;
        };
        let scene = texmap::load(&path, &LoadOptions::default())
            .expect("a readable mesh")
            .scene;
        let methods = [Method::Hybrid, Method::BackwardEwa];
        let options = |method| RenderOptions {
            method,
            ..RenderOptions::default()
        };
        let mut entrants: Vec<Entrant> = methods
            .map(|method| Entrant::new(&name(method), &scene, &options(method)))
            .into();
        let [low, high] = entrants[0]
            .renderer
            .bounds_in_world()
            .expect("the mesh has triangles");
        let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
        let eye = centre + 2.3 * radius * DVec3::new(0.4, 0.3, 1.0).normalize();
        draw(
            &mut entrants,
            &looking_camera(eye, centre, 45.0, [1024, 1024]),
            pool,
        );
        let [hybrid, ewa] = [entrants[0].least_cpu_ms, entrants[1].least_cpu_ms];
        println!("| {mesh} | {hybrid:.0} | {ewa:.0} | {:.2} |", hybrid / ewa);
    }
    println!();
}

/// The ground plane with ever more repeats.
fn print_repeats(pool: &ThreadPool) {
    println!("### A ground plane at 512 x 512\n");
    println!("| repeats | CPU ms | texels touched |\n|---|---|---|");
    let camera = looking_camera(
        DVec3::new(0.0, 1.0, 2.0),
        DVec3::new(0.0, 0.6, 0.0),
        60.0,
        [512, 512],
    );
    for repeats in [10.0, 100.0, 1000.0] {
        let scene = ground(photo(512), 60.0, repeats);
        let mut entrants = [Entrant::new("hybrid", &scene, &RenderOptions::default())];
        draw(&mut entrants, &camera, pool);
        let stats = &entrants[0].stats;
        println!(
            "| {repeats} | {:.0} | {} |",
            entrants[0].least_cpu_ms,
            stats.points + stats.splats
        );
    }
    println!();
}

/// How much a pixel changes while a minified ground slides by one pixel in steps, beside a hybrid picture with 8
/// sub-pixels and the full texture, which stands for the truth.
fn print_shimmer(pool: &ThreadPool) {
    println!("### Shimmer over {STEPS} steps of a sixteenth of a pixel\n");
    println!("| method | mean change per step | error of the change |\n|---|---|---|");
    let scene = ground(photo(512), 60.0, 20.0);
    let cameras: Vec<Camera> = (0..=STEPS)
        .map(|step| {
            let base = looking_camera(
                DVec3::new(0.0, 1.0, 2.0),
                DVec3::new(0.0, 0.6, 0.0),
                60.0,
                [256, 256],
            );
            Camera {
                cx: base.cx + step as f64 / STEPS as f64,
                ..base
            }
        })
        .collect();
    let film = |options: &RenderOptions| -> Vec<Image> {
        let mut renderer = Renderer::new(&scene, options).expect("options within their ranges");
        let mut frame = |camera| {
            pool.install(|| renderer.render(camera))
                .expect("a valid camera")
                .image
        };
        cameras.iter().map(&mut frame).collect()
    };
    let truth = film(&RenderOptions {
        subpixels: 8,
        ..RenderOptions::default()
    });
    for method in Method::ALL {
        let frames = film(&RenderOptions {
            method,
            ..RenderOptions::default()
        });
        let (mut change, mut error, mut count) = (0.0, 0.0, 0.0);
        for (ours, truth) in frames.windows(2).zip(truth.windows(2)) {
            for pixel in 0..ours[0].rgba.len() {
                for k in 0..3 {
                    let step = f64::from(ours[1].rgba[pixel][k] - ours[0].rgba[pixel][k]);
                    let expected = f64::from(truth[1].rgba[pixel][k] - truth[0].rgba[pixel][k]);
                    change += step.abs();
                    error += (step - expected).abs();
                    count += 1.0;
                }
            }
        }
        println!(
            "| {} | {:.5} | {:.6} |",
            name(method),
            change / count,
            error / count
        );
    }
    println!();
}

fn write_png(path: &Path, image: &Image) {
    let bytes: Vec<u8> = image
        .rgba
        .iter()
        .flat_map(|pixel| [0, 1, 2].map(|k| (255.0 * srgb_from_linear(pixel[k])).round() as u8))
        .collect();
    let file = std::fs::File::create(path).expect("the folder can be written");
    let mut encoder = png::Encoder::new(file, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("the picture can be written");
    writer
        .write_image_data(&bytes)
        .expect("the picture can be written");
}
