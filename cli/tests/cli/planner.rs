//! `--max-error`, `--max-time`, `--explain` and `calibrate`: promises are kept and can be repeated.

use std::fs;

use serde_json::Value;

use super::{BALL, Bench, stderr};

fn json(bench: &Bench, name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(bench.path(name)).expect("a file")).expect("JSON")
}

/// Writes the mesh that the tests draw, and a picture with depth: a wall at z = 4 before which a panel stands at z = 2.
fn with_scenes() -> Bench {
    let bench = Bench::new();
    bench.write(
        "quad.obj",
        b"v -1 -1 0\nv 1 -1 0\nv 1 1 0.4\nv -1 1 -0.4\nf 1 2 3 4\n",
    );
    let panel = |x: usize, y: usize| (20..40).contains(&x) && (14..34).contains(&y);
    let pixels: Vec<[usize; 2]> = (0..64 * 48).map(|i| [i % 64, i / 64]).collect();
    let colour = |x: usize, y: usize| {
        let odd = (x / 3 + y / 3) % 2 == 1;
        if panel(x, y) {
            [220, 40 * u8::from(odd), 40]
        } else {
            [(x * 3) as u8, (y * 5) as u8, 90]
        }
    };
    let rgb: Vec<u8> = pixels.iter().flat_map(|&[x, y]| colour(x, y)).collect();
    bench.write("im.ppm", &[b"P6\n64 48\n255\n".to_vec(), rgb].concat());
    let mut depth = b"Pf\n64 48\n-1\n".to_vec();
    for y in (0..48).rev() {
        depth.extend((0..64).flat_map(|x| (if panel(x, y) { 2.0_f32 } else { 4.0 }).to_le_bytes()));
    }
    bench.write("z.pfm", &depth);
    bench
}

/// Pictures of the sequences: enough of them that a look at three pays.
const FRAMES: usize = 64;

/// A sequence: its name, its words, and a narrow and a wide bound.
type Sequence = (&'static str, String, [&'static str; 2]);

fn sequences() -> [Sequence; 3] {
    let turntable = format!("--size 48x48 --turntable {FRAMES}");
    [
        (
            "ball",
            format!("volsplat ball.raw {BALL} {turntable}"),
            ["1/255", "1/40"],
        ),
        (
            "quad",
            format!("texmap quad.obj {turntable}"),
            ["1/255", "1/20"],
        ),
        (
            "panel",
            format!("warp3d im.ppm z.pfm --intrinsics 60,60,31.5,23.5 --sway 4 --frames {FRAMES}"),
            ["1/100", "1/12"],
        ),
    ]
}

#[test]
fn the_error_stays_under_the_bound_in_every_frame() {
    let bench = with_scenes();
    for (scene, words, bounds) in sequences() {
        let mut costs = Vec::new();
        for bound in bounds {
            let planned = keeps(&bench, (scene, &words), bound);
            costs.push(planned["predicted_ms"].as_f64().expect("a cost"));
            if bound == bounds[1] {
                assert_ne!(
                    planned["setting"], planned["exact_setting"],
                    "{scene}: {bound} saves something"
                );
            }
        }
        assert!(
            costs[1] <= costs[0],
            "{scene}: a wider bound costs no more: {costs:?}"
        );
    }
}

/// Draws a sequence under a bound and under the exact setting, compares every picture, and gives what was planned.
fn keeps(bench: &Bench, (scene, words): (&str, &str), bound: &str) -> Value {
    let command = format!("{words} -o out/{scene}-%02d.exr --stats out/s.json --max-error {bound}");
    let output = bench.run(&command);
    assert_eq!(
        output.status.code(),
        Some(0),
        "{command}: {}",
        stderr(&output)
    );
    let planned = json(bench, "out/s.json")["planned"].clone();
    let (allowed, predicted) = (
        planned["bound"].as_f64(),
        planned["predicted_error"].as_f64(),
    );
    assert!(
        predicted <= allowed && planned["kept"] == true,
        "{scene}: {bound} is predicted: {planned}"
    );
    let exact = planned["exact_setting"].as_str().expect("words");
    if !bench
        .path("out")
        .join(format!("{scene}-exact-00.exr"))
        .exists()
    {
        let output = bench.run(&format!("{words} -o out/{scene}-exact-%02d.exr {exact}"));
        assert_eq!(
            output.status.code(),
            Some(0),
            "the exact setting is words: {}",
            stderr(&output)
        );
    }
    let limit = allowed.expect("a number");
    for frame in 0..FRAMES {
        let pair = format!("out/{scene}-{frame:02}.exr out/{scene}-exact-{frame:02}.exr");
        let output = bench.run(&format!(
            "compare {pair} --inside --fail-above rmse={limit}"
        ));
        assert_eq!(
            output.status.code(),
            Some(0),
            "{scene}, frame {frame}, {bound}: {}",
            stderr(&output)
        );
    }
    planned
}

#[test]
fn a_run_that_planning_cannot_help_takes_the_exact_setting_at_once() {
    let bench = with_scenes();
    for words in [
        "texmap quad.obj --size 96x96",
        "texmap quad.obj --size 48x48 --turntable 4",
    ] {
        let command =
            format!("{words} -o out/a%02d.exr --stats out/s.json --max-error 1/255 --explain");
        let output = bench
            .run(&command.replace("a%02d", if words.contains("turn") { "a%02d" } else { "a" }));
        assert_eq!(
            output.status.code(),
            Some(0),
            "{words}: {}",
            stderr(&output)
        );
        let told = stderr(&output);
        assert!(
            told.contains("costs more than it can save"),
            "{words}: the reason is told: {told}"
        );
        let planned = &json(&bench, "out/s.json")["planned"];
        assert_eq!(planned["setting"], planned["exact_setting"], "{words}");
        assert_eq!(planned["predicted_error"], 0.0, "{words}: nothing is lost");
    }
}

#[test]
fn the_explained_command_repeats_the_picture() {
    let bench = Bench::new();
    let output =
        bench.draw("--size 48x48 --turntable 64 -o out/a%02d.png --max-error 1/40 --explain");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = stderr(&output);
    assert!(
        text.contains("pilot:") && text.contains("times as long"),
        "what was tried is told: {text}"
    );
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("again without planning: resample "));
    let again = line.expect("the command").replace("out/a", "out/b");
    assert!(
        !again.contains("--max-error") && !again.contains("--explain"),
        "no planning: {again}"
    );
    assert_eq!(bench.run(&again).status.code(), Some(0), "{again}");
    let bytes = |name: &str| fs::read(bench.path(name)).expect("a picture");
    assert!(
        bytes("out/a07.png") == bytes("out/b07.png"),
        "the same picture to the byte"
    );
}

#[test]
fn what_was_typed_is_kept() {
    let bench = Bench::new();
    let output =
        bench.draw("--size 48x48 -o out/a.png --slab 1 --max-error 1/100 --stats out/s.json");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let stats = json(&bench, "out/s.json");
    assert_eq!(
        stats["settings"]["render"]["order"]["field"]["slab_voxels"],
        1.0
    );
    assert!(
        !stats["planned"]["setting"]
            .as_str()
            .expect("words")
            .contains("--slab"),
        "not chosen: {stats}"
    );
}

#[test]
fn a_time_is_predicted_from_a_calibration_of_this_machine() {
    let bench = Bench::new();
    let output = bench.run("calibrate --reps 1 -o out/calibration.json");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let model = &json(&bench, "out/calibration.json")["model"]["cpu_ms"];
    let paths = model.as_object().expect("an object");
    assert!(
        paths.len() >= 14,
        "every way of drawing is measured: {}",
        paths.len()
    );
    assert!(
        paths
            .values()
            .flat_map(|c| c.as_array().expect("a list"))
            .all(|c| c.as_f64().is_some_and(|c| c >= 0.0)),
        "no cost is negative"
    );
    let cheap = bench.draw("--size 48x48 -o out/a.png --max-time 0.001ms --stats out/s.json");
    assert_eq!(
        cheap.status.code(),
        Some(0),
        "a time that cannot be kept is no error: {}",
        stderr(&cheap)
    );
    assert!(
        stderr(&cheap).contains("warning: no setting is predicted"),
        "but said: {}",
        stderr(&cheap)
    );
    assert_eq!(json(&bench, "out/s.json")["planned"]["kept"], false);
    let rich = bench.draw("--size 48x48 -o out/b.png --max-time 100s --stats out/s.json");
    assert_eq!(rich.status.code(), Some(0), "{}", stderr(&rich));
    let planned = &json(&bench, "out/s.json")["planned"];
    assert_eq!(
        planned["setting"], planned["exact_setting"],
        "with time enough the exact setting is taken"
    );
}

#[test]
fn bad_requests_are_refused_in_one_line() {
    let bench = Bench::new();
    for (words, expected) in [
        ("-o out/a.png --explain", "nothing to explain"),
        ("-o out/a.png --max-error 0", "expected a number above 0"),
        ("-o out/a.png --max-time soon", "expected a time"),
        (
            "-o out/a.png --max-error 1/255 --max-time 5ms",
            "cannot be used with",
        ),
    ] {
        let output = bench.draw(words);
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(
            stderr(&output).contains(expected),
            "{words}: {}",
            stderr(&output)
        );
        assert!(bench.written().is_empty(), "{words}: nothing is written");
    }
}
