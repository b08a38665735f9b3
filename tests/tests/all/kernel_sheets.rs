//! Image sheets summed from kernels, against their f64 reference: every kernel, pre- and post-classified, as sections, as
//! points and mixed, lit and clipped. The B-spline's footprint profile is off by 8e-4 of its peak, and has a bound of its own; points stand
//! at 256 positions a pixel, which moves each by up to 1/512 px.

mod held;

use glam::{DAffine3, DVec3};
use resample_core::{KernelShape, SelectMode};
use resample_tests::choices::{with_samples, with_sheets};
use resample_tests::volumes::scenes::{
    coloured, perspective, random_volume, sheared_grid, transfer,
};
use volsplat::procedural::blobs;
use volsplat::{
    Cells, Classify, Clip, ClipPlane, GradientOpacity, Interpolate, Light, RenderOptions, Renderer,
    Shading,
};

use held::{CLASSIFY, KERNELS, cameras, hold, options};

fn hold_grid(name: &str, grid: DAffine3) {
    let volume = random_volume([6, 5, 7], grid);
    let middle = grid.transform_point3(DVec3::new(2.5, 2.0, 3.0));
    let size = (grid.matrix3 * DVec3::new(5.0, 4.0, 6.0)).length();
    for camera in cameras(middle, size) {
        for kernel in KERNELS {
            for classify in CLASSIFY.into_iter() {
                let name = format!("{name}, {:?}", camera.projection);
                hold(
                    &name,
                    (&volume, &coloured(0.3)),
                    &camera,
                    &options(kernel, classify),
                );
                let thick =
                    with_sheets(options(kernel, classify), |sheets| sheets.slab_voxels = 1.3);
                hold(
                    &format!("{name}, thick"),
                    (&volume, &coloured(0.3)),
                    &camera,
                    &thick,
                );
            }
        }
    }
}

#[test]
fn cubic_grid() {
    hold_grid("cubic", DAffine3::IDENTITY);
}

#[test]
fn sheared_grid_and_stretched_grid() {
    hold_grid("sheared", sheared_grid());
    hold_grid(
        "stretched",
        DAffine3::from_scale(DVec3::new(0.5, 1.3, -0.7)),
    );
}

#[test]
fn eye_inside_the_volume() {
    let volume = random_volume([6, 5, 7], DAffine3::IDENTITY);
    let eye = DVec3::new(2.2, 2.3, 2.6);
    for fov_deg in [40.0, 110.0] {
        let camera = perspective(eye, eye + DVec3::new(0.5, 0.2, 1.0), fov_deg, [15, 13]);
        for kernel in KERNELS {
            for classify in CLASSIFY.into_iter() {
                hold(
                    "eye inside",
                    (&volume, &coloured(0.3)),
                    &camera,
                    &options(kernel, classify),
                );
            }
        }
    }
}

#[test]
fn points_and_mixtures() {
    let volume = random_volume([6, 5, 12], DAffine3::IDENTITY);
    // The spacing falls below one pixel half way through.
    let camera = perspective(
        DVec3::new(2.5, 2.0, -7.0),
        DVec3::new(2.4, 2.1, 6.0),
        80.0,
        [22, 22],
    );
    for select in [SelectMode::Points, SelectMode::Hybrid] {
        for classify in CLASSIFY {
            for kernel in &KERNELS[1..] {
                let options = with_samples(options(*kernel, classify), |samples| {
                    samples.select = select
                });
                hold("mixture", (&volume, &coloured(0.3)), &camera, &options);
            }
        }
    }
    let hybrid = with_samples(options(KernelShape::Gaussian, Classify::Pre), |samples| {
        samples.select = SelectMode::Hybrid
    });
    let mut renderer = Renderer::new(&volume, &coloured(0.3), &hybrid).expect("valid options");
    let stats = renderer.render(&camera).expect("a valid camera").stats;
    assert!(
        stats.points > 9 && stats.splats > 9,
        "{} points, {} splats",
        stats.points,
        stats.splats
    );
}

#[test]
fn means_of_cells() {
    let volume = random_volume([5, 4, 6], sheared_grid());
    let middle = sheared_grid().transform_point3(DVec3::new(2.0, 1.5, 2.5));
    for camera in cameras(middle, 7.0) {
        for kernel in KERNELS {
            let options = with_samples(options(kernel, Classify::Pre), |samples| {
                samples.cells = Cells::Mean
            });
            hold(
                "means of cells",
                (&volume, &coloured(0.3)),
                &camera,
                &options,
            );
        }
    }
}

/// The residual of the coefficients, a thousandth of the range, comes on top of the bound.
#[test]
fn interpolating_kernels() {
    let volume = random_volume([5, 4, 6], sheared_grid());
    let middle = sheared_grid().transform_point3(DVec3::new(2.0, 1.5, 2.5));
    for camera in cameras(middle, 7.0) {
        for kernel in &KERNELS[1..] {
            for select in [SelectMode::Splats, SelectMode::Points] {
                let interpolate = Interpolate::On;
                let options = with_sheets(
                    with_samples(options(*kernel, Classify::Post), |samples| {
                        samples.select = select
                    }),
                    |sheets| sheets.interpolate = interpolate,
                );
                hold(
                    "interpolating",
                    (&volume, &coloured(0.3)),
                    &camera,
                    &options,
                );
            }
        }
    }
}

/// What is added to image sheets of kernels by light and by the ramp over the gradient.
fn lights() -> [RenderOptions; 3] {
    let towards = Light::Towards(DVec3::new(0.4, 1.0, -0.7));
    let plain = RenderOptions::default();
    [
        RenderOptions {
            shading: Shading::Phong,
            ..plain.clone()
        },
        RenderOptions {
            shading: Shading::Lambert,
            light: towards,
            ..plain.clone()
        },
        RenderOptions {
            shading: Shading::Phong,
            light: towards,
            gradient_opacity: Some(GradientOpacity::ramp(0.02, 0.4)),
            ..plain
        },
    ]
}

/// `options`, lit and following the gradient as `light` says.
fn lit_as(light: &RenderOptions, options: RenderOptions) -> RenderOptions {
    let RenderOptions {
        shading,
        light,
        gradient_opacity,
        ..
    } = light.clone();
    RenderOptions {
        shading,
        light,
        gradient_opacity,
        ..options
    }
}

#[test]
fn gradients_are_summed_with_the_scalars() {
    let volume = random_volume([5, 4, 6], sheared_grid());
    let middle = sheared_grid().transform_point3(DVec3::new(2.0, 1.5, 2.5));
    for camera in cameras(middle, 7.0) {
        for (light, kernel) in lights()
            .iter()
            .flat_map(|light| KERNELS.map(|kernel| (light, kernel)))
        {
            for classify in CLASSIFY.into_iter() {
                let lit = lit_as(light, options(kernel, classify));
                hold("lit", (&volume, &coloured(0.3)), &camera, &lit);
            }
        }
    }
}

#[test]
fn light_on_points_on_interpolating_kernels_and_on_cells() {
    let volume = random_volume([5, 4, 6], sheared_grid());
    let middle = sheared_grid().transform_point3(DVec3::new(2.0, 1.5, 2.5));
    let [camera, _] = cameras(middle, 7.0);
    let gaussian = KernelShape::Gaussian;
    for light in &lights() {
        for classify in CLASSIFY {
            let points = with_samples(options(gaussian, classify), |samples| {
                samples.select = SelectMode::Points
            });
            hold(
                "lit points",
                (&volume, &coloured(0.3)),
                &camera,
                &lit_as(light, points),
            );
        }
        let sharp = with_sheets(options(gaussian, Classify::Post), |sheets| {
            sheets.interpolate = Interpolate::On
        });
        hold(
            "lit, interpolating",
            (&volume, &coloured(0.3)),
            &camera,
            &lit_as(light, sharp),
        );
        let cells = with_samples(options(gaussian, Classify::Pre), |samples| {
            samples.cells = Cells::Mean
        });
        hold(
            "lit cells",
            (&volume, &coloured(0.3)),
            &camera,
            &lit_as(light, cells),
        );
    }
}

#[test]
fn clips_cut_sections_along_the_ray_and_keep_points_or_not() {
    let volume = random_volume([6, 5, 7], sheared_grid());
    let middle = sheared_grid().transform_point3(DVec3::new(2.5, 2.0, 3.0));
    let normal = DVec3::new(1.0, 2.0, -1.0);
    // Through no voxel: rounding would decide about a point that lies in the plane.
    let slanted = ClipPlane {
        normal,
        offset: normal.dot(middle) + 0.03,
    };
    let crop_in_world = Some([
        middle - DVec3::new(1.1, 0.7, 2.3),
        middle + DVec3::new(0.9, 1.3, 1.7),
    ]);
    for clip in [
        Clip {
            planes: vec![slanted],
            ..Clip::default()
        },
        Clip {
            crop_in_world,
            ..Clip::default()
        },
        Clip {
            crop_in_world,
            planes: vec![slanted],
            ..Clip::default()
        },
    ] {
        for camera in cameras(middle, 9.0) {
            for kernel in KERNELS {
                for classify in CLASSIFY.into_iter() {
                    for select in [SelectMode::Splats, SelectMode::Points] {
                        let clipped = with_samples(
                            RenderOptions {
                                clip: clip.clone(),
                                ..options(kernel, classify)
                            },
                            |samples| samples.select = select,
                        );
                        hold("clipped", (&volume, &coloured(0.3)), &camera, &clipped);
                    }
                }
            }
        }
    }
}

/// Most voxels are dropped: what is left must sum to what all of them sum to.
#[test]
fn dropped_voxels_change_nothing() {
    let volume = blobs(17).expect("a good size");
    let white = [(0.0, [1.0, 0.9, 0.8]), (2.0, [0.2, 0.5, 1.0])];
    let band = transfer(&white, &[(0.6, 0.0), (0.9, 0.5), (1.2, 0.0)]);
    for camera in cameras(DVec3::ZERO, 2.0) {
        for kernel in KERNELS {
            hold(
                "band of blobs",
                (&volume, &band),
                &camera,
                &options(kernel, Classify::Post),
            );
        }
    }
}

#[test]
fn ewa_is_refused() {
    let refused = with_samples(options(KernelShape::Gaussian, Classify::Post), |samples| {
        samples.select = SelectMode::Ewa
    });
    let volume = random_volume([3, 3, 3], DAffine3::IDENTITY);
    let error = Renderer::new(&volume, &coloured(0.3), &refused)
        .err()
        .map(|e| e.to_string());
    assert!(
        error.as_deref().is_some_and(|e| e.contains("every-sample")),
        "{error:?}"
    );
}
