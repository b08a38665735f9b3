//! A renderer that keeps all of its volume and takes change after change draws the same bytes as a new one for each.

use glam::{DAffine3, DVec3};
use resample_core::Camera;
use resample_tests::choices::with_field;
use resample_tests::volumes::scenes::{
    coloured, orthographic, perspective, sheared_grid, transfer, volume,
};
use volsplat::{
    Blend, Channel, Clip, ClipPlane, GradientOpacity, Isosurface, Look, RenderOptions, Renderer,
    Scene, Shading, TransferFunction, Volume, Voxels,
};

const DIMS: [usize; 3] = [37, 26, 44];

/// Waves from 0 to 255, and nothing in a corner.
fn waves(grid: DAffine3) -> Volume {
    volume(DIMS, grid, |p| {
        let wave = (0.31 * p.x).sin() + (0.27 * p.y + 0.2 * p.z).cos();
        if p.x + p.y < 25.0 {
            0.0
        } else {
            (127.5 + 63.7 * wave).round()
        }
    })
}

/// The same of bytes.
fn bytes(volume: &Volume) -> Volume {
    let values = (0..volume.len()).map(|i| volume.value(i) as u8).collect();
    Volume::new(volume.dims, Voxels::U8(values), volume.world_from_index).expect("as many")
}

fn cameras(grid: DAffine3) -> [Camera; 2] {
    let end = DVec3::from(DIMS.map(|n| (n - 1) as f64));
    let target = grid.transform_point3(0.5 * end);
    let size = (grid.matrix3 * end).length();
    let eye = target + size * DVec3::new(0.9, 0.55, -1.0);
    [
        perspective(eye, target, 40.0, [72, 60]),
        orthographic(eye, target, 0.9 * size, [72, 60]),
    ]
}

/// Shows the scalars from one to another, the second with this opacity.
fn shows(low: f64, high: f64, opacity: f64) -> TransferFunction {
    let colours = [(0.0, [0.1, 0.2, 1.0]), (255.0, [1.0, 0.3, 0.1])];
    let opacities = [(low, 0.0), (high, opacity), (high + 1.0, 0.0)];
    transfer(&colours, &opacities)
}

fn blended(blend: Blend) -> RenderOptions {
    with_field(RenderOptions::default(), |field| field.blend = blend)
}

/// What a viewer may ask for, one after another: more, less, nothing, all; a shell; light, a clip, other blends.
fn looks() -> Vec<(&'static str, TransferFunction, RenderOptions)> {
    let plain = RenderOptions::default;
    let lit = |shading| RenderOptions { shading, ..plain() };
    let clipped = RenderOptions {
        clip: Clip {
            crop_in_grid: Some([DVec3::splat(3.0), DVec3::new(30.5, 20.0, 31.0)]),
            planes: vec![ClipPlane {
                normal: DVec3::new(1.0, 0.3, 0.2),
                offset: 9.0,
            }],
            ..Clip::default()
        },
        ..plain()
    };
    let surface = Blend::Isosurface(Isosurface {
        value: 170.0,
        colour: None,
        opacity: 0.8,
    });
    vec![
        ("little", shows(200.0, 240.0, 0.4), plain()),
        ("more", shows(90.0, 240.0, 0.2), plain()),
        ("other", shows(20.0, 70.0, 0.3), plain()),
        ("nothing", shows(300.0, 310.0, 0.3), plain()),
        ("all", coloured(0.1), plain()),
        ("a shell", shows(127.0, 129.0, 0.9), plain()),
        ("lit, little", shows(220.0, 240.0, 0.6), lit(Shading::Phong)),
        ("lit, more", shows(120.0, 240.0, 0.6), lit(Shading::Phong)),
        ("diffuse", shows(180.0, 240.0, 0.6), lit(Shading::Lambert)),
        ("clipped", shows(90.0, 240.0, 0.2), clipped),
        ("maximum", shows(90.0, 240.0, 0.2), blended(Blend::Maximum)),
        ("surface", shows(90.0, 240.0, 0.2), blended(surface)),
        (
            "by samples",
            shows(200.0, 240.0, 0.4),
            RenderOptions::every_sample(),
        ),
        ("unlit again", shows(120.0, 240.0, 0.6), plain()),
        (
            "by the gradient",
            shows(20.0, 240.0, 0.6),
            RenderOptions {
                gradient_opacity: Some(GradientOpacity::ramp(2.0, 30.0)),
                ..plain()
            },
        ),
        ("lit again", shows(120.0, 240.0, 0.6), lit(Shading::Phong)),
    ]
}

/// Holds the bytes of a renderer that changes to those of new ones; `scene` puts a function into the scene.
fn hold<'a>(
    grid: DAffine3,
    looks: &'a [(&str, TransferFunction, RenderOptions)],
    scene: impl Fn(&'a TransferFunction) -> Scene<'a>,
) {
    let [(_, first, options), others @ ..] = looks else {
        panic!("looks to change between");
    };
    let mut kept = Renderer::for_changes(&scene(first), options).expect("valid options");
    let mut drawn = Vec::new();
    for (name, transfer, options) in others {
        let scene = scene(transfer);
        kept.update_scene(&scene, options).expect("valid options");
        let mut new = Renderer::with_scene(&scene, options).expect("valid options");
        assert_eq!(
            kept.visible_bounds_in_world(),
            new.visible_bounds_in_world(),
            "{name}: the box"
        );
        for camera in &cameras(grid) {
            let [a, b] = [&mut kept, &mut new]
                .map(|renderer| renderer.render(camera).expect("a valid camera"));
            assert!(
                a.image == b.image,
                "{name}: another picture than that of a new renderer"
            );
            assert_eq!(
                a.stats.bricks_empty, b.stats.bricks_empty,
                "{name}: bricks that are not shown"
            );
            drawn.push(a.image);
        }
    }
    let seen = |image: &resample_core::Image| image.rgba.iter().any(|pixel| pixel[3] > 0.1);
    assert!(
        drawn.iter().filter(|image| seen(image)).count() > drawn.len() / 2,
        "something is seen"
    );
}

#[test]
fn a_field_of_scalars_changes_to_what_a_new_renderer_draws() {
    for grid in [DAffine3::IDENTITY, sheared_grid()] {
        let volume = waves(grid);
        hold(grid, &looks(), |transfer| Scene::new(&volume, transfer));
        let volume = bytes(&volume);
        hold(grid, &looks(), |transfer| Scene::new(&volume, transfer));
    }
}

#[test]
fn channels_under_a_mask_change_to_what_a_new_renderer_draws() {
    let grid = DAffine3::IDENTITY;
    let (one, mask) = (
        bytes(&waves(grid)),
        volume(DIMS, grid, |p| f64::from(p.y < 17.0)),
    );
    let other = volume(DIMS, grid, |p| 4.0 * p.z);
    let still = shows(60.0, 100.0, 0.2);
    let channel = |volume, transfer| Channel {
        volume,
        look: Look::Transfer(transfer),
    };
    let looks: Vec<_> = looks()
        .into_iter()
        .filter(|(name, ..)| *name != "surface")
        .collect();
    hold(grid, &looks, |transfer| Scene {
        channels: vec![channel(&one, transfer), channel(&other, &still)],
        mask: Some(&mask),
    });
}

#[test]
fn a_change_that_is_refused_changes_nothing() {
    let (volume, look) = (waves(DAffine3::IDENTITY), shows(90.0, 240.0, 0.2));
    let scene = Scene::new(&volume, &look);
    let [camera, _] = cameras(DAffine3::IDENTITY);
    let mut kept = Renderer::for_changes(&scene, &RenderOptions::default()).expect("valid options");
    let before = kept.render(&camera).expect("a picture").image;
    let refused = with_field(RenderOptions::default(), |field| field.slab_voxels = -1.0);
    assert!(
        kept.update_scene(&scene, &refused).is_err(),
        "a slab of no size"
    );
    assert!(
        kept.render(&camera).expect("a picture").image == before,
        "the same picture"
    );
}
