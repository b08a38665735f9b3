//! Files of every version, written here attribute by attribute and read back.

use std::io::Write;

use super::super::test_files::{Dir, check_damage, known, same_within};
use super::*;

const FRACTIONAL_BITS: u8 = 12;

fn bytes_of(values: [f32; 3], code: impl Fn(f32) -> f32) -> [u8; 3] {
    values.map(|value| code(value).round().clamp(0.0, 255.0) as u8)
}

/// The half-precision codes of the known positions: multiples of 1/4 below 4.
fn half_code(value: f32) -> u16 {
    let sign = u16::from(value < 0.0) << 15;
    let size = value.abs();
    if size == 0.0 {
        return sign;
    }
    let exponent = size.log2().floor();
    let fraction = (size / exponent.exp2() - 1.0) * 1024.0;
    sign | (((exponent as i32 + 15) as u16) << 10) | fraction as u16
}

fn rotation_code(version: u32, rotation: Quat) -> Vec<u8> {
    let four = rotation.to_array();
    if version < 3 {
        let sign = four[3].signum();
        let [x, y, z, _] = four.map(|part| part * sign);
        return bytes_of([x, y, z], |part| (part + 1.0) * 127.5).to_vec();
    }
    let order = |a: &usize, b: &usize| four[*a].abs().total_cmp(&four[*b].abs());
    let largest = (0..4).max_by(order).expect("four");
    let mut word = largest as u32;
    for place in (0..4).filter(|place| *place != largest) {
        let value = four[place] * four[largest].signum();
        let size = (value.abs() * 2f32.sqrt() * 511.0).round() as u32;
        word = word << 10 | u32::from(value < 0.0) << 9 | size;
    }
    word.to_le_bytes().to_vec()
}

fn parts(version: u32, degree: usize) -> [Vec<u8>; 6] {
    let mut parts: [Vec<u8>; 6] = Default::default();
    for (stored, rest) in known(degree) {
        for value in stored.centre.as_vec3().to_array() {
            match version {
                1 => parts[0].extend(half_code(value).to_le_bytes()),
                _ => {
                    let fixed = (value * f32::from(1u16 << FRACTIONAL_BITS)) as i32;
                    parts[0].extend(&fixed.to_le_bytes()[..3]);
                }
            }
        }
        parts[1].push((stored.opacity * 255.0).round() as u8);
        let constant = ((stored.colour - 0.5) / C0).to_array();
        parts[2].extend(bytes_of(constant, |c| (c * COLOUR_SCALE + 0.5) * 255.0));
        parts[3].extend(bytes_of(stored.scales.to_array(), |s| {
            (s.ln() + 10.0) * 16.0
        }));
        parts[4].extend(rotation_code(version, stored.rotation));
        parts[5].extend(rest.iter().map(|c| (c * 128.0 + 128.0).round() as u8));
    }
    parts
}

fn header(version: u32, degree: usize) -> Vec<u8> {
    let mut head = MAGIC.to_vec();
    head.extend([version, 3].map(u32::to_le_bytes).concat());
    head.extend([degree as u8, FRACTIONAL_BITS, 0, 0]);
    head
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).expect("in memory");
    encoder.finish().expect("in memory")
}

/// A Zstandard frame of one raw block.
fn zstd(bytes: &[u8]) -> Vec<u8> {
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0x60];
    frame.extend((bytes.len() as u16).wrapping_sub(256).to_le_bytes());
    if bytes.len() < 256 {
        frame.truncate(4);
        frame.extend([0x20, bytes.len() as u8]);
    }
    let block = (bytes.len() as u32) << 3 | 1;
    frame.extend(&block.to_le_bytes()[..3]);
    frame.extend(bytes);
    frame
}

fn file(version: u32, degree: usize) -> Vec<u8> {
    let parts = parts(version, degree);
    if version < 4 {
        return gzip(&[header(version, degree), parts.concat()].concat());
    }
    let parts: Vec<&Vec<u8>> = parts.iter().filter(|part| !part.is_empty()).collect();
    let mut file = header(4, degree);
    file[15] = parts.len() as u8;
    file.extend(40u32.to_le_bytes());
    // Reserved bytes, and an extension of 8 bytes.
    file.extend([0; 20]);
    let packed: Vec<Vec<u8>> = parts.iter().map(|part| zstd(part)).collect();
    for (part, packed) in parts.iter().zip(&packed) {
        file.extend(
            [packed.len() as u64, part.len() as u64]
                .map(u64::to_le_bytes)
                .concat(),
        );
    }
    file.extend(packed.concat());
    file
}

#[test]
fn every_version_and_degree_reads_back() {
    let dir = Dir::new();
    for version in 1..=4 {
        for degree in 0..=3 {
            let file = file(version, degree);
            assert!(begins(&file), "version {version}");
            let path = dir.write("a", &file);
            let mut notes = Vec::new();
            let read = load(&path, &Gate::default(), &mut notes).expect("a good file");
            assert!(notes.is_empty(), "{notes:?}");
            let rotations = if version < 3 { 0.02 } else { 0.003 };
            same_within(
                &read,
                &known(degree),
                [1e-6, rotations, 0.033, 0.005, 0.004],
            );
        }
    }
}

#[test]
fn degree_four_and_the_filter_are_noted() {
    let dir = Dir::new();
    let mut plain = [header(3, 4), parts(3, 4).concat()].concat();
    plain[14] = ANTIALIASED;
    let mut notes = Vec::new();
    let read = load(&dir.write("a", &gzip(&plain)), &Gate::default(), &mut notes);
    assert_eq!(read.expect("a good file").degree(), 3);
    assert!(
        notes[0].contains("degree 4") && notes[1].contains("filter"),
        "{notes:?}"
    );
}

#[test]
fn halves_are_decoded() {
    let value = |bits: u16| half(&bits.to_le_bytes());
    assert_eq!(value(0x3c00), 1.0);
    assert_eq!(value(0xc000), -2.0);
    assert_eq!(value(0x0001), 2f32.powi(-24));
    assert_eq!(value(0x7bff), 65_504.0);
    assert_eq!(value(0x7c00), f32::INFINITY);
    assert!(value(0x7e00).is_nan());
    assert_eq!(fixed(&[0xff, 0xff, 0xff], 1), -0.5);
}

#[test]
fn forged_and_damaged_files_are_refused() {
    let dir = Dir::new();
    let refused = |bytes: &[u8]| {
        let path = dir.write("a", bytes);
        let why = load(&path, &Gate::default(), &mut Vec::new()).expect_err("refused");
        why.to_string()
    };
    let plain = [header(2, 1), parts(2, 1).concat()].concat();
    let forged = |at: usize, bytes: &[u8]| {
        let mut forged = plain.clone();
        forged[at..at + bytes.len()].copy_from_slice(bytes);
        refused(&gzip(&forged))
    };
    assert!(forged(0, b"X").contains("NGSP"));
    assert!(forged(4, &[9]).contains("version 9"));
    assert!(forged(8, &[0xff; 4]).contains("memory"));
    assert!(forged(8, &[4]).contains("ends early"));
    assert!(forged(8, &[0]).contains("no Gaussian"));
    assert!(forged(12, &[7]).contains("degree 7"));
    assert!(refused(&plain).contains("gzip"), "not packed");
    let mut long = file(4, 0);
    long[15] = 9;
    assert!(refused(&long).contains("9 streams"));
    check_damage(&file(2, 1), load);
    check_damage(&file(4, 1), load);
    // Behind gzip, where damage would only break its sum.
    check_damage(&plain, |path, gate, notes| {
        let bytes = std::fs::read(path).expect("there");
        let mut name = path.as_os_str().to_owned();
        name.push(".gz");
        std::fs::write(&name, gzip(&bytes)).expect("written");
        load(Path::new(&name), gate, notes)
    });
}
