//! A roofline: times of frames of volumes beside the limits of memory, cache and arithmetic, as a Markdown table.
//!
//! `cargo run --release -p resample-tests --example roofline [-- FRAMES]`. The rates of the machine are measured first, on one thread: bytes
//! that are read from memory and from the second cache, and multiplications with additions. Counts of frames give three times
//! below which none can be: each brick is read from memory once, each brick of a tile from the cache once, and
//! each lane and sample takes its arithmetic. Says "skipped" where the data is absent.

use std::hint::black_box;
use std::time::Instant;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use resample_core::clock::StageClock;
use resample_core::simd::SimdLevel;
use resample_core::{Framing, dispatch};
use resample_tests::frames::{frames_argument, one_thread};
use resample_tests::volumes::lod_scenes::{procedural, real};
use volsplat::{Blend, FieldOptions, Order, RenderOptions, Renderer, Shading, Subpixels};

const PROGRAM: &str = "roofline";

/// Bytes of a brick of 8-bit voxels: its faces, its box and its cells.
const BRICK_BYTES: f64 = 2304.0 + 200.0;

/// Multiplications with additions of a lane: three for its place in the grid, three for its share of the cell, seven between the corners.
const LANE_OPERATIONS: f64 = 13.0;

/// Those of a sample that contributes: two for its place in the transfer function, four for its entry, six for opacity, four for the pixel.
const SAMPLE_OPERATIONS: f64 = 16.0;

/// The greatest rates of the machine, on one thread.
struct Rates {
    memory_bytes_per_s: f64,
    cache_bytes_per_s: f64,
    operations_per_s: f64,
}

fn main() {
    let frames = frames_argument(PROGRAM, 9).unwrap_or(9);
    one_thread().install(|| {
        let rates = Rates {
            memory_bytes_per_s: read_rate(1 << 28),
            cache_bytes_per_s: read_rate(1 << 18),
            operations_per_s: operation_rate(),
        };
        println!(
            "memory {:.1} GB/s, second cache {:.1} GB/s, {:.1} G operations/s\n",
            1e-9 * rates.memory_bytes_per_s,
            1e-9 * rates.cache_bytes_per_s,
            1e-9 * rates.operations_per_s
        );
        println!(
            "| scene | frame, ms | memory, ms | cache, ms | arithmetic, ms | nearest, % | operations a byte of memory |"
        );
        println!("|---|---|---|---|---|---|---|");
        for subject in procedural().into_iter().chain(real(PROGRAM)) {
            let with_blend = |blend| {
                Order::Field(FieldOptions {
                    blend,
                    ..FieldOptions::default()
                })
            };
            let one = Subpixels::Fixed(1);
            for (name, order, shading, subpixels) in [
                ("", with_blend(Blend::Emission), Shading::None, Subpixels::Auto),
                (", one sub-pixel", with_blend(Blend::Emission), Shading::None, one),
                (", Phong", with_blend(Blend::Emission), Shading::Phong, Subpixels::Auto),
                (", maximum", with_blend(Blend::Maximum), Shading::None, one),
            ] {
                let options = RenderOptions {
                    order,
                    shading,
                    subpixels,
                    ..RenderOptions::default()
                };
                let mut renderer = Renderer::new(&subject.volume, &subject.transfer, &options)
                    .expect("options within their ranges");
                let row = bounds(&mut renderer, frames, &rates);
                println!("| {}{name} | {row} |", subject.name);
            }
        }
    });
}

/// The frame's time beside those that bound it, medians over an orbit.
fn bounds(renderer: &mut Renderer, frames: usize, rates: &Rates) -> String {
    let span = renderer
        .visible_bounds_in_world()
        .expect("something is seen");
    let (mut times, mut memory, mut cache, mut arithmetic, mut intensity) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for number in 0..frames {
        let angle = std::f64::consts::TAU * number as f64 / frames as f64;
        let framing = Framing {
            towards_eye: glam::DVec3::new(angle.sin(), 0.4, angle.cos()),
            up: glam::DVec3::Y,
            fov_y_rad: 0.5,
        };
        let camera = framing
            .camera(span, [400, 400])
            .expect("a box with an extent");
        renderer.render(&camera).expect("a valid camera");
        let clock = StageClock::start();
        let stats = renderer.render(&camera).expect("a valid camera").stats;
        times.push(clock.stop().cpu_ms);
        let read = BRICK_BYTES * stats.bricks as f64;
        let by_tiles = BRICK_BYTES * (stats.tile_pairs - stats.hidden_pairs) as f64;
        let operations = LANE_OPERATIONS * stats.lanes_computed as f64
            + SAMPLE_OPERATIONS * stats.samples_contributed as f64;
        memory.push(1e3 * read / rates.memory_bytes_per_s);
        cache.push(1e3 * by_tiles / rates.cache_bytes_per_s);
        arithmetic.push(1e3 * operations / rates.operations_per_s);
        intensity.push(operations / read);
    }
    let [time, memory, cache, arithmetic, intensity] =
        [times, memory, cache, arithmetic, intensity].map(median);
    let nearest = 100.0 * memory.max(cache).max(arithmetic) / time;
    format!(
        "{time:.1} | {memory:.2} | {cache:.2} | {arithmetic:.2} | {nearest:.0} | {intensity:.0}"
    )
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Bytes read in a second of a list of so many, again and again: the best of five tries.
fn read_rate(bytes: usize) -> f64 {
    let list = vec![1.0f32; bytes / 4];
    let level = SimdLevel::Auto.resolve();
    let rounds = ((1 << 29) / bytes).max(1);
    best_of_five(|| {
        for _ in 0..rounds {
            black_box(dispatch!(level, simd => sum(simd, black_box(&list))));
        }
        (bytes * rounds) as f64
    })
}

/// Eight sums, so that none waits for the one before it.
#[simd]
fn sum<S: Simd>(simd: S, list: &[f32]) -> f32 {
    let mut sums = [f32x16::splat(simd, 0.0); 8];
    for part in list.chunks_exact(8 * 16) {
        for (sum, sixteen) in sums.iter_mut().zip(part.chunks_exact(16)) {
            *sum += f32x16::from_slice(simd, sixteen);
        }
    }
    let mut total = 0.0;
    for sum in sums {
        for number in sum.to_array() {
            total += number;
        }
    }
    total
}

/// Multiplications with additions in a second, each of one f32: the best of five tries.
fn operation_rate() -> f64 {
    const ROUNDS: usize = 1 << 22;
    let level = SimdLevel::Auto.resolve();
    best_of_five(|| {
        black_box(dispatch!(level, simd => chain(simd, black_box(ROUNDS))));
        (ROUNDS * 12 * 16) as f64
    })
}

/// Twelve chains of multiplications with additions, more than the machine has in flight.
#[simd]
fn chain<S: Simd>(simd: S, rounds: usize) -> f32 {
    let [factor, term] = black_box([0.999, 0.002]).map(|number| f32x16::splat(simd, number));
    let starts: [f32; 12] = black_box(std::array::from_fn(|number| number as f32));
    let mut chains = starts.map(|start| f32x16::splat(simd, start));
    for _ in 0..rounds {
        for chain in &mut chains {
            *chain = chain.mul_add(factor, term);
        }
    }
    let mut total = 0.0;
    for chain in chains {
        for number in chain.to_array() {
            total += number;
        }
    }
    total
}

/// The greatest rate of five tries; `work` gives the amount that it did.
fn best_of_five(mut work: impl FnMut() -> f64) -> f64 {
    let mut best: f64 = 0.0;
    for _ in 0..5 {
        let start = Instant::now();
        let done = work();
        best = best.max(done / start.elapsed().as_secs_f64());
    }
    best
}
