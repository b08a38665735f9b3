//! Shared by the tests of all readers: a folder for small files, packers, and damaged copies of good files.

use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::Error;
use crate::input::decode::{DEFLATE_EXPANSION, zip};
use crate::input::{LoadOptions, load, load_components};
use crate::volume::Volume;

/// A folder in which a test writes its files.
pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("temporary folder"))
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes the parts one after the other.
    pub(crate) fn write(&self, name: &str, parts: &[&[u8]]) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, parts.concat()).expect("write");
        path
    }

    pub(crate) fn load(&self, parts: &[&[u8]]) -> Result<Volume, Error> {
        load(&self.write("test.dat", parts), &LoadOptions::default())
    }

    /// The message with which the file is refused.
    pub(crate) fn refusal(&self, parts: &[&[u8]]) -> String {
        self.load(parts)
            .expect_err("this file must be refused")
            .to_string()
    }
}

/// Checks that several components read at once are those that are read one by one, in the order in which they were listed.
pub(crate) fn check_components(path: &Path, options: &LoadOptions, count: usize) {
    let numbers: Vec<usize> = (0..count).rev().chain([0]).collect();
    let several = load_components(path, options, &numbers).expect("good components");
    assert_eq!(several.len(), numbers.len());
    for (number, volume) in numbers.into_iter().zip(several) {
        let options = LoadOptions {
            component: Some(number),
            ..options.clone()
        };
        let one = load(path, &options).expect("a good component");
        assert_eq!(
            (volume.voxels, volume.world_from_index),
            (one.voxels, one.world_from_index),
            "component {number} of {}",
            path.display()
        );
    }
}

pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).expect("in memory");
    encoder.finish().expect("in memory")
}

pub(crate) fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).expect("in memory");
    encoder.finish().expect("in memory")
}

/// A sequence of numbers that looks random and is the same on every run: the generator of Knuth's MMIX.
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A number below `bound`, which is at least 1.
    pub(crate) fn below(&mut self, bound: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound
    }
}

/// Damaged copies of a good file: each must load or be refused, without a panic and without more memory than the
/// bytes could hold.
pub(crate) fn survive_damage(good: &[u8], options: &LoadOptions, copies: usize) {
    let folder = Folder::new();
    let mut dice = Dice::new(good.len() as u64);
    let mut refused = 0;
    for copy in 0..copies {
        // A name of its own: some file systems flush a file to the disk when it is written a second time.
        let path = folder.write(&format!("damaged.dat.{copy}"), &[&damaged(good, &mut dice)]);
        match load(&path, options) {
            Ok(volume) => {
                let most = (good.len() as u64 + 64) * DEFLATE_EXPANSION * 8;
                assert!(
                    volume.bytes() as u64 <= most,
                    "{} bytes out of {}",
                    volume.bytes(),
                    good.len()
                );
            }
            Err(error) => {
                refused += 1;
                // Damage can change the name of a data file, which is then the one that cannot be read.
                let is_named = error.to_string().contains("damaged.dat")
                    || matches!(error, Error::Read { .. });
                assert!(is_named, "the file is named: {error}");
            }
        }
    }
    assert!(
        refused > copies / 20,
        "damage is noticed: {refused} of {copies} were refused"
    );
}

fn damaged(good: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = good.to_vec();
    match dice.below(4) {
        0 => bytes.truncate(dice.below(good.len())),
        1 => {
            let at = dice.below(good.len());
            let count = dice.below(9).min(good.len() - at);
            bytes.drain(at..at + count);
        }
        2 => {
            let at = dice.below(good.len());
            let value = [0, 0xff, b'9', b'-', b' '][dice.below(5)];
            (0..1 + dice.below(8)).for_each(|_| bytes.insert(at, value));
        }
        _ => {
            // Headers are at the front: half of the hits go there.
            for _ in 0..1 + dice.below(4) {
                let reach = if dice.below(2) == 0 {
                    good.len().min(400)
                } else {
                    good.len()
                };
                let at = dice.below(reach);
                bytes[at] = dice.below(256) as u8;
            }
        }
    }
    bytes
}

/// A ZIP archive; every second member is deflated.
pub(crate) fn zip_archive(files: &[(impl AsRef<str>, Vec<u8>)]) -> Vec<u8> {
    let (mut zip, mut list) = (Vec::new(), Vec::new());
    for (number, (name, bytes)) in files.iter().enumerate() {
        let name = name.as_ref();
        let method = if number % 2 == 0 { 0u16 } else { 8 };
        let packed = match method {
            0 => bytes.clone(),
            _ => deflated(bytes),
        };
        let place = zip.len() as u32;
        let mut facts = [20u16, 0, method, 0, 0].map(u16::to_le_bytes).concat();
        facts.extend(
            [0, packed.len() as u32, bytes.len() as u32]
                .map(u32::to_le_bytes)
                .concat(),
        );
        facts.extend([name.len() as u16, 0].map(u16::to_le_bytes).concat());
        zip.extend([zip::MAGIC, &facts, name.as_bytes(), &packed].concat());
        list.extend([b"PK\x01\x02\x14\0", facts.as_slice(), &[0; 10]].concat());
        list.extend([&place.to_le_bytes(), name.as_bytes()].concat());
    }
    let (place, count) = (zip.len() as u32, files.len() as u16);
    zip.extend(&list);
    zip.extend(
        [
            b"PK\x05\x06\0\0\0\0".as_slice(),
            &[count.to_le_bytes(); 2].concat(),
        ]
        .concat(),
    );
    zip.extend([list.len() as u32, place].map(u32::to_le_bytes).concat());
    zip.extend([0, 0]);
    zip
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder =
        flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).expect("in memory");
    encoder.finish().expect("in memory")
}
