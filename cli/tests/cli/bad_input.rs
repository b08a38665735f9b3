//! Bad input: exit code 2, one line that names the file, nothing written.

use std::io::Write;

use super::{BALL, Bench, stderr};

/// Runs and expects a refusal that names `named`; `out` stays empty.
pub(super) fn assert_refused(bench: &Bench, words: &str, named: &str) {
    let output = bench.run(words);
    let said = stderr(&output);
    assert_eq!(
        output.status.code(),
        Some(2),
        "`{words}` must end with code 2, stderr was: {said}"
    );
    let errors = said
        .lines()
        .filter(|line| line.starts_with("error:"))
        .count();
    assert_eq!(
        errors, 1,
        "`{words}` must print one error line, stderr was: {said}"
    );
    assert!(
        said.contains(named),
        "`{words}` must name {named}, stderr was: {said}"
    );
    assert!(
        !said.contains("panicked"),
        "`{words}` must not panic, stderr was: {said}"
    );
    assert!(
        bench.written().is_empty(),
        "`{words}` must write nothing, found {:?}",
        bench.written()
    );
}

/// As [`assert_refused`], for complaints of one line that are this program's own and not the parser's.
pub(super) fn assert_one_line(bench: &Bench, words: &str, named: &str) {
    assert_refused(bench, words, named);
    let said = stderr(&bench.run(words));
    assert_eq!(
        said.lines().count(),
        1,
        "`{words}` must print one line, stderr was: {said}"
    );
}

fn gzip_nrrd(header: &str, voxels: &[u8]) -> Vec<u8> {
    let mut file = format!("NRRD0004\n{header}\nencoding: gzip\n\n").into_bytes();
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(voxels).expect("in memory");
    file.extend(packed.finish().expect("in memory"));
    file
}

#[test]
fn volumes_that_contradict_their_description_are_refused() {
    let bench = Bench::new();
    let to = "-o out/a.png";
    assert_one_line(
        &bench,
        &format!("volsplat ball.raw --dims 32,32,33 --type u8 {to}"),
        "ball.raw",
    );
    assert_one_line(
        &bench,
        &format!("volsplat ball.raw --dims 32,32,32 --type u16 {to}"),
        "ball.raw",
    );
    assert_one_line(&bench, &format!("volsplat ball.raw {to}"), "ball.raw");
    assert_one_line(
        &bench,
        &format!("volsplat absent.raw {BALL} {to}"),
        "absent.raw",
    );
    assert_one_line(&bench, &format!("volsplat out {BALL} {to}"), "out");
    let huge = "18446744073709551615,2,2";
    assert_refused(
        &bench,
        &format!("volsplat ball.raw --dims {huge} --type u8 {to}"),
        "dims",
    );
}

#[test]
fn damaged_nrrd_files_are_refused() {
    let bench = Bench::new();
    let header = "type: uint8\ndimension: 3\nsizes: 32 32 32";
    let whole = gzip_nrrd(header, &super::ball());
    bench.write("whole.nrrd", &whole);
    bench.write("cut.nrrd", &whole[..whole.len() / 2]);
    bench.write(
        "claim.nrrd",
        &gzip_nrrd(
            "type: uint8\ndimension: 3\nsizes: 100000 100000 100000",
            &[0; 64],
        ),
    );
    assert_one_line(&bench, "volsplat cut.nrrd -o out/a.png", "cut.nrrd");
    assert_one_line(&bench, "volsplat claim.nrrd -o out/a.png", "claim.nrrd");
    assert_one_line(
        &bench,
        &format!("volsplat whole.nrrd {BALL} -o out/a.png"),
        "whole.nrrd",
    );
}

#[test]
fn nan_is_refused_unless_it_is_given_a_value() {
    let bench = Bench::new();
    let voxels: Vec<u8> = [0.0, 1.0, f32::NAN, 0.5]
        .repeat(16)
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    bench.write("nan.raw", &voxels);
    let words = "volsplat nan.raw --dims 4,4,4 --type f32 --size 16x16 -o out/a.png";
    assert_one_line(&bench, words, "nan.raw");
    let output = bench.run(&format!("{words} --nan-as 0"));
    assert_eq!(
        output.status.code(),
        Some(0),
        "--nan-as makes it usable: {}",
        stderr(&output)
    );
}

#[test]
fn places_that_cannot_be_written_are_refused_before_rendering() {
    let bench = Bench::new();
    let refused = |words: &str, named: &str| {
        assert_one_line(&bench, &format!("volsplat ball.raw {BALL} {words}"), named);
    };
    refused("-o absent/a.png", "absent/a.png");
    refused("-o out/a.bmp", "out/a.bmp");
    refused("-o out/a", "out/a");
    refused("-o out", "out");
    refused("-o out/a.exr --bits 16", "out/a.exr");
    refused("-o out/a.png --stats absent/s.json", "absent/s.json");
    refused("-o out/a.png --stats ball.raw", "ball.raw");
    refused("-o out/%04d_%04d.png", "out/%04d_%04d.png");
    assert_eq!(
        std::fs::read(bench.path("ball.raw")).expect("there"),
        super::ball(),
        "the input is untouched"
    );
}

#[test]
fn bad_camera_files_are_refused() {
    let bench = Bench::new();
    let refused = |content: &str, part: &str| {
        bench.write("cam.json", content.as_bytes());
        let words = format!("volsplat ball.raw {BALL} --camera cam.json -o out/a.png");
        assert_one_line(&bench, &words, "cam.json");
        assert_one_line(&bench, &words, part);
    };
    let look_at = r#""position": [0, 0, 99], "target": [0, 0, 0], "up": [0, 1, 0]"#;
    let lens = r#""width": 64, "height": 64, "fx": 64, "fy": 64, "cx": 32, "cy": 32"#;
    refused(&format!("{{{look_at}, \"fov\": 30}}"), "\"fov\"");
    refused(
        &format!("[{{{look_at}}}, {{{look_at}, \"roll\": 3}}]"),
        "camera 1",
    );
    refused(
        &format!("{{{lens}, \"R\": [1, 0, 0, 0, 1, 0, 0, 0, 2], \"t\": [0, 0, 9]}}"),
        "rotation",
    );
    refused(
        &format!("{{{lens}, \"R\": [-1, 0, 0, 0, 1, 0, 0, 0, 1], \"t\": [0, 0, 9]}}"),
        "rotation",
    );
    refused("{\"position\": [0, 0", "line 1");
    refused("[]", "no camera");
    let large = lens.replace(
        "\"width\": 64, \"height\": 64",
        "\"width\": 32768, \"height\": 32768",
    );
    refused(
        &format!("{{{large}, \"R\": [1, 0, 0, 0, 1, 0, 0, 0, 1], \"t\": [0, 0, 99]}}"),
        "32768x32768",
    );
    assert_one_line(
        &bench,
        &format!("volsplat ball.raw {BALL} --camera no.json -o out/a.png"),
        "no.json",
    );
}

#[test]
fn bad_transfer_files_are_refused() {
    let bench = Bench::new();
    for content in ["{", "[]", "{\"nonsense\": 1}", "3"] {
        bench.write("tf.json", content.as_bytes());
        let words = format!("volsplat ball.raw {BALL} --transfer tf.json -o out/a.png");
        assert_one_line(&bench, &words, "tf.json");
    }
    assert_refused(
        &bench,
        &format!("volsplat ball.raw {BALL} --colormap mauve -o out/a.png"),
        "mauve",
    );
}

#[test]
fn misspelt_options_are_refused_by_name() {
    let bench = Bench::new();
    for (words, named) in [
        ("--dim 3", "--dim"),
        ("--size 64x", "--size"),
        ("--size 0x64", "--size"),
        ("--fov 180", "--fov"),
        ("--orbit 30", "--orbit"),
        ("--orbit 0,91", "--orbit"),
        ("--up w", "--up"),
        ("--threads 0", "--threads"),
        ("--min-transmittance 1", "--min-transmittance"),
        ("--point-threshold nan", "the point threshold"),
        ("--background puce", "--background"),
        ("--bits 12", "--bits"),
        ("--kernel box", "--kernel"),
        ("--quiet --verbose", "--verbose"),
        ("--transfer a.json --colormap viridis", "--colormap"),
        ("--camera a.json --orbit 0,0", "--orbit"),
    ] {
        assert_refused(
            &bench,
            &format!("volsplat ball.raw {BALL} -o out/a.png {words}"),
            named,
        );
    }
    assert_refused(
        &bench,
        "volsplat ball.raw --dims 32,32,32 -o out/a.png",
        "--type",
    );
}

#[test]
fn options_of_another_order_are_refused() {
    let bench = Bench::new();
    let words = |options: &str| format!("volsplat ball.raw {BALL} -o out/a.png {options}");
    assert_one_line(&bench, &words("--order field --select splats"), "--select");
    assert_one_line(&bench, &words("--order every-sample --slab 1"), "--slab");
    assert_one_line(
        &bench,
        &words("--order every-sample --classify post"),
        "--classify",
    );
    assert_one_line(&bench, &words("--order axis-sheets --slab 1"), "--slab");
    assert_one_line(&bench, &words("--footprint exact --slab 2"), "--footprint");
    assert_one_line(
        &bench,
        &words("--order image-sheets --cells mean"),
        "cells are classified before",
    );
    assert_one_line(
        &bench,
        &words("--order image-sheets --classify pre --cells split"),
        "means of whole cells",
    );
    assert_one_line(
        &bench,
        &words("--order every-sample --interpolate"),
        "--interpolate",
    );
    assert_refused(&bench, &words("--cells split:1"), "--cells");
    assert_refused(&bench, &words("--subpixels 3"), "--subpixels");
    assert_one_line(
        &bench,
        &words("--order every-sample --shade phong --labels"),
        "one channel of scalars",
    );
    assert_one_line(
        &bench,
        &words("--blend maximum --classify pre"),
        "--classify",
    );
    assert_one_line(
        &bench,
        &words("--blend maximum --shade phong"),
        "cannot be shaded",
    );
    assert_refused(&bench, &words("--shade phong --light 0,0,0"), "--light");
    assert_refused(&bench, &words("--shadows"), "--light");
    assert_one_line(
        &bench,
        &words("--blend maximum --light 1,0,0 --shadows"),
        "have no light",
    );
    assert_refused(&bench, &words("--occlusion=0"), "--occlusion");
    assert_one_line(
        &bench,
        &words("--iso 100 --iso-opacity 0.5 --occlusion"),
        "opacity 1",
    );
    assert_one_line(
        &bench,
        &words("--iso 100 --iso-opacity 0.5 --light 1,0,0 --shadows"),
        "opacity 1",
    );
    bench.write("slice.raw", &[200; 64]);
    let slice = "volsplat slice.raw --dims 8,8,1 --type u8 --order field -o out/a.png";
    assert_one_line(&bench, slice, "slice.raw");
}
