//! `resample warp3d` on films, by way of `ffmpeg`; without it these tests say that they are skipped.

use std::fs;
use std::io::Write;
use std::process::{Command, Output, Stdio};

use super::warp3d::png_of;
use super::{Bench, assert_good, stderr};

const SIZE: [usize; 2] = [96, 54];
const PICTURES: usize = 12;

/// The lens and the range of depth, so that nothing is guessed from the pictures.
const WORDS: &str = "--method rows --from fov:40 --relative-range 20,220 --depth-kind relative --stereo 0.2 --tolerance 0.03 --fill film";

/// Returns true if `ffmpeg` and `ffprobe` are installed.
fn has_ffmpeg() -> bool {
    let runs = |tool: &str| {
        let mut command = Command::new(tool);
        command
            .arg("-version")
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    let has = runs("ffmpeg") && runs("ffprobe");
    if !has {
        println!("skipped: no ffmpeg is installed");
    }
    has
}

/// Colours of a picture, and its depth's codes: a card moves before a wall; the other half of the film is another scene.
fn picture(number: usize) -> (Vec<u8>, Vec<u8>) {
    let is_second = number >= PICTURES / 2;
    let card = |x: usize, y: usize| (20 + 3 * number..40 + 3 * number).contains(&x) && y > 15;
    let pixels = || (0..SIZE[0] * SIZE[1]).map(|i| [i % SIZE[0], i / SIZE[0]]);
    let colour = |[x, y]: [usize; 2]| match (card(x, y), is_second) {
        (true, _) => [220, (60 + 4 * (y % 20)) as u8, 40],
        (false, false) => [(2 * x) as u8, (3 * y) as u8, 120],
        (false, true) => [30, (200 - 2 * x) as u8, (60 + 3 * y) as u8],
    };
    let depth = |[x, y]: [usize; 2]| match (card(x, y), is_second) {
        (true, _) => 200,
        (false, false) => (40 + y) as u8,
        (false, true) => (90 - y) as u8,
    };
    (
        pixels().flat_map(colour).collect(),
        pixels().map(depth).collect(),
    )
}

fn ffmpeg(bench: &Bench, input: &[&str], bytes: &[u8], output: &[&str]) {
    let mut command = Command::new("ffmpeg");
    command.current_dir(bench.folder.path()).args([
        "-v",
        "error",
        "-y",
        "-f",
        "rawvideo",
        "-s",
        "96x54",
        "-r",
        "30000/1001",
    ]);
    command.args(input).args(["-i", "-"]).args(output);
    let mut child = command
        .stdin(Stdio::piped())
        .spawn()
        .expect("ffmpeg starts");
    child
        .stdin
        .take()
        .expect("a pipe")
        .write_all(bytes)
        .expect("ffmpeg reads");
    assert!(child.wait().expect("it ends").success());
}

/// The films `film.mkv` (with a tone) and `depth.mkv`, without loss, and their pictures as numbered files.
fn films() -> Bench {
    let bench = Bench::new();
    let (mut colours, mut depths) = (Vec::new(), Vec::new());
    for number in 0..PICTURES {
        let (colour, depth) = picture(number);
        bench.write(&format!("c_{number:02}.png"), &png_of(SIZE, &colour));
        let grey = image::GrayImage::from_raw(96, 54, depth.clone()).expect("a picture");
        grey.save(bench.path(&format!("d_{number:02}.png")))
            .expect("written");
        colours.extend(colour);
        depths.extend(depth);
    }
    let tone = [
        "-f",
        "lavfi",
        "-i",
        "sine=frequency=300:duration=0.4",
        "-c:a",
        "aac",
        "-shortest",
    ];
    let lossless = ["-c:v", "ffv1", "film.mkv"];
    ffmpeg(
        &bench,
        &["-pix_fmt", "rgb24"],
        &colours,
        &[&tone[..], &lossless].concat(),
    );
    ffmpeg(
        &bench,
        &["-pix_fmt", "gray"],
        &depths,
        &["-c:v", "ffv1", "depth.mkv"],
    );
    bench
}

fn probed(bench: &Bench, file: &str, stream: &str, entries: &str) -> String {
    let mut command = Command::new("ffprobe");
    command.current_dir(bench.folder.path()).args([
        "-v",
        "error",
        "-count_packets",
        "-select_streams",
        stream,
    ]);
    command.args(["-show_entries", entries, "-of", "csv=p=0", file]);
    let output = command.output().expect("ffprobe starts");
    // Behind the entries, the marks of a pair have a field of their own.
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines()
        .next()
        .unwrap_or_default()
        .trim_end_matches(',')
        .to_owned()
}

#[test]
fn a_film_gives_the_pictures_of_its_files() {
    if !has_ffmpeg() {
        return;
    }
    let bench = films();
    assert_good(&bench.run(&format!(
        "warp3d film.mkv depth.mkv {WORDS} -o out/f_%02d.png"
    )));
    bench.write("cuts.txt", b"0 6\n");
    let files = format!("warp3d c_%02d.png d_%02d.png {WORDS} --cuts cuts.txt -o out/p_%02d.png");
    assert_good(&bench.run(&files));
    let mixed = format!("warp3d film.mkv d_%02d.png {WORDS} --cuts cuts.txt -o out/m_%02d.png");
    assert_good(&bench.run(&mixed));
    for number in 0..PICTURES {
        let read =
            |kind: &str| super::read_png(&bench.path(&format!("out/{kind}_{number:02}.png")));
        assert!(
            read("f") == read("p"),
            "picture {number}: the film, and its cut, are those of its files"
        );
        assert!(
            read("m") == read("p"),
            "picture {number}: a film and files of depth"
        );
    }
    // A part, and one that follows a cut, are the whole's.
    let part = format!("warp3d film.mkv depth.mkv {WORDS} --frames 8..10 -o out/part_%02d.png");
    assert_good(&bench.run(&part));
    for number in 8..10 {
        let read =
            |kind: &str| super::read_png(&bench.path(&format!("out/{kind}_{number:02}.png")));
        assert!(read("part") == read("f"), "picture {number} of a part");
    }
}

#[test]
fn a_stereo_film_keeps_rate_length_and_sound() {
    if !has_ffmpeg() {
        return;
    }
    let bench = films();
    let words = "warp3d film.mkv depth.mkv --stereo 0.1 --layout half-side-by-side -o out/s.mp4";
    let output = bench.run(&format!("{words} --stats stats.json"));
    assert_good(&output);
    let stats = fs::read_to_string(bench.path("stats.json")).expect("written");
    assert!(stats.contains("\"method\": \"rows\""), "{stats}");
    let said = stderr(&output);
    assert!(
        said.contains("2 shots in 12 pictures") && said.contains("fov:35"),
        "{said}"
    );
    let video = probed(
        &bench,
        "out/s.mp4",
        "v:0",
        "stream=width,height,r_frame_rate,nb_read_packets,color_space",
    );
    assert_eq!(video, "96,54,bt709,30000/1001,12");
    assert_eq!(
        probed(&bench, "out/s.mp4", "a:0", "stream=codec_name"),
        "aac"
    );
    let packets = |file| probed(&bench, file, "a:0", "packet=size");
    assert_eq!(
        packets("out/s.mp4"),
        packets("film.mkv"),
        "the packets of the sound are copied"
    );
    assert_eq!(bench.written(), ["s.mp4"]);
}

#[test]
fn subtitles_go_along() {
    if !has_ffmpeg() {
        return;
    }
    let bench = films();
    let line = b"1\n00:00:00,100 --> 00:00:00,300\nGood morning\n";
    bench.write("words.srt", line);
    let mut join = Command::new("ffmpeg");
    join.current_dir(bench.folder.path());
    join.args(["-v", "error", "-i", "film.mkv", "-i", "words.srt"]);
    join.args(["-map", "0", "-map", "1", "-map", "1", "-c", "copy"]);
    assert!(join.arg("spoken.mkv").status().expect("ffmpeg").success());
    for (film, codec) in [("s.mp4", "mov_text"), ("s.mkv", "subrip")] {
        let words = format!("warp3d spoken.mkv depth.mkv --stereo 0.1 -o out/{film}");
        assert_good(&bench.run(&words));
        for stream in ["s:0", "s:1"] {
            let found = probed(&bench, &format!("out/{film}"), stream, "stream=codec_name");
            assert_eq!(found, codec, "{film}");
        }
        let mut read = Command::new("ffmpeg");
        read.current_dir(bench.folder.path().join("out"));
        read.args(["-v", "error", "-i", film, "-map", "0:s:0", "-f", "srt", "-"]);
        let output = read.output().expect("ffmpeg");
        let text = String::from_utf8_lossy(&output.stdout);
        let time = "00:00:00,100 --> 00:00:00,300";
        assert!(
            text.contains(time) && text.contains("Good morning"),
            "{film}: {text}"
        );
    }
}

#[test]
fn a_film_goes_through_pipes() {
    if !has_ffmpeg() {
        return;
    }
    let bench = films();
    let film = fs::File::open(bench.path("film.mkv")).expect("a film");
    let mut command = Command::new(env!("CARGO_BIN_EXE_resample"));
    command.current_dir(bench.folder.path()).stdin(film);
    command.args(["warp3d", "-", "depth.mkv", "--stereo", "0.1", "-o", "-"]);
    let output: Output = command.output().expect("the binary starts");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    bench.write("piped.mkv", &output.stdout);
    let video = probed(
        &bench,
        "piped.mkv",
        "v:0",
        "stream=width,height,nb_read_packets",
    );
    assert_eq!(video, "192,54,12");
}

#[test]
fn halves_of_one_film_are_picture_and_depth() {
    if !has_ffmpeg() {
        return;
    }
    let bench = films();
    let mut command = Command::new("ffmpeg");
    command.current_dir(bench.folder.path()).args([
        "-v",
        "error",
        "-i",
        "film.mkv",
        "-i",
        "depth.mkv",
        "-filter_complex",
    ]);
    command.args([
        "[1:v]setpts=PTS-STARTPTS,format=gbrp[d];[0:v]setpts=PTS-STARTPTS,format=gbrp[c];[c][d]hstack",
        "-c:v",
        "ffv1",
        "-pix_fmt",
        "gbrp",
        "both.mkv",
    ]);
    assert!(command.status().expect("ffmpeg starts").success());
    assert_good(&bench.run(&format!(
        "warp3d both.mkv both.mkv#right {WORDS} -o out/b_%02d.png"
    )));
    assert_good(&bench.run(&format!(
        "warp3d film.mkv depth.mkv {WORDS} -o out/f_%02d.png"
    )));
    for number in 0..PICTURES {
        let read =
            |kind: &str| super::read_png(&bench.path(&format!("out/{kind}_{number:02}.png")));
        assert!(read("b") == read("f"), "picture {number}");
    }
}

#[test]
fn films_that_do_not_fit_are_refused_in_one_line() {
    if !has_ffmpeg() {
        return;
    }
    let bench = films();
    let whole = fs::read(bench.path("film.mkv")).expect("a film");
    bench.write("short.mkv", &whole[..200]);
    bench.write("cuts.txt", b"0 six");
    let tall = ["-vf", "crop=40:54", "-c:v", "ffv1", "tall.mkv"];
    let (_, depth) = picture(0);
    ffmpeg(&bench, &["-pix_fmt", "gray"], &depth, &tall);
    for (words, named) in [
        ("film.mkv d_00.png", "d_00.png"),
        ("film.mkv film.mkv", "film.mkv#right"),
        ("film.mkv depth.mkv#middle", "middle"),
        ("c_%02d.png missing.mkv", "missing.mkv"),
        ("short.mkv depth.mkv", "short.mkv"),
        ("film.mkv tall.mkv", "tall.mkv"),
        ("film.mkv depth.mkv --cuts cuts.txt", "six"),
        ("film.mkv depth.mkv --sway 3", "--sway"),
    ] {
        let output = bench.run(&format!("warp3d {words} --stereo 0.1 -o out/s.mp4"));
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{words}: {said}");
        let last = said.lines().last().unwrap_or_default();
        assert!(last.contains(named), "{words} must name {named}: {said}");
        assert!(bench.written().is_empty(), "{words}: nothing is written");
    }
    // Without the programs one line says what to do.
    let mut command = Command::new(env!("CARGO_BIN_EXE_resample"));
    command
        .current_dir(bench.folder.path())
        .env("PATH", bench.path("out"));
    command.args([
        "warp3d",
        "film.mkv",
        "depth.mkv",
        "--stereo",
        "0.1",
        "-o",
        "out/%02d.png",
    ]);
    let output = command.output().expect("the binary starts");
    let said = stderr(&output);
    assert_eq!(
        (output.status.code(), said.lines().count()),
        (Some(2), 1),
        "{said}"
    );
    assert!(said.contains("film.mkv: ffprobe was not found"), "{said}");
}

#[test]
fn a_killed_film_is_gone_on_with() {
    if !has_ffmpeg() {
        return;
    }
    let bench = films();
    for name in ["film", "depth"] {
        let (from, to) = (format!("{name}.mkv"), format!("long_{name}.mkv"));
        let mut command = Command::new("ffmpeg");
        command.current_dir(bench.folder.path());
        command.args(["-v", "error", "-stream_loop", "24", "-i", &from]);
        command.args(["-map", "0", "-c", "copy", &to]);
        assert!(command.status().expect("ffmpeg starts").success());
    }
    let words = |output: &str| format!("warp3d long_film.mkv long_depth.mkv {WORDS} -o {output}");
    assert_good(&bench.run(&words("whole.mp4")));
    assert!(!bench.path("whole.mp4.pieces").exists(), "nothing is left");

    // Killed once the first piece stands, while the second is drawn.
    let mut command = Command::new(env!("CARGO_BIN_EXE_resample"));
    command.current_dir(bench.folder.path());
    command.args(words("killed.mp4").split_whitespace());
    let mut child = command.stderr(Stdio::null()).spawn().expect("it starts");
    let first = bench.path("killed.mp4.pieces/0000000.mp4");
    while !first.exists() {
        assert!(child.try_wait().expect("a child").is_none(), "it ended");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().expect("killed");
    child.wait().expect("it ends");
    assert!(!bench.path("killed.mp4").exists());

    let refused = bench.run(&words("killed.mp4"));
    assert!(!refused.status.success());
    let said = stderr(&refused);
    let way_out = "125 pictures of this film are in killed.mp4.pieces: --resume draws the rest";
    assert!(said.contains(way_out), "{said}");

    let resumed = bench.run(&format!("{} --resume", words("killed.mp4")));
    assert_good(&resumed);
    let said = stderr(&resumed);
    assert!(
        said.contains("125 of 300 pictures were there already"),
        "{said}"
    );
    let read = |name: &str| fs::read(bench.path(name)).expect("a film");
    assert!(
        read("killed.mp4") == read("whole.mp4"),
        "the bytes of a run that nothing interrupted"
    );
    assert!(!bench.path("killed.mp4.pieces").exists(), "nothing is left");
    assert_eq!(
        probed(&bench, "killed.mp4", "v", "stream=nb_read_packets"),
        "300"
    );
    let [film, sound] = ["v", "a"].map(|stream| {
        let seconds = probed(&bench, "killed.mp4", stream, "stream=duration");
        seconds.parse::<f64>().expect("seconds")
    });
    assert!((film - 300.0 * 1001.0 / 30_000.0).abs() < 1e-3, "{film} s");
    assert!((sound - film).abs() < 0.5, "{sound} s of sound");

    // A mark of other settings: the pieces are replaced.
    fs::create_dir(bench.path("killed.mp4.pieces")).expect("a folder");
    bench.write("killed.mp4.pieces/mark", b"another");
    bench.write("killed.mp4.pieces/0000000.mp4", b"no film");
    assert_good(&bench.run(&words("killed.mp4")));
    assert!(read("killed.mp4") == read("whole.mp4"));
}

/// What `ffprobe` finds out about the views of a film.
fn marks(bench: &Bench, file: &str) -> String {
    let entries = "stream_side_data=type,projection,bound_left,bound_right:stream_tags=stereo_mode";
    let mut command = Command::new("ffprobe");
    command.current_dir(bench.folder.path());
    command.args([
        "-v",
        "error",
        "-select_streams",
        "v",
        "-show_entries",
        entries,
    ]);
    command.args(["-of", "default=nw=1", file]);
    let output = command.output().expect("ffprobe starts");
    String::from_utf8_lossy(&output.stdout)
        .trim()
        .replace('\n', " ")
}

#[test]
fn players_are_told_of_pairs_and_panoramas() {
    if !has_ffmpeg() {
        return;
    }
    let bench = films();
    let draw = |words: &str, output: &str| {
        let words = format!(
            "warp3d film.mkv depth.mkv {words} --depth-kind relative --relative-range 20,220 --stereo 0.2 -o {output}"
        );
        let drawn = bench.run(&words);
        assert_good(&drawn);
        (
            marks(&bench, output),
            probed(&bench, output, "v", "stream=width,height"),
        )
    };
    let told = draw("--from fov:40 --layout half-side-by-side", "half.mp4");
    assert_eq!(told, ("type=side by side".to_owned(), "96,54".to_owned()));
    let told = draw("--from fov:40 --layout top-bottom", "above.mp4");
    assert_eq!(
        told,
        ("type=top and bottom".to_owned(), "96,108".to_owned())
    );
    let (told, _) = draw("--from fov:40 --layout top-bottom", "above.mkv");
    assert!(told.contains("stereo_mode=top_bottom"), "{told}");
    let (told, _) = draw("--from fov:40 --anaglyph", "anaglyph.mp4");
    assert_eq!(told, "", "an anaglyph is one view");

    let told = draw("--from fov:40 --layout vr180 --size 64x64", "ahead.mp4");
    // ffprobe rounds the quarter that is left out at each side.
    let ahead = "type=side by side projection=tiled equirectangular bound_left=64 bound_right=63";
    assert_eq!(told, (ahead.to_owned(), "128,64".to_owned()));
    for film in ["ahead.mkv", "ahead.webm"] {
        let (told, _) = draw("--from fov:40 --layout vr180 --size 64x64", film);
        assert!(
            told.contains("side by side") || told.contains("stereo_mode=left_right"),
            "{film}: {told}"
        );
        assert!(
            told.contains("projection=tiled equirectangular bound_left=64"),
            "{film}: {told}"
        );
        let sound = probed(&bench, film, "a:0", "stream=codec_name");
        assert!(!sound.is_empty(), "{film}: its sound");
    }
    let around = "--from equirectangular --layout";
    let (told, size) = draw(&format!("{around} vr180"), "ahead_of_all.mp4");
    assert!(told.contains("tiled equirectangular"), "{told}");
    assert_eq!(size, "96,54", "the middle of each row, for two eyes");
    let (told, size) = draw("--from equirectangular", "all.mp4");
    assert_eq!(told, "type=top and bottom projection=equirectangular");
    assert_eq!(size, "96,108");

    // A film that is marked as a panorama is read as one.
    let mono = "warp3d film.mkv depth.mkv --from equirectangular --depth-kind relative --relative-range 20,220 --size 96x54 --layout equirectangular -o mono.mp4";
    assert_good(&bench.run(mono));
    assert_eq!(marks(&bench, "mono.mp4"), "projection=equirectangular");
    let again =
        bench.run("warp3d mono.mp4 depth.mkv --depth-kind relative --relative-range 20,220 --stereo 0.2 -o again.mp4");
    assert_good(&again);
    assert!(stderr(&again).contains("it is read with --from equirectangular"));
    assert!(marks(&bench, "again.mp4").contains("projection=equirectangular"));
}

#[test]
fn pairs_of_panoramas_that_cannot_be_are_refused() {
    let bench = Bench::new();
    bench.write("c.png", &png_of([2, 1], &[90; 6]));
    bench.write("d.png", &png_of([2, 1], &[50; 6]));
    let cases = [
        (
            "--from fov:40 --stereo 1 --layout equirectangular",
            "--layout vr180",
        ),
        (
            "--from equirectangular --to shift:1,0,0 --stereo 1 --layout equirectangular",
            "without --to",
        ),
        ("--from fov:40 --layout vr180", "give --stereo BASELINE"),
        (
            "--from fov:40 --stereo 1 --layout vr180 --convergence 3",
            "leave it out",
        ),
        (
            "--from fov:40 --stereo 1 --layout vr180 --size 64x32",
            "is a square",
        ),
        (
            "--from equirectangular --stereo 1 --layout equirectangular --size 32x32",
            "twice as wide as high",
        ),
        (
            "--from equirectangular --stereo 1 --layout equirectangular --sway 3",
            "leave --reference, --path and --sway out",
        ),
    ];
    for (words, expected) in cases {
        let refused = bench.run(&format!(
            "warp3d c.png d.png --depth-kind inverse {words} -o o.png"
        ));
        assert!(!refused.status.success(), "{words}");
        let said = stderr(&refused);
        assert!(
            said.contains(expected) && said.lines().count() == 1,
            "{words}: {said}"
        );
    }
}
