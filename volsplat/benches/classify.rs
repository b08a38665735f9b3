//! How long it takes to apply a transfer function to a volume and to pack what is visible into bricks.
//!
//! Items are voxels of the volume. One thread, then all.

mod subject;

use divan::Bencher;
use divan::counter::ItemsCount;
use rayon::ThreadPoolBuilder;
use resample_core::OpacityMode;
use volsplat::Samples;

use subject::Subject;

fn main() {
    subject::announce();
    divan::Divan::default()
        .max_time(std::time::Duration::from_secs(3))
        .config_with_args()
        .main();
}

#[divan::bench]
fn engine_1_thread(bencher: Bencher) {
    classify(bencher, &subject::engine(), 1);
}

#[divan::bench]
fn engine_all_threads(bencher: Bencher) {
    classify(bencher, &subject::engine(), 0);
}

#[divan::bench]
fn aneurism_1_thread(bencher: Bencher) {
    classify(bencher, &subject::aneurism(), 1);
}

#[divan::bench]
fn aneurism_all_threads(bencher: Bencher) {
    classify(bencher, &subject::aneurism(), 0);
}

/// `threads` of 0 is all.
fn classify(bencher: Bencher, subject: &Subject, threads: usize) {
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads can be started");
    let classified =
        || Samples::classify(&subject.volume, &subject.transfer, OpacityMode::Extinction);
    bencher
        .counter(ItemsCount::new(subject.volume.len()))
        .bench(|| pool.install(classified).count);
}
