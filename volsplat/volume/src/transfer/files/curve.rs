//! The content of a transfer function's file, whichever program wrote it, and the curves of VTK as plain knots.
//!
//! Takes nodes with a midpoint and a sharpness, returns opacity knots. A node shapes the segment behind it: the midpoint is
//! where the curve is half way, the sharpness bends it from a straight line (below 0.01) over a Hermite curve to a step
//! (above 0.99). Straight lines and steps come out exactly, the bent ones are sampled.
//! Source: the documentation and behaviour of vtkPiecewiseFunction (VTK 9).

use resample_core::image::linear_from_srgb;

use crate::transfer::{ColourEncoding, ColourKnot, GradientOpacity, OpacityKnot, Shading};

/// The content of a file.
#[derive(Debug, Default)]
pub(crate) struct Knots {
    /// Absent where the file has opacity alone.
    pub(crate) colours: Option<Vec<ColourKnot>>,
    /// Absent where the file has colours alone.
    pub(crate) opacities: Option<Vec<OpacityKnot>>,
    /// The light, where the file says.
    pub(crate) shading: Option<Shading>,
    /// Length over which its opacities are meant, world units, where the file says.
    pub(crate) opacity_unit: Option<f64>,
    /// Opacity by the gradient, where the file changes it: lengths are value per mean spacing of voxels.
    pub(crate) gradient: Option<GradientOpacity>,
    /// Ignored parts of the file, one sentence each.
    pub(crate) notes: Vec<String>,
}

impl Knots {
    /// From the least to the greatest value of the file's knots.
    pub(crate) fn span(&self) -> f64 {
        let colours = self.colours.iter().flatten().map(|knot| knot.value);
        let opacities = self.opacities.iter().flatten().map(|knot| knot.value);
        let values: Vec<f64> = colours.chain(opacities).collect();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        values.into_iter().fold(f64::NEG_INFINITY, f64::max) - least
    }
}

/// A colour in linear light.
pub(crate) fn decoded(rgb: [f64; 3], encoding: ColourEncoding) -> [f32; 3] {
    match encoding {
        ColourEncoding::Linear => rgb.map(|channel| channel as f32),
        ColourEncoding::Srgb => rgb.map(|channel| linear_from_srgb(channel as f32)),
    }
}

/// One node as ParaView writes it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) value: f64,
    pub(crate) opacity: f64,
    /// 0..=1 of the segment behind the node.
    pub(crate) midpoint: f64,
    /// 0..=1.
    pub(crate) sharpness: f64,
}

/// VTK keeps the midpoint this far from the ends of the segment.
const MIDPOINT_MARGIN: f64 = 1e-5;

/// Straight pieces per bent segment. At the greatest bend the curve rises as 0.5 (2s)^10.9: the pieces then miss it by
/// at most 10.9 * 9.9 / 2 / 4 / 64^2 = 0.4 % of the step, less than one of 256 levels.
const PIECES: usize = 128;

/// Knots of the curve through the nodes, which are in ascending order.
pub(crate) fn knots(nodes: &[Node]) -> Vec<OpacityKnot> {
    let mut knots = Vec::new();
    for pair in nodes.windows(2) {
        knots.push(OpacityKnot {
            value: pair[0].value,
            opacity: pair[0].opacity,
        });
        if pair[0].value < pair[1].value && pair[0].opacity != pair[1].opacity {
            inner_knots(pair[0], pair[1], &mut knots);
        }
    }
    knots.extend(nodes.last().map(|node| OpacityKnot {
        value: node.value,
        opacity: node.opacity,
    }));
    knots
}

/// The knots between two nodes.
fn inner_knots(from: Node, to: Node, knots: &mut Vec<OpacityKnot>) {
    let midpoint = from.midpoint.clamp(MIDPOINT_MARGIN, 1.0 - MIDPOINT_MARGIN);
    // `place` is 0..=1 with the midpoint at 0.5, as VTK stretches it.
    let mut push = |place: f64, rise: f64| {
        let share = if place < 0.5 {
            2.0 * place * midpoint
        } else {
            midpoint + (2.0 * place - 1.0) * (1.0 - midpoint)
        };
        let value = from.value * (1.0 - share) + to.value * share;
        let opacity = from.opacity * (1.0 - rise) + to.opacity * rise;
        knots.push(OpacityKnot { value, opacity });
    };
    if from.sharpness > 0.99 {
        push(0.5, 0.0);
        push(0.5, 1.0);
    } else if from.sharpness >= 0.01 {
        let places = (1..PIECES).map(|piece| piece as f64 / PIECES as f64);
        places.for_each(|place| push(place, rise(place, from.sharpness)));
    } else if from.midpoint != 0.5 {
        push(0.5, 0.5);
    }
}

/// How far the bent curve has risen, 0..=1, at a place that is 0.5 at the midpoint.
fn rise(place: f64, sharpness: f64) -> f64 {
    let power = 1.0 + 10.0 * sharpness;
    let bent = if place < 0.5 {
        0.5 * (2.0 * place).powf(power)
    } else {
        1.0 - 0.5 * (2.0 - 2.0 * place).powf(power)
    };
    // Hermite between 0 and 1 with the slope 1 - sharpness at both ends.
    let (square, cube) = (bent * bent, bent * bent * bent);
    let slopes = (2.0 * cube - 3.0 * square + bent) * (1.0 - sharpness);
    (3.0 * square - 2.0 * cube + slopes).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(midpoint: f64, sharpness: f64) -> Vec<OpacityKnot> {
        let from = Node {
            value: 10.0,
            opacity: 0.2,
            midpoint,
            sharpness,
        };
        let to = Node {
            value: 20.0,
            opacity: 1.0,
            midpoint: 0.5,
            sharpness: 0.0,
        };
        knots(&[from, to])
    }

    fn knot(value: f64, opacity: f64) -> OpacityKnot {
        OpacityKnot { value, opacity }
    }

    #[test]
    fn straight_segments_and_steps_are_exact() {
        assert_eq!(pair(0.5, 0.0), vec![knot(10.0, 0.2), knot(20.0, 1.0)]);
        assert_eq!(
            pair(0.25, 0.0),
            vec![knot(10.0, 0.2), knot(12.5, 0.6), knot(20.0, 1.0)]
        );
        assert_eq!(
            pair(0.75, 1.0),
            vec![
                knot(10.0, 0.2),
                knot(17.5, 0.2),
                knot(17.5, 1.0),
                knot(20.0, 1.0)
            ]
        );
    }

    #[test]
    fn bent_segments_rise_through_the_midpoint() {
        for sharpness in [0.01, 0.3, 0.98] {
            let knots = pair(0.3, sharpness);
            assert!(
                knots
                    .windows(2)
                    .all(|p| p[0].value < p[1].value && p[0].opacity <= p[1].opacity),
                "{sharpness}"
            );
            let middle = knots
                .iter()
                .find(|knot| (knot.value - 13.0).abs() < 1e-9)
                .expect("a knot at the midpoint");
            assert!(
                (middle.opacity - 0.6).abs() < 1e-12,
                "half way at the midpoint, not {}",
                middle.opacity
            );
        }
        // By hand for sharpness 0.5 at place 0.25: bent = 0.5 * 0.5^6 = 1/128.
        let bent = 1.0 / 128.0f64;
        let expected = 3.0 * bent.powi(2) - 2.0 * bent.powi(3)
            + 0.5 * (2.0 * bent.powi(3) - 3.0 * bent.powi(2) + bent);
        assert!((rise(0.25, 0.5) - expected).abs() < 1e-15);
    }

    #[test]
    fn pieces_follow_the_most_bent_curve_within_a_level() {
        for piece in 0..PIECES {
            let ends = [piece, piece + 1].map(|end| rise(end as f64 / PIECES as f64, 0.98));
            let middle = rise((piece as f64 + 0.5) / PIECES as f64, 0.98);
            assert!(
                (0.5 * (ends[0] + ends[1]) - middle).abs() < 1.0 / 256.0,
                "piece {piece}"
            );
        }
    }

    #[test]
    fn midpoints_at_the_ends_stay_inside() {
        for midpoint in [0.0, 1.0] {
            let knots = pair(midpoint, 0.5);
            assert!(
                knots
                    .iter()
                    .all(|knot| knot.value.is_finite() && (10.0..=20.0).contains(&knot.value))
            );
            assert!(
                knots.windows(2).all(|p| p[0].value <= p[1].value),
                "midpoint {midpoint}"
            );
        }
    }
}
