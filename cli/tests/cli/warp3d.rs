//! `resample warp3d` from end to end: a small picture with depth, made here, seen from elsewhere.

use std::fs;

use super::{Bench, assert_good, read_png, stderr};

/// Size of the test picture, px.
pub(super) const SIZE: [usize; 2] = [32, 24];

/// The options that the test picture needs.
pub(super) const VIEW: &str = "warp3d im.png z.pfm --intrinsics 30,30,15.5,11.5";

/// A folder with a picture, its depth (a wall at z = 4, a panel at z = 2), cameras, and an empty folder `out`.
pub(super) fn bench() -> Bench {
    let bench = Bench::new();
    let colour = |x: usize, y: usize| {
        if panel(x, y) {
            [220, 40, 40]
        } else {
            [(x * 7) as u8, (y * 9) as u8, 90]
        }
    };
    let pixels: Vec<u8> = pixels().flat_map(|(x, y)| colour(x, y)).collect();
    bench.write("im.png", &png_of(SIZE, &pixels));
    bench.write(
        "z.pfm",
        &pfm_of(SIZE, |x, y| if panel(x, y) { 2.0 } else { 4.0 }),
    );
    let pose = |x: f64| {
        let k = "\"W\": 32, \"H\": 24, \"fx\": 30, \"fy\": 30, \"cx\": 15.5, \"cy\": 11.5";
        format!("{{{k}, \"R\": [1,0,0,0,1,0,0,0,1], \"t\": [{x}, 0, 0]}}")
    };
    let cameras = format!(
        "{{\"ref\": {}, \"targets\": [{}, {}]}}",
        pose(0.0),
        pose(-0.2),
        pose(0.2)
    );
    bench.write("cameras.json", cameras.as_bytes());
    bench
}

fn pixels() -> impl Iterator<Item = (usize, usize)> {
    (0..SIZE[0] * SIZE[1]).map(|i| (i % SIZE[0], i / SIZE[0]))
}

fn panel(x: usize, y: usize) -> bool {
    (10..20).contains(&x) && (8..16).contains(&y)
}

pub(super) fn png_of([width, height]: [usize; 2], rgb: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(rgb))
        .expect("in memory");
    file
}

pub(super) fn pfm_of([width, height]: [usize; 2], z: impl Fn(usize, usize) -> f32) -> Vec<u8> {
    let mut file = format!("Pf\n{width} {height}\n-1\n").into_bytes();
    for y in (0..height).rev() {
        file.extend((0..width).flat_map(|x| z(x, y).to_le_bytes()));
    }
    file
}

/// The column at which the red panel begins in a row of an RGBA picture.
pub(super) fn panel_start(bytes: &[u8], width: usize, row: usize) -> Option<usize> {
    let pixel = |x: usize| &bytes[(row * width + x) * 4..][..4];
    (0..width).find(|&x| pixel(x)[0] > 180 && pixel(x)[1] < 80 && pixel(x)[3] > 200)
}

#[test]
fn a_step_to_the_right_moves_what_is_near_to_the_left() {
    let bench = bench();
    // f * 0.2 / z is 3 px for the panel and 1.5 px for the wall.
    for (to, expected) in [
        ("shift:0.2,0,0", 7),
        ("cameras.json#targets/0", 7),
        ("cameras.json#targets/1", 13),
    ] {
        assert_good(&bench.run(&format!("{VIEW} --method nearest --to {to} -o out/a.png")));
        let (width, height, bytes) = read_png(&bench.path("out/a.png"));
        assert_eq!((width, height), (32, 24), "size");
        assert_eq!(
            panel_start(&bytes, 32, 12),
            Some(expected),
            "the panel from {to}"
        );
    }
}

#[test]
fn a_far_sky_leaves_the_near_scene_as_it_is() {
    let bench = bench();
    // What renderers write where nothing is hit: the largest half, far planes, the largest floats.
    for sky in [65504.0, 1e6, 1e10, 1e30, f32::INFINITY] {
        let z = |x: usize, y: usize| match (y < 6, panel(x, y)) {
            (true, _) => sky,
            (false, true) => 2.0,
            (false, false) => 4.0,
        };
        bench.write("sky.pfm", &pfm_of(SIZE, z));
        let lens = "--intrinsics 30,30,15.5,11.5";
        for camera in ["shift:0.2,0,0", "cameras.json#targets/0"] {
            let output = format!("warp3d im.png sky.pfm {lens} --to {camera} -o out/a.png");
            assert_good(&bench.run(&output));
            let (_, _, bytes) = read_png(&bench.path("out/a.png"));
            assert_eq!(panel_start(&bytes, 32, 12), Some(7), "sky at {sky}");
            // Below the sky everything is seen, except behind the panel and beyond the border.
            let seen = |x: usize, y: usize| bytes[(y * 32 + x) * 4 + 3] == 255;
            let below = (7..24).all(|y| (0..29).all(|x| seen(x, y) || (15..20).contains(&x)));
            assert!(below, "sky at {sky}: a part of the wall is missing");
            let above = (0..5).all(|y| (0..29).all(|x| seen(x, y)));
            assert_eq!(above, sky.is_finite(), "sky at {sky}: infinity is unknown");
        }
    }
}

#[test]
fn the_identity_shows_the_picture_itself() {
    let bench = bench();
    assert_good(&bench.run(&format!(
        "{VIEW} --method nearest --to shift:0,0,0 -o out/a.png --filled out/mask.png"
    )));
    let (_, _, bytes) = read_png(&bench.path("out/a.png"));
    let (_, _, mask) = read_png(&bench.path("out/mask.png"));
    for (index, (x, y)) in pixels().enumerate() {
        let expected = if panel(x, y) {
            [220, 40, 40]
        } else {
            [(x * 7) as u8, (y * 9) as u8, 90]
        };
        assert_eq!(bytes[index * 4..][..3], expected, "pixel {x}, {y}");
        assert_eq!(mask[index], 0, "nothing is hidden at {x}, {y}");
    }
}

#[test]
fn what_was_hidden_is_in_the_mask_and_in_the_planes_of_an_exr() {
    let bench = bench();
    let planes = "--filled out/mask.png --confidence out/confidence.exr";
    assert_good(&bench.run(&format!(
        "{VIEW} --method nearest --to shift:0.4,0,0 -o out/a.exr {planes}"
    )));
    assert_eq!(
        bench.written(),
        ["a.exr", "confidence.exr", "mask.png"],
        "files"
    );
    let (_, _, mask) = read_png(&bench.path("out/mask.png"));
    // The panel moves by 6 px and the wall by 3: to the right of the panel 3 px were never seen.
    let row = &mask[12 * 32..13 * 32];
    let hidden = (4..28).filter(|&x| row[x] == 255).count();
    assert_eq!(hidden, 3, "the hole beside the panel: {row:?}");
    let meta =
        exr::meta::MetaData::read_from_file(bench.path("out/a.exr"), false).expect("an EXR file");
    let names: Vec<String> = meta.headers[0]
        .channels
        .list
        .iter()
        .map(|channel| channel.name.to_string())
        .collect();
    for name in ["R", "G", "B", "A", "Z", "filled", "confidence"] {
        assert!(
            names.iter().any(|found| found == name),
            "channel {name} among {names:?}"
        );
    }
}

#[test]
fn several_cameras_are_numbered_and_resumed() {
    let bench = bench();
    let words = format!("{VIEW} --method nearest --to cameras.json -o out/a.png");
    assert_good(&bench.run(&words));
    assert_eq!(
        bench.written(),
        ["a_0000.png", "a_0001.png", "a_0002.png"],
        "one for each camera of the file"
    );
    fs::remove_file(bench.path("out/a_0001.png")).expect("written before");
    let output = bench.run(&format!("{words} --resume"));
    assert!(
        stderr(&output).contains("2 of 3 pictures were there already"),
        "{}",
        stderr(&output)
    );
    assert_eq!(bench.written().len(), 3, "the missing one is drawn");
}

#[test]
fn stereo_quilts_anaglyphs_and_sways_have_their_sizes() {
    let bench = bench();
    let size = |words: &str, name: &str| {
        assert_good(&bench.run(&format!("{VIEW} --method nearest {words} -o out/{name}")));
        let (width, height, _) = read_png(&bench.path(&format!("out/{name}")));
        (width, height)
    };
    assert_eq!(size("--stereo 0.1", "pair.png"), (64, 24), "side by side");
    assert_eq!(
        size("--stereo 0.1 --anaglyph", "dubois.png"),
        (32, 24),
        "anaglyph"
    );
    assert_eq!(
        size("--stereo 0.1 --anaglyph grey", "grey.png"),
        (32, 24),
        "grey anaglyph"
    );
    assert_eq!(
        size("--quilt 3x2 --view-cone 20", "quilt.png"),
        (96, 48),
        "quilt"
    );
    assert_eq!(
        size("--quilt 2x1 --size 16x12 --convergence 3", "small.png"),
        (32, 12),
        "size of one view"
    );
    assert_good(&bench.run(&format!(
        "{VIEW} --method nearest --sway 3,4 -o out/sway.png"
    )));
    assert_eq!(
        bench
            .written()
            .iter()
            .filter(|name| name.starts_with("sway_"))
            .count(),
        4,
        "pictures of a sway"
    );
    assert_good(&bench.run(&format!(
        "{VIEW} --method nearest --sway 3,4 -o out/sway.apng"
    )));
}

#[test]
fn stereo_photographs_hold_both_views() {
    let bench = bench();
    let pair = format!("{VIEW} --method rows --stereo 0.1 --fill background");
    for name in ["pair.mpo", "pair.jps", "pair.png"] {
        assert_good(&bench.run(&format!("{pair} -o out/{name}")));
    }
    let decoded = |bytes: &[u8]| {
        let jpeg = image::load_from_memory_with_format(bytes, image::ImageFormat::Jpeg);
        jpeg.expect("a JPEG").to_rgb8()
    };
    let file = |name: &str| fs::read(bench.path(&format!("out/{name}"))).expect("written");
    let png = image::load_from_memory(&file("pair.png"))
        .expect("a PNG")
        .to_rgb8();
    let (half, whole) = (png.width() / 2, png.width());
    let mpo = file("pair.mpo");
    let begins = |at: &usize| mpo[*at..].starts_with(&[0xff, 0xd8, 0xff]);
    let second = (3..mpo.len()).find(begins).expect("a second picture");
    let views = [decoded(&mpo), decoded(&mpo[second..])];
    let crossed = decoded(&file("pair.jps"));
    // JPEG errs by a few codes on average.
    let off = |(x, y): (u32, u32), found: &image::Rgb<u8>| {
        let expected = png.get_pixel(x, y).0;
        let channels = expected.iter().zip(found.0);
        channels.map(|(a, b)| f64::from(a.abs_diff(b))).sum::<f64>() / 3.0
    };
    let mean = |picture: &image::RgbImage, from: u32| {
        let pixels = picture.enumerate_pixels();
        let sum: f64 = pixels
            .map(|(x, y, found)| off(((x + from) % whole, y), found))
            .sum();
        sum / f64::from(picture.width() * picture.height())
    };
    let errors = [
        mean(&views[0], 0),
        mean(&views[1], half),
        mean(&crossed, half),
    ];
    assert!(errors.iter().all(|&error| error < 6.0), "{errors:?}");
    assert!(
        mean(&views[0], half) > 2.0 * errors[0],
        "the views differ: {errors:?}"
    );
}

#[test]
fn a_path_moves_through_its_keys() {
    let bench = bench();
    let camera = |x: f64| {
        format!(
            "{{\"width\": 32, \"height\": 24, \"fx\": 30, \"fy\": 30, \"cx\": 16, \"cy\": 12, \
             \"R\": [1,0,0,0,1,0,0,0,1], \"t\": [{x}, 0, 0]}}"
        )
    };
    let keys = [0.0, -0.4].map(camera);
    let path = format!(
        "{{\"keys\": [{{\"time\": 0, \"camera\": {}}}, {{\"time\": 1, \"camera\": {}}}]}}",
        keys[0], keys[1]
    );
    bench.write("path.json", path.as_bytes());
    assert_good(&bench.run(&format!(
        "{VIEW} --method nearest --path path.json --fps 2 -o out/a.png"
    )));
    assert_eq!(
        bench.written().len(),
        3,
        "both ends and the middle: {:?}",
        bench.written()
    );
    let starts: Vec<_> = (0..3)
        .map(|i| {
            panel_start(
                &read_png(&bench.path(&format!("out/a_000{i}.png"))).2,
                32,
                12,
            )
            .expect("the panel")
        })
        .collect();
    assert_eq!(starts, [10, 7, 4], "the panel moves steadily");
}

#[test]
fn nothing_seen_is_a_warning_and_an_empty_picture() {
    let bench = bench();
    let output = bench.run(&format!("{VIEW} --to shift:0,0,100 -o out/a.png"));
    assert_good(&output);
    assert!(
        stderr(&output).contains("warning: nothing of the references is seen"),
        "{}",
        stderr(&output)
    );
    assert!(
        read_png(&bench.path("out/a.png"))
            .2
            .iter()
            .all(|&byte| byte == 0),
        "the picture is empty"
    );
}

#[test]
fn further_references_are_read() {
    let bench = bench();
    let words = format!(
        "{VIEW} --to shift:0.1,0,0 --reference im.png z.pfm cameras.json#targets/0 -o out/a.png"
    );
    assert_good(&bench.run(&format!("{words} --stats out/s.json")));
    let stats = fs::read_to_string(bench.path("out/s.json")).expect("written");
    assert!(
        stats.contains("\"references\": 2"),
        "both are counted: {stats}"
    );
    let absent = format!("{VIEW} --to shift:0,0,0 --reference im.png z.pfm no.json -o out/b.png");
    assert_eq!(
        bench.run(&absent).status.code(),
        Some(2),
        "a reference whose camera is absent"
    );
}
