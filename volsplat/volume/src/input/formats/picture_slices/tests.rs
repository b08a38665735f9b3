//! Slices in pictures: their order, their numbers, and refusals.

use std::path::Path;

use resample_io::Picture;

use super::{brightness, of_component};
use crate::input::test_files::Folder;
use crate::input::{Format, LoadOptions, format_of, load, load_colours};
use crate::volume::Voxels;

/// A grey PNG of 2x1 pixels of 8 bits, whose data is stored without packing.
fn png(values: [u8; 2]) -> Vec<u8> {
    let chunk = |name: &[u8; 4], data: &[u8]| {
        let body = [name.as_slice(), data].concat();
        let mut crc = flate2::Crc::new();
        crc.update(&body);
        [
            &(data.len() as u32).to_be_bytes()[..],
            &body,
            &crc.sum().to_be_bytes(),
        ]
        .concat()
    };
    let head = [
        &2u32.to_be_bytes()[..],
        &1u32.to_be_bytes(),
        &[8, 0, 0, 0, 0],
    ]
    .concat();
    let data = crate::input::test_files::zlib(&[0, values[0], values[1]]);
    [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        chunk(b"IHDR", &head),
        chunk(b"IDAT", &data),
        chunk(b"IEND", &[]),
    ]
    .concat()
}

#[test]
fn slices_come_in_the_order_of_their_numbers() {
    let folder = Folder::new();
    folder.write("notes.txt", &[b"text"]);
    for (name, values) in [("s10.png", [9, 10]), ("s2.png", [3, 4]), ("s1.png", [1, 2])] {
        folder.write(name, &[&png(values)]);
    }
    for typed in ["", "s*.png"] {
        let path = folder.path(typed);
        let second = LoadOptions {
            component: Some(1),
            ..LoadOptions::default()
        };
        let refused = load(&path, &second).expect_err("grey").to_string();
        assert!(refused.contains("1 component"), "{refused}");
        assert!(load_colours(&path, &second).expect("readable").is_none());
        assert_eq!(format_of(&path).expect("readable"), Some(Format::Pictures));
        let options = LoadOptions::default();
        let volume = load(&path, &options).expect("good slices");
        assert_eq!(volume.dims, [2, 1, 3]);
        assert_eq!(volume.voxels, Voxels::U8(vec![1, 2, 3, 4, 9, 10]));
        assert!(options.gate.remarks()[0].contains("3 slices in the natural order"));
        assert_eq!(
            options.gate.files().len(),
            3,
            "none of them is written over"
        );
    }
    let spaced = LoadOptions {
        spacing: Some([0.5, 0.5, 2.0]),
        ..LoadOptions::default()
    };
    let volume = load(&folder.path(""), &spaced).expect("good slices");
    assert_eq!(
        (volume.spacing(), spaced.gate.remarks().len()),
        ([0.5, 0.5, 2.0], 0)
    );
}

#[test]
fn colours_are_read_by_their_brightness() {
    let picture = Picture {
        width: 3,
        height: 1,
        rgb: vec![[1.0; 3], [0.0; 3], [0.0, 1.0, 0.0]],
        coverage: None,
    };
    assert_eq!(brightness(&picture), Voxels::U8(vec![255, 0, 220]));
    assert_eq!(of_component(&picture, 0), Voxels::U8(vec![255, 0, 0]));
    assert_eq!(of_component(&picture, 1), Voxels::U8(vec![255, 0, 255]));
}

#[test]
fn a_broken_slice_and_one_picture_are_refused_by_name() {
    let folder = Folder::new();
    let one = folder.write("s1.png", &[&png([1, 2])]);
    folder.write("s2.png", &[&png([1, 2])[..40]]);
    let refused = |path: &Path| {
        load(path, &LoadOptions::default())
            .expect_err("bad")
            .to_string()
    };
    assert!(refused(&folder.path("")).contains("s2.png"));
    assert!(refused(&one).contains("named by their folder"));
}
