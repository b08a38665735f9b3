//! The picture of a transfer function: its opacity over the volume's histogram, its colours below, and a value axis.
//!
//! Takes a function and a histogram, gives an opaque picture in linear light. Each column of the plot stands for one
//! scalar; counts are drawn by their logarithm, because most voxels of most volumes are background. Numbers are drawn
//! with a built-in font of 3 x 5 dots, which holds what a number needs and nothing else.

use resample_core::Image;

use crate::transfer::Histogram;
use crate::transfer::TransferFunction;

/// Size of the picture, px.
const SIZE: [usize; 2] = [800, 300];
/// First column of the plot, and columns beyond its last one, px: half of the longest number fits.
const MARGIN: usize = 40;
/// Columns of the plot.
const COLUMNS: usize = SIZE[0] - 2 * MARGIN;
/// Rows of the curve: its top at opacity 1, its bottom at 0.
const CURVE: [usize; 2] = [14, 230];
/// Rows of the colour bar.
const BAR: [usize; 2] = [238, 260];
/// First row of the numbers.
const NUMBERS: usize = 272;
/// Side of a dot of the font, px.
const DOT: usize = 2;
/// Most ticks on the axis.
const MOST_TICKS: f64 = 8.0;

/// Linear light.
const BACKGROUND: [f32; 3] = [0.01, 0.01, 0.012];
const COUNTS: [f32; 3] = [0.1, 0.11, 0.13];
const INK: [f32; 3] = [0.9, 0.9, 0.9];

/// Rows of three dots, from the top, the leftmost dot in the highest of three bits.
const FONT: [(char, [u8; 5]); 14] = [
    ('0', [7, 5, 5, 5, 7]),
    ('1', [2, 6, 2, 2, 7]),
    ('2', [7, 1, 7, 4, 7]),
    ('3', [7, 1, 7, 1, 7]),
    ('4', [5, 5, 7, 1, 1]),
    ('5', [7, 4, 7, 1, 7]),
    ('6', [7, 4, 7, 5, 7]),
    ('7', [7, 1, 1, 2, 2]),
    ('8', [7, 5, 7, 5, 7]),
    ('9', [7, 5, 7, 1, 7]),
    ('-', [0, 0, 7, 0, 0]),
    ('.', [0, 0, 0, 0, 2]),
    ('e', [0, 7, 7, 4, 7]),
    ('+', [0, 2, 7, 2, 0]),
];

/// The scalars of the first and the last column.
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    /// All that the function and the histogram reach.
    fn new(function: &TransferFunction, histogram: &Histogram) -> Self {
        let (first, last) = function.value_range();
        let (least, greatest) = histogram.range();
        let (low, high) = (first.min(least), last.max(greatest));
        if high > low {
            Self { low, high }
        } else {
            Self {
                low: low - 0.5,
                high: high + 0.5,
            }
        }
    }

    fn value(&self, column: usize) -> f64 {
        let share = column as f64 / (COLUMNS - 1) as f64;
        self.low * (1.0 - share) + self.high * share
    }

    /// The column of a scalar; scalars beyond give the ends. Halves keep a range of almost all of f64 finite.
    fn column(&self, value: f64) -> usize {
        let share = (0.5 * value - 0.5 * self.low) / (0.5 * self.high - 0.5 * self.low);
        (share.clamp(0.0, 1.0) * (COLUMNS - 1) as f64).round() as usize
    }
}

/// Draws the function over the histogram.
pub fn draw(function: &TransferFunction, histogram: &Histogram) -> Image {
    let axis = Axis::new(function, histogram);
    let mut image = Image::transparent(SIZE[0], SIZE[1]).over_background(BACKGROUND);
    draw_counts(&mut image, &axis, histogram);
    let mut before = None;
    for column in 0..COLUMNS {
        let (rgb, opacity) = function.sample(axis.value(column));
        fill(
            &mut image,
            [MARGIN + column, BAR[0]],
            [1, BAR[1] - BAR[0]],
            rgb.map(|channel| channel.min(1.0)),
        );
        let row = row_of(opacity);
        let (top, bottom) = (
            row.min(before.unwrap_or(row)),
            row.max(before.unwrap_or(row)),
        );
        fill(
            &mut image,
            [MARGIN + column, top],
            [2, bottom - top + 2],
            INK,
        );
        before = Some(row);
    }
    draw_ticks(&mut image, &axis);
    image
}

/// The row of a share of the curve's height.
fn row_of(share: f64) -> usize {
    CURVE[1] - (share.clamp(0.0, 1.0) * (CURVE[1] - CURVE[0]) as f64).round() as usize
}

fn draw_counts(image: &mut Image, axis: &Axis, histogram: &Histogram) {
    let counts = histogram.counts();
    let most = counts.iter().copied().max().unwrap_or(0);
    let mut greatest = [0u64; COLUMNS];
    for (bin, &count) in counts.iter().enumerate() {
        let centre = histogram.value(bin);
        let next = histogram.value((bin + 1).min(counts.len() - 1));
        let half = 0.5 * next - 0.5 * centre;
        // A bin that is wider than a column fills all of its columns.
        let columns = axis.column(centre - half)..=axis.column(centre + half);
        greatest[columns]
            .iter_mut()
            .for_each(|column| *column = count.max(*column));
    }
    for (column, &count) in greatest.iter().enumerate().filter(|(_, count)| **count > 0) {
        let row = row_of((count as f64).ln_1p() / (most as f64).ln_1p());
        fill(
            image,
            [MARGIN + column, row],
            [1, CURVE[1] + 1 - row],
            COUNTS,
        );
    }
}

fn draw_ticks(image: &mut Image, axis: &Axis) {
    let step = tick_step(axis.high - axis.low);
    let first = (axis.low / step).ceil();
    let last = (axis.high / step).floor();
    // A range that is tiny beside its values has no ticks that f64 could tell apart.
    if !(last - first <= 2.0 * MOST_TICKS) {
        return;
    }
    for tick in 0..=(last - first).max(0.0) as usize {
        let value = (first + tick as f64) * step;
        let centre = MARGIN + axis.column(value);
        fill(image, [centre, BAR[1]], [1, 6], INK);
        let text = number(value, step);
        let width = text.chars().count() * 4 * DOT;
        write_number(image, [centre.saturating_sub(width / 2), NUMBERS], &text);
    }
}

/// 1, 2 or 5 times a power of ten, so that the ticks are at most [`MOST_TICKS`] and one more.
fn tick_step(span: f64) -> f64 {
    let least = span / MOST_TICKS;
    let power = 10f64.powf(least.log10().floor());
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|factor| factor * power >= least);
    factor.unwrap_or(10.0) * power
}

/// A tick's number with the digits that its step needs.
fn number(value: f64, step: f64) -> String {
    let exponent = step.log10().floor();
    if value.abs() >= 1e7 || exponent < -4.0 {
        return format!("{value:.2e}");
    }
    // A negative zero would be written with its sign.
    format!("{:.*}", (-exponent).max(0.0) as usize, value + 0.0)
}

fn write_number(image: &mut Image, [left, top]: [usize; 2], text: &str) {
    for (place, letter) in text.chars().enumerate() {
        let rows = FONT
            .iter()
            .find(|(known, _)| *known == letter)
            .map_or([0; 5], |(_, rows)| *rows);
        for (y, row) in rows.into_iter().enumerate() {
            for x in (0..3).filter(|x| row & (4 >> x) != 0) {
                fill(
                    image,
                    [left + (4 * place + x) * DOT, top + y * DOT],
                    [DOT, DOT],
                    INK,
                );
            }
        }
    }
}

/// Fills a rectangle, cut at the edges of the picture.
fn fill(
    image: &mut Image,
    [left, top]: [usize; 2],
    [width, height]: [usize; 2],
    [r, g, b]: [f32; 3],
) {
    for y in top..(top + height).min(image.height) {
        for x in left..(left + width).min(image.width) {
            image.rgba[y * image.width + x] = [r, g, b, 1.0];
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::Volume;
    use crate::transfer::ColourMap;
    use crate::volume::Voxels;
    use glam::DAffine3;

    use super::*;

    fn plot(voxels: Voxels, level: f64, width: f64) -> Image {
        let volume = Volume::new([voxels.len(), 1, 1], voxels, DAffine3::IDENTITY).expect("valid");
        let function =
            TransferFunction::window(level, width, ColourMap::default()).expect("a window");
        draw(&function, &Histogram::of_volume(&volume))
    }

    fn rgb(image: &Image, x: usize, y: usize) -> [f32; 3] {
        let [r, g, b, _] = image.pixel(x, y);
        [r, g, b]
    }

    #[test]
    fn the_curve_rises_over_the_counts_and_the_bar_shows_the_colours() {
        let image = plot(Voxels::U8((0..=200).collect()), 100.0, 200.0);
        let (left, right) = (MARGIN, MARGIN + COLUMNS - 1);
        assert_eq!(rgb(&image, left, CURVE[1]), INK, "opacity 0 on the left");
        assert_eq!(rgb(&image, right, CURVE[0]), INK, "opacity 1 on the right");
        assert_eq!(
            rgb(&image, left + 300, CURVE[0]),
            COUNTS,
            "each value occurs once: all bars are full"
        );
        let map = ColourMap::default();
        assert_eq!(
            rgb(&image, left, BAR[0]),
            map.colour(0.0),
            "the map's first colour"
        );
        assert_eq!(
            rgb(&image, right, BAR[0]),
            map.colour(1.0),
            "the map's last colour"
        );
        // 200 / 8 = 25, so that the step is 50 and 100 is the tick in the middle.
        let middle = MARGIN
            + Axis {
                low: 0.0,
                high: 200.0,
            }
            .column(100.0);
        assert_eq!(rgb(&image, middle, BAR[1] + 2), INK, "a tick at 100");
        assert!(
            image.rgba.iter().all(|pixel| pixel[3] == 1.0),
            "the picture is opaque"
        );
    }

    #[test]
    fn steps_are_round_and_numbers_short() {
        for (span, step) in [(200.0, 50.0), (8.0, 1.0), (4000.0, 500.0), (1.0, 0.2)] {
            assert!(
                (tick_step(span) / step - 1.0).abs() < 1e-12,
                "span {span}: {}",
                tick_step(span)
            );
        }
        assert_eq!(number(-1000.0, 500.0), "-1000");
        assert_eq!(number(0.6000000000000001, 0.2), "0.6");
        assert_eq!(number(3e30, 1e30), "3.00e30");
        assert!(
            number(1.5, 0.5)
                .chars()
                .all(|c| FONT.iter().any(|(known, _)| *known == c)),
            "all in the font"
        );
    }

    #[test]
    fn odd_volumes_do_not_break_the_plot() {
        for voxels in [
            Voxels::F64(vec![-1.7e308, 1.7e308]),
            Voxels::F32(vec![5.0; 3]),
            Voxels::F64(vec![1e-310, 2e-310]),
        ] {
            let image = plot(voxels, 0.0, 1e-3);
            assert_eq!(
                (image.width, image.height),
                (SIZE[0], SIZE[1]),
                "a picture all the same"
            );
        }
    }
}
