//! Windows of a picture, and renderers that take other options: both must give the pixels that a whole, new one gives.
//!
//! A camera with a moved principal point and a smaller picture sees a part of what the whole camera sees. Renderers may
//! round differently where coordinates are smaller, so colours are compared to 1e-4, a fortieth of a step of 8 bits.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, Image, LookAt, Projection};
use resample_tests::choices::with_field;
use volsplat::{RenderOptions, Renderer, Reuse, Subpixels, TransferFunction, procedural};

const TOLERANCE: f32 = 1e-4;

/// The part of a picture that begins at a pixel.
fn part(camera: &Camera, at: [u32; 2], size: [u32; 2]) -> Camera {
    Camera {
        width: size[0],
        height: size[1],
        cx: camera.cx - f64::from(at[0]),
        cy: camera.cy - f64::from(at[1]),
        ..*camera
    }
}

/// Largest change between a window and the same place of the whole picture, except for a rim of `guard` pixels.
fn departure(whole: &Image, window: &Image, (at, guard): ([u32; 2], usize)) -> f32 {
    let mut worst = 0.0_f32;
    for y in guard..window.height - guard {
        for x in guard..window.width - guard {
            let expected = whole.pixel(x + at[0] as usize, y + at[1] as usize);
            for (a, b) in window.pixel(x, y).iter().zip(expected) {
                worst = worst.max((a - b).abs());
            }
        }
    }
    worst
}

fn camera(position: DVec3, target: DVec3) -> Camera {
    let pose = LookAt {
        position,
        target,
        up: DVec3::Y,
    };
    Camera::perspective(&pose, 0.6, [128, 96]).expect("a camera")
}

/// Windows on the tiles of the renderers, inside and at the rim.
const PLACES: [[u32; 2]; 4] = [[48, 32], [64, 48], [0, 0], [112, 80]];

#[test]
fn windows_of_a_volume_are_parts_of_its_picture() {
    let volume = procedural::blobs(48).expect("small");
    let transfer = TransferFunction::automatic(
        &volsplat::transfer::Histogram::of_volume(&volume),
        volsplat::transfer::ColourMap::default(),
    );
    let camera = camera(DVec3::new(60.0, 50.0, 140.0), DVec3::splat(24.0));
    let sheets = RenderOptions {
        subpixels: Subpixels::Fixed(2),
        ..RenderOptions::default()
    };
    for (name, options) in [
        ("sheets", sheets.clone()),
        ("sheets, auto", RenderOptions::default()),
        (
            "thin sheets",
            with_field(
                RenderOptions {
                    subpixels: Subpixels::Fixed(4),
                    ..sheets.clone()
                },
                |field| field.slab_voxels = 0.125,
            ),
        ),
        ("every sample", RenderOptions::every_sample()),
    ] {
        let mut renderer = Renderer::new(&volume, &transfer, &options).expect("a renderer");
        let whole = renderer.render(&camera).expect("a picture").image;
        assert!(
            whole.rgba.iter().any(|pixel| pixel[3] > 0.2),
            "{name}: something is seen"
        );
        for at in PLACES {
            let window = renderer
                .render(&part(&camera, at, [16, 16]))
                .expect("a window")
                .image;
            let worst = departure(&whole, &window, (at, 0));
            assert!(
                worst < TOLERANCE,
                "{name} at {at:?}: a window departs by {worst}"
            );
        }
    }
}

#[test]
fn a_volume_renderer_that_takes_options_draws_as_a_new_one() {
    let volume = procedural::blobs(32).expect("small");
    let transfer = TransferFunction::automatic(
        &volsplat::transfer::Histogram::of_volume(&volume),
        volsplat::transfer::ColourMap::default(),
    );
    let camera = camera(DVec3::new(60.0, 50.0, 240.0), DVec3::splat(16.0));
    let mut kept =
        Renderer::new(&volume, &transfer, &RenderOptions::default()).expect("a renderer");
    kept.render(&camera).expect("a picture");
    for options in [
        with_field(
            RenderOptions {
                subpixels: Subpixels::Fixed(1),
                ..RenderOptions::default()
            },
            |field| field.slab_voxels = 0.25,
        ),
        RenderOptions {
            min_transmittance: 0.01,
            ..RenderOptions::default()
        },
    ] {
        assert_eq!(
            kept.update(&options).expect("good options"),
            Reuse::Kept,
            "{options:?} asks for no other preparation"
        );
        let mut new = Renderer::new(&volume, &transfer, &options).expect("a renderer");
        let (a, b) = (
            kept.render(&camera).expect("a picture"),
            new.render(&camera).expect("a picture"),
        );
        assert_eq!(a.image, b.image, "{options:?}");
    }
    assert_eq!(
        kept.update(&RenderOptions::every_sample())
            .expect("good options"),
        Reuse::NeedsRenderer,
        "another pipeline"
    );
    assert!(
        kept.update(&with_field(RenderOptions::default(), |field| field
            .slab_voxels =
            -1.0))
            .is_err(),
        "checked"
    );
}

#[test]
fn windows_of_a_mesh_are_parts_of_its_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("quad.obj");
    std::fs::write(
        &path,
        "v -1 -1 0\nv 1 -1 0\nv 1 1 0.5\nv -1 1 -0.5\nf 1 2 3 4\n",
    )
    .expect("written");
    let scene = texmap::load(&path, &texmap::LoadOptions::default())
        .expect("a mesh")
        .scene;
    let camera = camera(DVec3::new(1.0, 0.5, 4.0), DVec3::ZERO);
    let mut kept =
        texmap::Renderer::new(&scene, &texmap::RenderOptions::default()).expect("a renderer");
    for method in texmap::Method::ALL {
        let options = texmap::RenderOptions {
            method,
            subpixels: 2,
            ..texmap::RenderOptions::default()
        };
        assert_eq!(
            kept.update(&options).expect("good options"),
            Reuse::Kept,
            "{method:?} asks for no other preparation"
        );
        let whole = kept.render(&camera).expect("a picture").image;
        let new = texmap::Renderer::new(&scene, &options)
            .expect("a renderer")
            .render(&camera);
        assert_eq!(
            whole,
            new.expect("a picture").image,
            "{method:?}: updated and new"
        );
        for at in PLACES {
            let window = kept
                .render(&part(&camera, at, [16, 16]))
                .expect("a window")
                .image;
            let worst = departure(&whole, &window, (at, 0));
            assert!(
                worst < TOLERANCE,
                "{method:?} at {at:?}: a window departs by {worst}"
            );
        }
    }
}

/// A slanted wall with a step in it, coloured by place.
fn reference() -> warp3d::Reference {
    let (width, height) = (96, 72);
    let camera = Camera {
        projection: Projection::Perspective,
        width,
        height,
        fx: 90.0,
        fy: 90.0,
        cx: 48.0,
        cy: 36.0,
        camera_from_world: DAffine3::IDENTITY,
        near: 0.01,
    };
    let at = |i: u32| [f64::from(i % width), f64::from(i / width)];
    let depth = |[x, y]: [f64; 2]| {
        let inside = (x - 48.0).abs() < 20.0 && (y - 36.0).abs() < 15.0;
        (if inside { 3.0 } else { 5.0 + 0.01 * x }) as f32
    };
    let colour = |[x, y]: [f64; 2]| {
        [
            (0.3 * x).sin().abs() as f32,
            (0.2 * y).cos().abs() as f32,
            0.5,
        ]
    };
    warp3d::Reference {
        colour: (0..width * height).map(|i| colour(at(i))).collect(),
        depth: (0..width * height).map(|i| depth(at(i))).collect(),
        camera,
    }
}

#[test]
fn windows_of_a_warp_are_parts_of_its_picture() {
    let reference = reference();
    let camera = Camera {
        camera_from_world: DAffine3::from_translation(DVec3::new(-0.2, 0.05, 0.1)),
        ..reference.camera
    };
    let worst_of = |method, at: [u32; 2]| {
        let options = warp3d::WarpOptions::with_method(method);
        let mut warper = warp3d::Warper::new(vec![reference.clone()], &options).expect("a warper");
        let whole = warper.render(&camera).expect("a picture").image;
        let window = warper
            .render(&part(&camera, at, [32, 32]))
            .expect("a window")
            .image;
        // The hybrid looks for edges in the neighbours of a pixel, which the rim of a window has not.
        departure(&whole, &window, (at, 1))
    };
    for method in warp3d::Method::ALL {
        for at in [[32, 32], [0, 0], [64, 40]] {
            let worst = worst_of(method, at);
            assert!(
                worst < TOLERANCE,
                "{method:?} at {at:?}: a window departs by {worst}"
            );
        }
    }
}
