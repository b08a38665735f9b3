//! The same scene in another unit of length is the same picture: for powers of two bit by bit, for powers of ten to the
//! rounding of the scene's own numbers. Every order and method; depths are compared in the scene's own unit.

use glam::{DAffine3, DMat3, DVec3};
use resample_core::{Camera, Image, KernelShape, SelectMode};
use resample_tests::choices::{with_field, with_samples, with_sheets};
use resample_tests::meshes::textured::{photo, wall};
use resample_tests::volumes::scenes::{coloured, orthographic, perspective, random_volume};
use resample_tests::warps::scenes::AnalyticScene;
use volsplat::{
    Blend, Classify, DepthPlane, Interpolate, Isosurface, RenderOptions, Renderer, Shading,
};
use warp3d::{Fill, Reference, WarpOptions, Warper};

/// Powers of two at which pictures are compared bit by bit.
const POWERS: [i32; 4] = [-100, -41, 13, 100];

/// Powers of ten; their products are rounded.
const TENS: [f64; 3] = [1e-11, 1e-10, 1e10];

/// A picture in another unit of length than one, with its depth brought back to that.
fn in_units(mut image: Image, unit: f64) -> Image {
    for depth in image.depth.iter_mut().flatten() {
        *depth = (f64::from(*depth) / unit) as f32;
    }
    image
}

fn scaled(camera: &Camera, unit: f64) -> Camera {
    let mut camera = *camera;
    camera.camera_from_world.translation *= unit;
    camera.near *= unit;
    if camera.projection == resample_core::Projection::Orthographic {
        (camera.fx, camera.fy) = (camera.fx / unit, camera.fy / unit);
    }
    camera
}

/// The largest difference of colour, and of depth as a share of it.
fn apart(a: &Image, b: &Image) -> f64 {
    let colours = resample_tests::volumes::scenes::worst_difference(a, b);
    let depths = a.depth.iter().flatten().zip(b.depth.iter().flatten());
    let depths = depths.filter(|(a, b)| a != b);
    let share = |(a, b): (&f32, &f32)| f64::from((a - b).abs() / a.abs());
    depths.map(share).fold(colours, f64::max)
}

/// Holds a picture to what it promises in other units: `of` draws it in a unit.
fn holds(name: &str, of: impl Fn(f64) -> Image) {
    let one = of(1.0);
    let shown = one.rgba.iter().filter(|p| p[3] > 0.1).count();
    assert!(
        shown > one.rgba.len() / 20,
        "{name}: {shown} pixels show something"
    );
    let wrong: Vec<String> = POWERS
        .iter()
        .map(|&k| (k, apart(&one, &in_units(of(2f64.powi(k)), 2f64.powi(k)))))
        .filter(|(_, apart)| *apart != 0.0)
        .map(|(k, apart)| format!("2^{k}: {apart:.1e}"))
        .collect();
    let worst = TENS
        .iter()
        .map(|&unit| apart(&one, &in_units(of(unit), unit)))
        .fold(0.0, f64::max);
    println!("| {name} | {} | {worst:.0e} |", wrong.len());
    assert!(wrong.is_empty(), "{name}: {}", wrong.join(", "));
    // Rounding may decide which of two samples at one depth comes first, and whether a cell is split: up to 3e-3 in a pixel.
    assert!(
        worst < 5e-3,
        "{name}: powers of ten change a pixel by {worst}"
    );
}

fn volume_options() -> Vec<(String, RenderOptions)> {
    let field = RenderOptions::default();
    let mut all = vec![("field".to_owned(), field.clone())];
    for blend in [
        Blend::Maximum,
        Blend::Average,
        Blend::Isosurface(Isosurface {
            value: 0.6,
            colour: None,
            opacity: 0.7,
        }),
    ] {
        all.push((
            format!("field, {blend:?}")
                .chars()
                .take_while(|c| *c != '(' && *c != '{')
                .collect(),
            with_field(field.clone(), |f| f.blend = blend),
        ));
    }
    all.push((
        "field, Phong".into(),
        RenderOptions {
            shading: Shading::Phong,
            ..field.clone()
        },
    ));
    for select in [
        SelectMode::Hybrid,
        SelectMode::Points,
        SelectMode::Splats,
        SelectMode::Ewa,
    ] {
        for (name, options) in [
            ("every sample", RenderOptions::every_sample()),
            ("every sample, paper", RenderOptions::paper()),
            ("axis sheets", RenderOptions::axis_sheets()),
        ] {
            all.push((
                format!("{name}, {select:?}"),
                with_samples(options, |s| s.select = select),
            ));
        }
    }
    all.push((
        "every sample, Phong".into(),
        RenderOptions {
            shading: Shading::Phong,
            ..RenderOptions::every_sample()
        },
    ));
    for kernel in KernelShape::ALL {
        for (classify, interpolate) in [
            (Classify::Pre, Interpolate::Off),
            (Classify::Post, Interpolate::Off),
            (Classify::Post, Interpolate::On),
        ] {
            let options = with_samples(RenderOptions::kernel_sheets(), |s| s.kernel = kernel);
            let options = with_sheets(options, |s| {
                (s.classify, s.interpolate) = (classify, interpolate)
            });
            all.push((
                format!("image sheets, {kernel:?}, {classify:?}, interpolate {interpolate:?}"),
                options,
            ));
        }
    }
    all
}

#[test]
fn volumes_in_every_order() {
    let grid = DAffine3::from_mat3_translation(
        DMat3::from_cols(
            DVec3::X,
            DVec3::new(0.1, 0.8, 0.0),
            DVec3::new(0.0, 0.3, 1.7),
        ),
        DVec3::new(0.3, -4.0, 2.0),
    );
    let (eye, target) = (DVec3::new(12.0, 6.0, -11.0), DVec3::new(3.5, -2.0, 6.0));
    let cameras = [
        ("perspective", perspective(eye, target, 40.0, [32, 24])),
        ("parallel", orthographic(eye, target, 13.0, [32, 24])),
    ];
    for (name, options) in volume_options() {
        for (projection, camera) in &cameras {
            holds(&format!("{name}, {projection}"), |unit| {
                let mut placed = grid;
                placed.matrix3 *= unit;
                placed.translation *= unit;
                let volume = random_volume([6, 7, 8], placed);
                let options = RenderOptions {
                    opacity_unit: Some(0.7 * unit),
                    depth: DepthPlane::Expected,
                    ..options.clone()
                };
                let mut renderer =
                    Renderer::new(&volume, &coloured(0.5), &options).expect("valid options");
                renderer
                    .render(&scaled(camera, unit))
                    .expect("a valid camera")
                    .image
            });
        }
    }
}

#[test]
fn meshes_with_every_method() {
    let eye = DVec3::new(0.6, 0.5, 1.9);
    let cameras = [
        ("perspective", perspective(eye, DVec3::ZERO, 60.0, [28, 24])),
        ("parallel", orthographic(eye, DVec3::ZERO, 2.2, [28, 24])),
    ];
    for method in texmap::Method::ALL {
        for shade in [texmap::Shade::Headlight, texmap::Shade::Pbr] {
            for (projection, camera) in &cameras {
                holds(&format!("{method:?}, {shade:?}, {projection}"), |unit| {
                    let mut scene = wall(photo(32));
                    scene.materials[0].lighting = texmap::scene::Lighting::Lit;
                    for position in &mut scene.meshes[0].positions {
                        *position = position.map(|c| (f64::from(c) * unit) as f32);
                    }
                    let options = texmap::RenderOptions {
                        method,
                        shade,
                        planes: vec![texmap::PlaneKind::Depth],
                        ..texmap::RenderOptions::default()
                    };
                    let mut renderer =
                        texmap::Renderer::new(&scene, &options).expect("valid options");
                    renderer
                        .render(&scaled(camera, unit))
                        .expect("a valid camera")
                        .image
                });
            }
        }
    }
}

#[test]
fn depth_images_with_every_method() {
    let start = resample_tests::warps::scenes::camera([36, 28], 30.0, DVec3::ZERO, 0.0);
    let aside =
        resample_tests::warps::scenes::camera([36, 28], 30.0, DVec3::new(0.3, 0.1, 0.2), 0.05);
    let reference = AnalyticScene::room().reference(&start);
    for method in warp3d::Method::ALL {
        for fill in [Fill::None, Fill::Background, Fill::Natural] {
            holds(&format!("{method:?}, {fill:?}"), |unit| {
                let reference = Reference {
                    camera: scaled(&start, unit),
                    depth: reference
                        .depth
                        .iter()
                        .map(|&z| (f64::from(z) * unit) as f32)
                        .collect(),
                    ..reference.clone()
                };
                let options = WarpOptions {
                    fill,
                    ..WarpOptions::with_method(method)
                };
                let mut warper = Warper::new(vec![reference], &options).expect("valid options");
                warper
                    .render(&scaled(&aside, unit))
                    .expect("a valid camera")
                    .image
            });
        }
    }
}
