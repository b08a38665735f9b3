//! McMillan's baseline: every sample sets the one pixel that it falls in.
//!
//! The reference is warped row by row; then each band of target rows takes the samples that fall in it, in reference
//! order with a z-buffer, or in occlusion order without one.

use rayon::prelude::*;

use crate::Reference;
use crate::bands::{BAND_ROWS, RowRange};
use crate::epipole::OcclusionOrder;
use crate::layer::Layer;
use crate::options::Visibility;
use crate::stats::FrameStats;
use crate::warp::{Warp, disparity};
use resample_core::Camera;
use resample_core::clock::StageClock;

/// Marks a sample that falls on no pixel.
const NOWHERE: u32 = u32::MAX;

/// Where a sample falls.
#[derive(Clone, Copy, Debug)]
struct Placed {
    pixel: u32,
    depth: f32,
}

/// Buffers that are kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Nearest {
    placed: Vec<Placed>,
    rows: Vec<RowRange>,
}

impl Nearest {
    /// Draws `reference` from `target`.
    pub(crate) fn render(
        &mut self,
        reference: &Reference,
        target: &Camera,
        visibility: Visibility,
        stats: &mut FrameStats,
    ) -> Layer {
        let clock = StageClock::start();
        self.project(reference, target);
        stats.stages.project += clock.stop();
        let known = reference.depth.iter().filter(|&&d| d > 0.0).count() as u64;
        stats.samples += known;
        stats.outside +=
            known.saturating_sub(self.placed.iter().filter(|p| p.pixel != NOWHERE).count() as u64);
        let clock = StageClock::start();
        let order = match visibility {
            Visibility::ZBuffer => None,
            Visibility::OcclusionOrder => {
                let size = [reference.camera.width, reference.camera.height];
                Some(OcclusionOrder::new(&reference.camera, target, size))
            }
        };
        let layer = self.draw(reference, target, order);
        stats.stages.accumulate += clock.stop();
        layer
    }

    fn project(&mut self, reference: &Reference, target: &Camera) {
        let width = reference.camera.width as usize;
        self.placed.resize(
            reference.depth.len(),
            Placed {
                pixel: NOWHERE,
                depth: 0.0,
            },
        );
        self.rows
            .resize(reference.camera.height as usize, RowRange::EMPTY);
        let warp = Warp::new(&reference.camera, target);
        let size = [f64::from(target.width), f64::from(target.height)];
        let rows = self
            .placed
            .par_chunks_mut(width)
            .zip(&mut self.rows)
            .enumerate();
        rows.for_each(|(y, (placed, range))| {
            let mut row = warp.row(y as u32);
            *range = RowRange::EMPTY;
            for (slot, &depth) in placed.iter_mut().zip(&reference.depth[y * width..]) {
                let known = disparity(reference.camera.projection, depth);
                let warped = row.next(f64::from(known.unwrap_or(0.0)));
                let at = warped.pos_in_screen();
                let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < size[0] && at.y < size[1];
                if known.is_none() || !inside || !warp.in_front(&warped) {
                    slot.pixel = NOWHERE;
                    continue;
                }
                range.include(at.y as f32);
                let pixel = at.y as u32 * target.width + at.x as u32;
                *slot = Placed {
                    pixel,
                    depth: warped.depth as f32,
                };
            }
        });
    }

    fn draw(&self, reference: &Reference, target: &Camera, order: Option<OcclusionOrder>) -> Layer {
        let width = target.width as usize;
        let mut layer = Layer::empty(width * target.height as usize);
        let band = width * BAND_ROWS;
        let planes = layer
            .rgba
            .par_chunks_mut(band)
            .zip(layer.depth.par_chunks_mut(band));
        planes
            .zip(layer.resolution.par_chunks_mut(band))
            .enumerate()
            .for_each(|(index, ((rgba, depth), resolution))| {
                let first = index * BAND_ROWS;
                let origin = first * width;
                let mut winner = vec![NOWHERE; depth.len()];
                let mut visit = |sample: usize, compare: bool| {
                    let placed = self.placed[sample];
                    let Some(slot) = (placed.pixel as usize).checked_sub(origin) else {
                        return;
                    };
                    if slot < depth.len()
                        && (!compare || placed.depth < depth[slot] || winner[slot] == NOWHERE)
                    {
                        depth[slot] = placed.depth;
                        winner[slot] = sample as u32;
                    }
                };
                self.visit_band(first, reference.camera.width as usize, order, &mut visit);
                for (slot, &sample) in winner.iter().enumerate().filter(|(_, w)| **w != NOWHERE) {
                    let [r, g, b] = reference.colour[sample as usize];
                    rgba[slot] = [r, g, b, 1.0];
                    resolution[slot] = 1.0;
                }
            });
        layer
    }

    /// Calls `visit` for the samples of every row that touches the band, in drawing order.
    fn visit_band(
        &self,
        first: usize,
        width: usize,
        order: Option<OcclusionOrder>,
        visit: &mut impl FnMut(usize, bool),
    ) {
        let touches = |y: usize| self.rows[y].touches(first, first + BAND_ROWS);
        match order {
            None => {
                for y in (0..self.rows.len()).filter(|&y| touches(y)) {
                    (y * width..(y + 1) * width).for_each(|sample| visit(sample, true));
                }
            }
            Some(order) => {
                for y in order
                    .rows
                    .indices()
                    .map(|y| y as usize)
                    .filter(|&y| touches(y))
                {
                    order
                        .columns
                        .indices()
                        .for_each(|x| visit(y * width + x as usize, false));
                }
            }
        }
    }
}
