//! The commands of README and of the pages, as they stand there, on small files of the names that they use.
//!
//! Left out: `demo`, which the checks run as the README's command; `view`, which waits for a browser; blocks that are not for the
//! shell of this machine (`ssh`). Videos become animations, as not every machine has the program that writes them.

use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::warp3d::{pfm_of, png_of};
use super::{Bench, SIDE, stderr};

/// Size of the pictures with depth, px.
const SIZE: [usize; 2] = [48, 36];

/// Distances of the wall and of the panel before it, and their disparities by the calibration below.
const WALL: f32 = 4.0;
const PANEL: f32 = 2.0;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the workspace")
        .to_owned()
}

/// The lines of a page's blocks that are typed into a shell.
fn commands(page: &Path) -> Vec<String> {
    let text = fs::read_to_string(page).expect("a page");
    let mut is_block = false;
    let mut found = Vec::new();
    for line in text.lines() {
        if line.starts_with("```") {
            is_block = !is_block;
        } else if is_block && line.starts_with("resample ") {
            found.push(line.to_owned());
        }
    }
    found
}

/// Values in Hounsfield units: air, skin, and bone within.
fn head() -> Vec<u8> {
    let mut file = format!(
        "NRRD0004\ntype: short\ndimension: 3\nsizes: {SIDE} {SIDE} {SIDE}\nspace: left-posterior-superior\n\
         space directions: (5,0,0) (0,5,0) (0,0,5)\nspace origin: (-80,-80,-80)\nendian: little\nencoding: raw\n\n"
    )
    .into_bytes();
    for index in 0..SIDE.pow(3) {
        let at = [index % SIDE, index / SIDE % SIDE, index / (SIDE * SIDE)];
        let offset = at.map(|i| (i as f64 - 15.5) / 15.5);
        let radius = offset.iter().map(|x| x * x).sum::<f64>().sqrt();
        let value: i16 = match radius {
            r if r > 0.85 => -1000,
            r if r > 0.7 => 40,
            r if r > 0.55 => 1200,
            _ => 60,
        };
        file.extend(value.to_le_bytes());
    }
    file
}

/// A square of gold.
fn helmet() -> Vec<u8> {
    let positions: [f32; 12] = [-1., -1., 0., 1., -1., 0., 1., 1., 0., -1., 1., 0.];
    let triangles: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let mut bytes: Vec<u8> = positions.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(triangles.iter().flat_map(|i| i.to_le_bytes()));
    let uri = STANDARD.encode(&bytes);
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1, "material": 0}}]}}],
        "materials": [{{"pbrMetallicRoughness": {{"baseColorFactor": [1, 0.8, 0.3, 1], "roughnessFactor": 0.4}}}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]}},
                      {{"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 12}}],
        "buffers": [{{"byteLength": 60, "uri": "data:application/octet-stream;base64,{uri}"}}]}}"#
    )
    .into_bytes()
}

fn is_panel(x: usize, y: usize) -> bool {
    (16..32).contains(&x) && (12..24).contains(&y)
}

fn depth(x: usize, y: usize) -> f32 {
    if is_panel(x, y) { PANEL } else { WALL }
}

fn npy(values: impl Iterator<Item = f32>) -> Vec<u8> {
    let mut header = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}",
        SIZE[1], SIZE[0]
    );
    header += &" ".repeat(63 - (10 + header.len()) % 64);
    header.push('\n');
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((header.len() as u16).to_le_bytes());
    file.extend(header.bytes());
    file.extend(values.flat_map(f32::to_le_bytes));
    file
}

/// A folder with the files that the pages name.
fn bench() -> Bench {
    let bench = Bench::new();
    let pixels: Vec<u8> = (0..SIZE[0] * SIZE[1])
        .map(|i| (i % SIZE[0], i / SIZE[0]))
        .flat_map(|(x, y)| {
            [
                (5 * x) as u8,
                if is_panel(x, y) { 200 } else { 60 },
                (7 * y) as u8,
            ]
        })
        .collect();
    let picture = png_of(SIZE, &pixels);
    for name in ["photo.jpg", "im0.png", "im1.png"] {
        bench.write(name, &picture);
    }
    let all = (0..SIZE[0] * SIZE[1]).map(|i| depth(i % SIZE[0], i / SIZE[0]));
    bench.write("depth.npy", &npy(all));
    // f B / Z with f = 50 px and B = 100 mm, distances in metres.
    for name in ["disp0.pfm", "disp1.pfm"] {
        bench.write(name, &pfm_of(SIZE, |x, y| 5.0 / depth(x, y)));
    }
    let lens = "[50 0 23.5; 0 50 17.5; 0 0 1]";
    let calibration = format!(
        "cam0={lens}\ncam1={lens}\ndoffs=0\nbaseline=100\nwidth={}\nheight={}\nndisp=10\n",
        SIZE[0], SIZE[1]
    );
    bench.write("calib.txt", calibration.as_bytes());
    bench.write("head.nrrd", &head());
    bench.write("helmet.glb", &helmet());
    bench.write("cells.ome.tif", &super::channels::ome_tiff());
    bench.write("garden.ply", &super::gaussians::ply(0));
    // The content says that it is a scan, whatever the name says.
    bench.write("street.laz", super::points::ply().as_bytes());
    bench
}

/// A command with small pictures, few of them, and no video.
fn quick(command: &str) -> String {
    let words = command.trim_start_matches("resample ").replace('\'', "");
    let words = words.replace(".mp4", ".apng");
    let mut words: Vec<String> = words.split_whitespace().map(str::to_owned).collect();
    for index in 1..words.len() {
        if words[index - 1] == "--turntable" {
            words[index] = "3".into();
        }
    }
    if words.contains(&"-o".to_owned())
        && !words.contains(&"--size".to_owned())
        && words[0] != "warp3d"
    {
        words.extend(["--size".into(), "48x48".into()]);
    }
    words.join(" ")
}

/// The pages whose commands are run, and how many they have at least.
const PAGES: [(&str, usize); 7] = [
    ("README.md", 3),
    ("docs/getting-started.md", 8),
    ("docs/points.md", 7),
    ("docs/tasks/render-a-ct.md", 8),
    ("docs/tasks/turntable.md", 5),
    ("docs/tasks/draw-a-mesh.md", 5),
    ("docs/tasks/warp-middlebury.md", 5),
];

#[test]
fn every_command_of_the_pages_runs() {
    let bench = bench();
    for (page, least) in PAGES {
        let all = commands(&root().join(page));
        let run = all.iter().filter(|command| {
            // Films need ffmpeg: they have tests of their own.
            !command.starts_with("resample demo")
                && !command.starts_with("resample view")
                && !command.contains(" film.mp4")
        });
        let mut count = 0;
        for command in run {
            let output = bench.run(&quick(command));
            assert_eq!(
                output.status.code(),
                Some(0),
                "{page}: `{command}`: {}",
                stderr(&output)
            );
            count += 1;
        }
        assert!(count >= least, "{page} has {count} commands");
    }
}
