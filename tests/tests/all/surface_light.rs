//! The sky's light on isosurfaces, against the share of directions that bodies of a formula leave free.

use glam::{DAffine3, DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, Image};
use resample_tests::twins::rays::RaySource;
use resample_tests::volumes::lit_scenes::white_isosurface;
use resample_tests::volumes::scenes::{perspective, transfer, volume};
use volsplat::{Clip, ClipPlane, Light, Occlusion, RenderOptions, Renderer, Shading, Volume};

const SIDE_VOXELS: usize = 48;

/// Of occlusion, world units.
const RADIUS: f64 = 7.0;

/// Above 0 inside of the body, as long as the way to its surface, world units.
type Body = fn(DVec3) -> f64;

fn ball_on_a_plate(p: DVec3) -> f64 {
    let ball = 9.0 - (p - DVec3::new(24.0, 21.0, 24.0)).length();
    ball.max(box_around(
        p,
        DVec3::new(24.0, 9.0, 24.0),
        DVec3::new(17.0, 3.0, 17.0),
    ))
}

fn blocks(p: DVec3) -> f64 {
    // Two blocks that stand askew on a third.
    let turned = |p: DVec3, angle: f64| glam::DQuat::from_rotation_y(angle) * (p - 24.0) + 24.0;
    let floor = box_around(
        turned(p, 0.4),
        DVec3::new(24.0, 10.0, 24.0),
        DVec3::new(16.0, 4.0, 16.0),
    );
    let left = box_around(
        turned(p, 0.4),
        DVec3::new(16.0, 20.0, 24.0),
        DVec3::new(4.0, 9.0, 9.0),
    );
    let right = box_around(
        turned(p, 0.9),
        DVec3::new(29.0, 18.0, 23.0),
        DVec3::new(4.0, 7.0, 9.0),
    );
    floor.max(left).max(right)
}

fn bowl(p: DVec3) -> f64 {
    let from_middle = (p - DVec3::new(24.0, 26.0, 24.0)).length();
    (15.0 - from_middle).min(from_middle - 9.0).min(26.0 - p.y)
}

fn box_around(p: DVec3, middle: DVec3, half: DVec3) -> f64 {
    let beyond = (p - middle).abs() - half;
    -beyond.max(DVec3::ZERO).length() - beyond.max_element().min(0.0)
}

/// A scan of a body whose edge is blurred over so many world units to each side.
fn scan(body: Body, blur: f64, spacing: DVec3) -> Volume {
    let world_from_index = DAffine3::from_scale(spacing);
    let dims = spacing
        .to_array()
        .map(|step| ((SIDE_VOXELS - 1) as f64 / step) as usize + 1);
    volume(dims, world_from_index, |index| {
        let distance = body(world_from_index.transform_point3(index));
        (0.5 + 0.5 * distance / blur).clamp(0.0, 1.0)
    })
}

fn camera() -> Camera {
    let middle = DVec3::splat(0.5 * (SIDE_VOXELS - 1) as f64);
    let eye = middle + 110.0 * DVec3::new(0.55, 0.62, 0.56).normalize();
    perspective(eye, middle, 28.0, [64; 2])
}

fn options(clip: &Clip, occlusion: Option<Occlusion>) -> RenderOptions {
    RenderOptions {
        order: white_isosurface(),
        shading: Shading::None,
        light: Light::Headlight,
        clip: clip.clone(),
        occlusion,
        ..RenderOptions::default()
    }
}

fn picture(volume: &Volume, clip: &Clip) -> Image {
    let look = transfer(&[(0.0, [1.0; 3])], &[(0.0, 1.0)]);
    let occlusion = Occlusion {
        radius: Some(RADIUS),
    };
    let mut renderer =
        Renderer::new(volume, &look, &options(clip, Some(occlusion))).expect("valid options");
    renderer.render(&camera()).expect("a valid camera").image
}

/// Where a ray meets the body first, within a length.
fn meets(body: impl Fn(DVec3) -> f64, origin: DVec3, direction: DVec3, length: f64) -> Option<f64> {
    let mut way = 0.0;
    while way < length {
        let inside = body(origin + way * direction);
        if inside > -1e-4 {
            return Some(way);
        }
        // Sphere tracing; a body that is cut or joined is never nearer than that.
        way += (-inside).max(1e-3);
    }
    None
}

/// The share of the directions around a place of the surface that meet nothing within the radius.
fn free_share(body: &impl Fn(DVec3) -> f64, at: DVec3) -> f64 {
    const COUNT: u32 = 600;
    const TURN: f64 = 2.399_963_229_728_653;
    let is_free = |number: u32| {
        let z = (f64::from(number) + 0.5) / f64::from(COUNT) * 2.0 - 1.0;
        let (sin, cos) = (TURN * f64::from(number)).sin_cos();
        let flat = (1.0 - z * z).sqrt();
        let direction = DVec3::new(flat * cos, flat * sin, z);
        // A little in front of it, so that the surface does not block itself.
        meets(body, at + 0.05 * direction, direction, RADIUS).is_none()
    };
    (0..COUNT).filter(|number| is_free(*number)).count() as f64 / f64::from(COUNT)
}

/// Errors of light over pixels that show a surface, each picture over its mean, dB, and the same without occlusion.
fn errors_db(image: &Image, body: impl Fn(DVec3) -> f64 + Sync) -> [f64; 2] {
    let camera = camera();
    let rays = RaySource::new(&camera, &DAffine3::IDENTITY);
    let width = camera.width as usize;
    let places = (0..image.rgba.len()).into_par_iter();
    let pairs: Vec<[f64; 2]> = places
        .filter_map(|place| {
            let pixel = image.rgba[place];
            let at = DVec2::new((place % width) as f64, (place / width) as f64) + 0.5;
            let ray = rays.ray(at);
            let direction = ray.direction.normalize();
            let way = meets(&body, ray.origin, direction, 400.0)?;
            // Pixels on outlines see more than one place.
            let beside = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];
            let is_even = beside.into_iter().all(|step| {
                let ray = rays.ray(at + 0.7 * step);
                let other = meets(&body, ray.origin, ray.direction.normalize(), 400.0);
                other.is_some_and(|other| (other - way).abs() < 3.0)
            });
            if !is_even || pixel[3] <= 0.999 {
                return None;
            }
            let share = free_share(&body, ray.origin + way * direction);
            // More than half of the sky is seen from edges alone, which are narrower than a voxel.
            (share < 0.55).then(|| [f64::from(pixel[0]), share])
        })
        .collect();
    assert!(pairs.len() > 500, "{} pixels", pairs.len());
    let count = pairs.len() as f64;
    let [own, truth] =
        [0, 1].map(|of: usize| pairs.iter().map(|pair| pair[of]).sum::<f64>() / count);
    let db = |squares: f64| -10.0 * (squares / count).log10();
    let with = pairs
        .iter()
        .map(|pair| (pair[0] / own - pair[1] / truth).powi(2))
        .sum();
    let without = pairs
        .iter()
        .map(|pair| (1.0 - pair[1] / truth).powi(2))
        .sum();
    [db(with), db(without)]
}

#[test]
fn occlusion_on_isosurfaces_is_that_of_their_shape() {
    let long = DVec3::new(1.0, 1.0, 2.0);
    let scenes: [(&str, Body, f64, DVec3, f64); 5] = [
        ("ball on a plate", ball_on_a_plate, 2.0, DVec3::ONE, 25.0),
        ("the same, steep", ball_on_a_plate, 0.7, DVec3::ONE, 25.0),
        ("slices 2 apart", ball_on_a_plate, 2.0, long, 25.0),
        ("blocks", blocks, 2.0, DVec3::ONE, 25.0),
        ("bowl", bowl, 2.0, DVec3::ONE, 24.5),
    ];
    for (name, body, blur, spacing, least_db) in scenes {
        let image = picture(&scan(body, blur, spacing), &Clip::default());
        let [with, without] = errors_db(&image, body);
        eprintln!("{name}: {with:.1} dB, {without:.1} without occlusion");
        assert!(with > least_db, "{name}: {with:.1} dB");
        assert!(with > without + 6.0, "{name}: {without:.1} dB without");
    }
}

#[test]
fn what_is_cut_away_takes_no_light_from_isosurfaces() {
    let above_a_plate: Body = |p| {
        let ball = 9.0 - (p - DVec3::new(24.0, 24.0, 24.0)).length();
        ball.max(box_around(
            p,
            DVec3::new(24.0, 9.0, 24.0),
            DVec3::new(17.0, 3.0, 17.0),
        ))
    };
    // Between the plate and the ball.
    let clip = Clip {
        planes: vec![ClipPlane {
            normal: DVec3::new(0.02, -1.0, -0.03),
            offset: -13.9,
        }],
        ..Clip::default()
    };
    let volume = scan(above_a_plate, 2.0, DVec3::ONE);
    let camera = camera();
    let rays = RaySource::new(&camera, &DAffine3::IDENTITY);
    let (whole, cut) = (picture(&volume, &Clip::default()), picture(&volume, &clip));
    let (mut seen, mut darkest) = (0, f32::INFINITY);
    for (place, (before, after)) in whole.rgba.iter().zip(&cut.rgba).enumerate() {
        let at = DVec2::new((place % 64) as f64, (place / 64) as f64) + 0.5;
        let ray = rays.ray(at);
        let on_plate = ray.origin + (12.0 - ray.origin.y) / ray.direction.y * ray.direction - 24.0;
        if on_plate.x.abs().max(on_plate.z.abs()) > 14.0 {
            continue;
        }
        seen += 1;
        darkest = darkest.min(before[0]);
        assert!((after[0] - 1.0).abs() < 0.04, "{after:?} at {at}");
    }
    assert!(seen > 200, "{seen} pixels");
    assert!(darkest < 0.7, "{darkest}");
}
