//! What must hold at the extremes: every picture is finite, and costs what is seen.

use glam::DVec3;
use resample_core::{Camera, Image};
use resample_tests::meshes::texture_scenes::looking_camera;
use resample_tests::meshes::textured::{checker, ground, quad_scene, texture, wall};
use texmap::scene::{Sides, Wrap};
use texmap::{FrameStats, Method, RenderOptions, Renderer, Scene};

fn drawn(scene: &Scene, camera: &Camera, method: Method) -> (Image, FrameStats) {
    let options = RenderOptions {
        method,
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(scene, &options).expect("options within their ranges");
    let frame = renderer.render(camera).expect("a valid camera");
    for pixel in &frame.image.rgba {
        let good = pixel
            .iter()
            .all(|v| v.is_finite() && (-0.1..1.1).contains(v));
        assert!(good, "{method:?}: a pixel is {pixel:?}");
    }
    (frame.image, frame.stats)
}

fn every_method(scene: &Scene, camera: &Camera) {
    for method in Method::ALL {
        drawn(scene, camera, method);
    }
}

fn front(distance: f64) -> Camera {
    looking_camera(DVec3::new(0.0, 0.0, distance), DVec3::ZERO, 50.0, [48, 48])
}

const SQUARE: [[f32; 3]; 4] = [
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
];

#[test]
fn texture_coordinates_without_area_show_one_texel() {
    let two = texture([2, 1], |x, _| {
        if x == 0 {
            [1.0, 0.0, 0.0, 1.0]
        } else {
            [0.0, 1.0, 0.0, 1.0]
        }
    });
    let scene = quad_scene(SQUARE, [[0.25, 0.5]; 4], two, Wrap::Clamp);
    let (image, _) = drawn(&scene, &front(2.5), Method::Hybrid);
    let pixel = image.pixel(24, 24);
    assert!(
        (pixel[0] - 1.0).abs() < 1e-5 && pixel[1] < 1e-5,
        "{pixel:?} is not the red texel"
    );
    every_method(&scene, &front(2.5));
    let line = [[0.0, 0.5], [1.0, 0.5], [1.0, 0.5], [0.0, 0.5]];
    every_method(
        &quad_scene(SQUARE, line, checker(64, 1), Wrap::Repeat),
        &front(2.5),
    );
}

#[test]
fn degenerate_triangles_are_dropped() {
    let mut scene = wall(checker(8, 1));
    scene.meshes[0]
        .triangles
        .extend([[0, 0, 0], [0, 1, 1], [0, 2, 0]]);
    let (_, stats) = drawn(&scene, &front(2.5), Method::Hybrid);
    // A triangle may keep a rounding error of area; no sub-pixel lies in it.
    let dropped = stats.back_facing + stats.hidden;
    assert_eq!(
        (stats.triangles, dropped, stats.drawn),
        (5, 3, 2),
        "{stats:?}"
    );
}

#[test]
fn texels_of_any_size() {
    for repeats in [1e-6f32, 1e-3, 1.0, 1e3, 1e6, 1e9] {
        let uvs = [
            [0.0, repeats],
            [repeats, repeats],
            [repeats, 0.0],
            [0.0, 0.0],
        ];
        every_method(
            &quad_scene(SQUARE, uvs, checker(16, 1), Wrap::Repeat),
            &front(2.5),
        );
    }
    let (image, _) = drawn(
        &quad_scene(
            SQUARE,
            [[0.0, 1e6], [1e6, 1e6], [1e6, 0.0], [0.0, 0.0]],
            checker(16, 1),
            Wrap::Repeat,
        ),
        &front(2.5),
        Method::Hybrid,
    );
    let grey = image.pixel(24, 24)[0];
    assert!(
        (grey - 0.5).abs() < 1e-3,
        "a million checkers a side are grey, not {grey}"
    );
}

#[test]
fn a_plane_through_the_eye_plane_and_at_grazing_angles() {
    let scene = ground(checker(64, 8), 1000.0, 100.0);
    for height in [1.0, 1e-2, 1e-4] {
        let camera = looking_camera(
            DVec3::new(0.0, height, 0.0),
            DVec3::new(0.0, height, -1.0),
            60.0,
            [48, 48],
        );
        every_method(&scene, &camera);
        let (image, _) = drawn(&scene, &camera, Method::Hybrid);
        assert!(
            image.pixel(24, 40)[3] > 0.999,
            "height {height}: the ground is not seen"
        );
        assert_eq!(
            image.pixel(24, 10)[3],
            0.0,
            "height {height}: the sky shows something"
        );
    }
}

#[test]
fn far_from_the_origin_it_is_the_same_picture() {
    let mut scene = wall(checker(16, 2));
    let (here, _) = drawn(&scene, &front(2.5), Method::Hybrid);
    // f32 positions of 2^24 and more are even numbers: the wall's corners, scaled by 1024, stay exact at 2^23.
    let offset = 8_388_608.0f32;
    for position in &mut scene.meshes[0].positions {
        *position = position.map(|v| v * 1024.0 + offset);
    }
    let centre = DVec3::splat(f64::from(offset));
    let camera = looking_camera(centre + DVec3::Z * 2560.0, centre, 50.0, [48, 48]);
    let (there, _) = drawn(&scene, &camera, Method::Hybrid);
    let worst = here
        .rgba
        .iter()
        .zip(&there.rgba)
        .flat_map(|(a, b)| (0..4).map(move |k| (a[k] - b[k]).abs()));
    let worst = worst.fold(0.0, f32::max);
    assert!(
        worst < 2e-3,
        "the picture changes by {worst} far from the origin"
    );
}

#[test]
fn the_cost_follows_the_pixels_not_the_repeats() {
    let camera = looking_camera(
        DVec3::new(0.0, 1.0, 2.0),
        DVec3::new(0.0, 0.6, 0.0),
        60.0,
        [128, 96],
    );
    let touched = |repeats: f32| {
        let (_, stats) = drawn(
            &ground(checker(256, 16), 60.0, repeats),
            &camera,
            Method::Hybrid,
        );
        (stats.points + stats.splats) as f64
    };
    let [ten, hundred, thousand] = [10.0, 100.0, 1000.0].map(touched);
    println!("texels touched: {ten:.0}, {hundred:.0}, {thousand:.0}");
    assert!(
        hundred < 3.0 * ten && thousand < 3.0 * ten,
        "{ten}, {hundred}, {thousand} texels"
    );
}

#[test]
fn what_is_not_seen_is_dropped_before_any_texel() {
    let mut scene = wall(checker(512, 1));
    scene.materials[0].sides = Sides::Front;
    let away = looking_camera(
        DVec3::new(0.0, 0.0, 2.5),
        DVec3::new(0.0, 0.0, 5.0),
        50.0,
        [48, 48],
    );
    let behind = looking_camera(DVec3::new(0.0, 0.0, -2.5), DVec3::ZERO, 50.0, [48, 48]);
    for camera in [away, behind] {
        let (_, stats) = drawn(&scene, &camera, Method::Hybrid);
        assert_eq!(
            (stats.points, stats.splats, stats.drawn),
            (0, 0, 0),
            "{stats:?}"
        );
    }
}
