//! The binary from end to end: what a person types, and what is on the disk afterwards.
//!
//! Bad input must give exit code 2, one line that names the file, and nothing written. Good input is tiny, 32^3
//! voxels and 64 x 64 pixels, so that the whole file runs in seconds.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

mod animations;
mod bad_input;
mod bench;
mod by_content;
mod channels;
mod compare;
mod documented;
mod errors;
mod exr_files;
mod figures;
mod films;
mod gate;
mod gaussians;
mod good_runs;
mod info;
mod limits;
mod looks;
mod motion;
mod other_grid;
mod pages;
mod parts;
mod planner;
mod planner_random;
mod points;
mod saved_camera;
mod scenes;
mod sequences;
mod standing_meshes;
mod stored;
mod texmap;
mod texmap_formats;
mod trade;
mod thumbnails;
mod time_steps;
mod transfer;
mod view;
mod warp3d;
mod warp3d_found;
mod warp3d_refused;
mod warp3d_relative;
mod warp3d_several;

/// Voxels along an axis of the test volume.
const SIDE: usize = 32;

/// A folder with a volume `ball.raw` and an empty folder `out` for what is written.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        let bench = Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        };
        bench.write("ball.raw", &ball());
        fs::create_dir(bench.path("out")).expect("a folder for the pictures");
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, content: &[u8]) {
        fs::write(self.path(name), content).expect("a file in a temporary folder");
    }

    /// Runs the binary in the folder, with words that are separated by spaces.
    fn run(&self, words: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_resample"))
            .current_dir(self.folder.path())
            .args(words.split_whitespace())
            .output()
            .expect("the binary starts")
    }

    /// Runs `resample volsplat` on the ball, at 64 x 64 pixels unless `words` say otherwise.
    fn draw(&self, words: &str) -> Output {
        self.run(&format!("volsplat ball.raw {BALL} {words}"))
    }

    /// Names of what lies in `out`, sorted.
    fn written(&self) -> Vec<String> {
        let entries = fs::read_dir(self.path("out")).expect("the folder is there");
        let mut names: Vec<_> = entries
            .map(|entry| {
                entry
                    .expect("readable")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        names
    }
}

/// The options that a raw file needs.
const BALL: &str = "--dims 32,32,32 --type u8";

/// A soft ball in the middle of an empty cube.
fn ball() -> Vec<u8> {
    let centre = 0.5 * (SIDE - 1) as f64;
    let voxel = |index: usize| {
        let offset = |i: usize| (i as f64 - centre) / centre;
        let at = [index % SIDE, index / SIDE % SIDE, index / (SIDE * SIDE)];
        let radius = at.map(|i| offset(i).powi(2)).iter().sum::<f64>().sqrt();
        (255.0 * (1.0 - radius / 0.8)).max(0.0) as u8
    };
    (0..SIDE.pow(3)).map(voxel).collect()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn assert_good(output: &Output) {
    assert_eq!(
        output.status.code(),
        Some(0),
        "expected success, stderr was: {}",
        stderr(output)
    );
    assert!(output.stdout.is_empty(), "stdout is left to pipes");
}

/// Width, height and RGBA bytes of an 8-bit PNG.
fn read_png(path: &Path) -> (u32, u32, Vec<u8>) {
    let file = fs::File::open(path).expect("a written picture");
    let mut reader = png::Decoder::new(std::io::BufReader::new(file))
        .read_info()
        .expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut bytes).expect("whole");
    (info.width, info.height, bytes)
}
