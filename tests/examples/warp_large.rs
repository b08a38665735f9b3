//! A depth image larger than memory through the command line: peak memory and time, beside the same in memory.
//!
//! `cargo run --release -p resample-tests --example warp_large -- RESAMPLE FOLDER SIDE[,SIDE...] MEMORY[,MEMORY...]`
//!
//! Takes the program, a folder for the files, sides of the square pictures, and limits such as `4G` (`-`: none, in
//! memory). Writes a procedural picture (8-bit PNG) and its depth (16-bit PNG) of each side, once, row by row; draws
//! one magnified view and one of the whole with each limit, and prints what the operating system says about the peak
//! memory of each run, and how far the pictures of one side differ.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use resample_core::Image;
use resample_tests::exr_read;

/// World units of a code of the depth.
const UNIT: &str = "0.0002";

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [program, folder, sides, limits] = words.as_slice() else {
        eprintln!("expected RESAMPLE FOLDER SIDES LIMITS");
        std::process::exit(2);
    };
    let folder = Path::new(folder);
    std::fs::create_dir_all(folder).expect("a folder");
    println!(
        "| side | view | --max-memory | peak MiB | load s | frame s | CPU s | windows | samples read | differs |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for side in sides
        .split(',')
        .map(|side| side.parse::<usize>().expect("a side"))
    {
        let files = written(folder, side);
        for view in ["magnified", "whole"] {
            let mut first = None;
            for limit in limits.split(',') {
                let run = Run {
                    program,
                    files: &files,
                    side,
                    view,
                    limit,
                };
                let picture = run.draw(folder);
                let pixels = exr_read::read_rgba(&picture).expect("a picture");
                let differs = first
                    .as_ref()
                    .map_or(String::new(), |first| changed(first, &pixels));
                println!(" {differs} |");
                first.get_or_insert(pixels);
            }
        }
    }
}

/// One call of the program.
struct Run<'a> {
    program: &'a str,
    files: &'a [PathBuf; 2],
    side: usize,
    view: &'a str,
    limit: &'a str,
}

impl Run<'_> {
    /// Draws, and prints a row without its end.
    fn draw(&self, folder: &Path) -> PathBuf {
        let (picture, stats) = (
            folder.join(format!("{}.exr", self.view)),
            folder.join("stats.json"),
        );
        let side = self.side as f64;
        let lens = format!("{0},{0},{1},{1}", 0.9 * side, 0.5 * side - 0.5);
        let camera = folder.join("to.json");
        std::fs::write(&camera, camera_json(self.view, side)).expect("written");
        let mut command = Command::new(self.program);
        command
            .arg("warp3d")
            .args(self.files)
            .args(["--depth-scale", UNIT, "--intrinsics", &lens]);
        command
            .arg("--to")
            .arg(&camera)
            .arg("--stats")
            .arg(&stats)
            .arg("-o")
            .arg(&picture);
        if self.limit != "-" {
            command.args(["--max-memory", self.limit]);
        }
        let status = command.arg("--quiet").status().expect("the program runs");
        assert!(status.success(), "{command:?}");
        let stats: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(&stats).expect("stats")).expect("JSON");
        let frame = &stats["frames"][0];
        let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
        print!(
            "| {} | {} | {} | {:.0} | {:.1} | {:.1} | {:.1} | {} | {} |",
            self.side,
            self.view,
            self.limit,
            number(&stats["peak_bytes"]) / f64::from(1 << 20),
            1e-3 * number(&stats["load_ms"]),
            1e-3 * number(&frame["wall_ms"]),
            1e-3 * number(&frame["cpu_ms"]),
            frame["windows"],
            frame["read_samples"],
        );
        std::io::stdout().flush().expect("a terminal");
        picture
    }
}

/// A camera that magnifies a part of the picture by one and a half, or that sees all of it, in 1920 x 1080.
fn camera_json(view: &str, side: f64) -> String {
    let (focal, [x, y, z]) = match view {
        "magnified" => (0.9 * side * 1.5, [0.6, 0.4, 0.5]),
        _ => (930.0, [0.3, -0.2, -0.4]),
    };
    format!(
        r#"{{"width": 1920, "height": 1080, "fx": {focal}, "fy": {focal}, "cx": 960, "cy": 540,
            "R": [1, 0, 0, 0, 1, 0, 0, 0, 1], "t": [{}, {}, {}]}}"#,
        -x, -y, -z
    )
}

/// How many pixels differ by more than 1e-4, and by how much at most.
fn changed(a: &Image, b: &Image) -> String {
    let worst =
        |(a, b): (&[f32; 4], &[f32; 4])| (0..4).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
    let changes = || a.rgba.iter().zip(&b.rgba).map(worst);
    let (count, largest) = (
        changes().filter(|&change| change > 1e-4).count(),
        changes().fold(0.0, f32::max),
    );
    format!("{count} of {}, by up to {largest:.4}", a.rgba.len())
}

/// The picture and its depth.
fn written(folder: &Path, side: usize) -> [PathBuf; 2] {
    let files = ["colour", "depth"].map(|name| folder.join(format!("{name}-{side}.png")));
    if files.iter().all(|file| file.exists()) {
        return files;
    }
    let start = Instant::now();
    rows(
        &files[0],
        side,
        (png::ColorType::Rgb, png::BitDepth::Eight),
        &|y, row| {
            for (x, rgb) in row.chunks_exact_mut(3).enumerate() {
                let checks = ((x >> 5) ^ (y >> 5)) as u8 & 1;
                let grain =
                    (((x as u32 * 73) ^ (y as u32 * 151)).wrapping_mul(2_654_435_761) >> 27) as u8;
                let tint = [(x * 160 / side) as u8, (y * 160 / side) as u8, 90];
                for (channel, tint) in rgb.iter_mut().zip(tint) {
                    *channel = 30 + tint + 20 * checks + grain;
                }
            }
        },
    );
    rows(
        &files[1],
        side,
        (png::ColorType::Grayscale, png::BitDepth::Sixteen),
        &|y, row| {
            for (x, code) in row.chunks_exact_mut(2).enumerate() {
                code.copy_from_slice(&depth_code(x, y, side).to_be_bytes());
            }
        },
    );
    eprintln!(
        "wrote {} and {} in {:.1} s",
        files[0].display(),
        files[1].display(),
        start.elapsed().as_secs_f64()
    );
    files
}

/// A slanted wall with sixteen by sixteen boxes before it.
fn depth_code(x: usize, y: usize, side: usize) -> u16 {
    let cell = side / 16;
    let (column, row) = (x / cell, y / cell);
    let inside = |v: usize| (cell / 4..cell * 3 / 4).contains(&(v % cell));
    let wall = 35_000 + x * 8_000 / side;
    let before = if inside(x) && inside(y) {
        5_000 + (column * 7 + row * 11) % 16 * 500
    } else {
        0
    };
    (wall - before) as u16
}

/// Writes a PNG row by row.
fn rows(
    path: &Path,
    side: usize,
    (colour, bits): (png::ColorType, png::BitDepth),
    fill: &dyn Fn(usize, &mut [u8]),
) {
    let file = BufWriter::new(File::create(path).expect("a file"));
    let mut encoder = png::Encoder::new(file, side as u32, side as u32);
    encoder.set_color(colour);
    encoder.set_depth(bits);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().expect("a header");
    let mut stream = writer.stream_writer().expect("a stream");
    let bytes = if colour == png::ColorType::Rgb { 3 } else { 2 };
    let mut row = vec![0; side * bytes];
    for y in 0..side {
        fill(y, &mut row);
        stream.write_all(&row).expect("room on the disk");
    }
    stream.finish().expect("written");
}
