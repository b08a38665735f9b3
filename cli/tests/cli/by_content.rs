//! `resample FILE`: the content finds the command, and the picture is that of the command by name.

use super::warp3d::bench as warp_bench;
use super::{BALL, Bench, assert_good, stderr};

/// A unit square of two triangles as OBJ.
const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";

/// Draws by content and by name, and compares the bytes.
fn same_bytes(bench: &Bench, by_content: &str, by_name: &str) {
    assert_good(&bench.run(&format!("{by_content} -o out/found.png")));
    assert_good(&bench.run(&format!("{by_name} -o out/named.png")));
    let [found, named] =
        ["out/found.png", "out/named.png"].map(|name| std::fs::read(bench.path(name)));
    assert!(
        found.expect("written") == named.expect("written"),
        "{by_content} draws as {by_name}"
    );
}

#[test]
fn a_volume_is_found_whatever_its_ending() {
    let bench = Bench::new();
    let head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 32 32 32\nencoding: raw\n\n";
    bench.write("head.obj", &[head.as_bytes(), &super::ball()].concat());
    same_bytes(
        &bench,
        "head.obj --size 48x48",
        "volsplat head.obj --size 48x48",
    );
    same_bytes(
        &bench,
        &format!("--threads 1 -q ball.raw {BALL} --size 48x48"),
        &format!("volsplat ball.raw {BALL} --size 48x48"),
    );
}

#[test]
fn a_folder_of_slices_is_a_volume() {
    let bench = Bench::new();
    bench.write("keep.txt", b"");
    assert_good(&bench.draw("-o out/slice%d.png --size 24x24 --turntable 3"));
    std::fs::rename(bench.path("out"), bench.path("slices")).expect("moved");
    std::fs::create_dir(bench.path("out")).expect("a folder");
    let words = "--spacing 1,1,4 --size 48x48";
    same_bytes(
        &bench,
        &format!("slices {words}"),
        &format!("volsplat slices {words}"),
    );
    // As a shell lists them.
    for command in ["", "volsplat "] {
        let listed = "slices/slice0.png slices/slice1.png slices/slice2.png";
        same_bytes(
            &bench,
            &format!("{command}{listed} {words}"),
            &format!("volsplat slices {words}"),
        );
    }
    let output = bench.run("volsplat slices/slice0.png slices/slice1.png -o out/a.png");
    let text = stderr(&output);
    assert!(
        output.status.code() == Some(2) && text.contains("3 in their folder have such a name"),
        "two of three slices: {text}"
    );
    let output = bench.run("volsplat slices/slice*.png -o slices/slice1.png --size 48x48");
    assert_eq!(output.status.code(), Some(2), "a slice is not written over");
}

#[test]
fn voxels_of_colours_are_drawn_as_they_are() {
    let bench = Bench::new();
    let head = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 3 32 32 32\nkinds: RGB-color domain domain domain\nencoding: raw\n\n";
    let colours: Vec<u8> = super::ball()
        .iter()
        .flat_map(|&value| [value, value / 2, 255 - value])
        .collect();
    bench.write("rgb.nrrd", &[head.as_bytes(), &colours].concat());
    same_bytes(
        &bench,
        "rgb.nrrd --size 48x48",
        "volsplat rgb.nrrd --size 48x48",
    );
    // A ball of one colour: where it is opaque, the picture has that colour.
    let one: Vec<u8> = super::ball()
        .iter()
        .flat_map(|&value| if value > 0 { [200, 100, 50] } else { [0; 3] })
        .collect();
    bench.write("one.nrrd", &[head.as_bytes(), &one].concat());
    for words in ["", "--blend maximum", "--order every-sample"] {
        let words = format!(
            "volsplat one.nrrd {words} --shade none --opacity-scale 20 --size 48x48 --background 0,0,0 -o out/one.png"
        );
        assert_good(&bench.run(&words));
        let picture = image::open(bench.path("out/one.png")).expect("a picture");
        let [red, green, blue, alpha] = picture.to_rgba8().get_pixel(24, 24).0;
        let near = |value: u8, wanted: u8| value.abs_diff(wanted) <= 2;
        assert!(
            near(red, 200) && near(green, 100) && near(blue, 50) && alpha == 255,
            "{words}: {:?}",
            [red, green, blue, alpha]
        );
    }
    let info = String::from_utf8(bench.run("info rgb.nrrd").stdout).expect("text");
    assert!(info.contains("colours    3 a voxel"), "{info}");
}

#[test]
fn a_mesh_is_found_whatever_its_ending() {
    let bench = Bench::new();
    bench.write("square.nrrd", SQUARE.as_bytes());
    same_bytes(
        &bench,
        "square.nrrd --size 48x48",
        "texmap square.nrrd --size 48x48",
    );
}

#[test]
fn a_picture_and_its_depth_are_two_names_or_one() {
    let bench = warp_bench();
    let lens = "--intrinsics 30,30,15.5,11.5 --to shift:0.1,0,0";
    same_bytes(
        &bench,
        &format!("im.png z.pfm {lens}"),
        &format!("warp3d im.png z.pfm {lens}"),
    );
    bench.write("square.obj", SQUARE.as_bytes());
    assert_good(&bench.run("texmap square.obj -o out/both.exr --size 48x48"));
    let lens = "--from fov:30 --to shift:0.05,0,0";
    same_bytes(
        &bench,
        &format!("out/both.exr {lens}"),
        &format!("warp3d out/both.exr out/both.exr {lens}"),
    );
}

#[test]
fn what_may_be_several_things_is_refused_with_the_commands() {
    let bench = warp_bench();
    let head = "{'descr': '|u1', 'fortran_order': False, 'shape': (4, 4), }";
    let head = format!("{head:<117}\n");
    let npy = [
        b"\x93NUMPY\x01\x00".as_slice(),
        &118u16.to_le_bytes(),
        head.as_bytes(),
        &[7; 16],
    ];
    bench.write("plane.bin", &npy.concat());
    for (words, said) in [
        (
            "plane.bin",
            "resample volsplat plane.bin) or a depth (resample warp3d",
        ),
        ("im.png", "a photograph needs a depth map"),
        ("im.png im.png im.png", "pattern in quotes"),
        ("absent/a.nrrd", "neither a file nor a command"),
    ] {
        let output = bench.run(&format!("{words} -o out/a.png"));
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{words}: {text}");
        assert!(
            text.contains(said) && text.lines().count() == 1 && !text.contains("error: error"),
            "{words}: {text}"
        );
    }
    let misspelt = stderr(&bench.run("volspalt a"));
    assert!(
        misspelt.contains("volsplat"),
        "commands are still corrected: {misspelt}"
    );
}
