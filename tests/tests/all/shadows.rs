//! Shadows that a volume casts on itself: pictures are compared with f64 integrals, and options that exclude shadows are refused.

use glam::{DAffine3, DVec2, DVec3};
use resample_core::Image;
use resample_tests::twins::rays::RaySource;
use resample_tests::volumes::lit_scenes::{
    ball, camera, fog, peaks, psnr_db, shells, solid, thin, towards, vessels, white_isosurface,
};
use resample_tests::volumes::scenes::{perspective, transfer, volume};
use resample_tests::volumes::shadow_truth::{ShadowTruth, Sky};
use volsplat::{
    Blend, Channel, Clip, ClipPlane, FieldOptions, Light, Look, Occlusion, Order, RenderOptions,
    Renderer, Reuse, Scene, Shading, Shadow, TransferFunction, Volume,
};

fn options(light_size_deg: f64) -> RenderOptions {
    RenderOptions {
        light: Light::Towards(3.0 * towards()),
        shadow: Some(Shadow { light_size_deg }),
        ..RenderOptions::default()
    }
}

fn drawn(volume: &Volume, look: &TransferFunction, options: &RenderOptions) -> Image {
    let mut renderer = Renderer::new(volume, look, options).expect("valid options");
    renderer.render(&camera()).expect("a valid camera").image
}

/// Directions over the disc of a light, in rings: not those of the renderer.
fn disc(size_deg: f64) -> Vec<DVec3> {
    let (right, up) = towards().any_orthonormal_pair();
    let mut found = Vec::new();
    for ring in 0..4 {
        let radius = (f64::from(ring) + 0.5) / 4.0 * (0.5 * size_deg).to_radians();
        // Rings of one width have areas in proportion to 1, 3, 5, ..
        for part in 0..3 * (2 * ring + 1) {
            let turn = std::f64::consts::TAU * f64::from(part) / f64::from(3 * (2 * ring + 1));
            let across = turn.cos() * right + turn.sin() * up;
            found.push(radius.cos() * towards() + radius.sin() * across);
        }
    }
    found
}

#[test]
fn hard_shadows_are_those_of_their_truth() {
    let whole = |_| true;
    for (name, volume, look, least_db) in [
        ("ball", ball(), solid(), 39.0),
        ("vessels", vessels(), solid(), 42.5),
        ("fog", fog(), thin(), 65.0),
        ("shells", shells(), peaks(), 41.0),
    ] {
        let truth = ShadowTruth::new(&volume, &look, vec![towards()], &whole);
        let truth = truth.picture(&camera(), 3);
        let db = psnr_db(&drawn(&volume, &look, &options(0.0)), &truth);
        eprintln!("{name}: {db:.1} dB");
        assert!(db >= least_db, "{name}: {db:.1} dB");
    }
}

#[test]
fn occlusion_is_that_of_its_truth() {
    let whole = |_| true;
    for (name, volume, look, least_db) in [
        ("ball", ball(), solid(), 38.0),
        ("vessels", vessels(), solid(), 40.0),
        ("fog", fog(), thin(), 58.0),
        ("shells", shells(), peaks(), 37.0),
    ] {
        let truth = ShadowTruth::new(&volume, &look, Vec::new(), &whole);
        let truth = truth.with_sky(Sky::new(60, RADIUS)).picture(&camera(), 3);
        let options = RenderOptions {
            light: Light::Headlight,
            shadow: None,
            ..with_sky()
        };
        let db = psnr_db(&drawn(&volume, &look, &options), &truth);
        eprintln!("{name}: {db:.1} dB");
        assert!(db >= least_db, "{name}: {db:.1} dB");
    }
}

#[test]
fn shadows_and_occlusion_together_are_those_of_their_truth() {
    // Matter through which light falls for some voxels, so that a cut is resolved.
    let volume = ball();
    let look = transfer(&[(0.0, [0.9, 0.7, 0.5])], &[(0.2, 0.0), (0.8, 0.3)]);
    let plane = ClipPlane {
        normal: DVec3::new(0.2, -1.0, 0.1),
        offset: -26.0,
    };
    let keeps = |at: DVec3| plane.normal.dot(at) >= plane.offset;
    let truth = ShadowTruth::new(&volume, &look, vec![towards()], &keeps);
    let truth = truth.with_sky(Sky::new(60, RADIUS)).picture(&camera(), 3);
    let options = RenderOptions {
        clip: Clip {
            planes: vec![plane],
            ..Clip::default()
        },
        ..with_sky()
    };
    let db = psnr_db(&drawn(&volume, &look, &options), &truth);
    eprintln!("both, cut: {db:.1} dB");
    assert!(db >= 36.0, "{db:.1} dB");
}

#[test]
fn opaque_matter_that_is_cut_is_as_bright_as_its_truth() {
    let (volume, look) = (ball(), solid());
    for (name, normal, least_db) in [
        ("across", DVec3::new(0.2, -1.0, 0.1), 34.0),
        // Directions that lie in the cut are wholly dark, where half of those around them see the sky: 0.8 of the light.
        ("along the grid", -DVec3::Y, 24.0),
    ] {
        let offset = -29.3;
        let plane = ClipPlane { normal, offset };
        let keeps = |at: DVec3| plane.normal.dot(at) >= plane.offset;
        let truth = ShadowTruth::new(&volume, &look, Vec::new(), &keeps);
        let truth = truth.with_sky(Sky::new(60, RADIUS)).picture(&camera(), 3);
        let options = RenderOptions {
            light: Light::Headlight,
            shadow: None,
            clip: Clip {
                planes: vec![plane],
                ..Clip::default()
            },
            ..with_sky()
        };
        let picture = drawn(&volume, &look, &options);
        let db = psnr_db(&picture, &truth);
        eprintln!("{name}: {db:.1} dB");
        assert!(db >= least_db, "{name}: {db:.1} dB");
    }
}

/// Radius of occlusion, voxels.
const RADIUS: f64 = 8.0;

/// A hard light and a sky.
fn with_sky() -> RenderOptions {
    RenderOptions {
        occlusion: Some(Occlusion {
            radius: Some(RADIUS),
        }),
        ..options(0.0)
    }
}

#[test]
fn occlusion_counts_lengths_in_the_world() {
    // The same matter with voxels half as deep along z: a plate with a pit, which ends before the volume does.
    let pit = |p: DVec3| {
        let beside = (p.x - 16.0).abs().max((p.y - 16.0).abs()) - 13.0;
        let plate = ((p.z - 10.0).abs() - 4.0).max(beside);
        let hole = 5.0 - (p - DVec3::new(16.0, 16.0, 14.0)).length();
        (0.5 - plate.max(hole) / 4.0).clamp(0.0, 1.0)
    };
    let even = volume([33, 33, 25], DAffine3::IDENTITY, pit);
    let flat = DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.5));
    let stretched = volume([33, 33, 49], flat, |p| pit(flat.transform_point3(p)));
    let middle = DVec3::new(16.0, 16.0, 12.0);
    let eye = middle + 70.0 * DVec3::new(0.3, 0.2, 0.9).normalize();
    let camera = perspective(eye, middle, 30.0, [40; 2]);
    let look = solid();
    let picture = |volume: &Volume| {
        let options = RenderOptions {
            light: Light::Headlight,
            shadow: None,
            opacity_unit: Some(1.0),
            ..with_sky()
        };
        let mut renderer = Renderer::new(volume, &look, &options).expect("valid options");
        renderer.render(&camera).expect("a valid camera").image
    };
    let db = psnr_db(&picture(&stretched), &picture(&even));
    eprintln!("stretched: {db:.1} dB");
    // Directions that lead between vertices are rounded to them: 43.2 dB.
    assert!(db >= 42.0, "{db:.1} dB");
}

#[test]
fn soft_shadows_are_those_of_their_truth() {
    let whole = |_| true;
    let (volume, look) = (ball(), solid());
    // Smaller lights have fewer directions.
    for size_deg in [2.0, 20.0] {
        let truth = ShadowTruth::new(&volume, &look, disc(size_deg), &whole);
        let truth = truth.picture(&camera(), 3);
        let db = psnr_db(&drawn(&volume, &look, &options(size_deg)), &truth);
        eprintln!("soft, {size_deg} degrees: {db:.1} dB");
        assert!(db >= 38.0, "{size_deg} degrees: {db:.1} dB");
    }
}

#[test]
fn what_is_cut_away_casts_no_shadow() {
    let volume = ball();
    let look = transfer(&[(0.0, [0.9, 0.7, 0.5])], &[(0.2, 0.0), (0.8, 0.3)]);
    // The ball is cut through its middle, across the light.
    let plane = ClipPlane {
        normal: DVec3::new(0.2, -1.0, 0.1),
        offset: -24.0,
    };
    let keeps = |at: DVec3| plane.normal.dot(at) >= plane.offset;
    let truth = ShadowTruth::new(&volume, &look, vec![towards()], &keeps);
    let truth = truth.picture(&camera(), 3);
    let options = RenderOptions {
        clip: Clip {
            planes: vec![plane],
            ..Clip::default()
        },
        ..options(0.0)
    };
    let db = psnr_db(&drawn(&volume, &look, &options), &truth);
    eprintln!("cut: {db:.1} dB");
    assert!(db >= 45.0, "{db:.1} dB");
}

#[test]
fn shadows_follow_light_and_clip_and_go_with_the_option() {
    let (volume, look) = (ball(), solid());
    let plain = RenderOptions {
        shadow: None,
        ..options(0.0)
    };
    let mut renderer = Renderer::new(&volume, &look, &plain).expect("valid options");
    let mut draw = |options: &RenderOptions, clip: Option<Clip>| {
        assert_eq!(
            renderer.update(options).expect("valid options"),
            Reuse::Kept
        );
        if let Some(clip) = clip {
            renderer.update_clip(clip).expect("a valid clip");
        }
        renderer.render(&camera()).expect("a valid camera").image
    };
    let before = draw(&plain, None);
    let with = draw(&options(0.0), None);
    assert_eq!(with.rgba, drawn(&volume, &look, &options(0.0)).rgba);
    assert_ne!(with.rgba, before.rgba);
    assert_eq!(draw(&plain, None).rgba, before.rgba, "off again");
    let clip = Clip {
        planes: vec![ClipPlane {
            normal: -DVec3::Y,
            offset: -24.0,
        }],
        ..Clip::default()
    };
    let cut = draw(&options(0.0), Some(clip.clone()));
    let own = RenderOptions {
        clip,
        ..options(0.0)
    };
    assert_eq!(cut.rgba, drawn(&volume, &look, &own).rgba);
}

#[test]
fn channels_cast_one_shadow_together() {
    // Two channels of half the extinction each are one: 1 - (1 - a)^(1/2).
    let (volume, fog) = (fog(), thin());
    let half = transfer(
        &[(0.0, [0.8; 3])],
        &[(0.0, 0.0), (1.0, 1.0 - 0.85f64.sqrt())],
    );
    let channel = || Channel {
        volume: &volume,
        look: Look::Transfer(&half),
    };
    let scene = Scene {
        channels: vec![channel(), channel()],
        mask: None,
    };
    for shadow in [None, options(0.0).shadow] {
        let options = RenderOptions {
            shadow,
            ..options(0.0)
        };
        let mut renderer = Renderer::with_scene(&scene, &options).expect("valid options");
        let together = renderer.render(&camera()).expect("a valid camera").image;
        let db = psnr_db(&together, &drawn(&volume, &fog, &options));
        // So near they are without shadows: 43.9 dB.
        assert!(db >= 43.0, "{shadow:?}: {db:.1} dB");
    }
}

#[test]
fn opacity_is_that_without_shadows_and_lit_places_keep_their_brightness() {
    let (volume, look) = (ball(), solid());
    let plain = RenderOptions {
        shadow: None,
        ..options(0.0)
    };
    let (with, without) = (
        drawn(&volume, &look, &options(0.0)),
        drawn(&volume, &look, &plain),
    );
    let mut ratios = Vec::new();
    for (with, without) in with.rgba.iter().zip(&without.rgba) {
        assert!((with[3] - without[3]).abs() < 1e-5, "opacity is the same");
        if without[3] > 0.99 {
            ratios.push(with[0] / without[0]);
        }
    }
    ratios.sort_by(f32::total_cmp);
    let at = |share: f64| ratios[(share * (ratios.len() - 1) as f64) as usize];
    // In shadow the ambient light is left.
    assert!((at(0.0) - 0.3).abs() < 0.05, "darkest {}", at(0.0));
    assert!((0.8..1.4).contains(&at(0.6)), "lit {}", at(0.6));
}

#[test]
fn occlusion_keeps_the_brightness_of_pictures() {
    for (name, volume, look) in [
        ("ball", ball(), solid()),
        ("vessels", vessels(), solid()),
        ("fog", fog(), thin()),
        ("shells", shells(), peaks()),
    ] {
        for shading in [Shading::None, Shading::Lambert] {
            let plain = RenderOptions {
                shading,
                light: Light::Headlight,
                ..RenderOptions::default()
            };
            let occluded = RenderOptions {
                occlusion: Some(Occlusion::default()),
                ..plain.clone()
            };
            let [before, after] = [&plain, &occluded].map(|options| {
                let picture = drawn(&volume, &look, options);
                let light = |pixel: &[f32; 4]| f64::from(pixel[0] + pixel[1] + pixel[2]);
                picture.rgba.iter().map(light).sum::<f64>()
            });
            let ratio = after / before;
            eprintln!("{name} {shading:?}: {ratio:.3}");
            // The six views whose mean is held are not this one; fourteen scans had 0.96 to 1.21.
            assert!((0.8..1.25).contains(&ratio), "{name} {shading:?}: {ratio}");
        }
    }
}

#[test]
fn an_isosurface_casts_the_shadow_of_its_shape() {
    // A ball of radius 10 over a plate, lit from straight above: the shadow is a disc below it.
    let (volume, look) = (ball(), solid());
    let options = RenderOptions {
        order: white_isosurface(),
        light: Light::Towards(DVec3::Y),
        ..options(0.0)
    };
    let camera = camera();
    let image = drawn(&volume, &look, &options);
    let rays = RaySource::new(&camera, &volume.world_from_index);
    let (mut lit, mut dark) = (0, 0);
    for (place, pixel) in image.rgba.iter().enumerate() {
        let width = camera.width as usize;
        let at = DVec2::new((place % width) as f64, (place / width) as f64) + 0.5;
        let ray = rays.ray(at);
        let towards = ray.direction;
        let on_plate = ray.origin + (12.0 - ray.origin.y) / towards.y * towards;
        let from_middle = (on_plate - DVec3::new(28.0, 12.0, 28.0)).abs();
        let to_ball = DVec3::new(28.0, 30.0, 28.0) - ray.origin;
        let misses = to_ball.reject_from(towards).length() > 12.0;
        if !misses || from_middle.x.max(from_middle.z) > 20.0 {
            continue;
        }
        let radius = from_middle.length();
        if radius > 12.0 {
            lit += 1;
            assert!(
                (pixel[0] - 1.0).abs() < 0.03,
                "lit at {radius:.1}: {pixel:?}"
            );
        } else if radius < 8.0 {
            dark += 1;
            assert!(
                (pixel[0] - 0.3).abs() < 0.03,
                "dark at {radius:.1}: {pixel:?}"
            );
        }
    }
    assert!(lit > 50 && dark > 10, "{lit} lit and {dark} dark pixels");
}

#[test]
fn looks_without_shadows_refuse_them() {
    let (volume, look) = (ball(), solid());
    let of_blend = |blend: Blend| RenderOptions {
        order: Order::Field(FieldOptions {
            blend,
            ..FieldOptions::default()
        }),
        ..options(0.0)
    };
    let headlight = RenderOptions {
        light: Light::Headlight,
        ..options(0.0)
    };
    let of_radius = |radius: f64| RenderOptions {
        occlusion: Some(Occlusion {
            radius: Some(radius),
        }),
        ..RenderOptions::default()
    };
    for (refused, why) in [
        (of_blend(Blend::Maximum), "have no light"),
        (of_radius(0.0), "above 0"),
        (of_radius(f64::INFINITY), "above 0"),
        (headlight, "give the light a direction"),
        (options(91.0), "0 to 90 degrees"),
        (options(f64::NAN), "0 to 90 degrees"),
    ] {
        let error = Renderer::new(&volume, &look, &refused).expect_err("refused");
        assert!(error.to_string().contains(why), "{error}");
    }
}
