//! All pictures in one file: animated PNG, and video by way of `ffmpeg`, of which a script takes the place here.

use std::fs;
use std::io::BufReader;
use std::path::Path;

use image::AnimationDecoder;
use image::codecs::webp::WebPDecoder;

use super::{Bench, assert_good, read_png, stderr};

struct Animation {
    /// Width and height, px.
    size: (u32, u32),
    /// Seconds per picture, numerator and denominator.
    delay: (u16, u16),
    /// RGBA bytes of each picture.
    frames: Vec<Vec<u8>>,
}

fn read_apng(path: &Path) -> Animation {
    let file = fs::File::open(path).expect("a written animation");
    let mut reader = png::Decoder::new(BufReader::new(file))
        .read_info()
        .expect("a PNG");
    let control = reader.info().animation_control.expect("an animated PNG");
    let mut delay = (0, 0);
    let frames = (0..control.num_frames).map(|_| {
        let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
        reader.next_frame(&mut bytes).expect("whole");
        let frame = reader
            .info()
            .frame_control
            .expect("a frame of an animation");
        delay = (frame.delay_num, frame.delay_den);
        bytes
    });
    let frames = frames.collect();
    Animation {
        size: (reader.info().width, reader.info().height),
        delay,
        frames,
    }
}

fn assert_refused(bench: &Bench, words: &str, named: &str) {
    let output = bench.draw(words);
    let said = stderr(&output);
    assert_eq!(
        output.status.code(),
        Some(2),
        "`{words}` is refused: {said}"
    );
    assert!(said.contains(named), "`{words}` must name {named}: {said}");
    assert!(
        bench.written().is_empty(),
        "`{words}` writes nothing: {:?}",
        bench.written()
    );
}

#[test]
fn an_animated_webp_holds_every_picture_and_its_alpha() {
    let bench = Bench::new();
    assert_good(&bench.draw("--size 24x16 --turntable 3 --fps 10 -o out/a.webp"));
    assert_eq!(bench.written(), ["a.webp"], "one file");
    let file = fs::File::open(bench.path("out/a.webp")).expect("written");
    let decoder = WebPDecoder::new(BufReader::new(file)).expect("a WebP");
    let frames = decoder
        .into_frames()
        .collect_frames()
        .expect("whole frames");
    assert_eq!(frames.len(), 3, "pictures");
    assert_good(&bench.draw("--size 24x16 --turntable 3 -o out/b.png"));
    for (index, frame) in frames.iter().enumerate() {
        assert_eq!(
            frame.delay().numer_denom_ms(),
            (100, 1),
            "picture {index}: a tenth of a second"
        );
        let (.., single) = read_png(&bench.path(&format!("out/b_000{index}.png")));
        let (mut partly, pixels) = (0, frame.buffer().chunks(4).zip(single.chunks(4)));
        for (got, wanted) in pixels {
            partly += usize::from((1..255).contains(&wanted[3]));
            assert!(
                got == wanted || got[3] == 0 && wanted[3] == 0,
                "picture {index}: {got:?}, {wanted:?}"
            );
        }
        assert!(partly > 20, "picture {index} is partly transparent");
    }
    assert_good(&bench.draw("--size 24x16 -o out/one.webp"));
    let one = image::open(bench.path("out/one.webp")).expect("a plain WebP");
    assert_eq!((one.width(), one.height()), (24, 16), "one picture");
    let bench = Bench::new();
    assert_refused(&bench, "--bits 16 -o out/b.webp", "8 bits");
    assert_refused(&bench, "--size 16385x1 -o out/b.webp", "16384");
}

#[test]
fn an_animated_png_holds_every_picture_bit_for_bit() {
    let bench = Bench::new();
    let output = bench.draw("--size 24x16 --turntable 3 --fps 10 -o out/a.apng");
    assert_good(&output);
    assert!(
        stderr(&output).contains("wrote 3 pictures as out/a.apng (24x16"),
        "{}",
        stderr(&output)
    );
    assert_eq!(bench.written(), ["a.apng"], "one file");
    let Animation {
        size,
        delay,
        frames,
    } = read_apng(&bench.path("out/a.apng"));
    assert_eq!(
        (size, delay, frames.len()),
        ((24, 16), (1, 10), 3),
        "size, delay and number"
    );
    assert_good(&bench.draw("--size 24x16 --turntable 3 -o out/b.png"));
    for (index, frame) in frames.iter().enumerate() {
        let (.., single) = read_png(&bench.path(&format!("out/b_000{index}.png")));
        assert!(
            *frame == single,
            "picture {index} differs from the numbered one"
        );
    }
    assert_good(&bench.draw("--size 8x8 --bits 16 -o out/one.apng"));
    let Animation { delay, frames, .. } = read_apng(&bench.path("out/one.apng"));
    assert_eq!(
        (delay, frames.len()),
        ((1, 25), 1),
        "one picture is an animation too"
    );
    assert_eq!(frames[0].len(), 8 * 8 * 4 * 2, "sixteen bits");
}

#[test]
fn what_no_animation_can_be_is_refused() {
    let bench = Bench::new();
    let camera = |side: u32| {
        format!(
            r#"{{"width": {side}, "height": 40, "fx": 40, "fy": 40, "cx": 20, "cy": 20,
            "R": [1, 0, 0, 0, 1, 0, 0, 0, 1], "t": [-15.5, -15.5, 44.5]}}"#
        )
    };
    bench.write(
        "cams.json",
        format!("[{}, {}]", camera(40), camera(48)).as_bytes(),
    );
    assert_refused(
        &bench,
        "--camera cams.json -o out/a.apng",
        "picture 1 has 48x40",
    );
    assert_refused(&bench, "--turntable 2 --resume -o out/a.apng", "--resume");
    assert_refused(&bench, "--turntable 2 --fps 10 -o out/a.png", "--fps");
    assert_refused(&bench, "--turntable 2 --fps 0 -o out/a.apng", "--fps");
    assert_refused(&bench, "--bits 16 -o out/a.mp4", "--bits");
    assert_good(&bench.draw("--camera cams.json --size 20x20 -o out/a.apng"));
    assert_eq!(
        read_apng(&bench.path("out/a.apng")).size,
        (20, 20),
        "--size makes them equal"
    );
}

#[cfg(unix)]
mod video {
    use std::os::unix::fs::PermissionsExt;
    use std::process::{Command, Output};

    use super::super::BALL;
    use super::*;

    /// Stands for `ffmpeg`: its last argument is the file, into which go its arguments and what it is fed.
    const WORKS: &str = r#"#!/bin/sh
[ "$1" = -version ] && exit 0
for last; do :; done
echo "$@" | /bin/sed "s|$last|FILE|" > "$last"
/bin/cat >> "$last"
"#;

    /// Ends at once with a complaint.
    const FAILS: &str =
        "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\necho 'Unknown encoder' >&2\nexit 3\n";

    /// Draws with nothing on the PATH but `ffmpeg`, if `script` is given.
    fn draw(bench: &Bench, script: Option<&str>, words: &str) -> Output {
        let folder = bench.path("bin");
        fs::create_dir_all(&folder).expect("a folder for the script");
        if let Some(script) = script {
            bench.write("bin/ffmpeg", script.as_bytes());
            let executable = fs::Permissions::from_mode(0o755);
            fs::set_permissions(bench.path("bin/ffmpeg"), executable).expect("it is ours");
        }
        let words = format!("volsplat ball.raw {BALL} {words}");
        let mut command = Command::new(env!("CARGO_BIN_EXE_resample"));
        command
            .current_dir(bench.folder.path())
            .env("PATH", folder)
            .args(words.split_whitespace());
        command.output().expect("the binary starts")
    }

    #[test]
    fn ffmpeg_is_fed_the_pictures() {
        let bench = Bench::new();
        for (name, encoder, container) in [
            ("a.mp4", "libx264", "mp4"),
            ("a.webm", "libvpx-vp9", "webm"),
            ("a.MKV", "libx264", "matroska"),
        ] {
            let words =
                format!("--size 24x16 --turntable 3 --fps 12 --background #ff8000 -o out/{name}");
            assert_good(&draw(&bench, Some(WORKS), &words));
            let file = fs::read(bench.path(&format!("out/{name}"))).expect("written");
            let (line, pixels) =
                file.split_at(file.iter().position(|&b| b == b'\n').expect("a line") + 1);
            let line = String::from_utf8_lossy(line);
            for told in [
                "rawvideo",
                "rgb24",
                "24x16",
                "-framerate 12",
                "yuv420p",
                encoder,
                container,
            ] {
                assert!(
                    line.contains(told),
                    "{name}: ffmpeg is not told {told}: {line}"
                );
            }
            assert_eq!(
                pixels.len(),
                3 * 24 * 16 * 3,
                "{name}: red, green and blue of three pictures"
            );
            assert_eq!(
                pixels[..3],
                [255, 128, 0],
                "{name}: the corner shows the background"
            );
        }
        assert_eq!(
            bench.written(),
            ["a.MKV", "a.mp4", "a.webm"],
            "no temporary file is left"
        );
    }

    #[test]
    fn without_ffmpeg_one_line_says_what_to_do() {
        let bench = Bench::new();
        let output = draw(&bench, None, "--turntable 3 -o out/a.mp4");
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "it is refused: {said}");
        assert_eq!(said.lines().count(), 1, "one line: {said}");
        assert!(
            said.contains("out/a.mp4: ffmpeg was not found") && said.contains(".png"),
            "{said}"
        );
        assert!(
            bench.written().is_empty(),
            "nothing is written: {:?}",
            bench.written()
        );
    }

    #[test]
    fn complaints_of_ffmpeg_are_shown_and_nothing_is_left() {
        let bench = Bench::new();
        let output = draw(
            &bench,
            Some(FAILS),
            "--size 64x64 --turntable 30 -o out/a.mp4",
        );
        let said = stderr(&output);
        assert_eq!(
            output.status.code(),
            Some(1),
            "it could not be written: {said}"
        );
        assert!(
            said.contains("out/a.mp4") && said.contains("Unknown encoder"),
            "{said}"
        );
        assert!(
            bench.written().is_empty(),
            "nothing is left: {:?}",
            bench.written()
        );
    }

    #[test]
    fn ctrl_c_leaves_no_video_and_no_temporary_file() {
        let bench = Bench::new();
        assert_good(&draw(&bench, Some(WORKS), "--size 8x8 -o out/a.mp4"));
        fs::remove_file(bench.path("out/a.mp4")).expect("written");
        let words = format!("volsplat ball.raw {BALL} --size 96x96 --turntable 3000 -o out/a.mp4");
        let mut command = Command::new(env!("CARGO_BIN_EXE_resample"));
        command
            .current_dir(bench.folder.path())
            .env("PATH", bench.path("bin"));
        command
            .args(words.split_whitespace())
            .stderr(std::process::Stdio::piped());
        let child = command.spawn().expect("the binary starts");
        let start = std::time::Instant::now();
        // The temporary file of the video is there for as long as it is drawn, those of the checks for an instant.
        let bytes = |name: &String| {
            fs::metadata(bench.path(&format!("out/{name}"))).map_or(0, |file| file.len())
        };
        while !bench.written().iter().any(|name| bytes(name) > 0) {
            assert!(
                start.elapsed().as_secs() < 60,
                "waited for the first picture in vain"
            );
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        let status = Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status();
        assert!(
            status.expect("kill is there").success(),
            "the process runs still"
        );
        let output = child.wait_with_output().expect("it ends");
        let said = stderr(&output);
        assert_eq!(
            output.status.code(),
            Some(130),
            "the exit code of Ctrl-C: {said}"
        );
        assert!(
            said.contains("interrupted: out/a.mp4 is not written"),
            "{said}"
        );
        assert!(
            bench.written().is_empty(),
            "nothing is left: {:?}",
            bench.written()
        );
    }

    #[test]
    fn odd_sizes_are_refused_with_the_next_even_one() {
        let bench = Bench::new();
        let output = draw(&bench, Some(WORKS), "--size 23x16 -o out/a.mp4");
        assert_eq!(
            output.status.code(),
            Some(2),
            "it is refused: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains("--size 24x16"),
            "it says which: {}",
            stderr(&output)
        );
        assert!(
            bench.written().is_empty(),
            "nothing is written: {:?}",
            bench.written()
        );
    }
}
