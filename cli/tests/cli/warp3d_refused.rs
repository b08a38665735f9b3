//! `resample warp3d` refuses bad input in one line, before it writes anything.

use std::io::Write;

use super::bad_input::{assert_one_line, assert_refused};
use super::warp3d::{SIZE, VIEW, bench, pfm_of};
use super::{assert_good, stderr};

#[test]
fn bad_input_is_refused_in_one_line() {
    let bench = bench();
    bench.write("small.pfm", &pfm_of([16, 24], |_, _| 2.0));
    bench.write("none.pfm", &pfm_of(SIZE, |_, _| f32::NAN));
    bench.write("cut.pfm", &pfm_of(SIZE, |_, _| 2.0)[..500]);
    bench.write("poses.log", b"0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    bench.write("scaled.log", b"0 0 1\n2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n");
    let k = "\"W\": 32, \"H\": 24, \"fx\": -30, \"fy\": 30, \"cx\": 15, \"cy\": 11";
    bench.write(
        "negative.json",
        format!("{{\"a\": {{{k}, \"R\": [1,0,0,0,1,0,0,0,1], \"t\": [0,0,0]}}}}").as_bytes(),
    );
    let lens = "--intrinsics 30,30,15.5,11.5";
    let to = "--to shift:0.1,0,0 -o out/a.png";
    let refused =
        |words: &str, named: &str| assert_one_line(&bench, &format!("warp3d {words} {to}"), named);
    refused(&format!("im.png small.pfm {lens}"), "16x24");
    refused(
        &format!("im.png none.pfm {lens}"),
        "no pixel has a usable depth",
    );
    refused(&format!("im.png cut.pfm {lens}"), "cut.pfm");
    refused(&format!("im.png absent.pfm {lens}"), "absent.pfm");
    refused(&format!("im.png im.png {lens}"), "one number per pixel");
    refused(&format!("im.png z.pfm:Z {lens}"), "z.pfm");
    refused(&format!("z.pfm z.pfm {lens}"), "z.pfm");
    refused("im.png z.pfm", "--from");
    refused("im.png z.pfm --from cameras.json", "cameras.json");
    refused("im.png z.pfm --from cameras.json#targets/7", "targets/7");
    refused("im.png z.pfm --from cameras.json#7", "cameras.json");
    refused("im.png z.pfm --from poses.log#0", "intrinsics");
    refused(
        &format!("im.png z.pfm {lens} --from scaled.log#0"),
        "rotation",
    );
    refused(
        &format!("im.png z.pfm {lens} --from poses.log#5"),
        "poses.log",
    );
    refused("im.png z.pfm --from negative.json#a", "focal length");
    refused("im.png z.pfm --from shift:1,0,0", "shift");
    refused(
        &format!("im.png z.pfm {lens} --depth-kind disparity"),
        "the baseline",
    );
    refused(
        &format!("im.png z.pfm {lens} --depth-kind mpeg"),
        "--near and --far",
    );
    refused(
        &format!("im.png z.pfm {lens} --depth-kind opengl --near 5 --far 1"),
        "near < far",
    );
}

#[test]
fn a_fault_of_the_depth_names_the_depth_once_and_no_picture() {
    let bench = bench();
    let words = "warp3d im.png z.pfm --intrinsics 30,30,15.5,11.5 --depth-scale 1e60 --to shift:0.1,0,0 -o out/a.png";
    assert_one_line(&bench, words, "no pixel has a usable depth");
    let said = stderr(&bench.run(words));
    assert_eq!(said.matches("z.pfm").count(), 1, "{said}");
    assert_eq!(said.matches("im.png").count(), 0, "{said}");
}

#[test]
fn words_that_contradict_each_other_are_refused() {
    let bench = bench();
    let refused =
        |words: &str, named: &str| assert_refused(&bench, &format!("{VIEW} {words}"), named);
    refused("-o out/a.png", "--to");
    refused(
        "--to cameras.json -o out/a.png --filled out/m.png",
        "--filled",
    );
    refused("--to shift:0,0,0 -o out/a.bmp", "out/a.bmp");
    refused(
        "--to shift:0,0,0 -o out/a.png --filled out/m.gif",
        "out/m.gif",
    );
    refused(
        "--to shift:0,0,0 -o out/a.png --filled out/a.png",
        "out/a.png",
    );
    refused("--to shift:0,0,0 -o im.png", "im.png");
    refused("--stereo 0 -o out/a.png", "--stereo");
    refused("--stereo 0.1 --quilt 2x2 -o out/a.png", "--quilt");
    refused("--anaglyph --to shift:0,0,0 -o out/a.png", "--stereo");
    refused("--quilt 1x1 -o out/a.png", "--quilt");
    refused(
        "--quilt 2x2 --convergence inf -o out/a.png",
        "--convergence",
    );
    refused("--to fov:0 -o out/a.png", "--to");
    refused("--to shift:0,0,0 --size 0x9 -o out/a.png", "--size");
    refused("--to cameras.json --sway 3 -o out/a.png", "--sway");
    refused("--to shift:0,0,0 --near 1 -o out/a.png", "--far");
    refused(
        "--to shift:0,0,0 --visibility occlusion-order -o out/a.png",
        "visibility",
    );
}

#[test]
fn a_limit_of_memory_is_kept_before_anything_is_read() {
    const SIDE: usize = 16_384;
    let bench = bench();
    let mut large = Vec::new();
    let mut encoder = png::Encoder::new(&mut large, SIDE as u32, SIDE as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().expect("in memory");
    let mut rows = writer.stream_writer().expect("in memory");
    let row = vec![128; SIDE];
    (0..SIDE).for_each(|_| rows.write_all(&row).expect("in memory"));
    rows.finish().expect("in memory");
    drop(writer);
    bench.write("large.png", &large);
    let lens = "--intrinsics 9000,9000,8192,8192 --to shift:0.1,0,0 -o out/a.png";
    let words = format!("warp3d large.png absent.pfm {lens} --max-memory");
    assert_one_line(
        &bench,
        &format!("{words} 4G --max-error rms:0.01"),
        "16384x16384",
    );
    // The picture is not unpacked for a depth that is not there.
    assert_one_line(&bench, &format!("{words} 16G"), "absent.pfm");
    assert_one_line(&bench, &format!("{words} 64M"), "64 MiB are allowed");
    assert_one_line(&bench, &format!("{words} 4G"), "MiB are allowed");
    assert_good(&bench.run(&format!(
        "{VIEW} --to shift:0.1,0,0 -o out/b.png --max-memory 64M"
    )));
}

#[test]
fn rows_and_stereo_photographs_need_a_pair() {
    let bench = bench();
    let refused = |words: &str, named: &str| {
        assert_one_line(&bench, &format!("warp3d im.png z.pfm {words}"), named)
    };
    let lens = "--intrinsics 30,30,15.5,11.5";
    refused(
        &format!("{lens} --method rows --to shift:0,0.1,0 -o out/a.png"),
        "use the method hybrid",
    );
    for words in [
        "--to shift:0.1,0,0 -o out/a.mpo",
        "--stereo 0.1 --layout half-side-by-side -o out/a.mpo",
        "--stereo 0.1 --anaglyph -o out/a.jps",
        "--stereo 0.1 -o out/a.png --filled out/b.mpo",
    ] {
        refused(&format!("{lens} {words}"), "stereo photograph");
    }
    assert_one_line(&bench, "texmap cube.obj -o out/a.mpo", "stereo photograph");
}
