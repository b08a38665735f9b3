//! Voxels of colours in the live viewer.

use serde_json::json;

use super::super::{Bench, ball};
use super::assert_same;

#[test]
fn voxels_of_colours_are_the_command_lines_picture_with_another_opacity_too() {
    let bench = Bench::new();
    let head = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 3 32 32 32\nkinds: RGB-color domain domain domain\nencoding: raw\n\n";
    let colours: Vec<u8> = ball()
        .iter()
        .flat_map(|&value| [value, value / 2, value / 4])
        .collect();
    bench.write("rgb.nrrd", &[head.as_bytes(), &colours].concat());
    assert_same(&bench, "rgb.nrrd", json!({}));
    assert_same(
        &bench,
        "rgb.nrrd",
        json!({ "changes": { "opacity-scale": ["3"] } }),
    );
    assert_same(
        &bench,
        "rgb.nrrd",
        json!({ "changes": { "window": ["128,100"] } }),
    );
}
