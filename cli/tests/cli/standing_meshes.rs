//! Meshes, isosurfaces and slices that stand in a volume: `--mesh FILE[:COLOUR[,OPACITY]]`, `--with-iso VALUE[:COLOUR[,OPACITY]]`,
//! `--with-slice PLACE[:LOW,HIGH]`.

use std::fs;

use super::{BALL, Bench, assert_good, stderr};

/// A rod through the ball, from before it to behind it: a box from the volume's left to its right, 32 voxels wide.
const ROD: &str = "v -8 14 14\nv 40 14 14\nv 40 18 14\nv -8 18 14\nv -8 14 18\nv 40 14 18\nv 40 18 18\nv -8 18 18\n\
    f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 4 3 7 8\nf 1 4 8 5\nf 2 6 7 3\n";

/// A square before the ball.
const PANE: &str = "v 0 0 40\nv 31 0 40\nv 31 31 40\nv 0 31 40\nf 1 2 3 4\n";

const FRONT: &str = "--orbit 0,0 --size 64x64 --background black";

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("rod.obj", ROD.as_bytes());
    bench.write("pane.obj", PANE.as_bytes());
    bench
}

fn picture(bench: &Bench, words: &str) -> image::RgbImage {
    let command = format!("volsplat ball.raw {BALL} {FRONT} -o out/a.png {words}");
    assert_good(&bench.run(&command));
    image::open(bench.path("out/a.png"))
        .expect("a picture")
        .to_rgb8()
}

#[test]
fn a_rod_stands_out_on_both_sides_and_lies_behind_the_ball() {
    let bench = bench();
    let window = "--window 128,10";
    let with = picture(&bench, &format!("{window} --mesh rod.obj:#ff0000"));
    let is_red = |image: &image::RgbImage, x: u32| {
        let [r, g, b] = image.get_pixel(x, 32).0;
        r > 100 && g < 20 && b < 20
    };
    // The view holds the whole rod; the ball, opaque from the value 133 on, hides its middle.
    assert!(
        is_red(&with, 8) && is_red(&with, 55),
        "both ends of the rod"
    );
    assert!(!is_red(&with, 32), "the ball hides the middle");
    assert!(
        !is_red(&with, 1) && !is_red(&with, 62),
        "the view holds the rod"
    );
    let clipped = picture(
        &bench,
        &format!("{window} --clip-plane 0,0,-1,-14 --mesh rod.obj:red"),
    );
    assert!(
        is_red(&clipped, 32),
        "a clip of the volume bares the middle"
    );
    let green = picture(&bench, &format!("{window} --mesh rod.obj:0,255,0"));
    let [r, g, _] = green.get_pixel(8, 32).0;
    assert!(g > 100 && r < 20);
    // The light from above leaves the side of the rod with ambient light.
    let lit = picture(
        &bench,
        &format!("{window} --light 0,1,0 --mesh rod.obj:red"),
    );
    assert!(lit.get_pixel(8, 32).0[0] < with.get_pixel(8, 32).0[0] - 20);
}

#[test]
fn a_translucent_pane_mixes_with_the_volume_behind_it() {
    let bench = bench();
    let window = "--window 128,10 --shade none --colormap greys --camera out/view.json";
    let view = format!("volsplat ball.raw {BALL} {FRONT} -o out/a.png --save-camera out/view.json");
    assert_good(&bench.run(&view));
    let bench = &bench;
    let at = |words: &str| {
        let words = format!("volsplat ball.raw {BALL} -o out/a.exr {window} {words}");
        assert_good(&bench.run(&words));
        let picture = resample_io::rendered::read(&bench.path("out/a.exr")).expect("a picture");
        picture.pixel(32, 32)
    };
    let bare = at("");
    let solid = at("--mesh pane.obj:#ff0000");
    let veiled = at("--mesh pane.obj:#ff0000,0.25");
    for channel in 0..3 {
        let expected = 0.75 * bare[channel] + 0.25 * solid[channel];
        assert!(
            (veiled[channel] - expected).abs() < 2e-3,
            "{veiled:?}: {bare:?} {solid:?}"
        );
    }
    // In any order.
    let two = [
        "--mesh pane.obj:red,0.5 --mesh rod.obj:blue",
        "--mesh rod.obj:blue --mesh pane.obj:red,0.5",
    ];
    assert_eq!(at(two[0]), at(two[1]));
}

#[test]
fn tiles_and_threads_give_the_bytes_of_the_whole_picture() {
    let bench = bench();
    let words = format!(
        "volsplat ball.raw {BALL} --mesh rod.obj:red --mesh pane.obj:blue,0.3 --size 70x50"
    );
    assert_good(&bench.run(&format!("{words} -o out/whole.exr --threads 1")));
    assert_good(&bench.run(&format!("{words} -o out/two.exr --threads 2")));
    let read = |name: &str| fs::read(bench.path(name)).expect("written");
    assert!(read("out/whole.exr") == read("out/two.exr"));
    for tile in ["0,0", "1,0", "2,0", "0,1", "1,1", "2,1"] {
        assert_good(&bench.run(&format!("{words} -o out/t.exr --tile {tile}/3x2")));
    }
    let tiles = (0..6).map(|at| format!("out/t.tile-{}-{}.exr", at % 3, at / 3));
    let tiles = tiles.collect::<Vec<_>>().join(" ");
    assert_good(&bench.run(&format!("join {tiles} -o out/joined.exr")));
    assert!(read("out/whole.exr") == read("out/joined.exr"));
}

#[test]
fn statistics_name_the_meshes_and_their_time() {
    let bench = bench();
    picture(&bench, "--mesh rod.obj:red,0.5 --stats out/a.json");
    let stats = fs::read_to_string(bench.path("out/a.json")).expect("written");
    let stats: serde_json::Value = serde_json::from_str(&stats).expect("JSON");
    let mesh = &stats["settings"]["scene"]["meshes"][0];
    assert_eq!(mesh["file"], "rod.obj");
    assert_eq!(mesh["opacity"], 0.5);
    let text = stats.to_string();
    assert!(text.contains("\"meshes\":{\"cpu_ms\""), "{text}");
}

#[test]
fn meshes_that_cannot_stand_are_refused() {
    let bench = bench();
    bench.write("none.obj", b"");
    for (words, why) in [
        ("--mesh gone.stl:red", "gone.stl"),
        ("--mesh none.obj", "none.obj"),
        (
            "--mesh rod.obj:rot",
            "expected #rrggbb, R,G,B from 0 to 255, or one of white",
        ),
        (
            "--mesh rod.obj:red,2",
            "the opacity is 2, expected above 0 and at most 1",
        ),
        (
            "--mesh rod.obj --order every-sample",
            "--mesh, --with-iso and --with-slice go with the field alone",
        ),
    ] {
        let output = bench.run(&format!("volsplat ball.raw {BALL} -o out/a.png {words}"));
        assert!(!output.status.success(), "{words}");
        let said = stderr(&output);
        assert!(said.contains(why), "{words}: {said}");
        assert!(!bench.path("out/a.png").exists(), "{words}");
    }
}

#[test]
fn isosurfaces_stand_in_the_volume_one_behind_another() {
    let bench = bench();
    let veil = "--window 200,400 --shade none --colormap greys --opacity-scale 0.01";
    let pixel = |words: &str| {
        picture(&bench, &format!("{veil} {words}"))
            .get_pixel(32, 32)
            .0
            .map(u32::from)
    };
    let [r, g, b] = pixel("--with-iso 200:red");
    assert!(r > 2 * g.max(b), "red through a veil: {r} {g} {b}");
    let [r, g, b] = pixel("--with-iso 200:red --with-iso 100:blue");
    assert!(b > 2 * r.max(g), "the outer one hides it: {r} {g} {b}");
    let [r, _, b] = pixel("--with-iso 200:red --with-iso 100:blue,0.5");
    assert!(
        b > 60 && r > 60,
        "and half of it shows the inner one: {r} {b}"
    );
    let with_rod = picture(
        &bench,
        &format!("{veil} --with-iso 100:blue,0.5 --mesh rod.obj:red"),
    );
    let [r, _, b] = with_rod.get_pixel(32, 32).0;
    assert!(r > 40 && b > 40, "a rod inside: {r} {b}");
    let refused = bench.run(&format!(
        "volsplat ball.raw {BALL} --order every-sample --with-iso 100 -o out/b.png"
    ));
    assert!(!refused.status.success());
    assert!(
        stderr(&refused).contains("leave them out"),
        "{}",
        stderr(&refused)
    );
    let refused = bench.run(&format!(
        "volsplat ball.raw {BALL} --with-iso bone -o out/b.png"
    ));
    assert!(
        stderr(&refused).contains("300:white,0.5"),
        "{}",
        stderr(&refused)
    );
}

#[test]
fn slices_stand_in_the_volume() {
    let bench = bench();
    let unseen = "--window 200,400 --shade none --opacity-scale 0.000001";
    let pixel = |words: &str| {
        let command = format!(
            "volsplat ball.raw {BALL} {unseen} {words} --camera front.json --size 64x64 --background black -o out/s.png"
        );
        assert_good(&bench.run(&command));
        let drawn = image::open(bench.path("out/s.png")).expect("a picture");
        drawn.to_rgb8().get_pixel(32, 32).0
    };
    let camera = r#"{"position": [15.5, 15.5, 80], "target": [15.5, 15.5, 15.5], "up": [0, 1, 0], "fov_y": 30}"#;
    bench.write("front.json", camera.as_bytes());
    let ball = super::ball();
    let middle = u32::from(ball[16 + 32 * (16 + 32 * 16)]);
    for words in ["z=16:0,255", "1,0,1,32:0,255", "0,0.5,0.5,16:0,255"] {
        let [r, g, b] = pixel(&format!("--with-slice {words}")).map(u32::from);
        assert_eq!([g, b], [r; 2], "{words}: it is grey");
        // It falls by 20 in a voxel, and between voxels its tip is blunt.
        assert!(
            r.abs_diff(middle) < 20,
            "{words}: {r}, the voxel is {middle}"
        );
    }
    let narrow = pixel("--with-slice z=16:250,300");
    assert_eq!(narrow, [0; 3], "below its window it is black");
    // The rod reaches from z = 14 to 18.
    let [before, behind] = ["z=24", "z=8"].map(|place| {
        let words = format!("--mesh rod.obj:red --with-slice {place}:0,255");
        let [r, g, _] = pixel(&words);
        (r, g)
    });
    assert_eq!(before.0, before.1, "the slice hides the rod");
    assert!(
        behind.0 > 2 * behind.1,
        "the rod hides the slice: {behind:?}"
    );
    // Channels and labels have their own colours.
    let labels: Vec<u8> = ball.iter().map(|&value| u8::from(value > 100)).collect();
    bench.write("labels.raw", &labels);
    bench.write("colours.csv", b"1,255,0,0,0.000001\n");
    let command = format!(
        "volsplat labels.raw {BALL} {FRONT} --labels --label-colours colours.csv --with-slice z=16 -o out/l.png"
    );
    assert_good(&bench.run(&command));
    let drawn = image::open(bench.path("out/l.png"))
        .expect("a picture")
        .to_rgb8();
    assert_eq!(drawn.get_pixel(32, 32).0, [255, 0, 0]);
    for (place, why) in [
        ("z=32", "the volume has 32 voxels there"),
        ("0,0,1,99", "the plane lies beside the volume"),
        ("w=3", "such as z=77"),
        ("0,0,0,1", "such as z=77"),
        ("z=3:5,2", "5,2"),
    ] {
        let refused = bench.run(&format!(
            "volsplat ball.raw {BALL} --with-slice {place} -o out/b.png"
        ));
        assert_eq!(refused.status.code(), Some(2), "{place}");
        assert!(
            stderr(&refused).contains(why),
            "{place}: {}",
            stderr(&refused)
        );
    }
}

/// The ball as NIfTI whose window is 60 to 80.
fn ball_with_window() -> Vec<u8> {
    let mut head = vec![0; 352];
    let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &348i32.to_le_bytes());
    put(40, &[3i16, 32, 32, 32].map(i16::to_le_bytes).concat());
    // Unsigned, 8 bits.
    put(70, &[2i16, 8].map(i16::to_le_bytes).concat());
    put(76, &[1.0f32; 4].map(f32::to_le_bytes).concat());
    put(108, &352.0f32.to_le_bytes());
    put(124, &[80.0f32, 60.0].map(f32::to_le_bytes).concat());
    put(344, b"n+1\0");
    [head, super::ball()].concat()
}

#[test]
fn slices_begin_with_the_window_of_the_file() {
    let bench = Bench::new();
    bench.write("ball.nii", &ball_with_window());
    let drawn = |place: &str| {
        let command = format!("volsplat ball.nii {FRONT} --with-slice {place} -o out/s.png");
        assert_good(&bench.run(&command));
        fs::read(bench.path("out/s.png")).expect("a picture")
    };
    let own = drawn("z=16");
    assert!(own == drawn("z=16:60,80"), "the window of the file");
    assert!(own != drawn("z=16:0,255"), "not any window");
    let told = bench.run("info ball.nii");
    let text = String::from_utf8_lossy(&told.stdout).into_owned();
    assert!(text.contains("window     60 to 80, of slices"), "{text}");
    let scaled = bench.run("info ball.nii --rescale-values=-2,10 --json");
    let json: serde_json::Value = serde_json::from_slice(&scaled.stdout).expect("JSON");
    assert_eq!(json["window"], serde_json::json!([-150.0, -110.0]));
}
