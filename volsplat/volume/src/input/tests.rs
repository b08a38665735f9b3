//! Headerless files and the choice of the format.

use std::path::PathBuf;

use glam::DVec3;
use tempfile::TempDir;

use crate::Error;
use crate::input::test_files::Folder;
use crate::input::*;
use crate::volume::{Endian, NanPolicy, VoxelType, Voxels};

fn file_with(bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("volume.raw");
    std::fs::write(&path, bytes).expect("write");
    (folder, path)
}

fn options(dims: [usize; 3], voxel_type: VoxelType) -> LoadOptions {
    LoadOptions {
        raw: Some(RawOptions::new(dims, voxel_type)),
        ..LoadOptions::default()
    }
}

#[test]
fn raw_values_lattice_and_skip_are_as_described() {
    let (_folder, path) = file_with(&[9, 9, 9, 0x01, 0x02, 0xff, 0xfe]);
    let mut raw = RawOptions::new([2, 1, 1], VoxelType::I16);
    raw.skip_bytes = 3;
    raw.endian = Endian::Big;
    raw.spacing = [2.0, 3.0, 4.0];
    raw.origin = [-1.0, 0.0, 1.0];
    let volume = load(
        &path,
        &LoadOptions {
            raw: Some(raw),
            ..LoadOptions::default()
        },
    )
    .expect("valid");
    assert_eq!(volume.voxels, Voxels::I16(vec![0x0102, -2]));
    assert_eq!(volume.spacing(), [2.0, 3.0, 4.0]);
    assert_eq!(
        volume.world_from_index.translation,
        DVec3::new(-1.0, 0.0, 1.0)
    );
}

#[test]
fn large_files_come_in_order_across_pieces() {
    let values: Vec<u16> = (0..300_000u32).map(|v| (v % 65_521) as u16).collect();
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let (_folder, path) = file_with(&bytes);
    let volume = load(&path, &options([1000, 300, 1], VoxelType::U16)).expect("valid");
    assert_eq!(volume.voxels, Voxels::U16(values));
}

#[test]
fn a_wrong_size_is_refused_with_both_numbers() {
    let (_folder, path) = file_with(&[0; 7]);
    let text = load(&path, &options([2, 2, 2], VoxelType::U8))
        .expect_err("7 of 8 bytes")
        .to_string();
    assert!(
        text.contains("dims 2x2x2 of u8 need 8 bytes after skipping 0, the file has 7"),
        "{text}"
    );
    assert!(text.contains("volume.raw"), "the file is named: {text}");
    let huge = options([100_000, 100_000, 100_000], VoxelType::F64);
    let text = load(&path, &huge).expect_err("10^15 voxels").to_string();
    assert!(text.contains("need 8000000000000000 bytes"), "{text}");
    let text = load(&path, &options([usize::MAX, 3, 1], VoxelType::U8))
        .expect_err("overflow")
        .to_string();
    assert!(text.contains("more voxels than"), "{text}");
    let text = load(&path, &options([usize::MAX, 1, 1], VoxelType::U16))
        .expect_err("overflow")
        .to_string();
    assert!(text.contains("more than can be addressed"), "{text}");
    let mut skip = RawOptions::new([7, 1, 1], VoxelType::U8);
    skip.skip_bytes = u64::MAX;
    let text = load(
        &path,
        &LoadOptions {
            raw: Some(skip),
            ..LoadOptions::default()
        },
    );
    assert!(text.is_err(), "a skip near the end of u64 must not wrap");
}

#[test]
fn nan_is_refused_or_replaced() {
    let bytes: Vec<u8> = [1.0f32, f32::NAN]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let (_folder, path) = file_with(&bytes);
    let mut options = options([1, 2, 1], VoxelType::F32);
    let text = load(&path, &options).expect_err("NaN").to_string();
    assert!(
        text.ends_with("voxel (0,1,0) is NaN: give --nan-as VALUE"),
        "{text}"
    );
    assert!(text.contains("volume.raw"), "the file is named: {text}");
    options.nan = NanPolicy::Replace(-7.0);
    assert_eq!(
        load(&path, &options).expect("replaced").voxels,
        Voxels::F32(vec![1.0, -7.0])
    );
}

#[test]
fn spacing_and_origin_of_the_caller_win() {
    let (_folder, path) = file_with(&[0; 1]);
    let mut options = options([1, 1, 1], VoxelType::U8);
    options.spacing = Some([0.5, 2.0, 3.0]);
    options.origin = Some([7.0, 8.0, 9.0]);
    let volume = load(&path, &options).expect("valid");
    assert_eq!(volume.spacing(), [0.5, 2.0, 3.0]);
    assert_eq!(
        volume.world_from_index.translation,
        DVec3::new(7.0, 8.0, 9.0)
    );
    options.spacing = Some([0.5, 0.0, 3.0]);
    assert!(
        load(&path, &options)
            .expect_err("zero")
            .to_string()
            .contains("above 0")
    );
}

#[test]
fn missing_folders_and_unknown_formats_are_told_apart() {
    let (folder, path) = file_with(b"something");
    let absent = load(&folder.path().join("absent"), &LoadOptions::default());
    assert!(matches!(absent, Err(Error::Read { .. })), "{absent:?}");
    let directory = load(folder.path(), &options([1, 1, 1], VoxelType::U8));
    assert!(
        matches!(directory, Err(Error::Read { .. })),
        "{directory:?}"
    );
    let text = load(&path, &LoadOptions::default())
        .expect_err("no options")
        .to_string();
    assert!(text.contains("--dims") && text.contains("--type"), "{text}");
    std::fs::write(&path, "NRRD0004\n").expect("write");
    let text = load(&path, &options([9, 1, 1], VoxelType::U8))
        .expect_err("both")
        .to_string();
    assert!(text.contains("leave out the layout"), "{text}");
}

#[test]
fn values_are_rescaled_before_anything_else_sees_them() {
    let folder = Folder::new();
    let path = folder.write("ct.raw", &[&[0, 0, 0, 4, 0, 16, 255, 15]]);
    let raw = Some(RawOptions::new([2, 2, 1], VoxelType::U16));
    let options = LoadOptions {
        raw,
        rescale: Some([1.0, -1024.0]),
        ..LoadOptions::default()
    };
    let volume = load(&path, &options).expect("valid");
    assert_eq!(volume.voxels, Voxels::I16(vec![-1024, 0, 3072, 3071]));
    let none = load(
        &path,
        &LoadOptions {
            rescale: Some([0.0, 1.0]),
            ..options
        },
    )
    .expect_err("no scale");
    assert!(none.to_string().contains("slope non-zero"), "{none}");
}

#[test]
fn formats_that_are_not_read_are_named_with_a_way_out() {
    let cases: [(&[u8], &str, &str); 9] = [
        (b"glTF", "glTF", "texmap"),
        (b" BDV", "OpenVDB", "copyToArray"),
        (b"MATLAB 5.0 MAT-file", "before 7.3", "-v7.3"),
        (b"ZISRAWFILE", "CZI", "OME-TIFF"),
        (b"\xda\xce\xbe\x0a", "ND2", "OME-Zarr"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "OIB", "Fiji"),
        (b"# AVS field file", "AVS", "--skip"),
        (b"<Xdmf Version=\"3.0\">", "XDMF", "HDF5"),
        (b"PK\x03\x04", "ZIP", "unpack"),
    ];
    for (mark, name, way) in cases {
        let (_folder, path) = file_with(&[mark, &[0; 600]].concat());
        let complaint = load(&path, &LoadOptions::default()).expect_err(name);
        let complaint = complaint.to_string();
        assert!(
            complaint.contains(name) && complaint.contains(way),
            "{complaint}"
        );
        assert_eq!(format_of(&path).expect("readable"), None, "{name}");
    }
}
