//! Letters: from a line of text and a size to the share of each pixel that they cover.
//!
//! The font is DejaVu Sans (Bitstream Vera's licence, and the public domain for what DejaVu adds), in the crate `dejavu`; outlines are covered by the crate
//! `ab_glyph`, exactly, at any size.

use std::sync::OnceLock;

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};
use glam::DVec2;
use resample_core::narrow::{floor, single};

use crate::figure::mask::Mask;

/// The place of a text's box that stands at a position: 0 is its left or upper edge, 1 its right or lower edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Anchor(pub(super) DVec2);

impl Anchor {
    pub(super) const MIDDLE: Self = Self(DVec2::new(0.5, 0.5));
    pub(super) const RIGHT: Self = Self(DVec2::new(1.0, 0.5));
    pub(super) const BOTTOM: Self = Self(DVec2::new(0.5, 1.0));
}

fn font() -> Option<&'static FontRef<'static>> {
    static FONT: OnceLock<Option<FontRef<'static>>> = OnceLock::new();
    FONT.get_or_init(|| FontRef::try_from_slice(dejavu::sans::regular()).ok())
        .as_ref()
}

/// The size of a line of text, px.
pub(super) fn size(text: &str, em_px: f64) -> DVec2 {
    line(text, em_px).map_or(DVec2::ZERO, |(_, size)| size)
}

/// The pixels that a line of text covers.
pub(super) fn mask(text: &str, em_px: f64, at: DVec2, Anchor(anchor): Anchor) -> Option<Mask> {
    let (glyphs, size) = line(text, em_px)?;
    let corner = at - anchor * size;
    let font = font()?;
    let mut outlines = Vec::new();
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for mut glyph in glyphs {
        glyph.position.x += single(corner.x);
        glyph.position.y += single(corner.y);
        let Some(outline) = font.outline_glyph(glyph) else {
            continue;
        };
        let bounds = outline.px_bounds();
        low = low.min(DVec2::new(bounds.min.x.into(), bounds.min.y.into()));
        high = high.max(DVec2::new(bounds.max.x.into(), bounds.max.y.into()));
        outlines.push(outline);
    }
    let mut mask = Mask::around(low, high)?;
    for outline in outlines {
        let bounds = outline.px_bounds();
        let (left, top) = (floor(bounds.min.x.into()), floor(bounds.min.y.into()));
        outline.draw(|x, y, cover| mask.add([left + i64::from(x), top + i64::from(y)], cover));
    }
    Some(mask)
}

/// The letters of a line from (0, 0) on, and its size, px.
fn line(text: &str, em_px: f64) -> Option<(Vec<Glyph>, DVec2)> {
    let font = font()?;
    // The scale of this crate is the height from the lowest to the highest letter.
    let per_em = font.height_unscaled() / font.units_per_em()?;
    let scaled = font.as_scaled(PxScale::from(single(em_px) * per_em));
    let mut glyphs: Vec<Glyph> = Vec::new();
    let mut right = 0.0;
    for letter in text.chars().filter(|letter| !letter.is_control()) {
        let mut glyph = scaled.scaled_glyph(letter);
        if let Some(before) = glyphs.last() {
            right += scaled.kern(before.id, glyph.id);
        }
        glyph.position = point(right, scaled.ascent());
        right += scaled.h_advance(glyph.id);
        glyphs.push(glyph);
    }
    Some((glyphs, DVec2::new(right.into(), scaled.height().into())))
}
