//! Channels, labels, masks and the ramp over the gradient against their f64 reference, and against each other.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, Image, KernelShape};
use resample_tests::choices::summed;
use resample_tests::twins::channels::render as reference;
use resample_tests::volumes::against_sheets::{ROUNDING, compared};
use resample_tests::volumes::scenes::{
    assert_sound, coloured, orthographic, perspective, random_volume, render, sheared_grid,
    transfer, volume, worst_difference,
};
use volsplat::{
    Channel, Clip, ClipPlane, GradientOpacity, LabelLook, LabelTable, Look, RenderOptions,
    Renderer, Scene, Shading, Subpixels, TransferFunction, Volume,
};

const DIMS: [usize; 3] = [20, 11, 18];

fn options() -> RenderOptions {
    RenderOptions {
        subpixels: Subpixels::Fixed(2),
        min_transmittance: 0.0,
        ..RenderOptions::default()
    }
}

fn cameras(grid: DAffine3) -> [Camera; 2] {
    let end = DVec3::from(DIMS.map(|n| (n - 1) as f64));
    let (target, size) = (
        grid.transform_point3(0.5 * end),
        (grid.matrix3 * end).length(),
    );
    let eye = target + size * DVec3::new(0.9, 0.55, -1.0);
    [
        perspective(eye, target, 40.0, [24, 20]),
        orthographic(eye, target, 0.9 * size, [24, 20]),
    ]
}

/// A label map of three labels and background, in lumps.
fn labels(grid: DAffine3) -> Volume {
    volume(DIMS, grid, |p| {
        let wave = (0.7 * p.x).sin() + (0.9 * p.y).cos() + (0.6 * p.z).sin();
        if wave < 0.3 {
            0.0
        } else {
            [7.0, 2.0, 300.0][(wave * 10.0) as usize % 3]
        }
    })
}

fn look(rgb: [f32; 3], opacity: f64) -> LabelLook {
    LabelLook { rgb, opacity }
}

fn table() -> LabelTable {
    let looks = [
        (7, look([1.0, 0.2, 0.1], 0.3)),
        (2, look([0.1, 0.9, 0.3], 0.6)),
        (300, look([0.2, 0.3, 1.0], 1.0)),
    ];
    LabelTable::new(looks).expect("valid looks")
}

fn mask(grid: DAffine3) -> Volume {
    volume(DIMS, grid, |p| {
        f64::from((p.x + 0.3 * p.y < 12.0) && (p.z > 3.0))
    })
}

fn drawn(scene: &Scene, camera: &Camera, options: &RenderOptions) -> Image {
    let mut renderer = Renderer::with_scene(scene, options).expect("valid options");
    let image = renderer.render(camera).expect("a valid camera").image;
    assert_sound(&image);
    image
}

fn scalars<'a>(volume: &'a Volume, transfer: &'a TransferFunction) -> Channel<'a> {
    Channel {
        volume,
        look: Look::Transfer(transfer),
    }
}

fn hold(name: &str, scene: &Scene, grid: DAffine3, options: &RenderOptions) {
    for camera in &cameras(grid) {
        let result = compared(
            &drawn(scene, camera, options),
            &reference(scene, camera, options),
        );
        println!("{name}, {:?}: {result:?}", camera.projection);
        assert!(
            result.seen > 20,
            "{name}: next to nothing is seen, so nothing is tested"
        );
        assert!(
            result.beyond < ROUNDING,
            "{name}: {:.1e} more than is admitted",
            result.beyond
        );
    }
}

#[test]
fn labels_are_those_of_the_nearest_voxel() {
    for grid in [DAffine3::IDENTITY, sheared_grid()] {
        let (map, table) = (labels(grid), table());
        let scene = Scene {
            channels: vec![Channel {
                volume: &map,
                look: Look::Labels(&table),
            }],
            mask: None,
        };
        hold("labels", &scene, grid, &options());
    }
}

#[test]
fn a_mask_hides_what_its_nearest_voxel_hides() {
    for grid in [DAffine3::IDENTITY, sheared_grid()] {
        let (field, mask, colours) = (random_volume(DIMS, grid), mask(grid), coloured(0.3));
        let scene = Scene {
            channels: vec![scalars(&field, &colours)],
            mask: Some(&mask),
        };
        hold("mask", &scene, grid, &options());
        let clip = Clip {
            planes: vec![ClipPlane {
                normal: DVec3::X,
                offset: 4.3,
            }],
            ..Clip::default()
        };
        hold(
            "mask and clip",
            &scene,
            grid,
            &RenderOptions { clip, ..options() },
        );
    }
}

#[test]
fn tints_multiply_the_colour_of_what_is_opaque() {
    for grid in [DAffine3::IDENTITY, sheared_grid()] {
        let (opacity, function) = (random_volume(DIMS, grid), coloured(0.3));
        let components = [0.7, 1.1, 1.9].map(|rate| {
            volume(DIMS, grid, |p| {
                127.5 * (1.0 + (rate * p.x).sin() * (p.y - rate * p.z).cos())
            })
        });
        let tints: Vec<TransferFunction> = components
            .iter()
            .enumerate()
            .map(|(number, volume)| volsplat::transfer::tint(number, volume))
            .collect();
        let mut channels: Vec<Channel> = components
            .iter()
            .zip(&tints)
            .map(|(volume, tint)| Channel {
                volume,
                look: Look::Tint(tint),
            })
            .collect();
        channels.insert(1, scalars(&opacity, &function));
        let scene = Scene {
            channels,
            mask: None,
        };
        hold("tints", &scene, grid, &options());
    }
    let volume = random_volume(DIMS, DAffine3::IDENTITY);
    let tint = volsplat::transfer::tint(0, &volume);
    let scene = Scene {
        channels: vec![Channel {
            volume: &volume,
            look: Look::Tint(&tint),
        }],
        mask: None,
    };
    let refused = Renderer::with_scene(&scene, &options()).map(|_| ());
    assert!(refused.is_err_and(|error| {
        error
            .to_string()
            .contains("at least one channel must carry opacity")
    }));
}

#[test]
fn channels_add_extinctions_and_mix_colours() {
    let grid = sheared_grid();
    let (a, b, map, table) = (
        random_volume(DIMS, grid),
        labels(grid),
        labels(grid),
        table(),
    );
    let (one, other) = (
        coloured(0.3),
        transfer(&[(0.0, [0.9, 0.1, 0.8])], &[(1.0, 0.0), (300.0, 0.4)]),
    );
    let two = vec![scalars(&a, &one), scalars(&b, &other)];
    hold(
        "two channels",
        &Scene {
            channels: two.clone(),
            mask: None,
        },
        grid,
        &options(),
    );
    let mut three = two;
    three.push(Channel {
        volume: &map,
        look: Look::Labels(&table),
    });
    let mask = mask(grid);
    hold(
        "three channels and a mask",
        &Scene {
            channels: three,
            mask: Some(&mask),
        },
        grid,
        &options(),
    );
}

#[test]
fn extinction_follows_the_gradient() {
    for grid in [DAffine3::IDENTITY, sheared_grid()] {
        let (field, colours) = (random_volume(DIMS, grid), coloured(0.5));
        for curve in ["0.1,0.6", "0:0.9,0.1:0.9,0.2:0.4,0.4:0.5,0.6:1"] {
            let gradient_opacity: GradientOpacity = curve.parse().expect("a curve");
            let options = RenderOptions {
                gradient_opacity: Some(gradient_opacity),
                ..options()
            };
            hold(curve, &Scene::new(&field, &colours), grid, &options);
        }
    }
}

/// What leaves every sample as it is must leave the picture as it is, whichever kernel draws it.
#[test]
fn options_that_change_nothing_change_nothing() {
    let (field, colours) = (random_volume(DIMS, DAffine3::IDENTITY), coloured(0.3));
    let all = volume(DIMS, DAffine3::IDENTITY, |_| 1.0);
    let nothing = volume(DIMS, DAffine3::IDENTITY, |_| 0.0);
    for camera in &cameras(DAffine3::IDENTITY) {
        for shading in [Shading::None, Shading::Phong] {
            let plain = RenderOptions {
                shading,
                ..options()
            };
            let truth = render(&field, &colours, &plain, camera);
            let masked = Scene {
                mask: Some(&all),
                ..Scene::new(&field, &colours)
            };
            assert!(
                drawn(&masked, camera, &plain) == truth,
                "a mask that hides nothing, {shading:?}"
            );
            let ramp = RenderOptions {
                gradient_opacity: Some(GradientOpacity::ramp(0.0, 1e-30)),
                ..plain.clone()
            };
            let difference = worst_difference(&render(&field, &colours, &ramp, camera), &truth);
            assert!(
                difference < 2e-6,
                "a ramp that is 1 everywhere, {shading:?}: {difference}"
            );
            let beside = Scene {
                channels: vec![scalars(&nothing, &colours), scalars(&field, &colours)],
                mask: None,
            };
            let difference = worst_difference(&drawn(&beside, camera, &plain), &truth);
            assert!(
                difference < 2e-6,
                "a channel that is empty, {shading:?}: {difference}"
            );
        }
    }
    let hidden = Scene {
        mask: Some(&nothing),
        ..Scene::new(&field, &colours)
    };
    let renderer = Renderer::with_scene(&hidden, &options()).expect("valid options");
    assert_eq!(
        renderer.visible_bounds_in_world(),
        None,
        "everything is hidden"
    );
    assert_eq!(renderer.non_transparent(), 0, "everything is hidden");
}

/// In the every-sample order, voxels are mixed before they are projected.
#[test]
fn every_sample_mixes_voxels() {
    let (field, colours) = (random_volume(DIMS, DAffine3::IDENTITY), coloured(0.3));
    let mask = mask(DAffine3::IDENTITY);
    let options = RenderOptions {
        min_transmittance: 0.0,
        ..RenderOptions::paper()
    };
    let cut = volume(DIMS, DAffine3::IDENTITY, |p| {
        let i = resample_tests::twins::trilinear::linear(&field, p.as_usizevec3().to_array());
        field.value(i) * mask.value(i)
    });
    let [camera, _] = cameras(DAffine3::IDENTITY);
    let masked = Scene {
        mask: Some(&mask),
        ..Scene::new(&field, &colours)
    };
    let difference = worst_difference(
        &drawn(&masked, &camera, &options),
        &render(&cut, &colours, &options, &camera),
    );
    assert!(difference < 1e-6, "a mask: {difference}");
    // The same field twice has twice the extinction.
    let (half, whole) = (
        transfer(&[(0.0, [0.7, 0.5, 0.2])], &[(0.0, 0.1)]),
        transfer(&[(0.0, [0.7, 0.5, 0.2])], &[(0.0, 0.19)]),
    );
    let twice = Scene {
        channels: vec![scalars(&field, &half), scalars(&field, &half)],
        mask: None,
    };
    let difference = worst_difference(
        &drawn(&twice, &camera, &options),
        &render(&field, &whole, &options, &camera),
    );
    assert!(difference < 1e-5, "twice the extinction: {difference}");
    let (map, table) = (labels(DAffine3::IDENTITY), table());
    let scene = Scene {
        channels: vec![Channel {
            volume: &map,
            look: Look::Labels(&table),
        }],
        mask: None,
    };
    assert!(
        drawn(&scene, &camera, &options)
            .rgba
            .iter()
            .any(|p| p[3] > 0.9),
        "labels are seen"
    );
}

#[test]
fn scenes_that_do_not_fit_are_refused() {
    let (field, colours) = (random_volume(DIMS, DAffine3::IDENTITY), coloured(0.3));
    let small = random_volume([4, 4, 4], DAffine3::IDENTITY);
    let moved = random_volume(DIMS, DAffine3::from_translation(DVec3::X));
    let table = table();
    let one = || Scene::new(&field, &colours);
    let beside = |volume| Scene {
        channels: vec![scalars(&field, &colours), scalars(volume, &colours)],
        mask: None,
    };
    let map = Scene {
        channels: vec![Channel {
            volume: &field,
            look: Look::Labels(&table),
        }],
        mask: None,
    };
    let summed = summed(options(), KernelShape::Polynomial);
    let cases = [
        (
            Scene {
                channels: vec![],
                mask: None,
            },
            options(),
            "no channel",
        ),
        (
            Scene {
                mask: Some(&small),
                ..one()
            },
            options(),
            "the mask has 4x4x4 voxels",
        ),
        (beside(&small), options(), "channel 1 has 4x4x4 voxels"),
        (beside(&moved), options(), "voxels away"),
        (map, options(), "whole numbers"),
        (
            Scene {
                mask: Some(&field),
                ..one()
            },
            summed,
            "one channel of scalars",
        ),
    ];
    for (scene, options, said) in cases {
        let error = Renderer::with_scene(&scene, &options)
            .expect_err("this does not fit")
            .to_string();
        assert!(error.contains(said), "expected '{said}' in: {error}");
    }
}
