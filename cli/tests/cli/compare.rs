//! `resample compare`: figures, bounds and what is refused.

use serde_json::Value;

use super::{Bench, assert_good, read_png, stderr};

/// Two pictures that differ a little, and one equal to the first.
fn bench() -> Bench {
    let bench = Bench::new();
    for (name, orbit) in [("a", "10,20"), ("b", "10,20,1.2"), ("same", "10,20")] {
        assert_good(&bench.draw(&format!("--size 32x24 --orbit {orbit} -o out/{name}.png")));
    }
    bench
}

fn json(bench: &Bench, words: &str) -> Value {
    let output = bench.run(&format!("compare {words} --json"));
    assert_eq!(
        output.status.code(),
        Some(0),
        "`{words}`: {}",
        stderr(&output)
    );
    serde_json::from_slice(&output.stdout).expect("JSON on stdout")
}

#[test]
fn equal_pictures_have_no_error_and_others_have() {
    let bench = bench();
    let equal = json(&bench, "out/a.png out/same.png");
    assert_eq!(equal["pictures"][0]["rmse"], 0.0);
    assert_eq!(equal["pictures"][0]["psnr"], Value::Null, "infinite");
    assert_eq!(equal["pictures"][0]["ssim"], 1.0);
    let other = json(&bench, "out/a.png out/b.png");
    let rmse = other["pictures"][0]["rmse"].as_f64().expect("a number");
    assert!(rmse > 1e-3, "the views differ: {rmse}");
    assert_eq!(other["pictures"][0]["pixels"], 32 * 24);
    let inside = json(&bench, "out/a.png out/b.png --inside");
    assert!(
        inside["pictures"][0]["pixels"].as_u64().expect("a count") < 32 * 24,
        "fewer pixels"
    );
    assert!(
        inside["pictures"][0]["rmse"].as_f64().expect("a number") > rmse,
        "errors lie inside"
    );
}

#[test]
fn a_broken_bound_exits_with_1_and_says_which() {
    let bench = bench();
    let good = bench.run("compare out/a.png out/same.png --fail-above rmse=0 --fail-above psnr=99");
    assert_eq!(
        good.status.code(),
        Some(0),
        "equal pictures hold every bound: {}",
        stderr(&good)
    );
    for bound in ["rmse=0.0001", "psnr=90", "flip=0"] {
        let output = bench.run(&format!("compare out/a.png out/b.png --fail-above {bound}"));
        assert_eq!(
            output.status.code(),
            Some(1),
            "{bound}: {}",
            stderr(&output)
        );
        let name = bound.split('=').next().expect("a name");
        assert!(
            stderr(&output).contains(&format!("{name} is ")),
            "{bound}: {}",
            stderr(&output)
        );
    }
}

#[test]
fn animations_are_compared_picture_by_picture() {
    let bench = Bench::new();
    assert_good(&bench.draw("--size 16x16 --turntable 3 -o out/a.apng"));
    assert_good(&bench.draw("--size 16x16 --turntable 3 -o out/f.png"));
    assert_good(&bench.draw("--size 16x16 --turntable 3 --orbit 30,20,1.2 -o out/g.png"));
    let same = json(&bench, "out/a.apng out/f_%04d.png");
    assert_eq!(
        same["pictures"].as_array().expect("a list").len(),
        3,
        "three pictures"
    );
    assert_eq!(
        same["flicker"], 0.0,
        "the same pictures in two kinds of files"
    );
    let other = json(&bench, "out/g_%04d.png out/a.apng");
    assert!(
        other["flicker"].as_f64().expect("a number") > 0.0,
        "the views differ"
    );
    let short = bench.run("compare out/a.apng out/f_0000.png");
    assert_eq!(short.status.code(), Some(2));
    assert!(
        stderr(&short).contains("out/f_0000.png: has fewer pictures than out/a.apng"),
        "{}",
        stderr(&short)
    );
}

#[test]
fn the_heat_map_is_dark_where_nothing_differs() {
    let bench = bench();
    let output = bench.run("compare out/a.png out/b.png --heatmap out/heat.png");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let (width, height, bytes) = read_png(&bench.path("out/heat.png"));
    assert_eq!((width, height), (32, 24));
    let light = |pixel: &[u8]| pixel[..3].iter().map(|&c| u32::from(c)).sum::<u32>();
    let pixels: Vec<u32> = bytes.chunks(4).map(light).collect();
    assert!(
        pixels[0] < 20,
        "the corner shows nothing in either: {}",
        pixels[0]
    );
    assert!(pixels.iter().any(|&p| p > 100), "somewhere they differ");
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let bench = bench();
    assert_good(&bench.draw("--size 16x16 -o out/small.png"));
    bench.write("out/text.png", b"no picture");
    for (words, part) in [
        ("out/a.png out/small.png", "one size"),
        ("out/a.png out/text.png", "out/text.png"),
        ("out/a.png out/absent.png", "out/absent.png"),
        (
            "out/a.png out/b.png --fail-above sharpness=1",
            "no such figure",
        ),
        ("out/a.png out/b.png --fail-above flip", "METRIC=VALUE"),
        (
            "out/a.png out/b.png --fail-above flicker=1",
            "does not flicker",
        ),
        ("out/a.png out/b.png --heatmap out/a.png", "out/a.png"),
    ] {
        let output = bench.run(&format!("compare {words}"));
        assert_eq!(
            output.status.code(),
            Some(2),
            "`{words}` is refused: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains(part),
            "`{words}` says {part}: {}",
            stderr(&output)
        );
    }
}
