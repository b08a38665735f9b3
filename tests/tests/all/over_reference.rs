//! The renderer against a full f64 reference of itself (method, sections 2, 3 and 4, `every-sample`).
//!
//! The reference takes every voxel against every pixel, sorted by distance with all digits. The renderer's tiles sort
//! lists of 64 and more by 16 bits of depth, which may swap near-ties of splats; the first tests keep below 64, so
//! that 1e-4 holds without a proviso, the last one adds what the swaps of each pixel may cost.
//!
//! Points: the renderer tabulates the pixel's weights at 256 positions a pixel, so that a point may stand 1/512 px off.
//! What that may change is summed per pixel by the reference and allowed on top.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, OpacityMode, SelectMode};
use resample_tests::choices::with_samples;
use resample_tests::twins::cells::parts;
use resample_tests::twins::samples::{ReferencePixel, Scene, render as reference};
use resample_tests::volumes::scenes::{
    coloured, full, orthographic, perspective, random_volume, render, sheared_grid,
};
use volsplat::{Cells, DepthPlane, RenderOptions, Renderer, SampleOrder, Volume};

const BOUND: f64 = 1e-4;

/// Largest error of any channel beyond `allowed`, and of depth times opacity: the quotient of depth multiplies the error
/// of a faint pixel's sums by what it divides by.
fn worst(scene: &Scene, allowed: impl Fn(&ReferencePixel) -> f64) -> [f64; 2] {
    let options = RenderOptions {
        depth: DepthPlane::Expected,
        ..scene.options.clone()
    };
    let image = render(scene.volume, scene.transfer, &options, scene.camera);
    let depths = image.depth.as_ref().expect("a depth plane was asked for");
    let (mut colour, mut depth, mut seen) = (0.0f64, 0.0f64, 0);
    for ((got, got_depth), truth) in image.rgba.iter().zip(depths).zip(reference(scene)) {
        let [r, g, b] = truth.rgb;
        for (got, truth_value) in got.iter().zip([r, g, b, 1.0 - truth.transmittance]) {
            colour = colour.max((f64::from(*got) - truth_value).abs() - allowed(&truth));
        }
        let opacity = 1.0 - truth.transmittance;
        if opacity > 1e-3 {
            depth = depth.max((f64::from(*got_depth) - truth.depth).abs() * opacity);
            seen += 1;
        }
    }
    assert!(seen > 10, "the scene shows next to nothing: {seen} pixels");
    [colour, depth]
}

/// 60 voxels in a column, seen from close to one end: their spacing falls from 3.4 px to 0.75 px.
fn column() -> Volume {
    random_volume([2, 2, 15], DAffine3::IDENTITY)
}

fn cameras() -> [Camera; 2] {
    let (eye, target) = (DVec3::new(1.93, 2.21, -4.17), DVec3::new(0.41, 0.37, 6.0));
    [
        perspective(eye, target, 80.0, [24, 24]),
        orthographic(eye, target, 14.0, [24, 24]),
    ]
}

/// As `check`, with a proviso for near-ties in long lists.
fn check_with(name: &str, (volume, opacity): (&Volume, f64), options: &RenderOptions, more: f64) {
    for camera in cameras() {
        let scene = Scene {
            volume,
            transfer: &coloured(opacity),
            camera: &camera,
            options,
        };
        let [colour, _] = worst(&scene, |p| p.phase_cost + p.swap_cost);
        println!(
            "{name}, {:?}: beyond phases and swaps {colour:.2e}",
            camera.projection
        );
        assert!(
            colour < BOUND + more,
            "{name}: a colour is off by {colour} beyond phases and swaps"
        );
    }
}

fn check(name: &str, volume: &Volume, options: &RenderOptions, bounds: [f64; 2]) {
    for camera in cameras() {
        let scene = Scene {
            volume,
            transfer: &coloured(0.3),
            camera: &camera,
            options,
        };
        let [plain, _] = worst(&scene, |_| 0.0);
        let [colour, depth] = worst(&scene, |p| p.phase_cost);
        let name = format!("{name}, {:?}", camera.projection);
        println!("{name}: colour {plain:.2e}, beyond the phases {colour:.2e}, depth {depth:.2e}");
        assert!(
            colour < bounds[0],
            "{name}: a colour is off by {colour} beyond the phases of points"
        );
        assert!(
            depth < bounds[1],
            "{name}: a depth is off by {depth}, weighted"
        );
    }
}

#[test]
fn splats() {
    check(
        "splats",
        &column(),
        &full(SelectMode::Splats),
        [BOUND, BOUND],
    );
    check(
        "splats, sheared",
        &random_volume([3, 4, 5], sheared_grid()),
        &full(SelectMode::Splats),
        [BOUND; 2],
    );
}

/// The depth of a sheet is one number for a whole tile, so it may be off by the sheet's thickness, here 1.
#[test]
fn points() {
    check("points", &column(), &full(SelectMode::Points), [BOUND, 1.0]);
    let thin = with_samples(full(SelectMode::Points), |samples| {
        samples.sheet_voxels = 0.01
    });
    check("points in thin sheets", &column(), &thin, [BOUND, 0.01]);
}

#[test]
fn hybrid() {
    let mut renderer =
        Renderer::new(&column(), &coloured(0.3), &full(SelectMode::Hybrid)).expect("valid options");
    let stats = renderer
        .render(&cameras()[0])
        .expect("a valid camera")
        .stats;
    assert!(
        stats.points > 9 && stats.splats > 9,
        "{} points, {} splats",
        stats.points,
        stats.splats
    );
    check("hybrid", &column(), &full(SelectMode::Hybrid), [BOUND, 1.0]);
}

#[test]
fn ewa() {
    check("ewa", &column(), &full(SelectMode::Ewa), [BOUND, BOUND]);
}

#[test]
fn linear_opacity() {
    for select in [SelectMode::Splats, SelectMode::Hybrid] {
        let options = RenderOptions {
            opacity: OpacityMode::Linear,
            ..full(select)
        };
        check("linear opacity", &column(), &options, [BOUND, 1.0]);
    }
}

/// Slices are whole whatever the depths in them, so that nothing depends on the keys of depth.
#[test]
fn axis_sheets() {
    for (name, volume) in [
        ("column", column()),
        ("sheared", random_volume([5, 6, 7], sheared_grid())),
        ("cube", cube()),
    ] {
        for select in [
            SelectMode::Splats,
            SelectMode::Hybrid,
            SelectMode::Points,
            SelectMode::Ewa,
        ] {
            if name == "sheared" && select == SelectMode::Ewa {
                continue;
            }
            let options = in_slices(full(select));
            // The phases change weights by up to 3e-3, of depths of up to 16.
            let depth = if select == SelectMode::Splats {
                2.0 * BOUND
            } else {
                5e-2
            };
            check(
                &format!("axis sheets, {name}, {select:?}"),
                &volume,
                &options,
                [BOUND, depth],
            );
        }
    }
    let linear = in_slices(RenderOptions {
        opacity: OpacityMode::Linear,
        ..full(SelectMode::Hybrid)
    });
    check(
        "axis sheets, linear opacity",
        &column(),
        &linear,
        [BOUND, 5e-2],
    );
}

fn in_slices(options: RenderOptions) -> RenderOptions {
    with_samples(options, |samples| samples.order = SampleOrder::AxisSheets)
}

/// Around the place that the cameras look at, so that one is inside and slices lie on both sides of it.
fn cube() -> Volume {
    random_volume(
        [9, 10, 9],
        DAffine3::from_translation(DVec3::new(-3.0, -4.0, -8.0)),
    )
}

/// Long lists: near-ties may swap, and the reference says what that may cost in each pixel.
#[test]
fn a_thousand_splats_up_to_swaps_of_near_ties() {
    let volume = random_volume([10, 10, 10], DAffine3::IDENTITY);
    let options = full(SelectMode::Splats);
    for camera in [
        perspective(
            DVec3::new(16.3, 13.1, -12.7),
            DVec3::splat(4.5),
            45.0,
            [24, 24],
        ),
        orthographic(
            DVec3::new(16.3, 13.1, -12.7),
            DVec3::splat(4.5),
            18.0,
            [24, 24],
        ),
    ] {
        let scene = Scene {
            volume: &volume,
            transfer: &coloured(0.3),
            camera: &camera,
            options: &options,
        };
        let cost = reference(&scene)
            .iter()
            .map(|p| p.swap_cost)
            .fold(0.0, f64::max);
        let [plain, _] = worst(&scene, |_| 0.0);
        let [beyond, _] = worst(&scene, |p| p.swap_cost);
        println!(
            "{:?}: error {plain:.2e}, swaps may cost {cost:.2e}, beyond {beyond:.2e}",
            camera.projection
        );
        assert!(
            beyond < BOUND,
            "{:?}: off by {beyond} beyond what swaps may cost",
            camera.projection
        );
        assert!(
            cost < 5e-3,
            "the bound on swaps has become too weak to test anything: {cost}"
        );
    }
}

/// Means of cells, and cells split into halves and quarters, near and far. The renderer's table of the transfer function
/// has 4096 entries, which comes on top of the bound.
#[test]
fn cells() {
    let table = 2e-4;
    for cells in [
        Cells::Mean,
        Cells::Split { error: 0.08 },
        Cells::Split { error: 0.04 },
    ] {
        let volume = random_volume([3, 2, 5], DAffine3::IDENTITY);
        let options = with_samples(full(SelectMode::Hybrid), |samples| {
            samples.cells = cells;
            samples.sheet_voxels = 0.01;
        });
        let drawn = parts(&volume, &coloured(0.9), &options);
        let sides =
            [1.0, 0.5, 0.25].map(|side| drawn.iter().filter(|part| part.side == side).count());
        println!("{cells:?}: whole cells, halves, quarters {sides:?}");
        for select in [SelectMode::Splats, SelectMode::Hybrid, SelectMode::Ewa] {
            let options = with_samples(options.clone(), |samples| samples.select = select);
            check_with(
                &format!("{cells:?}, {select:?}"),
                (&volume, 0.9),
                &options,
                table,
            );
        }
        let options = in_slices(options);
        check_with(
            &format!("{cells:?}, axis-sheets"),
            (&volume, 0.9),
            &options,
            table,
        );
    }
}
