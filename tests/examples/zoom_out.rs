//! Antialiasing along a zoom-out: error and flicker of every way of drawing, against the area-averaged truth.
//!
//! `cargo run --release -p resample-tests --example zoom_out [-- FRAMES]` prints Markdown tables (64 frames if not given).
//! Over the frames the camera moves away from where the volume fills the picture to eight times that distance. The
//! truth is trilinear and post-classified, 36 rays a pixel, f64. The paper's settings draw classified voxels summed with a
//! kernel: they are measured against the same truth, and against the truth of that field, which parts the error of
//! antialiasing from that of classification. PSNR is over the pixels that the truth shows and all frames; flicker is
//! the root mean square, over the same pixels, of the change of the error from frame to frame, times 1000.

use std::process::ExitCode;

use resample_core::{Camera, Image, SelectMode};
use resample_tests::choices::{samples, with_samples};
use resample_tests::volumes::area_truth::AreaTruth;
use resample_tests::volumes::lod_scenes::{Subject, zoom_subjects};
use volsplat::{Cells, RenderOptions, Renderer};

fn main() -> ExitCode {
    let frames = std::env::args()
        .nth(1)
        .map_or(Ok(64), |argument| argument.parse::<usize>());
    let Ok(frames @ 2..) = frames else {
        eprintln!("usage: zoom_out [FRAMES], with FRAMES a whole number above 1");
        return ExitCode::FAILURE;
    };
    for subject in zoom_subjects("zoom_out") {
        print_subject(&subject, frames);
    }
    ExitCode::SUCCESS
}

fn print_subject(subject: &Subject, frames: usize) {
    let cameras: Vec<Camera> = (0..frames)
        .map(|i| subject.zoomed(8f64.powf(i as f64 / (frames - 1) as f64)))
        .collect();
    let (volume, transfer) = (&subject.volume, &subject.transfer);
    let render =
        |truth: AreaTruth| -> Vec<Image> { cameras.iter().map(|c| truth.render(c)).collect() };
    let post = render(AreaTruth::new(volume, transfer));
    let kernel = samples(&RenderOptions::paper()).kernel;
    let pre = render(AreaTruth::of_classified(volume, transfer, kernel));
    println!("### {}\n", subject.name);
    println!(
        "| drawn by | truth | PSNR dB, all frames | first quarter | last quarter | flicker x1000 | longest frame, CPU ms | CPU ms a frame |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let images: Vec<&Image> = pre.iter().collect();
    print_row(
        "(the truth of classified voxels)",
        ("post", &post),
        &images,
        None,
    );
    for (name, options) in settings() {
        let mut renderer = Renderer::new(&subject.volume, &subject.transfer, &options)
            .expect("options within their ranges");
        let drawn: Vec<_> = cameras
            .iter()
            .map(|camera| renderer.render(camera).expect("a valid camera"))
            .collect();
        let images: Vec<&Image> = drawn.iter().map(|frame| &frame.image).collect();
        let cpu: Vec<f64> = drawn.iter().map(|frame| frame.stats.cpu_ms).collect();
        print_row(name, ("post", &post), &images, Some(&cpu));
        if options
            .samples()
            .is_some_and(|samples| samples.cells == Cells::Off)
        {
            print_row(name, ("pre", &pre), &images, Some(&cpu));
        }
    }
    println!();
}

/// One line of the table; times are left out where nothing was drawn.
fn print_row(
    name: &str,
    (kind, truths): (&str, &[Image]),
    images: &[&Image],
    cpu_ms: Option<&[f64]>,
) {
    let frames = images.len();
    let part = |range: std::ops::Range<usize>| psnr_db(&images[range.clone()], &truths[range]);
    let [longest, mean] = cpu_ms.map_or([f64::NAN; 2], |ms| {
        [
            ms.iter().copied().fold(0.0, f64::max),
            ms.iter().sum::<f64>() / frames as f64,
        ]
    });
    println!(
        "| {name} | {kind} | {:.1} | {:.1} | {:.1} | {:.2} | {longest:.1} | {mean:.1} |",
        part(0..frames),
        part(0..frames / 4),
        part(frames - frames / 4..frames),
        1e3 * flicker(images, truths)
    );
}

fn settings() -> Vec<(&'static str, RenderOptions)> {
    let paper = |select| with_samples(RenderOptions::paper(), |samples| samples.select = select);
    vec![
        ("image sheets (the default)", RenderOptions::default()),
        (
            "every sample (cells, sub-pixels)",
            RenderOptions::every_sample(),
        ),
        ("the paper: hybrid", paper(SelectMode::Hybrid)),
        ("the paper: splats", paper(SelectMode::Splats)),
        ("the paper: points", paper(SelectMode::Points)),
        ("the paper: ewa", paper(SelectMode::Ewa)),
    ]
}

/// Differences of red, green and blue at the pixels that the truth shows; 0 elsewhere.
fn errors(image: &Image, truth: &Image) -> Vec<Option<[f64; 3]>> {
    let error = |(a, b): (&[f32; 4], &[f32; 4])| {
        (b[3] > 0.0).then(|| std::array::from_fn(|c| f64::from(a[c]) - f64::from(b[c])))
    };
    image.rgba.iter().zip(&truth.rgba).map(error).collect()
}

fn psnr_db(images: &[&Image], truths: &[Image]) -> f64 {
    let all = images
        .iter()
        .zip(truths)
        .flat_map(|(image, truth)| errors(image, truth))
        .flatten()
        .flatten();
    -10.0 * mean_square(all).log10()
}

fn flicker(images: &[&Image], truths: &[Image]) -> f64 {
    let by_frame: Vec<_> = images
        .iter()
        .zip(truths)
        .map(|(image, truth)| errors(image, truth))
        .collect();
    let changes = by_frame.windows(2).flat_map(|pair| {
        let pixels = pair[0].iter().zip(&pair[1]);
        pixels.filter_map(|(a, b)| {
            Some(
                a.as_ref()?
                    .iter()
                    .zip(b.as_ref()?)
                    .map(|(a, b)| b - a)
                    .collect::<Vec<_>>(),
            )
        })
    });
    mean_square(changes.flatten()).sqrt()
}

fn mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    sum / count
}
