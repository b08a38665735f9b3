//! Transfer functions as they are asked for on the command line, seen in the pictures and in the stats.

use std::fs;

use serde_json::{Value, json};

use super::bad_input::assert_refused;
use super::{Bench, assert_good, read_png, stderr};

/// A white map over 0..1 that becomes opaque at its upper end.
const UNIT_MAP: &str = r#"[{"ColorSpace": "RGB", "RGBPoints": [0, 1, 1, 1, 1, 1, 1, 1],
    "Points": [0, 0, 0.5, 0, 1, 1, 0.5, 0]}]"#;

/// Draws the ball and gives the alpha of its middle and what the stats say of the transfer function.
fn drawn(bench: &Bench, words: &str) -> (u8, Value) {
    assert_good(&bench.draw(&format!(
        "--size 24x24 -o out/a.png --stats out/s.json {words}"
    )));
    let (.., rgba) = read_png(&bench.path("out/a.png"));
    let text = fs::read_to_string(bench.path("out/s.json")).expect("a stats file");
    let stats: Value = serde_json::from_str(&text).expect("a JSON file");
    (
        rgba[(12 * 24 + 12) * 4 + 3],
        stats["settings"]["transfer"].clone(),
    )
}

#[test]
fn a_window_decides_what_is_seen() {
    let bench = Bench::new();
    let (low, record) = drawn(&bench, "--window 100,200 --colormap magma");
    assert_eq!(low, 255, "the ball's values lie in the window");
    assert_eq!(
        (&record["window"], &record["colormap"]),
        (&json!([100.0, 200.0]), &json!("magma")),
        "{record}"
    );
    let (beyond, record) = drawn(&bench, "--window 500,200");
    assert_eq!(beyond, 0, "no value of the ball reaches 400");
    assert_eq!(record["colormap"], "viridis", "{record}");
    // A CT window may lie below 0.
    assert_eq!(
        drawn(&bench, "--window -600,1500").1["window"],
        json!([-600.0, 1500.0])
    );
}

#[test]
fn the_opacity_scale_scales_every_function() {
    let bench = Bench::new();
    bench.write("tf.json", UNIT_MAP.as_bytes());
    for words in [
        "",
        "--window 500,1000",
        "--transfer tf.json --rescale-transfer",
    ] {
        let alphas = ["0.02", "0.05", "0.2"]
            // From further off, so that the middle pixel is more than the ball's opaque core.
            .map(|scale| {
                drawn(
                    &bench,
                    &format!("{words} --orbit 30,20,2.5 --opacity-scale {scale}"),
                )
                .0
            });
        assert!(
            alphas[0] < alphas[1] && alphas[1] < alphas[2],
            "`{words}`: alpha grows with the scale: {alphas:?}"
        );
        // Alpha is 1 - exp(-scale * x), with the same x; the codes are rounded, and below 255 by some.
        let depth = |alpha: u8| -(1.0 - f64::from(alpha) / 255.0).ln();
        let ratio = depth(alphas[1]) / depth(alphas[0]);
        assert!(
            (ratio - 2.5).abs() < 0.3,
            "`{words}`: extinction grows by 2.5, not {ratio}: {alphas:?}"
        );
    }
    assert_eq!(drawn(&bench, "--opacity-scale 2.5").1["opacity_scale"], 2.5);
}

#[test]
fn a_map_over_the_unit_interval_is_moved_to_the_volume() {
    let bench = Bench::new();
    bench.write("tf.json", UNIT_MAP.as_bytes());
    // Almost every value of the ball is above 1, so that its rim is opaque; moved, the rim is faint.
    let visible = |words: &str| {
        let record = drawn(&bench, words).1;
        let (.., rgba) = read_png(&bench.path("out/a.png"));
        (
            rgba.chunks(4).filter(|pixel| pixel[3] > 200).count(),
            record,
        )
    };
    let (as_written, record) = visible("--transfer tf.json");
    assert_eq!(record["rescaled"], false, "{record}");
    let (moved, record) = visible("--transfer tf.json --rescale-transfer");
    assert_eq!(record["rescaled"], true, "{record}");
    assert!(
        moved < as_written,
        "opaque pixels: {as_written} as written, {moved} moved"
    );
}

#[test]
fn a_preset_draws_hounsfield_units_and_warns_of_others() {
    let bench = Bench::new();
    // The ball in steps of 8 above air: its middle is dense bone.
    let hounsfield = super::ball().into_iter().map(|v| i16::from(v) * 8 - 1000);
    bench.write(
        "ct.raw",
        &hounsfield.flat_map(i16::to_le_bytes).collect::<Vec<_>>(),
    );
    let ct = "volsplat ct.raw --dims 32,32,32 --type i16 --size 24x24 -o out/a.png --preset";
    for name in [
        "ct-bone",
        "ct-soft-tissue",
        "ct-vessels",
        "ct-skin",
        "ct-lung",
        "mr-head",
    ] {
        let output = bench.run(&format!("{ct} {name}"));
        assert_good(&output);
        assert!(
            !stderr(&output).contains("warning"),
            "{name} suits the volume: {}",
            stderr(&output)
        );
        let (.., rgba) = read_png(&bench.path("out/a.png"));
        assert!(
            rgba[(12 * 24 + 12) * 4 + 3] > 64,
            "{name} shows the middle of the ball"
        );
    }
    let output = bench.draw("--size 24x24 -o out/a.png --preset ct-bone");
    assert_good(&output);
    let said = stderr(&output);
    assert!(
        said.contains("warning: --preset ct-bone expects Hounsfield units")
            && said.contains("8 bits"),
        "{said}"
    );
    let record = drawn(&bench, "--preset mr-head").1;
    assert_eq!(
        (&record["preset"], &record["colormap"]),
        (&json!("mr-head"), &Value::Null),
        "{record}"
    );
}

#[test]
fn the_plot_is_an_extra_picture() {
    let bench = Bench::new();
    let record = drawn(&bench, "--window 100,200 --show-transfer out/plot.png").1;
    assert_eq!(record["shown_in"], "out/plot.png", "{record}");
    assert_eq!(
        bench.written(),
        ["a.png", "plot.png", "s.json"],
        "beside the picture"
    );
    let (width, height, rgba) = read_png(&bench.path("out/plot.png"));
    assert_eq!((width, height), (800, 300), "size");
    assert!(
        rgba.chunks(4).any(|pixel| pixel != &rgba[..4]),
        "something is drawn"
    );
}

#[test]
fn contradictions_and_bad_numbers_are_refused() {
    let bench = Bench::new();
    bench.write("tf.json", UNIT_MAP.as_bytes());
    let refused = |words: &str, named: &str| {
        assert_refused(
            &bench,
            &format!("volsplat ball.raw {} -o out/a.png {words}", super::BALL),
            named,
        );
    };
    refused("--window 40,400 --transfer tf.json", "--transfer");
    refused("--window 40", "LEVEL,WIDTH");
    refused("--window 40,0", "width above 0");
    refused("--opacity-scale 0", "--opacity-scale");
    refused("--rescale-transfer", "--transfer");
    refused("--show-transfer out/plot.exr", ".png");
    refused("--show-transfer out/a.png", "--show-transfer");
    refused("--show-transfer absent/plot.png", "absent");
    refused("--preset ct-bone --window 40,400", "--window");
    refused("--preset ct-bone --transfer tf.json", "--transfer");
    refused("--preset bone", "ct-bone          bone alone");
}

#[test]
fn list_asks_what_there_is() {
    let bench = Bench::new();
    for (words, lines) in [
        (
            "volsplat --preset list",
            [
                "ct-bone          bone alone",
                "mr-head          a head in MR",
            ],
        ),
        (
            "volsplat ball.raw --colormap=list",
            ["viridis\n", "greys\n"],
        ),
    ] {
        let output = bench.run(words);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{words}: {}",
            stderr(&output)
        );
        let text = String::from_utf8_lossy(&output.stdout);
        for line in lines {
            assert!(text.contains(line), "{words} lists {line}: {text}");
        }
    }
}

#[test]
fn a_slicer_property_brings_its_light_and_its_unit() {
    let bench = Bench::new();
    let text =
        "1\n1\n0.9\n0.1\n0.2\n10\n6 0 0 60 0 200 0.4\n4 0 1 255 1\n8 0 0.9 0.2 0.1 255 1 0.9 0.8\n";
    bench.write("tf.vp", text.as_bytes());
    let json = r#"{"volumeProperties":[{"components":[{"shade":true,"lighting":{"specular":0.2},
        "scalarOpacityUnitDistance":3,
        "scalarOpacity":{"points":[{"x":0,"y":0},{"x":60,"y":0},{"x":200,"y":0.4}]},
        "rgbTransferFunction":{"points":[{"x":0,"color":[0.9,0.2,0.1]},{"x":255,"color":[1,0.9,0.8]}]}}]}]}"#;
    bench.write("tf.vp.json", json.as_bytes());
    let map = r#"{"RGBPoints":[0,0.9,0.2,0.1,255,1,0.9,0.8],"Points":[0,0,0.5,0,60,0,0.5,0,200,0.4,0.5,0]}"#;
    bench.write("tf.json", map.as_bytes());
    for (own, typed) in [
        ("--transfer tf.vp", "--transfer tf.json --shade phong"),
        ("--transfer tf.vp --shade none", "--transfer tf.json"),
        (
            "--transfer tf.vp.json",
            "--transfer tf.json --shade phong --opacity-unit 3",
        ),
    ] {
        assert_good(&bench.draw(&format!("-o out/a.png --size 48x48 {own}")));
        assert_good(&bench.draw(&format!("-o out/b.png --size 48x48 {typed}")));
        let [a, b] = ["out/a.png", "out/b.png"].map(|name| fs::read(bench.path(name)));
        assert!(
            a.expect("written") == b.expect("written"),
            "{own} is {typed}"
        );
    }
}
