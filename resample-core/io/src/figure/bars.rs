//! The scale bar at the lower left, and the colour bar at the right.

use glam::DVec2;
use resample_core::Camera;
use resample_core::narrow::{cell, single};

use crate::figure::canvas::Canvas;
use crate::figure::parts::{ColourBar, ScaleBar};
use crate::figure::place::px_per_unit;
use crate::figure::text;
use crate::figure::text::Anchor;
use crate::figure::ticks::{number, round_length, ticks};

/// Share of the picture's width that a bar of no given length may have.
const MOST_SHARE: f64 = 0.22;

/// Height of the colour bar, as a share of the picture's, and its width and the length of a tick, ems.
const HEIGHT_SHARE: f64 = 0.45;
const WIDTH_EMS: f64 = 0.9;
const TICK_EMS: f64 = 0.3;

/// Draws a bar with its length above.
pub(super) fn scale(canvas: &mut Canvas, camera: &Camera, bar: &ScaleBar) {
    let Some(px) = px_per_unit(camera, bar.at) else {
        return;
    };
    let [width, height] = canvas.size;
    let length = bar
        .length
        .unwrap_or_else(|| round_length(MOST_SHARE * width / px));
    let em = canvas.em;
    let y = height - 1.5 * em;
    let from = DVec2::new(1.5 * em, y);
    let to = from + DVec2::new(px * length, 0.0);
    canvas.line(from, to);
    for end in [from, to] {
        let half = DVec2::new(0.0, TICK_EMS * em);
        canvas.line(end - half, end + half);
    }
    let unit = bar.unit.as_deref().map(|unit| format!(" {unit}"));
    let words = number(length) + &unit.unwrap_or_default();
    let middle = DVec2::new(0.5 * (from.x + to.x).max(0.0), y - 0.45 * em);
    // Long words over a short bar stay inside the picture.
    let least = 0.5 * text::size(&words, em).x + 0.5 * em;
    canvas.text(
        &words,
        em,
        DVec2::new(middle.x.max(least), middle.y),
        Anchor::BOTTOM,
    );
}

/// Draws the colours from the bottom up, with values on the left, and a title above.
pub(super) fn colours(canvas: &mut Canvas, bar: &ColourBar) {
    let [width, height] = canvas.size;
    let em = canvas.em;
    let high = DVec2::new(width - 1.5 * em, 0.5 * height * (1.0 + HEIGHT_SHARE));
    let low = DVec2::new(high.x - WIDTH_EMS * em, 0.5 * height * (1.0 - HEIGHT_SHARE));
    canvas.ramp(low, high, &bar.colours);
    let corners = [
        low,
        DVec2::new(high.x, low.y),
        high,
        DVec2::new(low.x, high.y),
    ];
    for (corner, next) in corners.into_iter().zip(corners.into_iter().cycle().skip(1)) {
        canvas.line(corner, next);
    }
    let [least, most] = bar.range;
    let lines = cell(single((HEIGHT_SHARE * height / (2.0 * em)).clamp(2.0, 7.0)));
    for value in ticks(least, most, lines) {
        let share = if most > least {
            (value - least) / (most - least)
        } else {
            0.5
        };
        let at = DVec2::new(low.x, high.y + share * (low.y - high.y));
        canvas.line(at - DVec2::new(TICK_EMS * em, 0.0), at);
        canvas.text(
            &number(value),
            em,
            at - DVec2::new(1.6 * TICK_EMS * em, 0.0),
            Anchor::RIGHT,
        );
    }
    if let Some(title) = &bar.title {
        let half = 0.5 * text::size(title, em).x;
        let x = (0.5 * (low.x + high.x)).min(width - half - 0.5 * em);
        canvas.text(title, em, DVec2::new(x, low.y - 0.6 * em), Anchor::BOTTOM);
    }
}
