//! Cells of voxels, in f64 and by definition: the parts that a volume is drawn in.
//!
//! A cell, or a part of it, is asked at the points of a lattice of quarters of a cell that lie in it: the trilinear field
//! there, through the transfer function itself. Its extinction is their mean, its colour their mean weighted by extinction. A
//! part whose eighths differ from it by more than the options' error, in opacity or emitted colour, is taken apart, down to
//! the quarters. Source: the method, section 11. Limits: one scalar channel; slow.

use glam::DVec3;
use resample_core::OpacityMode;
use volsplat::{Cells, RenderOptions, TransferFunction, Volume};

use crate::choices::samples;
use crate::twins::field::extinction;
use crate::twins::trilinear::scalar;

/// A cell or a part of one.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Its middle, voxels.
    pub index: DVec3,
    /// Its side, voxels.
    pub side: f64,
    /// Linear colour.
    pub rgb: [f64; 3],
    /// Extinction per opacity unit, or opacity where that is linear.
    pub strength: f64,
}

/// The parts that `options` draw of a volume; voxels where they do not ask for cells.
pub fn parts(volume: &Volume, transfer: &TransferFunction, options: &RenderOptions) -> Vec<Part> {
    let [nx, ny, _] = volume.dims;
    let at = |i: usize, nx: usize, ny: usize| {
        DVec3::new(
            (i % nx) as f64,
            (i / nx % ny) as f64,
            (i / (nx * ny)) as f64,
        )
    };
    let cells = options
        .samples()
        .map_or(Cells::Off, |samples| samples.cells);
    if !matches!(cells, Cells::Mean | Cells::Split { .. }) {
        let voxel = |i: usize| {
            let [rgb @ .., strength] = classified(transfer, options, volume.value(i));
            Part {
                index: at(i, nx, ny),
                side: 1.0,
                rgb,
                strength,
            }
        };
        return (0..volume.len())
            .map(voxel)
            .filter(|part| part.strength > 0.0)
            .collect();
    }
    let [cx, cy, cz] = volume.dims.map(|n| n - 1);
    let mut found = Vec::new();
    for i in 0..cx * cy * cz {
        collect((volume, transfer, options), at(i, cx, cy), 1.0, &mut found);
    }
    found
}

type Look<'a> = (&'a Volume, &'a TransferFunction, &'a RenderOptions);

/// Adds the cube of this side at this corner, or what it is taken apart into.
fn collect(look: Look, corner: DVec3, side: f64, found: &mut Vec<Part>) {
    let part = mean(look, corner, side);
    if !(part.strength > 0.0) {
        return;
    }
    let split = match samples(look.2).cells {
        Cells::Split { error } => Some(error),
        _ => None,
    };
    let half = 0.5 * side;
    let eighths = || {
        (0..8).map(move |i| {
            corner + half * DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))
        })
    };
    let differs = |at: DVec3| {
        let (whole, eighth) = (shown(look.2, &part), shown(look.2, &mean(look, at, half)));
        whole
            .iter()
            .zip(eighth)
            .any(|(a, b)| split.is_some_and(|error| (a - b).abs() > f64::from(error)))
    };
    if split.is_some() && side > 0.25 && eighths().any(differs) {
        eighths().for_each(|at| collect(look, at, half, found));
    } else {
        found.push(part);
    }
}

fn mean((volume, transfer, options): Look, corner: DVec3, side: f64) -> Part {
    let count = (4.0 * side) as usize;
    let mut sum = [0.0; 4];
    for i in 0..count.pow(3) {
        let point = DVec3::new(
            (i % count) as f64,
            (i / count % count) as f64,
            (i / (count * count)) as f64,
        );
        let value = scalar(volume, corner + 0.25 * (point + 0.5));
        let [r, g, b, strength] = classified(transfer, options, value);
        for (sum, value) in sum
            .iter_mut()
            .zip([r * strength, g * strength, b * strength, strength])
        {
            *sum += value / count.pow(3) as f64;
        }
    }
    let rgb = [0, 1, 2].map(|k| if sum[3] > 0.0 { sum[k] / sum[3] } else { 0.0 });
    Part {
        index: corner + 0.5 * side,
        side,
        rgb,
        strength: sum[3],
    }
}

/// The colour and opacity that a part shows over an opacity unit.
fn shown(options: &RenderOptions, part: &Part) -> [f64; 4] {
    let opacity = match options.opacity {
        OpacityMode::Extinction => -(-part.strength).exp_m1(),
        OpacityMode::Linear => part.strength,
    };
    let [r, g, b] = part.rgb.map(|c| c * opacity);
    [r, g, b, opacity]
}

/// Colour and strength of a scalar.
fn classified(transfer: &TransferFunction, options: &RenderOptions, value: f64) -> [f64; 4] {
    let (rgb, opacity) = transfer.sample(value);
    let [r, g, b] = rgb.map(f64::from);
    let strength = match options.opacity {
        OpacityMode::Extinction => extinction(opacity),
        OpacityMode::Linear => opacity,
    };
    [r, g, b, strength]
}
