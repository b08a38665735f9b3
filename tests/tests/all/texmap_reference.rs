//! Holds the texture renderer to brute force: f64 rays against triangles, on scenes made by formulas.

use glam::DVec3;
use resample_core::metrics::{Mask, compare};
use resample_core::simd::SimdLevel;
use resample_core::{Camera, Image, LookAt};
use resample_tests::meshes::texture_scenes::looking_camera;
use resample_tests::meshes::textured::{checker, ground, photo, trefoil, wall, zone_plate};
use resample_tests::meshes::textures::reference_picture;
use texmap::{Method, RenderOptions, Renderer, Scene};

/// Rays along a pixel's side.
const RAYS: usize = 8;

/// The same where many texels share a pixel, up to the horizon: with fewer, the truth itself is noisy.
const HORIZON_RAYS: usize = 32;

fn rendered(scene: &Scene, camera: &Camera, options: &RenderOptions) -> Image {
    let mut renderer = Renderer::new(scene, options).expect("options within their ranges");
    renderer.render(camera).expect("a valid camera").image
}

fn psnr_db(image: &Image, truth: &Image) -> f64 {
    compare(image, truth, Some(&Mask::from_alpha(truth)))
        .expect("pictures of one size")
        .psnr_db
}

/// As [`psnr_db`], over the pixels whose filter the surface fills: what textures are filtered to, without outlines.
fn inner_db(image: &Image, truth: &Image) -> f64 {
    let inside = truth.rgba.iter().map(|pixel| pixel[3] > 0.999_99).collect();
    let mask = Mask::new(truth.width, truth.height, inside).expect("one flag a pixel");
    compare(image, truth, Some(&mask))
        .expect("pictures of one size")
        .psnr_db
}

fn with(method: Method) -> RenderOptions {
    RenderOptions {
        method,
        ..RenderOptions::default()
    }
}

/// Hybrid is near the truth, `least_db` inside the surface, and 6 dB better there than every single-sample method.
/// Outlines included it is at least 45 dB: these small pictures consist of them, and so few rays see them in steps.
fn check(name: &str, scene: &Scene, camera: &Camera, (rays, least_db): (usize, f64)) {
    let truth = reference_picture(scene, camera, rays);
    let image = rendered(scene, camera, &RenderOptions::default());
    let (whole, hybrid) = (psnr_db(&image, &truth), inner_db(&image, &truth));
    println!("{name}: hybrid {hybrid:.1} dB inside, {whole:.1} dB with outlines");
    assert!(
        whole >= 45.0,
        "{name}: hybrid is {whole:.1} dB from the truth with outlines"
    );
    assert!(
        hybrid >= least_db,
        "{name}: hybrid is {hybrid:.1} dB from the truth, expected {least_db}"
    );
    for method in [
        Method::BackwardNearest,
        Method::BackwardBilinear,
        Method::BackwardTrilinear,
        Method::BackwardEwa,
    ] {
        let backward = inner_db(&rendered(scene, camera, &with(method)), &truth);
        println!("{name}: {method:?} {backward:.1} dB");
        assert!(
            hybrid >= backward + 6.0,
            "{name}: {method:?} {backward:.1} dB, hybrid {hybrid:.1} dB"
        );
    }
}

#[test]
fn a_slanted_zone_plate() {
    let camera = looking_camera(DVec3::new(0.9, 0.7, 1.6), DVec3::ZERO, 50.0, [96, 72]);
    check(
        "zone plate",
        &wall(zone_plate(256, 0.5)),
        &camera,
        (RAYS, 55.0),
    );
}

#[test]
fn a_minified_photo() {
    let camera = looking_camera(DVec3::new(-1.4, 0.4, 1.5), DVec3::ZERO, 55.0, [90, 70]);
    check("photo", &wall(photo(512)), &camera, (RAYS, 55.0));
}

#[test]
fn a_checkerboard_to_the_horizon() {
    let camera = looking_camera(
        DVec3::new(0.0, 1.0, 2.0),
        DVec3::new(0.3, 0.75, 0.0),
        60.0,
        [64, 48],
    );
    check(
        "horizon",
        &ground(checker(64, 8), 60.0, 30.0),
        &camera,
        (HORIZON_RAYS, 48.0),
    );
}

#[test]
fn a_magnified_texture_is_as_sharp_as_bilinear() {
    let scene = wall(photo(32));
    let camera = looking_camera(DVec3::new(0.2, 0.1, 1.2), DVec3::ZERO, 60.0, [96, 96]);
    let truth = reference_picture(&scene, &camera, RAYS);
    let hybrid = psnr_db(
        &rendered(&scene, &camera, &RenderOptions::default()),
        &truth,
    );
    let bilinear = psnr_db(
        &rendered(&scene, &camera, &with(Method::BackwardBilinear)),
        &truth,
    );
    println!("magnified: hybrid {hybrid:.1} dB, bilinear {bilinear:.1} dB");
    assert!(
        hybrid >= bilinear - 1.0,
        "hybrid {hybrid:.1} dB, bilinear {bilinear:.1} dB"
    );
    assert!(hybrid >= 55.0, "hybrid {hybrid:.1} dB");
}

#[test]
fn parallel_rays_are_held_to_the_same_truth() {
    let pose = LookAt {
        position: DVec3::new(1.0, 2.0, 3.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    let camera = Camera::orthographic(&pose, 2.6, [80, 80]).expect("valid");
    check("orthographic", &wall(photo(256)), &camera, (RAYS, 55.0));
}

#[test]
fn a_photo_far_away_is_gathered_from_coarse_levels() {
    let scene = wall(photo(512));
    let camera = looking_camera(DVec3::new(-1.4, 0.4, 3.5), DVec3::ZERO, 40.0, [64, 64]);
    let truth = reference_picture(&scene, &camera, HORIZON_RAYS);
    let image = rendered(&scene, &camera, &RenderOptions::default());
    let error_db = inner_db(&image, &truth);
    println!("levels: {error_db:.1} dB");
    // The stated error of starting from a coarser level.
    assert!(error_db > 55.0, "the level costs {error_db:.1} dB");
}

#[test]
fn a_ground_seen_from_close_above_is_filtered_in_perspective() {
    let scene = ground(zone_plate(1024, 0.4), 60.0, 1.0);
    let camera = looking_camera(
        DVec3::new(0.0, 0.4, 1.0),
        DVec3::new(0.0, 0.2, 0.0),
        70.0,
        [48, 36],
    );
    let truth = reference_picture(&scene, &camera, HORIZON_RAYS);
    let image = rendered(&scene, &camera, &RenderOptions::default());
    let error_db = inner_db(&image, &truth);
    println!("close above: {error_db:.2} dB");
    assert!(error_db > 55.0, "{error_db:.2} dB from the truth");
}

/// Pixels of a finely divided surface see several of its triangles, and gather texels from one plane through them. Each bound
/// is half a decibel below the measured PSNR.
#[test]
fn a_finely_divided_knot_is_gathered_from_planes() {
    let camera = looking_camera(DVec3::new(2.0, 3.0, 9.0), DVec3::ZERO, 46.0, [96, 96]);
    for (side, repeats, least_db) in [(64, 8.0, 78.9), (128, 16.0, 71.4)] {
        let scene = trefoil(photo(side), repeats);
        let truth = reference_picture(&scene, &camera, HORIZON_RAYS);
        let image = rendered(&scene, &camera, &RenderOptions::default());
        let error_db = inner_db(&image, &truth);
        println!("knot, {repeats} repeats: {error_db:.2} dB");
        assert!(error_db > least_db, "{repeats} repeats: {error_db:.2} dB");
    }
}

#[test]
fn one_picture_for_any_number_of_threads() {
    let scene = wall(photo(128));
    let camera = looking_camera(DVec3::new(-1.4, 0.4, 1.5), DVec3::ZERO, 55.0, [90, 70]);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| rendered(&scene, &camera, &RenderOptions::default()))
    };
    assert_eq!(
        on(1).rgba,
        on(4).rgba,
        "the number of threads changes the picture"
    );
}

#[test]
fn vector_instructions_change_nothing_but_rounding() {
    let scene = wall(photo(128));
    let camera = looking_camera(DVec3::new(-1.4, 0.4, 1.5), DVec3::ZERO, 55.0, [90, 70]);
    let with = |simd: SimdLevel| {
        rendered(
            &scene,
            &camera,
            &RenderOptions {
                simd,
                ..RenderOptions::default()
            },
        )
        .rgba
    };
    let (auto, plain) = (with(SimdLevel::Auto), with(SimdLevel::Baseline));
    let worst = auto
        .iter()
        .flatten()
        .zip(plain.iter().flatten())
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f32::max);
    assert!(
        worst < 1e-5,
        "vector instructions change the picture by {worst}"
    );
}
