//! A walk through the kinds of errors: each names the file, the place in it and the way out, in one line, with exit code 2.

use super::{BALL, Bench, stderr};

/// Files with one fault each.
const FILES: [(&str, &str); 21] = [
    (
        "cut.nrrd",
        "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 32 32 32\nencoding: raw\n\nabc",
    ),
    (
        "kind.nrrd",
        "NRRD0005\ntype: block\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\nabcdefgh",
    ),
    ("line.nrrd", "NRRD0005\ntype uint8\n\n"),
    (
        "out.nhdr",
        "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: ../../etc/passwd\n",
    ),
    (
        "rgb.mha",
        "NDims = 3\nDimSize = 1 1 1\nElementNumberOfChannels = 3\nElementType = MET_USHORT\nElementDataFile = LOCAL\nabcdef",
    ),
    ("bad.json", "{\"RGBPoints\": [0,0,0,0, 1,2,1,1]}"),
    ("half.json", "{\"RGBPoints\": [0,0,"),
    (
        "bad.vp",
        "1\n1\n0.9\n0.1\n0.2\n10\n7 0 0 9 1\n4 0 1 9 1\n4 0 1 1 1\n",
    ),
    (
        "grid.vtk",
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET RECTILINEAR_GRID\n",
    ),
    ("labels.csv", "1,255,0\n"),
    (
        "camera.json",
        "{\"position\": [0,0,5], \"target\": [0,0,0], \"up\": [0,1,0], \"fow\": 3}",
    ),
    (
        "same.json",
        "{\"position\": [0,0,0], \"target\": [0,0,0], \"up\": [0,1,0]}",
    ),
    (
        "keys.json",
        "{\"keys\": [{\"time\": 0, \"camera\": {\"position\": [0,0,9], \"target\": [0,0,0], \"up\": [0,1,0]}}]}",
    ),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
    ("b.obj", "v 0 0 0\nv 1 0\n"),
    ("a.gltf", "{\"asset\":{\"version\":\"3.0\"}}"),
    (
        "b.gltf",
        "{\"asset\":{\"version\":\"2.0\"},\"extensionsRequired\":[\"MSFT_texture_dds\"]}",
    ),
    (
        "c.gltf",
        "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":3}]}",
    ),
    ("text.txt", "hello"),
    ("poses.txt", "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 2\n0 0 0 1\n"),
    ("z.pfm", "Pf\n4 3\n-1\n0123456789"),
];

/// Words, the file that is named, and what is said of it: the place, or the way out.
const WALK: [(&str, &str, &[&str]); 32] = [
    ("volsplat absent.nrrd", "absent.nrrd", &["No such file"]),
    (
        "volsplat cut.nrrd",
        "cut.nrrd",
        &["32768 bytes", "there are 3", "check 'sizes'"],
    ),
    (
        "volsplat kind.nrrd",
        "kind.nrrd",
        &["type block", "convert it"],
    ),
    (
        "volsplat line.nrrd",
        "line.nrrd",
        &["'type uint8'", "expected 'field: value'"],
    ),
    (
        "volsplat out.nhdr",
        "out.nhdr",
        &["../../etc/passwd", "--allow-outside"],
    ),
    (
        "volsplat rgb.mha",
        "rgb.mha",
        &["3 components", "component=N"],
    ),
    (
        "volsplat text.txt",
        "text.txt",
        &["no known header", "--dims"],
    ),
    (
        "volsplat BALL --transfer bad.json",
        "bad.json",
        &["RGBPoints[5]", "expected 0 to 1"],
    ),
    (
        "volsplat BALL --transfer half.json",
        "half.json",
        &["line 1 column 19"],
    ),
    (
        "volsplat BALL --labels --label-colours labels.csv",
        "labels.csv",
        &["line 1", "expected label,red,green,blue"],
    ),
    (
        "volsplat BALL --camera camera.json",
        "camera.json",
        &["\"fow\"", "fov_y"],
    ),
    (
        "volsplat BALL --camera same.json",
        "same.json",
        &["the same point"],
    ),
    (
        "volsplat BALL --path keys.json",
        "keys.json",
        &["two keys or more"],
    ),
    (
        "volsplat BALL --order every-sample --iso 3",
        "--iso",
        &["drop one of them"],
    ),
    (
        "volsplat BALL --also ball.raw nocolour",
        "nocolour",
        &["expected the look", "viridis"],
    ),
    (
        "volsplat BALL --mask text.txt",
        "text.txt",
        &["the file has 5", "check the dimensions"],
    ),
    ("texmap absent.obj", "absent.obj", &["No such file"]),
    ("texmap a.obj", "a.obj", &["line 4", "there is no v 9"]),
    ("texmap b.obj", "b.obj", &["line 2", "expected 3 numbers"]),
    ("texmap a.gltf", "a.gltf", &["3.0", "convert the file"]),
    (
        "texmap b.gltf",
        "b.gltf",
        &["MSFT_texture_dds", "PNG, JPEG or WebP"],
    ),
    (
        "texmap c.gltf",
        "c.gltf",
        &["node 0", "mesh 3 does not exist"],
    ),
    ("texmap text.txt", "text.txt", &["expected glTF 2.0"]),
    (
        "texmap a.gltf#x --camera camera.json",
        "camera.json",
        &["\"fow\""],
    ),
    (
        "warp3d z.pfm z.pfm --from fov:50 --to shift:1,0,0",
        "z.pfm",
        &["no known picture format", "PNG"],
    ),
    (
        "warp3d ball.raw ball.raw --from absent.json --to shift:1,0,0",
        "ball.raw",
        &["no known picture format"],
    ),
    (
        "warp3d z.pfm z.pfm --from fov:50",
        "the new camera is missing",
        &["--to CAM"],
    ),
    (
        "compare text.txt z.pfm",
        "text.txt",
        &["expected a PNG, a JPEG or an OpenEXR"],
    ),
    (
        "volsplat BALL --transfer bad.vp",
        "bad.vp",
        &["line 7", "the count is 7, but 4 numbers"],
    ),
    (
        "volsplat grid.vtk",
        "grid.vtk",
        &["RECTILINEAR_GRID", "Resample To Image"],
    ),
    ("info text.txt", "text.txt", &["no known header"]),
    ("view text.txt --no-open", "text.txt", &["no known header"]),
];

#[test]
fn each_error_names_the_file_the_place_and_the_way_out_in_one_line() {
    let bench = Bench::new();
    for (name, text) in FILES {
        bench.write(name, text.as_bytes());
    }
    let mut wrong = Vec::new();
    for (words, named, says) in WALK {
        let draws =
            ["volsplat", "texmap", "warp3d"].contains(&words.split(' ').next().unwrap_or(""));
        let output = if draws { " -o out/a_%02d.png" } else { "" };
        let words = words.replace("BALL", &format!("ball.raw {BALL}"));
        let ran = bench.run(&format!("{words}{output}"));
        let text = stderr(&ran);
        let is_one_line = text.lines().count() == 1 && text.len() < 600;
        let is_said = text.contains(named) && says.iter().all(|part| text.contains(part));
        if ran.status.code() != Some(2) || !is_one_line || !is_said {
            wrong.push(format!("{words}\n  {:?} {text}", ran.status.code()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(bench.written().is_empty(), "nothing is written");
}

#[test]
fn the_help_lists_the_exit_codes() {
    let bench = Bench::new();
    let help = String::from_utf8(bench.run("--help").stdout).expect("text");
    for code in ["0 ", "1 ", "2 ", "130 "] {
        let is_listed = |line: &str| line.trim_start().starts_with(code);
        assert!(help.lines().any(is_listed), "{code} in\n{help}");
    }
}
