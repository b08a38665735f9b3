//! Interpolation between two colours in the colour spaces of VTK.
//!
//! Takes two colours as VTK holds them (red, green, blue, 0..1) and a share, gives the colour between. Lab and the
//! diverging scheme go over CIE Lab with D65 white and take the numbers as sRGB, as VTK does, so that the result has
//! the numbers that ParaView shows. What those numbers mean (linear or sRGB) is decided by the caller afterwards.
//! Sources: IEC 61966-2-1 and CIE 15 for Lab; Kenneth Moreland, "Diverging Color Maps for Scientific Visualization",
//! 2009, for the polar form Msh and its rules.

use std::f64::consts::PI;

/// How colours are interpolated between two knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ColourSpace {
    /// Straight in red, green, blue.
    Rgb,
    /// Hue, saturation, value; hue never crosses red.
    Hsv,
    /// Hue, saturation, value; hue takes the shorter way round.
    HsvWrapped,
    /// CIE Lab.
    Lab,
    /// Moreland's: through white between two saturated colours.
    Diverging,
    /// Constant: the colour of the upper knot.
    Step,
}

/// Three numbers in some colour space.
type Colour = [f64; 3];

/// D65 white, 2 degrees, as the sRGB primaries add up to it.
const WHITE_XYZ: Colour = [0.9505, 1.0, 1.089];

/// Msh saturation below which a colour counts as grey, in radians (Moreland's constant).
const GREY_SATURATION: f64 = 0.05;

impl ColourSpace {
    /// The colour between two at a share 0..=1; channels are clamped to 0..=1.
    pub(crate) fn between(self, from: Colour, to: Colour, share: f64) -> Colour {
        let mixed = match self {
            Self::Rgb => lerp(from, to, share),
            Self::Step => to,
            Self::Hsv => rgb_from_hsv(lerp(hsv_from_rgb(from), hsv_from_rgb(to), share)),
            Self::HsvWrapped => {
                rgb_from_hsv(lerp_wrapped(hsv_from_rgb(from), hsv_from_rgb(to), share))
            }
            Self::Lab => rgb_from_lab(lerp(lab_from_rgb(from), lab_from_rgb(to), share)),
            Self::Diverging => rgb_from_lab(lab_from_msh(diverging(from, to, share))),
        };
        mixed.map(|channel| channel.clamp(0.0, 1.0))
    }
}

fn lerp(from: Colour, to: Colour, share: f64) -> Colour {
    [0, 1, 2].map(|k| from[k] * (1.0 - share) + to[k] * share)
}

/// Hue in 0..1.
fn hsv_from_rgb([red, green, blue]: Colour) -> Colour {
    let value = red.max(green).max(blue);
    let chroma = value - red.min(green).min(blue);
    if chroma <= 0.0 {
        return [0.0, 0.0, value];
    }
    let sixths = if value == red {
        ((green - blue) / chroma).rem_euclid(6.0)
    } else if value == green {
        (blue - red) / chroma + 2.0
    } else {
        (red - green) / chroma + 4.0
    };
    [sixths / 6.0, chroma / value, value]
}

fn rgb_from_hsv([hue, saturation, value]: Colour) -> Colour {
    [5.0, 3.0, 1.0].map(|offset| {
        let place = (offset + 6.0 * hue).rem_euclid(6.0);
        value - value * saturation * place.min(4.0 - place).clamp(0.0, 1.0)
    })
}

fn lerp_wrapped(mut from: Colour, mut to: Colour, share: f64) -> Colour {
    if from[0] - to[0] > 0.5 {
        from[0] -= 1.0;
    } else if to[0] - from[0] > 0.5 {
        to[0] -= 1.0;
    }
    lerp(from, to, share)
}

fn lab_from_rgb(rgb: Colour) -> Colour {
    let linear = rgb.map(|c| {
        if c > 0.04045 {
            ((c + 0.055) / 1.055).powf(2.4)
        } else {
            c / 12.92
        }
    });
    let rows = [
        [0.4124, 0.3576, 0.1805],
        [0.2126, 0.7152, 0.0722],
        [0.0193, 0.1192, 0.9505],
    ];
    let xyz = rows.map(|row| dot(row, linear));
    let [x, y, z] = [0, 1, 2].map(|k| lab_curve(xyz[k] / WHITE_XYZ[k]));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn rgb_from_lab([lightness, a, b]: Colour) -> Colour {
    let y = (lightness + 16.0) / 116.0;
    let curved = [y + a / 500.0, y, y - b / 200.0];
    let xyz = [0, 1, 2].map(|k| WHITE_XYZ[k] * lab_curve_inverse(curved[k]));
    let rows = [
        [3.2406, -1.5372, -0.4986],
        [-0.9689, 1.8758, 0.0415],
        [0.0557, -0.2040, 1.0570],
    ];
    let linear = rows.map(|row| dot(row, xyz));
    linear.map(|c| {
        if c > 0.0031308 {
            1.055 * c.powf(1.0 / 2.4) - 0.055
        } else {
            12.92 * c
        }
    })
}

/// CIE 15: a cube root with a straight foot below (6/29)^3.
fn lab_curve(t: f64) -> f64 {
    let foot = 6.0 / 29.0f64;
    if t > foot.powi(3) {
        t.cbrt()
    } else {
        t / (3.0 * foot * foot) + 4.0 / 29.0
    }
}

fn lab_curve_inverse(t: f64) -> f64 {
    let foot = 6.0 / 29.0f64;
    if t > foot {
        t.powi(3)
    } else {
        3.0 * foot * foot * (t - 4.0 / 29.0)
    }
}

fn dot(row: [f64; 3], colour: Colour) -> f64 {
    row[0] * colour[0] + row[1] * colour[1] + row[2] * colour[2]
}

/// Polar form of Lab: distance from black, angle off the grey axis, hue; angles in radians.
fn msh_from_lab([lightness, a, b]: Colour) -> Colour {
    let m = (lightness * lightness + a * a + b * b).sqrt();
    let s = if m > 0.001 {
        (lightness / m).acos()
    } else {
        0.0
    };
    let h = if s > 0.001 { b.atan2(a) } else { 0.0 };
    [m, s, h]
}

fn lab_from_msh([m, s, h]: Colour) -> Colour {
    [m * s.cos(), m * s.sin() * h.cos(), m * s.sin() * h.sin()]
}

/// Moreland's interpolation; the result is in Msh.
fn diverging(from: Colour, to: Colour, mut share: f64) -> Colour {
    let [mut from, mut to] = [from, to].map(|rgb| msh_from_lab(lab_from_rgb(rgb)));
    let both_saturated = from[1] > GREY_SATURATION && to[1] > GREY_SATURATION;
    // Two saturated hues more than 60 degrees apart meet in white, or in a grey as bright as the brighter one.
    if both_saturated && hue_distance(from[2], to[2]) > PI / 3.0 {
        let middle = from[0].max(to[0]).max(88.0);
        if share < 0.5 {
            to = [middle, 0.0, 0.0];
            share *= 2.0;
        } else {
            from = [middle, 0.0, 0.0];
            share = 2.0 * share - 1.0;
        }
    }
    if from[1] < GREY_SATURATION && to[1] > GREY_SATURATION {
        from[2] = adjusted_hue(to, from[0]);
    } else if to[1] < GREY_SATURATION && from[1] > GREY_SATURATION {
        to[2] = adjusted_hue(from, to[0]);
    }
    lerp(from, to, share)
}

fn hue_distance(one: f64, other: f64) -> f64 {
    let around = (one - other).rem_euclid(2.0 * PI);
    around.min(2.0 * PI - around)
}

/// The hue to give a grey of this magnitude, so that the way to the saturated colour looks straight.
fn adjusted_hue([m, s, h]: Colour, grey_m: f64) -> f64 {
    if m >= grey_m - 0.1 {
        return h;
    }
    let spin = s * (grey_m * grey_m - m * m).sqrt() / (m * s.sin());
    // Moreland turns away from purple.
    if h > -0.3 * PI { h + spin } else { h - spin }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(got: Colour, expected: Colour, tolerance: f64, what: &str) {
        for k in 0..3 {
            assert!(
                (got[k] - expected[k]).abs() < tolerance,
                "{what}: {got:?} against {expected:?}"
            );
        }
    }

    #[test]
    fn ends_are_kept_in_every_space() {
        let pairs = [
            ([0.2, 0.3, 0.8], [0.7, 0.1, 0.15]),
            ([0.0, 0.0, 0.0], [1.0, 1.0, 1.0]),
            ([1.0, 0.0, 0.0], [0.5; 3]),
        ];
        for space in [
            ColourSpace::Rgb,
            ColourSpace::Hsv,
            ColourSpace::HsvWrapped,
            ColourSpace::Lab,
            ColourSpace::Diverging,
        ] {
            for (from, to) in pairs {
                // The sRGB matrices are rounded to four digits, so they invert each other to three.
                assert_near(
                    space.between(from, to, 0.0),
                    from,
                    2e-3,
                    &format!("{space:?} at 0"),
                );
                assert_near(
                    space.between(from, to, 1.0),
                    to,
                    2e-3,
                    &format!("{space:?} at 1"),
                );
            }
        }
        assert_eq!(ColourSpace::Step.between([0.1; 3], [0.9; 3], 0.5), [0.9; 3]);
    }

    #[test]
    fn hue_goes_through_green_or_the_shorter_way() {
        let (red, blue) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        assert_near(
            ColourSpace::Hsv.between(red, blue, 0.5),
            [0.0, 1.0, 0.0],
            1e-12,
            "plain hue",
        );
        assert_near(
            ColourSpace::HsvWrapped.between(red, blue, 0.5),
            [1.0, 0.0, 1.0],
            1e-12,
            "wrapped hue",
        );
    }

    #[test]
    fn lab_agrees_with_published_values() {
        // sRGB red is Lab (53.24, 80.09, 67.20), mid grey 0.5 has L = 53.39.
        assert_near(
            lab_from_rgb([1.0, 0.0, 0.0]),
            [53.24, 80.09, 67.20],
            0.05,
            "red",
        );
        assert_near(lab_from_rgb([0.5; 3]), [53.39, 0.0, 0.0], 0.05, "grey");
    }

    #[test]
    fn the_cool_to_warm_map_has_its_published_middle() {
        // Moreland's table: (59, 76, 192) to (180, 4, 38) passes through (221, 221, 221).
        let from = [59.0, 76.0, 192.0].map(|code| code / 255.0);
        let to = [180.0, 4.0, 38.0].map(|code| code / 255.0);
        let middle = ColourSpace::Diverging.between(from, to, 0.5);
        assert_near(middle, [221.0 / 255.0; 3], 1.5 / 255.0, "middle");
    }
}
