//! Parts of the work, drawn by processes of their own: together they have the bytes of one run, and parts that do not fit are refused.

use std::fs;

use super::{Bench, assert_good, stderr};

/// A triangle that fills a part of the picture.
const TRIANGLE: &str = "v 0 0 0\nv 1 0.2 0\nv 0.3 1 0.4\nf 1 2 3\n";

/// Draws the tiles of 3x2 of a command.
fn draw_tiles(bench: &Bench, command: &str) {
    for tile in ["0,0", "1,0", "2,0", "0,1", "1,1", "2,1"] {
        assert_good(&bench.run(&format!("{command} --tile {tile}/3x2")));
    }
}

/// The words of all tiles of a picture.
fn tiles(name: &str) -> String {
    let tile = |at: usize| format!("out/{name}.tile-{}-{}.exr", at % 3, at / 3);
    (0..6).map(tile).collect::<Vec<_>>().join(" ")
}

fn assert_same(bench: &Bench, one: &str, other: &str) {
    let read = |name: &str| fs::read(bench.path(name)).expect("written");
    assert!(read(one) == read(other), "{one} has the bytes of {other}");
}

fn assert_refused(bench: &Bench, words: &str, why: &str) {
    let output = bench.run(words);
    assert_eq!(
        output.status.code(),
        Some(2),
        "`{words}`: {}",
        stderr(&output)
    );
    assert!(
        stderr(&output).contains(why),
        "`{words}`: {}",
        stderr(&output)
    );
}

#[test]
fn pictures_of_a_part_are_those_of_one_run() {
    let bench = Bench::new();
    bench.write("a.obj", TRIANGLE.as_bytes());
    let volume = "volsplat ball.raw --dims 32,32,32 --type u8";
    for command in [volume, "texmap a.obj"] {
        let all = format!("{command} --size 40x30 --turntable 5");
        assert_good(&bench.run(&format!("{all} -o out/whole.png")));
        for part in ["0..2", "2..4", "4..9"] {
            assert_good(&bench.run(&format!("{all} --frames {part} -o out/part.png")));
        }
        for number in 0..5 {
            let names = ["part", "whole"].map(|name| format!("out/{name}_000{number}.png"));
            assert_same(&bench, &names[0], &names[1]);
        }
        assert!(!bench.path("out/part_0005.png").exists(), "there are five");
        let output = bench.run(&format!("{all} --frames 1..3 --resume -o out/part.png"));
        assert!(
            stderr(&output).contains("2 of 2 pictures"),
            "{}",
            stderr(&output)
        );
        assert_refused(
            &bench,
            &format!("{all} --frames 5..6 -o out/part.png"),
            "--frames",
        );
        assert_refused(
            &bench,
            &format!("{all} --frames 0..2 -o out/part.apng"),
            "--frames",
        );
        let hurried = format!("{all} --frames 0..2 --max-time 50ms -o out/part.png");
        assert_refused(&bench, &hurried, "--max-time");
    }
}

#[test]
fn warps_are_divided_by_pictures_alone() {
    let bench = super::warp3d::bench();
    let sway = format!("{} --method nearest --sway 3,4", super::warp3d::VIEW);
    assert_good(&bench.run(&format!("{sway} -o out/whole.png")));
    assert_good(&bench.run(&format!("{sway} --frames 2.. -o out/part.png")));
    assert_eq!(bench.written().len(), 6, "{:?}", bench.written());
    for number in 2..4 {
        let names = ["part", "whole"].map(|name| format!("out/{name}_000{number}.png"));
        assert_same(&bench, &names[0], &names[1]);
    }
    assert_refused(
        &bench,
        &format!("{sway} --tile 0,0/1x1 -o out/a.png"),
        "--tile",
    );
}

#[test]
fn tiles_together_are_one_run() {
    let bench = Bench::new();
    bench.write("a.obj", TRIANGLE.as_bytes());
    let volume = "volsplat ball.raw --dims 32,32,32 --type u8 --size 70x50";
    let cases = [
        (volume.to_owned(), "png"),
        (format!("{volume} --layers first-hit"), "exr"),
        (format!("{volume} --bits 16 --background out/a.png"), "png"),
        ("texmap a.obj --size 70x50 --layers depth".to_owned(), "exr"),
    ];
    assert_good(&bench.run("texmap a.obj --size 20x20 --background white -o out/a.png"));
    for (command, kind) in cases {
        assert_good(&bench.run(&format!("{command} -o out/whole.{kind}")));
        draw_tiles(&bench, &format!("{command} -o out/p.{kind}"));
        assert_good(&bench.run(&format!("join {} -o out/p.{kind}", tiles("p"))));
        assert_same(
            &bench,
            &format!("out/p.{kind}"),
            &format!("out/whole.{kind}"),
        );
    }
    let film = format!("{volume} --turntable 2");
    assert_good(&bench.run(&format!("{film} -o out/film.png")));
    draw_tiles(&bench, &format!("{film} -o out/q.png"));
    let both = format!("{} {}", tiles("q_0000"), tiles("q_0001"));
    assert_good(&bench.run(&format!("join {both} -o out/q.png")));
    assert_same(&bench, "out/q_0000.png", "out/film_0000.png");
    assert_same(&bench, "out/q_0001.png", "out/film_0001.png");
}

#[test]
fn parts_that_do_not_fit_together_are_refused() {
    let bench = Bench::new();
    let volume = "volsplat ball.raw --dims 32,32,32 --type u8 --size 70x50";
    draw_tiles(&bench, &format!("{volume} -o out/p.png"));
    let all = tiles("p");
    let refused = |words: &str, why: &str| {
        assert_refused(&bench, &format!("join {words} -o out/joined.png"), why);
    };
    let but_one = all.replace(" out/p.tile-1-1.exr", "");
    refused(&but_one, "the tile 1,1/3x2 is missing");
    refused(&format!("{all} out/p.tile-1-1.exr"), "the same tile twice");
    refused("ball.raw", "expected a file that --tile wrote");
    assert_refused(
        &bench,
        &format!("join {all} -o out/joined.exr"),
        "another format",
    );
    for (words, why) in [
        ("--opacity-scale 2", "other options"),
        ("--orbit 31,20", "other options"),
        ("--vector-level baseline", "unlike vector instructions"),
    ] {
        assert_good(&bench.run(&format!("{volume} {words} -o out/x.png --tile 1,1/3x2")));
        refused(&format!("{but_one} out/x.tile-1-1.exr"), why);
    }
    // A tile of another version: its record is plain text in the file.
    let tile = fs::read(bench.path("out/p.tile-1-1.exr")).expect("written");
    let version = concat!("\"version\":\"", env!("CARGO_PKG_VERSION"), "\"").as_bytes();
    let at = tile.windows(version.len()).position(|part| part == version);
    let last_digit = at.expect("the version") + version.len() - 2;
    let mut other = tile.clone();
    other[last_digit] ^= 1;
    bench.write("out/x.tile-1-1.exr", &other);
    refused(
        &format!("{but_one} out/x.tile-1-1.exr"),
        "drawn by the versions",
    );
    assert_good(&bench.run(&format!("{volume} -o out/x.png --tile 1,1/2x2")));
    refused(&format!("{but_one} out/x.tile-1-1.exr"), "other options");
    assert!(!bench.path("out/joined.png").exists(), "nothing is written");
    assert_refused(
        &bench,
        &format!("{volume} -o out/a.png --tile 0,0/5x9"),
        "at most 5x4 tiles",
    );
    let samples = format!("{volume} --order every-sample -o out/a.png --tile 0,0/2x2");
    assert_refused(&bench, &samples, "--tile");
}
