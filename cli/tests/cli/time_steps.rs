//! Volumes over time: a picture for each step, with one look and one view for all of them.

use serde_json::Value;

use super::bad_input::assert_refused;
use super::{Bench, assert_good, channels, read_png};

/// A step of 16x16x16 numbers: a block of 4 voxels at x, of a value, over 10.
pub(super) fn step(x: usize, value: f32) -> Vec<u8> {
    let voxel = |i: usize| {
        let at = [i % 16, i / 16 % 16, i / 256];
        let is_inside = (x..x + 4).contains(&at[0]) && at[1..].iter().all(|a| (6..10).contains(a));
        if is_inside { value } else { 10.0 }
    };
    let mut header = "{'descr': '<f4', 'fortran_order': False, 'shape': (16, 16, 16), }".to_owned();
    header += &" ".repeat(63 - (10 + header.len()) % 64);
    header.push('\n');
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((header.len() as u16).to_le_bytes());
    file.extend(header.bytes());
    file.extend((0..4096).flat_map(|i| voxel(i).to_le_bytes()));
    file
}

/// Four steps: the block moves from x = 0 to x = 12 and fades from 100 to 40.
fn bench() -> Bench {
    let bench = Bench::new();
    for (number, (x, value)) in [(0, 100.0), (4, 80.0), (8, 60.0), (12, 40.0)]
        .into_iter()
        .enumerate()
    {
        bench.write(&format!("t{number:02}.npy"), &step(x, value));
    }
    bench
}

/// Pixels that show something: how many, their mean column as a share of the width, and the sum of their alpha.
fn seen(bench: &Bench, name: &str) -> (usize, f64, f64) {
    let (width, _, rgba) = read_png(&bench.path(name));
    let shown = rgba
        .chunks(4)
        .enumerate()
        .filter(|(_, pixel)| pixel[3] > 16);
    let (mut count, mut columns, mut alpha) = (0, 0.0, 0.0);
    for (i, pixel) in shown {
        count += 1;
        columns += (i % width as usize) as f64;
        alpha += f64::from(pixel[3]);
    }
    (
        count,
        columns / count.max(1) as f64 / f64::from(width),
        alpha,
    )
}

#[test]
fn a_film_of_a_file_shows_all_its_points_in_time() {
    let bench = Bench::new();
    channels::image(&bench, &channels::three());
    let size = "--size 16x16";
    for (file, output) in [
        ("cells.zarr#time=all", "all%d"),
        ("cells.zarr", "film%d"),
        ("cells.zarr#time=0", "first%d"),
        ("cells.zarr#time=1", "second%d"),
        ("cells.zarr", "one"),
    ] {
        assert_good(&bench.run(&format!("volsplat {file} -o out/{output}.png {size}")));
    }
    let pixels = |name: &str| read_png(&bench.path(&format!("out/{name}.png")));
    assert!(pixels("film0") == pixels("all0") && pixels("film1") == pixels("all1"));
    assert!(pixels("film0") != pixels("film1"), "two steps");
    let written = bench.written();
    let one_of = |stem: &str| written.iter().filter(|name| name.starts_with(stem)).count();
    assert_eq!(
        [one_of("first"), one_of("second"), one_of("one")],
        [1, 1, 1]
    );
    // Around a still object: its first point in time.
    assert_good(&bench.run(&format!(
        "volsplat cells.zarr -o out/turn%d.png {size} --turntable 3"
    )));
    assert_eq!(
        bench
            .written()
            .iter()
            .filter(|name| name.starts_with("turn"))
            .count(),
        3
    );
}

#[test]
fn steps_share_their_look_and_their_view() {
    let bench = bench();
    let size = "--size 64x48 --orbit 0,0";
    assert_good(&bench.run(&format!(
        "volsplat t%02d.npy -o out/a%02d.png {size} --window 55,60"
    )));
    let all: Vec<_> = (0..4)
        .map(|n| seen(&bench, &format!("out/a{n:02}.png")))
        .collect();
    // The block goes through the picture in even steps, as large in each, and fades.
    for pair in all.windows(2) {
        assert!((pair[1].1 - pair[0].1 - 0.2).abs() < 0.06, "{all:?}");
        assert!(pair[0].0.abs_diff(pair[1].0) < pair[0].0 / 4, "{all:?}");
        assert!(pair[1].2 < pair[0].2, "{all:?}");
    }
    // Other names of the same files are the same pictures.
    let same = |words: &str, name: &str| {
        assert_good(&bench.run(&format!("volsplat {words} {size} --window 55,60")));
        // Files are marked with the words that drew them.
        let is_same = read_png(&bench.path(name)) == read_png(&bench.path("out/a02.png"));
        assert!(is_same, "{words}");
    };
    same("t*.npy -o out/b%02d.png", "out/b02.png");
    bench.write("list.txt", b"t00.npy\nt01.npy\nt02.npy\nt03.npy\n");
    same("list.txt -o out/c%02d.png", "out/c02.png");
    same("t*.npy -o out/d%02d.png --frames 2..3", "out/d02.png");
    // The first step alone decides: its view holds the first block, and the last one lies beside the picture.
    assert_good(&bench.run(&format!(
        "volsplat t*.npy -o out/e%02d.png {size} --look-of 0 --window 55,60"
    )));
    assert!(seen(&bench, "out/e00.png").0 > 2 * all[0].0);
    assert_eq!(seen(&bench, "out/e03.png").0, 0);
}

#[test]
fn turntables_and_animations_pass_through_the_steps() {
    let bench = bench();
    let size = "--size 48x48 --window 55,60";
    assert_good(&bench.run(&format!("volsplat t*.npy -o out/a.apng {size}")));
    assert_good(&bench.run(&format!(
        "volsplat t*.npy -o out/b%d.png {size} --turntable 8"
    )));
    assert!(bench.path("out/b7.png").exists() && !bench.path("out/b8.png").exists());
    // Surfaces and projections, too.
    assert_good(&bench.run("volsplat t*.npy -o out/c%d.png --size 48x48 --iso 50"));
    assert!(
        seen(&bench, "out/c0.png").0 > 0 && seen(&bench, "out/c3.png").0 == 0,
        "40 is below 50"
    );
    // A name without a number gets one.
    assert_good(&bench.run(&format!("volsplat t*.npy -o out/f.png {size}")));
    assert!(bench.path("out/f_0003.png").exists());
    assert_good(&bench.run("volsplat t*.npy -o out/d%d.png --size 48x48 --blend maximum"));
    let said = bench.run("info t*.npy --json");
    let facts: Value = serde_json::from_slice(&said.stdout).expect("JSON");
    assert_eq!(facts["steps"], 4);
}

#[test]
fn steps_that_cannot_be_are_refused() {
    let bench = bench();
    bench.write("flat.nii.gz", b"no NIfTI");
    for (words, named) in [
        ("t*.npy -o out/a%d.png --look-of 4", "4 steps"),
        ("t*.npy -o out/a%d.png --look-of last", "all, or the number"),
        ("t*.npy -o out/a%d.png --max-error 1/255", "one of them"),
        ("u*.npy -o out/a%d.png", "u*.npy"),
        ("u%d.npy -o out/a%d.png", "u%d.npy"),
        ("t00.npy#time=all -o out/a%d.png", "time"),
    ] {
        assert_refused(&bench, &format!("volsplat {words} --size 32x32"), named);
    }
    // A step that is broken is named.
    bench.write("t02.npy", b"\x93NUMPY");
    assert_refused(
        &bench,
        "volsplat t*.npy -o out/a%d.png --size 32x32",
        "t02.npy",
    );
}
