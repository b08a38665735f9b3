//! Texels across a seam, a wrap border or behind a surface do not leak; triangles of one surface leave no line.

use glam::DVec3;
use resample_core::{Camera, Image};
use resample_tests::meshes::texture_scenes::looking_camera;
use resample_tests::meshes::textured::{material, quad, quad_scene, texture, texture_use, wall};
use resample_tests::meshes::textures::reference_picture;
use texmap::scene::{Mesh, Wrap};
use texmap::{RenderOptions, Renderer, Scene};

const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 1.0];

fn rendered(scene: &Scene, camera: &Camera) -> Image {
    let mut renderer = Renderer::new(scene, &RenderOptions::default()).expect("default options");
    renderer.render(camera).expect("a valid camera").image
}

fn front(size: u32, distance: f64) -> Camera {
    looking_camera(
        DVec3::new(0.0, 0.0, distance),
        DVec3::ZERO,
        50.0,
        [size, size],
    )
}

/// Most blue in any pixel, as a share of its coverage.
fn most_blue(image: &Image) -> f32 {
    image
        .rgba
        .iter()
        .filter(|p| p[3] > 0.05)
        .map(|p| p[2] / p[3])
        .fold(0.0, f32::max)
}

const SQUARE: [[f32; 3]; 4] = [
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
];

#[test]
fn the_other_half_of_an_atlas_does_not_leak() {
    // The wall shows the red half only, up to half a texel from the blue one, as atlases are made.
    let cases = [
        (16usize, 2.5, 1e-3),
        (64, 4.0, 1e-3),
        (256, 4.0, 1e-3),
        (1024, 6.0, 1e-3),
        (1024, 20.0, 1e-3),
        (1024, 60.0, 0.02),
    ];
    for (side, distance, least) in cases {
        let halves = texture([side, side], |x, _| if 2 * x < side { RED } else { BLUE });
        let end = 0.5 - 0.5 / side as f32;
        let uvs = [[0.0, 1.0], [end, 1.0], [end, 0.0], [0.0, 0.0]];
        let scene = quad_scene(SQUARE, uvs, halves, Wrap::Clamp);
        for camera in [front(64, distance), slanted(64, distance)] {
            let (ours, truth) = (
                most_blue(&rendered(&scene, &camera)),
                most_blue(&reference_picture(&scene, &camera, 8)),
            );
            println!("{side} texels at {distance}: blue {ours:.4}, truth {truth:.4}");
            assert!(
                ours <= truth + least,
                "{side} texels at {distance}: blue leaks by {ours}, in the truth {truth}"
            );
        }
    }
}

/// From far to the side, so that texels are much smaller along one axis.
fn slanted(size: u32, distance: f64) -> Camera {
    let eye = distance * DVec3::new(0.9, 0.35, 0.3).normalize();
    looking_camera(eye, DVec3::ZERO, 50.0, [size, size])
}

#[test]
fn charts_that_meet_on_a_surface_take_nothing_from_their_neighbours_in_the_atlas() {
    // An atlas of four columns: red, blue, red, blue. A wall shows the first and, beside it, the third, each up to half
    // a texel from its borders; its two halves share the edge in the middle.
    for (side, distance) in [(64usize, 3.0), (512, 5.0), (1024, 8.0), (1024, 25.0)] {
        let columns = texture([side, side], |x, _| {
            if (4 * x / side) % 2 == 0 { RED } else { BLUE }
        });
        let half = 0.5 / side as f32;
        let chart = |left: f32| [left + half, left + 0.25 - half];
        let ([a, b], [c, d]) = (chart(0.0), chart(0.5));
        let mut scene = quad_scene(SQUARE, [[0.0; 2]; 4], columns, Wrap::Repeat);
        let piece = |x: [f32; 2], u: [f32; 2]| {
            let corners = [
                [x[0], -1.0, 0.0],
                [x[1], -1.0, 0.0],
                [x[1], 1.0, 0.0],
                [x[0], 1.0, 0.0],
            ];
            quad(
                corners,
                [[u[0], 1.0], [u[1], 1.0], [u[1], 0.0], [u[0], 0.0]],
                0,
            )
        };
        let (mut left, right) = (piece([-1.0, 0.0], [a, b]), piece([0.0, 1.0], [c, d]));
        left.positions.extend(&right.positions);
        left.uvs[0].extend(&right.uvs[0]);
        left.triangles.extend(
            right
                .triangles
                .iter()
                .map(|corners| corners.map(|corner| corner + 4)),
        );
        scene.meshes = vec![left];
        for camera in [front(64, distance), slanted(64, distance)] {
            let blue = most_blue(&rendered(&scene, &camera));
            println!("{side} texels at {distance}: blue {blue:.5}");
            assert!(
                blue < 1e-3,
                "{side} texels at {distance}: the atlas's neighbours leak by {blue}"
            );
        }
    }
}

#[test]
fn a_wrap_border_follows_the_wrap_mode() {
    // Red on the left, blue on the right: repeated, the left border's neighbour is blue; clamped or mirrored, red.
    for (side, distance) in [(64usize, 3.0), (64, 9.0), (512, 6.0), (512, 20.0)] {
        let halves = || texture([side, side], |x, _| if 2 * x < side { RED } else { BLUE });
        let uvs = [[0.0, 1.0], [0.4, 1.0], [0.4, 0.0], [0.0, 0.0]];
        for wrap in [Wrap::Clamp, Wrap::Mirror, Wrap::Repeat] {
            let scene = quad_scene(SQUARE, uvs, halves(), wrap);
            let camera = front(48, distance);
            // Enough rays to meet single texels.
            let (image, truth) = (
                rendered(&scene, &camera),
                reference_picture(&scene, &camera, 24),
            );
            let worst = image
                .rgba
                .iter()
                .zip(&truth.rgba)
                .map(|(a, b)| (a[2] - b[2]).abs())
                .fold(0.0, f32::max);
            println!("{side} texels at {distance}, {wrap:?}: worst difference in blue {worst:.4}");
            assert!(
                worst < 0.01,
                "{side} texels at {distance}, {wrap:?}: blue differs from the truth by {worst}"
            );
        }
    }
}

#[test]
fn triangles_of_one_surface_leave_no_line() {
    // A wall of 2 x 20 x 20 triangles in one colour: every pixel inside has it exactly.
    let n = 20u32;
    let mut mesh = Mesh {
        uvs: vec![Vec::new()],
        ..Mesh::default()
    };
    for j in 0..=n {
        for i in 0..=n {
            let (s, t) = (i as f32 / n as f32, j as f32 / n as f32);
            mesh.positions
                .push([2.0 * s - 1.0, 2.0 * t - 1.0, 0.3 * (7.0 * s).sin()]);
            mesh.uvs[0].push([s, t]);
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            mesh.triangles.push([a, a + 1, a + n + 2]);
            mesh.triangles.push([a, a + n + 2, a + n + 1]);
        }
    }
    let colour = texture([256, 256], |_, _| [0.25, 0.5, 0.75, 1.0]);
    let scene = Scene {
        origin_in_world: DVec3::ZERO,
        meshes: vec![mesh],
        materials: vec![material(Some(texture_use(Wrap::Clamp)))],
        textures: vec![colour],
        ..Scene::default()
    };
    let image = rendered(&scene, &front(100, 2.6));
    let inside = (30..70).flat_map(|y| (30..70).map(move |x| (x, y)));
    for (x, y) in inside {
        let pixel = image.pixel(x, y);
        for (channel, expected) in pixel.iter().zip([0.25, 0.5, 0.75, 1.0]) {
            assert!(
                (channel - expected).abs() < 1e-4,
                "pixel ({x}, {y}) is {pixel:?}"
            );
        }
    }
}

#[test]
fn a_wall_behind_does_not_bleed_through_a_thin_one() {
    let red = texture([4, 4], |_, _| RED);
    let blue = texture([4, 4], |_, _| BLUE);
    let mut scene = wall(red);
    let uvs = [[0.0; 2]; 4];
    for gap in [1e-2f32, 1e-4, 1e-5] {
        let behind = SQUARE.map(|[x, y, _]| [x, y, -gap]);
        scene.meshes.truncate(1);
        scene.meshes.push(quad(behind, uvs, 1));
        scene.textures.truncate(1);
        scene.textures.push(blue.clone());
        let mut second = texture_use(Wrap::Clamp);
        second.texture = 1;
        scene.materials.truncate(1);
        scene.materials.push(material(Some(second)));
        // Slanted, so that depth changes by far more than the gap within a pixel.
        let camera = looking_camera(DVec3::new(2.0, 0.5, 1.0), DVec3::ZERO, 50.0, [80, 80]);
        let image = rendered(&scene, &camera);
        let inside = |p: &&[f32; 4]| p[3] > 0.9999;
        let worst = image
            .rgba
            .iter()
            .filter(inside)
            .map(|p| p[2])
            .fold(0.0, f32::max);
        // The far wall's own outline shows by less than the gap's projection.
        assert!(
            worst <= 1e-2 + 100.0 * gap,
            "gap {gap}: the wall behind shows {worst}"
        );
    }
}

#[test]
fn of_two_walls_in_one_plane_the_first_is_seen() {
    let mut scene = wall(texture([4, 4], |_, _| RED));
    scene.textures.push(texture([4, 4], |_, _| BLUE));
    let mut second = texture_use(Wrap::Clamp);
    second.texture = 1;
    scene.materials.push(material(Some(second)));
    scene.meshes.push(quad(SQUARE, [[0.0; 2]; 4], 1));
    let image = rendered(&scene, &front(40, 2.5));
    assert!(
        most_blue(&image) < 1e-6,
        "the second wall shows {}",
        most_blue(&image)
    );
}
