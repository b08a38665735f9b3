//! Samples at the eye: kernels that hold the eye or cross the near plane.
//!
//! Their outline is a parabola, a hyperbola, or the whole screen, and only the part of the kernel beyond the near
//! plane is seen. There are few of them (within a kernel radius of the near plane, inside the view), so they are
//! integrated plainly in f64, pixel by pixel, with the kernel's own partial line integral, in front of all others.

use glam::{DVec2, DVec3};
use resample_core::composite::TilePixels;
use resample_core::maps::MapSource;
use resample_core::tile::TILE_PX;
use resample_core::{Kernel, OpacityMode};

/// A sample whose kernel is cut by the near plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearSample {
    /// Position in the indices of its layer.
    pub pos_in_grid: DVec3,
    /// The layer's number.
    pub layer: u8,
    /// Linear colour and strength, as in [`crate::paper::samples::sample::Brick::values`].
    pub value: [f32; 4],
    /// Distance from the eye, or camera z in orthographic views.
    pub depth: f32,
}

/// The input for integrating near samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearSetup {
    /// Camera in the grid, kernel radius, opacity unit.
    pub source: MapSource,
    /// The kernel.
    pub kernel: Kernel,
    /// Opacity of a pixel from optical depth.
    pub opacity: OpacityMode,
}

/// Composites `samples`, nearest first, onto the fresh pixels of the tile whose first pixel is `corner_px`; `setups` holds
/// one for each layer.
pub(crate) fn composite_near(
    setups: &[NearSetup],
    samples: &[NearSample],
    corner_px: [usize; 2],
    pixels: &mut TilePixels,
) {
    for row in 0..TILE_PX {
        for column in 0..TILE_PX {
            let pixel = DVec2::new(
                (corner_px[0] + column) as f64 + 0.5,
                (corner_px[1] + row) as f64 + 0.5,
            );
            composite_pixel(setups, samples, pixel, |weights| {
                pixels.transmittance[row][column] = weights.transmittance as f32;
                for (plane, c) in pixels.rgb.iter_mut().zip(weights.rgb) {
                    plane[row][column] = c as f32;
                }
                pixels.depth[row][column] = weights.depth as f32;
            });
        }
    }
}

struct PixelSum {
    transmittance: f64,
    rgb: [f64; 3],
    depth: f64,
}

fn composite_pixel(
    setups: &[NearSetup],
    samples: &[NearSample],
    pixel: DVec2,
    store: impl FnOnce(&PixelSum),
) {
    let mut sum = PixelSum {
        transmittance: 1.0,
        rgb: [0.0; 3],
        depth: 0.0,
    };
    for sample in samples {
        let setup = &setups[usize::from(sample.layer)];
        let view = &setup.source.view;
        let (origin, direction) = view.ray(pixel);
        let length = direction.length();
        let unit_per_grid = view.world_per_grid_along(direction) / setup.source.unit_in_world;
        let to_centre = sample.pos_in_grid - origin;
        let nearest = to_centre.dot(direction) / length;
        let distance2 = to_centre.cross(direction).length_squared() / (length * length);
        // The ray parameter is camera z: the near plane lies at grid distance near * |w| along it.
        let integral = setup
            .kernel
            .line_integral_from(distance2, view.near * length - nearest);
        let added = f64::from(sample.value[3]) * unit_per_grid * integral;
        let opacity = match setup.opacity {
            OpacityMode::Extinction => -(-added).exp_m1(),
            OpacityMode::Linear => added.min(1.0),
        };
        let weight = sum.transmittance * opacity;
        sum.transmittance -= weight;
        for (c, value) in sum.rgb.iter_mut().zip(sample.value) {
            *c += weight * f64::from(value);
        }
        sum.depth += weight * f64::from(sample.depth);
    }
    store(&sum);
}
