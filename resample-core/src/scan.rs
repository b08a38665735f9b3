//! Conic scan conversion: the pixels whose centres lie inside a conic, row by row.
//!
//! Each row gives a quadratic in x, solved once; the ends are then settled against the conic's own sign at the pixel
//! centres, so that no pixel is missed or added, whatever the rounding of the root. An ellipse gives one
//! span a row; an open conic may give two.

use std::ops::Range;

use glam::DVec2;

use crate::conic::Conic;

/// Columns first..end of one row.
pub type Span = Range<u32>;

/// The spans of pixel row `row` inside `conic`, clipped to columns 0..`width`; at most two, left to right.
pub fn row_spans(conic: &Conic, row: u32, width: u32) -> [Span; 2] {
    let y = f64::from(row) + 0.5;
    // Along the row: a x^2 + 2 b x + c.
    let (a, b, c) = (
        conic.xx,
        conic.xy * y + conic.x,
        (conic.yy * y + 2.0 * conic.y) * y + conic.one,
    );
    let inside = |x: u32| conic.value(DVec2::new(f64::from(x) + 0.5, y)) < 0.0;
    let [first, last] = roots(a, b, c);
    let cut = |x: f64| column(x, width);
    // The line between the roots, and what is left and right of them: which of the three is inside follows from the
    // sign at one pixel of each, after the ends have been settled.
    let bounds = [0, cut(first), cut(last), width];
    let mut spans = [0..0, 0..0];
    let mut used = 0;
    for piece in bounds.windows(2) {
        let settled = settle(piece[0]..piece[1], width, &inside);
        if settled.is_empty() {
            continue;
        }
        if used > 0 && spans[used - 1].end >= settled.start {
            spans[used - 1].end = settled.end.max(spans[used - 1].end);
        } else if used < spans.len() {
            spans[used] = settled;
            used += 1;
        }
    }
    spans
}

/// The rows that an ellipse's bounding box touches, clipped to 0..`height`.
pub fn ellipse_rows(centre_y_px: f64, half_height_px: f64, height: u32) -> Range<u32> {
    column(centre_y_px - half_height_px, height)..column(centre_y_px + half_height_px, height)
}

/// First pixel whose centre is not left of x, clipped to 0..=count. NaN counts as 0.
fn column(x: f64, count: u32) -> u32 {
    (x - 0.5).ceil().clamp(0.0, f64::from(count)) as u32
}

/// The roots of a x^2 + 2 b x + c in rising order, without cancellation; both +infinity without real roots.
fn roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let discriminant = b * b - a * c;
    if !(discriminant >= 0.0) {
        return [f64::INFINITY; 2];
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    let (one, two) = (q / a, c / q);
    match (one.is_nan(), two.is_nan()) {
        (true, true) => [f64::INFINITY; 2],
        (true, false) => [two; 2],
        (false, true) => [one; 2],
        (false, false) => [one.min(two), one.max(two)],
    }
}

/// Moves the ends of a candidate span to where the conic's sign changes: outwards over inside pixels, inwards over
/// outside ones. Rounding moves a root by far less than a pixel, so this is a step or two; a span whose middle is
/// outside is the outside of the conic and becomes empty.
fn settle(span: Span, width: u32, inside: &impl Fn(u32) -> bool) -> Span {
    let (mut start, mut end) = (span.start, span.end);
    if end - start > 8 && !inside(start + (end - start) / 2) {
        return start..start;
    }
    while start < end && !inside(start) {
        start += 1;
    }
    while end > start && !inside(end - 1) {
        end -= 1;
    }
    if start < end {
        while start > 0 && inside(start - 1) {
            start -= 1;
        }
        while end < width && inside(end) {
            end += 1;
        }
    }
    start..end
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::conic::Ellipse;

    fn check(conic: &Conic, width: u32, height: u32) {
        for row in 0..height {
            let spans = row_spans(conic, row, width);
            for x in 0..width {
                let centre = DVec2::new(f64::from(x) + 0.5, f64::from(row) + 0.5);
                let expected = conic.value(centre) < 0.0;
                let covered = spans.iter().any(|span| span.contains(&x));
                assert_eq!(
                    covered, expected,
                    "pixel ({x}, {row}) of {conic:?}: {spans:?}"
                );
            }
            assert!(
                spans[1].is_empty() || spans[0].end < spans[1].start,
                "spans overlap: {spans:?}"
            );
        }
    }

    proptest! {
        #[test]
        fn ellipses_hit_exactly_their_pixels(
            x in -10.0..50.0f64, y in -10.0..50.0f64, a in 0.01..300.0f64, b in 0.01..300.0f64, angle in 0.0..3.2f64,
        ) {
            let (u, v) = (DVec2::from_angle(angle) / a, DVec2::from_angle(angle).perp() / b);
            let form = [u.x * u.x + v.x * v.x, u.x * u.y + v.x * v.y, u.y * u.y + v.y * v.y];
            let ellipse = Ellipse { centre_px: DVec2::new(x, y), form };
            check(&ellipse.conic(), 40, 36);
            let rows = ellipse_rows(y, ellipse.half_extent_px().y, 36);
            for row in (0..36).filter(|row| !rows.contains(row)) {
                let spans = row_spans(&ellipse.conic(), row, 40);
                prop_assert!(spans.iter().all(|s| s.is_empty()), "row {row} lies outside the box");
            }
        }

        #[test]
        fn any_conic_hits_exactly_its_pixels(c in prop::array::uniform6(-1.0..1.0f64)) {
            // Centred in the picture, so that both branches of a hyperbola pass through it.
            let (u, v) = (-20.0, -18.0);
            let (x, y) = (c[0] * u + c[1] * v + 10.0 * c[3], c[1] * u + c[2] * v + 10.0 * c[4]);
            let one = c[0] * u * u + 2.0 * c[1] * u * v + c[2] * v * v
                + 20.0 * (c[3] * u + c[4] * v) + 100.0 * c[5];
            check(&Conic { xx: c[0], xy: c[1], yy: c[2], x, y, one }, 40, 36);
        }
    }

    #[test]
    fn degenerate_conics_are_taken_as_they_are() {
        let zero = Conic {
            xx: 0.0,
            xy: 0.0,
            yy: 0.0,
            x: 0.0,
            y: 0.0,
            one: 1.0,
        };
        check(&zero, 9, 9);
        check(&Conic { one: -1.0, ..zero }, 9, 9);
        check(
            &Conic {
                x: 0.5,
                one: -4.2,
                ..zero
            },
            9,
            9,
        );
        check(
            &Conic {
                xx: f64::NAN,
                ..zero
            },
            9,
            9,
        );
        check(
            &Conic {
                xx: 1e-300,
                x: -1e-200,
                one: 1e-300,
                ..zero
            },
            9,
            9,
        );
    }
}
