//! How long a tile's list takes to sort by depth: the radix sort against the comparison sort of the standard library.
//!
//! Items are entries. The depths are those of a volume: spread over 300 to 700 units from the eye, in no order.

mod inputs;

use divan::Bencher;
use divan::counter::ItemsCount;
use resample_core::sort::{depth_key, entry, sort_by_depth};

/// From a tile at the picture's edge to the fullest tile of a large volume.
const LENGTHS: [usize; 4] = [100, 300, 1_000, 10_000];

fn main() {
    inputs::measure();
}

#[divan::bench(args = LENGTHS)]
fn by_depth(bencher: Bencher, length: usize) {
    let given = entries(length);
    let mut scratch = Vec::new();
    bencher
        .counter(ItemsCount::new(length))
        .with_inputs(|| given.clone())
        .bench_local_refs(|entries| sort_by_depth(entries, &mut scratch));
}

#[divan::bench(args = LENGTHS)]
fn std_sort_unstable(bencher: Bencher, length: usize) {
    let given = entries(length);
    bencher
        .counter(ItemsCount::new(length))
        .with_inputs(|| given.clone())
        .bench_local_refs(|entries| entries.sort_unstable());
}

fn entries(length: usize) -> Vec<u64> {
    inputs::spread(length, 300.0, 700.0)
        .iter()
        .zip(0..)
        .map(|(&depth, i)| entry(depth_key(depth as f32), i))
        .collect()
}
