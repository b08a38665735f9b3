//! Magnified colours stay near the samples that they lie between: a hard edge has no bands along it.

use glam::DVec3;
use resample_core::Camera;
use resample_tests::warps::scenes::camera;
use warp3d::{Reference, WarpOptions, Warper};

const SIZE: [u32; 2] = [48, 36];

/// How much larger the new picture shows the reference.
const TIMES: f64 = 125.0;

/// A wall of one depth whose samples are black or white, in blocks of one to three.
fn chequered() -> Reference {
    let camera = camera(SIZE, 40.0, DVec3::ZERO, 0.0);
    let mut state = 7u32;
    let mut toss = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 31) as f32
    };
    let count = (SIZE[0] * SIZE[1]) as usize;
    let mut colour: Vec<[f32; 3]> = (0..count).map(|_| [toss(), toss(), toss()]).collect();
    let width = SIZE[0] as usize;
    for i in 0..count {
        // Some samples are as the one before them, or above.
        if i % width > 0 && toss() > 0.0 {
            colour[i] = colour[i - 1];
        } else if i >= width && toss() > 0.0 {
            colour[i] = colour[i - width];
        }
    }
    Reference {
        camera,
        colour,
        depth: vec![5.0; count],
    }
}

/// A view of a few samples around a place in the reference, px.
fn closely(at: [f64; 2], reference: &Camera) -> Camera {
    let [width, height] = [300, 200];
    Camera {
        width,
        height,
        fx: TIMES * reference.fx,
        fy: TIMES * reference.fy,
        cx: 0.5 * f64::from(width) - TIMES * (at[0] - reference.cx),
        cy: 0.5 * f64::from(height) - TIMES * (at[1] - reference.cy),
        ..*reference
    }
}

#[test]
fn colours_stay_within_a_twenty_fifth_of_the_four_samples_around() {
    let reference = chequered();
    let mut warper = Warper::new(vec![reference.clone()], &WarpOptions::default()).expect("good");
    let (mut worst, mut count) = (0.0f32, 0);
    for k in 0..24 {
        let at = [6.0 + 1.5 * f64::from(k), 6.0 + f64::from(k % 6) * 4.5];
        let target = closely(at, &reference.camera);
        let image = warper.render(&target).expect("a camera").image;
        for (i, pixel) in image.rgba.iter().enumerate() {
            let place = |index: usize, c: f64, middle: f64| {
                ((index as f64 + 0.5 - c) / TIMES + middle - 0.5).floor() as usize
            };
            let x = place(i % image.width, target.cx, reference.camera.cx);
            let y = place(i / image.width, target.cy, reference.camera.cy);
            let around = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]];
            let around = around.map(|[x, y]| reference.colour[y * SIZE[0] as usize + x]);
            for c in 0..3 {
                let channel = around.map(|colour| colour[c]);
                let low = channel.into_iter().fold(f32::INFINITY, f32::min);
                let high = channel.into_iter().fold(0.0, f32::max);
                worst = worst.max(low - pixel[c]).max(pixel[c] - high);
                count += 1;
            }
        }
    }
    println!("{count} colours, at most {worst:.4} beyond");
    // Two axes of 0.02 each, and rounding.
    assert!(worst <= 0.0401, "{worst}");
}
