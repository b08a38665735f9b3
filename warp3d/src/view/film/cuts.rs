//! Where a film cuts from one shot to the next.
//!
//! Takes small copies of the pictures and depths in order, finds the first picture of each shot. A cut is a change that is large, and much larger than those
//! around it: a pan changes every picture, a cut one. Colour and depth vote together: depth that stays while colours jump is a flash.
//! Limits: fades and dissolves are no cuts.

use resample_core::image::srgb_from_linear;

/// Width and height of a small copy.
const WIDTH: usize = 32;
const HEIGHT: usize = 18;

/// Least change of a cut: the mean difference of encoded colours, and of the rank of depths, of 1.
const LEAST_CHANGE: f32 = 0.06;

/// A cut changes at least so many times as much as the pictures around it. A guess, between pans (1.5) and cuts (10 and more).
const FACTOR: f32 = 3.0;

/// A change of colour that needs no vote of depth.
const SURE: f32 = 0.15;

/// Pictures before (and after, where they are known) that a change is compared with.
const AROUND: usize = 4;

/// A small copy of a picture and its depth.
#[derive(Clone, Debug, PartialEq)]
pub struct Thumb {
    colours: Vec<[f32; 3]>,
    /// Inverse depth, or what grows with it; NaN where nothing is known.
    nearness: Vec<f32>,
}

/// The changes of a film from picture to picture.
#[derive(Clone, Debug, Default)]
pub struct Cuts {
    last: Option<Thumb>,
    changes: Vec<f32>,
}

impl Thumb {
    /// The copy of a picture that is `width` wide, and of numbers that grow with nearness, of any width of their own.
    pub fn new(colour: &[[f32; 3]], width: usize, nearness: &[f32], its_width: usize) -> Self {
        let colours = blocks(colour, width, |block| {
            let mut sum = [0.0; 3];
            for [r, g, b] in block {
                sum = [sum[0] + r, sum[1] + g, sum[2] + b];
            }
            sum.map(|channel| srgb_from_linear(channel / block.len().max(1) as f32))
        });
        let nearness = blocks(nearness, its_width, |block| {
            let known = block.iter().copied().filter(|v| v.is_finite());
            let (sum, count) = known.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
            sum / count
        });
        Self { colours, nearness }
    }

    /// How much another picture differs, in colours and in depth.
    fn change(&self, other: &Self) -> [f32; 2] {
        let colours = self.colours.iter().zip(&other.colours);
        let apart =
            |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).sum::<f32>() / 3.0;
        let colour = colours.map(apart).sum::<f32>() / self.colours.len() as f32;
        // Depth may be scaled from picture to picture: its order in the picture may not.
        let (own, others) = (ranks(&self.nearness), ranks(&other.nearness));
        let depth = own
            .iter()
            .zip(&others)
            .map(|(a, b)| (a - b).abs())
            .sum::<f32>();
        [colour, depth / own.len() as f32]
    }
}

impl Cuts {
    /// Adds a picture; true if it begins a shot, as far as the pictures before it tell.
    pub fn add(&mut self, thumb: Thumb) -> bool {
        let Some(last) = self.last.replace(thumb) else {
            self.changes.push(0.0);
            return true;
        };
        let [colour, depth] = self.last.as_ref().map_or([0.0; 2], |now| now.change(&last));
        let is_sure = colour > SURE && depth > 0.5 * LEAST_CHANGE;
        let change = if is_sure || depth > LEAST_CHANGE {
            colour
        } else {
            0.5 * colour
        };
        self.changes.push(change);
        let index = self.changes.len() - 1;
        self.is_cut(index, index)
    }

    /// The first pictures of all shots, with all pictures known.
    pub fn all(&self) -> Vec<usize> {
        let last = self.changes.len().saturating_sub(1);
        (0..self.changes.len())
            .filter(|&index| index == 0 || self.is_cut(index, last))
            .collect()
    }

    /// Returns true if the change to picture `index` is a cut beside those around it, up to that of picture `last`.
    fn is_cut(&self, index: usize, last: usize) -> bool {
        let change = self.changes[index];
        let first = index.saturating_sub(AROUND).max(1);
        let around = (first..=(index + AROUND).min(last)).filter(|&other| other != index);
        let mut around: Vec<f32> = around.map(|other| self.changes[other]).collect();
        let middle = around.len() / 2;
        let usual = match around.is_empty() {
            true => 0.0,
            false => *around.select_nth_unstable_by(middle, f32::total_cmp).1,
        };
        change > LEAST_CHANGE && change > FACTOR * usual
    }
}

/// A value for each block of a small copy.
fn blocks<T: Copy, R>(values: &[T], width: usize, value: impl Fn(&[T]) -> R) -> Vec<R> {
    let height = values.len() / width.max(1);
    let mut block = Vec::new();
    let mut of = |index: usize| {
        let (column, row) = (index % WIDTH, index / WIDTH);
        let part = |number: usize, count: usize, side: usize| {
            let first = number * side / count;
            first..((number + 1) * side / count).max(first + 1).min(side)
        };
        block.clear();
        for y in part(row, HEIGHT, height) {
            let columns = part(column, WIDTH, width);
            block.extend_from_slice(&values[y * width..][columns]);
        }
        value(&block)
    };
    (0..WIDTH * HEIGHT).map(&mut of).collect()
}

/// The rank of each value, 0 to 1; one half where it is unknown.
fn ranks(values: &[f32]) -> Vec<f32> {
    let mut order: Vec<usize> = (0..values.len())
        .filter(|&i| values[i].is_finite())
        .collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.5; values.len()];
    let count = order.len().max(1) as f32;
    // Values that are alike share the middle of their ranks.
    let mut first = 0;
    while first < order.len() {
        let same = order[first..]
            .iter()
            .take_while(|&&i| values[i] == values[order[first]]);
        let end = first + same.count().max(1);
        for &index in &order[first..end] {
            ranks[index] = (0.5 * (first + end) as f32) / count;
        }
        first = end;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene of stripes that pans by `shift` px.
    fn thumb(scene: u32, shift: f32, light: f32) -> Thumb {
        let (width, height) = (64, 36);
        let wave = |i: usize| {
            let (x, y) = ((i % width) as f32 + shift, (i / width) as f32);
            let phase = scene as f32 * 1.7;
            0.5 + 0.5 * (0.2 * x + phase).sin() * (0.15 * y * (1.0 + 0.3 * scene as f32)).cos()
        };
        let colour: Vec<[f32; 3]> = (0..width * height)
            .map(|i| {
                [
                    light * wave(i),
                    light * 0.5 * wave(i),
                    light * (1.0 - wave(i)),
                ]
            })
            .collect();
        let nearness: Vec<f32> = (0..width * height)
            .map(|i| 1.0 + wave(i) * wave(i))
            .collect();
        Thumb::new(&colour, width, &nearness, width)
    }

    #[test]
    fn cuts_are_found_and_pans_and_flashes_are_none() {
        let mut cuts = Cuts::default();
        let mut online = Vec::new();
        for index in 0..60 {
            let scene = u32::from(index >= 20) + u32::from(index >= 41);
            let light = if index == 30 { 1.4 } else { 1.0 };
            if cuts.add(thumb(scene, 1.5 * index as f32, light)) {
                online.push(index);
            }
        }
        assert_eq!(cuts.all(), [0, 20, 41]);
        assert_eq!(online, [0, 20, 41]);
    }

    #[test]
    fn a_small_picture_has_a_thumb() {
        let thumb = Thumb::new(&[[0.5; 3]; 2], 2, &[f32::NAN, 1.0], 1);
        assert_eq!(thumb.colours.len(), WIDTH * HEIGHT);
        assert!(
            !Cuts {
                last: Some(thumb.clone()),
                changes: vec![0.0]
            }
            .add(thumb)
        );
    }
}
