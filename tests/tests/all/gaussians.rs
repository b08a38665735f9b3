//! Gaussians drawn as a volume: against their f64 twin from several cameras, whatever the threads, windows, order and offset.

use std::sync::Arc;

use glam::{DVec2, DVec3, Quat, Vec3};
use resample_core::{Camera, Image, LookAt};
use resample_tests::gaussians::popping::{Turn, blended};
use resample_tests::gaussians::scenes::{Numbers, ball, camera, knot};
use resample_tests::gaussians::twin::GaussianTwin;
use resample_tests::gaussians::viewers::ViewerTwin;
use volsplat::{
    Clip, ClipPlane, DepthPlane, Gaussian, GaussianLayer, GaussianModel, GaussianOptions,
    GaussianRenderer, Gaussians, PixelSamples,
};

fn drawn(gaussians: &Arc<Gaussians>, camera: &Camera) -> Image {
    let options = GaussianOptions::default();
    let mut renderer = GaussianRenderer::new(gaussians.clone(), &options).expect("options");
    renderer.render(camera).expect("a frame").image
}

/// Peak signal to noise over some covered pixels, dB: colours and opacity.
fn agreement(gaussians: &Arc<Gaussians>, camera: &Camera, count: usize) -> f64 {
    let image = drawn(gaussians, camera);
    let twin = GaussianTwin::new(gaussians, camera);
    let mut numbers = Numbers(5);
    let (mut squares, mut found) = (0.0, 0);
    while found < count {
        let x = (numbers.uniform() * f64::from(camera.width)) as usize;
        let y = (numbers.uniform() * f64::from(camera.height)) as usize;
        let got = blended(image.pixel(x, y));
        if got[3] < 0.02 {
            continue;
        }
        let wanted = twin.pixel(x, y);
        squares += got
            .iter()
            .zip(wanted)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            / 4.0;
        found += 1;
    }
    -10.0 * (squares / count as f64).log10()
}

#[test]
fn pictures_agree_with_the_twin_near_in_the_middle_wide_and_far() {
    let (dense, sparse) = (Arc::new(knot(1000, 1)), Arc::new(knot(400, 1)));
    let from = |distance: f64| distance * DVec3::new(0.3, 0.4, 1.0).normalize();
    // Far away every ray meets a large part of them all, and the twin's time grows with the square of their number.
    for (name, knot, camera, least) in [
        ("near", &dense, camera(from(1.7), 50.0, [64, 48]), 45.0),
        ("middle", &dense, camera(from(4.0), 40.0, [64, 48]), 45.0),
        ("wide", &dense, camera(from(1.1), 120.0, [64, 48]), 45.0),
        ("far", &sparse, camera(from(24.0), 40.0, [64, 48]), 40.0),
    ] {
        let db = agreement(knot, &camera, 8);
        println!("{name}: {db:.1} dB");
        assert!(
            db >= least,
            "{name}: {db:.1} dB, at least {least} are wanted"
        );
    }
}

#[test]
fn parallel_projections_agree_with_the_twin() {
    let ball = Arc::new(ball(150, 3));
    let pose = LookAt {
        position: DVec3::new(1.0, 0.5, 3.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    let camera = Camera::orthographic(&pose, 2.5, [48, 48]).expect("a camera");
    let db = agreement(&ball, &camera, 12);
    println!("{db:.1} dB");
    assert!(db >= 45.0, "{db:.1} dB");
}

fn one(opacity: f32, scales: Vec3) -> Gaussians {
    let mut all = Gaussians::with_capacity(0, 1);
    let gaussian = Gaussian {
        centre: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        scales,
        opacity,
        colour: Vec3::new(0.8, 0.5, 0.2),
    };
    all.push(&gaussian, &[]).expect("finite numbers");
    all
}

/// The share of its height that a round Gaussian of standard deviation 0.5 at the distance 5 keeps behind the pixel's Gaussian.
fn kept_height(camera: &Camera) -> f64 {
    let sigma2_px = (0.5 * camera.fx / 5.0).powi(2);
    sigma2_px / (sigma2_px + 0.25)
}

#[test]
fn one_gaussian_alone_has_its_own_opacity_and_colour() {
    let camera = camera(DVec3::new(0.0, 0.0, 5.0), 40.0, [65, 65]);
    for opacity in [0.01, 0.3, 0.9, 1.0] {
        let image = drawn(&Arc::new(one(opacity, Vec3::splat(0.5))), &camera);
        let got = blended(image.pixel(32, 32));
        let wanted = f64::from(opacity) * kept_height(&camera);
        assert!((got[3] - wanted).abs() < 1e-3 * wanted, "{got:?}");
        for (got, colour) in got.iter().zip([0.8, 0.5, 0.2]) {
            assert!((got - colour * wanted).abs() < 1e-3 * wanted, "{got}");
        }
    }
}

#[test]
fn threads_and_windows_change_no_byte() {
    let knot = Arc::new(knot(2000, 4));
    let camera = camera(DVec3::new(1.0, 0.8, 1.6), 60.0, [80, 64]);
    let with_threads = |count: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
        pool.expect("threads").install(|| drawn(&knot, &camera))
    };
    let whole = with_threads(1);
    assert_eq!(whole, with_threads(3));
    let options = GaussianOptions::default();
    let mut renderer = GaussianRenderer::new(knot.clone(), &options).expect("options");
    let window = renderer.render_window(&camera, [16, 32], [37, 20]);
    assert_eq!(
        window.expect("a frame").image,
        whole.window([16, 32], [37, 20])
    );
}

#[test]
fn clip_planes_cut_inside_a_gaussian() {
    let gaussians = Arc::new(one(0.8, Vec3::splat(0.5)));
    let camera = camera(DVec3::new(0.0, 0.0, 5.0), 40.0, [33, 33]);
    let half = ClipPlane {
        normal: DVec3::Z,
        offset: 0.0,
    };
    let options = GaussianOptions {
        clip: Clip {
            planes: vec![half],
            ..Clip::default()
        },
        ..GaussianOptions::default()
    };
    let mut renderer = GaussianRenderer::new(gaussians, &options).expect("options");
    let image = renderer.render(&camera).expect("a frame").image;
    // Half of the optical depth is left.
    let wanted = 1.0 - (1.0 - 0.8 * kept_height(&camera)).sqrt();
    let got = f64::from(image.pixel(16, 16)[3]);
    assert!((got - wanted).abs() < 1e-3, "{got}, not {wanted}");
}

#[test]
fn extremes_give_finite_pixels() {
    let eye = DVec3::new(0.0, 0.0, 5.0);
    for scales in [
        Vec3::new(1e-6, 1.0, 1.0),
        Vec3::new(1.0, 1e-6, 1e-6),
        Vec3::new(0.0, 0.5, 0.5),
        Vec3::splat(0.0),
        Vec3::splat(1e6),
        Vec3::new(5.0, 5.0, 20.0),
    ] {
        for offset in [0.0, 1e7] {
            let mut gaussians = one(1.0, scales);
            gaussians.origin_in_world = DVec3::splat(offset);
            let pose = LookAt {
                position: eye + offset,
                target: DVec3::splat(offset),
                up: DVec3::Y,
            };
            let camera = Camera::perspective(&pose, 0.7, [48, 48]).expect("a camera");
            let image = drawn(&Arc::new(gaussians), &camera);
            for pixel in &image.rgba {
                let is_sound = pixel.iter().all(|c| c.is_finite() && *c >= 0.0) && pixel[3] <= 1.0;
                assert!(is_sound, "{scales} at {offset}: {pixel:?}");
            }
        }
    }
}

#[test]
fn other_viewers_are_drawn_as_their_formulas_say() {
    let knot = Arc::new(knot(3000, 8));
    let near = camera(DVec3::new(0.6, 0.5, 1.6), 90.0, [64, 48]);
    let far = camera(DVec3::new(2.0, 3.0, 9.0), 40.0, [64, 48]);
    for model in [GaussianModel::Khr, GaussianModel::Inria, GaussianModel::Mip] {
        for camera in [&near, &far] {
            let options = GaussianOptions {
                model,
                ..GaussianOptions::default()
            };
            let mut renderer = GaussianRenderer::new(knot.clone(), &options).expect("options");
            let image = renderer.render(camera).expect("a frame").image;
            let twin = ViewerTwin::new(&knot, camera, model);
            let mut farthest = 0.0f64;
            for at in (0..64 * 48).step_by(5) {
                let (x, y) = (at % 64, at / 64);
                let got = blended(image.pixel(x, y));
                for (got, wanted) in got.iter().zip(twin.pixel(x, y)) {
                    farthest = farthest.max((got - wanted).abs());
                }
            }
            println!("{model:?}: {farthest:.5}");
            // An ellipse may end where its opacity in a pixel is the least one, and a pixel where 1e-4 of the light is left.
            assert!(farthest < 1.0 / 255.0, "{model:?}: {farthest}");
        }
    }
}

#[test]
fn a_tilted_clip_cuts_each_ray_where_it_meets_it() {
    const SIGMA: f64 = 0.5;
    const OPACITY: f64 = 0.95;
    // Two of different colours in one place, so that their slabs are thin.
    let mut both = Gaussians::default();
    for colour in [0.0, 1.0] {
        let gaussian = Gaussian {
            centre: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            scales: Vec3::splat(SIGMA as f32),
            opacity: OPACITY as f32,
            colour: Vec3::splat(colour),
        };
        both.push(&gaussian, &[]).expect("finite numbers");
    }
    // Nearly along the rays: those of one block meet it at very different depths.
    let plane = ClipPlane {
        normal: DVec3::new(1.0, 0.1, -0.15),
        offset: 0.0,
    };
    let camera = camera(DVec3::new(0.0, 0.0, 5.0), 30.0, [96, 96]);
    let options = GaussianOptions {
        clip: Clip {
            planes: vec![plane],
            ..Clip::default()
        },
        ..GaussianOptions::default()
    };
    let mut renderer = GaussianRenderer::new(Arc::new(both), &options).expect("options");
    let image = renderer.render(&camera).expect("a frame").image;
    let world_from_camera = camera.camera_from_world.inverse();
    for at in (0..96 * 96).step_by(7) {
        let pos_in_screen = DVec2::new((at % 96) as f64 + 0.5, (at / 96) as f64 + 0.5);
        let (origin, direction) = camera.ray_in_camera(pos_in_screen);
        let origin = world_from_camera.transform_point3(origin);
        let direction = world_from_camera.transform_vector3(direction).normalize();
        let along = -origin.dot(direction);
        let q = (origin.length_squared() - along * along) / (SIGMA * SIGMA);
        let depth = -2.0 * (-OPACITY * (-0.5 * q).exp()).ln_1p();
        let (towards, from) = (plane.normal.dot(direction), plane.normal.dot(origin));
        let x = (-from / towards - along) / (5.0f64.sqrt() * SIGMA);
        let x = x.clamp(-1.0, 1.0);
        let before = 0.5 + x * (0.75 - 0.25 * x * x);
        let share = if towards > 0.0 { 1.0 - before } else { before };
        let wanted = -(-depth * share).exp_m1();
        let got = f64::from(image.pixel(at % 96, at / 96)[3]);
        // The pixel's Gaussian, which the formula leaves out, blurs the cut.
        assert!(
            (got - wanted).abs() < 0.005,
            "{got} instead of {wanted} at {pos_in_screen}"
        );
    }
}

/// The order by centre is the control: it jumps where the volume does not.
#[test]
fn nothing_pops_while_the_view_turns() {
    let knot = Arc::new(knot(300, 6));
    let turn = Turn {
        eye: 1.7 * DVec3::new(0.3, 0.4, 1.0).normalize(),
        step_deg: 0.05,
        steps: 60,
        fov_y_deg: 50.0,
        size: [48, 36],
    };
    let jumps = turn.jumps(&knot, &GaussianOptions::default());
    for jump in &jumps[..3] {
        let truth = turn.true_jump(&knot, jump);
        println!("{jump:?}, in truth {truth:.5}");
        assert!(
            jump.size < truth + 1.0 / 255.0,
            "{jump:?}, in truth {truth}"
        );
    }
    let by_centre = GaussianOptions {
        model: GaussianModel::Khr,
        ..GaussianOptions::default()
    };
    let sorted = turn.jumps(&knot, &by_centre);
    println!("by centre: {:?}", sorted[0]);
    assert!(sorted[0].size > 1.0 / 255.0, "{:?}", sorted[0]);
}

#[test]
fn depths_are_those_of_the_gaussians_that_take_the_light() {
    let mut two = Gaussians::default();
    for (z, opacity) in [(1.0, 0.3), (-1.0, 0.9)] {
        let gaussian = Gaussian {
            centre: Vec3::new(0.0, 0.0, z),
            rotation: Quat::IDENTITY,
            scales: Vec3::new(0.5, 0.5, 0.01),
            opacity,
            colour: Vec3::ONE,
        };
        two.push(&gaussian, &[]).expect("finite numbers");
    }
    let camera = camera(DVec3::new(0.0, 0.0, 5.0), 40.0, [33, 33]);
    for samples in [PixelSamples::One, PixelSamples::Four] {
        let options = GaussianOptions {
            samples,
            depth: DepthPlane::Expected,
            layers: vec![GaussianLayer::MedianDepth],
            ..GaussianOptions::default()
        };
        let mut renderer = GaussianRenderer::new(Arc::new(two.clone()), &options).expect("options");
        let image = renderer.render(&camera).expect("a frame").image;
        let median = &image.planes[0].values;
        assert!((median[16 * 33 + 16] - 6.0).abs() < 0.05, "{samples:?}");
        assert_eq!(
            median[0],
            f32::INFINITY,
            "{samples:?}: little is lost there"
        );
    }
}
