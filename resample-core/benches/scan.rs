//! How long the scan conversion of one pixel row of a conic takes, for ellipses from small to larger than the picture
//! and for an open conic.
//!
//! Items are rows; every row that the outline touches is converted once per iteration, pixels counted.

mod inputs;

use std::ops::Range;

use divan::Bencher;
use divan::counter::ItemsCount;
use glam::DVec2;
use resample_core::conic::{Conic, Ellipse};
use resample_core::scan::{ellipse_rows, row_spans};

/// Side of the picture, px.
const SIDE_PX: u32 = 400;

fn main() {
    inputs::measure();
}

#[divan::bench(args = [2.0, 4.0, 16.0, 100.0, 1000.0])]
fn ellipse(bencher: Bencher, radius_px: f64) {
    let outlines = ellipses(radius_px);
    let rows =
        |outline: &Ellipse| ellipse_rows(outline.centre_px.y, outline.half_extent_px().y, SIDE_PX);
    let converted: Vec<(Conic, Range<u32>)> =
        outlines.iter().map(|e| (e.conic(), rows(e))).collect();
    let count: usize = converted.iter().map(|(_, rows)| rows.len()).sum();
    bencher.counter(ItemsCount::new(count)).bench_local(|| {
        converted
            .iter()
            .map(|(conic, rows)| pixels_inside(conic, rows.clone()))
            .sum::<usize>()
    });
}

#[divan::bench]
fn hyperbola(bencher: Bencher) {
    let conic = Conic {
        xx: 1.0,
        xy: 0.1,
        yy: -0.8,
        x: -220.0,
        y: 140.0,
        one: 9000.0,
    };
    bencher
        .counter(ItemsCount::new(SIDE_PX))
        .bench_local(|| pixels_inside(&conic, 0..SIDE_PX));
}

/// Sixteen ellipses near the middle of the picture, tilted, twice as long as wide, anywhere on the pixel grid.
fn ellipses(radius_px: f64) -> Vec<Ellipse> {
    let (u, v) = (
        DVec2::from_angle(0.4) / radius_px,
        DVec2::from_angle(0.4).perp() / (0.5 * radius_px),
    );
    let form = [
        u.x * u.x + v.x * v.x,
        u.x * u.y + v.x * v.y,
        u.y * u.y + v.y * v.y,
    ];
    let middle_px = DVec2::splat(f64::from(SIDE_PX) / 2.0);
    let offsets = inputs::spread(32, -4.0, 4.0);
    offsets
        .chunks(2)
        .map(|pair| Ellipse {
            centre_px: middle_px + DVec2::new(pair[0], pair[1]),
            form,
        })
        .collect()
}

fn pixels_inside(conic: &Conic, rows: Range<u32>) -> usize {
    rows.map(|row| {
        row_spans(conic, row, SIDE_PX)
            .map(|span| span.len())
            .iter()
            .sum::<usize>()
    })
    .sum()
}
