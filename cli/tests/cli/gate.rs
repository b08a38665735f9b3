//! Files that are read and written: no input changes, names in files stay in their folder, bombs are refused.

use std::fs;
use std::io::Write;
use std::time::{Duration, Instant};

use super::bad_input::{assert_one_line, assert_refused};
use super::{BALL, Bench, assert_good, stderr};

/// A triangle with a buffer and a picture beside it.
fn gltf(buffer: &str, picture: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"material":0}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
        "textures":[{{"source":0}}],"images":[{{"uri":"{picture}"}}],
        "buffers":[{{"uri":"{buffer}","byteLength":60}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":24}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}}]}}"#
    )
}

fn triangle() -> Vec<u8> {
    let numbers: [f32; 15] = [
        0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0,
    ];
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

fn nrrd(data_file: &str) -> String {
    format!(
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 32 32 32\nencoding: raw\ndata file: {data_file}\n"
    )
}

/// A small picture as this program writes it.
fn picture(bench: &Bench, name: &str) -> Vec<u8> {
    assert_good(&bench.draw(&format!("--size 8x8 -o {name}")));
    fs::read(bench.path(name)).expect("written")
}

#[test]
fn no_input_is_written_over() {
    let bench = Bench::new();
    let drawn = picture(&bench, "a_0001.png");
    bench.write("mesh.bin", &triangle());
    bench.write("mesh.gltf", gltf("mesh.bin", "a_0001.png").as_bytes());
    bench.write("ball.nhdr", nrrd("ball.raw").as_bytes());
    fs::copy(bench.path("ball.raw"), bench.path("ball.png")).expect("a copy");
    bench.write("named.nhdr", nrrd("ball.png").as_bytes());
    let background = "volsplat ball.nhdr --size 8x8 --background a_0001.png";
    for (words, named) in [
        (format!("{background} --turntable 2 -o a.png"), "a_0001.png"),
        ("texmap mesh.gltf -o a_0001.png".into(), "a_0001.png"),
        (
            "texmap mesh.gltf --turntable 2 -o a_%04d.png".into(),
            "a_0001.png",
        ),
        ("volsplat named.nhdr -o ball.png".into(), "ball.png"),
        (
            "volsplat named.nhdr --stats ball.png -o out/a.png".into(),
            "ball.png",
        ),
        (
            "volsplat ball.nhdr --stats out/y.png -o out/y.png".into(),
            "out/y.png",
        ),
        (
            "texmap mesh.gltf --stats mesh.bin -o out/y.png".into(),
            "mesh.bin",
        ),
    ] {
        assert_one_line(&bench, &words, named);
    }
    assert_eq!(fs::read(bench.path("a_0001.png")).expect("there"), drawn);
    assert_eq!(fs::read(bench.path("mesh.bin")).expect("there"), triangle());
}

#[cfg(unix)]
#[test]
fn another_spelling_is_the_same_file() {
    let bench = Bench::new();
    picture(&bench, "a.png");
    std::os::unix::fs::symlink(bench.path("a.png"), bench.path("link.png")).expect("a link");
    for target in ["out/../a.png", "link.png"] {
        let words = format!("volsplat ball.raw {BALL} --background a.png -o {target}");
        assert_one_line(&bench, &words, target);
    }
}

#[test]
fn names_in_files_stay_in_their_folder() {
    let bench = Bench::new();
    fs::create_dir(bench.path("in")).expect("a folder");
    let absolute = bench.path("ball.raw").display().to_string();
    for name in ["../ball.raw", absolute.as_str()] {
        bench.write("in/a.nhdr", nrrd(name).as_bytes());
        assert_one_line(&bench, "volsplat in/a.nhdr -o out/a.png", "--allow-outside");
        assert_good(&bench.run("volsplat in/a.nhdr --size 8x8 -o out/a.png --allow-outside"));
        fs::remove_file(bench.path("out/a.png")).expect("written");
    }
    bench.write("mesh.bin", &triangle());
    picture(&bench, "a.png");
    for name in ["../mesh.bin", "%2e%2e/mesh.bin", "http://host/mesh.bin"] {
        bench.write("in/a.gltf", gltf(name, "../a.png").as_bytes());
        assert_one_line(&bench, "texmap in/a.gltf -o out/a.png", "buffer 0");
    }
    bench.write("in/mesh.bin", &triangle());
    bench.write("in/a.gltf", gltf("mesh.bin", "../a.png").as_bytes());
    let output = bench.run("texmap in/a.gltf --size 8x8 -o out/a.png");
    assert!(
        stderr(&output).contains("--allow-outside"),
        "a note: {}",
        stderr(&output)
    );
    let mtl = "newmtl m\nmap_Kd ..\\a.png\n";
    bench.write("in/m.mtl", mtl.as_bytes());
    let obj = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
    bench.write("in/m.obj", obj.as_bytes());
    let output = bench.run("texmap in/m.obj --size 8x8 -o out/a.png");
    assert!(
        stderr(&output).contains("--allow-outside"),
        "a note: {}",
        stderr(&output)
    );
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_refused_at_once() {
    let bench = Bench::new();
    let made = std::process::Command::new("mkfifo")
        .arg(bench.path("pipe"))
        .status();
    assert!(made.is_ok_and(|status| status.success()), "a pipe");
    bench.write("zero.nhdr", nrrd("/dev/zero\nline skip: 1").as_bytes());
    let start = Instant::now();
    for words in [
        format!("volsplat ball.raw {BALL} --transfer /dev/zero -o out/a.png"),
        format!("volsplat ball.raw {BALL} --camera pipe -o out/a.png"),
        format!("volsplat ball.raw {BALL} --labels --label-colours pipe -o out/a.png"),
        "volsplat zero.nhdr --allow-outside -o out/a.png".into(),
        "volsplat pipe -o out/a.png".into(),
        "texmap pipe -o out/a.png".into(),
        "texmap /dev/zero -o out/a.png".into(),
        "warp3d pipe pipe --from fov:60 --to shift:0.1,0,0 -o out/a.png".into(),
    ] {
        assert_refused(&bench, &words, "a device, a pipe or a socket");
    }
    assert_refused(&bench, "compare pipe pipe", "a device, a pipe or a socket");
    let joined = "join pipe ball.raw -o out/a.png";
    assert_refused(&bench, joined, "a device, a pipe or a socket");
    assert!(start.elapsed() < Duration::from_secs(20), "nothing waits");
}

#[test]
fn a_text_may_come_from_the_standard_input() {
    let bench = Bench::new();
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_resample"))
        .current_dir(bench.folder.path())
        .args(format!("volsplat ball.raw {BALL} --size 8x8 --camera - -o out/a.png").split(' '))
        .stdin(std::process::Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let camera = br#"{"position":[16,16,90],"target":[16,16,16],"up":[0,1,0]}"#;
    let mut stdin = child.stdin.take().expect("a pipe");
    stdin.write_all(camera).expect("read");
    drop(stdin);
    assert!(child.wait().expect("an end").success());
    assert_eq!(bench.written(), ["a.png"]);
}

#[test]
fn what_a_file_says_cannot_command_the_terminal() {
    let bench = Bench::new();
    bench.write(
        "a.nrrd",
        b"NRRD0004\ntype: \x1b]0;owned\x07\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n\n1",
    );
    let arrays: String = (0..20_000)
        .map(|i| format!(r#"<DataArray type="UInt8" Name="a{i}" format="ascii">1</DataArray>"#))
        .collect();
    let vti = format!(
        r#"<VTKFile type="ImageData"><ImageData WholeExtent="0 1 0 1 0 1" Origin="0 0 0" Spacing="1 1 1"><Piece Extent="0 1 0 1 0 1"><PointData>{arrays}</PointData></Piece></ImageData></VTKFile>"#
    );
    bench.write("many.vti", vti.as_bytes());
    for file in ["a.nrrd", "many.vti"] {
        let said = stderr(&bench.run(&format!("volsplat {file} -o out/a.png")));
        assert!(!said.contains(['\x1b', '\x07']), "{said:?}");
        assert!(said.len() < 700, "{} bytes", said.len());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn names_that_are_no_unicode_are_names() {
    use std::os::unix::ffi::OsStrExt;
    let bench = Bench::new();
    let name = std::ffi::OsStr::from_bytes(b"b\xff.raw");
    fs::copy(bench.path("ball.raw"), bench.folder.path().join(name)).expect("a copy");
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_resample"))
        .current_dir(bench.folder.path())
        .arg("volsplat")
        .arg(name)
        .args(format!("{BALL} --size 8x8 -o out/a.png --stats out/s.json").split(' '))
        .output()
        .expect("the binary starts");
    assert_good(&output);
    assert_eq!(bench.written(), ["a.png", "s.json"]);
}

#[test]
fn resume_keeps_only_what_this_run_would_write() {
    let bench = Bench::new();
    assert_good(&bench.draw("--size 16x16 --turntable 4 -o out/w.png"));
    let whole = |step: usize| fs::read(bench.path(&format!("out/w_000{step}.png"))).expect("there");
    bench.write("out/a_0000.png", b"");
    bench.write("out/a_0001.png", &whole(1)[..60]);
    bench.write("out/a_0002.png", &picture(&bench, "small.png"));
    bench.write("out/a_0003.png", &whole(3));
    let output = bench.draw("--size 16x16 --turntable 4 --resume -o out/a.png");
    assert_good(&output);
    let said = stderr(&output);
    assert!(
        said.contains("1 of 4 pictures were there already"),
        "{said}"
    );
    assert!(
        said.contains("8x8 pixels, expected a PNG of 8 bits of 16x16"),
        "{said}"
    );
    for step in 0..4 {
        let again = fs::read(bench.path(&format!("out/a_000{step}.png"))).expect("there");
        assert!(again == whole(step), "picture {step}");
    }
}

#[test]
fn resume_draws_again_what_other_options_or_files_made() {
    for format in ["png", "exr"] {
        let bench = Bench::new();
        let words = format!("--size 16x16 --turntable 2 --resume -o out/a.{format}");
        assert_good(&bench.draw(&words));
        let kept = |output: &std::process::Output| stderr(output).contains("wrote nothing");
        assert!(kept(&bench.draw(&words)), "{format}: the same again");
        assert!(
            kept(&bench.draw(&format!("{words} --threads 1"))),
            "threads"
        );
        let other = format!("{words} --background white");
        let output = bench.draw(&other);
        let said = stderr(&output);
        assert!(said.contains("made with other options"), "{said}");
        assert!(said.contains("wrote 2 pictures"), "{said}");
        assert!(kept(&bench.draw(&other)));
        let mut voxels = fs::read(bench.path("ball.raw")).expect("there");
        let last = voxels.len() - 1;
        voxels[last] ^= 1;
        fs::write(bench.path("ball.raw"), &voxels).expect("written");
        assert!(!kept(&bench.draw(&other)), "a voxel has changed");
    }
}

#[test]
fn a_folder_in_the_way_is_found_before_the_first_picture() {
    let bench = Bench::new();
    fs::create_dir(bench.path("out/a_0002.png")).expect("a folder");
    let output = bench.draw("--size 8x8 --turntable 3 -o out/a.png");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(bench.written(), ["a_0002.png"], "no picture is drawn");
}

#[test]
fn files_of_killed_runs_are_swept_up_and_those_of_others_stay() {
    let bench = Bench::new();
    bench.write("out/.resample-dead.tmp", b"half a picture");
    let busy = fs::File::create(bench.path("out/.resample-busy.tmp")).expect("a file");
    busy.lock().expect("a lock");
    assert_good(&bench.draw("--size 8x8 -o out/a.png"));
    assert_eq!(bench.written(), [".resample-busy.tmp", "a.png"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_terminated_run_leaves_nothing_half_written() {
    let bench = Bench::new();
    for signal in ["-TERM", "-HUP", "-INT"] {
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_resample"))
            .current_dir(bench.folder.path())
            .args(
                format!("volsplat ball.raw {BALL} --size 256x256 --turntable 4000 -o out/a.apng")
                    .split(' '),
            )
            .stderr(std::process::Stdio::null())
            .spawn()
            .expect("the binary starts");
        let begun = Instant::now();
        while bench.written().is_empty() && begun.elapsed() < Duration::from_secs(20) {
            std::thread::sleep(Duration::from_millis(5));
        }
        let kill = |signal: &str| {
            let id = child.id().to_string();
            std::process::Command::new("kill")
                .args([signal, &id])
                .status()
        };
        assert!(kill(signal).is_ok_and(|status| status.success()));
        assert_eq!(child.wait().expect("an end").code(), Some(130), "{signal}");
        assert!(
            bench.written().is_empty(),
            "{signal}: {:?}",
            bench.written()
        );
    }
}

#[test]
fn small_files_that_unpack_to_much_are_refused_until_memory_is_given() {
    let bench = Bench::new();
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    let zeros = vec![0u8; 1 << 20];
    for _ in 0..300 {
        packed.write_all(&zeros).expect("memory");
    }
    let packed = packed.finish().expect("memory");
    let header = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 1024 1024 300\nencoding: gzip\n\n";
    bench.write("a.nrrd", &[header.as_bytes(), &packed].concat());
    let bytes = fs::metadata(bench.path("a.nrrd")).expect("written").len();
    assert!(bytes < 400_000, "a bomb of {bytes} bytes");
    assert_one_line(&bench, "volsplat a.nrrd -o out/a.png", "--max-memory");
    assert_one_line(&bench, "info a.nrrd", "--max-memory");
    assert_one_line(
        &bench,
        "volsplat a.nrrd --max-memory 100M -o out/a.png",
        "104.9 MB",
    );
    let zarr = r#"{"zarr_format":2,"shape":[1048576,1024,1024],"chunks":[64,1024,1024],"dtype":"|u1",
        "compressor":null,"fill_value":7,"order":"C","filters":null}"#;
    fs::create_dir(bench.path("a.zarr")).expect("a folder");
    bench.write("a.zarr/.zarray", zarr.as_bytes());
    assert_refused(&bench, "volsplat a.zarr -o out/a.png", "a.zarr");
}

#[test]
fn forged_counts_are_refused_at_once() {
    let bench = Bench::new();
    let start = Instant::now();
    let attributes: String = (0..20_000).map(|i| format!(r#" a{i}="1""#)).collect();
    bench.write(
        "tag.vti",
        format!(r#"<VTKFile type="ImageData"{attributes}/>"#).as_bytes(),
    );
    assert_one_line(
        &bench,
        "volsplat tag.vti -o out/a.png",
        "a tag of more than",
    );

    let zeros = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[PRIMITIVES]}],
        "accessors":[{"componentType":5126,"count":60000,"type":"VEC3"}]}"#;
    let primitives = vec![r#"{"attributes":{"POSITION":0}}"#; 64].join(",");
    bench.write(
        "zeros.gltf",
        zeros.replace("PRIMITIVES", &primitives).as_bytes(),
    );
    assert_one_line(&bench, "texmap zeros.gltf -o out/a.png", "--max-memory");

    let buffer = r#"{"uri":"self.gltf","byteLength":100000}"#;
    let buffers = vec![buffer; 4000].join(",");
    let document = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{}}],"buffers":[{buffers}]}}"#
    );
    bench.write("self.gltf", document.as_bytes());
    assert_one_line(&bench, "texmap self.gltf -o out/a.png", "--max-memory");

    let corners = "1 2 3 ".repeat(30_000);
    bench.write(
        "fan.obj",
        format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf {corners}\n").as_bytes(),
    );
    assert_one_line(&bench, "texmap fan.obj -o out/a.png", "corners");

    bench.write("m.mtl", "newmtl m\nKd 1 0 0\n".repeat(20_000).as_bytes());
    let libraries = "mtllib m.mtl\n".repeat(20_000);
    let obj = format!("{libraries}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    bench.write("many.obj", obj.as_bytes());
    assert_good(&bench.run("texmap many.obj --size 8x8 -o out/a.png"));
    fs::remove_file(bench.path("out/a.png")).expect("written");

    let inner = r#"{"name":"sharding_indexed","configuration":{"chunk_shape":[0,4,4],"codecs":[{"name":"bytes"}],
        "index_codecs":[{"name":"bytes"}],"index_location":"end"}}"#;
    let zarr = format!(
        r#"{{"zarr_format":3,"node_type":"array","shape":[8,8,8],"data_type":"uint8","chunk_grid":{{"name":"regular",
        "configuration":{{"chunk_shape":[8,8,8]}}}},"chunk_key_encoding":{{"name":"default","configuration":{{"separator":"/"}}}},
        "fill_value":0,"codecs":[{{"name":"sharding_indexed","configuration":{{"chunk_shape":[8,8,8],"codecs":[{inner}],
        "index_codecs":[{{"name":"bytes"}}],"index_location":"end"}}}}],"attributes":{{}}}}"#
    );
    fs::create_dir_all(bench.path("a.zarr/c/0/0")).expect("folders");
    bench.write("a.zarr/zarr.json", zarr.as_bytes());
    bench.write("a.zarr/c/0/0/0", &[0; 528]);
    assert_one_line(&bench, "volsplat a.zarr -o out/a.png", "cannot be cut");
    let vast = r#"{"zarr_format":2,"shape":[4194304,1048576,1048576],"chunks":[2048,1024,1024],"dtype":"|u1",
        "compressor":null,"fill_value":0,"order":"C","filters":null}"#;
    fs::create_dir(bench.path("b.zarr")).expect("a folder");
    bench.write("b.zarr/.zarray", vast.as_bytes());
    assert_one_line(&bench, "info b.zarr", "b.zarr");
    assert!(
        start.elapsed() < Duration::from_secs(20),
        "no work for forged counts"
    );
}
