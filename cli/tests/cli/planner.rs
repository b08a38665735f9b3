//! `--max-error`, `--max-time`, `--explain` and `calibrate`: what is promised is kept, and can be repeated.

use std::fs;

use serde_json::Value;

use super::{BALL, Bench, stderr};

fn json(bench: &Bench, name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(bench.path(name)).expect("a file")).expect("JSON")
}

/// Writes the mesh and the picture with depth that the tests draw.
fn with_scenes() -> Bench {
    let bench = Bench::new();
    bench.write("quad.obj", b"v -1 -1 0\nv 1 -1 0\nv 1 1 0.4\nv -1 1 -0.4\nf 1 2 3 4\n");
    bench
}

#[test]
fn the_error_stays_under_the_bound_in_every_frame() {
    let bench = with_scenes();
    for (scene, words, bounds) in [
        ("ball", format!("volsplat ball.raw {BALL} --size 64x64"), ["1/255", "1/40"]),
        ("quad", "texmap quad.obj --size 64x64".to_owned(), ["1/255", "1/20"]),
    ] {
        let mut costs = Vec::new();
        for bound in bounds {
            let command = format!(
                "{words} --turntable 4 -o out/{scene}-%02d.exr --stats out/s.json --max-error {bound}"
            );
            let output = bench.run(&command);
            assert_eq!(output.status.code(), Some(0), "{command}: {}", stderr(&output));
            let planned = &json(&bench, "out/s.json")["planned"];
            let (allowed, predicted) = (planned["bound"].as_f64(), planned["predicted_error"].as_f64());
            assert!(
                predicted <= allowed && planned["kept"] == true,
                "{scene}: the prediction keeps {bound}: {planned}"
            );
            costs.push(planned["predicted_ms"].as_f64().expect("a cost"));
            let exact = planned["exact_setting"].as_str().expect("words");
            let output = bench.run(&format!("{words} --turntable 4 -o out/exact-%02d.exr {exact}"));
            assert_eq!(output.status.code(), Some(0), "the exact setting is words: {}", stderr(&output));
            for frame in 0..4 {
                let limit = allowed.expect("a number");
                let compare = format!(
                    "compare out/{scene}-{frame:02}.exr out/exact-{frame:02}.exr --inside --fail-above rmse={limit}"
                );
                let output = bench.run(&compare);
                assert_eq!(
                    output.status.code(),
                    Some(0),
                    "{scene}, frame {frame}, {bound}: {}",
                    stderr(&output)
                );
            }
        }
        assert!(costs[1] <= costs[0], "{scene}: a wider bound costs no more: {costs:?}");
    }
}

#[test]
fn the_explained_command_repeats_the_picture() {
    let bench = Bench::new();
    let output = bench.draw("--size 48x48 -o out/a.png --max-error max:1/200 --explain");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = stderr(&output);
    assert!(text.contains("pilot:") && text.contains("times as long"), "what was tried is told: {text}");
    let line = text.lines().find_map(|line| line.strip_prefix("again without planning: resample "));
    let again = line.expect("the command").replace("out/a.png", "out/b.png");
    assert!(!again.contains("--max-error") && !again.contains("--explain"), "no planning: {again}");
    assert_eq!(bench.run(&again).status.code(), Some(0), "{again}");
    let bytes = |name: &str| fs::read(bench.path(name)).expect("a picture");
    assert!(bytes("out/a.png") == bytes("out/b.png"), "the same picture to the byte");
}

#[test]
fn what_was_typed_is_kept() {
    let bench = Bench::new();
    let output = bench.draw("--size 48x48 -o out/a.png --slab 1 --max-error 1/100 --stats out/s.json");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let stats = json(&bench, "out/s.json");
    assert_eq!(stats["settings"]["render"]["slab_voxels"], 1.0);
    assert!(!stats["planned"]["setting"].as_str().expect("words").contains("--slab"), "not chosen: {stats}");
}

#[test]
fn a_time_is_predicted_from_a_calibration_of_this_machine() {
    let bench = Bench::new();
    let output = bench.run("calibrate --reps 1 -o out/calibration.json");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let model = &json(&bench, "out/calibration.json")["model"]["cpu_ms"];
    let paths = model.as_object().expect("an object");
    assert!(paths.len() > 30, "every way of drawing is measured: {}", paths.len());
    assert!(
        paths
            .values()
            .flat_map(|c| c.as_array().expect("a list"))
            .all(|c| c.as_f64().is_some_and(|c| c >= 0.0)),
        "no cost is negative"
    );
    let cheap = bench.draw("--size 48x48 -o out/a.png --max-time 0.001ms --stats out/s.json");
    assert_eq!(cheap.status.code(), Some(0), "a time that cannot be kept is no error: {}", stderr(&cheap));
    assert!(stderr(&cheap).contains("warning: no setting is predicted"), "but said: {}", stderr(&cheap));
    assert_eq!(json(&bench, "out/s.json")["planned"]["kept"], false);
    let rich = bench.draw("--size 48x48 -o out/b.png --max-time 100s --stats out/s.json");
    assert_eq!(rich.status.code(), Some(0), "{}", stderr(&rich));
    let planned = &json(&bench, "out/s.json")["planned"];
    assert_eq!(planned["setting"], planned["exact_setting"], "with time enough the exact setting is taken");
}

#[test]
fn bad_requests_are_refused_in_one_line() {
    let bench = Bench::new();
    for (words, expected) in [
        ("-o out/a.png --explain", "nothing to explain"),
        ("-o out/a.png --max-error 0", "expected a number above 0"),
        ("-o out/a.png --max-time soon", "expected a time"),
        ("-o out/a.png --max-error 1/255 --max-time 5ms", "cannot be used with"),
    ] {
        let output = bench.draw(words);
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(stderr(&output).contains(expected), "{words}: {}", stderr(&output));
        assert!(bench.written().is_empty(), "{words}: nothing is written");
    }
}
