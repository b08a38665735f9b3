//! Several volumes in one file: times, vectors, colours.

use super::files::Fields;
use crate::input::test_files::{Folder, gzip};
use crate::input::{LoadOptions, load};
use crate::volume::Voxels;

#[test]
fn a_time_is_chosen_or_the_first_is_read_with_a_remark() {
    let folder = Folder::new();
    // Twelve bytes: three times of 2x1x2 voxels.
    let series = Fields {
        dim: [4, 2, 1, 2, 3, 0, 0, 0],
        ..Fields::new(1, 2)
    };
    let file = [series.bytes(), (0..12).collect()].concat();
    for (name, file) in [("a", file.clone()), ("b", gzip(&file))] {
        let path = folder.write(name, &[&file]);
        let at = |time| LoadOptions {
            time,
            ..LoadOptions::default()
        };
        for (time, first) in [(None, 0), (Some(0), 0), (Some(1), 4), (Some(2), 8)] {
            let options = at(time);
            let volume = load(&path, &options).expect("a good file");
            let expected: Vec<u8> = (first..first + 4).collect();
            assert_eq!(volume.voxels, Voxels::U8(expected), "time {time:?}");
            let remarks = options.gate.remarks();
            assert_eq!(remarks.len(), usize::from(time.is_none()), "{remarks:?}");
            assert!(remarks.iter().all(|remark| remark.contains("#time=N")));
        }
        let text = load(&path, &at(Some(3))).expect_err("beyond").to_string();
        assert!(text.contains("time=3: the file holds 3"), "{text}");
    }
    let cut = series.refusal(&[0; 11]);
    assert!(
        cut.contains("in 3 volumes, which are 12 bytes, but 11 are there"),
        "{cut}"
    );
    let huge = Fields {
        dim: [5, 2, 1, 2, i64::MAX, i64::MAX, 0, 0],
        ..Fields::new(2, 2)
    };
    assert!(!huge.refusal(&[0; 4]).is_empty());
    let six = Fields {
        dim: [6, 1, 1, 1, 1, 1, 4, 0],
        ..Fields::new(1, 2)
    };
    assert!(six.refusal(&[0; 4]).contains("dim[6] is 4"));
    let one = Fields {
        dim: [4, 2, 1, 2, 1, 0, 0, 0],
        ..Fields::new(1, 2)
    };
    assert_eq!(one.load(&[1, 2, 3, 4]).dims, [2, 1, 2]);
    let flat = Fields {
        dim: [2, 2, 2, 0, 0, 0, 0, 0],
        ..Fields::new(1, 2)
    };
    assert_eq!(flat.load(&[1, 2, 3, 4]).dims, [2, 2, 1]);
}

#[test]
fn colours_and_vectors_have_components() {
    let folder = Folder::new();
    let component = |component| LoadOptions {
        component: Some(component),
        ..LoadOptions::default()
    };
    for (datatype, colours) in [(128, 3), (2304, 4)] {
        let file = [Fields::new(1, datatype).bytes(), (0..4 * colours).collect()].concat();
        let path = folder.write("colours", &[&file]);
        for chosen in 0..colours {
            let volume = load(&path, &component(usize::from(chosen))).expect("a good file");
            let expected: Vec<u8> = (0..4).map(|voxel| voxel * colours + chosen).collect();
            assert_eq!(volume.voxels, Voxels::U8(expected), "colour {chosen}");
        }
        let text = load(&path, &LoadOptions::default())
            .expect_err("several")
            .to_string();
        assert!(text.contains("component=N"), "{text}");
    }
    let vectors = Fields {
        dim: [5, 2, 1, 2, 1, 3, 0, 0],
        ..Fields::new(1, 2)
    };
    let path = folder.write(
        "vectors",
        &[&vectors.bytes(), &(0..12).collect::<Vec<u8>>()],
    );
    let volume = load(&path, &component(2)).expect("a good file");
    assert_eq!(
        volume.voxels,
        Voxels::U8(vec![8, 9, 10, 11]),
        "one behind the other"
    );
}
