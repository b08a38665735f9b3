//! `resample view`: who is let in, what the page may ask for, and that a resting picture is the command line's.

use std::io::{Read, Write};
use std::net::TcpStream;

use serde_json::{Value, json};
use tungstenite::Message;

use super::{BALL, Bench, points, warp3d};
use page::{Viewer, run_copied, view, with};

mod beside;
mod browser;
mod choices;
mod colours;
mod figures;
mod kept;
mod page;
mod waiting;

/// What a page shows at rest, and what the copied command writes, are the same file.
fn assert_same(bench: &Bench, words: &str, more: Value) {
    let viewer = Viewer::start(bench, words);
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let view = view(&scene, more);
    let shown = page.rest(&view);
    page.say(&with(&view, json!({ "type": "command" })));
    let command = page.hear("command");
    let written = run_copied(bench, command["text"].as_str().expect("a text"));
    assert!(
        shown == written,
        "{words}: {} and {} bytes",
        shown.len(),
        written.len()
    );
}

/// A transfer function that shows more than the automatic one.
fn transfer() -> Value {
    json!({
        "ColorSpace": "RGB",
        "Points": [0.0, 0.0, 0.5, 0.0, 17.3, 0.21, 0.5, 0.0, 255.0, 0.9, 0.5, 0.0],
        "RGBPoints": [0.0, 0.1, 0.2, 0.7, 255.0, 0.9, 0.4, 0.1],
    })
}

#[test]
fn a_resting_volume_is_the_command_lines_picture() {
    let bench = Bench::new();
    for more in [
        json!({}),
        json!({ "transfer": transfer(), "changes": { "shade": ["phong"], "light": ["1,2,3"] } }),
        json!({ "changes": { "blend": ["maximum"], "colormap": ["magma"], "background": ["white"] } }),
        json!({ "changes": { "iso": ["100"], "crop": ["3,3,3,25,31,31"] } }),
        json!({ "changes": { "clip-plane": ["0.6,0,0.8,12"], "opacity-scale": ["2"] } }),
        json!({ "exactness": "default", "changes": { "order": ["every-sample"] } }),
        json!({ "exactness": "exact" }),
        json!({ "exactness": "1/255", "changes": { "shade": ["phong"] } }),
        json!({ "exactness": "1/64", "transfer": transfer() }),
    ] {
        assert_same(&bench, &format!("ball.raw {BALL}"), more);
    }
    super::assert_good(&bench.draw("--size 40x30 -o behind.png"));
    let behind = format!("ball.raw {BALL} --background behind.png");
    assert_same(&bench, &behind, json!({}));
    assert_same(
        &bench,
        &format!("ball.raw {BALL} --projection orthographic"),
        json!({}),
    );
}

#[test]
fn resting_gaussians_are_the_command_lines_picture() {
    let bench = Bench::new();
    bench.write("a.bin", &super::gaussians::ply(0));
    for more in [
        json!({}),
        json!({ "changes": { "samples": ["4"], "slab-error": ["0.05"], "background": ["white"] } }),
        json!({ "changes": { "clip-plane": ["0,1,0,0.1"] }, "exactness": "exact" }),
        json!({ "exactness": "1/255" }),
    ] {
        assert_same(&bench, "a.bin", more);
    }
}

#[test]
fn labels_and_channels_in_the_pages_colours_are_the_command_lines_pictures() {
    let bench = Bench::new();
    let labels = json!({ "200": { "colour": "#ff0000", "opacity": 0.5 }, "210": { "colour": "#0000ff", "opacity": 1 } });
    let ball = format!("ball.raw {BALL}");
    assert_same(&bench, &format!("{ball} --labels"), json!({}));
    assert_same(
        &bench,
        &format!("{ball} --labels"),
        json!({ "labels": labels }),
    );
    let words = format!("{ball} --channel 0:red --also ball.raw viridis");
    assert_same(&bench, &words, json!({}));
    assert_same(
        &bench,
        &words,
        json!({ "changes": { "channel": ["0:#00ff80"] } }),
    );
}

#[test]
fn labels_and_channels_are_told_to_the_page() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL} --labels"));
    let volume = viewer.page().hear("scene")["volume"].clone();
    let labels = volume["labels"].as_array().expect("a list");
    let voxels = super::ball();
    let count = |label: &Value| {
        let is = |voxel: &&u8| label["label"] == **voxel;
        voxels.iter().filter(is).count()
    };
    let counts: Vec<usize> = labels.iter().map(count).collect();
    assert!(counts.is_sorted_by(|a, b| a >= b), "{counts:?}");
    let coloured = voxels.iter().filter(|voxel| **voxel > 0).count();
    assert_eq!(counts.iter().sum::<usize>(), coloured, "all but 0");
    assert_eq!(volume["function"], Value::Null);
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL} --channel 0:red"));
    let volume = viewer.page().hear("scene")["volume"].clone();
    let channel = &volume["channels"][0];
    assert_eq!(
        (&channel["number"], &channel["look"]),
        (&json!("0"), &json!("red"))
    );
    let colour = [0, 1, 2].map(|k| channel["colour"][k].as_f64().expect("a number"));
    assert!(colour[0] > 0.999 && colour[1..] == [0.0; 2], "{colour:?}");
    assert_eq!(volume["function"], Value::Null);
}

/// A bench with a square whose texture is a photograph.
fn textured() -> Bench {
    let bench = warp3d::bench();
    bench.write(
        "square.obj",
        b"v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n",
    );
    bench
}

#[test]
fn a_resting_mesh_and_a_resting_warp_are_the_command_lines_pictures() {
    let bench = textured();
    for changes in [
        json!({ "shade": ["lambert"] }),
        json!({ "textures": ["grid"] }),
        json!({ "textures": ["left-out"], "shade": ["unlit"] }),
    ] {
        let words = "square.obj --up z --texture im.png";
        assert_same(&bench, words, json!({ "changes": changes }));
    }
    let words = "im.png z.pfm --intrinsics 30,30,15.5,11.5";
    assert_same(&bench, words, json!({}));
    assert_same(
        &bench,
        words,
        json!({ "changes": { "fill": ["background"] } }),
    );
    assert_same(&bench, "im.png z.pfm", json!({}));
}

#[test]
fn a_resting_scan_is_the_command_lines_picture() {
    let bench = points::bench();
    for changes in [
        json!({}),
        json!({ "color-by": ["height"], "colormap": ["magma"], "shade": ["lambert"] }),
        json!({ "color-by": ["class"], "crop": ["0,0,-1,40,40,9"] }),
        json!({ "blend": ["mean"], "clip-plane": ["1,0,0,20"] }),
        json!({ "color-by": ["height"], "colour-bar": ["on"], "axes": ["box"], "scale-bar": ["on"], "caption": ["Hill"] }),
    ] {
        assert_same(&bench, "hill.ply --up z", json!({ "changes": changes }));
    }
    for exactness in ["exact", "1/255"] {
        let words = "hill.ply --up z --color-by height --points 2000";
        assert_same(&bench, words, json!({ "exactness": exactness }));
    }
}

#[test]
fn moving_pictures_come_at_once_and_only_the_newest_counts() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let view = view(&scene, json!({}));
    for id in 1..=40 {
        page.say(&with(
            &view,
            json!({ "type": "draw", "id": id, "motion": "moving" }),
        ));
    }
    let mut ids = Vec::new();
    while ids.last() != Some(&40) {
        if let Message::Binary(bytes) = page.read() {
            let (head, picture) = page.shown(&bytes);
            assert_eq!(
                (&head["kind"], &picture[..2]),
                (&json!("moving"), &[0xFF, 0xD8][..]),
                "a JPEG"
            );
            ids.push(head["id"].as_u64().expect("a number"));
        }
    }
    assert!(ids.is_sorted() && ids.len() < 40, "{ids:?}");
}

#[test]
fn nothing_is_answered_without_the_token_or_to_other_names() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let (host, token) = (&viewer.host, &viewer.token);
    let own = format!("Host: {host}\r\n");
    let (status, body) = viewer.get(&format!("/{token}/"), &own);
    assert!(
        status.contains("200") && body.contains("</html>"),
        "{status}"
    );
    for outside in ["http://", "https://", "src=\"/", "@import"] {
        assert!(
            !body.contains(outside),
            "no request leaves the machine: {outside}"
        );
    }
    for path in [
        "/",
        "/x/",
        "/favicon.ico",
        &format!("/{token}x/"),
        &format!("/{token}/socket"),
    ] {
        assert!(viewer.get(path, &own).0.contains("404"), "{path}");
    }
    let page = format!("/{token}/");
    assert!(
        viewer
            .get(&page, "Host: evil.example\r\n")
            .0
            .contains("403")
    );
    let upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    for origin in ["Origin: http://evil.example\r\n", "Origin: null\r\n", ""] {
        let socket = viewer.get(
            &format!("/{token}/socket"),
            &format!("{own}{upgrade}{origin}"),
        );
        assert!(socket.0.contains("403"), "{origin}: {}", socket.0);
    }
}

#[test]
fn requests_that_never_end_keep_no_page_waiting() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let begun: Vec<TcpStream> = (0..100)
        .map(|_| {
            let mut stream = TcpStream::connect(&viewer.host).expect("it listens");
            stream.write_all(b"GET / HTTP/1.1\r\n").expect("it reads");
            stream
        })
        .collect();
    let own = format!("Host: {}\r\n", viewer.host);
    for _ in 0..3 {
        let (status, _) = viewer.get(&format!("/{}/", viewer.token), &own);
        assert!(status.contains("200"), "{status}");
    }
    drop(begun);
}

#[test]
fn frames_of_other_sites_are_refused_and_those_of_notebooks_allowed() {
    let bench = Bench::new();
    let words = format!("ball.raw {BALL} --allow-host hub.example --allow-host x;y");
    let viewer = Viewer::start(&bench, &words);
    let mut stream = TcpStream::connect(&viewer.host).expect("it listens");
    let (host, token) = (&viewer.host, &viewer.token);
    write!(stream, "GET /{token}/ HTTP/1.1\r\nHost: {host}\r\n\r\n").expect("it reads");
    let mut text = String::new();
    stream.read_to_string(&mut text).expect("it answers");
    let frames = text
        .lines()
        .find_map(|line| line.strip_prefix("Content-Security-Policy: "))
        .and_then(|policy| {
            policy
                .split("; ")
                .find(|part| part.starts_with("frame-ancestors"))
        })
        .expect("a policy of frames");
    for allowed in ["'self'", "http://localhost:*", "https://hub.example"] {
        assert!(frames.split(' ').any(|word| word == allowed), "{frames}");
    }
    assert!(
        !frames.contains('*') || frames.split(' ').all(|word| word != "*"),
        "{frames}"
    );
    assert!(!text.contains("x;y"), "a name cannot end the list");
}

#[test]
fn numbered_pictures_replace_no_files() {
    let bench = Bench::new();
    bench.write("t_0001.png", b"mine");
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let view = view(&scene, json!({}));
    let keys = json!({ "keys": [{ "time": 0, "camera": view["camera"] }, { "time": 2, "camera": view["camera"] }] });
    let cameras = json!([view["camera"], view["camera"]]);
    for (what, name, detail) in [
        ("turntable", "t.png", cameras.clone()),
        ("turntable", "t_%04d.png", cameras),
        ("film", "t.png", keys),
    ] {
        let save = json!({ "type": "save", "what": what, "name": name, "detail": detail });
        page.say(&with(&view, save));
        let why = page.not_saved();
        assert!(why.contains("t_0001.png exists"), "{why}");
    }
    let read = std::fs::read(bench.path("t_0001.png")).expect("still there");
    assert_eq!(read, b"mine");
    assert!(
        !bench.path("t_0000.png").exists(),
        "all names are tested first"
    );
}

#[test]
fn messages_name_no_folders_of_the_viewer() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let view = view(&scene, json!({ "transfer": { "Points": "none" } }));
    let draw = json!({ "type": "draw", "id": 1, "motion": "resting" });
    let why = page.refusal(&with(&view, draw));
    assert!(why.contains("transfer.json"), "{why}");
    assert!(!why.contains('/') && !why.contains('\\'), "{why}");
}

#[test]
fn the_page_names_no_files_but_new_ones_in_the_folder() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let view = view(&scene, json!({}));
    let draw = json!({ "type": "draw", "id": 1, "motion": "resting" });
    for (name, value) in [
        ("mask", "ball.raw"),
        ("transfer", "/etc/passwd"),
        ("stats", "a.json"),
        ("background", "a.png"),
        ("output", "a.png"),
        ("channel", "0:a.json"),
        ("channel", "--stats red"),
    ] {
        let changes = json!({ "changes": { name: [value] } });
        let why = page.refusal(&with(&with(&view, draw.clone()), changes));
        assert!(why.contains(&format!("--{name}")), "{why}");
    }
    let why = page.refusal(&with(
        &with(&view, draw),
        json!({ "changes": { "shade": ["none --stats=a"] } }),
    ));
    assert!(why.contains("shade"), "{why}");
    let save = json!({ "type": "save", "what": "camera" });
    for name in ["../a.json", "/tmp/a.json", ".a", "", "a/b"] {
        page.refusal(&with(&with(&view, save.clone()), json!({ "name": name })));
    }
    // A name that is taken is counted up.
    for (name, expected) in [
        ("camera.json", "camera.json"),
        ("camera.json", "camera-2.json"),
        ("ball.raw", "ball-2.raw"),
    ] {
        page.say(&with(&with(&view, save.clone()), json!({ "name": name })));
        assert_eq!(page.hear("saved")["path"], expected);
    }
    let names = std::fs::read_dir(bench.path("")).expect("a folder").count();
    assert_eq!(names, 5, "the volume, the empty folder, and three cameras");
}

#[test]
fn the_page_is_told_the_transfer_function_of_a_colour_map() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL} --opacity-scale 2"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let before = &scene["volume"]["function"];
    let view = view(&scene, json!({ "changes": { "colormap": ["magma"] } }));
    page.say(&with(
        &view,
        json!({ "type": "draw", "id": 1, "motion": "moving" }),
    ));
    let now = page.hear("function")["function"].clone();
    assert_eq!(now["opacities"], before["opacities"], "unscaled");
    assert_ne!(now["colours"], before["colours"]);
}

#[test]
fn what_was_found_is_saved() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let view = view(&scene, json!({ "transfer": transfer() }));
    let cameras = json!([view["camera"], view["camera"]]);
    let keys = json!({ "keys": [{ "time": 0, "camera": view["camera"] }, { "time": 2, "camera": view["camera"] }] });
    for (what, name, detail) in [
        ("picture", "a.png", Value::Null),
        ("picture", "a.exr", Value::Null),
        ("transfer", "t.json", Value::Null),
        ("camera", "c.json", Value::Null),
        ("path", "p.json", keys.clone()),
        ("turntable", "turn_%02d.png", cameras),
        ("film", "film.webp", keys.clone()),
    ] {
        page.say(&with(
            &view,
            json!({ "type": "save", "what": what, "name": name, "detail": detail }),
        ));
        assert_eq!(page.hear("saved")["path"], name);
    }
    for words in [
        "--transfer t.json --transfer-space srgb --camera c.json --size 97x80 -o b.png",
        "--transfer t.json --transfer-space srgb --path p.json --fps 1 -o path_%02d.png",
    ] {
        super::assert_good(&bench.draw(words));
    }
    let read = |name: &str| std::fs::read(bench.path(name)).expect("written");
    assert!(
        read("a.png") == read("b.png"),
        "what was saved repeats the picture"
    );
    let pixels = |name: &str| super::read_png(&bench.path(name));
    assert!(pixels("turn_00.png") == pixels("a.png"));
    assert!(read("turn_01.png").len() > 100);
    assert!(read("a.exr").starts_with(b"\x76\x2f\x31\x01"));
    assert!(read("film.webp").starts_with(b"RIFF"));
}

#[test]
fn a_probe_says_what_lies_under_the_pointer() {
    let bench = Bench::new();
    let viewer = Viewer::start(&bench, &format!("ball.raw {BALL}"));
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let view = view(&scene, json!({ "transfer": transfer() }));
    page.say(&with(&view, json!({ "type": "probe", "at": [48.5, 40.5] })));
    let found = page.hear("probe")["found"].clone();
    let voxel: Vec<usize> = (0..3)
        .map(|k| found["voxel"][k].as_u64().expect("an index") as usize)
        .collect();
    let place = voxel[0] + 32 * (voxel[1] + 32 * voxel[2]);
    assert_eq!(found["value"], f64::from(super::ball()[place]));
    page.say(&with(&view, json!({ "type": "probe", "at": [0.5, 0.5] })));
    assert_eq!(
        page.hear("probe")["found"],
        Value::Null,
        "the corner is empty"
    );
}

/// The place in the world under a pixel.
fn probed(bench: &Bench, words: &str, at: [f64; 2]) -> Value {
    let viewer = Viewer::start(bench, words);
    let mut page = viewer.page();
    let scene = page.hear("scene");
    let view = view(&scene, json!({}));
    page.say(&with(&view, json!({ "type": "probe", "at": at })));
    page.hear("probe")["found"].clone()
}

#[test]
fn a_probe_finds_surfaces_labels_and_channels() {
    let bench = textured();
    let found = probed(&bench, "square.obj --up z --texture im.png", [48.5, 40.5]);
    let z = found["world"][2].as_f64().expect("a place");
    assert!(z.abs() < 1e-4, "the square lies at z = 0: {found}");
    let found = probed(
        &bench,
        "im.png z.pfm --intrinsics 30,30,15.5,11.5",
        [48.5, 40.5],
    );
    assert!(found["world"][2].is_number(), "{found}");
    let bench = Bench::new();
    for words in ["--labels", "--channel 0:red", "--blend maximum"] {
        let found = probed(&bench, &format!("ball.raw {BALL} {words}"), [48.5, 40.5]);
        let voxel = [0, 1, 2].map(|k| found["voxel"][k].as_u64().expect("an index") as usize);
        let place = voxel[0] + 32 * (voxel[1] + 32 * voxel[2]);
        let value = super::ball()[place];
        assert!(
            value > 0 && found["value"] == f64::from(value),
            "{words}: {found}"
        );
        let found = probed(&bench, &format!("ball.raw {BALL} {words}"), [0.5, 0.5]);
        assert_eq!(found, Value::Null, "{words}: the corner is empty");
    }
    // A mesh before the ball is found first, and one behind it is not.
    for (z, is_nearer) in [(40, true), (-40, false)] {
        let pane = format!("v -4 -4 {z}\nv 35 -4 {z}\nv 35 35 {z}\nv -4 35 {z}\nf 1 2 3 4\n");
        bench.write("pane.obj", pane.as_bytes());
        let words = format!("ball.raw {BALL} --mesh pane.obj:red,0.2 --orbit 0,0 --up y");
        let found = probed(&bench, &words, [48.5, 40.5]);
        let world_z = found["world"][2].as_f64().expect("a place");
        assert_eq!((world_z - 40.0).abs() < 1e-3, is_nearer, "{found}");
        assert_eq!(found["voxel"].is_null(), is_nearer, "{found}");
    }
}

#[test]
fn bad_words_are_refused_as_in_every_command() {
    let bench = Bench::new();
    for (words, said) in [
        ("view no.nrrd --no-open", "no.nrrd"),
        (
            "view ball.raw --dims 32,32,32 --type u8 --shade glow --no-open",
            "glow",
        ),
        (
            "view ball.raw --dims 32,32,32 --type u8 --no-open --turntable",
            "--turntable",
        ),
    ] {
        let output = bench.run(words);
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(
            super::stderr(&output).contains(said),
            "{}",
            super::stderr(&output)
        );
    }
}
