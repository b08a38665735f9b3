//! A raw file larger than its memory, cameras around it and inside, and a transfer function that shows almost all of it.

use glam::DVec3;
use resample_core::Camera;
use resample_core::Image;
use resample_tests::volumes::scenes::{orthographic, perspective, transfer};
use std::path::PathBuf;
use tempfile::TempDir;
use volsplat::{LargeVolume, LoadOptions, RawOptions, TransferFunction, VoxelType};

/// 9.2 MB of u16: no side is a whole number of bricks.
pub(super) const DIMS: [usize; 3] = [202, 171, 133];

/// A fifth of the volume.
pub(super) const BUDGET: u64 = 2_000_000;

/// Ripples around the middle, 0 to 4000: no brick is alike, and most are visible under `dense`.
pub(super) fn value([x, y, z]: [usize; 3]) -> u16 {
    let at = |i: usize, axis: usize| i as f64 / DIMS[axis] as f64 - 0.5;
    let (x, y, z) = (at(x, 0), at(y, 1), at(z, 2));
    let radius = (x * x + 1.3 * y * y + 0.8 * z * z).sqrt();
    let ripple = 1.0 + (40.0 * radius + 3.0 * (9.0 * x).sin()).cos();
    (2000.0 * ripple * (1.0 - radius).max(0.0)) as u16
}

pub(super) struct Scene {
    pub(super) _folder: TempDir,
    pub(super) path: PathBuf,
    pub(super) options: LoadOptions,
}

pub(super) fn write(bytes: impl Iterator<Item = u8>, voxel_type: VoxelType) -> Scene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("large.raw");
    std::fs::write(&path, bytes.collect::<Vec<u8>>()).expect("room for the test volume");
    let raw = Some(RawOptions::new(DIMS, voxel_type));
    let spacing = Some([1.0, 1.2, 0.9]);
    Scene {
        _folder: folder,
        path,
        options: LoadOptions {
            raw,
            spacing,
            ..LoadOptions::default()
        },
    }
}

pub(super) fn places() -> impl Iterator<Item = [usize; 3]> {
    let [x, y, _] = DIMS;
    (0..DIMS.iter().product()).map(move |i: usize| [i % x, i / x % y, i / (x * y)])
}

pub(super) fn scene() -> Scene {
    write(
        places().flat_map(|at| value(at).to_le_bytes()),
        VoxelType::U16,
    )
}

pub(super) fn open(scene: &Scene, budget: u64) -> LargeVolume {
    let opened = LargeVolume::open(&scene.path, &scene.options, budget, &mut |_| {});
    opened
        .expect("a valid file")
        .expect("a raw file can be read in parts")
}

/// Almost every brick is visible, and the middle is opaque.
pub(super) fn dense() -> TransferFunction {
    let colours = [
        (0.0, [0.1, 0.2, 1.0]),
        (1500.0, [0.2, 0.9, 0.3]),
        (4000.0, [1.0, 0.3, 0.1]),
    ];
    transfer(&colours, &[(500.0, 0.0), (2500.0, 0.1), (4000.0, 0.9)])
}

pub(super) fn bits(image: &Image) -> Vec<u32> {
    let depths = image.depth.iter().flatten();
    image
        .rgba
        .iter()
        .flatten()
        .chain(depths)
        .map(|x| x.to_bits())
        .collect()
}

pub(super) fn middle() -> DVec3 {
    DVec3::new(101.0, 102.0, 60.0)
}

/// From all sides, from inside, and in parallel.
pub(super) fn cameras() -> Vec<(&'static str, Camera)> {
    let from = |offset: DVec3| perspective(middle() + offset, middle(), 35.0, [60, 44]);
    vec![
        ("along z", from(DVec3::new(10.0, 5.0, -400.0))),
        ("along -z", from(DVec3::new(-10.0, 5.0, 400.0))),
        ("along x", from(DVec3::new(-400.0, 20.0, 30.0))),
        ("along -y", from(DVec3::new(30.0, 400.0, 20.0))),
        (
            "close",
            perspective(
                middle() + DVec3::new(70.0, 60.0, -90.0),
                middle(),
                60.0,
                [60, 44],
            ),
        ),
        (
            "from inside",
            perspective(
                middle() + 3.0,
                middle() + DVec3::new(40.0, 20.0, 9.0),
                80.0,
                [48, 40],
            ),
        ),
        (
            "in parallel",
            orthographic(
                middle() - DVec3::new(300.0, 200.0, 100.0),
                middle(),
                180.0,
                [60, 44],
            ),
        ),
    ]
}
