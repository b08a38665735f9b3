//! Shared by the tests of all readers: known Gaussians, a folder for small files, damaged copies of good ones.

use std::path::{Path, PathBuf};

use glam::{DVec3, Quat, Vec3};
use resample_io::{Gate, Outside};
use tempfile::TempDir;

use super::sink::{Stored, coefficients_of};
use crate::Error;
use crate::gaussians::Gaussians;

/// A folder in which a test writes its files.
pub(super) struct Dir(TempDir);

impl Dir {
    pub(super) fn new() -> Self {
        Self(tempfile::tempdir().expect("temporary folder"))
    }

    pub(super) fn path(&self) -> &Path {
        self.0.path()
    }

    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    }
}

/// Three Gaussians with their coefficients beyond the constant.
pub(super) fn known(degree: usize) -> Vec<(Stored, Vec<f32>)> {
    (0..3)
        .map(|number| {
            let n = number as f32;
            let stored = Stored {
                centre: DVec3::new(1.5 - f64::from(n), 0.25 * f64::from(n), -2.0),
                rotation: Quat::from_xyzw(0.3 - 0.4 * n, 0.1, 0.5 * n - 0.3, 0.7).normalize(),
                scales: Vec3::new(0.1, 0.02 + 0.1 * n, 0.5),
                opacity: 0.25 + 0.25 * n,
                colour: Vec3::new(0.3, 0.6, 0.5 - 0.2 * n),
            };
            let value = |place: usize| 0.25 * (1.3 * place as f32 + n).sin();
            let coefficients = (0..coefficients_of(degree)).map(value).collect();
            (stored, coefficients)
        })
        .collect()
}

/// Checks that what was read is what is known, each number within a tolerance; coefficients have 8 bits.
pub(super) fn same(read: &Gaussians, known: &[(Stored, Vec<f32>)], tolerance: f32) {
    same_within(read, known, [tolerance; 5]);
}

/// Checks with tolerances of centres, rotations, scales (relative), opacities and colours, and coefficients.
pub(super) fn same_within(read: &Gaussians, known: &[(Stored, Vec<f32>)], within: [f32; 5]) {
    assert_eq!(read.len(), known.len());
    for (index, (stored, coefficients)) in known.iter().enumerate() {
        let got = read.get(index);
        let centre = read.origin_in_world + got.centre.as_dvec3();
        let off = (centre - stored.centre).length() as f32;
        assert!(off <= within[0], "{index}: {centre}, off by {off}");
        let [a, b] = [got.rotation, stored.rotation.normalize()];
        let off = (a - b).length().min((a + b).length());
        assert!(off <= within[1].max(1e-3), "{index}: {a}, expected {b}");
        let off = ((got.scales - stored.scales) / stored.scales).abs();
        assert!(off.max_element() <= within[2], "{index}: {}", got.scales);
        assert!(
            (got.opacity - stored.opacity).abs() <= within[3],
            "{index}: {}",
            got.opacity
        );
        let off = (got.colour - stored.colour).abs();
        assert!(off.max_element() <= within[3], "{index}: {}", got.colour);
        let got: Vec<f32> = read.coefficients(index).collect();
        assert_eq!(got.len(), coefficients.len());
        for (got, known) in got.iter().zip(coefficients) {
            let off = (got - known).abs();
            assert!(off <= within[4] + 0.25 / 250.0, "{index}: {got}, {known}");
        }
    }
}

/// Damaged copies of a good file: each is read or refused, and nothing else happens.
pub(super) fn check_damage(
    good: &[u8],
    load: impl Fn(&Path, &Gate, &mut Vec<String>) -> Result<Gaussians, Error>,
) {
    let dir = Dir::new();
    let gate = Gate::new(Outside::Refused, Some(32 << 20));
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
            let reach = [bytes.len(), bytes.len().min(64)][roll(2)];
            let at = roll(reach);
            if let Some(byte) = bytes.get_mut(at) {
                *byte = [0, 1, 0x7f, 0x80, 0xff, b'9'][roll(6)];
            }
        }
        // A name of its own: some file systems flush a file that is written a second time.
        let path = dir.write(&format!("damaged.{copy}"), &bytes);
        if let Err(why) = load(&path, &gate, &mut Vec::new()) {
            assert!(why.to_string().contains("damaged."), "{why}");
        }
    }
}
