//! Shading against closed forms: a linear field has one gradient everywhere, so every pixel of it is lit alike.
//! (METHOD section 3: image sheets with gradient shading.)

mod voxels;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use resample_core::metrics::{Mask, compare};
use resample_core::{Camera, KernelShape, LookAt, SelectMode};
use resample_tests::choices::{classified_orders, summed, with_field, with_samples, with_sheets};
use resample_tests::volumes::analytic_fields::AnalyticField;
use resample_tests::volumes::scenes::render;
use volsplat::transfer::{ColourKnot, OpacityKnot};
use volsplat::{
    Blend, Cells, Channel, Classify, GradientOpacity, Interpolate, Light, Look, RenderOptions,
    Renderer, Scene, Shading, Subpixels, TransferFunction, Volume, Voxels,
};

/// Ambient and diffuse share, highlight and its exponent, as the shading's documentation gives them.
const AMBIENT: f64 = 0.3;
const DIFFUSE: f64 = 0.7;
const SPECULAR: f64 = 0.2;
const POWER: i32 = 20;

const COLOUR: [f32; 3] = [0.9, 0.5, 0.1];

/// A field that rises linearly along `gradient` (grid units), wholly visible and in one colour.
fn ramp(gradient: DVec3, world_from_index: DAffine3) -> (Volume, TransferFunction) {
    let n = 12;
    let at = |i: usize| DVec3::new((i % n) as f64, (i / n % n) as f64, (i / (n * n)) as f64);
    let voxels = (0..n * n * n)
        .map(|i| (100.0 + gradient.dot(at(i))) as f32)
        .collect();
    let volume = Volume::new([n; 3], Voxels::F32(voxels), world_from_index).expect("valid");
    let transfer = TransferFunction::new(
        vec![ColourKnot {
            value: 0.0,
            rgb: COLOUR,
        }],
        vec![OpacityKnot {
            value: 0.0,
            opacity: 0.6,
        }],
    );
    (volume, transfer.expect("valid"))
}

fn camera(volume: &Volume) -> Camera {
    let middle = volume.world_from_index.transform_point3(DVec3::splat(5.5));
    let pose = LookAt {
        position: middle + DVec3::new(30.0, 20.0, 50.0),
        target: middle,
        up: DVec3::Y,
    };
    Camera::perspective(&pose, 0.3, [32, 32]).expect("valid")
}

/// The colour of a ray over its opacity: what a sample was lit to. Only pixels whose samples have whole differences
/// on all sides are looked at, near the middle of the picture.
fn lit_colours(
    volume: &Volume,
    transfer: &TransferFunction,
    options: &RenderOptions,
) -> Vec<(DVec2, [f64; 3])> {
    let camera = camera(volume);
    let mut renderer = Renderer::new(volume, transfer, options).expect("valid options");
    let image = renderer.render(&camera).expect("valid camera").image;
    let middle = (12..20).flat_map(|y| (12..20).map(move |x| (x, y)));
    middle
        .map(|(x, y)| {
            let pixel = image.pixel(x, y);
            let colour = [0, 1, 2].map(|k| f64::from(pixel[k]) / f64::from(pixel[3]));
            (DVec2::new(x as f64 + 0.5, y as f64 + 0.5), colour)
        })
        .collect()
}

fn options(shading: Shading, light: Light) -> RenderOptions {
    RenderOptions {
        shading,
        light,
        subpixels: Subpixels::Fixed(1),
        min_transmittance: 0.0,
        ..RenderOptions::default()
    }
}

fn sheared() -> DAffine3 {
    DAffine3::from_mat3_translation(
        DMat3::from_cols(
            DVec3::new(1.0, 0.2, 0.0),
            DVec3::new(-0.3, 0.5, 0.1),
            DVec3::new(0.0, 0.4, 2.0),
        ),
        DVec3::new(5.0, -3.0, 2.0),
    )
}

/// The faces of the volume take one-sided differences, of half the size: only a gradient along an axis keeps its
/// direction there, in the grid as in the world.
const ALONG_X: DVec3 = DVec3::new(3.0, 0.0, 0.0);

/// All that can be lit, with what rounding may change: sums of many kernels round more often.
fn ways(options: &RenderOptions) -> Vec<(RenderOptions, f64)> {
    let mut ways = vec![(options.clone(), 2e-6)];
    for shape in KernelShape::ALL {
        let summed = summed(options.clone(), shape);
        for select in [SelectMode::Splats, SelectMode::Points] {
            ways.push((
                with_samples(summed.clone(), |samples| samples.select = select),
                1e-5,
            ));
        }
        let interpolate = Interpolate::On;
        ways.push((
            with_sheets(summed, |sheets| sheets.interpolate = interpolate),
            1e-5,
        ));
    }
    ways
}

#[test]
fn lambert_follows_the_cosine_in_the_world() {
    for grid in [
        DAffine3::IDENTITY,
        DAffine3::from_scale(DVec3::new(1.0, 2.0, 0.5)),
        sheared(),
    ] {
        let (volume, transfer) = ramp(ALONG_X, grid);
        let normal = (grid.matrix3.inverse().transpose() * ALONG_X).normalize();
        for light in [
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(-4.0, 1.0, 0.5),
            normal,
            -normal,
        ] {
            let options = options(Shading::Lambert, Light::Towards(light));
            let factor = AMBIENT + DIFFUSE * normal.dot(light.normalize()).abs();
            let mut ways = ways(&options);
            // Samples that are lit by themselves are all lit alike.
            for order in classified_orders() {
                for cells in [Cells::Off, Cells::Mean] {
                    ways.push((
                        with_samples(options.clone(), |samples| {
                            samples.order = order;
                            samples.cells = cells;
                        }),
                        1e-5,
                    ));
                }
            }
            for (options, bound) in ways {
                for (pixel, colour) in lit_colours(&volume, &transfer, &options) {
                    for (got, own) in colour.iter().zip(COLOUR) {
                        let expected = factor * f64::from(own);
                        assert!(
                            (got - expected).abs() < bound,
                            "{pixel} lit from {light}: {got} against {expected}, {options:?}"
                        );
                    }
                }
            }
        }
    }
}

/// Scalars and lengths have the user's units: light and the ramp over the gradient see directions and ratios alone, also
/// where the square of a gradient, or the gradient itself, is beyond what f32 holds.
#[test]
fn light_does_not_depend_on_units() {
    let light = DVec3::new(1.0, 2.0, 3.0);
    let factor = AMBIENT + DIFFUSE * light.normalize().x;
    let mut usual = std::collections::HashMap::new();
    let units = [
        (1.0, 1.0),
        (1e25, 1.0),
        (1e-25, 1.0),
        (1.0, 1e-7),
        (1e20, 1e-6),
        (1e-20, 1e6),
        (1e32, 1e-8),
    ];
    for (value, length) in units {
        let (unscaled, transfer) = ramp(ALONG_X, DAffine3::IDENTITY);
        let voxels = (0..unscaled.len())
            .map(|i| (value * unscaled.value(i)) as f32)
            .collect();
        let grid = DAffine3::from_scale(DVec3::splat(length));
        let volume = Volume::new(unscaled.dims, Voxels::F32(voxels), grid).expect("valid");
        let target = DVec3::splat(5.5 * length);
        let pose = LookAt {
            position: target + length * DVec3::new(30.0, 20.0, 50.0),
            target,
            up: DVec3::Y,
        };
        let camera = Camera::perspective(&pose, 0.3, [32, 32]).expect("valid");
        let slope = ALONG_X.x * value / length;
        let lit = options(Shading::Lambert, Light::Towards(light));
        let mut ways = vec![lit.clone()];
        let summed = summed(lit.clone(), KernelShape::Polynomial);
        ways.push(summed.clone());
        ways.push(with_sheets(summed, |sheets| {
            sheets.classify = Classify::Pre
        }));
        ways.push(with_samples(lit, |_| {}));
        for (number, options) in ways.into_iter().enumerate() {
            let whole = render(&volume, &transfer, &options, &camera).pixel(16, 16);
            for channel in 0..3 {
                let got = f64::from(whole[channel]) / f64::from(whole[3]);
                let expected = factor * f64::from(COLOUR[channel]);
                assert!(
                    (got - expected).abs() < 1e-5,
                    "{value:e} {length:e}: {got}, {expected}, {options:?}"
                );
            }
            if slope < f64::from(f32::MAX) / 4.0 {
                // About half of the extinction; differences at faces are others.
                let gradient_opacity = Some(GradientOpacity::ramp(0.0, 2.0 * slope));
                let faint = render(
                    &volume,
                    &transfer,
                    &RenderOptions {
                        gradient_opacity,
                        ..options.clone()
                    },
                    &camera,
                );
                let depth = |alpha: f32| -f64::from(-alpha).ln_1p();
                let ratio = depth(faint.pixel(16, 16)[3]) / depth(whole[3]);
                assert!(
                    (0.4..0.6).contains(&ratio),
                    "{value:e} {length:e}: {ratio}, {options:?}"
                );
                let usual = *usual.entry(number).or_insert(ratio);
                assert!(
                    (ratio - usual).abs() < 1e-3,
                    "{value:e} {length:e}: {ratio}, {usual}, {options:?}"
                );
            }
        }
    }
}

#[test]
fn a_headlight_shines_along_the_view() {
    let (volume, transfer) = ramp(ALONG_X, DAffine3::IDENTITY);
    let forward = camera(&volume).forward_in_world();
    let head = lit_colours(
        &volume,
        &transfer,
        &options(Shading::Phong, Light::Headlight),
    );
    let same = lit_colours(
        &volume,
        &transfer,
        &options(Shading::Phong, Light::Towards(-7.0 * forward)),
    );
    assert_eq!(
        head, same,
        "a light of any length, from where the camera is"
    );
}

#[test]
fn phong_adds_the_mirrored_light() {
    let (volume, transfer) = ramp(ALONG_X, DAffine3::IDENTITY);
    let camera = camera(&volume);
    // The mirror image of the view about the normal: the highlight is at its strongest near the middle.
    let forward = camera.forward_in_world();
    let light = forward - 2.0 * forward.x * DVec3::X;
    for light in [light, light + DVec3::new(0.1, 0.2, 0.0)].map(DVec3::normalize) {
        let normal = DVec3::X * light.x.signum();
        let mirrored = 2.0 * normal.dot(light) * normal - light;
        let mut strongest = 0.0f64;
        for (options, bound) in ways(&options(Shading::Phong, Light::Towards(light))) {
            for (pixel, colour) in lit_colours(&volume, &transfer, &options) {
                let (_, in_camera) = camera.ray_in_camera(pixel);
                let ray = (camera.camera_from_world.matrix3.transpose() * in_camera).normalize();
                let shine = SPECULAR * (-mirrored.dot(ray)).max(0.0).powi(POWER);
                strongest = strongest.max(shine);
                for (got, own) in colour.iter().zip(COLOUR) {
                    let expected = (AMBIENT + DIFFUSE * light.x.abs()) * f64::from(own) + shine;
                    // The highlight is a power of 20.
                    let bound = bound + 3e-6;
                    assert!(
                        (got - expected).abs() < bound,
                        "{pixel}: {got} against {expected}, {options:?}"
                    );
                }
            }
        }
        assert!(strongest > 0.1, "the highlight is in view: {strongest}");
    }
}

/// Balls whose normals are known by formula: a lit picture is about as near to its truth as the unlit one, and the kernels
/// that interpolate are nearer than the trilinear one, with the same sub-pixels.
#[test]
fn lit_balls_are_near_their_formula() {
    let field = AnalyticField::Blobs;
    let (volume, camera) = (field.volume(), field.camera(1.0));
    let light = Light::Towards(DVec3::new(0.3, 1.0, -0.4));
    let lights = [Shading::None, Shading::Phong].map(|shading| RenderOptions {
        shading,
        light,
        subpixels: Subpixels::Fixed(2),
        ..RenderOptions::default()
    });
    // The truth depends on the light alone, so that one serves every kernel.
    let truths = lights
        .each_ref()
        .map(|options| field.truth_lit(&camera, options));
    let psnr_db = |options: &RenderOptions| {
        let image = render(&volume, &field.look(), options, &camera);
        let truth = &truths[usize::from(options.shading != Shading::None)];
        compare(&image, truth, Some(&Mask::from_alpha(truth)))
            .expect("pictures of one size")
            .psnr_db
    };
    let of = |kernel, interpolate| {
        lights.clone().map(|options| {
            psnr_db(&with_sheets(summed(options, kernel), |sheets| {
                sheets.interpolate = interpolate
            }))
        })
    };
    let [unlit, trilinear] = lights.clone().map(|options| psnr_db(&options));
    println!("trilinear: {unlit:.1} dB unlit, {trilinear:.1} dB lit");
    for shape in KernelShape::ALL {
        let [blurred, sharp] =
            [Interpolate::Off, Interpolate::On].map(|interpolate| of(shape, interpolate));
        println!("{shape:?}: {blurred:.1?} dB unlit and lit, interpolating {sharp:.1?}");
        for [unlit, lit] in [blurred, sharp] {
            assert!(
                lit > unlit - 3.0,
                "{shape:?}: light costs {:.1} dB",
                unlit - lit
            );
        }
        if shape != KernelShape::Polynomial {
            assert!(
                sharp[1] > trilinear,
                "{shape:?}: {:.1} dB lit, trilinear {trilinear:.1}",
                sharp[1]
            );
        }
    }
}

#[test]
fn a_field_without_a_gradient_shows_its_ambient_part() {
    let (volume, transfer) = ramp(DVec3::ZERO, DAffine3::IDENTITY);
    for (options, bound) in ways(&options(Shading::Phong, Light::Headlight)) {
        for (pixel, colour) in lit_colours(&volume, &transfer, &options) {
            for (got, own) in colour.iter().zip(COLOUR) {
                assert!(
                    (got - AMBIENT * f64::from(own)).abs() < bound,
                    "{pixel}: {got}, {options:?}"
                );
            }
        }
    }
}

#[test]
fn shading_where_it_cannot_be_is_refused() {
    let (volume, transfer) = ramp(ALONG_X, DAffine3::IDENTITY);
    let lit = options(Shading::Phong, Light::Headlight);
    for bad in [
        with_field(lit.clone(), |field| field.blend = Blend::Maximum),
        RenderOptions {
            light: Light::Towards(DVec3::ZERO),
            ..lit.clone()
        },
        RenderOptions {
            light: Light::Towards(DVec3::NAN),
            ..lit.clone()
        },
    ] {
        assert!(Renderer::new(&volume, &transfer, &bad).is_err(), "{bad:?}");
    }
    let channel = Channel {
        volume: &volume,
        look: Look::Transfer(&transfer),
    };
    let two = Scene {
        channels: vec![channel; 2],
        mask: None,
    };
    let error = Renderer::with_scene(&two, &with_samples(lit, |_| {}));
    assert!(error.is_err_and(|error| error.to_string().contains("one channel of scalars")));
}
