//! Alpha of surfaces: ignored, cut off, and blended in depth order.

use glam::DVec3;
use resample_core::{Camera, Image};
use resample_tests::meshes::texture_scenes::looking_camera;
use resample_tests::meshes::textured::{material, quad, texture, wall};
use texmap::scene::{AlphaMode, Mesh, Sides};
use texmap::{PlaneKind, RenderOptions, Renderer, Scene};

fn rendered(scene: &Scene, camera: &Camera) -> Image {
    let planes = vec![PlaneKind::Depth, PlaneKind::Coverage, PlaneKind::Normal];
    let options = RenderOptions {
        planes,
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(scene, &options).expect("options within their ranges");
    renderer.render(camera).expect("a valid camera").image
}

fn front() -> Camera {
    looking_camera(DVec3::new(0.0, 0.0, 2.5), DVec3::ZERO, 60.0, [41, 41])
}

fn near(got: [f32; 4], expected: [f32; 4], what: &str) {
    let error = got
        .iter()
        .zip(expected)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f32::max);
    assert!(error < 1e-4, "{what}: {got:?}, expected {expected:?}");
}

#[test]
fn opaque_surfaces_ignore_alpha() {
    let scene = wall(texture([2, 2], |_, _| [0.2, 0.4, 0.6, 0.0]));
    near(
        rendered(&scene, &front()).pixel(20, 20),
        [0.2, 0.4, 0.6, 1.0],
        "opaque",
    );
}

#[test]
fn a_mask_cuts_where_alpha_falls_below_the_cutoff() {
    // Alpha rises from 0 on the left to 1 on the right; the cutoff 0.5 lies in the middle.
    let mut scene = wall(texture([64, 4], |x, _| {
        [1.0, 1.0, 1.0, (x as f32 + 0.5) / 64.0]
    }));
    scene.materials[0].alpha = AlphaMode::Mask { cutoff: 0.5 };
    let image = rendered(&scene, &front());
    near(image.pixel(13, 20), [0.0; 4], "left of the cutoff");
    near(image.pixel(27, 20), [1.0; 4], "right of the cutoff");
    let edge = image.pixel(20, 20)[3];
    assert!(
        (0.3..0.7).contains(&edge),
        "the cut is not antialiased: {edge}"
    );
}

/// Two half-transparent panes, red at z = 0.5 and green at z = -0.5, before an opaque blue wall at z = -1.
fn panes(order: [usize; 3]) -> Scene {
    let at = |z: f32| {
        [
            [-3.0, -3.0, z],
            [3.0, -3.0, z],
            [3.0, 3.0, z],
            [-3.0, 3.0, z],
        ]
    };
    let colours = [
        [1.0, 0.0, 0.0, 0.5],
        [0.0, 1.0, 0.0, 0.25],
        [0.0, 0.0, 1.0, 1.0],
    ];
    let mut scene = Scene::default();
    for (k, colour) in colours.into_iter().enumerate() {
        let mut made = material(None);
        made.base_colour = colour;
        made.alpha = if k < 2 {
            AlphaMode::Blend
        } else {
            AlphaMode::Opaque
        };
        scene.materials.push(made);
    }
    scene.meshes = order
        .map(|k| quad(at([0.5, -0.5, -1.0][k]), [[0.0; 2]; 4], k))
        .to_vec();
    scene
}

#[test]
fn panes_blend_in_depth_order_whatever_their_order_in_the_file() {
    // Red over green over blue: 0.5 red, 0.5 * 0.25 green, 0.5 * 0.75 blue.
    for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
        let image = rendered(&panes(order), &front());
        near(
            image.pixel(20, 20),
            [0.5, 0.125, 0.375, 1.0],
            &format!("order {order:?}"),
        );
        let depth = image.depth.as_ref().expect("depth was asked for")[20 * 41 + 20];
        assert!(
            (depth - 2.0).abs() < 1e-3,
            "the nearest pane stands at 2, not {depth}"
        );
    }
}

#[test]
fn a_pane_alone_is_premultiplied() {
    let mut scene = panes([0, 1, 2]);
    scene.meshes = vec![scene.meshes[0].clone()];
    near(
        rendered(&scene, &front()).pixel(20, 20),
        [0.5, 0.0, 0.0, 0.5],
        "one pane",
    );
}

#[test]
fn one_sided_surfaces_are_seen_from_the_front_alone() {
    let mut scene = wall(texture([2, 2], |_, _| [1.0; 4]));
    scene.materials[0].sides = Sides::Front;
    assert!(
        rendered(&scene, &front()).pixel(20, 20)[3] > 0.99,
        "the front is not seen"
    );
    let behind = looking_camera(DVec3::new(0.0, 0.0, -2.5), DVec3::ZERO, 60.0, [41, 41]);
    assert_eq!(
        rendered(&scene, &behind).pixel(20, 20)[3],
        0.0,
        "the back is seen"
    );
}

#[test]
fn vertex_colours_and_the_headlight_multiply_the_texture() {
    let mut scene = wall(texture([2, 2], |_, _| [0.5, 0.5, 0.5, 1.0]));
    let mesh: &mut Mesh = &mut scene.meshes[0];
    mesh.colours = vec![[1.0, 0.5, 0.25, 1.0]; 4];
    near(
        rendered(&scene, &front()).pixel(20, 20),
        [0.5, 0.25, 0.125, 1.0],
        "vertex colours",
    );
    scene.materials[0].lighting = texmap::scene::Lighting::Lit;
    let image = rendered(&scene, &front());
    // The middle of the wall faces the light.
    near(
        image.pixel(20, 20),
        [0.5, 0.25, 0.125, 1.0],
        "headlight in the middle",
    );
    assert!(
        image.pixel(36, 20)[0] < 0.499,
        "the light does not fall off to the side"
    );
    let plane = |name: &str| {
        image
            .planes
            .iter()
            .find(|p| p.name == name)
            .expect("a plane")
            .values[20 * 41 + 20]
    };
    assert!(
        (plane("normal.Z") - 1.0).abs() < 1e-4,
        "the normal is {}",
        plane("normal.Z")
    );
    assert!(
        (plane("coverage") - 1.0).abs() < 1e-4,
        "coverage is {}",
        plane("coverage")
    );
}
