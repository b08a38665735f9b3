//! The look of data for which nobody typed one, and what goes with a preset.

use serde_json::Value;

use super::{BALL, Bench, assert_good, ball, read_png, stderr};

/// Draws and gives the bytes of the picture, what was said, and what the stats say of the look.
fn drawn(bench: &Bench, words: &str) -> (Vec<u8>, String, Value) {
    let output = bench.run(&format!(
        "volsplat {words} --size 40x40 -o out/a.png --stats out/s.json"
    ));
    assert_good(&output);
    let text = std::fs::read_to_string(bench.path("out/s.json")).expect("a stats file");
    let stats: Value = serde_json::from_str(&text).expect("a JSON file");
    let (.., rgba) = read_png(&bench.path("out/a.png"));
    (
        rgba,
        stderr(&output),
        stats["settings"]["transfer"]["taken_for"].clone(),
    )
}

fn same(bench: &Bench, one: &str, other: &str) -> bool {
    drawn(bench, one).0 == drawn(bench, other).0
}

/// A ball of muscle in air around a ball of bone, in Hounsfield units.
fn body(bench: &Bench) -> String {
    let hounsfield = |value: u8| match value {
        0..20 => -1000i16,
        20..180 => 60,
        _ => 900,
    };
    let values = ball().into_iter().map(hounsfield);
    bench.write(
        "ct.raw",
        &values.flat_map(i16::to_le_bytes).collect::<Vec<_>>(),
    );
    "ct.raw --dims 32,32,32 --type i16".to_owned()
}

#[test]
fn hounsfield_units_look_as_the_preset_for_ct() {
    let bench = Bench::new();
    let ct = body(&bench);
    let (picture, said, taken_for) = drawn(&bench, &ct);
    assert_eq!(taken_for, "hounsfield");
    assert!(
        said.contains("Hounsfield units") && said.contains("--preset ct"),
        "{said}"
    );
    assert!(
        picture == drawn(&bench, &format!("{ct} --preset ct")).0,
        "as that preset"
    );
    assert!(
        !drawn(&bench, &format!("{ct} --quiet"))
            .1
            .contains("taken for")
    );
    let (.., typed) = drawn(&bench, &format!("{ct} --colormap magma"));
    assert_eq!(typed, Value::Null, "a map was typed");
}

#[test]
fn labels_are_recognised_and_never_interpolated() {
    let bench = Bench::new();
    // Quarters of the ball have names that are not in the order of their places.
    let name = |(i, value): (usize, u8)| {
        let (x, y) = (i % 32 / 16, i / 32 % 32 / 16);
        if value > 20 {
            [7, 2, 90, 31][x + 2 * y]
        } else {
            0
        }
    };
    let labels: Vec<u8> = ball().into_iter().enumerate().map(name).collect();
    bench.write("parts.raw", &labels);
    let parts = format!("parts.raw {BALL}");
    let (picture, said, taken_for) = drawn(&bench, &parts);
    assert_eq!(taken_for, "labels");
    assert!(
        said.contains("--labels") && said.contains("--colormap"),
        "{said}"
    );
    assert!(
        picture == drawn(&bench, &format!("{parts} --labels")).0,
        "as --labels"
    );
    for words in ["--colormap viridis", "--iso 5", "--blend maximum"] {
        let (.., taken_for) = drawn(&bench, &format!("{parts} {words}"));
        assert_ne!(taken_for, "labels", "{words}: quantities");
    }
}

#[test]
fn light_and_blending_come_with_a_preset_and_typed_ones_win() {
    let bench = Bench::new();
    let ct = body(&bench);
    let bone = format!("{ct} --preset ct-bone");
    assert!(same(&bench, &bone, &format!("{bone} --shade phong")), "lit");
    assert!(
        !same(&bench, &bone, &format!("{bone} --shade none")),
        "typed"
    );
    let mip = format!("{ct} --preset ct-mip");
    assert!(
        same(&bench, &mip, &format!("{mip} --blend maximum")),
        "a projection"
    );
    assert!(
        !same(&bench, &mip, &format!("{mip} --blend average")),
        "typed"
    );
    // Emission of that look has the look's own light: none.
    let emission = format!("{mip} --blend emission");
    assert!(same(&bench, &emission, &format!("{emission} --shade none")));
    // A surface has its own light, and no blending beside it.
    let iso = format!("{mip} --iso 300");
    assert!(same(&bench, &iso, &format!("{iso} --shade phong")));
}

#[test]
fn a_field_is_lit_and_a_projection_is_grey() {
    let bench = Bench::new();
    let ball = format!("ball.raw {BALL}");
    assert!(same(&bench, &ball, &format!("{ball} --shade phong")), "lit");
    let (picture, ..) = drawn(&bench, &format!("{ball} --blend maximum"));
    let is_grey = |pixel: &[u8]| pixel[0] == pixel[1] && pixel[1] == pixel[2];
    assert!(picture.chunks(4).all(is_grey), "black to white");
    let middle = &picture[(20 * 40 + 20) * 4..][..4];
    assert!(
        middle[0] > 230,
        "the greatest values are bright: {middle:?}"
    );
    // --light implies shading.
    let map = format!("{ball} --colormap magma");
    assert!(same(
        &bench,
        &format!("{map} --light 1,2,3"),
        &format!("{map} --light 1,2,3 --shade phong")
    ));
    assert!(
        same(&bench, &map, &format!("{map} --shade none")),
        "a typed map is unlit"
    );
}

#[test]
fn what_hides_everything_is_named() {
    let bench = Bench::new();
    let ball = format!("ball.raw {BALL}");
    for (words, said) in [
        (
            "--iso 4000",
            "--iso 4000 is outside the values of ball.raw, which are 0 to",
        ),
        (
            "--crop 100,100,100,110,110,110",
            "keeps nothing of ball.raw that can be seen: it reaches from 0,0,0 to 31,31,31",
        ),
        (
            "--window 5000,10",
            "the transfer function makes every voxel of ball.raw transparent",
        ),
    ] {
        let (picture, text, _) = drawn(&bench, &format!("{ball} {words}"));
        assert!(
            text.contains("warning: nothing is visible") && text.contains(said),
            "{words}: {text}"
        );
        assert!(picture.iter().all(|&byte| byte == 0), "{words}");
    }
}

/// The larger side of what is seen in a picture, as a share of it.
fn fill(rgba: &[u8], side: usize) -> f64 {
    let seen = |at: &dyn Fn(usize) -> usize| {
        let places = rgba
            .chunks(4)
            .enumerate()
            .filter(|(_, pixel)| pixel[3] > 20);
        let (low, high) = places.fold((side, 0), |(low, high), (i, _)| {
            (low.min(at(i)), high.max(at(i)))
        });
        (high - low + 1) as f64 / side as f64
    };
    seen(&|i| i % side).max(seen(&|i| i / side))
}

#[test]
fn what_is_seen_fills_the_picture_and_faint_voxels_do_not_count() {
    let bench = Bench::new();
    // The core of the ball alone is seen, whatever lies around it.
    for words in [
        "--window 200,60",
        "--iso 180",
        "--blend maximum --window 200,60",
        "--shade none",
    ] {
        for orbit in ["30,20", "100,-60"] {
            let (picture, ..) = drawn(&bench, &format!("ball.raw {BALL} {words} --orbit {orbit}"));
            let share = fill(&picture, 40);
            assert!(
                (0.78..=0.92).contains(&share),
                "{words} from {orbit}: {share}"
            );
        }
    }
}
