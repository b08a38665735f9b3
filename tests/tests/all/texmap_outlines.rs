//! Outlines: an edge covers as much of a pixel as the pixel's Gaussian says, and real meshes are as near to brute force
//! as one with 4 x 4 samples a pixel.

use glam::{DVec2, DVec3};
use resample_core::metrics::{Mask, compare};
use resample_core::{Camera, Image, LookAt};
use resample_tests::meshes::mesh_views::MESH_VIEWS;
use resample_tests::meshes::textured::{material, quad, quad_scene, texture};
use resample_tests::meshes::textures::reference_picture;
use texmap::scene::{Mesh, Wrap};
use texmap::{Method, RenderOptions, Renderer, Scene};

/// Side of the pictures of edges, px; a world unit is a pixel.
const SIDE_PX: u32 = 48;

fn rendered(scene: &Scene, camera: &Camera, options: &RenderOptions) -> Image {
    let mut renderer = Renderer::new(scene, options).expect("options within their ranges");
    renderer.render(camera).expect("a valid camera").image
}

/// Parallel rays, the origin in the middle, y up.
fn pixel_camera() -> Camera {
    let pose = LookAt {
        position: DVec3::new(0.0, 0.0, 100.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    Camera::orthographic(&pose, f64::from(SIDE_PX), [SIDE_PX; 2]).expect("a valid camera")
}

/// A white half-plane on the left of the line through the middle at `angle_rad`, moved by `shift_px` to its right.
fn half_plane(angle_rad: f64, shift_px: f64) -> Scene {
    let (along, right) = (
        DVec2::from_angle(angle_rad),
        DVec2::from_angle(angle_rad).perp() * -1.0,
    );
    let corner = |a: f64, r: f64| {
        let p = along * a + right * (r + shift_px);
        [p.x as f32, p.y as f32, 0.0]
    };
    let corners = [
        corner(-90.0, 0.0),
        corner(90.0, 0.0),
        corner(90.0, -90.0),
        corner(-90.0, -90.0),
    ];
    quad_scene(
        corners,
        [[0.5; 2]; 4],
        texture([2, 2], |_, _| [1.0; 4]),
        Wrap::Clamp,
    )
}

/// Integral of the pixel's Gaussian (sigma 0.5 px) up to `distance_px` beyond its middle.
fn gaussian_integral(distance_px: f64) -> f64 {
    0.5 * libm::erfc(-std::f64::consts::SQRT_2 * distance_px)
}

/// The greatest error of coverage along straight edges of many directions.
fn worst_coverage(options: &RenderOptions) -> f64 {
    let edges = (0..60).map(|k| {
        let angle_rad = std::f64::consts::TAU * f64::from(k) / 60.0;
        (angle_rad, 0.37 * f64::from(k % 7) - 1.0)
    });
    worst_coverage_along(edges, options)
}

/// The same along edges given by their direction and how far they lie beyond the middle of the picture, px.
fn worst_coverage_along(edges: impl Iterator<Item = (f64, f64)>, options: &RenderOptions) -> f64 {
    let camera = pixel_camera();
    let mut worst = 0.0f64;
    for (angle_rad, shift_px) in edges {
        let image = rendered(&half_plane(angle_rad, shift_px), &camera, options);
        let right = -DVec2::from_angle(angle_rad).perp();
        for (index, pixel) in image.rgba.iter().enumerate() {
            let half = 0.5 * f64::from(SIDE_PX);
            let at = DVec2::new(
                (index % image.width) as f64 + 0.5 - half,
                half - (index / image.width) as f64 - 0.5,
            );
            let expected = gaussian_integral(shift_px - at.dot(right));
            worst = worst.max((f64::from(pixel[3]) - expected).abs());
        }
    }
    worst
}

#[test]
fn edges_through_subpixels_cover_what_the_gaussian_says() {
    // A sub-pixel of the lattice of 17 within the pixel to the right of and below the picture's middle.
    let node = |row: u32| {
        let place = |k: u32| (f64::from(k % 17) + 0.5) / 17.0;
        DVec2::new(place(4 * row), -place(row))
    };
    let edges = (0..240).map(|k| {
        let angle_rad = std::f64::consts::TAU * f64::from(k) / 240.0;
        let right = -DVec2::from_angle(angle_rad).perp();
        (angle_rad, node(k).dot(right))
    });
    let worst = worst_coverage_along(edges, &RenderOptions::default());
    assert!(worst < 2e-3, "coverage is off by {worst}");
}

#[test]
fn straight_edges_cover_what_the_gaussian_says() {
    // The Gaussian is cut at four standard deviations, which alone is 3e-4. One and two sub-pixels a side are too few
    // for the Gaussian itself.
    for (subpixels, most) in [(1, 0.06), (2, 0.012), (3, 5e-3), (4, 2e-3), (8, 1e-3)] {
        let worst = worst_coverage(&RenderOptions {
            subpixels,
            ..RenderOptions::default()
        });
        println!("{subpixels} sub-pixels a side: coverage is off by up to {worst:.5}");
        assert!(
            worst < most,
            "{subpixels} sub-pixels: coverage is off by {worst}, expected {most} at most"
        );
    }
    // Backward methods share the outlines.
    let worst = worst_coverage(&RenderOptions {
        method: Method::BackwardEwa,
        ..RenderOptions::default()
    });
    assert!(worst < 2e-3, "backward-ewa: coverage is off by {worst}");
}

/// Red in front of blue behind, whose common edge at x = 0.3 is made in one of three ways.
fn parted(how: &str) -> Scene {
    let square = |x: [f32; 2], z: [f32; 2]| {
        [
            [x[0], -90.0, z[0]],
            [x[1], -90.0, z[1]],
            [x[1], 90.0, z[1]],
            [x[0], 90.0, z[0]],
        ]
    };
    let (left, right) = match how {
        "one ends before the other" => (
            square([-90.0, 0.3], [1.0; 2]),
            square([-90.0, 90.0], [0.0; 2]),
        ),
        "both end" => (
            square([-90.0, 0.3], [0.0; 2]),
            square([0.3, 90.0], [0.0; 2]),
        ),
        // One slants through the other; the second ends half a pixel behind the first.
        _ => (
            square([-90.0, 90.0], [0.0; 2]),
            square([-0.2, 89.8], [-1.0, 179.0]),
        ),
    };
    let mut scene = Scene::default();
    for (corners, colour) in [(left, [1.0, 0.0, 0.0, 1.0]), (right, [0.0, 0.0, 1.0, 1.0])] {
        let mut made = material(None);
        made.base_colour = colour;
        scene
            .meshes
            .push(quad(corners, [[0.0; 2]; 4], scene.materials.len()));
        scene.materials.push(made);
    }
    scene
}

#[test]
fn edges_between_surfaces_are_where_they_meet() {
    // The slanted one rises by 2 a pixel from -1 at -0.2: it meets the other at 0.3.
    for how in [
        "one ends before the other",
        "both end",
        "one slants through the other",
    ] {
        let image = rendered(&parted(how), &pixel_camera(), &RenderOptions::default());
        for x in 20..28 {
            let red = gaussian_integral(0.3 - (x as f64 + 0.5 - 24.0));
            let [r, _, b, a] = image.pixel(x, 20);
            assert!(
                (a - 1.0).abs() < 1e-5,
                "{how}: column {x} is not filled: {a}"
            );
            let error = (f64::from(r) - red)
                .abs()
                .max((f64::from(b) - (1.0 - red)).abs());
            assert!(
                error < 2e-3,
                "{how}: column {x} is {r} red and {b} blue, expected {red} red"
            );
        }
    }
}

#[test]
fn slivers_at_an_outline_do_not_hide_it() {
    // A fan whose outermost triangles are a fiftieth of a pixel wide: the outline is that of the whole.
    let mut mesh = Mesh::default();
    let widths = [-90.0f32, 0.0, 0.1, 0.12, 0.14, 0.16];
    for (k, x) in widths.into_iter().enumerate() {
        mesh.positions.extend([[x, -90.0, 0.0], [x, 90.0, 0.0]]);
        let first = 2 * k as u32;
        if k > 0 {
            mesh.triangles.extend([
                [first - 2, first, first + 1],
                [first - 2, first + 1, first - 1],
            ]);
        }
    }
    let scene = Scene {
        meshes: vec![mesh],
        materials: vec![material(None)],
        ..Scene::default()
    };
    let image = rendered(&scene, &pixel_camera(), &RenderOptions::default());
    for x in 20..28 {
        let expected = gaussian_integral(0.16 - (x as f64 + 0.5 - 24.0));
        let error = (f64::from(image.pixel(x, 20)[3]) - expected).abs();
        assert!(
            error < 2e-3,
            "column {x} is covered by {}, expected {expected}",
            image.pixel(x, 20)[3]
        );
    }
}

#[test]
fn real_meshes_reach_four_by_four_samples() {
    for view in MESH_VIEWS {
        let Some(scene) = view.scene("real_meshes_reach_four_by_four_samples") else {
            continue;
        };
        let camera = view.camera(&scene, 96);
        let truth = reference_picture(&scene, &camera, 20).over_background([0.5; 3]);
        let covered: Vec<bool> = reference_picture(&scene, &camera, 4)
            .rgba
            .iter()
            .map(|pixel| pixel[3] > 1.0 / 255.0)
            .collect();
        let mask = Mask::new(truth.width, truth.height, covered).expect("one flag a pixel");
        let psnr_db = |image: Image| {
            compare(&image.over_background([0.5; 3]), &truth, Some(&mask))
                .expect("one size")
                .psnr_db
        };
        let sampled = psnr_db(reference_picture(&scene, &camera, 4));
        let hybrid = psnr_db(rendered(&scene, &camera, &RenderOptions::default()));
        println!(
            "{}: hybrid {hybrid:.1} dB, 4 x 4 samples {sampled:.1} dB",
            view.name
        );
        assert!(
            hybrid >= sampled,
            "{}: hybrid {hybrid:.1} dB, 4 x 4 samples {sampled:.1} dB",
            view.name
        );
    }
}
