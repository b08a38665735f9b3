//! How long it takes to look up the pixels and weights of a point, and to tabulate the weights.
//!
//! Items are points (two axes each), or tables. What a point costs in a tile is in `composite.rs`.

mod inputs;

use divan::Bencher;
use divan::counter::ItemsCount;
use resample_core::point::PixelFilter;

/// Points per iteration.
const COUNT: usize = 1024;

fn main() {
    inputs::measure();
}

#[divan::bench]
fn weights(bencher: Bencher) {
    let filter = PixelFilter::new();
    let places: Vec<f32> = inputs::spread(2 * COUNT, 0.0, 400.0)
        .iter()
        .map(|&x| x as f32)
        .collect();
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| {
        for pair in places.chunks_exact(2) {
            divan::black_box((filter.along_axis(pair[0]), filter.along_axis(pair[1])));
        }
    });
}

#[divan::bench]
fn tabulate(bencher: Bencher) {
    bencher
        .counter(ItemsCount::new(1u32))
        .bench_local(PixelFilter::new);
}
