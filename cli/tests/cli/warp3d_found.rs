//! `resample warp3d` on depth and cameras as people have them: sequences, other sizes, no units, layouts, panoramas.

use super::bad_input::assert_one_line;
use super::warp3d::{SIZE, VIEW, bench, panel_start, pfm_of};
use super::{Bench, assert_good, read_png, stderr};

/// Three frames of the test picture, taken 0.2 units apart; the panel moves by 3 px a frame.
fn frames() -> Bench {
    let bench = bench();
    let picture = std::fs::read(bench.path("im.png")).expect("the test picture");
    let depth = std::fs::read(bench.path("z.pfm")).expect("its depth");
    let mut log = String::new();
    let mut times = ["", "", ""].map(str::to_owned);
    for number in 0..3 {
        bench.write(&format!("c_{number:03}.png"), &picture);
        bench.write(&format!("z_{number:03}.pfm"), &depth);
        let x = 0.2 * f64::from(number);
        log += &format!("{number} {number} 3\n1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
        bench.write(
            &format!("pose-{number:03}.txt"),
            format!("1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n").as_bytes(),
        );
        let time = 100.0 + 0.04 * f64::from(number);
        times[0] += &format!("{time} c_{number:03}.png\n");
        times[1] += &format!("{} z_{number:03}.pfm\n", time + 0.007);
        times[2] += &format!("{} {x} 0 0 0 0 0 1\n", time - 0.009);
    }
    bench.write("poses.log", log.as_bytes());
    for (name, text) in ["rgb.txt", "depth.txt", "groundtruth.txt"]
        .iter()
        .zip(times)
    {
        bench.write(name, text.as_bytes());
    }
    bench
}

const LENS: &str = "--intrinsics 30,30,15.5,11.5 --method nearest";

/// Columns at which the panel begins in the pictures of a run.
fn panels(bench: &Bench, words: &str) -> Vec<Option<usize>> {
    assert_good(&bench.run(&format!("{words} {LENS} -o out/a.png")));
    bench
        .written()
        .iter()
        .map(|name| {
            let (width, _, bytes) = read_png(&bench.path(&format!("out/{name}")));
            panel_start(&bytes, width as usize, 12)
        })
        .collect()
}

#[test]
fn a_sequence_takes_each_picture_from_its_own_camera() {
    let bench = frames();
    // The same picture from 0, 0.2 and 0.4: seen from 0.2, the panel is 3 px to the left, as it is, 3 px to the right.
    let expected = [Some(7), Some(10), Some(13)];
    for sequence in [
        "c_%03d.png z_%03d.pfm --from poses.log",
        "c_%03d.png z_%03d.pfm --from pose-%03d.txt",
        "rgb.txt depth.txt --from groundtruth.txt",
    ] {
        let found = panels(&bench, &format!("warp3d {sequence} --to poses.log#1"));
        assert_eq!(found, expected, "{sequence}");
    }
    let stabilised = panels(
        &bench,
        "warp3d c_%03d.png z_%03d.pfm --from poses.log --to poses.log",
    );
    assert_eq!(stabilised, [Some(10); 3], "each from its own camera");
    let moved = panels(&bench, "warp3d c_%03d.png z_%03d.pfm --to shift:0.2,0,0");
    assert_eq!(moved, [Some(7); 3], "a camera that stands");
}

#[test]
fn a_sequence_becomes_stereo_and_goes_on_where_it_stopped() {
    let bench = frames();
    let words = format!(
        "warp3d c_%03d.png z_%03d.pfm {LENS} --from poses.log --stereo 0.1 --layout half-side-by-side -o out/s.png"
    );
    assert_good(&bench.run(&words));
    assert_eq!(bench.written(), ["s_0000.png", "s_0001.png", "s_0002.png"]);
    let last = std::fs::read(bench.path("out/s_0002.png")).expect("written");
    std::fs::remove_file(bench.path("out/s_0002.png")).expect("written before");
    assert!(stderr(&bench.run(&format!("{words} --resume"))).contains("2 of 3 pictures"));
    let again = std::fs::read(bench.path("out/s_0002.png")).expect("drawn again");
    assert_eq!(again, last, "the third picture again, from the third frame");
}

#[test]
fn sequences_that_do_not_fit_together_are_refused() {
    let bench = frames();
    bench.write("none.txt", b"900 c_000.png\n");
    let refused = |words: &str, named: &str| {
        assert_one_line(
            &bench,
            &format!("warp3d {words} {LENS} -o out/a.png"),
            named,
        );
    };
    refused(
        "c_%03d.png z.pfm --to shift:0.1,0,0",
        "one depth for several pictures",
    );
    refused(
        "x_%03d.png z_%03d.pfm --to shift:0.1,0,0",
        "no file has such a name",
    );
    refused(
        "none.txt depth.txt --to shift:0.1,0,0",
        "depth of their number or time",
    );
    refused("c_%03d.png z_%03d.pfm --sway 3", "--sway");
    refused(
        "c_%03d.png z_%03d.pfm --to shift:0.1,0,0 --filled out/f.png",
        "--filled",
    );
}

#[test]
fn a_sequence_without_some_poses_says_what_it_leaves_out() {
    let bench = frames();
    bench.write(
        "two.txt",
        b"99.991 0 0 0 0 0 0 1\n100.031 0.2 0 0 0 0 0 1\n",
    );
    let words =
        format!("warp3d rgb.txt depth.txt {LENS} --from two.txt --to shift:0,0,0 -o out/a.png");
    let output = bench.run(&words);
    assert_good(&output);
    assert!(
        stderr(&output).contains("1 of 3 pictures are left out"),
        "{}",
        stderr(&output)
    );
    assert_eq!(bench.written().len(), 2);
}

#[test]
fn layouts_have_their_sizes_and_need_their_views() {
    let bench = bench();
    for (words, size) in [
        ("--stereo 0.1 --layout side-by-side", (64, 24)),
        ("--stereo 0.1 --layout cross-eye", (64, 24)),
        ("--stereo 0.1 --layout half-side-by-side", (32, 24)),
        ("--stereo 0.1 --layout top-bottom", (32, 48)),
        ("--stereo 0.1 --layout half-top-bottom", (32, 24)),
        ("--layout colour-and-depth", (64, 24)),
        ("--layout equirectangular --size 80x40", (80, 40)),
    ] {
        assert_good(&bench.run(&format!("{VIEW} {words} -o out/a.png")));
        let (width, height, _) = read_png(&bench.path("out/a.png"));
        assert_eq!((width, height), size, "{words}");
    }
    std::fs::remove_file(bench.path("out/a.png")).expect("written");
    assert_one_line(
        &bench,
        &format!("{VIEW} --layout top-bottom -o out/a.png"),
        "--stereo",
    );
    let both = format!("{VIEW} --stereo 0.1 --layout colour-and-depth -o out/a.png");
    assert_one_line(&bench, &both, "leave --stereo out");
}

#[test]
fn depth_of_half_the_size_shows_the_same_panel() {
    let bench = bench();
    let panel = |x: usize, y: usize| (5..10).contains(&x) && (4..8).contains(&y);
    let z = |x: usize, y: usize| if panel(x, y) { 2.0 } else { 4.0 };
    bench.write("half.pfm", &pfm_of([SIZE[0] / 2, SIZE[1] / 2], z));
    let words =
        |depth: &str| format!("warp3d im.png {depth} {LENS} --to shift:0.2,0,0 -o out/a.png");
    let bytes = |depth: &str| {
        assert_good(&bench.run(&words(depth)));
        read_png(&bench.path("out/a.png")).2
    };
    assert_eq!(
        bytes("half.pfm"),
        bytes("z.pfm"),
        "edges where the colours change"
    );
}

#[test]
fn relative_depth_needs_no_unit_and_says_so() {
    let bench = bench();
    bench.write("near.pfm", &pfm_of(SIZE, |_, y| 1.0 + y as f32));
    bench.write("far.pfm", &pfm_of(SIZE, |_, y| 30.0 - y as f32));
    let words = |depth: &str| {
        format!("warp3d im.png {depth} --depth-kind relative --from fov:50 --sway 3,2 -o out/a.png")
    };
    let said = |depth: &str| {
        let output = bench.run(&words(depth));
        assert_good(&output);
        stderr(&output)
    };
    assert!(
        said("near.pfm").contains("between 1 and 10"),
        "a note on the scale"
    );
    assert!(
        said("far.pfm").contains("if larger numbers are farther"),
        "a note on its direction"
    );
}

#[test]
fn a_panorama_is_seen_from_a_pinhole_and_as_a_panorama() {
    let bench = bench();
    bench.write("ball.pfm", &pfm_of(SIZE, |_, _| 3.0));
    for (words, size) in [
        ("--to fov:70 --size 40x30", (40, 30)),
        ("--layout equirectangular --size 32x16", (32, 16)),
    ] {
        let words = format!("warp3d im.png ball.pfm --from equirectangular {words} -o out/a.png");
        assert_good(&bench.run(&words));
        let (width, height, bytes) = read_png(&bench.path("out/a.png"));
        assert_eq!((width, height), size);
        assert!(
            bytes.chunks(4).all(|pixel| pixel[3] == 255),
            "every direction was seen"
        );
    }
    let disparity = "warp3d im.png ball.pfm --from equirectangular --depth-kind disparity --baseline 1 --to fov:70 -o out/a.png";
    std::fs::remove_file(bench.path("out/a.png")).expect("written");
    assert_one_line(&bench, disparity, "a panorama has no disparity");
}
