//! Round numbers for bars and axes, and how they are written.

use resample_core::narrow::floor;

/// The largest round length, 1, 2 or 5 times a power of ten, that is not above `most`, which is above 0.
///
/// ```
/// assert_eq!(resample_io::figure::round_length(73.0), 50.0);
/// assert_eq!(resample_io::figure::round_length(0.019), 0.01);
/// ```
pub fn round_length(most: f64) -> f64 {
    let (power, digits) = power_below(most);
    let step = [5.0, 2.0].into_iter().find(|&step| step <= digits);
    scaled(step.unwrap_or(1.0), power)
}

/// The power of ten below a number, and the number divided by it: 1 to 10.
fn power_below(number: f64) -> (i32, f64) {
    let power = number.log10().floor() as i32;
    let digits = number / 10f64.powi(power);
    // The logarithm may be rounded to the wrong side of a power of ten.
    match digits {
        digits if digits >= 9.999_999_999 => (power + 1, 1.0),
        digits if digits < 1.0 => (power, 1.0),
        digits => (power, digits),
    }
}

/// A number times a power of ten; negative powers divide, because only the others are exact.
fn scaled(number: f64, power: i32) -> f64 {
    if power < 0 {
        number / 10f64.powi(-power)
    } else {
        number * 10f64.powi(power)
    }
}

/// Round numbers from `low` to `high`, at most `most` of them, at least two where `most` is.
pub(super) fn ticks(low: f64, high: f64, most: usize) -> Vec<f64> {
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return vec![low];
    }
    let (power, digits) = power_below(span / most.max(1) as f64);
    let step = [1.0, 2.0, 5.0].into_iter().find(|&step| step >= digits);
    let (step, power) = step.map_or((1.0, power + 1), |step| (step, power));
    let unit = scaled(step, power);
    let from = floor((low / unit - 1e-9).ceil());
    let to = floor(high / unit + 1e-9);
    (from..=to)
        .take(2 * most + 2)
        .map(|count| scaled(count as f64 * step, power))
        .collect()
}

/// A number as people write it: no more digits than a round number needs, powers of ten only far from 1.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e6).contains(&size) {
        return format!("{value:e}").replace('-', "−");
    }
    // Sums of round numbers have errors behind the tenth digit.
    let rounded: f64 = format!("{value:.10}").parse().unwrap_or(value);
    format!("{}", if rounded == 0.0 { 0.0 } else { rounded }).replace('-', "−")
}
