//! How long it takes to make a footprint and to evaluate it: the modes against each other, the paper's index table
//! against the closed form, and the footprint table against the profile.
//!
//! Items are footprints (`make`) or evaluations (all others). These are the f64 functions that define the modes; what
//! a frame pays per pixel is in `composite.rs`. Each index function gets its arguments in the form that it wants, so
//! the table is spared the square root and the arc sine that it would need in a renderer.

mod inputs;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use glam::{DAffine3, DVec2, DVec3};
use resample_core::footprint::{BallGeometry, Footprint, index2_from_ellipse};
use resample_core::index_table::{IndexTable, MAX_ANGLE_RAD};
use resample_core::table::{FootprintProfile, FootprintTable};
use resample_core::{Camera, FootprintMode, GridView, Kernel, KernelShape, LookAt};

/// Evaluations per iteration: enough to drown the clock, few enough to stay in the first-level cache.
const COUNT: usize = 1024;

fn main() {
    inputs::measure();
}

#[divan::bench(args = FootprintMode::ALL)]
fn make(bencher: Bencher, mode: FootprintMode) {
    let view = view();
    let centres = centres();
    bencher
        .counter(ItemsCount::new(centres.len()))
        .bench_local(|| {
            for &centre in &centres {
                black_box(
                    BallGeometry::new(&view, centre, 1.8).map(|ball| Footprint::new(mode, &ball)),
                );
            }
        });
}

#[divan::bench(args = FootprintMode::ALL)]
fn evaluate(bencher: Bencher, mode: FootprintMode) {
    let view = view();
    let ball =
        BallGeometry::new(&view, DVec3::new(3.0, 2.0, 1.0), 1.8).expect("in front of the eye");
    let footprint = Footprint::new(mode, &ball);
    let offsets = inputs::spread(2 * COUNT, -20.0, 20.0);
    let pixels: Vec<DVec2> = offsets
        .chunks(2)
        .map(|pair| ball.projected_px + DVec2::new(pair[0], pair[1]))
        .collect();
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| {
        pixels
            .iter()
            .map(|&pixel| footprint.index2(&view, pixel))
            .sum::<f64>()
    });
}

#[divan::bench]
fn index_by_table(bencher: Bencher) {
    let table = IndexTable::new();
    let pairs: Vec<[f32; 2]> = index_pairs()
        .iter()
        .map(|pair| pair.map(|x| x as f32))
        .collect();
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| {
        pairs
            .iter()
            .map(|[index, angle_rad]| table.index(*index, *angle_rad))
            .sum::<f32>()
    });
}

#[divan::bench]
fn index_by_closed_form(bencher: Bencher) {
    let pairs: Vec<[f64; 2]> = index_pairs()
        .iter()
        .map(|[index, angle_rad]| [index.powi(2), angle_rad.sin().powi(2)])
        .collect();
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| {
        pairs
            .iter()
            .map(|[i2, sin2_cone]| index2_from_ellipse(*i2, *sin2_cone))
            .sum::<f64>()
    });
}

#[divan::bench]
fn line_integral_by_table(bencher: Bencher) {
    let table = FootprintTable::new(&Kernel::new(KernelShape::Gaussian));
    let squared_indices = squared_indices();
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| {
        squared_indices
            .iter()
            .map(|&q| table.line_integral(q))
            .sum::<f32>()
    });
}

#[divan::bench]
fn line_integral_by_profile(bencher: Bencher) {
    let profile = FootprintProfile::new(&Kernel::new(KernelShape::Gaussian));
    let squared_indices = squared_indices();
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| {
        squared_indices
            .iter()
            .map(|&q| profile.line_integral(q))
            .sum::<f32>()
    });
}

/// Squared indices from inside and outside the support: 0..1.3, about what the corners of a bounding box give.
fn squared_indices() -> Vec<f32> {
    inputs::spread(COUNT, 0.0, 1.3)
        .iter()
        .map(|&q| q as f32)
        .collect()
}

/// An index in 0..1 and a half cone angle within the table's range, radians.
fn index_pairs() -> Vec<[f64; 2]> {
    inputs::spread(2 * COUNT, 0.0, 1.0)
        .chunks(2)
        .map(|pair| [pair[0], pair[1] * MAX_ANGLE_RAD])
        .collect()
}

fn centres() -> Vec<DVec3> {
    inputs::spread(3 * COUNT, -8.0, 8.0)
        .chunks(3)
        .map(|c| DVec3::new(c[0], c[1], c[2]))
        .collect()
}

/// A view of a grid with unequal spacings, from 40 units away.
fn view() -> GridView {
    let pose = LookAt {
        position: DVec3::new(12.0, 20.0, -32.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    let camera = Camera::perspective(&pose, 0.9, [400, 400]).expect("a valid camera");
    GridView::new(&camera, &DAffine3::from_scale(DVec3::new(1.0, 1.0, 1.4)))
}
