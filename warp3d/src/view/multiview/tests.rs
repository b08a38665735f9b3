//! Several views: their cameras agree at the convergence, and their pictures lie in their places.

use resample_core::LookAt;

use glam::DVec2;

use super::*;

fn camera() -> Camera {
    let pose = LookAt {
        position: DVec3::new(1.0, -2.0, 5.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    Camera::perspective(&pose, 0.8, [40, 30]).expect("a good camera")
}

/// Where `seen` has a point that lies before `camera`, px.
fn at(seen: &Camera, camera: &Camera, pos_in_camera: DVec3) -> DVec2 {
    let world = camera
        .camera_from_world
        .inverse()
        .transform_point3(pos_in_camera);
    seen.screen_from_camera(seen.camera_from_world.transform_point3(world))
}

#[test]
fn views_agree_at_the_convergence_and_never_up_or_down() {
    let camera = camera();
    let layouts = [
        Layout::Stereo(0.3, Places::SideBySide),
        Layout::Anaglyph(0.3, Anaglyph::Grey),
        Layout::Quilt(
            Grid {
                columns: 4,
                rows: 3,
            },
            40.0,
        ),
    ];
    for layout in layouts {
        let views = layout.views(&layout.sheet(&camera), 6.0);
        for view in &views {
            let expected = camera.screen_from_camera(DVec3::new(0.7, 0.4, 6.0));
            let found = at(view, &camera, DVec3::new(0.7, 0.4, 6.0));
            assert!(
                (found - expected).length() < 1e-9,
                "{layout:?}: {found} instead of {expected}"
            );
        }
        let near = |view: &Camera| at(view, &camera, DVec3::new(0.0, 0.2, 3.0));
        let (first, last) = (near(&views[0]), near(&views[views.len() - 1]));
        assert!(
            first.x > last.x + 0.1,
            "{layout:?}: what is near moves left as the eye moves right"
        );
        assert!(
            (first.y - last.y).abs() < 1e-9,
            "{layout:?}: vertical parallax"
        );
    }
}

#[test]
fn parallel_views_shift_by_focal_length_times_baseline_over_depth() {
    let camera = camera();
    let layout = Layout::Stereo(0.5, Places::SideBySide);
    let views = layout.views(&layout.sheet(&camera), f64::INFINITY);
    let point = DVec3::new(0.2, 0.1, 4.0);
    let disparity = at(&views[0], &camera, point).x - at(&views[1], &camera, point).x;
    assert!(
        (disparity - camera.fx * 0.5 / 4.0).abs() < 1e-9,
        "{disparity} px"
    );
}

#[test]
fn a_quilt_runs_from_the_bottom_left_to_the_top_right() {
    let grid = Grid {
        columns: 3,
        rows: 2,
    };
    let layout = Layout::Quilt(grid, 30.0);
    let small = Camera {
        width: 2,
        height: 1,
        ..camera()
    };
    let sheet = layout.sheet(&small);
    assert_eq!([sheet.width, sheet.height], [6, 2], "size of the sheet");
    let views = layout.views(&sheet, 5.0);
    assert!(
        views.iter().all(|view| [view.width, view.height] == [2, 1]),
        "size of a view"
    );
    let marked = |index: usize| {
        let mut image = Image::transparent(2, 1);
        image.rgba = vec![[index as f32, 0.0, 0.0, 1.0]; 2];
        image
    };
    let whole = layout.put_together(&sheet, (0..6).map(marked).collect());
    let numbers: Vec<f32> = whole.rgba.iter().step_by(2).map(|pixel| pixel[0]).collect();
    assert_eq!(numbers, [3.0, 4.0, 5.0, 0.0, 1.0, 2.0], "rows from the top");
}

#[test]
fn an_anaglyph_of_two_equal_grey_views_is_nearly_that_grey() {
    let mut view = Image::transparent(1, 1);
    view.rgba[0] = [0.5, 0.5, 0.5, 1.0];
    for (kind, tolerance) in [
        (Anaglyph::Colour, 1e-6),
        (Anaglyph::Grey, 1e-6),
        (Anaglyph::Dubois, 2e-3),
    ] {
        let both = anaglyph(&[view.clone(), view.clone()], kind).rgba[0];
        let worst = both[..3]
            .iter()
            .map(|channel| (channel - 0.5).abs())
            .fold(0.0, f32::max);
        assert!(
            worst < tolerance,
            "{kind:?}: white must stay white, {both:?}"
        );
    }
}

#[test]
fn red_glasses_see_the_left_view() {
    let [mut left, mut right] = [Image::transparent(1, 1), Image::transparent(1, 1)];
    left.rgba[0] = [0.6, 0.6, 0.6, 1.0];
    right.rgba[0] = [0.1, 0.1, 0.1, 1.0];
    for kind in [Anaglyph::Colour, Anaglyph::Grey, Anaglyph::Dubois] {
        let [red, green, blue, _] = anaglyph(&[left.clone(), right.clone()], kind).rgba[0];
        assert!(
            red > 0.5 && green < 0.15 && blue < 0.15,
            "{kind:?}: [{red}, {green}, {blue}]"
        );
    }
}

#[test]
fn a_sway_keeps_the_pivot_and_its_angle() {
    let camera = camera();
    let cameras = sway(&camera, 3.0, 4.0, 12).expect("good cameras");
    let pivot = DVec3::new(0.0, 0.0, 3.0);
    let mut widest = 0.0f64;
    for swayed in &cameras {
        let found = at(swayed, &camera, pivot);
        assert!(
            (found - camera.screen_from_camera(pivot)).length() < 1e-9,
            "the pivot moves to {found}"
        );
        let cosine = swayed.forward_in_world().dot(camera.forward_in_world());
        widest = widest.max(cosine.min(1.0).acos().to_degrees());
    }
    assert!(
        (cameras[0].eye_in_world() - camera.eye_in_world()).length() < 1e-12,
        "it starts at the camera"
    );
    assert!((3.9..4.6).contains(&widest), "the widest angle is {widest}");
}

/// Two views, the first all 0 and the second all 1.
fn marked(views: &[Camera]) -> Vec<Image> {
    let one = |(index, view): (usize, &Camera)| {
        let mut image = Image::transparent(view.width as usize, view.height as usize);
        image.rgba.fill([index as f32, 0.0, 0.0, 1.0]);
        image
    };
    views.iter().enumerate().map(one).collect()
}

#[test]
fn the_views_of_a_pair_lie_where_their_places_say() {
    let camera = camera();
    let left_of = |layout: Layout| {
        let sheet = layout.sheet(&camera);
        let views = layout.views(&sheet, 6.0);
        let whole = layout.put_together(&sheet, marked(&views));
        let ends = [
            whole.pixel(0, 0)[0],
            whole.pixel(whole.width - 1, whole.height - 1)[0],
        ];
        assert_eq!(ends, [0.0, 1.0], "{layout:?}: the first view comes first");
        assert!(
            whole.rgba.iter().all(|pixel| pixel[3] == 1.0),
            "{layout:?}: no gap"
        );
        let x =
            |view: &Camera| at(view, &camera, DVec3::new(0.0, 0.0, 3.0)).x / f64::from(view.width);
        ([whole.width, whole.height], x(&views[0]) > x(&views[1]))
    };
    for (places, size, left_first) in [
        (Places::SideBySide, [80, 30], true),
        (Places::CrossEye, [80, 30], false),
        (Places::TopBottom, [40, 60], true),
        (Places::HalfSideBySide, [40, 30], true),
        (Places::HalfTopBottom, [40, 30], true),
    ] {
        let found = left_of(Layout::Stereo(0.3, places));
        assert_eq!(found, (size, left_first), "{places:?}");
    }
}

#[test]
fn views_of_half_a_width_show_as_much_as_whole_ones() {
    let camera = camera();
    let point = DVec3::new(0.4, -0.3, 4.0);
    for (places, scale) in [
        (Places::HalfSideBySide, DVec2::new(0.5, 1.0)),
        (Places::HalfTopBottom, DVec2::new(1.0, 0.5)),
    ] {
        let views = |places| {
            let layout = Layout::Stereo(0.3, places);
            layout.views(&layout.sheet(&camera), 6.0)
        };
        for (half, whole) in views(places).iter().zip(&views(Places::SideBySide)) {
            let expected = at(whole, &camera, point) * scale;
            assert!(
                (at(half, &camera, point) - expected).length() < 1e-9,
                "{places:?}"
            );
        }
    }
}

#[test]
fn a_grey_picture_of_depth_is_white_where_it_is_nearest() {
    let mut view = Image::transparent(3, 1);
    view.depth = Some(vec![2.0, 4.0, f32::INFINITY]);
    let layout = Layout::ColourAndDepth(2.0);
    let sheet = Camera {
        width: 6,
        height: 1,
        ..camera()
    };
    let whole = layout.put_together(&sheet, vec![view]);
    let grey: Vec<f32> = whole.rgba[3..]
        .iter()
        .map(|pixel| resample_core::image::srgb_from_linear(pixel[0]))
        .collect();
    assert!(
        (grey[0] - 1.0).abs() < 1e-6 && (grey[1] - 0.5).abs() < 1e-6,
        "{grey:?}"
    );
    assert_eq!(grey[2], 0.0, "nothing is black");
}

#[test]
fn a_panorama_shows_every_direction_once() {
    let sheet = Camera {
        width: 256,
        height: 128,
        ..camera()
    };
    let layout = Layout::Equirectangular(None);
    let in_world = |face: &Camera, x: usize, y: usize| {
        let pos = DVec2::new(x as f64, y as f64) + 0.5;
        let (_, ray) = face.ray_in_camera(pos);
        let in_camera = face.camera_from_world.matrix3.transpose() * ray;
        sheet.camera_from_world.matrix3 * in_camera
    };
    // Every face shows a smooth colour of the direction, and the distance of a sphere around the eye.
    let colour = |towards: DVec3| (towards.normalize() * 0.4 + 0.5).as_vec3().to_array();
    let faces = layout.views(&sheet, 1.0);
    let draw = |face: &Camera| {
        let (width, height) = (face.width as usize, face.height as usize);
        let mut image = Image::transparent(width, height);
        let mut depth = Vec::new();
        for index in 0..width * height {
            let ray = in_world(face, index % width, index / width);
            let [r, g, b] = colour(ray);
            image.rgba[index] = [r, g, b, 1.0];
            depth.push((7.0 / ray.length()) as f32);
        }
        image.depth = Some(depth);
        image
    };
    let whole = layout.put_together(&sheet, faces.iter().map(draw).collect());
    let depth = whole.depth.as_ref().expect("depth");
    for (index, &distance) in depth.iter().enumerate() {
        let pos = DVec2::new((index % 256) as f64, (index / 256) as f64) + 0.5;
        let expected = colour(crate::panorama::direction(pos, [256, 128]));
        let found = whole.rgba[index];
        for c in 0..3 {
            assert!(
                (found[c] - expected[c]).abs() < 1e-4,
                "{pos}: {found:?}, not {expected:?}"
            );
        }
        assert!(
            (distance - 7.0).abs() < 0.1,
            "{pos}: the distance is {distance}"
        );
    }
}

#[test]
fn a_comfortable_pair_has_the_disparity_that_was_asked_for() {
    let camera = camera();
    let layout = Layout::Stereo(0.5, Places::SideBySide);
    let (near, far, convergence) = (2.0, 30.0, 4.0);
    let baseline = comfortable_baseline(0.5, &camera, convergence, [near, far], 1.5);
    assert!(baseline < 0.5, "0.5 is too much: {baseline}");
    let layout = layout.with_baseline(baseline);
    let views = layout.views(&layout.sheet(&camera), convergence);
    // Where both views show a thing straight ahead, in per cent of the width.
    let apart = |z: f64| {
        let place = camera
            .camera_from_world
            .inverse()
            .transform_point3(DVec3::Z * z);
        let x = |view: &Camera| {
            view.screen_from_camera(view.camera_from_world.transform_point3(place))
                .x
        };
        100.0 * (x(&views[1]) - x(&views[0])) / f64::from(views[0].width)
    };
    for z in [near, convergence, far] {
        let said = disparity_percent(baseline, &camera, convergence, z);
        assert!(
            (apart(z) - said).abs() < 1e-9,
            "at {z}: {} and {said}",
            apart(z)
        );
    }
    assert!(
        (apart(near) + 1.5).abs() < 1e-9,
        "near things stand before the screen: {}",
        apart(near)
    );
    assert!(
        apart(far) > 0.0 && apart(far) < 1.5,
        "far ones behind it: {}",
        apart(far)
    );
    let enough = comfortable_baseline(0.01, &camera, convergence, [near, far], 1.5);
    assert_eq!(enough, 0.01, "a pair that is comfortable stays");
}

#[test]
fn a_floating_window_hides_the_outer_sides() {
    let white = || Image {
        rgba: vec![[1.0; 4]; 40 * 4],
        ..Image::transparent(40, 4)
    };
    let black = |view: &Image, x: usize| view.pixel(x, 2)[0] == 0.0;
    for (places, left) in [(Places::SideBySide, 0), (Places::CrossEye, 1)] {
        let mut views = [white(), white()];
        Layout::Stereo(0.1, places).float_window(&mut views, 5.0);
        let (left, right) = (&views[left], &views[1 - left]);
        assert!(
            black(left, 1) && !black(left, 2) && !black(left, 39),
            "{places:?}"
        );
        assert!(
            black(right, 38) && !black(right, 37) && !black(right, 0),
            "{places:?}"
        );
    }
}
