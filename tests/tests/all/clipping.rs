//! Clipping against the f64 reference, which tests the inequalities of the clip at every sample, in the world.
//!
//! Beside the reference: what a clip that cuts nothing must leave alone, to the byte, and what is not drawn.

use glam::{DAffine3, DVec3};
use resample_core::Camera;
use resample_tests::twins::samples::Scene;
use resample_tests::volumes::against_sheets::hold;
use resample_tests::volumes::scenes::{
    coloured, full, orthographic, perspective, random_volume, render, sheared_grid,
    worst_difference,
};
use volsplat::{Clip, ClipPlane, RenderOptions, Renderer, Shading, Subpixels, Volume};

const DIMS: [usize; 3] = [20, 17, 25];

fn options(clip: Clip) -> RenderOptions {
    RenderOptions {
        clip,
        subpixels: Subpixels::Fixed(2),
        min_transmittance: 0.0,
        ..RenderOptions::default()
    }
}

fn middle(volume: &Volume) -> DVec3 {
    volume
        .world_from_index
        .transform_point3(0.5 * DVec3::from(DIMS.map(|n| (n - 1) as f64)))
}

fn cameras(volume: &Volume) -> [Camera; 2] {
    let size = (volume.world_from_index.matrix3 * DVec3::from(DIMS.map(|n| n as f64))).length();
    let target = middle(volume);
    let eye = target + size * DVec3::new(0.9, 0.55, -1.0);
    [
        perspective(eye, target, 40.0, [26, 22]),
        orthographic(eye, target, 0.9 * size, [26, 22]),
    ]
}

/// Planes through the middle, or near it, that leave something: as many as `count`.
fn planes(volume: &Volume, count: usize) -> Vec<ClipPlane> {
    let normals = [
        DVec3::new(1.0, 0.3, -0.2),
        DVec3::new(-0.2, 2.0, 0.4),
        DVec3::new(0.1, -0.3, -0.7),
        DVec3::new(-1.0, 0.0, 0.3),
        DVec3::new(0.0, -1.0, 0.0),
        DVec3::new(0.5, 0.5, 0.5),
    ];
    let plane = |normal: DVec3| ClipPlane {
        normal,
        offset: normal.dot(middle(volume)) - 3.7 * normal.length(),
    };
    normals.into_iter().take(count).map(plane).collect()
}

fn clips(volume: &Volume) -> Vec<(&'static str, Clip)> {
    let crop_in_grid = Some([DVec3::new(3.3, 4.0, 7.5), DVec3::new(16.1, 30.0, 20.0)]);
    let reach = 0.25 * DVec3::from(volume.spacing()) * DVec3::from(DIMS.map(|n| n as f64));
    let crop_in_world = Some([middle(volume) - reach, middle(volume) + 1.3 * reach]);
    vec![
        (
            "a box of voxels",
            Clip {
                crop_in_grid,
                ..Clip::default()
            },
        ),
        (
            "a box of the world",
            Clip {
                crop_in_world,
                ..Clip::default()
            },
        ),
        (
            "a plane",
            Clip {
                planes: planes(volume, 1),
                ..Clip::default()
            },
        ),
        (
            "six planes",
            Clip {
                planes: planes(volume, 6),
                ..Clip::default()
            },
        ),
        (
            "everything",
            Clip {
                crop_in_world,
                crop_in_grid,
                planes: planes(volume, 6),
            },
        ),
    ]
}

fn hold_grid(name: &str, grid: DAffine3) {
    let volume = random_volume(DIMS, grid);
    for camera in &cameras(&volume) {
        for (what, clip) in clips(&volume) {
            let scene = Scene {
                volume: &volume,
                transfer: &coloured(0.3),
                camera,
                options: &options(clip),
            };
            hold(&format!("{name}, {:?}, {what}", camera.projection), &scene);
        }
    }
}

#[test]
fn cubic_grid() {
    hold_grid("cubic", DAffine3::IDENTITY);
}

#[test]
fn sheared_stretched_and_mirrored_grids() {
    hold_grid("sheared", sheared_grid());
    hold_grid("stretched", DAffine3::from_scale(DVec3::new(0.5, 1.3, 0.7)));
    hold_grid("mirrored", DAffine3::from_scale(DVec3::new(-1.0, 0.8, 1.0)));
}

#[test]
fn far_from_the_origin_of_the_world() {
    hold_grid(
        "offset by 1e7",
        DAffine3::from_translation(DVec3::new(1e7, -1e7, 2e7)),
    );
}

/// What the eye looks out of is cut open by a plane at the eye.
#[test]
fn eye_inside_the_cut() {
    let volume = random_volume(DIMS, DAffine3::IDENTITY);
    let eye = middle(&volume) + DVec3::new(0.3, -0.4, 0.2);
    let camera = perspective(eye, eye + DVec3::new(0.5, 0.2, 1.0), 90.0, [26, 22]);
    let plane = ClipPlane {
        normal: DVec3::new(0.5, 0.2, 1.0),
        offset: DVec3::new(0.5, 0.2, 1.0).dot(eye),
    };
    let options = options(Clip {
        planes: vec![plane],
        ..Clip::default()
    });
    hold(
        "eye in a plane",
        &Scene {
            volume: &volume,
            transfer: &coloured(0.3),
            camera: &camera,
            options: &options,
        },
    );
}

#[test]
fn a_clip_that_cuts_nothing_changes_no_byte() {
    let volume = random_volume(DIMS, DAffine3::IDENTITY);
    let last = DVec3::from(DIMS.map(|n| (n - 1) as f64));
    let clip = Clip {
        crop_in_world: Some([DVec3::ZERO, last]),
        crop_in_grid: Some([DVec3::ZERO, last]),
        planes: vec![ClipPlane {
            normal: DVec3::X,
            offset: 0.0,
        }],
    };
    for camera in &cameras(&volume) {
        for base in [RenderOptions::default(), RenderOptions::every_sample()] {
            let clipped = RenderOptions {
                clip: clip.clone(),
                ..base.clone()
            };
            let [a, b] =
                [base, clipped].map(|options| render(&volume, &coloured(0.3), &options, camera));
            assert!(
                a == b,
                "the clip holds the whole volume, and the picture differs"
            );
        }
    }
}

#[test]
fn bricks_outside_are_not_touched_and_framing_follows() {
    let volume = random_volume([64, 16, 16], DAffine3::IDENTITY);
    let camera = perspective(
        DVec3::new(32.0, 8.0, -90.0),
        DVec3::new(32.0, 8.0, 8.0),
        50.0,
        [40, 40],
    );
    let mut renderer =
        Renderer::new(&volume, &coloured(0.3), &options(Clip::default())).expect("valid options");
    let whole = renderer.render(&camera).expect("a valid camera").stats;
    let clip = Clip {
        crop_in_grid: Some([DVec3::splat(-1.0), DVec3::new(15.5, 20.0, 7.5)]),
        ..Clip::default()
    };
    renderer.update_clip(clip).expect("a valid clip");
    let part = renderer.render(&camera).expect("a valid camera").stats;
    assert_eq!(
        (whole.bricks, part.bricks),
        (32, 4),
        "of 8 bricks of 8 cells along x, two are kept; half in z"
    );
    let [low, high] = renderer
        .visible_bounds_in_world()
        .expect("something is kept");
    assert!(
        low.abs().max_element() < 1e-9,
        "from the first voxel: {low}"
    );
    assert!(
        (high - DVec3::new(15.5, 15.0, 7.5)).abs().max_element() < 1e-9,
        "to the faces of the box: {high}"
    );
    let away = ClipPlane {
        normal: DVec3::X,
        offset: 1e12,
    };
    renderer
        .update_clip(Clip {
            planes: vec![away],
            ..Clip::default()
        })
        .expect("a valid clip");
    assert_eq!(renderer.visible_bounds_in_world(), None, "nothing is kept");
    let empty = renderer.render(&camera).expect("a valid camera").image;
    assert!(
        empty.rgba.iter().all(|p| *p == [0.0; 4]),
        "nothing is kept, so nothing is seen"
    );
}

/// A voxel whose centre is cut off is drawn as if it held nothing.
#[test]
fn every_sample_clips_voxel_centres() {
    let volume = random_volume(DIMS, sheared_grid());
    for (what, clip) in clips(&volume) {
        let kept = |index: DVec3| {
            resample_tests::twins::clip::keeps_with(&clip, &volume.world_from_index, index, 0.0)
        };
        let cut = resample_tests::volumes::scenes::volume(DIMS, sheared_grid(), |index| {
            let [i, j, k] = index.as_usizevec3().to_array();
            if kept(index) {
                volume.value((k * DIMS[1] + j) * DIMS[0] + i)
            } else {
                0.0
            }
        });
        for camera in &cameras(&volume) {
            let plain = full(resample_core::SelectMode::Hybrid);
            let clipped = RenderOptions {
                clip: clip.clone(),
                ..plain.clone()
            };
            let difference = worst_difference(
                &render(&volume, &coloured(0.3), &clipped, camera),
                &render(&cut, &coloured(0.3), &plain, camera),
            );
            assert!(difference < 1e-6, "{what}: off by {difference}");
        }
    }
}

/// Shading is that of the whole volume: a cut is not a surface of the field.
#[test]
fn shaded_samples_are_clipped_alike() {
    let volume = random_volume(DIMS, DAffine3::IDENTITY);
    let [camera, _] = cameras(&volume);
    let whole = RenderOptions {
        shading: Shading::Phong,
        ..options(Clip::default())
    };
    // A slab one plane thick at most, far behind: what is lit is the same, sample by sample.
    let clip = Clip {
        planes: planes(&volume, 3),
        ..Clip::default()
    };
    let clipped = RenderOptions {
        clip: clip.clone(),
        ..whole
    };
    let flat = options(clip);
    let [lit, unlit] =
        [clipped, flat].map(|options| render(&volume, &coloured(0.3), &options, &camera));
    for (lit, unlit) in lit.rgba.iter().zip(&unlit.rgba) {
        assert!(
            (lit[3] - unlit[3]).abs() < 1e-6,
            "light changes no opacity: {} {}",
            lit[3],
            unlit[3]
        );
    }
}

#[test]
fn thin_boxes_and_distant_planes_are_sound() {
    let volume = random_volume(DIMS, DAffine3::IDENTITY);
    let thin = Some([
        DVec3::new(5.0, 0.0, 0.0),
        DVec3::new(5.0 + 1e-7, 20.0, 30.0),
    ]);
    let far = |offset: f64| {
        vec![ClipPlane {
            normal: DVec3::new(1e-3, 0.0, 0.0),
            offset,
        }]
    };
    for camera in &cameras(&volume) {
        render(
            &volume,
            &coloured(0.3),
            &options(Clip {
                crop_in_grid: thin,
                ..Clip::default()
            }),
            camera,
        );
        for offset in [1e300, -1e300, 1e-300] {
            render(
                &volume,
                &coloured(0.3),
                &options(Clip {
                    planes: far(offset),
                    ..Clip::default()
                }),
                camera,
            );
        }
    }
}
