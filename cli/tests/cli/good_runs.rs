//! Good runs: what is written, and what it holds.

use std::fs;

use serde_json::Value;

use super::{BALL, Bench, assert_good, read_png, stderr};

pub(super) fn stats(bench: &Bench) -> Value {
    let text = fs::read_to_string(bench.path("out/s.json")).expect("a stats file");
    serde_json::from_str(&text).expect("a JSON file")
}

#[test]
fn help_lists_the_commands_and_their_options() {
    let bench = Bench::new();
    let help = |words: &str| {
        let output = bench.run(words);
        assert_eq!(
            output.status.code(),
            Some(0),
            "`{words}`: {}",
            stderr(&output)
        );
        String::from_utf8(output.stdout).expect("text")
    };
    let short = help("--help");
    assert!(
        short.contains("demo") && short.contains("volsplat"),
        "commands: {short}"
    );
    let long = help("volsplat --help");
    for option in [
        "--dims",
        "--transfer",
        "--camera",
        "--orbit",
        "--stats",
        "--threads",
        "[default: hybrid]",
    ] {
        assert!(long.contains(option), "{option} is missing in: {long}");
    }
}

#[test]
fn png_shows_the_ball_in_the_middle_of_a_transparent_picture() {
    let bench = Bench::new();
    let output = bench.draw("--size 64x48 -o out/a.png");
    assert_good(&output);
    assert_eq!(bench.written(), ["a.png"], "one file");
    let said = stderr(&output);
    assert!(
        said.lines().count() == 2
            && said.starts_with("wrote out/a.png (64x48")
            && said.contains("its values were taken for a field"),
        "summary, and what the data decided: {said}"
    );
    let (width, height, rgba) = read_png(&bench.path("out/a.png"));
    assert_eq!((width, height), (64, 48), "size");
    let alpha = |x: usize, y: usize| rgba[(y * 64 + x) * 4 + 3];
    assert!(
        alpha(32, 24) > 64,
        "the ball is seen in the middle: alpha {}",
        alpha(32, 24)
    );
    assert_eq!(
        [alpha(0, 0), alpha(63, 0), alpha(0, 47), alpha(63, 47)],
        [0; 4],
        "corners are empty"
    );
}

#[test]
fn background_makes_the_picture_opaque() {
    let bench = Bench::new();
    assert_good(&bench.draw("--size 64x64 --background #ff8000 --quiet -o out/a.png"));
    let (_, _, rgba) = read_png(&bench.path("out/a.png"));
    assert_eq!(
        rgba[..4],
        [255, 128, 0, 255],
        "the corner shows the colour as it was given"
    );
    assert!(
        rgba.chunks(4).all(|pixel| pixel[3] == 255),
        "every pixel is opaque"
    );
}

#[test]
fn a_list_of_cameras_gives_numbered_pictures() {
    let bench = Bench::new();
    let camera = |z: i32| {
        format!(
            r#"{{"position": [15.5, 15.5, {z}], "target": [15.5, 15.5, 15.5], "up": [0, 1, 0]}}"#
        )
    };
    bench.write(
        "cams.json",
        format!("[{}, {}]", camera(99), camera(-99)).as_bytes(),
    );
    assert_good(&bench.draw("--size 32x32 --camera cams.json -o out/a.png --stats out/s.json"));
    assert_eq!(
        bench.written(),
        ["a_0000.png", "a_0001.png", "s.json"],
        "numbers before the extension"
    );
    assert_eq!(
        stats(&bench)["frames"].as_array().map(Vec::len),
        Some(2),
        "one entry per picture"
    );
    assert_good(&bench.draw("--size 32x32 --camera cams.json -o out/b%02d.png"));
    assert!(
        bench.path("out/b01.png").is_file(),
        "a pattern is filled in: {:?}",
        bench.written()
    );
    bench.write("one.json", format!("[{}]", camera(99)).as_bytes());
    assert_good(&bench.draw("--size 32x32 --camera one.json -o out/c.png"));
    assert!(
        bench.path("out/c_0000.png").is_file(),
        "a list of one is still a list: {:?}",
        bench.written()
    );
}

#[test]
fn a_calibrated_camera_brings_its_own_size() {
    let bench = Bench::new();
    // 60 units behind the ball's centre, which is at 15.5 on each axis.
    let camera = r#"{"width": 48, "height": 40, "fx": 40, "fy": 40, "cx": 23.5, "cy": 19.5,
        "pixel_centre": "integer", "R": [1, 0, 0, 0, 1, 0, 0, 0, 1], "t": [-15.5, -15.5, 44.5]}"#;
    bench.write("cam.json", camera.as_bytes());
    assert_good(&bench.draw("--camera cam.json -o out/a.png"));
    let (width, height, rgba) = read_png(&bench.path("out/a.png"));
    assert_eq!((width, height), (48, 40), "the camera's own size");
    // The principal point is the middle of the picture, so the ball is symmetric in it.
    let alpha = |x: usize, y: usize| i32::from(rgba[(y * 48 + x) * 4 + 3]);
    let uneven = (0..40).flat_map(|y| (0..48).map(move |x| (x, y)));
    let uneven = uneven
        .map(|(x, y)| (alpha(x, y) - alpha(47 - x, 39 - y)).abs())
        .max();
    assert!(
        uneven <= Some(2),
        "turned by 180 degrees the ball looks the same, but alpha differs by {uneven:?}"
    );
    assert_good(&bench.draw("--camera cam.json --size 24x20 -o out/b.png"));
    assert_eq!(read_png(&bench.path("out/b.png")).0, 24, "--size wins");
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let bench = Bench::new();
    for extension in ["png", "exr"] {
        let bytes = [1, 2, 7].map(|threads| {
            let name = format!("out/t{threads}.{extension}");
            assert_good(&bench.draw(&format!("--size 64x64 --threads {threads} -o {name}")));
            fs::read(bench.path(&name)).expect("written")
        });
        assert!(
            bytes[0] == bytes[1] && bytes[0] == bytes[2],
            "{extension}: threads must not change a byte"
        );
    }
}

#[test]
fn every_view_option_gives_a_picture() {
    let bench = Bench::new();
    for (index, words) in [
        "--orbit 0,90",
        "--orbit -30,-90,2",
        "--up -z --orbit 10,5",
        "--projection orthographic",
        "--projection orthographic --orbit 0,0,0.5",
        "--fov 90 --bits 16",
        "--spacing 1,1,2 --origin -5,0,1e6",
        "--colormap viridis --opacity-unit 3",
        "--order every-sample",
        "--order axis-sheets --kernel polynomial",
        "--order image-sheets --kernel gaussian --select points --classify post",
        "--kernel b-spline --slab 1 --classify pre",
        "--order image-sheets --slab 1 --subpixels 2",
        "--slab 1 --subpixels auto",
        "--shade phong --light 1,2,-3",
        "--light 1,2,-3 --shadows --light-size 5",
        "--occlusion",
        "--occlusion=2.5 --light 1,2,-3 --shadows",
        "--shade lambert --projection orthographic",
        "--shade phong --order every-sample",
        "--shade lambert --order axis-sheets --gradient-opacity 0,5",
        "--select ewa --footprint affine",
        "--colour-by select",
    ]
    .into_iter()
    .enumerate()
    {
        assert_good(&bench.draw(&format!("--size 24x24 -o out/{index}.png {words}")));
        let (.., rgba) = read_png(&bench.path(&format!("out/{index}.png")));
        assert!(rgba.iter().any(|&byte| byte > 0), "`{words}` shows nothing");
    }
}

#[test]
fn options_choose_their_order_and_a_single_slice_is_drawn() {
    let bench = Bench::new();
    let order = |words: &str| {
        assert_good(&bench.draw(&format!(
            "--size 8x8 -o out/a.png --stats out/s.json {words}"
        )));
        stats(&bench)["settings"]["render"]["order"].clone()
    };
    assert!(order("")["field"].is_object());
    assert!(order("--slab 0.5")["field"].is_object());
    assert!(order("--blend maximum")["field"].is_object());
    assert_eq!(order("--select splats")["samples"]["order"], "every-sample");
    assert!(order("--classify pre")["samples"]["order"]["image-sheets"].is_object());
    assert!(
        order("--interpolate --kernel b-spline")["samples"]["order"]["image-sheets"].is_object()
    );
    bench.write("slice.raw", &[200; 64]);
    let words = "volsplat slice.raw --dims 8,8,1 --type u8 --size 8x8 --orbit 0,0 -o out/b.png";
    assert_good(&bench.run(words));
}

#[test]
fn a_fully_transparent_volume_gives_an_empty_picture_and_a_warning() {
    let bench = Bench::new();
    let transparent = r#"[{"ColorSpace": "RGB", "RGBPoints": [0, 1, 1, 1, 255, 1, 1, 1],
        "Points": [0, 0, 0.5, 0, 255, 0, 0.5, 0]}]"#;
    bench.write("tf.json", transparent.as_bytes());
    let output = bench.draw("--transfer tf.json --size 16x16 -o out/a.png");
    assert_good(&output);
    let said = stderr(&output);
    assert!(
        said.contains("warning: nothing is visible") && said.contains("ball.raw"),
        "{said}"
    );
    let (.., rgba) = read_png(&bench.path("out/a.png"));
    assert!(
        rgba.iter().all(|&byte| byte == 0),
        "the picture is transparent"
    );
}

#[test]
fn verbose_prints_stage_times_and_quiet_prints_nothing() {
    let bench = Bench::new();
    let output = bench.draw("--size 24x24 --verbose -o out/a.png");
    assert_good(&output);
    let said = stderr(&output);
    assert!(
        said.contains("load ") && said.contains("composite "),
        "{said}"
    );
    let output = bench.run(&format!(
        "--quiet volsplat ball.raw {BALL} --size 24x24 -o out/b.png"
    ));
    assert_good(&output);
    assert_eq!(stderr(&output), "", "quiet is quiet");
}

#[test]
fn demo_needs_no_file() {
    let bench = Bench::new();
    let output = bench.run("demo --size 32x32 -o out/demo");
    assert_good(&output);
    let page = fs::read_to_string(bench.path("out/demo/index.html")).expect("a page");
    assert_eq!(page.matches("<section>").count(), 6, "{page}");
    // Of shadow and occlusion no error is measured.
    assert_eq!(page.matches(" dB</figcaption>").count(), 10, "{page}");
    // Each command draws its picture again.
    for line in page.split("<pre>").skip(1) {
        let command = line.split("</pre>").next().expect("a command");
        let words = command.strip_prefix("resample ").expect("a command");
        let file = words.split(' ').next_back().expect("a name");
        let shown = fs::read(bench.path(file)).expect("a picture");
        assert_good(&bench.run(words));
        assert!(
            shown == fs::read(bench.path(file)).expect("again"),
            "{command}"
        );
    }
    assert!(
        stderr(&output).contains("out/demo"),
        "it says where: {}",
        stderr(&output)
    );
    assert_eq!(
        bench.run("demo -o absent/demo").status.code(),
        Some(2),
        "the parent folder must exist"
    );
}

#[test]
fn a_jpeg_is_opaque_and_a_dash_is_the_standard_output() {
    let bench = Bench::new();
    assert_good(&bench.draw("--size 24 -o out/a.jpg"));
    assert_good(&bench.draw("--size 24x24 --background black -o out/a.png"));
    let jpeg = fs::read(bench.path("out/a.jpg")).expect("written");
    assert!(jpeg.starts_with(b"\xff\xd8\xff"), "a JPEG");
    let said = bench.run("compare out/a.jpg out/a.png --fail-above flip=0.1");
    assert!(said.status.success(), "{}", stderr(&said));
    let piped = bench.draw("--size 24 --background black -o -");
    assert!(piped.status.success(), "{}", stderr(&piped));
    let file = fs::read(bench.path("out/a.png")).expect("written");
    assert!(piped.stdout == file, "the file itself, and nothing else");
    assert_eq!(bench.written(), ["a.jpg", "a.png"]);
    for words in ["--turntable 2 -o -", "--bits 16 -o out/b.jpg"] {
        assert_eq!(bench.draw(words).status.code(), Some(2), "{words}");
    }
}

#[test]
fn shells_and_man_learn_every_command() {
    let bench = Bench::new();
    for shell in ["bash", "zsh", "fish"] {
        let output = bench.run(&format!("completions {shell}"));
        assert!(output.status.success(), "{}", stderr(&output));
        let text = String::from_utf8(output.stdout).expect("text");
        assert!(text.contains("volsplat") && text.contains("max-error"));
    }
    assert_good(&bench.run("man out"));
    let written = bench.written();
    for page in ["resample.1", "resample-volsplat.1", "resample-view.1"] {
        assert!(written.contains(&page.to_owned()), "{written:?}");
        let text = fs::read_to_string(bench.path(&format!("out/{page}"))).expect("a page");
        assert!(text.contains(".SH NAME"), "{page}");
    }
    assert_eq!(bench.run("man absent").status.code(), Some(2));
}
