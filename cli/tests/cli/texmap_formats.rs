//! `resample texmap`: meshes without materials, and animated ones.

use super::bad_input::assert_refused;
use super::texmap::{FRONT, pixel};
use super::{Bench, assert_good, read_png};

#[test]
fn ply_and_stl_show_the_same_square() {
    let bench = Bench::new();
    let corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
    let vertices: String = corners
        .iter()
        .map(|[x, y]| format!("{x} {y} 0 0 0 255\n"))
        .collect();
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n{vertices}4 0 1 2 3\n"
    );
    bench.write("a.ply", ply.as_bytes());
    let facet = |corners: [[i32; 2]; 3]| {
        let lines: String = corners
            .iter()
            .map(|[x, y]| format!("vertex {x} {y} 0\n"))
            .collect();
        format!("facet normal 0 0 1\nouter loop\n{lines}endloop\nendfacet\n")
    };
    let [a, b, c, d] = corners;
    let stl = format!(
        "solid s\n{}{}endsolid s\n",
        facet([a, b, c]),
        facet([a, c, d])
    );
    bench.write("a.stl", stl.as_bytes());
    for (file, colour) in [("a.ply", [0, 0, 255, 255]), ("a.stl", [255; 4])] {
        assert_good(&bench.run(&format!("texmap {file} -o out/a.png {FRONT}")));
        let picture = read_png(&bench.path("out/a.png"));
        assert_eq!(
            (pixel(&picture, 32, 32), pixel(&picture, 0, 0)),
            (colour, [0; 4]),
            "{file}"
        );
    }
    std::fs::remove_file(bench.path("out/a.png")).expect("written");
    assert_refused(
        &bench,
        &format!("texmap a.ply --pose-time 1 -o out/b.png {FRONT}"),
        "no animations",
    );
}

#[test]
fn an_animation_is_posed_and_played() {
    let bench = Bench::new();
    let floats =
        |numbers: &[f32]| -> Vec<u8> { numbers.iter().flat_map(|x| x.to_le_bytes()).collect() };
    let square = [
        -1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0,
        0.0,
    ];
    // Within a second the square grows from its size to three times it.
    let data = [
        floats(&square),
        floats(&[0.0, 1.0]),
        floats(&[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]),
    ]
    .concat();
    bench.write("a.bin", &data);
    let view = |offset: usize, length: usize| {
        format!("{{\"buffer\": 0, \"byteOffset\": {offset}, \"byteLength\": {length}}}")
    };
    let accessor = |view: usize, count: usize, shape: &str| {
        format!(
            "{{\"bufferView\": {view}, \"componentType\": 5126, \"count\": {count}, \"type\": \"{shape}\"}}"
        )
    };
    let gltf = format!(
        "{{\"asset\": {{\"version\": \"2.0\"}}, \"buffers\": [{{\"uri\": \"a.bin\", \"byteLength\": 104}}],
          \"bufferViews\": [{}, {}, {}], \"accessors\": [{}, {}, {}],
          \"meshes\": [{{\"primitives\": [{{\"attributes\": {{\"POSITION\": 0}}}}]}}],
          \"nodes\": [{{\"mesh\": 0}}], \"scenes\": [{{\"nodes\": [0]}}], \"scene\": 0,
          \"animations\": [{{\"name\": \"grow\", \"samplers\": [{{\"input\": 1, \"output\": 2}}],
            \"channels\": [{{\"sampler\": 0, \"target\": {{\"node\": 0, \"path\": \"scale\"}}}}]}}]}}",
        view(0, 72), view(72, 8), view(80, 24),
        accessor(0, 6, "VEC3"), accessor(1, 2, "SCALAR"), accessor(2, 2, "VEC3")
    );
    bench.write("a.gltf", gltf.as_bytes());
    let camera =
        "{\"position\": [0, 0, 10], \"target\": [0, 0, 0], \"up\": [0, 1, 0], \"fov_y\": 60}";
    let keys = format!(
        "{{\"keys\": [{{\"time\": 0, \"camera\": {camera}}}, {{\"time\": 1, \"camera\": {camera}}}]}}"
    );
    bench.write("still.json", keys.as_bytes());
    bench.write("camera.json", camera.as_bytes());
    let covered = |name: &str| {
        let (_, _, bytes) = read_png(&bench.path(&format!("out/{name}")));
        bytes
            .chunks(4)
            .map(|pixel| f64::from(pixel[3]) / 255.0)
            .sum::<f64>()
    };
    let area = |words: &str| {
        let words = format!(
            "texmap a.gltf --camera camera.json --size 96x96 --shade unlit {words} -o out/a.png"
        );
        assert_good(&bench.run(&words));
        covered("a.png")
    };
    let still = area("");
    for (words, scale) in [
        ("--pose-time 0", 1.0),
        ("--pose-time 0.5 --animation grow", 2.0),
        ("--pose-time 9", 3.0),
    ] {
        let grown = (area(words) / still).sqrt();
        assert!(
            (grown - scale).abs() < 0.1,
            "{words}: {grown} times as large"
        );
    }
    std::fs::remove_file(bench.path("out/a.png")).expect("written");
    let play =
        "texmap a.gltf --path still.json --fps 2 --play --size 96x96 --shade unlit -o out/p.png";
    assert_good(&bench.run(play));
    let sizes: Vec<f64> = bench
        .written()
        .iter()
        .map(|name| (covered(name) / still).sqrt())
        .collect();
    assert_eq!(sizes.len(), 3, "two pictures a second, both ends");
    for (size, expected) in sizes.iter().zip([1.0, 2.0, 3.0]) {
        assert!((size - expected).abs() < 0.1, "{sizes:?}");
    }
}
