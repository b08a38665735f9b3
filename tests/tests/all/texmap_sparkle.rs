//! Bumps under a small bright light, still and moving: filtered before light, with their variance, they sparkle no more than their truth.
//!
//! A look-up filters normals, makes them one long again and then lights them: of what a pixel covers it shows one highlight or none, and it flashes from
//! frame to frame. The truth is 32x32 lit samples a pixel.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::Camera;
use resample_tests::meshes::surroundings::{Reflector, of_small_light};
use resample_tests::meshes::textured::{quad, texture_use};
use texmap::scene::{Physical, Wrap};
use texmap::{Method, RenderOptions, Renderer, Scene};

use crate::texmap_light::{bilinear, bumps, lit, mean};
use crate::texmap_sun::sky_with;

/// Texels along the normal map, and how often it repeats over 16 units.
const SIDE: usize = 128;
const REPEATS: f32 = 8.0;

const SIZE: u32 = 16;
const FRAMES: usize = 60;

/// Radius of the light, and its radiance times solid angle: highlights of the bumps are about white.
const RADIUS: f64 = 0.009;
const POWER: f64 = 0.6;

fn surface(roughness: f64) -> Reflector {
    Reflector {
        base: DVec3::new(0.9, 0.7, 0.4),
        metal: 1.0,
        roughness,
    }
}

fn scene(roughness: f64, sun: DVec3) -> (Scene, Vec<DVec3>) {
    let (normal_map, normals) = bumps(SIDE);
    let physical = Physical {
        metal: 1.0,
        roughness: roughness as f32,
        normal_texture: Some(texture_use(Wrap::Repeat)),
        ..Physical::default()
    };
    let corners = [
        [-8.0, -8.0, 0.0],
        [8.0, -8.0, 0.0],
        [8.0, 8.0, 0.0],
        [-8.0, 8.0, 0.0],
    ];
    let uvs = [[0.0, REPEATS], [REPEATS; 2], [REPEATS, 0.0], [0.0; 2]];
    let mut sky = sky_with((sun, RADIUS), 0.0);
    for part in sky.rgb.iter_mut().flatten() {
        *part *= POWER as f32;
    }
    let scene = Scene {
        meshes: vec![quad(corners, uvs, 0)],
        materials: vec![lit([0.9, 0.7, 0.4, 1.0], physical)],
        textures: vec![normal_map],
        surroundings: Some(Arc::new(sky)),
        ..Scene::default()
    };
    (scene, normals)
}

/// Parallel rays along `-eye` that move by a third of a pixel from frame to frame, not along the grid.
fn camera(eye: DVec3, height: f64, frame: usize) -> Camera {
    let px = height / f64::from(SIZE);
    let away = DVec3::new(0.31, 0.13, 0.0) * (px * frame as f64);
    let pose = resample_core::LookAt {
        position: eye * 50.0 + away,
        target: away,
        up: DVec3::Y,
    };
    Camera::orthographic(&pose, height, [SIZE; 2]).expect("a pose with a direction")
}

/// The red of every pixel and frame, up to white.
type Film = Vec<Vec<f64>>;

fn film(scene: &Scene, method: Method, cameras: &[Camera]) -> Film {
    let options = RenderOptions {
        method,
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(scene, &options).expect("good options");
    let frame = |camera| {
        let image = renderer.render(camera).expect("a valid camera").image;
        image
            .rgba
            .iter()
            .map(|pixel| f64::from(pixel[0]).min(1.0))
            .collect()
    };
    cameras.iter().map(frame).collect()
}

fn true_film(
    roughness: f64,
    (sun, eye): (DVec3, DVec3),
    normals: &[DVec3],
    cameras: &[Camera],
) -> Film {
    let surface = surface(roughness);
    let pixel = |camera: &Camera, at: u32| {
        let seen = |p: DVec3| {
            let uv = DVec2::new(p.x + 8.0, 8.0 - p.y) * (SIDE as f64 / 2.0);
            of_small_light(&surface, (bilinear(normals, SIDE, uv), eye), sun) * POWER
        };
        mean(camera, [at % SIZE, at / SIZE], &seen).x.min(1.0)
    };
    let frame = |camera| {
        (0..SIZE * SIZE)
            .into_par_iter()
            .map(|at| pixel(camera, at))
            .collect()
    };
    cameras.iter().map(frame).collect()
}

/// The mean, over pixels, of the difference from a frame to the next.
fn sparkle(film: &Film) -> f64 {
    let steps = film
        .windows(2)
        .flat_map(|pair| pair[0].iter().zip(&pair[1]));
    let (sum, count) = steps.fold((0.0, 0), |(sum, count), (a, b)| {
        (sum + (a - b).abs(), count + 1)
    });
    sum / f64::from(count)
}

fn psnr_db(film: &Film, truth: &Film) -> f64 {
    let pairs = film.iter().flatten().zip(truth.iter().flatten());
    let (sum, count) = pairs.fold((0.0, 0), |(sum, count), (a, b)| {
        (sum + (a - b).powi(2), count + 1)
    });
    -10.0 * (sum / f64::from(count)).log10()
}

#[test]
fn glossy_bumps_sparkle_no_more_than_their_truth() {
    let eye = DVec3::new(0.35, 0.25, 0.8).normalize();
    let sun = DVec3::new(-0.2, 0.3, 0.9).normalize();
    for roughness in [0.2, 0.4] {
        let (scene, normals) = scene(roughness, sun);
        for texels_per_px in [1.0, 2.0, 4.0] {
            let height = f64::from(SIZE) * texels_per_px * 2.0 / SIDE as f64;
            let cameras: Vec<_> = (0..FRAMES)
                .map(|frame| camera(eye, height, frame))
                .collect();
            let truth = true_film(roughness, (sun, eye), &normals, &cameras);
            let [ours, looked_up] = [Method::Hybrid, Method::BackwardTrilinear]
                .map(|method| film(&scene, method, &cameras));
            println!(
                "roughness {roughness}, {texels_per_px} texels a pixel: {:.1} dB, looked up {:.1}; sparkle {:.4} of {:.4}, looked up {:.4}",
                psnr_db(&ours, &truth),
                psnr_db(&looked_up, &truth),
                sparkle(&ours),
                sparkle(&truth),
                sparkle(&looked_up),
            );
            assert!(psnr_db(&ours, &truth) > psnr_db(&looked_up, &truth));
            // Lobes of 0.2 are narrower than the bumps of neighbouring sub-pixels are apart: they sparkle up to three levels more.
            let levels = if roughness > 0.3 { 1.0 } else { 3.0 };
            assert!(sparkle(&ours) < sparkle(&truth) + levels / 255.0);
        }
    }
}
