//! Paths whose keys change the volume: transfer functions that mix, boxes and planes that move, and what is refused.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::{Bench, assert_good, read_png, stderr};

/// Colours and opacities by scalar, as ParaView writes them.
fn map(colours: &[[f64; 4]], opacities: &[[f64; 2]]) -> Value {
    let points: Vec<f64> = opacities
        .iter()
        .flat_map(|&[value, opacity]| [value, opacity, 0.5, 0.0])
        .collect();
    json!([{"Name": "test", "ColorSpace": "RGB", "RGBPoints": colours.concat(), "Points": points}])
}

fn camera() -> Value {
    json!({"position": [15, 40, -60], "target": [15.5, 15.5, 15.5], "up": [0, 1, 0], "fov_y": 30, "near": 1})
}

fn write_json(bench: &Bench, name: &str, value: &Value) {
    bench.write(name, value.to_string().as_bytes());
}

/// Two functions, and the mean of them by hand: knots at the union of theirs, a step kept.
fn write_maps(bench: &Bench) {
    let (red, blue, mean) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.0, 0.5]);
    let knot = |value: f64, [r, g, b]: [f64; 3]| [value, r, g, b];
    write_json(
        bench,
        "a.json",
        &map(
            &[knot(0.0, red)],
            &[[50.0, 0.0], [150.0, 0.5], [255.0, 0.5]],
        ),
    );
    write_json(
        bench,
        "b.json",
        &map(
            &[knot(0.0, blue)],
            &[[100.0, 0.0], [100.0, 0.25], [255.0, 0.25]],
        ),
    );
    let opacities = [
        [50.0, 0.0],
        [100.0, 0.125],
        [100.0, 0.25],
        [150.0, 0.375],
        [255.0, 0.375],
    ];
    write_json(bench, "mean.json", &map(&[knot(0.0, mean)], &opacities));
    write_json(bench, "camera.json", &camera());
}

fn write_path(bench: &Bench, keys: &[Value]) {
    let keys: Vec<Value> = keys
        .iter()
        .enumerate()
        .map(|(number, key)| {
            let mut key = key.clone();
            key["time"] = json!(number);
            key["camera"] = camera();
            key
        })
        .collect();
    write_json(bench, "keys.json", &json!({ "keys": keys }));
}

/// The largest difference of two pictures, in steps of 8 bits.
fn apart(one: &Path, other: &Path) -> u8 {
    let ((width, height, a), (other_width, other_height, b)) = (read_png(one), read_png(other));
    assert_eq!((width, height), (other_width, other_height), "sizes");
    assert!(
        a.chunks(4).any(|pixel| pixel[3] > 40),
        "something is seen in {}",
        one.display()
    );
    a.iter()
        .zip(&b)
        .map(|(a, b)| a.abs_diff(*b))
        .max()
        .unwrap_or(0)
}

#[test]
fn transfer_functions_mix_between_keys() {
    let bench = Bench::new();
    write_maps(&bench);
    write_path(
        &bench,
        &[
            json!({"transfer": "a.json"}),
            json!({}),
            json!({"transfer": "b.json"}),
        ],
    );
    for order in ["image-sheets", "every-sample"] {
        let words = format!("--size 40x40 --order {order} --background black");
        assert_good(&bench.draw(&format!("{words} --path keys.json --fps 1 -o out/p.png")));
        for (name, picture) in [("a", "p_0000"), ("mean", "p_0001"), ("b", "p_0002")] {
            assert_good(&bench.draw(&format!(
                "{words} --transfer {name}.json --camera camera.json -o out/one.png"
            )));
            let [moved, single] =
                [picture, "one"].map(|name| bench.path(&format!("out/{name}.png")));
            let apart = apart(&moved, &single);
            assert_eq!(apart, 0, "{order}: {picture} is drawn with {name}.json");
        }
    }
}

#[test]
fn clips_move_between_keys() {
    let bench = Bench::new();
    write_maps(&bench);
    let planes = |offset: f64| json!({"clip_planes": [[2, 0, 0, offset], [0, 0, -1, -25]]});
    let cases = [
        (
            [planes(10.0), planes(40.0)],
            "--clip-plane 1,0,0,12.5 --clip-plane 0,0,-1,-25",
        ),
        (
            [
                json!({"crop": [0, 0, 4, 31, 31, 20]}),
                json!({"crop": [8, 0, 20, 31, 31, 36]}),
            ],
            "--crop 4,0,12,31,31,28",
        ),
        (
            [
                json!({"crop_voxels": [0, 0, 0, 20, 31, 31]}),
                json!({"crop_voxels": [0, 0, 0, 10, 31, 31]}),
            ],
            "--crop-voxels 0,0,0,15,31,31",
        ),
    ];
    for (keys, clip) in cases {
        write_path(&bench, &keys);
        let words = "--size 40x40 --transfer a.json";
        assert_good(&bench.draw(&format!("{words} --path keys.json --fps 2 -o out/p.png")));
        assert_good(&bench.draw(&format!(
            "{words} {clip} --camera camera.json -o out/one.png"
        )));
        let [half, single, first] =
            ["p_0001", "one", "p_0000"].map(|name| bench.path(&format!("out/{name}.png")));
        assert_eq!(apart(&half, &single), 0, "half way it is {clip}");
        assert!(apart(&first, &single) > 20, "the clip moves: {clip}");
    }
}

#[test]
fn resume_takes_the_state_of_each_picture() {
    let bench = Bench::new();
    write_maps(&bench);
    write_path(
        &bench,
        &[
            json!({"transfer": "a.json", "crop": [0, 0, 0, 31, 31, 20]}),
            json!({"transfer": "b.json"}),
        ],
    );
    let words = "--size 24x24 --path keys.json --fps 4";
    assert_good(&bench.draw(&format!("{words} -o out/p.png")));
    let before: Vec<_> = (0..5)
        .map(|i| fs::read(bench.path(&format!("out/p_000{i}.png"))).expect("drawn"))
        .collect();
    for i in [1, 3] {
        fs::remove_file(bench.path(&format!("out/p_000{i}.png"))).expect("it is there");
    }
    assert_good(&bench.draw(&format!("{words} --resume -o out/p.png")));
    for (i, bytes) in before.iter().enumerate() {
        let again = fs::read(bench.path(&format!("out/p_000{i}.png"))).expect("drawn again");
        assert!(
            again == *bytes,
            "picture {i} is the same when it is drawn by itself"
        );
    }
    assert_good(&bench.draw(&format!("{words} -o out/p.apng")));
}

#[test]
fn what_a_volume_cannot_do_is_refused_by_key_and_field() {
    let bench = Bench::new();
    write_maps(&bench);
    let good = json!({"transfer": "a.json"});
    let cases = [
        (
            json!({"transfer": "none.json"}),
            "",
            "key 1 of the path: \"transfer\": none.json",
        ),
        (
            json!({"transfer": 7}),
            "",
            "key 1 of the path: \"transfer\": expected a name",
        ),
        (
            json!({"transfer": "camera.json"}),
            "",
            "key 1 of the path: \"transfer\"",
        ),
        (
            json!({"preset": "ct-boon"}),
            "",
            "key 1 of the path: \"preset\": expected one of",
        ),
        (
            json!({"transfer": "a.json", "preset": "ct-bone"}),
            "",
            "\"transfer\" and \"preset\"",
        ),
        (
            json!({"crop": [0, 0, 0, 1, 1]}),
            "",
            "key 1 of the path: \"crop\": expected a list of 6 numbers",
        ),
        (
            json!({"crop_voxels": [0, 0, 0, 1, 1, 0]}),
            "",
            "key 1 of the path: \"crop_voxels\": expected the first",
        ),
        (
            json!({"clip_planes": [[0, 0, 0, 1]]}),
            "",
            "key 1 of the path: \"clip_planes\": plane 0",
        ),
        (
            json!({"clip_planes": vec![[1, 0, 0, 1]; 7]}),
            "",
            "key 1 of the path: there are 7 clip planes",
        ),
        (
            json!({"clip_plane": []}),
            "",
            "key 1 of the path: unknown key \"clip_plane\"",
        ),
        (
            json!({}),
            "--transfer b.json",
            "--transfer and the keys of --path",
        ),
        (
            json!({"crop": [0, 0, 0, 1, 1, 1]}),
            "--crop 0,0,0,9,9,9",
            "--crop and the keys of --path",
        ),
    ];
    for (bad, words, complaint) in cases {
        write_path(&bench, &[good.clone(), bad.clone()]);
        let output = bench.draw(&format!("--path keys.json {words} -o out/p.png"));
        assert_eq!(output.status.code(), Some(2), "{bad}: {}", stderr(&output));
        // Long lines are wrapped.
        let said = stderr(&output)
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        assert!(said.contains(complaint), "{bad} says {said}");
    }
    let planes = |list: Value| json!({"clip_planes": list});
    for (first, second, complaint) in [
        (
            planes(json!([[1, 0, 0, 1]])),
            planes(json!([])),
            "1 planes in one and 0",
        ),
        (
            planes(json!([[1, 0, 0, 1]])),
            planes(json!([[-1, 0, 0, 1]])),
            "turns over",
        ),
    ] {
        write_path(&bench, &[first, second]);
        let output = bench.draw("--path keys.json -o out/p.png");
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(complaint), "{}", stderr(&output));
    }
    assert!(
        bench.written().is_empty(),
        "nothing is written: {:?}",
        bench.written()
    );
}
