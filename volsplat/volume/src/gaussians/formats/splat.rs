//! `.splat` files: Gaussians of 32 bytes each and nothing else.
//!
//! Takes a path, gives Gaussians. Each is three f32 of position, three f32 of standard deviations, red, green, blue and opacity in
//! a byte each, and a quaternion w x y z whose components are bytes of (value - 128) / 128; little-endian throughout.
//! Source: the converter of the viewer "splat" (K. Kwok 2023), which made the format.
//! The format has no mark: a file counts as one if a sample of it has finite numbers, and quaternions of length 1.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use glam::{Quat, Vec3};
use resample_io::Gate;

use super::sink::{self, Sink, Stored};
use crate::Error;
use crate::gaussians::Gaussians;
use crate::input::{Fault, cannot_read, open_sized};

/// Bytes of a Gaussian.
const BYTES: usize = 32;

/// Gaussians that are looked at to recognise a file. Noise passes the test of a quaternion's length in about one of ten, so
/// that few would do.
const SAMPLE: u64 = 256;

/// How far the length of a quaternion of four bytes may be from 1: each component is off by 1/128 at most, so that
/// 4 times 1/128 bounds the length; this is three times that.
const LENGTH_WITHIN: f32 = 0.1;

/// Returns true if the file looks as if it holds Gaussians: a sample from all over the file.
pub(crate) fn begins(file: &mut File, bytes: u64) -> std::io::Result<bool> {
    let count = bytes / BYTES as u64;
    if count == 0 || !bytes.is_multiple_of(BYTES as u64) {
        return Ok(false);
    }
    let (mut units, mut sizes, mut is_text) = (0, 0, true);
    let sampled = count.min(SAMPLE);
    for number in 0..sampled {
        // Even steps, without overflow.
        let place = (u128::from(number) * u128::from(count) / u128::from(sampled)) as u64;
        file.seek(SeekFrom::Start(place * BYTES as u64))?;
        let mut row = [0; BYTES];
        file.read_exact(&mut row)?;
        is_text &= row
            .iter()
            .all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace());
        let stored = gaussian(&row);
        let is_sound = stored.centre.is_finite()
            && stored.scales.is_finite()
            && stored.scales.min_element() >= 0.0;
        if !is_sound {
            return Ok(false);
        }
        units += u64::from((stored.rotation.length() - 1.0).abs() <= LENGTH_WITHIN);
        sizes += u64::from(stored.scales.max_element() > 0.0);
    }
    // A short text, such as a list of names, can have such numbers by chance; no row of a file of Gaussians is text alone.
    Ok(!is_text && units * 10 >= sampled * 9 && sizes * 2 >= sampled)
}

/// Reads a file.
pub(crate) fn load(path: &Path, gate: &Gate, notes: &mut Vec<String>) -> Result<Gaussians, Error> {
    let (file, bytes) = open_sized(path)?;
    let count = bytes / BYTES as u64;
    if !bytes.is_multiple_of(BYTES as u64) {
        let what = format!(
            "it has {bytes} bytes, which are no whole number of Gaussians of {BYTES} bytes: it is cut off"
        );
        return Err(Fault::Invalid(what).at(path));
    }
    sink::ask(gate, 0, count, 0).map_err(|fault| fault.at(path))?;
    let mut file = BufReader::with_capacity(1 << 18, file);
    let mut sink = Sink::with_capacity(0, count);
    for _ in 0..count {
        let mut row = [0; BYTES];
        let read = file.read_exact(&mut row);
        read.map_err(|source| cannot_read(path, source))?;
        sink.push(&gaussian(&row), &[]);
    }
    sink.finish(notes).map_err(|fault| fault.at(path))
}

fn gaussian(row: &[u8; BYTES]) -> Stored {
    let float = |number: usize| {
        let at = 4 * number;
        f32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]])
    };
    let [r, g, b, opacity] = [24, 25, 26, 27].map(|at| f32::from(row[at]) / 255.0);
    let [w, x, y, z] = [28, 29, 30, 31].map(|at| (f32::from(row[at]) - 128.0) / 128.0);
    Stored {
        centre: Vec3::new(float(0), float(1), float(2)).as_dvec3(),
        rotation: Quat::from_xyzw(x, y, z, w),
        scales: Vec3::new(float(3), float(4), float(5)),
        opacity,
        colour: Vec3::new(r, g, b),
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_files::{Dir, check_damage, known, same_within};
    use super::*;

    fn file() -> Vec<u8> {
        let mut file = Vec::new();
        for (stored, _) in known(0) {
            let floats = [stored.centre.as_vec3(), stored.scales].map(|vector| vector.to_array());
            file.extend(floats.concat().iter().flat_map(|value| value.to_le_bytes()));
            let colour = [stored.colour.to_array().as_slice(), &[stored.opacity]].concat();
            file.extend(colour.iter().map(|part| (part * 255.0).round() as u8));
            let [x, y, z, w] = stored.rotation.to_array();
            file.extend([w, x, y, z].map(|part| (part * 128.0 + 128.0) as u8));
        }
        file
    }

    fn is_one(dir: &Dir, bytes: &[u8]) -> bool {
        let path = dir.write("a", bytes);
        let mut file = File::open(path).expect("there");
        begins(&mut file, bytes.len() as u64).expect("readable")
    }

    #[test]
    fn gaussians_read_back() {
        let dir = Dir::new();
        assert!(is_one(&dir, &file()));
        let path = dir.write("a", &file());
        let read = load(&path, &Gate::default(), &mut Vec::new()).expect("a good file");
        same_within(&read, &known(0), [1e-6, 0.02, 1e-6, 0.003, 0.0]);
    }

    #[test]
    fn other_files_are_not_taken() {
        let dir = Dir::new();
        assert!(!is_one(&dir, &[]), "empty");
        assert!(!is_one(&dir, &[0; 320]), "zeros");
        assert!(!is_one(&dir, &[128; 320]), "no rotation");
        assert!(!is_one(&dir, &file()[..95]), "cut off");
        let text = b"a text of some length that fills a few rows of 32 bytes each....";
        assert!(!is_one(&dir, text));
        let noise: Vec<u8> = (0..3200u32)
            .map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8)
            .collect();
        assert!(!is_one(&dir, &noise));
        let mut bad = file();
        bad[12..16].copy_from_slice(&(-1f32).to_le_bytes());
        assert!(!is_one(&dir, &bad), "a negative size");
    }

    #[test]
    fn damaged_files_are_refused() {
        let dir = Dir::new();
        let path = dir.write("a", &file()[..95]);
        let why = load(&path, &Gate::default(), &mut Vec::new()).expect_err("cut off");
        assert!(why.to_string().contains("95 bytes"), "{why}");
        check_damage(&file(), load);
    }
}
