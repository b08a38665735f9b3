//! The accuracy ladder: every order, classification, kernel, footprint and kind of sample against the true integral of fields
//! that are known by formula, beside the time.
//!
//! `cargo run --release -p resample-tests --example accuracy_ladder [-- FRAMES]` prints one Markdown table a field. Each
//! field is drawn at 3 pixels a voxel (close) and at half a pixel (far). PSNR is over the pixels that the truth shows, in
//! linear light. Time is process-CPU time of one thread, the least of FRAMES frames (3 if not given). A star marks what no
//! other row beats in both error and time; the best of each order is bold. A last table holds lit pictures, at one pixel a
//! voxel, against those lit by the gradient of the formula.

use std::process::ExitCode;

use glam::DVec3;
use resample_core::metrics::{Mask, compare};
use resample_core::{Camera, FootprintMode, Image, KernelShape, SelectMode};
use resample_tests::choices::{summed, with_field, with_samples, with_sheets};
use resample_tests::frames::{frames_argument, one_thread};
use resample_tests::volumes::analytic_fields::AnalyticField;
use volsplat::{
    Cells, Classify, Interpolate, Light, RenderOptions, Renderer, SampleOrder, Shading,
};

/// Pixels that a voxel takes in the views.
const VOXEL_PX: [f64; 2] = [3.0, 0.5];

const KERNELS: [(&str, KernelShape); 3] = [
    ("polynomial", KernelShape::Polynomial),
    ("gaussian", KernelShape::Gaussian),
    ("b-spline", KernelShape::BSpline),
];

/// A setting as it would be typed.
struct Setting {
    words: String,
    options: RenderOptions,
}

struct Measured {
    psnr_db: [f64; 2],
    cpu_ms: [f64; 2],
    prepared_ms: f64,
}

fn main() -> ExitCode {
    let Some(frames) = frames_argument("accuracy_ladder", 3) else {
        return ExitCode::FAILURE;
    };
    let pool = one_thread();
    for field in AnalyticField::ALL {
        let cameras = VOXEL_PX.map(|px| field.camera(px));
        let truths = cameras.map(|camera| field.truth(&camera));
        pool.install(|| print_field(field, (&cameras, &truths), frames));
    }
    pool.install(print_lit);
    ExitCode::SUCCESS
}

/// The fields that curve, lit from above.
fn print_lit() {
    let lit = |options: &RenderOptions| RenderOptions {
        shading: Shading::Phong,
        light: Light::Towards(DVec3::new(0.3, 1.0, -0.4)),
        ..options.clone()
    };
    let fields = [AnalyticField::MarschnerLobb, AnalyticField::Blobs];
    let views = fields.map(|field| {
        let camera = field.camera(1.0);
        (
            field,
            camera,
            [RenderOptions::default(), lit(&RenderOptions::default())]
                .map(|o| field.truth_lit(&camera, &o)),
        )
    });
    println!(
        "### Lit\n\n| setting | {}: dB unlit; lit | {}: dB unlit; lit |",
        fields[0].name(),
        fields[1].name()
    );
    println!("|---|---|---|");
    let has_cells = |setting: &Setting| setting.words.contains("--cells");
    for setting in sheets()
        .into_iter()
        .chain(samples().into_iter().filter(has_cells))
    {
        let cells = views.each_ref().map(|(field, camera, truths)| {
            let options = [setting.options.clone(), lit(&setting.options)];
            let [plain, lit] = [0, 1].map(|i| {
                let mut renderer = Renderer::new(&field.volume(), &field.look(), &options[i])
                    .expect("options within their ranges");
                let image = renderer.render(camera).expect("a valid camera").image;
                let mask = Mask::from_alpha(&truths[i]);
                compare(&image, &truths[i], Some(&mask))
                    .expect("pictures of one size")
                    .psnr_db
            });
            format!("{plain:.1}; {lit:.1}")
        });
        println!("| `{}` | {} |", setting.words, cells.join(" | "));
    }
}

fn print_field(field: AnalyticField, views: (&[Camera; 2], &[Image; 2]), frames: usize) {
    let settings = settings();
    let rows: Vec<Measured> = settings
        .iter()
        .map(|setting| measured(field, &setting.options, views, frames))
        .collect();
    println!("### {}\n", field.name());
    println!("| setting | close: dB; ms | far: dB; ms | prepared in ms |");
    println!("|---|---|---|---|");
    for (i, (setting, row)) in settings.iter().zip(&rows).enumerate() {
        let cell = |view: usize| {
            let same = |other: &usize| settings[*other].options.order == setting.options.order;
            let is_best = (0..rows.len())
                .filter(same)
                .all(|other| rows[other].psnr_db[view] <= row.psnr_db[view]);
            let beaten = (0..rows.len()).any(|other| {
                other != i
                    && rows[other].psnr_db[view] >= row.psnr_db[view]
                    && rows[other].cpu_ms[view] <= row.cpu_ms[view]
            });
            let figures = format!("{:.1}; {:.1}", row.psnr_db[view], row.cpu_ms[view]);
            let figures = if is_best {
                format!("**{figures}**")
            } else {
                figures
            };
            if beaten {
                figures
            } else {
                format!("{figures} *")
            }
        };
        println!(
            "| `{}` | {} | {} | {:.0} |",
            setting.words,
            cell(0),
            cell(1),
            row.prepared_ms
        );
    }
    println!();
}

fn measured(
    field: AnalyticField,
    options: &RenderOptions,
    (cameras, truths): (&[Camera; 2], &[Image; 2]),
    frames: usize,
) -> Measured {
    let volume = field.volume();
    let start = std::time::Instant::now();
    let mut renderer =
        Renderer::new(&volume, &field.look(), options).expect("options within their ranges");
    let mut row = Measured {
        psnr_db: [0.0; 2],
        cpu_ms: [f64::INFINITY; 2],
        prepared_ms: 1e3 * start.elapsed().as_secs_f64(),
    };
    for view in 0..2 {
        for _ in 0..frames {
            let frame = renderer.render(&cameras[view]).expect("a valid camera");
            row.cpu_ms[view] = row.cpu_ms[view].min(frame.stats.cpu_ms);
            let mask = Mask::from_alpha(&truths[view]);
            row.psnr_db[view] = compare(&frame.image, &truths[view], Some(&mask))
                .expect("pictures of one size")
                .psnr_db;
        }
    }
    row
}

fn settings() -> Vec<Setting> {
    let mut rows = sheets();
    rows.extend(samples());
    rows
}

/// Image sheets: kernels, classification, interpolation, slabs.
fn sheets() -> Vec<Setting> {
    let default = RenderOptions::default;
    let of = |words: &str, options: RenderOptions| Setting {
        words: format!("image-sheets{words}"),
        options,
    };
    let mut rows = vec![of("", default())];
    for slab_voxels in [1.0, 0.25] {
        rows.push(of(
            &format!(" --slab {slab_voxels}"),
            with_field(default(), |field| field.slab_voxels = slab_voxels),
        ));
    }
    for (name, shape) in KERNELS {
        let options = summed(default(), shape);
        rows.push(of(&format!(" --kernel {name}"), options.clone()));
        let solved = with_sheets(options, |sheets| sheets.interpolate = Interpolate::On);
        rows.push(of(&format!(" --kernel {name} --interpolate"), solved));
    }
    for (word, cells) in [("", Cells::Off), (" --cells mean", Cells::Mean)] {
        let options = with_sheets(
            with_samples(default(), |samples| samples.cells = cells),
            |sheets| sheets.classify = Classify::Pre,
        );
        rows.push(of(
            &format!(" --classify pre --kernel polynomial{word}"),
            options,
        ));
    }
    rows
}

/// The orders of samples: kernels and cells, then one change at a time.
fn samples() -> Vec<Setting> {
    let mut rows = Vec::new();
    for (order_name, order) in [
        ("every-sample", SampleOrder::EverySample),
        ("axis-sheets", SampleOrder::AxisSheets),
    ] {
        let base = with_samples(RenderOptions::default(), |samples| samples.order = order);
        let mut push = |words: &str, options: RenderOptions| {
            rows.push(Setting {
                words: format!("{order_name}{words}"),
                options,
            });
        };
        for (name, kernel) in KERNELS {
            for (word, cells) in [
                ("off", Cells::Off),
                ("mean", Cells::Mean),
                ("split", Cells::SPLIT),
            ] {
                push(
                    &format!(" --kernel {name} --cells {word}"),
                    with_samples(base.clone(), |samples| {
                        samples.kernel = kernel;
                        samples.cells = cells;
                    }),
                );
            }
        }
        let footprints = [
            ("affine-approx", FootprintMode::AffineApprox),
            ("affine", FootprintMode::Affine),
            ("table", FootprintMode::Table),
        ];
        for (name, footprint) in footprints {
            push(
                &format!(" --footprint {name}"),
                with_samples(base.clone(), |samples| samples.footprint = footprint),
            );
        }
        for (name, select) in [
            ("points", SelectMode::Points),
            ("splats", SelectMode::Splats),
            ("ewa", SelectMode::Ewa),
        ] {
            push(
                &format!(" --select {name}"),
                with_samples(base.clone(), |samples| samples.select = select),
            );
        }
    }
    rows.push(Setting {
        words: "every-sample --cells off --subpixel 1 --kernel gaussian (the paper)".into(),
        options: RenderOptions::paper(),
    });
    rows
}
