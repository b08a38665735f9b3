//! `--max-error`, `--max-time` and `--explain`: promises are kept and can be repeated.

use std::fs;
use std::path::Path;

use resample_core::Image;
use resample_core::metrics::{Mask, compare};
use serde_json::Value;

use super::{BALL, Bench, assert_good, stderr};

pub(super) fn json(bench: &Bench, name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(bench.path(name)).expect("a file")).expect("JSON")
}

/// Writes the mesh that the tests draw, and a picture with depth: a wall at z = 4 before which a panel stands at z = 2.
fn with_scenes() -> Bench {
    let bench = Bench::new();
    bench.write(
        "quad.obj",
        b"v -1 -1 0\nv 1 -1 0\nv 1 1 0.4\nv -1 1 -0.4\nf 1 2 3 4\n",
    );
    let panel = |x: usize, y: usize| (30..60).contains(&x) && (21..51).contains(&y);
    let pixels: Vec<[usize; 2]> = (0..96 * 72).map(|i| [i % 96, i / 96]).collect();
    let colour = |x: usize, y: usize| {
        let odd = (x / 3 + y / 3) % 2 == 1;
        if panel(x, y) {
            [220, 40 * u8::from(odd), 40]
        } else {
            [(x * 2) as u8, (y * 3) as u8, 90]
        }
    };
    let rgb: Vec<u8> = pixels.iter().flat_map(|&[x, y]| colour(x, y)).collect();
    bench.write("im.ppm", &[b"P6\n96 72\n255\n".to_vec(), rgb].concat());
    let mut depth = b"Pf\n96 72\n-1\n".to_vec();
    for y in (0..72).rev() {
        depth.extend((0..96).flat_map(|x| (if panel(x, y) { 2.0_f32 } else { 4.0 }).to_le_bytes()));
    }
    bench.write("z.pfm", &depth);
    bench
}

/// Pictures of the sequences: enough of them that a look pays.
const FRAMES: usize = 64;

/// A sequence under two bounds.
struct Sequence {
    scene: &'static str,
    words: String,
    narrow: &'static str,
    wide: &'static str,
}

fn sequences() -> [Sequence; 3] {
    let turntable = format!("--size 48x48 --turntable {FRAMES}");
    [
        Sequence {
            scene: "ball",
            words: format!("volsplat ball.raw {BALL} {turntable}"),
            narrow: "1/255",
            wide: "1/40",
        },
        Sequence {
            scene: "quad",
            words: format!("texmap quad.obj {turntable}"),
            narrow: "1/255",
            wide: "1/20",
        },
        Sequence {
            scene: "panel",
            words: format!("warp3d im.ppm z.pfm --intrinsics 90,90,47.5,35.5 --sway 4,{FRAMES}"),
            narrow: "1/100",
            wide: "1/12",
        },
    ]
}

#[test]
fn the_error_stays_under_the_bound_in_every_frame() {
    let bench = with_scenes();
    for sequence in sequences() {
        let narrow = keeps(&bench, &sequence, sequence.narrow);
        let wide = keeps(&bench, &sequence, sequence.wide);
        let scene = sequence.scene;
        assert_ne!(
            wide["setting"], wide["exact_setting"],
            "{scene}: {} saves something",
            sequence.wide
        );
        let work = |planned: &Value| planned["predicted_work"].as_f64().unwrap_or(f64::INFINITY);
        // The transmittance at which rays end follows from the bound, for the preview that the windows are drawn by too:
        // estimates of one setting differ in their seventh digit.
        assert!(
            work(&wide) <= work(&narrow) * (1.0 + 1e-6),
            "{scene}: a wider bound costs no more: {wide} {narrow}"
        );
    }
}

/// Draws a sequence under a bound and under the exact setting, compares every picture, and gives what was planned.
fn keeps(bench: &Bench, sequence: &Sequence, bound: &str) -> Value {
    let Sequence { scene, words, .. } = sequence;
    let command = format!("{words} -o out/{scene}-%02d.exr --stats out/s.json --max-error {bound}");
    assert_good(&bench.run(&command));
    let planned = json(bench, "out/s.json")["planned"].clone();
    let allowed = planned["bound"].as_f64().expect("a number");
    let predicted = planned["predicted_error"].as_f64().expect("a number");
    assert!(
        predicted <= allowed && planned["kept"] == true,
        "{scene}: {bound} is predicted: {planned}"
    );
    let exact = planned["exact_setting"].as_str().expect("words");
    let picture = |name: String| read_exr(&bench.path("out").join(name));
    if !bench.path(&format!("out/{scene}-exact-00.exr")).exists() {
        let words = format!("{words} -o out/{scene}-exact-%02d.exr {exact}");
        assert_good(&bench.run(&words));
    }
    for frame in 0..FRAMES {
        let truth = picture(format!("{scene}-exact-{frame:02}.exr"));
        let own = picture(format!("{scene}-{frame:02}.exr"));
        let mask = Mask::from_alpha(&truth);
        let error = compare(&own, &truth, Some(&mask))
            .expect("of one size")
            .rmse;
        assert!(error <= allowed, "{scene}, frame {frame}, {bound}: {error}");
    }
    planned
}

pub(super) fn read_exr(path: &Path) -> Image {
    let picture = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| Image::transparent(size.width(), size.height()),
        |image, at, (r, g, b, a): (f32, f32, f32, f32)| {
            image.rgba[at.y() * image.width + at.x()] = [r, g, b, a];
        },
    );
    picture.expect("a picture").layer_data.channel_data.pixels
}

#[test]
fn the_default_is_taken_where_it_keeps_the_bound() {
    let bench = Bench::new();
    let words = "--size 160x160 --stats out/s.json";
    assert_good(&bench.draw(&format!("{words} -o out/a.png --max-error 1/100")));
    let planned = &json(&bench, "out/s.json")["planned"];
    let first = &planned["considered"][0];
    assert_eq!(
        first["setting"], "",
        "the default is tried first: {planned}"
    );
    assert!(
        planned["predicted_work"].as_f64().expect("a number") <= 1.0,
        "nothing dearer is taken: {planned}"
    );
}

#[test]
fn a_run_that_planning_cannot_help_takes_the_exact_setting_at_once() {
    let bench = with_scenes();
    for words in [
        "texmap quad.obj --size 48x48",
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
            told.contains("trial renders to pay off"),
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
        text.contains("pilot:") && text.contains(": error "),
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
fn errors_of_blocked_light_are_named_beside_what_is_predicted() {
    let bench = Bench::new();
    let said = |words: &str| {
        let output = bench.draw(&format!(
            "-o out/a.png {words} {}",
            if words.contains("--max-error") {
                ""
            } else {
                "--size 48x48 --max-error 1/40"
            }
        ));
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        stderr(&output)
    };
    let counted = "shadows and occlusion err by at most";
    assert!(!said("--light 1,2,3").contains(counted));
    let of = |words: &str| -> f64 {
        let said = said(words);
        let (_, behind) = said.split_once(counted).expect("the error of light");
        let number = behind.split_whitespace().next().expect("a number");
        number.parse().expect("a number")
    };
    let hard = of("--light 1,2,3 --shadows");
    let coarse = of("--light 1,2,3 --shadows --light-grid 8");
    assert!(hard > 0.0 && coarse > 1.5 * hard, "{hard} and {coarse}");
    for words in ["--occlusion", "--occlusion=3"] {
        assert!(of(words) > 0.0, "{words}");
    }
    let strict = said("--occlusion --max-error max:1/4000 --size 40x40");
    assert!(strict.contains("may err by more than"), "{strict}");
}

#[test]
fn a_time_that_cannot_be_kept_is_said_and_time_enough_takes_the_exact_setting() {
    let bench = Bench::new();
    let cheap = bench.draw("--size 48x48 -o out/a.png --max-time 0.001ms --stats out/s.json");
    assert_good(&cheap);
    assert!(
        stderr(&cheap).contains("warning: no setting is predicted"),
        "no error, but said: {}",
        stderr(&cheap)
    );
    assert_eq!(json(&bench, "out/s.json")["planned"]["kept"], false);
    assert_good(&bench.draw("--size 48x48 -o out/b.png --max-time 100s --stats out/s.json"));
    let planned = &json(&bench, "out/s.json")["planned"];
    assert_eq!(planned["setting"], planned["exact_setting"]);
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

#[test]
fn a_time_gets_the_least_error_that_fits() {
    let bench = Bench::new();
    // Two narrow peaks are drawn along rays, where errors and times do not follow the ladder's order.
    bench.write(
        "peaks.json",
        br#"[{"ColorSpace":"RGB","RGBPoints":[0,0.1,0.2,0.9,255,0.9,0.3,0.1],"Points":[0,0,0.5,0,78,0,0.5,0,
        80,0.6,0.5,0,82,0,0.5,0,168,0,0.5,0,170,0.9,0.5,0,172,0,0.5,0,255,0,0.5,0]}]"#,
    );
    for time_ms in [40.0, 400.0] {
        let words = format!("--size 200x200 --transfer peaks.json --max-time {time_ms}ms");
        assert_good(&bench.draw(&format!("{words} -o out/a.png --stats out/s.json")));
        let planned = &json(&bench, "out/s.json")["planned"];
        let number = |of: &Value, name: &str| of[name].as_f64();
        let Some(chosen) = number(planned, "predicted_error") else {
            panic!("errors are measured for a time too: {planned}");
        };
        let others = planned["considered"].as_array().expect("a list");
        assert!(
            others.iter().any(|other| other["setting"] == ""),
            "the default is a candidate: {planned}"
        );
        // Nearer to the time, settings may be left out because one took longer than predicted.
        let fits = |other: &&Value| number(other, "predicted_ms").expect("ms") < 0.25 * time_ms;
        for other in others.iter().filter(fits) {
            let error = number(other, "predicted_error").expect("an error");
            assert!(
                planned["kept"] == false || chosen <= error,
                "{time_ms} ms: {other} is better: {planned}"
            );
        }
    }
}
