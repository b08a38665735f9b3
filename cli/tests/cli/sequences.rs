//! Several pictures in a row: turntables, going on after a stop, and Ctrl-C.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::{Bench, assert_good, read_png, stderr};

fn frames_in_stats(bench: &Bench) -> Vec<String> {
    let text = fs::read_to_string(bench.path("out/s.json")).expect("a stats file");
    let stats: Value = serde_json::from_str(&text).expect("a JSON file");
    let frames = stats["frames"].as_array().expect("a list of frames");
    frames
        .iter()
        .map(|frame| frame["file"].as_str().expect("a name").to_owned())
        .collect()
}

fn same_bytes(one: &Path, other: &Path) -> bool {
    fs::read(one).expect("written") == fs::read(other).expect("written")
}

#[test]
fn a_turntable_goes_once_around() {
    let bench = Bench::new();
    assert_good(
        &bench.draw("--size 24x24 --turntable 4 --orbit 10,20 -o out/a.png --stats out/s.json"),
    );
    let names = [
        "a_0000.png",
        "a_0001.png",
        "a_0002.png",
        "a_0003.png",
        "s.json",
    ];
    assert_eq!(bench.written(), names, "numbered pictures");
    assert_eq!(frames_in_stats(&bench).len(), 4, "one entry per picture");
    for (step, azimuth_deg) in [10, 100, 190, 280].into_iter().enumerate() {
        assert_good(&bench.draw(&format!(
            "--size 24x24 --orbit {azimuth_deg},20 -o out/one.png"
        )));
        let frame = bench.path(&format!("out/a_000{step}.png"));
        assert!(
            read_png(&frame) == read_png(&bench.path("out/one.png")),
            "step {step} is the view from {azimuth_deg}"
        );
    }
    assert_good(&bench.draw("--size 8x8 --turntable 2 -o out/p%02d.exr"));
    assert!(
        bench.path("out/p01.exr").is_file(),
        "a pattern is filled in: {:?}",
        bench.written()
    );
}

#[test]
fn a_turntable_refuses_a_camera_file_and_no_step() {
    let bench = Bench::new();
    for words in [
        "--turntable 4 --camera cam.json",
        "--turntable 0",
        "--turntable 100001",
    ] {
        let output = bench.draw(&format!("-o out/a.png {words}"));
        assert_eq!(
            output.status.code(),
            Some(2),
            "`{words}` is refused: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains("--turntable"),
            "`{words}` is named: {}",
            stderr(&output)
        );
    }
    assert!(
        bench.written().is_empty(),
        "nothing is written: {:?}",
        bench.written()
    );
}

#[test]
fn resume_draws_only_what_is_missing() {
    let bench = Bench::new();
    assert_good(&bench.draw("--size 16x16 --turntable 3 -o out/whole.png"));
    let before = fs::read(bench.path("out/whole_0001.png")).expect("there");
    bench.write("out/a_0001.png", &before);
    let output = bench.draw("--size 16x16 --turntable 3 --resume -o out/a.png --stats out/s.json");
    assert_good(&output);
    assert!(
        stderr(&output).contains("1 of 3 pictures were there already"),
        "{}",
        stderr(&output)
    );
    assert_eq!(
        fs::read(bench.path("out/a_0001.png")).expect("there"),
        before,
        "it is kept"
    );
    assert_eq!(
        frames_in_stats(&bench),
        ["out/a_0000.png", "out/a_0002.png"],
        "stats hold what was drawn"
    );
    for step in [0, 2] {
        let names = [
            format!("out/a_000{step}.png"),
            format!("out/whole_000{step}.png"),
        ];
        assert!(
            same_bytes(&bench.path(&names[0]), &bench.path(&names[1])),
            "step {step} is its own view"
        );
    }
    let output = bench.draw("--size 16x16 --turntable 3 --resume -o out/a.png");
    assert_good(&output);
    assert!(
        stderr(&output).contains("wrote nothing"),
        "all are there: {}",
        stderr(&output)
    );
    assert_good(&bench.draw("--size 16x16 --turntable 3 -o out/a.png"));
    assert_eq!(
        read_png(&bench.path("out/a_0001.png")).0,
        16,
        "without --resume, all are drawn again"
    );
}

#[cfg(unix)]
mod interrupted {
    use std::process::{Child, Command, Output, Stdio};
    use std::thread::sleep;
    use std::time::{Duration, Instant};

    use super::super::BALL;
    use super::*;

    /// How long the test waits for another process before it fails; drawing takes milliseconds.
    const PATIENCE: Duration = Duration::from_secs(60);

    fn start(bench: &Bench, words: &str) -> Child {
        let words = format!("volsplat ball.raw {BALL} {words}");
        let mut command = Command::new(env!("CARGO_BIN_EXE_resample"));
        command
            .current_dir(bench.folder.path())
            .args(words.split_whitespace());
        command
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .expect("the binary starts")
    }

    fn press_ctrl_c(child: &Child) {
        let status = Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status();
        assert!(
            status.expect("kill is there").success(),
            "the process runs still"
        );
    }

    fn wait_for(what: &str, mut seen: impl FnMut() -> bool) {
        let start = Instant::now();
        while !seen() {
            assert!(start.elapsed() < PATIENCE, "waited for {what} in vain");
            sleep(Duration::from_millis(1));
        }
    }

    fn ended(child: Child) -> Output {
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(
            output.status.code(),
            Some(130),
            "the exit code of Ctrl-C: {}",
            stderr(&output)
        );
        output
    }

    fn assert_whole_pictures(bench: &Bench) -> usize {
        let names = bench.written();
        for name in &names {
            assert!(
                name.starts_with("a_") && name.ends_with(".png"),
                "only pictures are left, not {name}"
            );
            assert_eq!(
                read_png(&bench.path(&format!("out/{name}"))).0,
                96,
                "{name} is whole"
            );
        }
        names.len()
    }

    #[test]
    fn ctrl_c_finishes_the_picture_and_resume_goes_on() {
        let bench = Bench::new();
        let words = "--size 96x96 --threads 1 --turntable 2000 -o out/a.png";
        let child = start(&bench, words);
        wait_for("two pictures", || bench.path("out/a_0001.png").is_file());
        press_ctrl_c(&child);
        let said = stderr(&ended(child));
        assert!(
            said.contains("ending after this picture"),
            "it answers: {said}"
        );
        let count = assert_whole_pictures(&bench);
        assert!(
            (2..2000).contains(&count),
            "it ended between the first and the last picture: {count}"
        );
        let expected = format!("interrupted: {count} of 2000 pictures are finished; --resume");
        assert!(said.contains(&expected), "it says how to go on: {said}");
        let missing = bench.path(&format!("out/a_{count:04}.png"));
        let child = start(&bench, &format!("{words} --resume"));
        wait_for("the next picture", || missing.is_file());
        press_ctrl_c(&child);
        ended(child);
        assert!(
            assert_whole_pictures(&bench) > count,
            "it went on where it stopped"
        );
    }

    #[test]
    fn a_second_ctrl_c_ends_at_once_and_cleans_up() {
        let bench = Bench::new();
        let child = start(
            &bench,
            "--size 96x96 --threads 1 --turntable 2000 -o out/a.png",
        );
        wait_for("a picture", || bench.path("out/a_0000.png").is_file());
        press_ctrl_c(&child);
        // It may have ended in between, which is as good.
        let _ = Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .stderr(Stdio::null())
            .status();
        ended(child);
        assert!(
            assert_whole_pictures(&bench) >= 1,
            "what was finished stays"
        );
    }

    #[test]
    fn ctrl_c_in_the_middle_of_one_picture_leaves_nothing() {
        let bench = Bench::new();
        // Minutes of work, so that the signal cannot come too late.
        let words = "--size 4000x4000 --threads 1 --subpixels 16 --slab 0.05 -o out/a.png";
        let child = start(&bench, words);
        // The temporary file of the first check says that Ctrl-C is listened to; it may be gone before it is seen.
        sleep(Duration::from_millis(500));
        press_ctrl_c(&child);
        ended(child);
        assert!(
            bench.written().is_empty(),
            "nothing is left: {:?}",
            bench.written()
        );
    }
}

/// Two keys a second apart: the front, and a quarter turn on.
const PATH: &str = r#"{"keys": [
    {"time": 0, "camera": {"position": [16, 16, 90], "target": [16, 16, 16], "up": [0, 1, 0]}},
    {"time": 1, "camera": {"position": [90, 16, 16], "target": [16, 16, 16], "up": [0, 1, 0]}}]}"#;

#[test]
fn a_path_passes_through_its_keys() {
    let bench = Bench::new();
    bench.write("path.json", PATH.as_bytes());
    assert_good(&bench.draw("--size 24x24 --path path.json --fps 4 -o out/a.png"));
    assert_eq!(
        bench.written().len(),
        5,
        "a second at four pictures a second, both ends: {:?}",
        bench.written()
    );
    let camera = |position: &str| {
        format!(r#"{{"position": {position}, "target": [16, 16, 16], "up": [0, 1, 0]}}"#)
    };
    for (file, position) in [("a_0000", "[16, 16, 90]"), ("a_0004", "[90, 16, 16]")] {
        bench.write("cam.json", camera(position).as_bytes());
        assert_good(&bench.draw("--size 24x24 --camera cam.json -o out/one.exr"));
        assert_good(&bench.draw("--size 24x24 --path path.json --fps 4 -o out/a.exr"));
        let words = format!("compare out/{file}.exr out/one.exr --fail-above max=0.0001");
        let output = bench.run(&words);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{file} is the key's view: {}",
            stderr(&output)
        );
    }
}

#[test]
fn a_bad_path_is_refused_by_name() {
    let bench = Bench::new();
    bench.write(
        "path.json",
        PATH.replace("\"time\": 1", "\"time\": 0").as_bytes(),
    );
    let output = bench.draw("--path path.json -o out/a.png");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("path.json") && stderr(&output).contains("key 1"),
        "{}",
        stderr(&output)
    );
    assert!(
        bench.written().is_empty(),
        "nothing is written: {:?}",
        bench.written()
    );
}
