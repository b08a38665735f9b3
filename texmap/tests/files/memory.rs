//! Pictures that do not fit into memory with their levels.

use resample_io::{Gate, Outside};
use texmap::{LoadOptions, load};

/// A unit square of two triangles, with texture coordinates.
const SQUARE: &str =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\n";

#[test]
fn pictures_beyond_the_memory_are_an_error_and_not_white() {
    let folder = tempfile::tempdir().expect("a folder");
    let side = 64;
    let count = 5;
    let (mut library, mut obj) = (String::new(), format!("mtllib a.mtl\n{SQUARE}"));
    for number in 0..count {
        let picture = image::RgbaImage::from_pixel(side, side, image::Rgba([0, 0, 255, 255]));
        picture
            .save(folder.path().join(format!("{number}.png")))
            .expect("written");
        library += &format!("newmtl m{number}\nmap_Kd {number}.png\n");
        obj += &format!("usemtl m{number}\nf 1/1 2/2 3/3\n");
    }
    std::fs::write(folder.path().join("a.mtl"), library).expect("written");
    let path = folder.path().join("a.obj");
    std::fs::write(&path, obj).expect("written");
    // Texels as they are in the file take 4 bytes, and 8 in linear light; coarser levels a third of that more.
    let texels = u64::from(count * side * side);
    let enough = texels * 4 + texels * 4 / 3 * 8;
    let within = |bytes: u64| {
        let gate = Gate::new(Outside::Refused, Some(bytes));
        load(
            &path,
            &LoadOptions {
                gate,
                ..LoadOptions::default()
            },
        )
    };
    let scene = within(enough).expect("all fit").scene;
    assert_eq!(scene.textures.len(), count as usize, "every one");
    for bytes in [enough * 9 / 10, texels * 4, texels * 4 - 1] {
        let error = within(bytes).expect_err("not all fit").to_string();
        assert!(
            error.contains("textures") && error.contains("--max-memory"),
            "of {bytes} bytes: {error}"
        );
    }
}
