//! Shared by the tests of all readers: a folder for small files, and damaged copies of good ones.

use std::path::{Path, PathBuf};

use resample_io::{Gate, Outside};
use tempfile::TempDir;

use super::file::{CloudLoadOptions, PointCloudFile};

/// A folder in which a test writes its files.
pub(super) struct Dir(TempDir);

impl Dir {
    pub(super) fn new() -> Self {
        Self(tempfile::tempdir().expect("temporary folder"))
    }

    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    }
}

/// Damaged copies of a good file: each is read or refused, and nothing else happens.
pub(super) fn survive_damage(
    good: &[u8],
    load: impl Fn(&Path, &CloudLoadOptions) -> Result<PointCloudFile, String>,
) {
    let dir = Dir::new();
    let options = CloudLoadOptions {
        gate: Gate::new(Outside::Refused, Some(32 << 20)),
        points: None,
    };
    let mut dice = 1u64;
    let mut roll = |sides: usize| {
        dice = dice
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (dice >> 33) as usize % sides.max(1)
    };
    for copy in 0..400 {
        let mut bytes = good.to_vec();
        let at = roll(bytes.len());
        match copy % 4 {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at..(at + 1 + roll(9)).min(good.len()))),
            2 => bytes.insert(at, roll(256) as u8),
            _ => {}
        }
        // Headers are at the front: half of the hits go there.
        for _ in 0..copy % 4 {
            let reach = [bytes.len(), bytes.len().min(400)][roll(2)];
            let at = roll(reach);
            if let Some(byte) = bytes.get_mut(at) {
                *byte = [0, 1, 0x7f, 0x80, 0xff, b'9'][roll(6)];
            }
        }
        // A name of its own: some file systems flush a file that is written a second time.
        let path = dir.write(&format!("damaged.{copy}"), &bytes);
        let attempt = std::panic::AssertUnwindSafe(|| load(&path, &options));
        let read = std::panic::catch_unwind(attempt);
        assert!(read.is_ok(), "copy {copy} ends in a panic: {bytes:?}");
    }
}
