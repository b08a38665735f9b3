//! Samples of cells on volumes of a few voxels whose field is known: means, splits, and what is left out.
//!
//! Takes the layers that `cell_samples` makes, and gives nothing: each value is compared with one worked out by hand.

use glam::DAffine3;

use crate::look::clip::Clip;
use crate::look::transfer::{ColourKnot, OpacityKnot};
use crate::paper::samples::cell_samples::*;
use crate::{TransferFunction, Volume, Voxels};

/// Red below 0.5, blue above; opaque in part from 0.25 on.
fn look() -> TransferFunction {
    let colour = |value: f64, rgb: [f32; 3]| ColourKnot { value, rgb };
    let colours = vec![
        colour(0.0, [1.0, 0.0, 0.0]),
        colour(0.5, [1.0, 0.0, 0.0]),
        colour(0.5, [0.0, 0.0, 1.0]),
        colour(1.0, [0.0, 0.0, 1.0]),
    ];
    let opacity = |value: f64, opacity: f64| OpacityKnot { value, opacity };
    TransferFunction::new(
        colours,
        vec![opacity(0.25, 0.0), opacity(0.25, 0.5), opacity(1.0, 0.5)],
    )
    .expect("the knots ascend")
}

/// A field that rises along x from 0 at the first voxel to 1 at the last.
fn ramp(dims: [usize; 3]) -> Volume {
    let value = |i: usize| (i % dims[0]) as f64 / (dims[0] - 1) as f64;
    let voxels = (0..dims.iter().product()).map(value).collect();
    Volume::new(dims, Voxels::F64(voxels), DAffine3::IDENTITY).expect("a valid volume")
}

fn samples(volume: &Volume, parts: Parts) -> Vec<Samples> {
    let options = RenderOptions::every_sample();
    cell_samples(&Scene::new(volume, &look()), &options, parts).expect("one channel")
}

#[test]
fn one_cell_carries_the_mean_of_what_lies_in_it() {
    // Of four layers of places the first, at 1/8, is invisible, the second is red, the others are blue.
    let mean = samples(&ramp([2, 2, 2]), Parts::Whole);
    assert_eq!((mean.len(), mean[0].count), (1, 1), "one cell, one sample");
    let [r, g, b, strength] = mean[0].bricks[0].values[0];
    assert!(
        (f64::from(strength) - 0.75 * 2f64.ln()).abs() < 1e-6,
        "extinction {strength}"
    );
    assert!(
        (r - 1.0 / 3.0).abs() < 1e-6 && g == 0.0 && (b - 2.0 / 3.0).abs() < 1e-6,
        "colour {r} {g} {b}"
    );
    let place = mean[0].world_from_index.transform_point3(DVec3::ZERO);
    assert_eq!(
        place,
        DVec3::splat(0.5),
        "the sample stands in the middle of its cell"
    );
}

#[test]
fn parts_are_split_only_where_they_differ() {
    let split = samples(&ramp([2, 2, 2]), Parts::Split { error: 0.01 });
    // The left half holds what is invisible and what is red: 16 quarters of it are seen. The right half is all blue.
    let counts: Vec<u64> = split.iter().map(|lattice| lattice.count).collect();
    assert_eq!(counts, [0, 4, 16], "whole cells, halves, quarters");
    let coarse = samples(&ramp([2, 2, 2]), Parts::Split { error: 0.9 });
    assert_eq!(
        coarse.iter().map(|l| l.count).collect::<Vec<_>>(),
        [1, 0, 0],
        "an error that allows all"
    );
    let quarter = split[2].world_from_index.transform_point3(DVec3::ZERO);
    assert_eq!(
        quarter,
        DVec3::splat(0.125),
        "the middle of the first quarter"
    );
}

#[test]
fn splitting_keeps_what_there_is_of_extinction_and_colour() {
    let volume = ramp([12, 10, 9]);
    let total = |lattices: &[Samples]| {
        let mut sum = [0.0f64; 4];
        for (level, lattice) in lattices.iter().enumerate() {
            for value in lattice.bricks.iter().flat_map(|brick| &brick.values) {
                let mass = f64::from(value[3]) * 0.125f64.powi(level as i32);
                for (sum, part) in sum.iter_mut().zip([value[0], value[1], value[2], 1.0]) {
                    *sum += mass * f64::from(part);
                }
            }
        }
        sum
    };
    let [mean, split] =
        [Parts::Whole, Parts::Split { error: 0.05 }].map(|parts| total(&samples(&volume, parts)));
    for (a, b) in mean.iter().zip(split) {
        assert!(
            (a - b).abs() < 1e-5 * mean[3],
            "{mean:?} split into {split:?}"
        );
    }
}

#[test]
fn a_clip_of_voxels_is_the_same_place_on_every_lattice() {
    let volume = ramp([20, 5, 5]);
    let clip = Clip {
        crop_in_grid: Some([DVec3::splat(1.0), DVec3::splat(3.0)]),
        ..Clip::default()
    };
    for lattice in samples(&volume, Parts::Split { error: 0.01 }) {
        let in_lattice = lattice.clip(&clip);
        let inverse = lattice.world_from_index.inverse();
        for (at, kept) in [(0.99, false), (1.01, true), (2.99, true), (3.01, false)] {
            let place = inverse.transform_point3(DVec3::splat(at));
            assert_eq!(in_lattice.keeps(place), kept, "voxel {at}");
        }
    }
}
