//! Two views in one red-cyan picture.
//!
//! Source: E. Dubois, "A projection method to generate anaglyph stereo images" (ICASSP 2001), for the matrix.

use clap::ValueEnum;
use resample_core::Image;

/// How two views become one red-cyan picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Anaglyph {
    /// Least-squares colours for red-cyan glasses, little ghosting
    Dubois,
    /// Red of the left view, green and blue of the right
    Colour,
    /// Luminance alone
    Grey,
}

/// Dubois' least-squares matrix for red-cyan glasses, linear light: rows are red, green and blue of the anaglyph,
/// columns red, green and blue of the left and then of the right view.
const DUBOIS: [[f32; 6]; 3] = [
    [
        0.456_1,
        0.500_484,
        0.176_381,
        -0.043_470_6,
        -0.087_938_8,
        -0.001_555_29,
    ],
    [
        -0.040_082_2,
        -0.037_824_6,
        -0.015_758_9,
        0.378_476,
        0.733_64,
        -0.018_450_3,
    ],
    [
        -0.015_216_1,
        -0.020_597_1,
        -0.005_468_56,
        -0.072_152_7,
        -0.112_961,
        1.226_4,
    ],
];

/// Luminance of linear Rec. 709 red, green and blue.
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Left and right view in one picture. It has no depth: there are two.
pub(crate) fn anaglyph(views: &[Image], kind: Anaglyph) -> Image {
    let [left, right] = views else {
        return Image::transparent(1, 1);
    };
    let grey = |[r, g, b, _]: [f32; 4]| LUMINANCE[0] * r + LUMINANCE[1] * g + LUMINANCE[2] * b;
    let mut both = Image::transparent(left.width, left.height);
    for ((pixel, &l), &r) in both.rgba.iter_mut().zip(&left.rgba).zip(&right.rgba) {
        let [red, green, blue] = match kind {
            Anaglyph::Colour => [l[0], r[1], r[2]],
            Anaglyph::Grey => [grey(l), grey(r), grey(r)],
            Anaglyph::Dubois => DUBOIS.map(|row| {
                let parts = row[..3].iter().zip(l).chain(row[3..].iter().zip(r));
                parts
                    .map(|(weight, channel)| weight * channel)
                    .sum::<f32>()
                    .max(0.0)
            }),
        };
        *pixel = [red, green, blue, l[3].max(r[3])];
    }
    both
}
