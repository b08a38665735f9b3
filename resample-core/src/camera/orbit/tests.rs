//! Framing: what must be in the picture is, from every side and through every lens.

use glam::Vec3Swizzles;

use super::*;

const BOX: [DVec3; 2] = [DVec3::new(10.0, -4.0, 3.0), DVec3::new(14.0, 2.0, 5.0)];
const LENSES: [Lens; 2] = [Lens::Perspective { fov_y_deg: 40.0 }, Lens::Orthographic];

fn view(lens: Lens) -> View {
    let stance = Stance {
        up: DVec3::Y,
        right: DVec3::X,
    };
    View {
        size: Size {
            width: 200,
            height: 100,
        },
        orbit: DEFAULT_ORBIT,
        stance,
        lens,
    }
}

fn corners() -> impl Iterator<Item = DVec3> {
    (0..8).map(|i| DVec3::new(BOX[i & 1].x, BOX[i >> 1 & 1].y, BOX[i >> 2].z))
}

fn assert_all_corners_seen(view: &View) {
    let camera = frame(&Extent::of_box(BOX), view).expect("a good view");
    for corner in corners() {
        let in_camera = camera.camera_from_world.transform_point3(corner);
        let seen = camera.screen_from_camera(in_camera);
        let far_corner = DVec2::new(f64::from(view.size.width), f64::from(view.size.height));
        let inside = seen.cmpge(DVec2::ZERO).all() && seen.cmple(far_corner).all();
        assert!(
            inside && in_camera.z > camera.near,
            "{view:?}: corner {corner} at {seen}"
        );
    }
}

#[test]
fn all_corners_are_inside_the_picture_from_every_side() {
    for lens in LENSES {
        for (azimuth_deg, elevation_deg) in
            [(0.0, 0.0), (30.0, 20.0), (123.0, 90.0), (-77.0, -90.0)]
        {
            for (width, height) in [(200, 100), (60, 300)] {
                let orbit = Orbit {
                    azimuth_deg,
                    elevation_deg,
                    distance: 1.0,
                };
                assert_all_corners_seen(&View {
                    size: Size { width, height },
                    orbit,
                    ..view(lens)
                });
            }
        }
    }
}

#[test]
fn a_ball_just_fits_between_the_nearer_edges() {
    let middle = DVec3::new(1.0, 2.0, 3.0);
    let extent = Extent {
        bounds: [middle - DVec3::ONE, middle + DVec3::ONE],
        radius: 3.0,
    };
    // The tangent of half the angle is 1/2 across the narrow side of the last, so that the sine is 1 by the root of 5.
    let expected = [
        ([100, 100], 60.0, 6.0),
        ([200, 100], 60.0, 6.0),
        ([100, 200], 90.0, 3.0 * 5.0f64.sqrt()),
    ];
    for (size, fov_y_deg, distance) in expected {
        let [width, height] = size;
        let near = View {
            size: Size { width, height },
            ..view(Lens::Perspective { fov_y_deg })
        };
        let mut far = near;
        far.orbit.distance = 2.0;
        for (view, expected) in [(near, distance), (far, 2.0 * distance)] {
            let camera = frame(&extent, &view).expect("a camera");
            let found = camera.eye_in_world().distance(middle);
            assert!((found - expected).abs() < 1e-12 * expected, "{found}");
        }
    }
    let parallel = frame(&extent, &view(Lens::Orthographic)).expect("a camera");
    assert!((parallel.fy - 100.0 / 6.0).abs() < 1e-12, "px per unit");
}

#[test]
fn a_ball_is_framed_as_a_ball_and_not_as_its_box() {
    let ball = [DVec3::splat(-1.0), DVec3::splat(1.0)];
    let on_it = [
        DVec3::X,
        DVec3::NEG_X,
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::Z,
        DVec3::NEG_Z,
    ];
    let extent = Extent::of_points(ball, on_it.into_iter());
    assert!(
        (extent.radius - 1.0).abs() < 1e-15,
        "radius {}",
        extent.radius
    );
    let camera = frame(&extent, &view(Lens::Perspective { fov_y_deg: 40.0 })).expect("a good view");
    let distance = camera.eye_in_world().length();
    assert!(
        (1.0 / distance - 20f64.to_radians().sin()).abs() < 1e-12,
        "tangent cone at {distance}"
    );
}

#[test]
fn angles_move_the_eye_to_the_right_and_up() {
    let at = |azimuth_deg, elevation_deg| {
        let orbit = Orbit {
            azimuth_deg,
            elevation_deg,
            distance: 1.0,
        };
        orbit_directions(
            &orbit,
            &Stance {
                up: DVec3::Z,
                right: DVec3::X,
            },
        )
    };
    // Azimuth 30 leads to (1/2, -cos 30, 0) at the horizon.
    let (eye, up) = (
        DVec3::new(0.469_846, -0.813_798, 0.342_020),
        DVec3::new(-0.171_010, 0.296_198, 0.939_693),
    );
    let expected = [
        ([0.0, 0.0], (-DVec3::Y, DVec3::Z)),
        ([90.0, 0.0], (DVec3::X, DVec3::Z)),
        ([0.0, 90.0], (DVec3::Z, DVec3::Y)),
        ([30.0, 20.0], (eye, up)),
    ];
    for ([azimuth, elevation], (eye, up)) in expected {
        let found = at(azimuth, elevation);
        assert!(found.0.distance(eye) < 1e-6 && found.1.distance(up) < 1e-6);
    }
}

#[test]
fn distance_scales_the_view() {
    let scale = |lens: Lens, distance: f64| {
        let orbit = Orbit {
            distance,
            ..DEFAULT_ORBIT
        };
        let camera = frame(
            &Extent::of_box(BOX),
            &View {
                orbit,
                ..view(lens)
            },
        )
        .expect("a good view");
        let depth = camera.eye_in_world().distance(DVec3::new(12.0, -1.0, 4.0));
        if matches!(lens, Lens::Orthographic) {
            camera.fx
        } else {
            camera.fx / depth
        }
    };
    for lens in LENSES {
        let ratio = scale(lens, 0.5) / scale(lens, 1.0);
        assert!(
            (ratio - 2.0).abs() < 1e-12,
            "{lens:?}: half the distance, twice the scale, not {ratio}"
        );
    }
}

#[test]
fn one_point_still_gives_a_camera() {
    for at in [DVec3::ZERO, DVec3::splat(1e7)] {
        for lens in LENSES {
            assert!(
                frame(&Extent::of_box([at, at]), &view(lens)).is_ok(),
                "{lens:?} at {at}"
            );
        }
    }
}

#[test]
fn a_turntable_steps_evenly_on_one_circle() {
    for lens in LENSES {
        let cameras: Vec<Camera> = turned(&view(lens), 5)
            .map(|view| frame(&Extent::of_box(BOX), &view).expect("a good view"))
            .collect();
        let centre = 0.5 * (BOX[0] + BOX[1]);
        let arms: Vec<DVec3> = cameras
            .iter()
            .map(|camera| camera.eye_in_world() - centre)
            .collect();
        assert_eq!(
            cameras[0],
            frame(&Extent::of_box(BOX), &view(lens)).expect("a good view"),
            "it starts at the orbit's azimuth"
        );
        for (step, arm) in arms.iter().enumerate() {
            let next = arms[(step + 1) % arms.len()];
            assert!(
                (arm.y - arms[0].y).abs() < 1e-12 * arm.length(),
                "step {step} keeps its elevation"
            );
            let turned_deg = arm.xz().angle_to(next.xz()).to_degrees();
            assert!(
                (turned_deg.abs() - 72.0).abs() < 1e-9,
                "step {step} turns by {turned_deg} degrees"
            );
        }
    }
}

/// The extent that shows the corners of the box in these views.
fn fitted(views: &[View]) -> Extent {
    let mut measure = |camera: &Camera| Ok::<_, CameraError>(seen_points(camera, corners()));
    fit(&Extent::of_box(BOX), views, &mut measure).expect("good views")
}

#[test]
fn the_larger_side_fills_its_share_and_the_middle_is_the_pictures() {
    for lens in LENSES {
        for (azimuth_deg, elevation_deg) in [(0.0, 0.0), (30.0, 20.0), (123.0, 90.0)] {
            for (width, height) in [(200, 100), (60, 300), (100, 100)] {
                let orbit = Orbit {
                    azimuth_deg,
                    elevation_deg,
                    distance: 1.0,
                };
                let view = View {
                    size: Size { width, height },
                    orbit,
                    ..view(lens)
                };
                let camera = frame(&fitted(&[view]), &view).expect("a good view");
                let seen = seen_points(&camera, corners()).expect("seen");
                let half = 0.5 * (seen.high - seen.low);
                assert!(
                    (half.max_element() - FILL).abs() < 0.005,
                    "{view:?}: {seen:?} fills {half}"
                );
                let middle = 0.5 * (seen.low + seen.high);
                assert!(middle.abs().max_element() < 0.005, "{view:?}: {middle}");
            }
        }
    }
}

#[test]
fn a_turntable_shows_all_at_one_size() {
    for lens in LENSES {
        let views: Vec<View> = turned(&view(lens), 12).collect();
        let extent = fitted(&views);
        let mut most = 0.0f64;
        for view in &views {
            let camera = frame(&extent, view).expect("a good view");
            let seen = seen_points(&camera, corners()).expect("seen");
            let reach = seen.low.abs().max(seen.high.abs()).max_element();
            assert!(reach <= FILL + 0.02, "{lens:?}: {seen:?}");
            most = most.max(reach);
        }
        assert!(
            most > FILL - 0.02,
            "{lens:?}: no larger than needed, {most}"
        );
    }
}

#[test]
fn a_very_wide_view_shows_all() {
    for fov_y_deg in [100.0, 120.0, 140.0, 160.0] {
        let view = view(Lens::Perspective { fov_y_deg });
        let camera = frame(&fitted(&[view]), &view).expect("a good view");
        let seen = seen_points(&camera, corners()).expect("seen");
        let reach = seen.low.abs().max(seen.high.abs()).max_element();
        assert!((0.3..=1.0).contains(&reach), "{fov_y_deg}: {seen:?}");
    }
}

#[test]
fn where_nothing_is_seen_all_is_framed() {
    let mut nothing = |_: &Camera| Ok::<_, CameraError>(None);
    let extent = Extent::of_box(BOX);
    let views = [view(LENSES[0])];
    let fitted = fit(&extent, &views, &mut nothing).expect("good views");
    assert_eq!(
        (fitted.bounds, fitted.radius),
        (extent.bounds, extent.radius)
    );
}

#[test]
fn a_view_is_inside_up_to_the_edge() {
    let at = |middle, fill| Excess {
        middle: DVec2::new(middle, 0.0),
        fill,
        near_enough: 0.0,
    };
    assert!(at(-0.5, 0.5).is_inside() && !at(-0.5, 0.625).is_inside());
}
