//! `resample texmap`: pictures of small models, and damaged models.

use super::bad_input::assert_refused;
use super::planner::read_exr;
use super::{Bench, assert_good, read_png, stderr};

/// A square from -1 to 1 in the plane z = 0, with coordinates from the lower left corner, as OBJ has them.
const SQUARE: &str = "mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\n\
                      f 1/1 2/2 3/3 4/4\n";

/// From the front, so that the square fills the middle of the picture.
pub(super) const FRONT: &str = "--orbit 0,0 --size 64x64 --shade unlit";

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("square.obj", SQUARE.as_bytes());
    bench.write("a.mtl", b"newmtl m\nKd 1 0 0\n");
    // Four colours: red and green above, blue and white below.
    let mut picture = Vec::new();
    let mut encoder = png::Encoder::new(&mut picture, 2, 2);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().expect("memory");
    writer
        .write_image_data(&[255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255])
        .expect("memory");
    writer.finish().expect("memory");
    bench.write("four.png", &picture);
    bench
}

pub(super) fn pixel(picture: &(u32, u32, Vec<u8>), x: usize, y: usize) -> [u8; 4] {
    let at = 4 * (y * picture.0 as usize + x);
    [0, 1, 2, 3].map(|c| picture.2[at + c])
}

#[test]
fn a_model_is_framed_in_its_own_colour_over_nothing() {
    let bench = bench();
    assert_good(&bench.run(&format!("texmap square.obj -o out/a.png {FRONT}")));
    let picture = read_png(&bench.path("out/a.png"));
    assert_eq!(
        pixel(&picture, 32, 32),
        [255, 0, 0, 255],
        "red in the middle"
    );
    assert_eq!(pixel(&picture, 0, 0), [0; 4], "nothing in the corner");
    assert_eq!(
        (picture.0, picture.1),
        (64, 64),
        "the size that was asked for"
    );
}

#[test]
fn a_bound_texture_stands_upright_and_a_background_lies_behind() {
    let bench = bench();
    bench.write("bare.obj", SQUARE.replace("mtllib a.mtl\n", "").as_bytes());
    let words =
        format!("texmap bare.obj --texture four.png --background four.png -o out/a.png {FRONT}");
    assert_good(&bench.run(&words));
    let picture = read_png(&bench.path("out/a.png"));
    // Which of the four it is; two texels are mixed nearly everywhere.
    let near = |[r, g, b, _]: [u8; 4], expected: [u8; 3]| {
        [r, g, b]
            .iter()
            .zip(expected)
            .all(|(&found, expected)| (found > 127) == (expected > 127))
    };
    for (x, y, expected) in [
        (18, 18, [255, 0, 0]),
        (45, 18, [0, 255, 0]),
        (18, 45, [0, 0, 255]),
        (45, 45, [255; 3]),
    ] {
        let found = pixel(&picture, x, y);
        assert!(
            near(found, expected),
            "pixel {x}, {y} of the texture: {found:?}, expected {expected:?}"
        );
    }
    for (x, y, expected) in [
        (1, 1, [255, 0, 0]),
        (62, 1, [0, 255, 0]),
        (1, 62, [0, 0, 255]),
        (62, 62, [255; 3]),
    ] {
        let found = pixel(&picture, x, y);
        assert!(
            near(found, expected),
            "pixel {x}, {y} of the background: {found:?}, expected {expected:?}"
        );
    }
}

#[test]
fn stats_name_the_model_and_how_it_was_drawn() {
    let bench = bench();
    let words = "--stats out/s.json --method backward-ewa --shade lambert --light 0,0,1";
    assert_good(&bench.run(&format!(
        "texmap square.obj -o out/a.png --size 32x32 {words}"
    )));
    let text = std::fs::read_to_string(bench.path("out/s.json")).expect("written");
    let stats: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(
        (&stats["triangles"], &stats["meshes"]),
        (&2.into(), &1.into()),
        "counts: {stats}"
    );
    let render = &stats["settings"]["render"];
    assert_eq!(
        (&render["method"], &render["shade"]),
        (&"backward-ewa".into(), &"lambert".into()),
        "{render}"
    );
    assert!(
        stats["frames"][0]["wall_ms"].is_number(),
        "a frame: {stats}"
    );
}

#[test]
fn layers_go_into_an_exr_file() {
    let bench = bench();
    assert_good(&bench.run("texmap square.obj -o out/a.exr --size 16x16 --layers depth,coverage"));
    let meta = exr::meta::MetaData::read_from_file(bench.path("out/a.exr"), false).expect("an EXR");
    let mut names: Vec<_> = meta.headers[0]
        .channels
        .list
        .iter()
        .map(|channel| channel.name.to_string())
        .collect();
    names.sort();
    assert_eq!(
        names,
        ["A", "B", "G", "R", "Z", "coverage"],
        "what was asked for"
    );
    let bench = self::bench();
    assert_refused(
        &bench,
        "texmap square.obj -o out/a.png --layers depth",
        "--layers",
    );
}

#[test]
fn turntables_are_numbered_and_taken_up_again() {
    let bench = bench();
    assert_good(&bench.run("texmap square.obj -o out/a.png --size 16x16 --turntable 3"));
    assert_eq!(
        bench.written(),
        ["a_0000.png", "a_0001.png", "a_0002.png"],
        "three steps"
    );
    let again = bench.run("texmap square.obj -o out/a.png --size 16x16 --turntable 3 --resume");
    assert!(
        stderr(&again).contains("3 of 3 pictures were there already"),
        "{}",
        stderr(&again)
    );
}

#[test]
fn cameras_of_the_file_are_chosen_by_name() {
    let bench = bench();
    let triangle = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let data: String = triangle
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .map(|b| format!("%{b:02x}"))
        .collect();
    let json = serde_json::json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": 36, "uri": format!("data:,{data}") }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 1, "aspectRatio": 2, "znear": 0.1 } }],
        "nodes": [{ "mesh": 0 }, { "camera": 0, "name": "front", "translation": [0, 0, 0.5] }],
        "scenes": [{ "nodes": [0, 1], "name": "main" }],
    });
    bench.write("a.gltf", json.to_string().as_bytes());
    assert_refused(
        &bench,
        "texmap a.gltf -o out/a.png --camera-name back",
        "0 (front)",
    );
    assert_refused(&bench, "texmap a.gltf#other -o out/a.png", "0 (main)");
    assert_refused(
        &bench,
        "texmap a.gltf -o out/a.png --camera-name front --orbit 0,0",
        "--orbit",
    );
    assert_good(&bench.run("texmap a.gltf#main -o out/a.png --camera-name front"));
    let picture = read_png(&bench.path("out/a.png"));
    assert_eq!(
        (picture.0, picture.1),
        (1600, 800),
        "the proportions of the file"
    );
    assert_eq!(
        pixel(&picture, 900, 300)[3],
        255,
        "the triangle lies right above the middle"
    );
    assert_eq!(pixel(&picture, 700, 500)[3], 0, "and not left below it");
}

#[test]
fn models_that_are_none_are_refused() {
    let bench = bench();
    bench.write("empty.obj", b"");
    bench.write("far.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    bench.write("cut.glb", b"glTF\x02\0\0\0");
    bench.write(
        "dds.gltf",
        br#"{"asset":{"version":"2.0"},"extensionsRequired":["MSFT_texture_dds"]}"#,
    );
    bench.write(
        "lost.gltf",
        br#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":9,"uri":"lost.bin"}]}"#,
    );
    for (name, said) in [
        ("empty.obj", "empty.obj"),
        ("far.obj", "line 4"),
        ("cut.glb", "cut.glb"),
        ("dds.gltf", "MSFT_texture_dds"),
        ("lost.gltf", "lost.bin"),
        ("ball.raw", "ball.raw"),
        ("absent.glb", "absent.glb"),
        ("out", "out"),
    ] {
        assert_refused(&bench, &format!("texmap {name} -o out/a.png"), said);
    }
}

#[test]
fn options_that_mean_nothing_are_refused() {
    let bench = bench();
    let draw = "texmap square.obj -o out/a.png";
    assert_refused(&bench, "texmap square.obj#0 -o out/a.png", "no scenes");
    assert_refused(
        &bench,
        &format!("{draw} --camera-name 0"),
        "the file has none",
    );
    assert_refused(&bench, &format!("{draw} --subpixels 5"), "sub-pixels");
    assert_refused(
        &bench,
        &format!("{draw} --texture absent.png"),
        "absent.png",
    );
    assert_refused(
        &bench,
        &format!("{draw} --background absent.png"),
        "absent.png",
    );
    assert_refused(&bench, &format!("{draw} --light 0,0,1"), "--shade");
    assert_refused(&bench, "texmap square.obj -o square.obj", "square.obj");
}

#[test]
fn a_model_far_from_the_origin_is_framed_and_drawn_as_at_the_origin() {
    let bench = Bench::new();
    let drawn = |offset: f64| {
        let corner = |x: f64, y: f64, z: f64| format!("v {} {} {z}\n", x + offset, y - offset);
        let corners = [
            corner(-1.0, -1.0, 0.0),
            corner(1.0, -1.0, 0.5),
            corner(1.0, 1.0, 0.0),
            corner(-1.0, 1.0, 0.5),
        ];
        bench.write(
            "far.obj",
            format!("{}f 1 2 3\nf 1 3 4\n", corners.concat()).as_bytes(),
        );
        assert_good(&bench.run("texmap far.obj --size 64x64 -o out/far.exr"));
        read_exr(&bench.path("out/far.exr"))
    };
    let here = drawn(0.0);
    for offset in [1e5, 1e6, 1e7, 1e9] {
        let there = drawn(offset);
        let pairs = here.rgba.iter().flatten().zip(there.rgba.iter().flatten());
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-3, "{offset:e}: a channel changes by {worst}");
    }
}

#[test]
fn a_white_metal_in_even_light_is_as_bright_as_the_light() {
    let bench = Bench::new();
    let corners: [f32; 9] = [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0];
    let data: String = corners
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .map(|b| format!("%{b:02x}"))
        .collect();
    let json = serde_json::json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": 36, "uri": format!("data:,{data}") }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 }],
        "materials": [{ "pbrMetallicRoughness": { "roughnessFactor": 0.7 } }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
        "nodes": [{ "mesh": 0 }],
        "scenes": [{ "nodes": [0] }],
    });
    bench.write("a.gltf", json.to_string().as_bytes());
    let hdr = |width: usize, exponent: u8| {
        let mut file =
            format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X {width}\n").into_bytes();
        file.extend([128, 128, 128, exponent].repeat(4 * width));
        file
    };
    // Mantissas of a half: exponent 128 is 0.5, 127 a quarter.
    bench.write("even.hdr", &hdr(8, 127));
    bench.write("square.hdr", &hdr(4, 128));
    assert_refused(
        &bench,
        "texmap a.gltf --environment square.hdr -o out/a.png",
        "twice as wide",
    );
    assert_good(&bench.run(
        "texmap a.gltf --environment even.hdr --environment-turn 30 --size 64x64 --orbit 20,0 -o out/a.png",
    ));
    let (width, _, rgb) = read_png(&bench.path("out/a.png"));
    let middle = rgb[(36 * width as usize + 32) * 3];
    // sRGB of a quarter is 137.
    assert!((135..=139).contains(&middle), "{middle}");
    // Runs of one byte: 24 MiB of light in 132 kB.
    let [runs, rest] = [[255, 128], [128 + 16, 128]];
    let row = [
        vec![2, 2, 8, 0],
        [runs.repeat(16), rest.to_vec()].concat().repeat(4),
    ]
    .concat();
    let head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1024 +X 2048\n";
    bench.write("wide.hdr", &[head.to_vec(), row.repeat(1024)].concat());
    let words = "texmap a.gltf --environment wide.hdr --size 16x16 -o out/b.png";
    assert_good(&bench.run(words));
    let output = bench.run(&format!("{words} --max-memory 20M"));
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(said.contains("wide.hdr: the surroundings take"), "{said}");
    shadows_of_one_triangle(&bench);
}

/// A ground takes the shadow of a triangle, and shows nothing else; no other light has shadows.
fn shadows_of_one_triangle(bench: &Bench) {
    let words = |shadows: &str, out: &str| {
        format!(
            "texmap a.gltf --environment even.hdr --size 64x64 --orbit 20,30 {shadows} -o {out}"
        )
    };
    assert_good(&bench.run(&words("--shadows", "out/mesh.png")));
    assert_good(&bench.run(&words("--shadows=ground", "out/ground.png")));
    let opened = |name: &str| image::open(bench.path(name)).expect("a picture").to_rgba8();
    let (mesh, ground) = (opened("out/mesh.png"), opened("out/ground.png"));
    let mut shadow = 0;
    for (mesh, ground) in mesh.pixels().zip(ground.pixels()) {
        match (mesh.0, ground.0) {
            ([.., 0], [0, 0, 0, alpha]) if alpha > 0 => shadow += 1,
            // Beside the outline a little of the triangle is in the pixel.
            ([.., 0], [r, .., alpha]) if alpha > 16 => {
                assert!(r < 64, "the ground is black, not {r}");
            }
            ([.., 255], ground) => assert_eq!(ground, mesh.0),
            _ => {}
        }
    }
    assert!(shadow > 50, "{shadow} pixels of shadow");
    for (wrong, expected) in [
        ("--shadows --shade unlit", "surroundings"),
        ("--shadows=sky", "ground"),
    ] {
        let output = bench.run(&words(wrong, "out/no.png"));
        assert_eq!(output.status.code(), Some(2));
        let said = stderr(&output);
        assert!(said.contains(expected), "{said}");
        assert!(!bench.path("out/no.png").exists());
    }
}
