//! FreeSurfer's volumes: what is read, and what is refused with its place.

use glam::DVec3;

use crate::input::test_files::{Folder, gzip, survive_damage};
use crate::input::{Format, LoadOptions, format_of, load};
use crate::volume::Voxels;

/// A header of 3x2x2 voxels.
fn header(kind: i32, times: i32) -> Vec<u8> {
    let words = [1, 3, 2, 2, times, kind, 0].map(i32::to_be_bytes).concat();
    // Coronal slices: x to the left, y to the feet, z to the front, of 1, 1.5 and 2 mm.
    let place = [
        1.0f32, 1.5, 2.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 10.0, 20.0, 30.0,
    ];
    let mut bytes = [
        words,
        1i16.to_be_bytes().to_vec(),
        place.map(f32::to_be_bytes).concat(),
    ]
    .concat();
    bytes.resize(284, 0);
    bytes
}

fn values() -> Vec<u8> {
    (0..12).collect()
}

#[test]
fn sizes_place_and_values_are_read_packed_or_not() {
    let folder = Folder::new();
    let file = [header(0, 1), values(), b"tags".to_vec()].concat();
    for file in [gzip(&file), file] {
        let path = folder.write("a", &[&file]);
        assert_eq!(format_of(&path).expect("readable"), Some(Format::Mgh));
        let volume = load(&path, &LoadOptions::default()).expect("a good file");
        assert_eq!(
            (volume.dims, &volume.voxels),
            ([3, 2, 2], &Voxels::U8(values()))
        );
        let map = volume.world_from_index;
        assert_eq!(map.matrix3.y_axis, DVec3::new(0.0, 0.0, -1.5), "a row down");
        // The world position belongs to the index (1.5, 1, 1).
        let middle = map.transform_point3(DVec3::new(1.5, 1.0, 1.0));
        assert!(
            middle.distance(DVec3::new(10.0, 20.0, 30.0)) < 1e-12,
            "{middle}"
        );
        assert_eq!(volume.up_hint, Some(DVec3::Z));
    }
}

#[test]
fn every_type_reads_back() {
    let folder = Folder::new();
    let shorts: Vec<i16> = (0..12).map(|i| 300 * i - 1000).collect();
    let floats: Vec<f32> = (0..12).map(|i| i as f32 - 0.5).collect();
    let file = |kind, data: Vec<u8>| [header(kind, 1), data].concat();
    let big = |bytes: Vec<[u8; 2]>| bytes.concat();
    let cases = [
        (
            file(4, big(shorts.iter().map(|v| v.to_be_bytes()).collect())),
            Voxels::I16(shorts.clone()),
        ),
        (
            file(3, floats.iter().flat_map(|v| v.to_be_bytes()).collect()),
            Voxels::F32(floats),
        ),
        (
            file(
                1,
                shorts
                    .iter()
                    .flat_map(|&v| i32::from(v).to_be_bytes())
                    .collect(),
            ),
            Voxels::I32(shorts.iter().map(|&v| i32::from(v)).collect()),
        ),
    ];
    for (file, expected) in cases {
        assert_eq!(folder.load(&[&file]).expect("a good file").voxels, expected);
    }
}

#[test]
fn times_are_chosen_or_the_first_is_read_with_a_remark() {
    let folder = Folder::new();
    let path = folder.write("a", &[&header(0, 2), &values(), &[7; 12]]);
    let options = LoadOptions::default();
    assert_eq!(
        load(&path, &options).expect("good").voxels,
        Voxels::U8(values())
    );
    assert!(options.gate.remarks()[0].contains("#time=N"));
    let second = LoadOptions {
        time: Some(1),
        ..LoadOptions::default()
    };
    assert_eq!(
        load(&path, &second).expect("good").voxels,
        Voxels::U8(vec![7; 12])
    );
}

#[test]
fn faults_name_their_place() {
    let folder = Folder::new();
    let refused = |parts: &[&[u8]]| folder.refusal(parts);
    let text = refused(&[&header(0, 1), &values()[..11]]);
    assert!(
        text.contains("which are 296 bytes with the header, but 295"),
        "{text}"
    );
    assert!(refused(&[&header(2, 1), &values()]).contains("type 2 (byte 20)"));
    assert!(refused(&[&header(0, 1)[..200]]).contains("the header needs 284 bytes"));
    let packed = gzip(&header(0, 60_000));
    assert!(refused(&[&packed]).contains("at most"));
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    let file = [header(4, 1), vec![3; 24]].concat();
    survive_damage(&file, &LoadOptions::default(), 1000);
    survive_damage(&gzip(&file), &LoadOptions::default(), 500);
}
