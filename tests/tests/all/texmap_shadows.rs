//! Light that meshes block from themselves: held to the sum over every direction that nothing blocks, and to closed forms.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, Image};
use resample_tests::meshes::shadows::{Body, Shape, bumpy_ball, first_met, lit, scene};
use resample_tests::meshes::surroundings::{Reflector, lamps, radiance};
use resample_tests::volumes::scenes::perspective;
use texmap::scene::Surroundings;
use texmap::{RenderOptions, Renderer, Scene, Shadows};

const SIZE: u32 = 320;

/// Directions of each sum.
const DIRECTIONS: usize = 4096;

fn surface(base: DVec3, metal: f64, roughness: f64) -> Reflector {
    Reflector {
        base,
        metal,
        roughness,
    }
}

fn white() -> Reflector {
    surface(DVec3::ONE, 0.0, 1.0)
}

fn body(shape: Shape, surface: Reflector) -> Body {
    Body { shape, surface }
}

fn plate() -> Shape {
    Shape::Block(DVec3::new(-3.0, -1.3, -3.0), DVec3::new(3.0, -1.0, 3.0))
}

/// A ball that lies on a plate.
fn ball_on_plate(surface: Reflector) -> Vec<Body> {
    vec![
        body(plate(), white()),
        body(Shape::Ball(DVec3::ZERO, 1.0), surface),
    ]
}

/// Fins that stand on a plate, a seventh of a unit thick.
fn fins() -> Vec<Body> {
    let mut bodies = vec![body(plate(), white())];
    for k in 0..6 {
        let x = -1.75 + 0.6 * f64::from(k);
        let shape = Shape::Block(DVec3::new(x, -1.0, -1.4), DVec3::new(x + 0.15, 0.3, 1.4));
        bodies.push(body(shape, white()));
    }
    bodies
}

/// Three balls of metal and lacquer, which mirror one another.
fn three_balls() -> Vec<Body> {
    let ball = |x: f64, z: f64, surface| body(Shape::Ball(DVec3::new(x, -0.3, z), 0.7), surface);
    vec![
        body(plate(), white()),
        ball(-0.8, 0.3, surface(DVec3::new(0.9, 0.7, 0.4), 1.0, 0.4)),
        ball(0.75, 0.4, surface(DVec3::new(0.2, 0.4, 0.8), 0.0, 0.3)),
        ball(0.0, -0.9, surface(DVec3::splat(0.9), 1.0, 0.7)),
    ]
}

/// A corner of two walls and a floor.
fn corner() -> Vec<Body> {
    let wall = |low: [f64; 3], high: [f64; 3]| body(Shape::Block(low.into(), high.into()), white());
    vec![
        wall([-1.5, -1.3, -1.5], [1.5, -1.0, 1.5]),
        wall([-1.8, -1.3, -1.5], [-1.5, 1.0, 1.5]),
        wall([-1.5, -1.0, -1.8], [1.5, 1.0, -1.5]),
    ]
}

fn camera() -> Camera {
    perspective(
        DVec3::new(3.2, 2.4, 4.4),
        DVec3::new(0.0, -0.4, 0.0),
        38.0,
        [SIZE; 2],
    )
}

fn drawn(scene: &Scene, shadows: Shadows, camera: &Camera) -> Image {
    let options = RenderOptions {
        shadows,
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(scene, &options).expect("good options");
    renderer.render(camera).expect("a valid camera").image
}

/// The ray through the centre of a pixel, in the world.
fn ray(camera: &Camera, [x, y]: [u32; 2]) -> (DVec3, DVec3) {
    let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
    let (from, towards) = camera.ray_in_camera(at);
    let back = camera.camera_from_world.inverse();
    (
        back.transform_point3(from),
        back.transform_vector3(towards).normalize(),
    )
}

/// Returns true if all rays around a pixel's centre meet one side of one body: outlines are other tests'.
fn is_within(bodies: &[Body], camera: &Camera, [x, y]: [u32; 2]) -> bool {
    let met = |[x, y]: [u32; 2]| {
        let (from, towards) = ray(camera, [x, y]);
        first_met(bodies, from, towards)
    };
    let Some(own) = met([x, y]) else { return false };
    [[x - 3, y], [x + 3, y], [x, y - 3], [x, y + 3]]
        .into_iter()
        .all(|at| {
            met(at).is_some_and(|met| met.body == own.body && met.normal.dot(own.normal) > 0.5)
        })
}

/// Distance of a picture from the truth, of 1, dB, and that of a picture without shadows.
fn from_truth(bodies: &[Body], surroundings: &Surroundings) -> [f64; 2] {
    let mut scene = scene(bodies);
    scene.surroundings = Some(Arc::new(surroundings.clone()));
    let camera = camera();
    let images = [Shadows::Mesh, Shadows::None].map(|shadows| drawn(&scene, shadows, &camera));
    let pixels: Vec<[u32; 2]> = (0..SIZE / 5 * (SIZE / 5))
        .map(|k| [5 * (k % (SIZE / 5)), 5 * (k / (SIZE / 5))])
        .filter(|[x, y]| *x >= 5 && *y >= 5 && is_within(bodies, &camera, [*x, *y]))
        .collect();
    let errors: Vec<[f64; 2]> = pixels
        .par_iter()
        .map(|&[x, y]| {
            let light = |direction| radiance(surroundings, direction);
            let truth = lit(bodies, ray(&camera, [x, y]), light, DIRECTIONS).expect("a body");
            [0, 1].map(|k: usize| {
                let [r, g, b, _] = images[k].pixel(x as usize, y as usize).map(f64::from);
                (DVec3::new(r, g, b) - truth).length_squared() / 3.0
            })
        })
        .collect();
    [0, 1].map(|k: usize| {
        let sum: f64 = errors.iter().map(|error| error[k]).sum();
        -10.0 * (sum / errors.len() as f64).log10()
    })
}

#[test]
fn pictures_of_blocked_light_are_their_truth() {
    let lamps = lamps(128);
    let matt = surface(DVec3::new(0.8, 0.5, 0.3), 0.0, 1.0);
    for (name, bodies, least) in [
        ("ball on a plate", ball_on_plate(matt), 33.0),
        ("fins", fins(), 33.0),
        ("three balls", three_balls(), 33.0),
        ("corner", corner(), 33.0),
    ] {
        let [with, without] = from_truth(&bodies, &lamps);
        println!("{name}: {with:.1} dB, {without:.1} without shadows");
        assert!(with > least, "{name}: {with:.1} dB");
        assert!(with > without + 6.0, "{name}: shadows change little");
    }
}
