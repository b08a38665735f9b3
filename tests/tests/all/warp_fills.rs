//! Holes, what is put in them, and several references.

use glam::DVec3;
use resample_core::{Camera, Image};
use resample_tests::warps::filtered::filtered_scene;
use resample_tests::warps::measure::measure;
use resample_tests::warps::scenes::{AnalyticScene, Body, camera};
use warp3d::{Fill, Reference, WarpOptions, Warper};

const SIZE: [u32; 2] = [160, 120];

fn start() -> Camera {
    camera(SIZE, 130.0, DVec3::ZERO, 0.0)
}

/// A card before a wall whose colour changes linearly across the view.
fn card_before_a_gradient() -> Reference {
    let wall = Body::Card(DVec3::Z * 8.0, DVec3::X * 30.0, DVec3::Y * 30.0);
    let card = Body::Card(DVec3::Z * 4.0, DVec3::X * 0.7, DVec3::Y * 0.7);
    let scene = AnalyticScene(vec![(wall, 1e6, [1.0; 3]), (card, 1e6, [1.0; 3])]);
    let mut reference = scene.reference(&start());
    for (i, colour) in reference.colour.iter_mut().enumerate() {
        let x = (i % SIZE[0] as usize) as f32 / SIZE[0] as f32;
        *colour = if reference.depth[i] < 6.0 {
            [0.9, 0.0, 0.0]
        } else {
            [0.0, x, 0.5]
        };
    }
    reference
}

fn warp(references: Vec<Reference>, target: &Camera, options: &WarpOptions) -> Image {
    Warper::new(references, options)
        .expect("good")
        .render(target)
        .expect("a camera")
        .image
}

#[test]
fn holes_take_the_far_side_and_say_so() {
    let target = camera(SIZE, 130.0, DVec3::X * 0.5, 0.0);
    let with = |fill| {
        warp(
            vec![card_before_a_gradient()],
            &target,
            &WarpOptions {
                fill,
                ..WarpOptions::default()
            },
        )
    };
    let empty = with(Fill::None);
    let holes: Vec<usize> = (0..empty.rgba.len())
        .filter(|&i| empty.rgba[i][3] == 0.0)
        .collect();
    assert!(
        holes.len() > 200,
        "the card uncovers a hole: {}",
        holes.len()
    );
    assert!(
        empty.planes[0].values.iter().all(|&v| v == 0.0),
        "nothing was filled"
    );
    for fill in [Fill::Background, Fill::Natural] {
        let filled = with(fill);
        assert_eq!(filled.planes[0].name, "filled");
        let depth = filled.depth.as_ref().expect("depth");
        for &i in &holes {
            assert!(
                (filled.rgba[i][3] - 1.0).abs() < 1e-4,
                "{fill:?}: pixel {i} is still open"
            );
            assert!(
                filled.rgba[i][0] < 0.1,
                "{fill:?}: the card's red in the hole at {i}: {:?}",
                filled.rgba[i]
            );
            assert!(
                depth[i] > 7.0,
                "{fill:?}: the hole lies behind, not at {}",
                depth[i]
            );
            assert!(
                filled.planes[0].values[i] > 0.99,
                "{fill:?}: the mask leaves {i} out"
            );
            assert_eq!(
                filled.planes[1].values[i], 0.0,
                "{fill:?}: there is no confidence in a filled pixel"
            );
        }
    }
}

#[test]
fn no_single_pixel_of_a_rim_draws_a_line_across_a_hole() {
    let target = camera(SIZE, 130.0, DVec3::X * 1.2, 0.0);
    let mut reference = card_before_a_gradient();
    let mut state = 5u32;
    let mut uniform = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1u32 << 24) as f32
    };
    for (colour, z) in reference.colour.iter_mut().zip(&reference.depth) {
        if *z > 6.0 {
            *colour = [uniform(), uniform(), uniform()];
        }
    }
    let options = WarpOptions {
        fill: Fill::Background,
        ..WarpOptions::default()
    };
    let empty = warp(vec![reference.clone()], &target, &WarpOptions::default());
    let filled = warp(vec![reference], &target, &options);
    let width = SIZE[0] as usize;
    // Pixels from whose rim the nearest one is at least four away, and neither are they beyond the reference's frame.
    let is_deep = |i: usize| {
        let [x, y] = [i % width, i / width];
        let around = |d: usize| -4 + d as isize % 9;
        (20..100).contains(&x)
            && (20..100).contains(&y)
            && (0..81).all(|k| {
                let at = i as isize + around(k) + around(k / 9) * width as isize;
                empty.rgba[at as usize][3] == 0.0
            })
    };
    let deep: Vec<usize> = (0..filled.rgba.len()).filter(|&i| is_deep(i)).collect();
    assert!(
        deep.len() > 100,
        "{} pixels are deep in the hole",
        deep.len()
    );
    let step = |i: usize, to: usize| {
        let [a, b] = [filled.rgba[i], filled.rgba[to]];
        (0..3).map(|c| f64::from(a[c] - b[c]).abs()).sum::<f64>() / 3.0
    };
    let mean = |by: usize| deep.iter().map(|&i| step(i, i + by)).sum::<f64>() / deep.len() as f64;
    let [across, down] = [mean(1), mean(width)];
    println!("steps of a fill beside noise: {across:.4} across, {down:.4} down");
    // Eight pixels of the rim, as they were taken before, gave 0.1.
    assert!(across < 0.05 && down < 0.05, "{across} {down}");
}

#[test]
fn natural_neighbours_continue_a_gradient() {
    let target = camera(SIZE, 130.0, DVec3::X * 0.5, 0.0);
    let options = WarpOptions {
        fill: Fill::Natural,
        ..WarpOptions::default()
    };
    let reference = card_before_a_gradient();
    let empty = warp(vec![reference.clone()], &target, &WarpOptions::default());
    let image = warp(vec![reference], &target, &options);
    // The wall's point at a target pixel lies f * 0.5 / 8 px further right in the reference.
    let shift = 130.0 * 0.5 / 8.0;
    for (i, pixel) in image
        .rgba
        .iter()
        .enumerate()
        .filter(|(i, _)| empty.rgba[*i][3] == 0.0)
    {
        let x = (i % SIZE[0] as usize) as f32 + shift as f32;
        // Beside the hull of the rim the picture's border is carried inwards instead.
        if x < SIZE[0] as f32 - 1.0 {
            let expected = x / SIZE[0] as f32;
            assert!(
                (pixel[1] - expected).abs() < 0.04,
                "pixel {i}: {} against {expected}",
                pixel[1]
            );
        }
    }
}

#[test]
fn a_hole_before_the_sky_shows_the_sky() {
    let target = camera(SIZE, 130.0, DVec3::X * 0.5, 0.0);
    let mut reference = card_before_a_gradient();
    for z in reference.depth.iter_mut().filter(|z| **z > 6.0) {
        *z = f32::INFINITY;
    }
    let empty = warp(vec![reference.clone()], &target, &WarpOptions::default());
    // The hole is f * 0.5 / 4 px wide, and a rim that is extended has one colour over it.
    let hole = 130.0 * 0.5 / 4.0 / SIZE[0] as f32;
    for (fill, most) in [(Fill::Background, hole), (Fill::Natural, 0.04)] {
        let options = WarpOptions {
            fill,
            ..WarpOptions::default()
        };
        let image = warp(vec![reference.clone()], &target, &options);
        let depth = image.depth.as_ref().expect("a depth plane");
        let (mut holes, mut off) = (0, 0.0f32);
        for (i, pixel) in image.rgba.iter().enumerate() {
            if empty.rgba[i][3] > 0.0 {
                continue;
            }
            holes += 1;
            // The sky stands still, however far the eye moves.
            let x = (i % SIZE[0] as usize) as f32 / SIZE[0] as f32;
            off = off.max((pixel[1] - x).abs()).max((pixel[2] - 0.5).abs());
            assert!(
                depth[i] > 1e15,
                "{fill:?}, pixel {i}: a sky {} away",
                depth[i]
            );
        }
        assert!(holes > 200, "{fill:?}: {holes} pixels");
        assert!(off < most, "{fill:?}: off by {off}");
    }
}

#[test]
fn a_second_reference_closes_holes_and_does_no_harm() {
    let scene = AnalyticScene::room();
    let at = |x: f64| camera(SIZE, 130.0, DVec3::X * x, 0.0);
    // At edges, only pixels that are means over their Gaussian have a truth.
    let pair = |x| filtered_scene("room", &scene, &at(x), &at(0.0));
    let (left, right) = (pair(-0.4), pair(0.4));
    let truth = left.truth;
    let references = vec![left.reference.clone(), right.reference];
    let one = warp(vec![left.reference], &at(0.0), &WarpOptions::default());
    let open = |image: &Image| image.rgba.iter().filter(|p| p[3] < 0.25).count();
    let both = warp(references, &at(0.0), &WarpOptions::default());
    assert!(
        open(&both) * 4 < open(&one),
        "{} of {} pixels stay open",
        open(&both),
        open(&one)
    );
    let (alone, together) = (measure(&one, &truth), measure(&both, &truth));
    assert!(
        together.psnr_db > alone.psnr_db - 0.1,
        "{together:?} against {alone:?}"
    );
}
