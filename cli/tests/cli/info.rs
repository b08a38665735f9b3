//! `resample info`: the facts about a volume, and refusals.

use serde_json::Value;

use super::{BALL, Bench, stderr};

/// Runs and gives what was printed to stdout.
fn told(bench: &Bench, words: &str) -> String {
    let output = bench.run(words);
    assert_eq!(
        output.status.code(),
        Some(0),
        "`{words}`: {}",
        stderr(&output)
    );
    assert!(
        stderr(&output).is_empty(),
        "`{words}` has nothing to say on stderr: {}",
        stderr(&output)
    );
    String::from_utf8(output.stdout).expect("text")
}

/// A MetaImage of 2x1x2 voxels of 16 bits that lies turned in the world.
fn meta_image() -> Vec<u8> {
    let head = "ObjectType = Image\nNDims = 3\nDimSize = 2 1 2\nElementType = MET_SHORT\nElementSpacing = 1 2 4\n\
                Offset = 10 20 30\nTransformMatrix = 0 1 0 -1 0 0 0 0 1\nAnatomicalOrientation = RAI\n\
                ElementDataFile = LOCAL\n";
    let values = [-3i16, 0, 5, 1000].map(i16::to_le_bytes).concat();
    [head.as_bytes(), &values].concat()
}

#[test]
fn people_read_size_place_and_values() {
    let bench = Bench::new();
    bench.write("turned.mha", &meta_image());
    let text = told(&bench, "info turned.mha");
    for line in [
        "turned.mha",
        "format     MetaImage",
        "size       2 x 1 x 2, 4 voxels",
        "type       i16",
        "spacing    1 x 2 x 4",
        "extent     0 x 1 x 4",
        "x 10 to 10, y 20 to 21, z 30 to 34",
        "x along +y, y along -x, z along +z; up is +z",
        "values     -3 to 1000",
        "memory     8 bytes",
        "histogram  -3 █",
    ] {
        assert!(text.contains(line), "'{line}' is missing in:\n{text}");
    }
    let text = told(&bench, &format!("info ball.raw {BALL} --spacing 1,1,2"));
    assert!(
        text.contains("format     headerless") && text.contains("spacing    1 x 1 x 2"),
        "{text}"
    );
}

#[test]
fn programs_read_json() {
    let bench = Bench::new();
    bench.write("turned.mha", &meta_image());
    let json: Value = serde_json::from_str(&told(&bench, "info --json turned.mha")).expect("JSON");
    assert_eq!(json["format"], "MetaImage", "{json}");
    assert_eq!(json["dims"], serde_json::json!([2, 1, 2]), "{json}");
    assert_eq!(
        json["extent"],
        serde_json::json!([[10.0, 20.0, 30.0], [10.0, 21.0, 34.0]]),
        "{json}"
    );
    assert_eq!(
        json["axes"][1],
        serde_json::json!([-2.0, 0.0, 0.0]),
        "{json}"
    );
    assert_eq!(
        (&json["left_handed"], &json["bytes"]),
        (&Value::Bool(false), &8.into()),
        "{json}"
    );
    let counts: u64 = json["histogram"]["counts"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(Value::as_u64)
        .sum();
    assert_eq!(counts, 4, "every voxel is counted: {json}");
}

#[test]
fn what_cannot_be_read_is_refused_in_one_line() {
    let bench = Bench::new();
    bench.write("turned.mha", &meta_image());
    for (words, named) in [
        ("info absent.nrrd", "absent.nrrd"),
        ("info ball.raw", "--dims"),
        ("info out", "without slices"),
        ("info turned.mha#component=1", "component=1"),
        ("info turned.mha#series=1.2", "series does not apply"),
        ("info turned.mha#array=a", "array does not apply"),
    ] {
        let output = bench.run(words);
        let said = stderr(&output);
        assert_eq!(
            output.status.code(),
            Some(2),
            "`{words}` must end with code 2: {said}"
        );
        assert!(
            said.lines().count() == 1 && said.contains(named),
            "`{words}` must name {named}: {said}"
        );
        assert!(output.stdout.is_empty(), "`{words}` has no result");
    }
}

#[test]
fn meshes_are_counted_and_the_command_is_named() {
    let bench = Bench::new();
    let square = "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nf 1 2 3\nf 1 3 4\n";
    bench.write("square.obj", square.as_bytes());
    let text = told(&bench, "info square.obj");
    for line in [
        "format     OBJ",
        "triangles  2 in 1 parts, 4 vertices",
        "extent     2 x 3 x 0",
        "units      not stated by this format",
        "draw       resample texmap square.obj -o picture.png",
    ] {
        assert!(text.contains(line), "'{line}' is missing in:\n{text}");
    }
    let json: Value = serde_json::from_str(&told(&bench, "info --json square.obj")).expect("JSON");
    assert_eq!(
        (&json["kind"], &json["triangles"]),
        (&"mesh".into(), &2.into()),
        "{json}"
    );
}

#[test]
fn depths_have_a_range_and_unknown_pixels() {
    let bench = super::warp3d::bench();
    let depth = super::warp3d::pfm_of([4, 2], |x, y| match (x, y) {
        (0, 0) => f32::NAN,
        (1, 0) => 0.0,
        (x, y) => (x + 4 * y) as f32,
    });
    bench.write("d.pfm", &depth);
    let text = told(&bench, "info d.pfm");
    for line in [
        "format     PFM",
        "size       4 x 2 pixels",
        "depth      2 to 7, median 5",
        "unknown    2 of 8 pixels, 25.0 %: 1 are 0, 0 negative, 1 NaN, 0 infinite",
        "draw       resample warp3d PICTURE d.pfm",
    ] {
        assert!(text.contains(line), "'{line}' is missing in:\n{text}");
    }
    let text = told(&bench, "info im.png");
    assert!(
        text.contains("channels   3: red (8 bits)") && !text.contains("depth "),
        "{text}"
    );
}

#[test]
fn all_arrays_of_a_file_are_listed() {
    let bench = Bench::new();
    let array = |name: &str| {
        let values = "1 2 3 4 5 6 7 8";
        format!("<DataArray type=\"UInt8\" Name=\"{name}\" format=\"ascii\">{values}</DataArray>")
    };
    let file = format!(
        "<?xml version=\"1.0\"?><VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 0 1 0 1\"><Piece Extent=\"0 1 0 1 0 1\">\
         <PointData Scalars=\"T\">{}{}</PointData></Piece></ImageData></VTKFile>",
        array("T"),
        array("p")
    );
    bench.write("sim.vti", file.as_bytes());
    let printed = |words: &str| {
        let output = bench.run(words);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        String::from_utf8(output.stdout).expect("text")
    };
    let text = printed("info sim.vti");
    assert!(
        text.contains("arrays     T (drawn), p; FILE#array=NAME draws another"),
        "{text}"
    );
    let json: Value = serde_json::from_str(&printed("info --json sim.vti")).expect("JSON");
    assert_eq!(json["arrays"], serde_json::json!(["T", "p"]));
    assert_eq!(json["array"], "T");
    assert!(printed("info sim.vti#array=p").contains("T, p (drawn)"));
    let one = printed(&format!("info ball.raw {BALL}"));
    assert!(!one.contains("arrays"), "{one}");
    let said = stderr(&bench.run("volsplat sim.vti --size 8x8 -o out/a.png"));
    assert!(
        said.contains("the array T is read, there is also p"),
        "{said}"
    );
}
