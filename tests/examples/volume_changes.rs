//! How soon a volume can be drawn after its transfer function, light or clip has changed, beside its preparation.
//!
//! `cargo run --release -p resample-tests --example volume_changes` prints a Markdown table of elapsed ms, medians of 7.
//! "Little" shows the greatest 2 % of the values' range that holds 2 % of the voxels, "more" all above the median of the
//! voxels that are not the least one. Says "skipped" where the data is absent.

use resample_core::clock::StageClock;
use resample_tests::data::data_file;
use resample_tests::volumes::peer_scenes::Subject;
use resample_tests::volumes::scenes::transfer;
use volsplat::{
    Clip, LoadOptions, RenderOptions, Renderer, Scene, Shading, TransferFunction, Volume, Voxels,
};

const PROGRAM: &str = "volume_changes";
const ROUNDS: usize = 7;

fn main() {
    println!("elapsed (CPU) ms, {} threads", rayon::current_num_threads());
    println!(
        "| volume | prepared, little | prepared, more | prepared for changes | to more | to little | to more, lit, at first | again | clipped |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, volume) in volumes() {
        print_row(name, &volume);
    }
}

fn volumes() -> Vec<(&'static str, Volume)> {
    let subject = |subject: Subject| subject.volume(PROGRAM);
    let file = |path| {
        let path = data_file(PROGRAM, path)?;
        Some(volsplat::load(&path, &LoadOptions::default()).expect("a volume"))
    };
    let bonsai = file("volumes/nifti/bonsai.nii.gz");
    let floats = bonsai.as_ref().map(floats);
    [
        ("Engine, 256x256x128", subject(Subject::Engine)),
        ("Aneurism, 256^3", subject(Subject::Aneurism)),
        ("head, 256x256x94, 16 bits", file("volumes/vti/head.vti")),
        ("bonsai, 256^3", bonsai),
        ("bonsai of f32", floats),
    ]
    .into_iter()
    .filter_map(|(name, volume)| Some((name, volume?)))
    .collect()
}

fn floats(volume: &Volume) -> Volume {
    let values = (0..volume.len()).map(|i| volume.value(i) as f32).collect();
    Volume::new(volume.dims, Voxels::F32(values), volume.world_from_index).expect("as many")
}

/// The value that this share of the voxels above the least one exceeds.
fn above(volume: &Volume, share: f64) -> f64 {
    let (least, _) = volume.value_range();
    let mut values: Vec<f64> = (0..volume.len())
        .step_by(7)
        .map(|i| volume.value(i))
        .filter(|&value| value > least)
        .collect();
    values.sort_by(f64::total_cmp);
    values[((1.0 - share) * (values.len() - 1) as f64) as usize]
}

/// Shows what lies above a value.
fn shows_above(volume: &Volume, low: f64) -> TransferFunction {
    let (least, greatest) = volume.value_range();
    let colours = [(least, [0.2, 0.3, 1.0]), (greatest, [1.0, 0.8, 0.4])];
    let top = greatest.max(low + 1.0);
    transfer(&colours, &[(low, 0.0), (top, 0.2)])
}

fn print_row(name: &str, volume: &Volume) {
    let [little, more] = [0.02, 0.5].map(|share| shows_above(volume, above(volume, share)));
    let [little, more] = [&little, &more].map(|look| Scene::new(volume, look));
    let plain = RenderOptions::default();
    let lit = RenderOptions {
        shading: Shading::Phong,
        ..plain.clone()
    };
    let clipped = RenderOptions {
        clip: Clip {
            crop_in_grid: Some([[20.0; 3].into(), [60.0; 3].into()]),
            ..Clip::default()
        },
        ..plain.clone()
    };
    let prepare = |scene: &Scene| Renderer::with_scene(scene, &plain).expect("valid options");
    let keep = || Renderer::for_changes(&little, &plain).expect("valid options");
    let mut kept = keep();
    let mut cells = vec![
        median(|| timed(|| drop(prepare(&little)))),
        median(|| timed(|| drop(prepare(&more)))),
        median(|| timed(|| drop(keep()))),
    ];
    let mut change = |scenes: [(&Scene, &RenderOptions); 2]| {
        let mut to = |(scene, options): (&Scene, &RenderOptions)| {
            kept.update_scene(scene, options).expect("valid options");
        };
        median(|| {
            to(scenes[0]);
            timed(|| to(scenes[1]))
        })
    };
    let before = (&little, &plain);
    cells.push(change([before, (&more, &plain)]));
    cells.push(change([(&more, &plain), before]));
    cells.push(median(|| {
        let mut new = keep();
        timed(|| new.update_scene(&more, &lit).expect("valid options"))
    }));
    cells.push({
        change([before, (&more, &lit)]);
        change([before, (&more, &lit)])
    });
    cells.push(change([before, (&little, &clipped)]));
    let cells = cells
        .iter()
        .map(|[wall, cpu]| format!(" {wall:.0} ({cpu:.0}) |"));
    println!("| {name} |{}", cells.collect::<String>());
}

/// Elapsed and CPU ms.
fn timed(work: impl FnOnce()) -> [f64; 2] {
    let clock = StageClock::start();
    work();
    let time = clock.stop();
    [time.wall_ms, time.cpu_ms]
}

fn median(mut measured: impl FnMut() -> [f64; 2]) -> [f64; 2] {
    let times: Vec<[f64; 2]> = (0..ROUNDS).map(|_| measured()).collect();
    [0, 1].map(|kind| {
        let mut one: Vec<f64> = times.iter().map(|time| time[kind]).collect();
        one.sort_by(f64::total_cmp);
        one[ROUNDS / 2]
    })
}
