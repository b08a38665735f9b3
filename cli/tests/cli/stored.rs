//! Volumes that stay in their file: a tiny OME-Zarr image, drawn with less memory than it takes.

use std::fs;

use super::{Bench, assert_good, stderr};

/// Voxels along an axis, and of a chunk: no chunk ends where a brick of 8 cells does.
const SIDE: usize = 60;
const CHUNK: usize = 20;

/// Ripples around the middle: no brick is alike.
fn value(at: [usize; 3]) -> u8 {
    let radius = at
        .map(|i| (i as f64 / SIDE as f64 - 0.5).powi(2))
        .iter()
        .sum::<f64>()
        .sqrt();
    (120.0 * (1.0 + (40.0 * radius).cos()) * (1.0 - radius)) as u8
}

/// Writes an OME-Zarr 0.4 image with one level, the slices 1.5 times as far apart as the rest.
fn write_image(bench: &Bench) {
    fs::create_dir_all(bench.path("image.zarr/0")).expect("folders");
    let axes = ["z", "y", "x"]
        .map(|name| format!(r#"{{"name": "{name}", "type": "space"}}"#))
        .join(",");
    let image = format!(
        r#"{{"multiscales": [{{"version": "0.4", "axes": [{axes}], "datasets": [{{"path": "0",
            "coordinateTransformations": [{{"type": "scale", "scale": [1.5, 1, 1]}}]}}]}}]}}"#
    );
    let array = format!(
        r#"{{"zarr_format": 2, "shape": [{SIDE},{SIDE},{SIDE}], "chunks": [{CHUNK},{CHUNK},{CHUNK}], "dtype": "|u1",
            "order": "C", "filters": null, "fill_value": 0, "compressor": null}}"#
    );
    bench.write("image.zarr/.zgroup", br#"{"zarr_format": 2}"#);
    bench.write("image.zarr/.zattrs", image.as_bytes());
    bench.write("image.zarr/0/.zarray", array.as_bytes());
    let chunks = SIDE / CHUNK;
    for number in 0..chunks.pow(3) {
        let chunk = [
            number % chunks,
            number / chunks % chunks,
            number / (chunks * chunks),
        ];
        let voxel = |place: usize| {
            let inside = [
                place % CHUNK,
                place / CHUNK % CHUNK,
                place / (CHUNK * CHUNK),
            ];
            value([0, 1, 2].map(|axis| chunk[axis] * CHUNK + inside[axis]))
        };
        let [x, y, z] = chunk;
        let bytes: Vec<u8> = (0..CHUNK.pow(3)).map(voxel).collect();
        bench.write(&format!("image.zarr/0/{z}.{y}.{x}"), &bytes);
    }
}

#[test]
fn an_image_larger_than_the_memory_gives_the_same_picture() {
    let bench = Bench::new();
    write_image(&bench);
    // What is read again for each picture is framed by its box, and all else by what is seen of it.
    let side = SIDE as f64;
    let camera = serde_json::json!({
        "position": [1.3 * side, 1.1 * side, 1.9 * side], "target": [0.5 * side, 0.5 * side, 0.5 * side], "up": [0, 1, 0],
    });
    bench.write("camera.json", camera.to_string().as_bytes());
    let draw = |words: &str| {
        bench.run(&format!(
            "volsplat image.zarr --size 80x64 --camera camera.json {words}"
        ))
    };
    for (name, words) in [
        ("plain", ""),
        ("lit", "--shade phong"),
        ("greatest", "--blend maximum"),
    ] {
        assert_good(&draw(&format!("{words} -o out/{name}-memory.png")));
        let stored =
            format!("{words} --max-memory 180K --stats out/{name}.json -o out/{name}-stored.png");
        assert_good(&draw(&stored));
        let [memory, stored] = ["memory", "stored"]
            .map(|way| fs::read(bench.path(&format!("out/{name}-{way}.png"))).expect("a picture"));
        assert!(memory == stored, "{name}: the pictures differ");
        let stats = fs::read_to_string(bench.path(&format!("out/{name}.json"))).expect("stats");
        let stats: serde_json::Value = serde_json::from_str(&stats).expect("JSON");
        let read = stats["bricks_read"]
            .as_u64()
            .or_else(|| stats["frames"][0]["bricks_read"].as_u64());
        assert!(
            read.is_some_and(|read| read > 0),
            "{name}: nothing was read brick by brick: {stats}"
        );
    }
}

#[test]
fn what_needs_all_voxels_is_refused_with_a_way_out() {
    let bench = Bench::new();
    write_image(&bench);
    bench.write("mask.raw", &[1; 8]);
    for (words, advice) in [
        ("--mask mask.raw", "--max-memory"),
        ("--order every-sample", "raise the memory limit"),
        ("--kernel gaussian", "raise the memory limit"),
    ] {
        let output = bench.run(&format!(
            "volsplat image.zarr --max-memory 180K {words} -o out/a.png"
        ));
        assert_eq!(
            output.status.code(),
            Some(2),
            "{words}: {}",
            stderr(&output)
        );
        let text = stderr(&output);
        assert!(
            text.trim_end().lines().count() == 1 && text.contains(advice),
            "{words}: {text}"
        );
    }
    assert!(bench.written().is_empty(), "nothing is written");
}
