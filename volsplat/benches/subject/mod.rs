//! What the benchmarks of whole volumes render: the Engine and the Aneurism, or stand-ins made from formulas.
//!
//! The real volumes are taken from `volumes/raw` in the data folder: `RESAMPLE_DATA` if set, else `../shared/data`
//! beside the workspace root. Where they are absent, a formula gives a volume of the same size with nearly as many
//! visible voxels in surfaces of like thickness. Which of the two was measured is printed, because their figures do
//! not compare. Transfer functions are those of the peer comparison
//! in the tests package.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};
use volsplat::transfer::{ColourKnot, OpacityKnot};
use volsplat::{LoadOptions, RawOptions, TransferFunction, Volume, VoxelType, Voxels};

/// A volume with its transfer function.
pub(crate) struct Subject {
    /// The volume, unit spacing.
    pub(crate) volume: Volume,
    /// Opacity per voxel.
    pub(crate) transfer: TransferFunction,
}

const ENGINE_FILE: &str = "engine_256x256x128_uint8.raw";
const ANEURISM_FILE: &str = "aneurism_256x256x256_uint8.raw";

/// Prints which of the two volumes are real.
pub(crate) fn announce() {
    for file in [ENGINE_FILE, ANEURISM_FILE] {
        let what = if real_path(file).is_file() {
            "the real volume"
        } else {
            "a stand-in: the file is absent"
        };
        println!("{file}: {what}");
    }
}

/// The Engine (256x256x128), or an engine block of walls and bores.
pub(crate) fn engine() -> Subject {
    let opacities = [
        [0.0, 0.0],
        [70.0, 0.0],
        [110.0, 0.05],
        [150.0, 0.08],
        [200.0, 0.4],
        [255.0, 0.7],
    ];
    let colours = [
        [0.0, 0.0, 0.0, 0.0],
        [90.0, 0.35, 0.45, 0.6],
        [150.0, 0.6, 0.65, 0.7],
        [195.0, 0.9, 0.6, 0.2],
        [255.0, 1.0, 0.9, 0.6],
    ];
    let volume = real_or(ENGINE_FILE, [256, 256, 128], block);
    Subject {
        volume,
        transfer: transfer(&opacities, &colours),
    }
}

/// The Aneurism (256^3), or a tangle of thin tubes.
pub(crate) fn aneurism() -> Subject {
    let opacities = [
        [0.0, 0.0],
        [24.0, 0.0],
        [80.0, 0.35],
        [140.0, 0.8],
        [255.0, 0.9],
    ];
    let colours = [
        [0.0, 0.6, 0.1, 0.1],
        [90.0, 0.9, 0.2, 0.15],
        [180.0, 1.0, 0.75, 0.6],
        [255.0, 1.0, 1.0, 0.95],
    ];
    let volume = real_or(ANEURISM_FILE, [256; 3], vessels);
    Subject {
        volume,
        transfer: transfer(&opacities, &colours),
    }
}

fn transfer(opacities: &[[f64; 2]], colours: &[[f64; 4]]) -> TransferFunction {
    let colour = |k: &[f64; 4]| ColourKnot {
        value: k[0],
        rgb: [k[1] as f32, k[2] as f32, k[3] as f32],
    };
    let opacity = |k: &[f64; 2]| OpacityKnot {
        value: k[0],
        opacity: k[1],
    };
    let knots = (
        colours.iter().map(colour).collect(),
        opacities.iter().map(opacity).collect(),
    );
    TransferFunction::new(knots.0, knots.1).expect("ascending knots")
}

fn real_or(file: &str, dims: [usize; 3], formula: fn(DVec3) -> f64) -> Volume {
    let path = real_path(file);
    if path.is_file() {
        let options = LoadOptions {
            raw: Some(RawOptions::new(dims, VoxelType::U8)),
            ..LoadOptions::default()
        };
        return volsplat::load(&path, &options).expect("the file has the size that its name says");
    }
    let value = |i: usize| {
        let at = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        formula(DVec3::from(at.map(|x| x as f64))) as u8
    };
    let voxels = (0..dims.iter().product()).map(value).collect();
    Volume::new(dims, Voxels::U8(voxels), DAffine3::IDENTITY).expect("as many voxels as dims say")
}

fn real_path(file: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let data = root.join(std::env::var_os("RESAMPLE_DATA").unwrap_or("../shared/data".into()));
    data.join("volumes/raw").join(file)
}

/// Walls about 6 voxels thick around a box and around four bores, densest in their middle.
fn block(at: DVec3) -> f64 {
    let from_centre = at - DVec3::new(127.5, 127.5, 63.5);
    let to_box = (from_centre.abs() - DVec3::new(78.0, 92.0, 52.0)).max_element();
    let bore = (from_centre.truncate().abs() - glam::DVec2::new(38.0, 44.0)).length() - 26.0;
    let from_wall = if to_box > 0.0 {
        to_box
    } else {
        to_box.abs().min(bore.abs())
    };
    (230.0 - 56.0 * from_wall).max(0.0)
}

/// Tubes of radius 3.5 voxels, twisted along each axis.
fn vessels(at: DVec3) -> f64 {
    let turn = TAU / 128.0;
    let tube = |along: f64, x: f64, y: f64| {
        let (dx, dy) = (
            30.0 * (turn * along).sin(),
            30.0 * (0.7 * turn * along).cos(),
        );
        let cell = |p: f64| (p + 128.0).rem_euclid(128.0) - 64.0;
        cell(x + dx).hypot(cell(y + dy))
    };
    let nearest = tube(at.x, at.y, at.z)
        .min(tube(at.y, at.z, at.x))
        .min(tube(at.z, at.x, at.y));
    (200.0 - 50.0 * nearest).max(0.0)
}
