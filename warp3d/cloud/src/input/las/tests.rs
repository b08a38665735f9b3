//! Files of each kind, written here byte by byte and, for LAZ, packed by the crate `laz`.

use std::io::Cursor;

use glam::DVec3;

use ::laz::{LasZipCompressor, LazItemRecordBuilder, LazVlrBuilder};

use super::super::las_header::{HEADER_BYTES, LONG_HEADER_BYTES, MAGIC, POINT_BYTES, RECORD, USER};
use super::super::test_files::{Dir, survive_damage};
use super::*;

const COUNT: usize = 1000;

/// A point that depends on its number.
fn point(format: usize, extra: usize, number: usize) -> Vec<u8> {
    let mut bytes = vec![0; POINT_BYTES[format] + extra];
    for axis in 0..3 {
        let value = (number * (axis + 1)) as i32 - 700;
        bytes[4 * axis..4 * axis + 4].copy_from_slice(&value.to_le_bytes());
    }
    bytes[12..14].copy_from_slice(&(number as u16 * 60).to_le_bytes());
    let class = if format > 5 { 16 } else { 15 };
    bytes[class] = (number % 20) as u8;
    if RED[format] > 0 {
        let colour = [number as u16 * 64, 256, 0].map(u16::to_le_bytes).concat();
        bytes[RED[format]..RED[format] + 6].copy_from_slice(&colour);
    }
    bytes
}

fn header(format: usize, point_bytes: usize, records: u32) -> Vec<u8> {
    let minor = if format > 5 { 4 } else { 2 };
    let bytes = if minor == 4 {
        LONG_HEADER_BYTES
    } else {
        HEADER_BYTES
    };
    let mut head = vec![0; bytes];
    let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, MAGIC);
    put(24, &[1, minor]);
    put(94, &(bytes as u16).to_le_bytes());
    put(96, &(bytes as u32).to_le_bytes());
    put(100, &records.to_le_bytes());
    put(104, &[format as u8]);
    put(105, &(point_bytes as u16).to_le_bytes());
    put(131, &[0.001f64, 0.01, 0.1].map(f64::to_le_bytes).concat());
    put(155, &[600_000f64, 0.0, 10.0].map(f64::to_le_bytes).concat());
    match minor {
        4 => put(247, &(COUNT as u64).to_le_bytes()),
        _ => put(107, &(COUNT as u32).to_le_bytes()),
    }
    head
}

fn plain_file(format: usize) -> Vec<u8> {
    let points = (0..COUNT).map(|number| point(format, 3, number));
    [
        header(format, POINT_BYTES[format] + 3, 0),
        points.flatten().collect(),
    ]
    .concat()
}

/// Chunks of 300 points.
fn packed_file(format: usize, extra: usize) -> Vec<u8> {
    let items = LazItemRecordBuilder::default_for_point_format_id(format as u8, extra as u16);
    let vlr = LazVlrBuilder::new(items.expect("a format"))
        .with_fixed_chunk_size(300)
        .build();
    let mut content = Vec::new();
    vlr.write_to(&mut content).expect("in memory");
    let mut file = header(format, POINT_BYTES[format] + extra, 1);
    file[104] |= 0x80;
    let begin = file.len() as u32 + 54 + content.len() as u32;
    file[96..100].copy_from_slice(&begin.to_le_bytes());
    file.extend([[0, 0].as_slice(), USER].concat());
    file.extend(
        [RECORD, content.len() as u16]
            .map(u16::to_le_bytes)
            .concat(),
    );
    file.extend([0; 32]);
    file.extend(content);
    let mut packed = Cursor::new(file);
    packed.set_position(u64::from(begin));
    let mut packer = LasZipCompressor::new(&mut packed, vlr).expect("a packing");
    for number in 0..COUNT {
        packer
            .compress_one(&point(format, extra, number))
            .expect("in memory");
    }
    packer.done().expect("in memory");
    drop(packer);
    packed.into_inner()
}

fn check(file: &PointCloudFile, format: usize) {
    assert_eq!(file.positions.len(), COUNT);
    for number in [0, 1, 299, 300, 999] {
        let n = number as f64;
        let place =
            file.origin_in_world + glam::Vec3::from_array(file.positions[number]).as_dvec3();
        let expected = DVec3::new(
            600_000.0 + 0.001 * (n - 700.0),
            0.01 * (2.0 * n - 700.0),
            10.0 + 0.1 * (3.0 * n - 700.0),
        );
        assert!(
            place.distance(expected) < 1e-4,
            "{number}: {place}, {expected}"
        );
        assert_eq!(
            file.intensities.as_ref().expect("there")[number],
            number as u16 * 60
        );
        assert_eq!(
            file.classes.as_ref().expect("there")[number],
            (number % 20) as u8
        );
        let colour = file.colours.as_ref().map(|colours| colours[number]);
        let red = ((number as u16 * 64) >> 8) as u8;
        assert_eq!(colour, (RED[format] > 0).then_some([red, 1, 0]));
    }
}

fn read(bytes: &[u8]) -> Result<PointCloudFile, String> {
    let dir = Dir::new();
    load(&dir.write("a", bytes), &CloudLoadOptions::default())
}

#[test]
fn plain_points_of_every_format_read_back() {
    for format in 0..=10 {
        check(&read(&plain_file(format)).expect("a good file"), format);
    }
}

#[test]
fn packed_points_read_back() {
    for (format, extra) in [(0, 0), (1, 2), (2, 0), (3, 0), (6, 0), (7, 2), (8, 0)] {
        check(
            &read(&packed_file(format, extra)).expect("a good file"),
            format,
        );
    }
}

#[test]
fn points_are_thinned_while_they_are_read() {
    let dir = Dir::new();
    let options = CloudLoadOptions {
        points: Some(10),
        ..CloudLoadOptions::default()
    };
    for file in [plain_file(3), packed_file(3, 0)] {
        let file = load(&dir.write("a", &file), &options).expect("a good file");
        assert_eq!(
            file.intensities.expect("there"),
            [
                0, 6000, 12_000, 18_000, 24_000, 30_000, 36_000, 42_000, 48_000, 54_000
            ]
        );
        assert!(file.notes[0].contains("10 of its 1000"), "{:?}", file.notes);
    }
}

#[test]
fn forged_and_damaged_files_are_refused() {
    let good = plain_file(3);
    let forged = |at: usize, bytes: &[u8]| {
        let mut forged = good.clone();
        forged[at..at + bytes.len()].copy_from_slice(bytes);
        read(&forged).expect_err("refused")
    };
    assert!(forged(107, &[0xff; 4]).contains("4294967295 points"));
    assert!(forged(107, &[0; 4]).contains("no points"));
    assert!(forged(104, &[11]).contains("format 11"));
    assert!(forged(105, &[9, 0]).contains("9 bytes a point"));
    assert!(forged(25, &[9]).contains("version 1.9"));
    assert!(forged(131, &[0xff; 8]).contains("scale"));
    assert!(forged(104, &[0x83]).contains("no record says how"));
    assert!(read(&good[..200]).expect_err("cut").contains("200 bytes"));
    survive_damage(&good, load);
    survive_damage(&packed_file(3, 0), load);
    survive_damage(&packed_file(7, 2), load);
}
