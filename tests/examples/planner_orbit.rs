//! Holds `--max-error` and `--max-time` to their word: orbits of real scenes, every frame against the exact setting.
//!
//!     cargo build --release -p resample-cli
//!     cargo run --release -p resample-tests --example planner_orbit -- [FRAMES [SIDE [NAME]]]
//!
//! Runs the binary beside this program (or `RESAMPLE_BINARY`) with one thread, reads its pictures and stats, and prints
//! Markdown tables. Errors are those of all frames; times are CPU times of the frames themselves. Scenes whose files are
//! absent are skipped and said. Limits: the exact setting is the one that the planner names, not the truth.

use std::path::{Path, PathBuf};
use std::process::Command;

use resample_core::Image;
use resample_core::metrics::{Mask, compare};
use resample_io::rendered;
use resample_tests::data::{data_dir, skipped};
use serde_json::{Value, json};
use volsplat::procedural;
use volsplat::volume::Voxels;

/// Name, and words: files of the data folder behind an `@`, files that are written here behind a `%`.
type Scene = (&'static str, &'static str);

const SCENES: [Scene; 14] = [
    (
        "checker box",
        "volsplat %checker-box.raw --dims 100,100,100 --type u8 --transfer %checker-box.json",
    ),
    (
        "engine",
        "volsplat @volumes/raw/engine_256x256x128_uint8.raw --dims 256,256,128 --type u8",
    ),
    (
        "aneurism",
        "volsplat @volumes/raw/aneurism_256x256x256_uint8.raw --dims 256,256,256 --type u8",
    ),
    (
        "lobster",
        "volsplat @volumes/raw/lobster_301x324x56_uint8.raw --dims 301,324,56 --type u8 --spacing 1,1,1.4",
    ),
    (
        "CT head (NIfTI)",
        "volsplat @volumes/nifti/CT_AVM.nii.gz --preset ct-bone",
    ),
    ("tooth", "volsplat @volumes/nrrd/tooth.nhdr"),
    (
        "walnut, far",
        "volsplat @volumes/raw/walnut_128x96x114_uint16.raw --dims 128,96,114 --type u16 --orbit 10,30,2",
    ),
    (
        "Avocado",
        "texmap @meshes/khronos/Avocado/glTF/Avocado.gltf",
    ),
    (
        "DamagedHelmet",
        "texmap @meshes/khronos/DamagedHelmet/glTF-Binary/DamagedHelmet.glb",
    ),
    (
        "viking room (OBJ)",
        "texmap @meshes/obj/viking_room/viking_room.obj --texture @meshes/obj/viking_room/viking_room.png --up z",
    ),
    ("Duck", "texmap @meshes/khronos/Duck/glTF/Duck.gltf"),
    (
        "Cones",
        "warp3d @rgbd/middlebury-2003/Cones/imL.png @rgbd/middlebury-2003/Cones/disp2.png --depth-kind disparity --depth-scale 0.25 --baseline 0.16 --intrinsics 500,500,225,187",
    ),
    (
        "Teddy",
        "warp3d @rgbd/middlebury-2003/Teddy/imL.png @rgbd/middlebury-2003/Teddy/disp2.png --depth-kind disparity --depth-scale 0.25 --baseline 0.16 --intrinsics 500,500,225,187",
    ),
    (
        "warp truth, stereo",
        "warp3d @warp-truth/stereo/ref.exr @warp-truth/stereo/ref.exr#Z --from @warp-truth/stereo/cameras.json#ref",
    ),
];

/// What is asked for.
const BOUNDS: [&str; 3] = ["1/255", "1/64", "max:1/16"];

/// Times that are asked for, in multiples of what the setting for 1/64 takes.
const TIMES: [f64; 2] = [1.0, 4.0];

struct Bench {
    binary: PathBuf,
    folder: PathBuf,
    data: PathBuf,
    frames: usize,
    side: usize,
}

struct Run {
    /// CPU time of each frame, ms.
    cpu_ms: Vec<f64>,
    planned: Value,
}

fn main() {
    let mut args = std::env::args().skip(1);
    let number =
        |text: Option<String>, default| text.and_then(|text| text.parse().ok()).unwrap_or(default);
    let (frames, side) = (number(args.next(), 64), number(args.next(), 160));
    let only = args.next();
    let Some(data) = data_dir() else {
        return skipped("planner_orbit: there is no data folder");
    };
    let folder = std::env::temp_dir().join(format!("planner-orbit-{}", std::process::id()));
    let bench = Bench {
        binary: binary(),
        folder,
        data,
        frames,
        side,
    };
    bench.write_checker_box();
    println!("{frames} frames of {side} px, one thread\n");
    println!(
        "| scene | asked | chosen | predicted | worst frame | frames over | CPU ms a frame | exact | default | pilot, of the exact run | whole run, of the cheapest of default and exact that keeps the bound |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let mut times = String::new();
    for (name, words) in SCENES {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        match bench.words(words) {
            Some(words) => times += &bench.scene(name, &words),
            None => skipped(name),
        }
    }
    println!(
        "\n| scene | asked ms | chosen | median CPU ms | slowest | within 1.2 times | predicted ms | pilot CPU ms |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    print!("{times}");
    // Nothing is lost if the folder stays.
    let _ = std::fs::remove_dir_all(&bench.folder);
}

impl Bench {
    /// The words with real paths; `None` if a file is absent.
    fn words(&self, text: &str) -> Option<Vec<String>> {
        let word = |word: &str| match word.strip_prefix('@') {
            None => Some(match word.strip_prefix('%') {
                Some(name) => self.folder.join(name).display().to_string(),
                None => word.to_owned(),
            }),
            Some(path) => {
                let file = path.split(['#', ':']).next().unwrap_or(path);
                let full = self.data.join(path).display().to_string();
                self.data.join(file).is_file().then_some(full)
            }
        };
        text.split_whitespace().map(word).collect()
    }

    /// Opaque cells with sharp edges, as a raw file and a colour map.
    fn write_checker_box(&self) {
        std::fs::create_dir_all(&self.folder).expect("a folder for the scene");
        let volume = procedural::checker_box(100, 10).expect("a volume");
        let Voxels::U8(voxels) = &volume.voxels else {
            panic!("expected bytes")
        };
        let [dark, light] = procedural::CHECKER_VALUES;
        let map = json!([{
            "Name": "checker",
            "ColorSpace": "RGB",
            "RGBPoints": [dark, 0.3, 0.4, 0.65, light, 0.95, 0.9, 0.85],
            "Points": [dark, 0.9, 0.5, 0.0, light, 0.9, 0.5, 0.0],
        }]);
        std::fs::write(self.folder.join("checker-box.raw"), &voxels[..]).expect("a volume");
        std::fs::write(self.folder.join("checker-box.json"), map.to_string())
            .expect("a colour map");
    }

    /// Prints the rows of the bounds, and gives those of the times.
    fn scene(&self, name: &str, words: &[String]) -> String {
        let planned: Vec<Run> = BOUNDS
            .iter()
            .map(|bound| self.draw(words, &["--max-error", bound], &format!("{bound}/")))
            .collect();
        let exact_words = planned[0].planned["exact_setting"]
            .as_str()
            .unwrap_or_default()
            .to_owned();
        let exact = self.draw(words, &exact_words.split(' ').collect::<Vec<_>>(), "exact/");
        let default = self.draw(words, &[], "default/");
        for (bound, run) in BOUNDS.iter().zip(&planned) {
            self.bound_row((name, bound), run, [&default, &exact]);
        }
        let base = middle(&planned[1].cpu_ms);
        let rows = TIMES.map(|factor| self.time_row(name, words, base * factor));
        rows.concat()
    }

    fn bound_row(&self, (name, bound): (&str, &str), run: &Run, [default, exact]: [&Run; 2]) {
        let allowed = run.planned["bound"].as_f64().unwrap_or(0.0);
        let errors_in = |folder: &str| -> Vec<f64> {
            let error_in = |frame| {
                let truth = self.picture("exact/", frame);
                let largest = run.planned["metric"] == "max";
                error(&self.picture(folder, frame), &truth, largest)
            };
            (0..self.frames).map(error_in).collect()
        };
        let largest = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
        let errors = errors_in(&format!("{bound}/"));
        let over = errors.iter().filter(|&&error| error > allowed).count();
        let pilot_ms = run.planned["pilot_cpu_ms"].as_f64().unwrap_or(0.0);
        let sum = |run: &Run| run.cpu_ms.iter().sum::<f64>();
        let cheapest = match largest(&errors_in("default/")) <= allowed {
            true => sum(default).min(sum(exact)),
            false => sum(exact),
        };
        println!(
            "| {name} | {bound} ({allowed:.4}) | `{}` | {:.4} | {:.4} | {over} | {:.1} | {:.1} | {:.1} | {:.1} % | {:.2} |",
            chosen(run),
            run.planned["predicted_error"].as_f64().unwrap_or(0.0),
            largest(&errors),
            middle(&run.cpu_ms),
            middle(&exact.cpu_ms),
            middle(&default.cpu_ms),
            100.0 * pilot_ms / sum(exact),
            (pilot_ms + sum(run)) / cheapest,
        );
    }

    fn time_row(&self, name: &str, words: &[String], time_ms: f64) -> String {
        let run = self.draw(words, &["--max-time", &format!("{time_ms}ms")], "time/");
        let within = run.cpu_ms.iter().filter(|&&ms| ms <= 1.2 * time_ms).count();
        format!(
            "| {name} | {time_ms:.1} | `{}` | {:.1} | {:.1} | {within} of {} | {:.1} | {:.0} |\n",
            chosen(&run),
            middle(&run.cpu_ms),
            run.cpu_ms.iter().copied().fold(0.0, f64::max),
            run.cpu_ms.len(),
            run.planned["predicted_ms"].as_f64().unwrap_or(0.0),
            run.planned["pilot_cpu_ms"].as_f64().unwrap_or(0.0),
        )
    }

    /// Draws the orbit into a folder of its own.
    fn draw(&self, words: &[String], more: &[&str], folder: &str) -> Run {
        let folder = self.folder.join(plain(folder));
        std::fs::create_dir_all(&folder).expect("a folder for the pictures");
        let stats = folder.join("stats.json");
        let frames = self.frames.to_string();
        let mut command = Command::new(&self.binary);
        command
            .args(["--threads", "1", "--quiet"])
            .args(words)
            .args(more);
        if words[0] == "warp3d" {
            command.args(["--sway", &format!("3,{frames}")]);
        } else {
            command.args([
                "--turntable",
                &frames,
                "--size",
                &format!("{0}x{0}", self.side),
            ]);
        }
        command
            .arg("-o")
            .arg(folder.join("%04d.exr"))
            .arg("--stats")
            .arg(&stats);
        let output = command.output().expect("the binary runs");
        assert!(
            output.status.success(),
            "{command:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        let text = std::fs::read_to_string(&stats).expect("the stats");
        let stats: Value = serde_json::from_str(&text).expect("JSON");
        let frames = stats["frames"].as_array().expect("a list");
        Run {
            cpu_ms: frames
                .iter()
                .filter_map(|frame| frame["cpu_ms"].as_f64())
                .collect(),
            planned: stats["planned"].clone(),
        }
    }

    fn picture(&self, folder: &str, frame: usize) -> Image {
        rendered::read(
            &self
                .folder
                .join(plain(folder))
                .join(format!("{frame:04}.exr")),
        )
        .expect("a picture")
    }
}

/// Root mean square over the covered pixels, or the largest change of any.
fn error(picture: &Image, truth: &Image, largest: bool) -> f64 {
    let mask = Mask::from_alpha(truth);
    let mask = (!largest).then_some(&mask);
    let found = compare(picture, truth, mask).expect("pictures of one size");
    if largest { found.max_abs } else { found.rmse }
}

/// The words of the setting that was chosen.
fn chosen(run: &Run) -> &str {
    match run.planned["setting"].as_str() {
        Some("") | None => "the default",
        Some(words) => words,
    }
}

fn middle(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// A bound as the name of a folder.
fn plain(text: &str) -> String {
    text.trim_end_matches('/').replace(['/', ':'], "-")
}

/// The binary: named by the environment, or built beside the examples.
fn binary() -> PathBuf {
    let beside = || -> Option<PathBuf> {
        let own = std::env::current_exe().ok()?;
        Some(own.parent().and_then(Path::parent)?.join("resample"))
    };
    let found = std::env::var_os("RESAMPLE_BINARY")
        .map(PathBuf::from)
        .or_else(beside);
    found
        .filter(|path| path.is_file())
        .expect("build the binary first: cargo build --release -p resample-cli")
}
