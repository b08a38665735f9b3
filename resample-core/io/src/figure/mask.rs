//! Masks: the share of each pixel of a box that a letter, a line or a rim covers.

use glam::DVec2;
use resample_core::narrow::{cell, floor, single};

/// The share of each pixel of a box that something covers.
pub(super) struct Mask {
    /// Column and row of the first pixel.
    pub(super) first: [i64; 2],
    pub(super) size: [usize; 2],
    pub(super) cover: Vec<f32>,
}

impl Mask {
    /// An empty mask of the pixels between two corners; `None` if it has no pixel or a side above 65536 px.
    pub(super) fn around(low: DVec2, high: DVec2) -> Option<Self> {
        let first = low.floor();
        let size = high.ceil() - first;
        let is_sound = size.cmpge(DVec2::ONE).all() && size.cmple(DVec2::splat(65_536.0)).all();
        let [width, height] = is_sound.then(|| size.to_array().map(|side| cell(single(side))))?;
        Some(Self {
            first: first.to_array().map(floor),
            size: [width, height],
            cover: vec![0.0; width * height],
        })
    }

    /// Covers a share of a pixel more.
    pub(super) fn add(&mut self, [x, y]: [i64; 2], share: f32) {
        let place = [x - self.first[0], y - self.first[1]].map(usize::try_from);
        if let [Ok(x), Ok(y)] = place
            && x < self.size[0]
            && y < self.size[1]
        {
            let cover = &mut self.cover[x + self.size[0] * y];
            *cover = (*cover + share).min(1.0);
        }
    }

    /// The same with heavier edges: thin dark lines on a light ground look too light where colours are mixed in linear light.
    pub(super) fn heavier(&self) -> Self {
        const POWER: f32 = 0.6;
        Self {
            first: self.first,
            size: self.size,
            cover: self.cover.iter().map(|share| share.powf(POWER)).collect(),
        }
    }

    /// The same with a rim: the greatest cover within a radius, px.
    pub(super) fn widened(&self, radius_px: f64) -> Self {
        let reach = floor(radius_px.ceil());
        let rim = cell(single(radius_px.ceil()));
        let [width, height] = self.size;
        let wide = [width + 2 * rim, height + 2 * rim];
        let mut cover = vec![0.0f32; wide[0] * wide[1]];
        for (dy, down) in (-reach..=reach).zip(0..) {
            for (dx, right) in (-reach..=reach).zip(0..) {
                // The edge of the disc is as soft as a pixel.
                let share =
                    single((radius_px + 0.5 - (dx as f64).hypot(dy as f64)).clamp(0.0, 1.0));
                if share == 0.0 {
                    continue;
                }
                let shift = right + wide[0] * down;
                for (y, row) in self.cover.chunks_exact(width).enumerate() {
                    let to = &mut cover[shift + wide[0] * y..][..width];
                    for (to, from) in to.iter_mut().zip(row) {
                        *to = to.max(share * from);
                    }
                }
            }
        }
        Self {
            first: self.first.map(|at| at - reach),
            size: wide,
            cover,
        }
    }
}

/// The pixels that a line of a width covers, each by its distance.
pub(super) fn line_mask(from: DVec2, to: DVec2, width_px: f64) -> Option<Mask> {
    let reach = DVec2::splat(0.5 * width_px + 1.0);
    let mut mask = Mask::around(from.min(to) - reach, from.max(to) + reach)?;
    let along = to - from;
    let length = along.length_squared();
    let [left, top] = mask.first;
    let [width, height] = mask.size;
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let at = [behind(left, x), behind(top, y)];
        let middle = DVec2::new(at[0] as f64 + 0.5, at[1] as f64 + 0.5);
        let share = if length > 0.0 {
            ((middle - from).dot(along) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let distance = middle.distance(from + along * share);
        mask.add(
            at,
            single((0.5 * width_px + 0.5 - distance).clamp(0.0, 1.0)),
        );
    }
    Some(mask)
}

/// The pixel so many behind another.
pub(super) fn behind(first: i64, count: usize) -> i64 {
    first.saturating_add_unsigned(count as u64)
}
