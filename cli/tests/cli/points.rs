//! `resample points`: scans from a file to pictures, found by their content, and refused where they are bad.

use std::fmt::Write;
use std::fs;

use super::{Bench, assert_good, read_png, stderr};

/// A hill over a square of 60x60 points, with colours, an intensity and a class; z is up.
fn hill() -> Vec<([f64; 3], [u8; 3], u16, u8)> {
    let point = |i: usize| {
        let (x, y) = (f64::from(i as u32 % 60), f64::from(i as u32 / 60));
        let height = 8.0 * (-((x - 30.0).powi(2) + (y - 30.0).powi(2)) / 150.0).exp();
        let is_hill = height > 2.0;
        let colour = if is_hill {
            [40, 160, 40]
        } else {
            [200, 60, 40]
        };
        (
            [x, y, height],
            colour,
            (100 * i % 6000) as u16,
            if is_hill { 5 } else { 2 },
        )
    };
    (0..3600).map(point).collect()
}

pub(super) fn ply() -> String {
    let points = hill();
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", points.len());
    for name in [
        "float x",
        "float y",
        "float z",
        "uchar red",
        "uchar green",
        "uchar blue",
    ] {
        writeln!(text, "property {name}").expect("a text");
    }
    text += "property float intensity\nproperty uchar classification\nend_header\n";
    for ([x, y, z], [r, g, b], intensity, class) in points {
        writeln!(text, "{x} {y} {z} {r} {g} {b} {intensity} {class}").expect("a text");
    }
    text
}

fn xyz() -> String {
    let rows = hill().into_iter();
    rows.map(|([x, y, z], ..)| format!("{x} {y} {z}\n"))
        .collect()
}

pub(super) fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("hill.ply", ply().as_bytes());
    bench.write("hill.dat", xyz().as_bytes());
    bench
}

const SMALL: &str = "--size 64x48 --up z";

fn pixels(bench: &Bench, name: &str) -> Vec<u8> {
    read_png(&bench.path(&format!("out/{name}"))).2
}

/// The mean colour of the opaque pixels.
fn mean(pixels: &[u8]) -> [f64; 3] {
    let opaque: Vec<&[u8]> = pixels.chunks(4).filter(|p| p[3] == 255).collect();
    assert!(
        opaque.len() > 300,
        "only {} pixels show something",
        opaque.len()
    );
    std::array::from_fn(|i| {
        let sum: f64 = opaque.iter().map(|p| f64::from(p[i])).sum();
        sum / opaque.len() as f64
    })
}

#[test]
fn scans_are_found_by_their_content() {
    let bench = bench();
    assert_good(&bench.run(&format!("points hill.ply {SMALL} -o out/a.png")));
    assert_good(&bench.run(&format!("hill.ply {SMALL} -o out/b.png")));
    assert_good(&bench.run(&format!("warp3d hill.ply {SMALL} -o out/c.png")));
    let first = pixels(&bench, "a.png");
    assert_eq!(first, pixels(&bench, "b.png"));
    assert_eq!(first, pixels(&bench, "c.png"));
    assert_good(&bench.run("hill.dat -o out/d.png --size 64x48"));
    assert!(mean(&pixels(&bench, "d.png"))[0] > 0.0);
    // A mesh stays one, and a mesh's command names the one for points.
    let refused = bench.run("texmap hill.ply -o out/e.png");
    assert!(
        stderr(&refused).contains("resample points"),
        "{}",
        stderr(&refused)
    );
    let mesh = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    bench.write("mesh.ply", mesh.as_bytes());
    let info = String::from_utf8(bench.run("info mesh.ply").stdout).expect("a text");
    assert!(info.contains("resample texmap"), "{info}");
}

#[test]
fn info_names_what_a_scan_has() {
    let bench = bench();
    let text = String::from_utf8(bench.run("info hill.ply").stdout).expect("a text");
    for part in [
        "PLY",
        "3600",
        "colour, intensity, class",
        "x 0 to 59",
        "2 ground: ",
        "5 high vegetation: ",
        "about 1",
        "resample points hill.ply -o picture.png",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let json = String::from_utf8(bench.run("info hill.ply --json").stdout).expect("a text");
    let facts: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(
        (&facts["kind"], &facts["points"]),
        (&"scan".into(), &3600.into())
    );
    let spacing = facts["spacing"].as_f64().expect("a number");
    assert!((0.8..1.2).contains(&spacing), "{spacing}");
}

#[test]
fn colours_come_from_what_is_asked_for() {
    let bench = bench();
    let colours = |by: &str| {
        let name = format!("{}.png", by.split(' ').next().unwrap_or_default());
        let words = format!("hill.ply {SMALL} --color-by {by} --shade unlit -o out/{name}");
        let output = bench.run(&words);
        assert_good(&output);
        (mean(&pixels(&bench, &name)), stderr(&output))
    };
    let (red, _) = colours("colour");
    assert!(red[0] > 1.5 * red[2], "mostly red: {red:?}");
    let (height, note) = colours("height --colormap greys");
    assert!((height[0] - height[1]).abs() < 2.0, "grey: {height:?}");
    assert!(
        note.contains("heights from 0") && note.contains("greys"),
        "{note}"
    );
    let (class, _) = colours("class");
    assert!(class[0] > class[2], "ground is brown: {class:?}");
    let (_, note) = colours("intensity --color-range 0,6000");
    assert!(
        !note.contains("intensities from"),
        "the range is known: {note}"
    );
    let (normal, _) = colours("normal");
    assert!(normal[2] > normal[0], "it faces up: {normal:?}");
    let refused = bench.run("hill.dat --color-by class -o out/f.png");
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        stderr(&refused).contains("--color-by class: the file has none; expected height, normal"),
        "{}",
        stderr(&refused)
    );
    let refused = bench.run("hill.ply --colormap greys -o out/f.png");
    assert!(
        stderr(&refused).contains("--colormap: is for"),
        "{}",
        stderr(&refused)
    );
}

#[test]
fn the_part_that_is_asked_for_is_drawn() {
    let bench = bench();
    let seen = |words: &str| {
        assert_good(&bench.run(&format!(
            "hill.ply {words} --save-camera out/c.json {SMALL} -o out/a.png"
        )));
        pixels(&bench, "a.png")
            .chunks(4)
            .filter(|p| p[3] > 0)
            .count()
    };
    let whole = seen("");
    fs::copy(bench.path("out/c.json"), bench.path("c.json")).expect("written");
    let drawn = |words: &str| {
        assert_good(&bench.run(&format!(
            "hill.ply {words} --camera c.json --size 64x48 -o out/b.png"
        )));
        pixels(&bench, "b.png")
            .chunks(4)
            .filter(|p| p[3] > 0)
            .count()
    };
    assert_eq!(drawn(""), whole, "the camera file gives the same picture");
    let half = drawn("--clip-plane 1,0,0,30");
    assert!(
        (whole / 3..3 * whole / 4).contains(&half),
        "{half} of {whole}"
    );
    assert!(drawn("--crop 0,0,-1,20,20,9") < half);
    let thinned = bench.run(&format!("hill.ply --points 900 {SMALL} -o out/a.png"));
    assert!(
        stderr(&thinned).contains("900 of its 3600 points"),
        "{}",
        stderr(&thinned)
    );
    let nothing = bench.run("hill.ply --crop 100,0,0,200,1,1 -o out/d.png");
    assert!(
        stderr(&nothing).contains("--crop: leaves no point"),
        "{}",
        stderr(&nothing)
    );
    assert!(!bench.path("out/d.png").exists());
}

#[test]
fn tiles_threads_and_resumed_pictures_have_the_bytes_of_one_run() {
    let bench = bench();
    let words = "points hill.ply --up z --size 70x50 --shade lambert --color-by height";
    let planes = "--layers normal";
    assert_good(&bench.run(&format!("{words} {planes} -o out/whole.exr")));
    for tile in ["0,0", "1,0", "0,1", "1,1"] {
        assert_good(&bench.run(&format!(
            "{words} {planes} -o out/part.exr --tile {tile}/2x2"
        )));
    }
    let tiles = ["0-0", "1-0", "0-1", "1-1"].map(|at| format!("out/part.tile-{at}.exr"));
    assert_good(&bench.run(&format!("join {} -o out/joined.exr", tiles.join(" "))));
    let read = |name: &str| fs::read(bench.path(&format!("out/{name}"))).expect("written");
    assert!(read("whole.exr") == read("joined.exr"), "tiles");
    for channel in ["normal.X", "normal.Y", "normal.Z", "Z"] {
        let file = read("whole.exr");
        let mut places = file.windows(channel.len() + 1);
        let name = [channel.as_bytes(), b"\0"].concat();
        assert!(places.any(|place| place == name), "{channel}");
    }
    for threads in [1, 2] {
        assert_good(&bench.run(&format!(
            "{words} --threads {threads} -o out/t{threads}.png"
        )));
    }
    assert!(read("t1.png") == read("t2.png"), "threads");
    assert_good(&bench.run(&format!(
        "{words} --turntable 3 -o out/turn.png --stats out/s.json"
    )));
    let stats: serde_json::Value = serde_json::from_slice(&read("s.json")).expect("JSON");
    assert_eq!(
        (&stats["points"], &stats["settings"]["colours"]["by"]),
        (&3600.into(), &"height".into())
    );
    let resumed = bench.run(&format!("{words} --turntable 3 -o out/turn.png --resume"));
    assert!(
        stderr(&resumed).contains("3 of 3 pictures were there"),
        "{}",
        stderr(&resumed)
    );
}

/// A station in a round room with a post, 2 degrees a beam; the range of one column beside the post lies between both.
fn station() -> String {
    let head = "180\n60\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n9 0 0 1\n";
    let mut text = head.to_owned();
    for (column, row) in (0..180).flat_map(|column| (0..60).map(move |row| (column, row))) {
        let (sin, cos) = f64::from(2 * column).to_radians().sin_cos();
        let (up, out) = f64::from(2 * row - 59).to_radians().sin_cos();
        let range = match column {
            20..=25 => 1.0,
            26 => 2.5,
            _ => 5.0,
        };
        let [x, y, z] = [range * out * cos, range * out * sin, range * up];
        writeln!(text, "{x:.5} {y:.5} {z:.5} 0.5").expect("a text");
    }
    text
}

#[test]
fn points_between_two_surfaces_of_a_station_are_left_out() {
    let bench = bench();
    bench.write("a.ptx", station().as_bytes());
    let discs = |words: &str| {
        let output = bench.run(&format!(
            "a.ptx {words} --size 64x48 -o out/a.png --stats out/s.json"
        ));
        assert_good(&output);
        let stats = fs::read(bench.path("out/s.json")).expect("written");
        let stats: serde_json::Value = serde_json::from_slice(&stats).expect("JSON");
        (stats["discs"].as_u64(), stderr(&output))
    };
    let (left, said) = discs("");
    assert!(
        said.contains("60 of 10800 points lie between two surfaces"),
        "{said}"
    );
    let (all, said) = discs("--keep-all");
    assert!(!said.contains("between two surfaces"), "{said}");
    assert_eq!(all, Some(10_800));
    assert!(left < Some(10_741), "{left:?}");
}

#[test]
fn an_error_or_a_time_chooses_a_setting() {
    let bench = bench();
    for ask in ["--max-error 1/64", "--max-error 1/255", "--max-time 5s"] {
        let output = bench.run(&format!("hill.ply {SMALL} {ask} --explain -o out/a.png"));
        assert_good(&output);
        assert!(
            stderr(&output).contains("every"),
            "{ask}: {}",
            stderr(&output)
        );
    }
    let output = bench.run("trade warp3d hill.ply --up z --size 48x32 --reps 1 --out out/trade");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(bench.path("out/trade").join("index.html").exists() || !bench.written().is_empty());
}

#[test]
fn bad_scans_are_refused_in_a_line() {
    let bench = bench();
    bench.write("short.ply", &ply().as_bytes()[..2000]);
    bench.write("empty.xyz", b"nan nan nan\nnan nan nan\n");
    bench.write("one.xyz", b"1 2 3\n1 2 3\n1 2 3\n");
    for (words, why) in [
        ("points short.ply", "short.ply"),
        ("points one.xyz", "one.xyz"),
        ("points ball.raw", "holds no points of a known format"),
        ("points hill.ply --points 0", "--points"),
        ("points hill.ply --every 65", "every"),
        ("points hill.ply --subpixels 3", "sub-pixels"),
        (
            "points hill.ply --layers normal",
            "--layers: only a name that ends in .exr",
        ),
        ("points hill.ply --max-memory 1K", "--points N"),
        ("points nothing.las", "nothing.las"),
        ("points hill.ply#1", "scans are read whole"),
    ] {
        let output = bench.run(&format!("{words} -o out/a.png"));
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
        assert!(bench.written().is_empty(), "{words}: {:?}", bench.written());
    }
}
