//! A view from the reference's own camera: known pixels come back as they are.
//!
//! A pixel beside unknown depth is partly covered by what is known, so anywhere else it is partly transparent. At home its
//! colour is known whole. The same holds where the target is a part of the reference's picture, cut at whole pixels.

use glam::DVec2;
use resample_core::Camera;

use crate::prepared::Prepared;
use crate::view::layer::Layer;
use crate::view::warp::Warp;

/// A reference whose samples move by no more than this on the screen is at home, px. From 0 to this the known pixels fade
/// from as they are to as they are drawn; a guess, small against what the spline resolves.
const HOME_PX: f64 = 0.02;

/// A target whose pixels are those of the reference.
pub(crate) struct Home {
    /// From a pixel of the reference to that of the target, px.
    offset: [i64; 2],
    /// How much it is at home, above 0 to 1.
    share: f32,
}

impl Home {
    /// `None` where a sample of `reference` of any disparity up to `largest` moves farther than [`HOME_PX`].
    pub(super) fn new(reference: &Camera, largest: f32, warp: &Warp) -> Option<Self> {
        let size = DVec2::new(f64::from(reference.width), f64::from(reference.height));
        let shift = |share: DVec2, disparity: f64| {
            let pos = share * size;
            warp.at(pos, disparity).pos_in_screen() - pos
        };
        let offset = shift(DVec2::splat(0.5), f64::from(largest)).round();
        let mut moved = 0.0f64;
        for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]] {
            for disparity in [0.0, f64::from(largest)] {
                let away = (shift(corner.into(), disparity) - offset).length();
                // Parallel rays have no place at depth 0: NaN is no home.
                moved = if away >= 0.0 {
                    moved.max(away)
                } else {
                    f64::INFINITY
                };
            }
        }
        (moved < HOME_PX).then(|| Self {
            offset: [offset.x as i64, offset.y as i64],
            share: (1.0 - moved / HOME_PX) as f32,
        })
    }

    /// Puts the known pixels of the reference into `layer`.
    pub(super) fn give_back(&self, prepared: &Prepared, width: usize, layer: &mut Layer) {
        let columns = i64::from(prepared.camera.width);
        let height = layer.rgba.len() / width;
        for at in 0..prepared.surfaces.disparity.len() {
            let z = prepared.depth(at);
            let x = at as i64 % columns + self.offset[0];
            let y = at as i64 / columns + self.offset[1];
            let inside = (0..width as i64).contains(&x) && (0..height as i64).contains(&y);
            if !inside || !(z > 0.0) {
                continue;
            }
            let to = y as usize * width + x as usize;
            let rgb = prepared.colours.taken.get(at);
            for (found, known) in layer.rgba[to].iter_mut().zip([rgb[0], rgb[1], rgb[2], 1.0]) {
                *found += self.share * (known - *found);
            }
            layer.resolution[to] += self.share * (1.0 - layer.resolution[to]);
            if let Some(purity) = layer.purity.get_mut(to) {
                *purity += self.share * (1.0 - *purity);
            }
            if layer.depth[to].is_infinite() {
                layer.depth[to] = z;
            }
        }
    }
}
