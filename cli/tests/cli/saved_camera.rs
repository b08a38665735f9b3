//! `--save-camera`: the file draws the same bytes.

use super::warp3d::{VIEW, bench as warp_bench};
use super::{BALL, Bench, assert_good, read_png, stderr};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";

fn bytes(bench: &Bench, name: &str) -> Vec<u8> {
    std::fs::read(bench.path(name)).expect("written")
}

#[test]
fn an_automatic_view_comes_back_in_the_same_bytes() {
    let bench = Bench::new();
    bench.write("square.obj", SQUARE.as_bytes());
    for scene in [
        format!("volsplat ball.raw {BALL}"),
        "texmap square.obj".to_owned(),
    ] {
        for view in [
            "",
            "--orbit 17.3,41.9,0.9",
            "--projection orthographic",
            "--fov 11.7 --up z",
        ] {
            assert_good(&bench.run(&format!(
                "{scene} --size 61x47 {view} -o out/a.png --save-camera out/cam.json"
            )));
            assert_good(&bench.run(&format!("{scene} --camera out/cam.json -o out/b.png")));
            assert!(
                bytes(&bench, "out/a.png") == bytes(&bench, "out/b.png"),
                "{scene} {view}"
            );
        }
    }
}

#[test]
fn a_turntable_is_a_list() {
    let bench = Bench::new();
    let scene = format!("volsplat ball.raw {BALL}");
    assert_good(&bench.run(&format!(
        "{scene} --size 32x32 --turntable 3 -o out/a_%d.png --save-camera out/cam.json"
    )));
    assert_good(&bench.run(&format!("{scene} --camera out/cam.json -o out/b_%d.png")));
    for number in 0..3 {
        // The files differ: numbered pictures carry a fingerprint of the options.
        let [a, b] =
            ["a", "b"].map(|name| read_png(&bench.path(&format!("out/{name}_{number}.png"))));
        assert!(a == b, "picture {number}");
    }
}

#[test]
fn a_moved_picture_comes_back_in_the_same_bytes() {
    let bench = warp_bench();
    assert_good(&bench.run(&format!(
        "{VIEW} --to shift:0.13,-0.07,0.02 -o out/a.png --save-camera out/cam.json"
    )));
    assert_good(&bench.run(&format!("{VIEW} --to out/cam.json -o out/b.png")));
    assert!(bytes(&bench, "out/a.png") == bytes(&bench, "out/b.png"));
}

#[test]
fn the_name_is_checked_before_anything_is_drawn() {
    let bench = Bench::new();
    let output = bench.run(&format!(
        "volsplat ball.raw {BALL} -o out/a.png --save-camera ball.raw"
    ));
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(bench.written().is_empty());
}
