//! Pairs of panoramas and of half panoramas against rays traced from where each eye stands.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use glam::{DVec2, DVec3};
use resample_core::{Camera, Image};
use warp3d::input::{DepthKind, DepthMeaning, Picture, Plane, Stored, unrolled, unrolled_camera};
use warp3d::multiview::{Hemisphere, Layout, Places};
use warp3d::panorama::direction;
use warp3d::{Fill, Method, Reference, SurfaceTolerance, WarpOptions, Warper};

const SIZE: [u32; 2] = [768, 384];

/// The distance of the eyes, units: a metre is one.
const BASELINE: f64 = 0.065;

/// Rays along each side of a pixel.
const RAYS: u32 = 4;

/// The nearest place that a ray meets in a room of 4 by 2.8 by 5 metres with two balls, as a length, and its colour.
fn met(origin: DVec3, towards: DVec3) -> (f64, [f64; 3]) {
    let half = DVec3::new(2.0, 1.4, 2.5);
    let wall = ((half * towards.signum() - origin) / towards).min_element();
    let balls = [
        (DVec3::new(0.5, 0.2, 1.3), 0.3),
        (DVec3::new(-0.9, 0.4, -1.1), 0.35),
    ];
    let ball = |(centre, radius): &(DVec3, f64)| {
        let across = *centre - origin;
        let along = across.dot(towards);
        let inside = radius * radius - (across.length_squared() - along * along);
        (inside > 0.0 && along > 0.0).then(|| along - inside.sqrt())
    };
    let nearest = balls.iter().filter_map(ball).fold(f64::INFINITY, f64::min);
    let length = wall.min(nearest);
    let place = origin + length * towards;
    let waves = if nearest < wall { 9.0 } else { 5.0 };
    let colour = [0.0, 1.1, 2.3].map(|phase| {
        let wave = |value: f64| (waves * value + phase).sin();
        0.5 + 0.15 * (wave(place.x) + wave(place.y) + wave(place.z))
    });
    (length, colour)
}

/// A picture of `size` whose rays `ray` gives, one for each position.
fn traced(size: [u32; 2], ray: impl Fn(DVec2) -> Option<(DVec3, DVec3)>) -> Vec<[f32; 3]> {
    let mean = |x: u32, y: u32| {
        let mut sum = [0.0; 3];
        for part in 0..RAYS * RAYS {
            let within = DVec2::new(f64::from(part % RAYS), f64::from(part / RAYS)) + 0.5;
            let pos = DVec2::new(f64::from(x), f64::from(y)) + within / f64::from(RAYS);
            let (_, colour) = ray(pos).map_or((0.0, [0.0; 3]), |(from, to)| met(from, to));
            for (sum, value) in sum.iter_mut().zip(colour) {
                *sum += value / f64::from(RAYS * RAYS);
            }
        }
        sum.map(|value| value as f32)
    };
    (0..size[1])
        .flat_map(|y| (0..size[0]).map(move |x| mean(x, y)))
        .collect()
}

/// The rays of one eye, `aside` to the right of the middle: each direction from where the eye stands that looks there.
fn rays_of_eye(aside: f64) -> impl Fn(DVec2) -> Option<(DVec3, DVec3)> {
    move |pos| {
        let longitude = (pos.x / f64::from(SIZE[0]) - 0.5) * TAU;
        let right = DVec3::new(longitude.cos(), 0.0, -longitude.sin());
        Some((aside * right, direction(pos, SIZE)))
    }
}

fn pixel(index: usize) -> DVec2 {
    let width = SIZE[0] as usize;
    DVec2::new((index % width) as f64, (index / width) as f64) + 0.5
}

/// The panorama of the room from its middle, with exact distances on a grid whose sides are `divided`, unrolled for two eyes.
fn panorama(divided: u32) -> (Vec<[f32; 3]>, Reference) {
    let rgb = traced(SIZE, |pos| Some((DVec3::ZERO, direction(pos, SIZE))));
    let [width, height] = SIZE.map(|side| side as usize);
    let coarse = SIZE.map(|side| side / divided);
    let distance = |index: u32| {
        let pos = DVec2::new(f64::from(index % coarse[0]), f64::from(index / coarse[0])) + 0.5;
        met(DVec3::ZERO, direction(pos, coarse)).0 as f32
    };
    let stored = Plane {
        width: coarse[0] as usize,
        height: coarse[1] as usize,
        values: (0..coarse[0] * coarse[1]).map(distance).collect(),
        stored: Stored::Float,
    };
    let picture = Picture {
        width,
        height,
        rgb: rgb.clone(),
        coverage: None,
    };
    let meaning = DepthMeaning::of(DepthKind::Z);
    let file = Path::new("distance.exr");
    let reference = unrolled(&picture, &stored, &meaning, file, BASELINE).expect("a room");
    (rgb, reference)
}

fn near(camera: Camera) -> Camera {
    Camera {
        near: 0.01,
        ..camera
    }
}

fn options(method: Method) -> WarpOptions {
    WarpOptions {
        method,
        fill: Fill::Background,
        ..WarpOptions::default()
    }
}

/// Both eyes, in the order of the layout.
fn drawn(mut reference: Reference, layout: &Layout, camera: &Camera, method: Method) -> Vec<Image> {
    reference.camera = near(reference.camera);
    let mut warper = Warper::new(vec![reference], &options(method)).expect("a warp");
    let sheet = layout.sheet(camera);
    let views = layout.views(&sheet, f64::INFINITY);
    let eyes = views
        .iter()
        .map(|view| warper.render(view).expect("a view").image)
        .collect();
    let whole = layout.put_together(&sheet, eyes);
    let (width, height) = match layout {
        Layout::Stereo(_, Places::TopBottom) => (whole.width, whole.height / 2),
        _ => (whole.width / 2, whole.height),
    };
    let corner = |eye: usize| {
        if width == whole.width {
            [0, eye * height]
        } else {
            [eye * width, 0]
        }
    };
    let part = |eye: usize| {
        let [left, top] = corner(eye);
        let mut image = Image::transparent(width, height);
        for (index, pixel) in image.rgba.iter_mut().enumerate() {
            *pixel = whole.pixel(left + index % width, top + index / width);
        }
        image
    };
    vec![part(0), part(1)]
}

/// PSNR over the pixels that `counts` names, dB.
fn psnr(image: &[[f32; 3]], truth: &[[f32; 3]], counts: impl Fn(usize) -> bool) -> f64 {
    let (mut sum, mut pixels) = (0.0, 0.0);
    for (_, (a, b)) in image
        .iter()
        .zip(truth)
        .enumerate()
        .filter(|(index, _)| counts(*index))
    {
        sum += a
            .iter()
            .zip(b)
            .map(|(a, b)| f64::from(a - b).powi(2))
            .sum::<f64>();
        pixels += 3.0;
    }
    assert!(pixels > 1000.0, "pixels are compared");
    -10.0 * (sum / pixels).log10()
}

fn colours(image: &Image) -> Vec<[f32; 3]> {
    image
        .rgba
        .iter()
        .map(|&[red, green, blue, _]| [red, green, blue])
        .collect()
}

fn methods() -> [(&'static str, Method); 2] {
    let tolerance = SurfaceTolerance::Auto;
    [
        (
            "hybrid",
            Method::Hybrid {
                tolerance,
                subpixels: 4,
            },
        ),
        ("rows", Method::Rows { tolerance }),
    ]
}

#[test]
fn both_eyes_see_the_room_all_around() {
    let (middle, reference) = panorama(1);
    let layout = Layout::Stereo(BASELINE, Places::TopBottom);
    for (name, method) in methods() {
        let eyes = drawn(
            reference.clone(),
            &layout,
            &near(unrolled_camera(SIZE)),
            method,
        );
        for (eye, aside) in eyes.iter().zip([-0.5 * BASELINE, 0.5 * BASELINE]) {
            let truth = traced(SIZE, rays_of_eye(aside));
            let found = colours(eye);
            // Up to 60 degrees up and down the eyes are as far apart as asked for.
            let is_full =
                |index: usize| (pixel(index).y / f64::from(SIZE[1]) - 0.5).abs() < 1.0 / 3.0;
            let is_seam = |index: usize| {
                let x = pixel(index).x;
                is_full(index) && x.min(f64::from(SIZE[0]) - x) < 12.0
            };
            let db = psnr(&found, &truth, is_full);
            let unmoved = psnr(&middle, &truth, is_full);
            let seam = psnr(&found, &truth, is_seam);
            println!(
                "{name}, eye {aside:+.4}: {db:.1} dB, seam {seam:.1}; without a warp {unmoved:.1}"
            );
            assert!(
                db > 54.0 && db > unmoved + 20.0,
                "{name}: {db} dB, {unmoved} without a warp"
            );
            assert!(
                seam > db - 3.0,
                "{name}: the ends of a row fit together: {seam} dB"
            );
            // Towards the poles the eyes come together: there the truth is that of the middle.
            let is_pole = |index: usize| (pixel(index).y / f64::from(SIZE[1]) - 0.5).abs() > 0.49;
            let pole = psnr(&found, &middle, is_pole);
            assert!(pole > 30.0, "{name}: {pole} dB at the poles");
        }
    }
}

#[test]
fn a_half_panorama_is_the_room_ahead_of_each_eye() {
    let side = 512;
    let focal_px = 300.0;
    let camera = Camera {
        width: 640,
        height: 480,
        fx: focal_px,
        fy: focal_px,
        cx: 320.0,
        cy: 240.0,
        ..near(unrolled_camera(SIZE))
    };
    let of_camera = |pos: DVec2| {
        let on_plane = (pos - DVec2::new(320.0, 240.0)) / focal_px;
        Some((DVec3::ZERO, on_plane.extend(1.0).normalize()))
    };
    let size = [camera.width, camera.height];
    let depth = |index: u32| {
        let pos = DVec2::new(f64::from(index % size[0]), f64::from(index / size[0])) + 0.5;
        let (from, to) = of_camera(pos).expect("a ray");
        (met(from, to).0 * to.z) as f32
    };
    let reference = Reference {
        camera,
        colour: traced(size, of_camera),
        depth: (0..size[0] * size[1]).map(depth).collect(),
    };
    let nearest = f64::from(reference.nearest());
    let half = Hemisphere::new(&camera, BASELINE, nearest, Some(side));
    let layout = Layout::Hemispheres(BASELINE, half);
    for (name, method) in methods() {
        let eyes = drawn(reference.clone(), &layout, &camera, method);
        for (eye, aside) in eyes.iter().zip([-0.5 * BASELINE, 0.5 * BASELINE]) {
            let ahead = |pos: DVec2| {
                let longitude = (pos.x / f64::from(side) - 0.5) * PI;
                let latitude = (0.5 - pos.y / f64::from(side)) * PI;
                DVec3::new(
                    latitude.cos() * longitude.sin(),
                    -latitude.sin(),
                    latitude.cos() * longitude.cos(),
                )
            };
            let truth = traced([side; 2], |pos| {
                Some((DVec3::new(aside, 0.0, 0.0), ahead(pos)))
            });
            let index_pos =
                |index: usize| DVec2::new((index % 512) as f64, (index / 512) as f64) + 0.5;
            // The lens's field of view, without the margins that one eye alone sees.
            let on_plane = |index: usize| {
                let towards = ahead(index_pos(index));
                towards.truncate() / towards.z
            };
            let is_seen = |index: usize| {
                let at = on_plane(index).abs();
                at.x < 320.0 / focal_px - 0.06 && at.y < 240.0 / focal_px - 0.02
            };
            let db = psnr(&colours(eye), &truth, is_seen);
            println!("{name}, eye {aside:+.4}: {db:.1} dB");
            assert!(db > 55.0, "{name}: {db} dB");
            let is_beyond = |index: usize| {
                let at = on_plane(index).abs();
                at.x > 320.0 / focal_px + 0.3 || at.y > 240.0 / focal_px + 0.02
            };
            let beyond = eye
                .rgba
                .iter()
                .enumerate()
                .filter(|(index, _)| is_beyond(*index));
            assert!(
                beyond.into_iter().all(|(_, pixel)| *pixel == [0.0; 4]),
                "{name}: nothing beyond"
            );
        }
    }
}

#[test]
fn a_smaller_depth_of_a_panorama_is_resampled() {
    let (middle, reference) = panorama(2);
    let layout = Layout::Stereo(BASELINE, Places::TopBottom);
    let truth = traced(SIZE, rays_of_eye(-0.5 * BASELINE));
    let (name, method) = methods()[0];
    let eyes = drawn(reference, &layout, &near(unrolled_camera(SIZE)), method);
    let is_full = |index: usize| (pixel(index).y / f64::from(SIZE[1]) - 0.5).abs() < 1.0 / 3.0;
    let db = psnr(&colours(&eyes[0]), &truth, is_full);
    let unmoved = psnr(&middle, &truth, is_full);
    println!("{name}, depth of half the size: {db:.1} dB; without a warp {unmoved:.1}");
    assert!(db > 45.0, "{db} dB");
}
