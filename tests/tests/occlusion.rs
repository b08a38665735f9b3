//! Culling what lies behind opaque pixels changes no pixel by more than its bound, in every order of compositing.
//!
//! A pixel left alone at transmittance T can change by at most T: what lies behind adds at most T of colour.

use glam::{DAffine3, DVec3};
use resample_tests::lod_scenes::procedural;
use resample_tests::scenes::{coloured, perspective, random_volume, render, worst_difference};
use volsplat::{Cells, Order, RenderOptions, SheetSums};

#[test]
fn the_early_end_changes_no_pixel_by_more_than_its_bound() {
    let mut scenes: Vec<_> = procedural().into_iter().map(|s| (s.name, s.volume, s.transfer)).collect();
    scenes.push(("noise", random_volume([40, 37, 33], DAffine3::IDENTITY), coloured(0.4)));
    for (name, volume, look) in &scenes {
        let extent = DVec3::from(volume.dims.map(|n| (n - 1) as f64));
        let middle = volume.world_from_index.transform_point3(0.5 * extent);
        let size = (volume.world_from_index.matrix3 * extent).length();
        for (away, side) in [(0.9, 48u32), (4.0, 32)] {
            let eye = middle + away * size * DVec3::new(0.5, 0.4, -0.75);
            let camera = perspective(eye, middle, 40.0, [side; 2]);
            for order in [Order::EverySample, Order::ImageSheets, Order::AxisSheets] {
                for sheet_sums in [SheetSums::Gather, SheetSums::Scatter] {
                    // Voxels as they are: the samples of cells go the same way, and are many.
                    let cells = Cells::Off;
                    let options = RenderOptions {
                        order,
                        sheet_sums,
                        cells,
                        lod_error: 0.0,
                        ..RenderOptions::default()
                    };
                    let full = RenderOptions { min_transmittance: 0.0, ..options.clone() };
                    for bound in [1.0 / 512.0, 0.05] {
                        let early = RenderOptions { min_transmittance: bound, ..options.clone() };
                        let worst = worst_difference(
                            &render(volume, look, &early, &camera),
                            &render(volume, look, &full, &camera),
                        );
                        // Sums of f32 in another order, beside the bound.
                        let most = f64::from(bound) + 1e-5;
                        assert!(worst <= most, "{name}, {order:?}, {sheet_sums:?}: {worst}, bound {bound}");
                    }
                }
            }
        }
    }
}
