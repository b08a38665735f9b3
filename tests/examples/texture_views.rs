//! Renders the scenes of the texture comparison with every method and prints error and cost as Markdown tables.
//!
//! `cargo run --release -p resample-tests --example texture_views [-- FOLDER]`. Errors are against the Gaussian truth, over
//! the pixels that it covers, both laid over the truth's grey background. Time is the least process-CPU time of a
//! frame on one thread, the methods taking turns frame by frame. With FOLDER, the checkerboard plane by three methods
//! and its truth are written there as PNG. Says "skipped" and succeeds where the data is absent.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use rayon::ThreadPool;
use resample_core::image::srgb_from_linear;
use resample_core::metrics::{Comparison, Mask, compare};
use resample_core::{Camera, Image};
use resample_tests::frames::one_thread;
use resample_tests::meshes::texture_scenes::{TextureScene, TruthFilter};
use texmap::{FrameStats, Method, RenderOptions, Renderer, Scene};

/// Timed frames of each setting.
const FRAMES: usize = 5;

/// The background of the truths, linear light.
const BACKGROUND: [f32; 3] = [0.5; 3];

/// What skip lines call this program.
const PROGRAM: &str = "texture_views";

fn main() -> ExitCode {
    let folder = std::env::args().nth(1).map(PathBuf::from);
    let pool = one_thread();
    for scene in TextureScene::ALL {
        print_scene(scene, &pool, folder.as_deref());
    }
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
