//! `resample gaussians`: found by content, the same bytes in tiles and on any number of threads, framed without floaters, and bad options.

use std::fs;

use exr::prelude::{ReadChannels, ReadLayers};
use serde_json::{Value, json};

use super::good_runs::stats;
use super::{Bench, assert_good, read_png, stderr};

/// A PLY file as INRIA's code writes it: balls on a spiral, red to blue, and floaters far off where they are asked for.
pub(super) fn ply(floaters: usize) -> Vec<u8> {
    let balls = 400;
    let names = [
        "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
        "rot_0", "rot_1", "rot_2", "rot_3",
    ];
    let mut file = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n",
        balls + floaters
    );
    for name in names {
        file += &format!("property float {name}\n");
    }
    file += "end_header\n";
    let mut file = file.into_bytes();
    for number in 0..balls + floaters {
        let t = number as f32 / balls as f32;
        let (sin, cos) = (20.0 * t).sin_cos();
        let mut values = [
            cos,
            2.0 * t - 1.0,
            sin,
            1.5 - 3.0 * t,
            -0.5,
            3.0 * t - 1.5,
            2.0,
            -2.5,
            -3.0,
            -3.5,
            1.0,
            0.2,
            t,
            0.0,
        ];
        if number >= balls {
            // Faint ones.
            (values[0], values[6]) = (1e4, -4.0);
        }
        file.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
    file
}

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("a.bin", &ply(0));
    bench
}

fn bytes(bench: &Bench, name: &str) -> Vec<u8> {
    fs::read(bench.path(name)).expect("written")
}

fn assert_same(bench: &Bench, one: &str, other: &str) {
    assert!(
        bytes(bench, one) == bytes(bench, other),
        "{one} has the bytes of {other}"
    );
}

#[test]
fn gaussians_are_found_by_their_content() {
    let bench = bench();
    let size = "--size 48x48";
    assert_good(&bench.run(&format!("gaussians a.bin {size} -o out/named.png")));
    for (number, words) in [
        "a.bin",
        "volsplat a.bin",
        "--threads 1 -q volsplat --slab-error 0.02 a.bin",
        "-q volsplat --resume --size 48x48 a.bin",
    ]
    .iter()
    .enumerate()
    {
        let size = if words.contains("--size") { "" } else { size };
        assert_good(&bench.run(&format!("{words} {size} -o out/{number}.png")));
        let [a, b] = ["named".to_owned(), number.to_string()]
            .map(|name| read_png(&bench.path(&format!("out/{name}.png"))));
        assert!(a == b, "{words}");
    }
    let (_, _, pixels) = read_png(&bench.path("out/named.png"));
    let seen = pixels.chunks(4).filter(|pixel| pixel[3] > 128).count();
    assert!((300..2000).contains(&seen), "{seen} pixels show something");
}

#[test]
fn info_tells_what_they_are() {
    let bench = bench();
    let output = bench.run("info a.bin --json");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let facts: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(facts["kind"], "gaussians");
    assert_eq!(facts["format"], "PLY");
    assert_eq!(facts["gaussians"], 400);
    assert_eq!(facts["degree"], 0);
    assert_eq!(facts["up"], json!([0.0, -1.0, 0.0]));
    let command = "resample gaussians a.bin -o picture.png";
    assert_eq!(facts["commands"], json!([command]));
    let text = String::from_utf8(bench.run("info a.bin").stdout).expect("text");
    for part in ["3-D Gaussians, PLY", "400 Gaussians", "sRGB", command] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn y_points_down_unless_it_is_said_otherwise() {
    let bench = bench();
    let size = "--size 48x48 --orbit 0,0";
    let output = bench.run(&format!("gaussians a.bin {size} -o out/a.png"));
    assert!(stderr(&output).contains("--up y"), "{}", stderr(&output));
    let output = bench.run(&format!("gaussians a.bin {size} --up y -o out/b.png"));
    assert!(!stderr(&output).contains("--up"), "{}", stderr(&output));
    // Red is at -y, blue at +y.
    let blue_above = |name: &str| {
        let (_, _, pixels) = read_png(&bench.path(name));
        let sum = |rows: &[u8], channel: usize| {
            let all = rows.chunks(4).map(|pixel| u32::from(pixel[channel]));
            all.sum::<u32>()
        };
        let upper = &pixels[..pixels.len() / 2];
        sum(upper, 2) > sum(upper, 0)
    };
    assert!(!blue_above("out/a.png") && blue_above("out/b.png"));
}

#[test]
fn floaters_do_not_move_the_camera_away() {
    let bench = bench();
    bench.write("floaters.ply", &ply(10));
    for name in ["a.bin", "floaters.ply"] {
        assert_good(&bench.run(&format!("{name} --size 48x48 -o out/{name}.png")));
    }
    let seen = |name: &str| {
        let (_, _, pixels) = read_png(&bench.path(&format!("out/{name}.png")));
        pixels.chunks(4).filter(|pixel| pixel[3] > 128).count() as f64
    };
    let ratio = seen("floaters.ply") / seen("a.bin");
    assert!((0.8..1.2).contains(&ratio), "{ratio}");
}

#[test]
fn parts_threads_and_saved_cameras_give_the_same_bytes() {
    let bench = bench();
    let command = "gaussians a.bin --size 70x50";
    assert_good(&bench.run(&format!("{command} --layers median-depth -o out/whole.exr")));
    for row in 0..2 {
        for column in 0..3 {
            assert_good(&bench.run(&format!(
                "{command} --layers median-depth --tile {column},{row}/3x2 -o out/part.exr"
            )));
        }
    }
    let tile = |at: usize| format!("out/part.tile-{}-{}.exr", at % 3, at / 3);
    let tiles: Vec<String> = (0..6).map(tile).collect();
    assert_good(&bench.run(&format!("join {} -o out/joined.exr", tiles.join(" "))));
    assert_same(&bench, "out/joined.exr", "out/whole.exr");

    for threads in [1, 2] {
        assert_good(&bench.run(&format!(
            "--threads {threads} {command} -o out/{threads}.png --save-camera out/cam.json"
        )));
    }
    assert_same(&bench, "out/1.png", "out/2.png");
    assert_good(&bench.run(&format!("{command} --camera out/cam.json -o out/3.png")));
    assert_same(&bench, "out/1.png", "out/3.png");
}

#[test]
fn a_turntable_turns_and_goes_on() {
    let bench = bench();
    let command = "gaussians a.bin --size 40x40 --turntable 4 -o out/a_%d.png";
    assert_good(&bench.run(&format!("{command} --frames 0..2")));
    let output = bench.run(&format!("{command} --resume --stats out/s.json"));
    assert!(
        stderr(&output).contains("2 of 4 pictures"),
        "{}",
        stderr(&output)
    );
    assert_ne!(bytes(&bench, "out/a_0.png"), bytes(&bench, "out/a_1.png"));
    let stats = stats(&bench);
    assert_eq!(stats["gaussians"], 400);
    assert_eq!(stats["settings"]["render"]["samples"], "auto");
    assert_eq!(stats["settings"]["camera"]["up"], json!([0.0, -1.0, 0.0]));
}

#[test]
fn planes_are_channels_of_an_exr() {
    let bench = bench();
    assert_good(&bench.run("a.bin --size 32x32 -o out/a.exr --layers median-depth"));
    let read = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(bench.path("out/a.exr"))
        .expect("an EXR");
    let channels = &read.layer_data.channel_data.list;
    let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names, ["A", "B", "G", "R", "Z", "depth.median"]);
    let values = |at: usize| -> Vec<f32> { channels[at].sample_data.values_as_f32().collect() };
    let (alpha, mean, median) = (values(0), values(4), values(5));
    let mut both = 0;
    for at in 0..alpha.len() {
        assert_eq!(alpha[at] > 0.0, mean[at].is_finite(), "mean at {at}");
        if alpha[at] > 0.8 {
            both += usize::from(median[at].is_finite() && (median[at] - mean[at]).abs() < 2.5);
        } else if alpha[at] < 0.4 {
            assert!(median[at].is_infinite(), "less than half is lost at {at}");
        }
    }
    assert!(both > 100, "{both} pixels have a mean and a median");
}

#[test]
fn an_error_that_is_asked_for_is_kept() {
    let bench = bench();
    let command = "gaussians a.bin --size 64x64 --turntable 12";
    assert_good(&bench.run(&format!(
        "{command} --max-error 1/255 --explain --stats out/s.json -o out/a_%d.exr"
    )));
    assert_good(&bench.run(&format!(
        "{command} --slab-error 0.005 --samples 4 --min-transmittance 0.00001 -o out/b_%d.exr"
    )));
    for number in 0..12 {
        let output = bench.run(&format!(
            "compare out/a_{number}.exr out/b_{number}.exr --inside --fail-above psnr=48.1"
        ));
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    assert_good(&bench.run(&format!("{command} --max-time 10s -o out/c_%d.png")));
}

#[test]
fn a_clip_cuts_and_an_empty_one_is_an_error() {
    let bench = bench();
    assert_good(&bench.run("a.bin --size 48x48 --clip-plane 0,1,0,0 -o out/a.png"));
    let (_, _, pixels) = read_png(&bench.path("out/a.png"));
    let [red, blue] = [0, 2].map(|channel| {
        let all = pixels.chunks(4).map(|pixel| u32::from(pixel[channel]));
        all.sum::<u32>()
    });
    assert!(blue > 2 * red, "the red half is gone: {red}, {blue}");
    for (words, why) in [
        ("--crop 5,5,5,6,6,6", "--crop or --clip-plane keeps"),
        ("--preset ct-bone", "--preset"),
        ("--slab-error 0", "above 0, at most 1"),
        ("--samples 2", "--samples"),
        ("--layers median-depth", "--layers: only a name"),
        ("--crop-voxels 0,0,0,1,1,1", "--crop-voxels"),
    ] {
        for command in ["a.bin", "volsplat a.bin"] {
            let output = bench.run(&format!("{command} {words} -o out/bad.png"));
            assert_eq!(
                output.status.code(),
                Some(2),
                "{words}: {}",
                stderr(&output)
            );
            assert!(
                stderr(&output).contains(why),
                "{words}: {}",
                stderr(&output)
            );
        }
    }
    let output = bench.run("a.bin#1 -o out/bad.png");
    assert!(
        stderr(&output).contains("has no parts"),
        "{}",
        stderr(&output)
    );
    assert!(!bench.path("out/bad.png").exists());
}

#[test]
fn trade_measures_them() {
    let bench = bench();
    let output = bench.run("trade volsplat a.bin --size 32x32 --reps 1 --out out/report");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let page = fs::read_to_string(bench.path("out/report/index.html")).expect("a page");
    assert!(page.contains("slab-error 0.02"), "its rows are on the page");
}
