//! A sun in the surroundings: its highlight on flat and on bumpy metal, at all angles, against the model summed over the sun's disc.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};
use resample_tests::meshes::surroundings::{Reflector, of_small_light};
use resample_tests::meshes::textured::{material, quad, seen_from_afar, texture_use};
use texmap::Scene;
use texmap::scene::{Lighting, Material, Physical, Surroundings, Texels, Texture, Wrap};

/// Radius of the sun.
const RADIUS: f64 = 0.009;

/// A dark sky with a sun whose radiance times solid angle is 1.
fn sky(sun: DVec3) -> Surroundings {
    sky_with((sun, RADIUS), 0.0)
}

/// A sky of an even radiance, and on it a disc of a radius whose radiance times solid angle is 1.
pub(super) fn sky_with((sun, radius): (DVec3, f64), even: f64) -> Surroundings {
    let (width, height) = (1440, 720);
    let direction = |x: f64, y: f64| {
        let (sin, cos) = ((x / width as f64 - 0.5) * TAU).sin_cos();
        let (down_sin, down_cos) = (y / height as f64 * PI).sin_cos();
        DVec3::new(down_sin * sin, down_cos, -down_sin * cos)
    };
    let pixel = |at: usize| {
        let (x, y) = (at % width, at / width);
        let middle = direction(x as f64 + 0.5, y as f64 + 0.5);
        if middle.distance(sun) > 2.0 * radius {
            return 0.0;
        }
        // The share of the pixel that the disc covers.
        let mut inside = 0;
        for k in 0..16 {
            let part = |k: i32| (f64::from(k) + 0.5) / 4.0;
            let d = direction(x as f64 + part(k % 4), y as f64 + part(k / 4));
            inside += i32::from(d.distance(sun) < radius);
        }
        f64::from(inside) / 16.0
    };
    let covered: Vec<f64> = (0..width * height).map(pixel).collect();
    let solid = |at: usize| {
        let down = ((at / width) as f64 + 0.5) / height as f64 * PI;
        down.sin() * TAU / width as f64 * PI / height as f64
    };
    let whole: f64 = covered
        .iter()
        .enumerate()
        .map(|(at, part)| part * solid(at))
        .sum();
    let radiance = |part: &f64| [(part / whole + even) as f32; 3];
    Surroundings {
        width,
        height,
        rgb: covered.iter().map(radiance).collect(),
    }
}

/// What is seen in the middle of a metal square in the plane z = 0.
fn seen(sun: DVec3, eye: DVec3, roughness: f64, bumps: Option<&Texture>) -> f64 {
    seen_under(sky(sun), eye, roughness, bumps)
}

/// The same, under any sky.
fn seen_under(sky: Surroundings, eye: DVec3, roughness: f64, bumps: Option<&Texture>) -> f64 {
    let corners = [
        [-8.0, -8.0, 0.0],
        [8.0, -8.0, 0.0],
        [8.0, 8.0, 0.0],
        [-8.0, 8.0, 0.0],
    ];
    let repeats = 8.0;
    let uvs = [[0.0, repeats], [repeats; 2], [repeats, 0.0], [0.0; 2]];
    let physical = Physical {
        metal: 1.0,
        roughness: roughness as f32,
        normal_texture: bumps.map(|_| texture_use(Wrap::Repeat)),
        ..Physical::default()
    };
    let scene = Scene {
        meshes: vec![quad(corners, uvs, 0)],
        materials: vec![Material {
            lighting: Lighting::Lit,
            physical: Some(physical),
            ..material(None)
        }],
        textures: bumps.into_iter().cloned().collect(),
        surroundings: Some(Arc::new(sky)),
        ..Scene::default()
    };
    seen_from_afar(&scene, eye)[0]
}

/// The mean over the sun's disc.
fn truth(sun: DVec3, eye: DVec3, roughness: f64, normals: &[DVec3]) -> f64 {
    truth_of((sun, RADIUS), eye, roughness, normals)
}

/// The same, of a disc of any radius.
fn truth_of((sun, radius): (DVec3, f64), eye: DVec3, roughness: f64, normals: &[DVec3]) -> f64 {
    let surface = Reflector {
        base: DVec3::ONE,
        metal: 1.0,
        roughness,
    };
    let (side, above) = sun.any_orthonormal_pair();
    let parts = 32;
    let mut sum = 0.0;
    for k in 0..parts {
        let away = radius * ((f64::from(k) + 0.5) / f64::from(parts)).sqrt();
        let (sin, cos) = (f64::from(k) * 2.399_963).sin_cos();
        let light = (sun + (side * cos + above * sin) * away).normalize();
        for &normal in normals {
            sum += of_small_light(&surface, (normal, eye), light).x;
        }
    }
    // Light that facets reflect more than once leaves a white metal evenly.
    let lost = 1.0 - reflected_once(&surface, eye);
    sum / f64::from(parts) / normals.len() as f64 + lost * sun.z.max(0.0) / PI
}

/// The part of even light that facets reflect once.
fn reflected_once(surface: &Reflector, eye: DVec3) -> f64 {
    let (rows, columns) = (400, 800);
    let mut sum = 0.0;
    for k in 0..rows * columns {
        let z = (f64::from(k / columns) + 0.5) / f64::from(rows);
        let (sin, cos) = ((f64::from(k % columns) + 0.5) / f64::from(columns) * TAU).sin_cos();
        let wide = (1.0 - z * z).sqrt();
        let light = DVec3::new(wide * cos, wide * sin, z);
        sum += of_small_light(surface, (DVec3::Z, eye), light).x;
    }
    sum * TAU / f64::from(rows * columns)
}

fn at(angle_deg: f64) -> DVec3 {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    DVec3::new(sin, 0.0, cos)
}

/// Directions of the sun around the mirrored eye: in the plane of incidence, and across.
fn around(eye: DVec3, step_deg: f64) -> [DVec3; 5] {
    let mirrored = DVec3::new(-eye.x, 0.0, eye.z);
    let step = step_deg.to_radians();
    let turned = |axis: DVec3, angle: f64| DQuat::from_axis_angle(axis, angle) * mirrored;
    let across = mirrored.cross(DVec3::Y);
    [
        mirrored,
        turned(DVec3::Y, step),
        turned(DVec3::Y, -step),
        turned(across, step),
        turned(across, -step),
    ]
}

#[test]
fn flat_metal_keeps_the_highlight_of_a_sun_at_every_angle() {
    let mut worst = 0.0f64;
    for roughness in [0.3, 0.45, 0.65] {
        for angle_deg in [15.0, 78.0] {
            let eye = at(angle_deg);
            let suns = around(eye, 4.0);
            let pairs = suns.map(|sun| {
                let found = seen(sun, eye, roughness, None);
                (found, truth(sun, eye, roughness, &[DVec3::Z]))
            });
            let ratios = pairs.map(|(found, truth)| found / truth);
            println!("roughness {roughness}, {angle_deg} degrees: {ratios:.3?}");
            worst = ratios
                .iter()
                .fold(worst, |worst, ratio| worst.max((ratio - 1.0).abs()));
        }
    }
    assert!(worst < 0.05, "off by {worst:.3}");
}

/// Random bumps of 64 by 64 texels, and their normals between texels, four a texel.
fn bumps() -> (Texture, Vec<DVec3>) {
    const SIDE: usize = 64;
    let random = |k: usize| {
        let mut h = (k as u32).wrapping_mul(0x85eb_ca6b) ^ 0x2545_f491;
        h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
        h = (h ^ h >> 12).wrapping_mul(0x297a_2d39);
        f64::from(h >> 8) / 16_777_216.0 - 0.5
    };
    let codes: Vec<[u8; 4]> = (0..SIDE * SIDE)
        .map(|at| {
            let slope = DVec2::new(random(2 * at), random(2 * at + 1)) * 0.5;
            let n = DVec3::new(slope.x, slope.y, 1.0).normalize();
            let code = |v: f64| ((v * 0.5 + 0.5) * 255.0).round() as u8;
            [code(n.x), code(n.y), code(n.z), 255]
        })
        .collect();
    let normal = |x: usize, y: usize| {
        let [x, y, z, _] = codes[y % SIDE * SIDE + x % SIDE].map(f64::from);
        (DVec3::new(x, y, z) / 127.5 - DVec3::ONE).normalize()
    };
    let mut normals = Vec::new();
    for k in 0..4 * SIDE * SIDE {
        let (x, y) = (k % (2 * SIDE), k / (2 * SIDE));
        let share = |k: usize| 0.25 + 0.5 * (k % 2) as f64;
        let row = |y: usize| normal(x / 2, y).lerp(normal(x / 2 + 1, y), share(x));
        normals.push(row(y / 2).lerp(row(y / 2 + 1), share(y)).normalize());
    }
    let texture = Texture {
        name: String::new(),
        width: SIDE,
        height: SIDE,
        texels: Texels::Srgb8(Arc::new(codes)),
    };
    (texture, normals)
}

#[test]
fn bumps_too_small_to_be_seen_keep_the_energy_of_a_sun() {
    let (texture, normals) = bumps();
    let mut worst = 0.0f64;
    for roughness in [0.3, 0.45] {
        for angle_deg in [15.0, 60.0] {
            let eye = at(angle_deg);
            let (mut found, mut expected) = (0.0, 0.0);
            for sun in around(eye, 12.0) {
                found += seen(sun, eye, roughness, Some(&texture));
                expected += truth(sun, eye, roughness, &normals);
            }
            let ratio = found / expected;
            println!("roughness {roughness}, {angle_deg} degrees, bumps: {ratio:.3}");
            worst = worst.max((ratio - 1.0).abs());
        }
    }
    assert!(worst < 0.05, "off by {worst:.3}");
}

/// The largest change from one sky to the next, of what is seen as a part of what is true.
fn largest_step(skies: &[(f64, f64)]) -> f64 {
    let (eye, roughness) = (at(70.0), 0.3);
    let sun = DVec3::new(-eye.x, 0.0, eye.z);
    let ratio = |&(radius, even): &(f64, f64)| {
        let found = seen_under(sky_with((sun, radius), even), eye, roughness, None);
        // White metal gives even light back.
        found / (truth_of((sun, radius), eye, roughness, &[DVec3::Z]) + even)
    };
    let ratios: Vec<f64> = skies.iter().map(ratio).collect();
    println!("{ratios:.3?}");
    let steps = ratios.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.fold(0.0, f64::max)
}

#[test]
fn a_sun_that_grows_until_it_is_a_lamp_does_not_make_the_picture_jump() {
    // In blurred surroundings at least a fifth of the highlight is left, and the way there is a hundredth of a radian: a twentieth
    // of that way may change the picture by 0.8 / 20, and by 0.01 for the pixels of the sky.
    let skies: Vec<(f64, f64)> = (0..28)
        .map(|k| (0.018 + 0.0005 * f64::from(k), 0.02))
        .collect();
    let step = largest_step(&skies);
    assert!(step < 0.05, "a step of {step:.3}");
}

#[test]
fn a_sun_that_fades_into_the_sky_does_not_make_the_picture_jump() {
    // From 1/400 to all but all of the light, the sky 1.1 times as bright from one picture to the next: a sixth of the way at most, and the
    // highlight is a third of what is seen there.
    let skies: Vec<(f64, f64)> = (0..36).map(|k| (RADIUS, 1.5 * 1.1f64.powi(k))).collect();
    let step = largest_step(&skies);
    assert!(step < 0.05, "a step of {step:.3}");
}
