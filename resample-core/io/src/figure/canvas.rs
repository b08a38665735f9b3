//! A part of a picture that is drawn on: letters, lines and filled boxes, with a rim where the ground is not known.

use glam::DVec2;
use resample_core::Image;
use resample_core::narrow::{cell, single};

use crate::figure::mask::{Mask, behind, line_mask};
use crate::figure::parts::Ground;
use crate::figure::text;
use crate::figure::text::Anchor;

/// Share of the picture's shorter side that an em has: 19 px of 800. A guess, looked at on a page's width.
const EM_SHARE: f64 = 0.024;

/// Smallest size of the letters, px: smaller ones cannot be read.
const LEAST_EM_PX: f64 = 9.0;

/// Least distance of letters from the edge of the picture, ems. A guess.
const EDGE_EMS: f64 = 0.3;

/// Width of a rim, ems. A guess.
const RIM_EMS: f64 = 0.12;

/// A part of a picture that is drawn on.
pub(super) struct Canvas<'a> {
    image: &'a mut Image,
    /// Column and row of the whole picture at which the part begins.
    first: [usize; 2],
    /// Width and height of the whole picture, px.
    pub(super) size: [f64; 2],
    /// Height of letters, px.
    pub(super) em: f64,
    ground: Ground,
}

impl<'a> Canvas<'a> {
    pub(super) fn new(
        image: &'a mut Image,
        first: [usize; 2],
        size: [f64; 2],
        ground: Ground,
    ) -> Self {
        Self {
            image,
            first,
            size,
            em: (EM_SHARE * size[0].min(size[1])).max(LEAST_EM_PX),
            ground,
        }
    }

    /// Width of lines, px.
    pub(super) fn line_px(&self) -> f64 {
        (0.09 * self.em).max(1.0)
    }

    fn ink(&self) -> [f32; 3] {
        match self.ground {
            Ground::Light | Ground::Unknown => [0.0; 3],
            Ground::Dark => [1.0; 3],
        }
    }

    /// Draws a line of text. If its anchor lies inside the picture, the text is moved so that all of it is inside.
    pub(super) fn text(&mut self, text: &str, em_px: f64, at: DVec2, anchor: Anchor) {
        let at = self.moved_inside(at, anchor, text::size(text, em_px));
        if let Some(mask) = text::mask(text, em_px, at, anchor) {
            self.inked(&mask);
        }
    }

    /// The anchor at which a box of letters lies inside the picture. Anchors outside the picture stay, and so do boxes that are too large.
    fn moved_inside(&self, at: DVec2, Anchor(anchor): Anchor, size: DVec2) -> DVec2 {
        let picture = DVec2::from_array(self.size);
        let margin = DVec2::splat(EDGE_EMS * self.em);
        let is_inside = at.cmpge(DVec2::ZERO).all() && at.cmple(picture).all();
        let most = picture - margin - size;
        if !is_inside || most.cmplt(margin).any() {
            return at;
        }
        (at - anchor * size).clamp(margin, most) + anchor * size
    }

    /// Covers in the colour of letters, over a rim where that is needed.
    fn inked(&mut self, mask: &Mask) {
        if self.ground == Ground::Unknown {
            let rim = mask.widened(RIM_EMS * self.em);
            self.cover(&rim, [1.0; 3], None);
        }
        let ink = self.ink();
        let on_light = (self.ground != Ground::Dark).then(|| mask.heavier());
        self.cover(on_light.as_ref().unwrap_or(mask), ink, None);
    }

    /// A straight line in the colour of letters.
    pub(super) fn line(&mut self, from: DVec2, to: DVec2) {
        if let Some(mask) = line_mask(from, to, self.line_px()) {
            self.inked(&mask);
        }
    }

    /// Draws a straight line in a colour. With a camera z at both ends, nearer pixels of the picture hide it.
    pub(super) fn coloured_line(
        &mut self,
        from: DVec2,
        to: DVec2,
        colour: [f32; 3],
        depths: Option<[f64; 2]>,
    ) {
        let Some(mask) = line_mask(from, to, self.line_px()) else {
            return;
        };
        let along = depths.map(|depths| Depths { from, to, depths });
        self.cover(&mask, colour, along);
    }

    /// A line of the box of axes, in the colour of letters.
    pub(super) fn deep_line(&mut self, from: (DVec2, f64), to: (DVec2, f64)) {
        // On an unknown ground grey, which shows on white and on black.
        let grey = match self.ground {
            Ground::Light => [0.1; 3],
            Ground::Unknown => [0.25; 3],
            Ground::Dark => [0.6; 3],
        };
        self.coloured_line(from.0, to.0, grey, Some([from.1, to.1]));
    }

    /// A box whose rows have colours, from the bottom up.
    pub(super) fn ramp(&mut self, low: DVec2, high: DVec2, colours: &[[f32; 3]]) {
        let Some(mask) = Mask::around(low, high) else {
            return;
        };
        for y in 0..mask.size[1] {
            let row = behind(mask.first[1], y);
            let share = 1.0 - ((row as f64 + 0.5 - low.y) / (high.y - low.y)).clamp(0.0, 1.0);
            let place = share * (colours.len() - 1) as f64;
            let before = cell(single(place.floor()));
            let after = (before + 1).min(colours.len() - 1);
            let part = single(place - before as f64);
            let colour =
                [0, 1, 2].map(|k| colours[before][k] * (1.0 - part) + colours[after][k] * part);
            let vertical = overlap(row, low.y, high.y);
            for x in 0..mask.size[0] {
                let column = behind(mask.first[0], x);
                let share = single(vertical * overlap(column, low.x, high.x));
                self.pixel([column, row], share, colour, None);
            }
        }
    }

    fn cover(&mut self, mask: &Mask, colour: [f32; 3], depths: Option<Depths>) {
        for (index, &share) in mask.cover.iter().enumerate() {
            let at = [index % mask.size[0], index / mask.size[0]];
            let place = [0, 1].map(|axis| behind(mask.first[axis], at[axis]));
            self.pixel(place, share, colour, depths.as_ref());
        }
    }

    /// Lays a share of a colour over a pixel of the whole picture, or behind it where the pixel shows something nearer.
    fn pixel(&mut self, place: [i64; 2], share: f32, colour: [f32; 3], depths: Option<&Depths>) {
        let inside = [0, 1].map(|axis| {
            let first = self.first[axis] as u64;
            usize::try_from(place[axis].saturating_sub_unsigned(first))
        });
        let [Ok(x), Ok(y)] = inside else {
            return;
        };
        if !(share > 0.0) || x >= self.image.width || y >= self.image.height {
            return;
        }
        let index = x + self.image.width * y;
        let nearest = self
            .image
            .depth
            .as_ref()
            .map_or(f32::INFINITY, |depth| depth[index]);
        let is_behind = depths.is_some_and(|depths| depths.at(place) > f64::from(nearest));
        let laid = [
            colour[0] * share,
            colour[1] * share,
            colour[2] * share,
            share,
        ];
        let pixel = &mut self.image.rgba[index];
        *pixel = if is_behind {
            [0, 1, 2, 3].map(|k| pixel[k] + (1.0 - pixel[3]).max(0.0) * laid[k])
        } else {
            [0, 1, 2, 3].map(|k| laid[k] + (1.0 - share) * pixel[k])
        };
    }
}

/// Camera z along a line between two places of the screen.
struct Depths {
    from: DVec2,
    to: DVec2,
    depths: [f64; 2],
}

impl Depths {
    fn at(&self, [x, y]: [i64; 2]) -> f64 {
        let along = self.to - self.from;
        let place = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - self.from;
        let share = (place.dot(along) / along.length_squared()).clamp(0.0, 1.0);
        // One over z is even along the screen in perspective, and near enough in parallel views.
        let [near, far] = self.depths;
        1.0 / ((1.0 - share) / near + share / far)
    }
}

/// The share of a row or column of pixels that lies between two places.
fn overlap(at: i64, low: f64, high: f64) -> f64 {
    let at = at as f64;
    ((at + 1.0).min(high) - at.max(low)).clamp(0.0, 1.0)
}
