//! Depth images at the extremes: a finite picture, or one clear error before any work.

use glam::DVec3;
use resample_core::{Camera, Image};
use resample_tests::warps::scenes::{AnalyticScene, camera};
use warp3d::{Error, Fill, Method, Reference, SurfaceTolerance, WarpOptions, Warper};

const SIZE: [u32; 2] = [64, 48];

fn start() -> Camera {
    camera(SIZE, 50.0, DVec3::ZERO, 0.0)
}

fn warp(reference: &Reference, target: &Camera, options: &WarpOptions) -> Image {
    Warper::new(vec![reference.clone()], options)
        .expect("good")
        .render(target)
        .expect("a camera")
        .image
}

fn assert_finite(image: &Image, what: &str) {
    let finite = image.rgba.iter().all(|p| p.iter().all(|v| v.is_finite()));
    assert!(finite, "{what}: colours must be finite");
    let opaque = image
        .rgba
        .iter()
        .all(|p| (-1e-6..=1.000_01).contains(&p[3]));
    assert!(opaque, "{what}: coverage must be 0 to 1");
    let depth = image.depth.as_ref().expect("a depth plane");
    assert!(
        depth.iter().all(|d| !d.is_nan()),
        "{what}: depth must not be NaN"
    );
}

fn each_method(what: &str, reference: &Reference, target: &Camera) {
    for method in Method::ALL {
        for fill in [Fill::None, Fill::Background, Fill::Natural] {
            let options = WarpOptions {
                fill,
                ..WarpOptions::with_method(method)
            };
            assert_finite(
                &warp(reference, target, &options),
                &format!("{what}, {method:?}, {fill:?}"),
            );
        }
    }
}

#[test]
fn every_depth_that_is_none_is_unknown() {
    let mut reference = AnalyticScene::room().reference(&start());
    let odd = [
        0.0,
        -1.0,
        f32::NAN,
        f32::INFINITY,
        f32::MIN_POSITIVE,
        1e-45,
        1e30,
        f32::NEG_INFINITY,
    ];
    for (i, depth) in reference.depth.iter_mut().enumerate() {
        if i % 5 == 0 {
            *depth = odd[i / 5 % odd.len()];
        }
    }
    each_method(
        "odd depths",
        &reference,
        &camera(SIZE, 50.0, DVec3::X * 0.2, 0.05),
    );
}

#[test]
fn a_sky_of_any_distance_leaves_the_scene_before_it_as_it_is() {
    let reference = AnalyticScene::room().reference(&start());
    let is_sky = |z: f32| z > 8.0;
    let with_sky = |sky: f32| {
        let mut reference = reference.clone();
        for z in reference.depth.iter_mut().filter(|z| is_sky(**z)) {
            *z = sky;
        }
        reference
    };
    let aside = camera(SIZE, 50.0, DVec3::X * 0.3, 0.02);
    let of = |sky: f32| warp(&with_sky(sky), &aside, &WarpOptions::default());
    let without = of(f32::NAN);
    let depth_without = without.depth.as_ref().expect("a depth plane");
    // Away from the edges, at which the sky's colours come in.
    let whole = |i: usize| {
        let (x, y) = (i % SIZE[0] as usize, i / SIZE[0] as usize);
        (x.saturating_sub(3)..=x + 3).all(|u| {
            (y.saturating_sub(3)..=y + 3).all(|v| {
                let inside = u < SIZE[0] as usize && v < SIZE[1] as usize;
                !inside || without.pixel(u, v)[3] > 0.999
            })
        })
    };
    for sky in [65_504.0, 1e6, 1e10, 1e30, f32::INFINITY] {
        let image = of(sky);
        let depth = image.depth.as_ref().expect("a depth plane");
        let (mut scene, mut behind) = (0, 0);
        for i in 0..depth.len() {
            if whole(i) {
                scene += 1;
                let apart = (depth[i] - depth_without[i]).abs();
                assert!(
                    apart < 1e-5 * depth_without[i],
                    "sky {sky}, pixel {i}: {}",
                    depth[i]
                );
                let alike = image.rgba[i].iter().zip(without.rgba[i]);
                let largest = alike.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(largest < 0.02, "sky {sky}, pixel {i} differs by {largest}");
            } else if without.rgba[i][3] == 0.0 && image.rgba[i][3] > 0.999 {
                behind += 1;
                assert!(depth[i] >= 0.9 * sky, "sky {sky}, pixel {i}: {}", depth[i]);
            }
        }
        assert!(
            scene > 300 && behind > 300,
            "sky {sky}: {scene} before, {behind} behind"
        );
    }
}

#[test]
fn nothing_known_is_an_empty_picture() {
    let mut reference = AnalyticScene::room().reference(&start());
    reference.depth.fill(f32::NAN);
    for method in Method::ALL {
        let image = warp(&reference, &start(), &WarpOptions::with_method(method));
        assert!(
            image.rgba.iter().all(|p| *p == [0.0; 4]),
            "{method:?}: nothing is known"
        );
    }
}

#[test]
fn depth_jumps_of_a_million() {
    let mut reference = AnalyticScene::room().reference(&start());
    for (i, depth) in reference.depth.iter_mut().enumerate() {
        *depth = if (i / 8) % 2 == 0 { 1.0 } else { 1e6 };
    }
    each_method(
        "jumps",
        &reference,
        &camera(SIZE, 50.0, DVec3::new(0.1, 0.0, 0.3), 0.0),
    );
}

#[test]
fn one_pixel() {
    let from = camera([1, 1], 1.0, DVec3::ZERO, 0.0);
    let reference = Reference {
        camera: from,
        colour: vec![[0.5, 0.25, 1.0]],
        depth: vec![3.0],
    };
    each_method("one pixel", &reference, &from);
    let image = warp(&reference, &from, &WarpOptions::default());
    assert_eq!(
        image.rgba,
        vec![[0.5, 0.25, 1.0, 1.0]],
        "one pixel seen from its own place"
    );
}

#[test]
fn a_camera_that_looks_away_sees_nothing() {
    let reference = AnalyticScene::room().reference(&start());
    for method in Method::ALL {
        let away = camera(SIZE, 50.0, DVec3::ZERO, std::f64::consts::PI);
        let image = warp(&reference, &away, &WarpOptions::with_method(method));
        assert!(
            image.rgba.iter().all(|p| p[3] == 0.0),
            "{method:?} sees something behind itself"
        );
    }
}

#[test]
fn the_back_of_a_surface_is_not_shown() {
    let reference = AnalyticScene::wall(0.0).reference(&start());
    let behind = camera(SIZE, 50.0, DVec3::Z * 10.0, std::f64::consts::PI);
    for method in [Method::HYBRID, Method::SPLATS, Method::POINTS] {
        let image = warp(&reference, &behind, &WarpOptions::with_method(method));
        assert!(
            image.rgba.iter().all(|p| p[3] == 0.0),
            "{method:?} shows the back of a wall"
        );
    }
}

#[test]
fn a_camera_inside_a_surface() {
    let reference = AnalyticScene::room().reference(&start());
    each_method(
        "in the wall",
        &reference,
        &camera(SIZE, 50.0, DVec3::Z * 9.0, 0.0),
    );
    each_method(
        "in the ball",
        &reference,
        &camera(SIZE, 50.0, DVec3::new(1.3, 0.2, 5.0), 1.0),
    );
}

#[test]
fn ten_million_units_from_the_origin_change_nothing() {
    let scene = AnalyticScene::room();
    let reference = scene.reference(&start());
    let near = warp(
        &reference,
        &camera(SIZE, 50.0, DVec3::X * 0.25, 0.0),
        &WarpOptions::default(),
    );
    let offset = DVec3::new(1e7, -1e7, 1e7);
    let far = Reference {
        camera: camera(SIZE, 50.0, offset, 0.0),
        ..reference
    };
    let far = warp(
        &far,
        &camera(SIZE, 50.0, offset + DVec3::X * 0.25, 0.0),
        &WarpOptions::default(),
    );
    let differ = near
        .rgba
        .iter()
        .zip(&far.rgba)
        .filter(|(a, b)| (0..4).any(|c| (a[c] - b[c]).abs() > 1e-3));
    assert!(
        differ.count() < 5,
        "a scene far from the origin looks different"
    );
}

#[test]
fn bad_references_are_refused_with_a_reason() {
    let good = AnalyticScene::room().reference(&start());
    let short = Reference {
        depth: vec![1.0; 5],
        ..good.clone()
    };
    let refused = |references: Vec<Reference>, options: &WarpOptions| -> String {
        let error: Error = Warper::new(references, options).expect_err("must be refused");
        error.to_string()
    };
    let said = refused(vec![good.clone(), short], &WarpOptions::default());
    assert!(
        said.contains("reference 1") && said.contains("depth"),
        "{said}"
    );
    assert!(refused(Vec::new(), &WarpOptions::default()).contains("at least one reference"));
    let ninefold = WarpOptions {
        method: Method::Hybrid {
            tolerance: SurfaceTolerance::Auto,
            subpixels: 9,
        },
        ..WarpOptions::default()
    };
    assert!(refused(vec![good], &ninefold).contains("1 to 8"));
}
