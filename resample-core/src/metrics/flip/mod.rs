//! FLIP, the difference that a viewer sees when flipping between two pictures (the variant for low dynamic range).
//!
//! Takes two images and the number of pixels per degree of the visual field, gives an error in 0..=1 per pixel. Both
//! pictures are blurred in an opponent colour space as the eye would blur them at that distance, and compared by colour.
//! A second comparison of edges and points amplifies the colour error where the pictures differ in structure.
//!
//! Source: P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, "FLIP: A Difference
//! Evaluator for Alternating Images", Proceedings of the ACM on Computer Graphics and Interactive Techniques 3(2)
//! (High Performance Graphics), 2020. The
//! authors' own program, which computes in f32 and with a rounded white point, differs by up to 2e-5 in the mean.
//!
//! Limits: linear input is clamped to 0..=1 (no HDR-FLIP). Weighted percentiles are exact, not read off a histogram.

#[cfg(test)]
mod tests;

use std::f64::consts::PI;

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use crate::Image;
use crate::metrics::convolve::{
    Border, along_both, along_columns, along_rows, normalised, sampled_taps,
};
use crate::metrics::inputs::{MetricsError, ScalarMap, check_pair};

pub use crate::metrics::inputs::MAX_PIXELS_PER_DEGREE;

/// The paper's viewing condition: a screen 0.7 m wide with 3840 pixels across, seen from 0.7 m, hence
/// `0.7 * 3840 / 0.7 * pi / 180` pixels in the central degree.
pub const DEFAULT_PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Amplitude and squared width (in square degrees) of one Gaussian of a contrast sensitivity filter.
type CsfTerm = (f64, f64);

/// Contrast sensitivity of luminance, the achromatic row of the paper's table 1.
const CSF_LUMINANCE: &[CsfTerm] = &[(1.0, 0.0047)];
/// Contrast sensitivity of red against green.
const CSF_RED_GREEN: &[CsfTerm] = &[(1.0, 0.0053)];
/// Contrast sensitivity of blue against yellow.
const CSF_BLUE_YELLOW: &[CsfTerm] = &[(34.1, 0.04), (13.5, 0.025)];
/// The widest term above: it sets the filter radius for all three channels.
const CSF_WIDEST: f64 = 0.04;

/// Exponent that compresses large colour differences.
const COLOUR_EXPONENT: f64 = 0.7;
/// Colour differences up to this fraction of the largest are spread over ...
const KNEE_INPUT: f64 = 0.4;
/// ... this fraction of the output range.
const KNEE_OUTPUT: f64 = 0.95;

/// A FLIP error map pooled to a few numbers.
///
/// The weighted percentiles weigh each pixel by its own error: a fraction of 0.25, 0.5 or 0.75 of the total error lies
/// in pixels with at most this error. They tell a few large errors from many small ones where the mean cannot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlipSummary {
    /// Mean error, in 0..=1.
    pub mean: f64,
    /// Weighted first quartile.
    pub weighted_quartile_1: f64,
    /// Weighted median.
    pub weighted_median: f64,
    /// Weighted third quartile.
    pub weighted_quartile_3: f64,
    /// Largest error.
    pub max: f64,
}

impl FlipSummary {
    /// Pools the errors of the selected pixels; all zero for none.
    pub fn new(mut errors: Vec<f64>) -> Self {
        errors.sort_unstable_by(f64::total_cmp);
        let total: f64 = errors.iter().sum();
        Self {
            mean: total / errors.len().max(1) as f64,
            weighted_quartile_1: weighted_quantile(&errors, 0.25 * total),
            weighted_median: weighted_quantile(&errors, 0.5 * total),
            weighted_quartile_3: weighted_quantile(&errors, 0.75 * total),
            max: errors.last().copied().unwrap_or(0.0),
        }
    }
}

/// Pixels in the central degree of the visual field, for a screen of this width seen from this distance.
///
/// ```
/// use resample_core::metrics::flip::pixels_per_degree;
///
/// // A screen 0.7 m wide of 3840 pixels, seen from 0.7 m.
/// assert!((pixels_per_degree(0.7, 0.7, 3840.0) - 67.0).abs() < 0.1);
/// ```
pub fn pixels_per_degree(distance_m: f64, screen_width_m: f64, screen_width_px: f64) -> f64 {
    distance_m * screen_width_px / screen_width_m * PI / 180.0
}

/// The FLIP error of every pixel, in 0..=1.
///
/// # Errors
/// As [`super::compare`], for sizes, lengths and values that are not finite; and for `pixels_per_degree` outside
/// `0 < p <= MAX_PIXELS_PER_DEGREE`.
pub fn map(
    image: &Image,
    reference: &Image,
    pixels_per_degree: f64,
) -> Result<ScalarMap, MetricsError> {
    check_pair(image, reference)?;
    if !(pixels_per_degree > 0.0 && pixels_per_degree <= MAX_PIXELS_PER_DEGREE) {
        return Err(MetricsError::BadPixelsPerDegree(pixels_per_degree));
    }
    let space = ColourSpace::srgb();
    let image = Opponent::new(image, &space);
    let reference = Opponent::new(reference, &space);
    let feature_error = difference(&image.luminance, &reference.luminance, pixels_per_degree);
    let image = image.seen_lab(&space, pixels_per_degree);
    let reference = reference.seen_lab(&space, pixels_per_degree);
    let largest = largest_distance(&space);
    let values = (image.par_iter().zip(&reference).zip(&feature_error.values))
        .map(|((a, b), feature)| colour_error(*a, *b, largest).powf(1.0 - feature))
        .collect();
    Ok(ScalarMap {
        values,
        ..feature_error
    })
}

/// A picture in the opponent space YCxCz: luminance, red against green, blue against yellow.
struct Opponent {
    luminance: ScalarMap,
    red_green: ScalarMap,
    blue_yellow: ScalarMap,
}

impl Opponent {
    fn new(image: &Image, space: &ColourSpace) -> Self {
        let colours: Vec<DVec3> = image
            .rgba
            .par_iter()
            .map(|pixel| opponent_of(pixel, space))
            .collect();
        let plane = |channel: usize| ScalarMap {
            width: image.width,
            height: image.height,
            values: colours.iter().map(|colour| colour[channel]).collect(),
        };
        Self {
            luminance: plane(0),
            red_green: plane(1),
            blue_yellow: plane(2),
        }
    }

    /// The picture after the eye's blur, as CIELAB with the Hunt effect.
    fn seen_lab(&self, space: &ColourSpace, pixels_per_degree: f64) -> Vec<DVec3> {
        let luminance = csf_filtered(&self.luminance, CSF_LUMINANCE, pixels_per_degree);
        let red_green = csf_filtered(&self.red_green, CSF_RED_GREEN, pixels_per_degree);
        let blue_yellow = csf_filtered(&self.blue_yellow, CSF_BLUE_YELLOW, pixels_per_degree);
        (luminance.par_iter().zip(&red_green).zip(&blue_yellow))
            .map(|((&y, &cx), &cz)| {
                // The blur can leave the gamut of the screen, so the colour is clamped before it is judged.
                let rgb = space
                    .rgb_from_opponent(DVec3::new(y, cx, cz))
                    .clamp(DVec3::ZERO, DVec3::ONE);
                space.hunt_lab_from_rgb(rgb)
            })
            .collect()
    }
}

fn opponent_of(pixel: &[f32; 4], space: &ColourSpace) -> DVec3 {
    let rgb = DVec3::new(pixel[0].into(), pixel[1].into(), pixel[2].into());
    space.opponent_from_rgb(rgb.clamp(DVec3::ZERO, DVec3::ONE))
}

/// One channel under its contrast sensitivity filter.
///
/// The filter is a sum of terms `a sqrt(pi / b) exp(-pi^2 d^2 / b)` of the distance d in degrees. Each term is
/// separable, so it is applied alone with taps of sum 1 and the results are added by their share of the whole weight.
fn csf_filtered(channel: &ScalarMap, terms: &[CsfTerm], pixels_per_degree: f64) -> Vec<f64> {
    // exp(-pi^2 d^2 / b) is a Gaussian of variance b / (2 pi^2); three deviations hold all but 0.3 % of it.
    let radius = (3.0 * (CSF_WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
    let mut sum = vec![0.0; channel.values.len()];
    let mut total_weight = 0.0;
    for &(amplitude, width) in terms {
        let taps = sampled_taps(radius, |x| {
            (-(PI * x / pixels_per_degree).powi(2) / width).exp()
        });
        let weight = amplitude * (PI / width).sqrt() * taps.iter().sum::<f64>().powi(2);
        let filtered = along_both(channel, &normalised(taps), Border::Replicate);
        sum.iter_mut()
            .zip(filtered.values)
            .for_each(|(total, value)| *total += weight * value);
        total_weight += weight;
    }
    sum.iter_mut().for_each(|value| *value /= total_weight);
    sum
}

/// The distance of green and blue, the largest between any two colours of the screen.
fn largest_distance(space: &ColourSpace) -> f64 {
    let green = space.hunt_lab_from_rgb(DVec3::Y);
    let blue = space.hunt_lab_from_rgb(DVec3::Z);
    hyab_distance(green, blue).powf(COLOUR_EXPONENT)
}

/// The colour error in 0..=1: the compressed distance through two straight pieces.
fn colour_error(a: DVec3, b: DVec3, largest: f64) -> f64 {
    let fraction = hyab_distance(a, b).powf(COLOUR_EXPONENT) / largest;
    if fraction < KNEE_INPUT {
        return fraction * KNEE_OUTPUT / KNEE_INPUT;
    }
    let above_knee = (fraction - KNEE_INPUT) / (1.0 - KNEE_INPUT);
    // The rounding of the largest distance itself must not end above 1.
    (KNEE_OUTPUT + above_knee * (1.0 - KNEE_OUTPUT)).min(1.0)
}

/// The first of the ascending errors at which the running sum reaches `target`; 0 without errors.
fn weighted_quantile(ascending: &[f64], target: f64) -> f64 {
    let mut sum = 0.0;
    let reached = ascending.iter().find(|&&error| {
        sum += error;
        sum >= target
    });
    reached.or(ascending.last()).copied().unwrap_or(0.0)
}

/// CIE xy chromaticities of the sRGB primaries red, green, blue.
const PRIMARIES_XY: [DVec2; 3] = [
    DVec2::new(0.64, 0.33),
    DVec2::new(0.30, 0.60),
    DVec2::new(0.15, 0.06),
];
/// Chromaticity of the white point D65 as sRGB rounds it.
const WHITE_XY: DVec2 = DVec2::new(0.3127, 0.3290);

/// Conversions that share one pair of matrices.
struct ColourSpace {
    xyz_from_rgb: DMat3,
    rgb_from_xyz: DMat3,
    white_xyz: DVec3,
}

impl ColourSpace {
    /// The space of a standard screen: columns are the primaries, scaled so that RGB (1, 1, 1) is white of Y = 1.
    fn srgb() -> Self {
        let white_xyz = xyz_of_unit_luminance(WHITE_XY);
        let [red, green, blue] = PRIMARIES_XY.map(xyz_of_unit_luminance);
        let primaries = DMat3::from_cols(red, green, blue);
        let xyz_from_rgb = primaries * DMat3::from_diagonal(primaries.inverse() * white_xyz);
        Self {
            xyz_from_rgb,
            rgb_from_xyz: xyz_from_rgb.inverse(),
            white_xyz,
        }
    }

    /// YCxCz of linear RGB. White is (100, 0, 0).
    fn opponent_from_rgb(&self, rgb: DVec3) -> DVec3 {
        let relative = self.xyz_from_rgb * rgb / self.white_xyz;
        DVec3::new(
            116.0 * relative.y - 16.0,
            500.0 * (relative.x - relative.y),
            200.0 * (relative.y - relative.z),
        )
    }

    /// The inverse of [`Self::opponent_from_rgb`]; may leave 0..=1.
    fn rgb_from_opponent(&self, opponent: DVec3) -> DVec3 {
        let y = (opponent.x + 16.0) / 116.0;
        let relative = DVec3::new(y + opponent.y / 500.0, y, y - opponent.z / 200.0);
        self.rgb_from_xyz * (relative * self.white_xyz)
    }

    /// CIELAB of linear RGB, with a and b scaled by L / 100: dark colours look less colourful (the Hunt effect).
    fn hunt_lab_from_rgb(&self, rgb: DVec3) -> DVec3 {
        let relative = self.xyz_from_rgb * rgb / self.white_xyz;
        let response = DVec3::new(
            lightness_response(relative.x),
            lightness_response(relative.y),
            lightness_response(relative.z),
        );
        let lightness = 116.0 * response.y - 16.0;
        let a = 500.0 * (response.x - response.y);
        let b = 200.0 * (response.y - response.z);
        DVec3::new(lightness, 0.01 * lightness * a, 0.01 * lightness * b)
    }
}

/// Lightness difference plus the Euclidean distance of the two chromatic parts (HyAB).
fn hyab_distance(a: DVec3, b: DVec3) -> f64 {
    let difference = a - b;
    difference.x.abs() + difference.y.hypot(difference.z)
}

/// The curve of CIELAB: a cube root, continued as its tangent below (6/29)^3.
fn lightness_response(relative: f64) -> f64 {
    const JOIN: f64 = 6.0 / 29.0;
    if relative > JOIN * JOIN * JOIN {
        relative.cbrt()
    } else {
        relative / (3.0 * JOIN * JOIN) + 4.0 / 29.0
    }
}

/// XYZ of a chromaticity at Y = 1.
fn xyz_of_unit_luminance(xy: DVec2) -> DVec3 {
    DVec3::new(xy.x / xy.y, 1.0, (1.0 - xy.x - xy.y) / xy.y)
}

/// Width of the feature detector in degrees of the visual field.
const FEATURE_WIDTH_DEG: f64 = 0.082;
/// Exponent of the feature difference.
const FEATURE_EXPONENT: f64 = 0.5;

/// The feature difference of two luminance maps (the Y of YCxCz, -16..=100).
fn difference(image: &ScalarMap, reference: &ScalarMap, pixels_per_degree: f64) -> ScalarMap {
    let kernels = Kernels::new(pixels_per_degree);
    let image_features = kernels.detect(image);
    let reference_features = kernels.detect(reference);
    let values = (image_features.par_iter().zip(&reference_features))
        .map(|(a, b)| {
            let edge = (a.edge - b.edge).abs();
            let point = (a.point - b.point).abs();
            // Lengths go up to the square root of 2, where both axes see a full step.
            (edge.max(point) * std::f64::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT)
        })
        .collect();
    ScalarMap {
        width: image.width,
        height: image.height,
        values,
    }
}

/// Strength of the features at one pixel.
struct Feature {
    edge: f64,
    point: f64,
}

/// A Gaussian and its first two derivatives as taps.
struct Kernels {
    smooth: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Kernels {
    fn new(pixels_per_degree: f64) -> Self {
        // The detector's width is the distance of the derivative's two extrema, which lie one deviation to each side.
        let sigma_px = 0.5 * FEATURE_WIDTH_DEG * pixels_per_degree;
        let radius = (3.0 * sigma_px).ceil() as usize;
        let gaussian = |x: f64| (-0.5 * (x / sigma_px).powi(2)).exp();
        Self {
            smooth: normalised(sampled_taps(radius, gaussian)),
            first: balanced(sampled_taps(radius, |x| -x * gaussian(x))),
            second: balanced(sampled_taps(radius, |x| {
                ((x / sigma_px).powi(2) - 1.0) * gaussian(x)
            })),
        }
    }

    fn detect(&self, luminance: &ScalarMap) -> Vec<Feature> {
        let values = luminance
            .values
            .iter()
            .map(|y| (y + 16.0) / 116.0)
            .collect();
        let relative = ScalarMap {
            values,
            ..*luminance
        };
        let rows = |taps: &[f64]| along_rows(&relative, taps, Border::Replicate);
        let columns =
            |map: &ScalarMap, taps: &[f64]| along_columns(map, taps, Border::Replicate).values;
        let smooth_in_x = rows(&self.smooth);
        let edge_x = columns(&rows(&self.first), &self.smooth);
        let edge_y = columns(&smooth_in_x, &self.first);
        let point_x = columns(&rows(&self.second), &self.smooth);
        let point_y = columns(&smooth_in_x, &self.second);
        (0..edge_x.len())
            .into_par_iter()
            .map(|i| Feature {
                edge: edge_x[i].hypot(edge_y[i]),
                point: point_x[i].hypot(point_y[i]),
            })
            .collect()
    }
}

/// The taps with the positive ones scaled to sum 1 and the negative ones to sum -1.
fn balanced(mut taps: Vec<f64>) -> Vec<f64> {
    let positive: f64 = taps.iter().filter(|&&tap| tap > 0.0).sum();
    let negative: f64 = -taps.iter().filter(|&&tap| tap < 0.0).sum::<f64>();
    for tap in &mut taps {
        *tap /= if *tap > 0.0 { positive } else { negative };
    }
    taps
}
