//! Surfaces of one scalar against their f64 reference and against closed forms.

use glam::{DAffine3, DVec3};
use resample_core::Camera;
use resample_tests::choices::with_field;
use resample_tests::twins::isosurface::render as reference;
use resample_tests::twins::samples::Scene;
use resample_tests::volumes::scenes::{
    coloured, orthographic, perspective, random_volume, render, sheared_grid, volume,
};
use volsplat::{
    Blend, Clip, ClipPlane, DepthPlane, GradientOpacity, Isosurface, RenderOptions, Renderer,
    Shading, Subpixels, Volume,
};

fn white(value: f64) -> Blend {
    Blend::Isosurface(Isosurface {
        value,
        colour: Some([1.0; 3]),
        opacity: 1.0,
    })
}

fn options(value: f64, subpixels: u32) -> RenderOptions {
    with_field(
        RenderOptions {
            shading: Shading::Lambert,
            subpixels: Subpixels::Fixed(subpixels),
            depth: DepthPlane::Expected,
            ..RenderOptions::default()
        },
        |field| field.blend = white(value),
    )
}

/// A lumpy ball in the middle of a grid.
fn lump(grid: DAffine3) -> Volume {
    volume([22, 19, 25], grid, |p| {
        let from = p - DVec3::new(10.3, 9.1, 12.2);
        from.length() + 0.8 * (0.9 * p.x).sin() * (0.8 * p.y).cos() * (0.7 * p.z).sin()
    })
}

fn cameras(grid: DAffine3) -> [Camera; 2] {
    let end = DVec3::new(21.0, 18.0, 24.0);
    let (target, size) = (
        grid.transform_point3(0.5 * end),
        (grid.matrix3 * end).length(),
    );
    let eye = target + size * DVec3::new(0.9, 0.55, -1.0);
    [
        perspective(eye, target, 40.0, [40, 32]),
        orthographic(eye, target, 0.9 * size, [40, 32]),
    ]
}

fn hold(name: &str, volume: &Volume, camera: &Camera, options: &RenderOptions) {
    let truth = reference(&Scene {
        volume,
        transfer: &coloured(0.5),
        camera,
        options,
    });
    let image = render(volume, &coloured(0.5), options, camera);
    let depths = image.depth.as_ref().expect("a depth plane was asked for");
    let spacing = DVec3::from(volume.spacing()).max_element();
    let (mut light, mut depth, mut seen, mut sure) = (0.0f64, 0.0f64, 0, 0);
    for ((got, got_depth), truth) in image.rgba.iter().zip(depths).zip(&truth) {
        seen += usize::from(truth.coverage > 0.5);
        if truth.doubtful > 0.0 {
            continue;
        }
        sure += usize::from(truth.coverage > 0.5);
        light = light
            .max((f64::from(got[0]) - truth.light).abs())
            .max((f64::from(got[3]) - truth.coverage).abs());
        if truth.coverage > 0.0 {
            depth = depth.max((f64::from(*got_depth) - truth.depth).abs() / spacing);
        }
    }
    println!(
        "{name}: light off by {light:.1e}, depth by {depth:.1e} voxels; {sure} of {seen} px are sure"
    );
    assert!(
        sure > 30 && 2 * sure > seen,
        "{name}: too little is sure: {sure} of {seen} px"
    );
    assert!(light < 1e-3, "{name}: light off by {light}");
    assert!(depth < 2e-4, "{name}: depth off by {depth} voxels");
}

#[test]
fn against_the_reference() {
    for (grid, name) in [
        (DAffine3::IDENTITY, "cubic"),
        (sheared_grid(), "sheared"),
        (
            DAffine3::from_translation(DVec3::new(1e6, -1e6, 2e6)),
            "far from the origin",
        ),
    ] {
        let volume = lump(grid);
        for camera in &cameras(grid) {
            for subpixels in [1, 2] {
                let name = format!("{name}, {:?}, {subpixels} sub-pixels", camera.projection);
                hold(&name, &volume, camera, &options(7.0, subpixels));
            }
        }
    }
}

#[test]
fn a_cut_surface_shows_its_inside() {
    let volume = lump(DAffine3::IDENTITY);
    let plane = ClipPlane {
        normal: DVec3::new(0.2, 0.1, 1.0),
        offset: 11.7,
    };
    let clip = Clip {
        planes: vec![plane],
        ..Clip::default()
    };
    for camera in &cameras(DAffine3::IDENTITY) {
        hold(
            "cut",
            &volume,
            camera,
            &RenderOptions {
                clip: clip.clone(),
                ..options(7.0, 1)
            },
        );
    }
}

/// The field of a plane is the plane: its depth is exact, however thick the slabs, so that no slab shows.
#[test]
fn slabs_leave_no_pattern() {
    let normal = DVec3::new(0.3, -0.2, 0.9);
    let field = volume([30, 30, 30], DAffine3::IDENTITY, |p| normal.dot(p));
    let camera = perspective(
        DVec3::new(9.0, 20.0, -50.0),
        DVec3::splat(14.5),
        20.0,
        [48, 48],
    );
    for slab_voxels in [0.2, 0.5, 1.0, 3.0] {
        let options = with_field(options(14.2, 1), |field| field.slab_voxels = slab_voxels);
        let image = render(&field, &coloured(0.5), &options, &camera);
        let depths = image.depth.as_ref().expect("a depth plane was asked for");
        let rays = resample_tests::twins::rays::RaySource::new(&camera, &DAffine3::IDENTITY);
        let (mut worst, mut seen) = (0.0f64, 0);
        for (i, depth) in depths
            .iter()
            .enumerate()
            .filter(|(_, depth)| depth.is_finite())
        {
            let ray = rays.pixel(i % 48, i / 48);
            let truth = (14.2 - normal.dot(ray.origin)) / normal.dot(ray.direction);
            worst = worst.max((f64::from(*depth) - truth).abs());
            seen += 1;
        }
        println!("slab {slab_voxels}: depth off by {worst:.1e} voxels over {seen} px");
        assert!(seen > 500, "the plane is seen: {seen} px");
        assert!(worst < 5e-5, "slab {slab_voxels}: depth off by {worst}");
    }
}

/// Between bricks a surface has no holes: every ray through the middle of a closed surface hits it.
#[test]
fn a_closed_surface_has_no_holes() {
    let field = volume([41, 41, 41], DAffine3::IDENTITY, |p| {
        (p - 20.0).abs().max_element()
    });
    // Faces of this cube lie on the faces of bricks: at 8, 16, 24 and 32 voxels.
    for value in [4.0, 12.0, 11.99999, 12.00001] {
        for eye in [
            DVec3::new(20.0, 20.0, -70.0),
            DVec3::new(-41.0, 55.0, -37.0),
            DVec3::new(60.1, 20.0, 75.3),
        ] {
            let camera = perspective(eye, DVec3::splat(20.0), 4.0, [64, 64]);
            let image = render(&field, &coloured(0.5), &options(value, 1), &camera);
            let holes = image.rgba.iter().filter(|p| p[3] < 1.0).count();
            assert_eq!(holes, 0, "value {value}, eye {eye}: {holes} holes");
        }
    }
}

/// A ray through a closed surface crosses it twice, on faces of bricks too.
#[test]
fn a_translucent_surface_is_composited_once_for_each_crossing() {
    let field = volume([33, 33, 33], DAffine3::IDENTITY, |p| {
        (p - 16.0).abs().max_element()
    });
    for (value, eye) in [
        (8.0, DVec3::new(16.0, 16.0, -70.0)),
        (6.3, DVec3::new(-20.0, 30.0, -50.0)),
    ] {
        let blend = Blend::Isosurface(Isosurface {
            value,
            colour: Some([1.0; 3]),
            opacity: 0.25,
        });
        let options = with_field(
            RenderOptions {
                shading: Shading::None,
                ..options(value, 1)
            },
            |field| field.blend = blend,
        );
        let image = render(
            &field,
            &coloured(0.5),
            &options,
            &perspective(eye, DVec3::splat(16.0), 6.0, [32, 32]),
        );
        for pixel in &image.rgba {
            assert!(
                (pixel[3] - 0.4375).abs() < 1e-6,
                "value {value}: opacity {} instead of 1 - 0.75^2",
                pixel[3]
            );
            assert!((pixel[0] - pixel[3]).abs() < 1e-6, "value {value}: white");
        }
    }
}

#[test]
fn surfaces_at_extremes_are_sound() {
    let noise = random_volume([9, 9, 9], DAffine3::from_scale(DVec3::new(1e-3, 1.0, 1e3)));
    let flat = volume([9, 9, 9], DAffine3::IDENTITY, |_| 0.5);
    for (field, eye) in [
        (&noise, DVec3::new(0.004, 4.0, 4000.0)),
        (&flat, DVec3::splat(4.0)),
        (&flat, DVec3::splat(1e7)),
    ] {
        let camera = perspective(eye, eye + DVec3::new(-1.0, -1.0, -1.0), 100.0, [20, 20]);
        for value in [0.5, 0.0, -1e30, 1e30] {
            render(field, &coloured(0.5), &options(value, 4), &camera);
        }
    }
}

#[test]
fn what_is_no_surface_is_refused() {
    let field = random_volume([4, 4, 4], DAffine3::IDENTITY);
    let surface = |value, opacity| {
        Blend::Isosurface(Isosurface {
            value,
            colour: None,
            opacity,
        })
    };
    let cases = [
        (
            with_field(RenderOptions::default(), |field| {
                field.blend = surface(f64::NAN, 1.0)
            }),
            "finite",
        ),
        (
            with_field(RenderOptions::default(), |field| {
                field.blend = surface(0.5, 0.0)
            }),
            "opacity",
        ),
        (
            RenderOptions {
                gradient_opacity: Some(GradientOpacity::ramp(3.0, 2.0)),
                ..RenderOptions::default()
            },
            "by the gradient",
        ),
        (
            RenderOptions {
                gradient_opacity: Some(GradientOpacity::ramp(0.0, 2.0)),
                ..options(0.5, 1)
            },
            "emission",
        ),
    ];
    for (options, said) in cases {
        let error = Renderer::new(&field, &coloured(0.5), &options)
            .expect_err("this cannot be")
            .to_string();
        assert!(error.contains(said), "expected '{said}' in: {error}");
    }
}
