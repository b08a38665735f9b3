//! Orders that classify voxels: each is lit where it stands, by its own gradient.

use glam::{DAffine3, DVec3};
use resample_core::SelectMode;
use resample_tests::choices::{classified_orders, with_samples};
use resample_tests::volumes::scenes::render;
use volsplat::transfer::{ColourKnot, OpacityKnot};
use volsplat::{
    Cells, Clip, GradientOpacity, Light, RenderOptions, Shading, TransferFunction, Volume, Voxels,
};

use super::{AMBIENT, COLOUR, DIFFUSE, POWER, SPECULAR, camera, options, sheared};

/// Voxels that stand alone: of these two one is seen, the other is clipped away or was never there.
const SEEN: [usize; 3] = [8, 7, 8];
const CLIPPED: [usize; 3] = [3, 4, 3];

/// A field whose gradient at a voxel (grid units) is the second, invisible except at single voxels.
fn curved(at: DVec3) -> (f64, DVec3) {
    let value = 0.2 * at.x * at.x + 0.1 * at.y * at.y - 0.15 * at.z * at.z + 0.5 * at.x;
    (value, DVec3::new(0.4 * at.x + 0.5, 0.2 * at.y, -0.3 * at.z))
}

fn single_voxels(visible: &[[usize; 3]], grid: DAffine3) -> (Volume, TransferFunction) {
    let n = 12;
    let voxel = |i: usize| {
        let at = [i % n, i / n % n, i / (n * n)];
        if visible.contains(&at) {
            100.0
        } else {
            curved(DVec3::from(at.map(|a| a as f64))).0 as f32
        }
    };
    let voxels = Voxels::F32((0..n * n * n).map(voxel).collect());
    let knot = |value, opacity| OpacityKnot { value, opacity };
    let transfer = TransferFunction::new(
        vec![ColourKnot {
            value: 0.0,
            rgb: COLOUR,
        }],
        vec![knot(80.0, 0.0), knot(90.0, 0.4)],
    );
    (
        Volume::new([n; 3], voxels, grid).expect("valid"),
        transfer.expect("valid"),
    )
}

/// The orders that classify voxels light each with its own gradient and the ray to its own place; a clip that removes
/// others changes neither.
#[test]
fn a_classified_voxel_is_lit_where_it_stands() {
    let grid = sheared();
    let place = DVec3::from(SEEN.map(|a| a as f64));
    let in_world = grid.transform_point3(place);
    let gradient = grid.matrix3.inverse().transpose() * curved(place).1;
    let normal = gradient.normalize();
    let (alone, transfer) = single_voxels(&[SEEN], grid);
    let (both, _) = single_voxels(&[SEEN, CLIPPED], grid);
    let half = Clip {
        crop_in_grid: Some([DVec3::splat(5.0), DVec3::splat(11.0)]),
        ..Clip::default()
    };
    let camera = camera(&alone);
    let ray = (in_world - camera.camera_from_world.inverse().translation).normalize();
    // Half-way to the mirrored view, so that the highlight is strong and not at its top.
    let light = (2.0 * normal.dot(-ray) * normal + ray + DVec3::new(0.1, 0.05, 0.0)).normalize();
    let body = AMBIENT + DIFFUSE * normal.dot(light).abs();
    let mirrored = 2.0 * normal.dot(light) * normal - light;
    let shine = SPECULAR * (-mirrored.dot(ray)).max(0.0).powi(POWER);
    assert!(shine > 0.05, "the highlight is seen: {shine}");
    for order in classified_orders() {
        for select in [SelectMode::Splats, SelectMode::Points] {
            let lit = options(Shading::Phong, Light::Towards(light));
            let plain = with_samples(lit, |samples| {
                samples.order = order;
                samples.select = select;
                samples.cells = Cells::Off;
            });
            let whole = render(&alone, &transfer, &plain, &camera);
            let clipped = render(
                &both,
                &transfer,
                &RenderOptions {
                    clip: half.clone(),
                    ..plain.clone()
                },
                &camera,
            );
            let ramp = Some(GradientOpacity::ramp(0.0, 2.0 * gradient.length()));
            let faint = render(
                &alone,
                &transfer,
                &RenderOptions {
                    gradient_opacity: ramp,
                    ..plain.clone()
                },
                &camera,
            );
            let mut seen = 0;
            for (k, pixel) in whole
                .rgba
                .iter()
                .enumerate()
                .filter(|(_, pixel)| pixel[3] > 0.02)
            {
                seen += 1;
                for channel in 0..3 {
                    let expected = body * f64::from(COLOUR[channel]) + shine;
                    let got = f64::from(pixel[channel]) / f64::from(pixel[3]);
                    assert!(
                        (got - expected).abs() < 2e-5,
                        "{got} against {expected}, {plain:?}"
                    );
                    let behind = (clipped.rgba[k][channel] - pixel[channel]).abs();
                    assert!(behind < 1e-6, "clipping changes it by {behind}, {plain:?}");
                }
                // Half of the ramp: half of the extinction.
                let depth = |alpha: f32| -f64::from(-alpha).ln_1p();
                let ratio = depth(faint.rgba[k][3]) / depth(pixel[3]);
                assert!(
                    (ratio - 0.5).abs() < 1e-4,
                    "extinction times {ratio}, {plain:?}"
                );
            }
            assert!(seen > 3, "{seen} pixels, {plain:?}");
        }
    }
}
