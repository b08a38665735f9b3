//! Surfaces by formula, sampled at random, against their antialiased truth; extremes.

mod scenes;

use glam::DVec3;
use resample_core::{Camera, Image, LookAt};

use crate::{
    Blend, CloudFrame, CloudLayer, CloudOptions, CloudRenderer, Disc, PointCloud, prepare,
};
use scenes::{Found, Random, Scene, Shape, against, truth};

/// Waves of the texture: 15 px of the pictures below to a wave.
const WAVES: f64 = 5.0;

fn pose(position: DVec3, target: DVec3) -> LookAt {
    LookAt {
        position,
        target,
        up: DVec3::new(0.0, -1.0, 0.0),
    }
}

/// A camera 3.2 units from the origin, which lies a little aside of the axis of a plane.
fn camera() -> Camera {
    let pose = pose(DVec3::new(0.6, -0.8, -3.0), DVec3::ZERO);
    Camera::perspective(&pose, 0.9, [256, 192]).expect("a camera")
}

fn parallel() -> Camera {
    let pose = pose(DVec3::new(0.6, -0.8, -3.0), DVec3::ZERO);
    Camera::orthographic(&pose, 2.8, [256, 192]).expect("a camera")
}

fn drawn(cloud: &PointCloud, camera: &Camera, options: &CloudOptions) -> CloudFrame {
    let prepared = prepare(cloud).expect("points");
    let mut renderer = CloudRenderer::new(prepared, options).expect("options");
    renderer.render(camera).expect("a frame")
}

fn measured(shape: Shape, per_px: f64, camera: &Camera, blend: Blend) -> Found {
    let scene = Scene {
        shape,
        waves: WAVES,
    };
    let cloud = scene.sampled(per_px, camera);
    let options = CloudOptions {
        blend,
        ..CloudOptions::default()
    };
    let frame = drawn(&cloud, camera, &options);
    save(&frame.image, &format!("{shape:?}_{per_px}"));
    let found = against(&frame.image, &truth(&scene, camera));
    println!(
        "{shape:?}, {per_px} points a px, {blend:?}: {found:?}, {:?}",
        frame.stats.left_out
    );
    found
}

#[test]
fn one_point_a_pixel_is_within_45_db_of_the_truth() {
    for shape in [Shape::Plane, Shape::Sphere] {
        let found = measured(shape, 1.0, &camera(), Blend::Linear);
        assert!(found.inside_db > 54.0, "{shape:?}: {found:?}");
        // The outline of a sphere is known, the end of a plane only to the distance of its points.
        let whole_db = if shape == Shape::Plane { 42.0 } else { 49.0 };
        assert!(found.whole_db > whole_db, "{shape:?}: {found:?}");
        assert!(found.lacking < 0.001, "{shape:?}: {found:?}");
        assert_eq!(found.holes, 0, "{shape:?}");
        assert!(found.false_fill < 0.002, "{shape:?}: {found:?}");
    }
}

#[test]
fn a_linear_fit_is_nearer_to_the_truth_than_a_mean() {
    let mean = measured(Shape::Sphere, 1.0, &camera(), Blend::Mean);
    let linear = measured(Shape::Sphere, 1.0, &camera(), Blend::Linear);
    assert!(
        linear.inside_db > mean.inside_db + 8.0,
        "{linear:?} against {mean:?}"
    );
}

#[test]
fn twice_magnified_surfaces_have_no_holes() {
    for shape in [Shape::Plane, Shape::Sphere] {
        let found = measured(shape, 0.25, &camera(), Blend::Linear);
        assert!(found.inside_db > 41.0, "{shape:?}: {found:?}");
        assert_eq!(found.holes, 0, "{shape:?}");
        // The plane ends somewhere between its outermost points and those that are not there.
        assert!(found.false_fill < 0.004, "{shape:?}: {found:?}");
        assert!(found.lacking < 0.005, "{shape:?}: {found:?}");
    }
}

#[test]
fn minified_surfaces_are_gathered() {
    for shape in [Shape::Plane, Shape::Sphere] {
        let found = measured(shape, 6.0, &camera(), Blend::Linear);
        assert!(found.inside_db > 60.0, "{shape:?}: {found:?}");
        assert_eq!(found.holes, 0, "{shape:?}");
    }
}

#[test]
fn parallel_rays_see_the_same_surfaces() {
    for shape in [Shape::Plane, Shape::Sphere] {
        let found = measured(shape, 1.0, &parallel(), Blend::Linear);
        assert!(found.inside_db > 50.0, "{shape:?}: {found:?}");
        assert_eq!(found.holes, 0, "{shape:?}");
    }
}

#[test]
fn normals_are_those_of_the_surface_towards_the_eye() {
    for (shape, camera) in [
        (Shape::Plane, camera()),
        (Shape::Sphere, camera()),
        (Shape::Plane, parallel()),
        (Shape::Sphere, parallel()),
    ] {
        let scene = Scene {
            shape,
            waves: WAVES,
        };
        let options = CloudOptions {
            layers: vec![CloudLayer::Normal],
            ..CloudOptions::default()
        };
        let cloud = scene.sampled(1.0, &camera);
        let mut image = drawn(&cloud, &camera, &options).image;
        let (mut worst, mut sum, mut count) = (0.0f64, 0.0, 0.0);
        for (i, pixel) in image.rgba.iter().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| f64::from(image.planes[axis].values[i]));
            let normal = DVec3::new(x, y, z);
            assert!(
                (normal.length() - f64::from(pixel[3])).abs() < 1e-4,
                "times coverage"
            );
            let place = [i % image.width, i / image.width];
            if let Some(expected) = scene.normal(&camera, place).filter(|_| pixel[3] == 1.0) {
                let apart = normal.angle_between(expected).to_degrees();
                (worst, sum, count) = (worst.max(apart), sum + apart, count + 1.0);
            }
        }
        println!(
            "{shape:?}: {worst} degrees at most, {} in the mean",
            sum / count
        );
        assert!(
            sum / count < 0.3 && worst < 8.0,
            "{shape:?}: {worst} {}",
            sum / count
        );
        let names = ["normal.X", "normal.Y", "normal.Z"];
        assert!(image.planes.iter().map(|plane| &plane.name).eq(names));
        image.planes.clear();
        let plain = drawn(&cloud, &camera, &CloudOptions::default()).image;
        assert_eq!(image, plain, "colour and depth stay as they are");
    }
}

/// Points wholly at random leave circles of two spacings empty.
#[test]
fn points_wholly_at_random_leave_few_holes() {
    let scene = Scene {
        shape: Shape::Plane,
        waves: WAVES,
    };
    let mut random = Random(3);
    let mut place = || DVec3::new(2.0 * random.next() - 1.0, 2.0 * random.next() - 1.0, 0.0);
    let places: Vec<DVec3> = (0..4000).map(|_| place()).collect();
    let frame = drawn(&scene.cloud(&places), &camera(), &CloudOptions::default());
    let found = against(&frame.image, &truth(&scene, &camera()));
    println!("wholly at random: {found:?}, {:?}", frame.stats);
    save(&frame.image, "random");
    assert!(found.holes < 30, "{found:?}");
}

/// A red plane half a unit behind a green one of half its size.
#[test]
fn a_surface_behind_another_does_not_shine_through() {
    let mut random = Random(5);
    let mut plane = |size: f64, z: f64| -> Vec<[f32; 3]> {
        let mut at = |i: usize| (size * (2.0 * (i as f64 + random.next()) / 100.0 - 1.0)) as f32;
        (0..100 * 100)
            .map(|i| [at(i % 100), at(i / 100), z as f32])
            .collect()
    };
    let positions = [plane(1.0, 0.5), plane(0.5, 0.0)].concat();
    let colours = [vec![[255, 0, 0]; 10_000], vec![[0, 255, 0]; 10_000]].concat();
    let cloud = PointCloud {
        origin_in_world: DVec3::ZERO,
        positions,
        colours,
    };
    let camera = camera();
    let image = drawn(&cloud, &camera, &CloudOptions::default()).image;
    save(&image, "two");
    let (mut front, mut back) = (0, 0);
    for (x, y) in (0..256).flat_map(|x| (0..192).map(move |y| (x, y))) {
        let at = glam::DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let (origin, direction) = camera.ray_in_camera(at);
        let world = camera.camera_from_world.inverse();
        let (o, d) = (
            world.transform_point3(origin),
            world.transform_vector3(direction),
        );
        let place = o - d * (o.z / d.z);
        let pixel = image.pixel(x, y);
        if place.x.abs().max(place.y.abs()) < 0.46 {
            assert_eq!(pixel[0], 0.0, "red at {x} {y}");
            assert_eq!(pixel[3], 1.0, "a hole at {x} {y}");
            front += 1;
        } else if pixel[3] == 1.0 && place.x.abs().max(place.y.abs()) > 0.54 {
            assert_eq!(pixel[1], 0.0, "green at {x} {y}");
            back += 1;
        }
    }
    assert!(front > 1000 && back > 1000, "{front} {back}");
}

#[test]
fn noise_across_a_surface_leaves_it_closed() {
    let scene = Scene {
        shape: Shape::Plane,
        waves: WAVES,
    };
    let mut cloud = scene.sampled(1.0, &camera());
    let mut random = Random(11);
    // Half a spacing, root mean square.
    for position in &mut cloud.positions {
        position[2] += ((random.next() - 0.5) * 3f64.sqrt() * 2.0 * 0.008) as f32;
    }
    let frame = drawn(&cloud, &camera(), &CloudOptions::default());
    let found = against(&frame.image, &truth(&scene, &camera()));
    println!(
        "noise of half a spacing: {found:?}, {:?}",
        frame.stats.left_out
    );
    save(&frame.image, "noise");
    assert!(found.inside_db > 30.0, "{found:?}");
    assert_eq!(found.holes, 0);
}

/// Points that noise has moved outwards would widen the outline by twice its deviation, and cover 2.9 % too much.
#[test]
fn noise_does_not_widen_an_outline() {
    let scene = Scene {
        shape: Shape::Sphere,
        waves: WAVES,
    };
    let mut cloud = scene.sampled(1.0, &camera());
    let mut random = Random(17);
    // Three quarters of a spacing, root mean square, in all directions.
    for coordinate in cloud.positions.as_flattened_mut() {
        let sum: f64 = (0..12).map(|_| random.next()).sum();
        *coordinate += ((sum - 6.0) * 0.75 * 0.0161 / 3f64.sqrt()) as f32;
    }
    let frame = drawn(&cloud, &camera(), &CloudOptions::default());
    let found = against(&frame.image, &truth(&scene, &camera()));
    println!("noise in all directions: {found:?}");
    save(&frame.image, "noisy-sphere");
    assert!(found.inside_db > 38.0, "{found:?}");
    assert!(found.false_fill < 0.014, "{found:?}");
    assert_eq!(found.holes, 0);
}

#[test]
fn flying_pixels_are_left_out() {
    let scene = Scene {
        shape: Shape::Plane,
        waves: WAVES,
    };
    let mut cloud = scene.sampled(1.0, &camera());
    for i in 0..50 {
        cloud.positions.push([
            0.04 * i as f32 - 1.0,
            0.3 * (i % 5) as f32 - 0.6,
            -0.1 - 0.001 * i as f32,
        ]);
        cloud.colours.push([0, 0, 0]);
    }
    let prepared = prepare(&cloud).expect("points");
    println!("{:?} of 50 are isolated", prepared.left_out);
    assert!(
        (45..=60).contains(&prepared.left_out.isolated),
        "{:?}",
        prepared.left_out
    );
}

/// Dust in the air above a plane: its specks are one another's neighbours. A sparse plane beside the dense one stays.
#[test]
fn dust_is_left_out_and_a_sparse_surface_stays() {
    let mut random = Random(9);
    let mut place = |low: [f64; 3], high: [f64; 3]| -> [f32; 3] {
        std::array::from_fn(|i| (low[i] + (high[i] - low[i]) * random.next()) as f32)
    };
    let mut positions: Vec<[f32; 3]> = (0..20_000)
        .map(|_| place([0.0; 3], [20.0, 20.0, 0.0]))
        .collect();
    positions.extend((0..200).map(|_| place([0.0, 0.0, 5.0], [20.0, 20.0, 15.0])));
    positions.extend((0..600).map(|_| place([30.0, 0.0, 0.0], [60.0, 20.0, 0.0])));
    let prepared = prepare(&of_places(positions)).expect("points");
    let above = prepared.discs.iter().filter(|disc| disc.position[2] > 2.0);
    let (above, beside) = (
        above.count(),
        prepared
            .discs
            .iter()
            .filter(|disc| disc.position[0] > 25.0)
            .count(),
    );
    println!("{above} of 200 specks and {beside} of 600 points beside are kept");
    assert!(above <= 20 && beside >= 580, "{above} {beside}");
}

#[test]
fn depth_is_that_of_the_surface() {
    let scene = Scene {
        shape: Shape::Sphere,
        waves: WAVES,
    };
    let camera = camera();
    let image = drawn(
        &scene.sampled(1.0, &camera),
        &camera,
        &CloudOptions::default(),
    )
    .image;
    let depth = image.depth.expect("depth");
    // The sphere's front lies one radius before its middle.
    let expected = DVec3::new(0.6, -0.8, -3.0).length() - 1.0;
    let found = f64::from(depth[96 * 256 + 128]);
    assert!(
        (found - expected).abs() < 1e-3,
        "{found} against {expected}"
    );
    assert_eq!(depth[0], f32::INFINITY);
}

#[test]
fn threads_do_not_change_the_bytes() {
    let scene = Scene {
        shape: Shape::Sphere,
        waves: WAVES,
    };
    let cloud = scene.sampled(2.0, &camera());
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| drawn(&cloud, &camera(), &CloudOptions::default()).image)
    };
    assert!(
        with(1) == with(3),
        "one thread and three draw different pictures"
    );
}

/// Windows begin at edges of 16 px, and the renderer's own tiles are larger.
#[test]
fn a_window_has_the_pixels_of_the_whole() {
    let scene = Scene {
        shape: Shape::Sphere,
        waves: WAVES,
    };
    let prepared = prepare(&scene.sampled(0.5, &camera())).expect("points");
    let mut renderer = CloudRenderer::new(prepared, &CloudOptions::default()).expect("options");
    let whole = renderer.render(&camera()).expect("a frame").image;
    for (first, size) in [
        ([16, 48], [100, 61]),
        ([64, 80], [1, 1]),
        ([0, 0], [256, 16]),
    ] {
        let window = renderer.render_window(&camera(), first, size);
        let window = window.expect("a frame").image;
        let (depth, all) = (window.depth.as_ref(), whole.depth.as_ref());
        for (x, y) in (0..size[0]).flat_map(|x| (0..size[1]).map(move |y| (x, y))) {
            let [column, row] = [first[0] + x, first[1] + y];
            assert_eq!(window.pixel(x, y), whole.pixel(column, row), "{x} {y}");
            let expected = all.map(|depth| depth[row * 256 + column]);
            assert_eq!(depth.map(|depth| depth[y * size[0] + x]), expected);
        }
    }
}

fn of_places(positions: Vec<[f32; 3]>) -> PointCloud {
    PointCloud {
        origin_in_world: DVec3::ZERO,
        colours: vec![[200; 3]; positions.len()],
        positions,
    }
}

#[test]
fn bad_clouds_are_refused() {
    let refused = |cloud: &PointCloud, word: &str| {
        let text = prepare(cloud).unwrap_err().to_string();
        assert!(text.contains(word), "{text}");
    };
    refused(&of_places(Vec::new()), "no points");
    refused(&of_places(vec![[0.0; 3], [0.0, f32::NAN, 1.0]]), "point 1");
    refused(&of_places(vec![[f32::INFINITY; 3]]), "point 0");
    let mut short = of_places(vec![[0.0; 3]; 3]);
    short.colours.pop();
    refused(&short, "2 colours");
    let lost = PointCloud {
        origin_in_world: DVec3::NAN,
        ..of_places(vec![[0.0; 3]])
    };
    refused(&lost, "origin");
    let options = CloudOptions {
        sigma_spacings: f64::NAN,
        ..CloudOptions::default()
    };
    let prepared = prepare(&of_places(vec![[0.0; 3]])).expect("a point");
    assert!(CloudRenderer::new(prepared, &options).is_err());
}

#[test]
fn points_without_spacing_are_counted_and_not_drawn() {
    for count in [1, 2, 100, 5000] {
        let cloud = of_places(vec![[0.1, 0.2, 0.3]; count]);
        let frame = drawn(&cloud, &camera(), &CloudOptions::default());
        assert_eq!(frame.stats.left_out.without_spacing, count as u64);
        assert_eq!(frame.stats.seen, 0);
    }
}

#[test]
fn few_points_and_points_on_a_line_draw_something_finite() {
    for count in [2u8, 3, 5, 40] {
        let cloud = of_places(
            (0..count)
                .map(|i| [0.02 * f32::from(i), 0.0, 0.0])
                .collect(),
        );
        let image = drawn(&cloud, &camera(), &CloudOptions::default()).image;
        assert!(
            image.rgba.iter().flatten().all(|c| c.is_finite()),
            "{count} points"
        );
    }
}

#[test]
fn an_offset_of_1e7_changes_nothing_that_can_be_seen() {
    let scene = Scene {
        shape: Shape::Sphere,
        waves: WAVES,
    };
    let near = scene.sampled(1.0, &camera());
    let offset = DVec3::new(1e7, -1e7, 3e7);
    let far = PointCloud {
        origin_in_world: offset,
        ..near.clone()
    };
    let moved = pose(DVec3::new(0.6, -0.8, -3.0) + offset, offset);
    let moved = Camera::perspective(&moved, 0.9, [256, 192]).expect("a camera");
    let options = CloudOptions::default();
    let (near, far) = (
        drawn(&near, &camera(), &options),
        drawn(&far, &moved, &options),
    );
    let pairs = near
        .image
        .rgba
        .iter()
        .flatten()
        .zip(far.image.rgba.iter().flatten());
    let differ = pairs.filter(|(a, b)| (*a - *b).abs() > 1e-3).count();
    assert!(differ < 40, "{differ} values differ");
}

#[test]
fn points_across_the_eye_plane_draw_those_in_front() {
    let mut random = Random(1);
    let mut at = |size: f64| (size * (2.0 * random.next() - 1.0)) as f32;
    // A floor one unit below the eye, that the eye stands on.
    let floor = of_places((0..20_000).map(|_| [at(5.0), 1.0, at(5.0)]).collect());
    for position in [
        DVec3::ZERO,
        DVec3::new(0.0, 0.99, 0.0),
        DVec3::new(0.0, 1.0, 0.0),
    ] {
        for height in [64, 192] {
            let pose = pose(position, position + DVec3::Z);
            let camera = Camera::perspective(&pose, 1.2, [256, height]).expect("a camera");
            let image = drawn(&floor, &camera, &CloudOptions::default()).image;
            assert!(image.rgba.iter().flatten().all(|c| (0.0..=1.0).contains(c)));
            let depth = image.depth.expect("depth");
            assert!(depth.iter().all(|d| *d > 0.0), "at {position}");
        }
    }
}

#[test]
fn a_disc_takes_52_bytes() {
    assert!(size_of::<Disc>() == 52);
}

/// Writes a picture to the folder that `CLOUD_PICTURES` names, if it does.
fn save(image: &Image, name: &str) {
    if let Ok(folder) = std::env::var("CLOUD_PICTURES") {
        let mut bytes = format!("P6 {} {} 255\n", image.width, image.height).into_bytes();
        let image = image.clone().over_background([0.1, 0.0, 0.2]);
        bytes.extend(image.srgb8().concat());
        std::fs::write(format!("{folder}/{name}.ppm"), bytes).expect("a file");
    }
}
