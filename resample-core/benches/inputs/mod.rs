//! What all benchmarks of this crate share: reproducible numbers to work on, and the time that each may take.
//!
//! The numbers come from the mixing function of a counter (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number
//! Generators", OOPSLA 2014), so every run and every machine measures the same work. They have no pattern that a
//! branch predictor or a sorting algorithm could learn. Limits: not for statistics.

use std::time::Duration;

/// Wall time of one benchmark, at least: some thousand samples, among which a quiet one is found on a busy machine.
const MIN_TIME: Duration = Duration::from_millis(100);

/// Wall time of one benchmark, at most. A file of twenty stays within 10 s.
const MAX_TIME: Duration = Duration::from_millis(400);

/// `count` numbers spread over `low..high`.
pub(crate) fn spread(count: usize, low: f64, high: f64) -> Vec<f64> {
    let uniform = |i: usize| (mixed(i as u64 + 1) >> 11) as f64 / (1u64 << 53) as f64;
    (0..count)
        .map(|i| low + (high - low) * uniform(i))
        .collect()
}

/// Runs the benchmarks of the calling file; options on the command line go before.
pub(crate) fn measure() {
    divan::Divan::default()
        .min_time(MIN_TIME)
        .max_time(MAX_TIME)
        .config_with_args()
        .main();
}

/// 64 well mixed bits of a counter.
fn mixed(counter: u64) -> u64 {
    let mut z = counter.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
