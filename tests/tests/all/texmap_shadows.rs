//! Light that meshes block from themselves: held to the sum over every direction that nothing blocks, and to closed forms.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, Image};
use resample_tests::meshes::shadows::{Body, Shape, bumpy_ball, first_met, lit, scene};
use resample_tests::meshes::surroundings::{Reflector, lamps, radiance};
use resample_tests::volumes::scenes::perspective;
use texmap::scene::{Sides, Surroundings};
use texmap::{RenderOptions, Renderer, Scene, Shade, Shadows};

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

/// Even light of radiance 1.
fn even() -> Surroundings {
    Surroundings {
        width: 16,
        height: 8,
        rgb: vec![[1.0; 3]; 128],
    }
}

/// The grey value of a white surface at a place of the world, from above.
fn seen_at(image: &Image, camera: &Camera, place: DVec3) -> f64 {
    let in_camera = camera.camera_from_world.transform_point3(place);
    let x = camera.fx * in_camera.x / in_camera.z + camera.cx;
    let y = camera.fy * in_camera.y / in_camera.z + camera.cy;
    f64::from(image.pixel(x as usize, y as usize)[1])
}

/// A ball of radius 1 at height h over a plane takes, from a place at distance d of the foot point, the form factor of a sphere: h / (h^2 + d^2)^(3/2)
/// (where it lies above the horizon).
#[test]
fn a_ball_over_a_plane_takes_its_form_factor() {
    let height = 1.6;
    let mut bodies = vec![body(plate(), white())];
    bodies.push(body(
        Shape::Ball(DVec3::new(0.0, height - 1.0, 0.0), 1.0),
        white(),
    ));
    let mut scene = scene(&bodies);
    scene.surroundings = Some(Arc::new(even()));
    let camera = perspective(
        DVec3::new(0.0, 5.0, 6.0),
        DVec3::new(0.0, -0.5, 0.0),
        50.0,
        [400; 2],
    );
    let [with, without] =
        [Shadows::Mesh, Shadows::None].map(|shadows| drawn(&scene, shadows, &camera));
    for x in [1.2, 1.5, 1.8, 2.1, 2.4, 2.7] {
        for z in [0.9, 1.4] {
            let place = DVec3::new(x, -1.0, z);
            let away2 = x * x + z * z;
            let open = 1.0 - height / (height * height + away2).powf(1.5);
            let share = seen_at(&with, &camera, place) / seen_at(&without, &camera, place);
            // The highlight of a rough surface is 3 % of its light, and follows other directions.
            assert!(
                (share - open).abs() < 0.012,
                "at {x} {z}: {share:.4}, {open:.4}"
            );
        }
    }
}

/// A wall of infinite length and height a stands on a plane: from distance d it takes (1 - d / sqrt(d^2 + a^2)) / 2.
#[test]
fn a_long_wall_takes_its_form_factor() {
    let wall = |low: [f64; 3], high: [f64; 3]| body(Shape::Block(low.into(), high.into()), white());
    let bodies = [
        wall([-40.0, -1.3, -0.5], [40.0, -1.0, 4.0]),
        wall([-40.0, -1.3, -0.8], [40.0, 1.0, -0.5]),
    ];
    let mut scene = scene(&bodies);
    scene.surroundings = Some(Arc::new(even()));
    let camera = perspective(
        DVec3::new(0.0, 4.0, 7.0),
        DVec3::new(0.0, -0.5, 1.0),
        40.0,
        [400; 2],
    );
    let [with, without] =
        [Shadows::Mesh, Shadows::None].map(|shadows| drawn(&scene, shadows, &camera));
    for away in [0.3, 0.6, 1.0, 1.5, 2.0, 3.0] {
        let open = 0.5 + 0.5 * away / f64::hypot(away, 2.0);
        let place = DVec3::new(0.1, -1.0, away - 0.5);
        let share = seen_at(&with, &camera, place) / seen_at(&without, &camera, place);
        assert!(
            (share - open).abs() < 0.015,
            "at {away}: {share:.4}, {open:.4}"
        );
    }
}

/// A sun of 4 degrees in a dim sky.
fn sunny(towards: DVec3) -> Surroundings {
    let (width, height) = (1024, 512);
    let pixel = |at: usize| {
        let across = (((at % width) as f64 + 0.5) / width as f64 - 0.5) * 2.0 * PI;
        let down = ((at / width) as f64 + 0.5) / height as f64 * PI;
        let d = DVec3::new(
            down.sin() * across.sin(),
            down.cos(),
            -down.sin() * across.cos(),
        );
        let is_sun = d.dot(towards) > f64::to_radians(1.0).cos();
        if is_sun {
            [6000.0, 5600.0, 5000.0]
        } else {
            [0.3, 0.35, 0.45]
        }
    };
    Surroundings {
        width,
        height,
        rgb: (0..width * height).map(pixel).collect(),
    }
}

#[test]
fn a_sun_casts_a_shadow_as_sharp_as_it_is_small() {
    let towards = DVec3::new(0.5, 0.8, 0.3).normalize();
    let mut scene = scene(&ball_on_plate(white()));
    scene.surroundings = Some(Arc::new(sunny(towards)));
    let camera = perspective(
        DVec3::new(0.0, 7.0, 3.0),
        DVec3::new(0.0, -1.0, 0.0),
        45.0,
        [400; 2],
    );
    let [with, without] =
        [Shadows::Mesh, Shadows::None].map(|shadows| drawn(&scene, shadows, &camera));
    // Across the shadow's far end: the place whose ray passes the ball's middle at distance r is lit where r is above 1. The sun is a degree in radius,
    // and the edge some 1.5 away: its half shadow is 0.03 to either side.
    let foot = -towards.with_y(0.0) / towards.y;
    let direction = foot.normalize();
    let mut seen = [0, 0];
    for k in 0..40 {
        let place = DVec3::new(0.0, -1.0, 0.0) + foot + direction * (0.02 * f64::from(k) + 0.9);
        let passes = place.cross(towards).length();
        let share = seen_at(&with, &camera, place) / seen_at(&without, &camera, place);
        if passes < 0.94 {
            assert!(share < 0.35, "in shadow at {passes:.2}: {share:.3}");
            seen[0] += 1;
        } else if passes > 1.06 {
            assert!(share > 0.85, "in light at {passes:.2}: {share:.3}");
            seen[1] += 1;
        }
    }
    assert!(seen.iter().all(|&count| count >= 5), "{seen:?}");
}

/// The alpha of the ground is the share of light that a ball takes from it; where there is no shadow, nothing is drawn.
#[test]
fn the_ground_catches_the_shadow_alone() {
    let ball = [body(Shape::Ball(DVec3::new(0.0, 0.0, 0.0), 1.0), white())];
    let mut scene = scene(&ball);
    scene.surroundings = Some(Arc::new(even()));
    const SIZE_OF_GROUND: u32 = 400;
    let camera = perspective(
        DVec3::new(0.0, 5.0, 6.0),
        DVec3::new(0.0, -0.5, 0.0),
        50.0,
        [SIZE_OF_GROUND; 2],
    );
    let image = drawn(&scene, Shadows::Ground, &camera);
    let at = |place: DVec3| {
        let in_camera = camera.camera_from_world.transform_point3(place);
        let x = camera.fx * in_camera.x / in_camera.z + camera.cx;
        let y = camera.fy * in_camera.y / in_camera.z + camera.cy;
        image.pixel(x as usize, y as usize)
    };
    // The form factor of a ball that touches the plane; farther away the shadow fades.
    for x in [1.1, 1.4, 1.7, 2.0_f64] {
        let [r, g, b, alpha] = at(DVec3::new(x, -1.0, 0.6)).map(f64::from);
        let taken = (1.0 + x * x + 0.36).powf(-1.5);
        assert_eq!([r, g, b], [0.0; 3], "the ground is black");
        assert!(
            (alpha - taken).abs() < 0.01,
            "at {x}: {alpha:.4}, {taken:.4}"
        );
    }
    assert_eq!(image.pixel(2, 2), [0.0; 4]);
    let on_mesh = drawn(&scene, Shadows::Mesh, &camera);
    let middle = SIZE_OF_GROUND as usize / 2;
    assert_eq!(image.pixel(middle, middle), on_mesh.pixel(middle, middle));
}

#[test]
fn light_is_the_same_on_any_number_of_threads() {
    let scene = bumpy_ball(24);
    let camera = camera();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads")
            .install(|| drawn(&scene, Shadows::Ground, &camera).rgba)
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn shadows_need_the_light_of_surroundings() {
    let scene = bumpy_ball(8);
    for shade in [Shade::Unlit, Shade::Headlight, Shade::Lambert] {
        let options = RenderOptions {
            shadows: Shadows::Mesh,
            shade,
            ..RenderOptions::default()
        };
        let error = Renderer::new(&scene, &options).expect_err("no shadow in this light");
        assert!(error.to_string().contains("surroundings"), "{error}");
    }
}

/// Files often turn triangles against their normals: the normals say which side is outside.
#[test]
fn triangles_that_turn_against_their_normals_are_lit_as_these_say() {
    let mut scene = bumpy_ball(24);
    scene.materials[0].sides = Sides::Both;
    let camera = camera();
    let expected = [Shadows::None, Shadows::Mesh].map(|shadows| drawn(&scene, shadows, &camera));
    for triangle in scene.meshes[0].triangles.iter_mut().step_by(3) {
        triangle.swap(1, 2);
    }
    let turned = [Shadows::None, Shadows::Mesh].map(|shadows| drawn(&scene, shadows, &camera));
    for (expected, turned) in expected.iter().zip(&turned) {
        for (a, b) in expected.rgba.iter().zip(&turned.rgba) {
            for (a, b) in a.iter().zip(b) {
                assert!((a - b).abs() < 2e-3, "{a} {b}");
            }
        }
    }
}
