//! Depth as people have it: blurred, enlarged from a smaller map, or packed with loss, made from exact depth in f64.
//!
//! Takes a reference with exact depth, gives the same reference with soft depth. Numbers are changed as they would be in a
//! file: as camera z, or as inverse z, which is what stereo and networks give. Colours stay as they are.
//!
//! Limits: every sample has a depth; a JPEG file has one grey channel and the quantiser of its standard's annex K.

use warp3d::Reference;

/// The numbers of a depth file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbers {
    /// Camera z.
    Z,
    /// Inverse of camera z.
    Inverse,
}

/// The change of a depth map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Softening {
    /// A Gaussian of this sigma, px.
    Blurred(f64),
    /// Every n-th sample, and straight lines between them.
    Linear(usize),
    /// Every n-th sample, and a cubic of four taps (Keys 1981), which overshoots.
    Cubic(usize),
    /// Blurred by this sigma, px, and filtered by the picture's brightness (the guided filter of He, Sun and Tang 2010, with a
    /// window of twice the sigma): sharp where the picture has contrast, soft elsewhere.
    Guided(f64),
    /// Rounded to 8 bits between the least and the greatest number, and packed as JPEG of this quality, 1 to 100.
    Jpeg(f64),
}

/// `reference` with softened depth.
pub fn softened(reference: &Reference, numbers: Numbers, how: Softening) -> Reference {
    let width = reference.camera.width as usize;
    let height = reference.camera.height as usize;
    let convert = |v: f64| match numbers {
        Numbers::Z => v,
        Numbers::Inverse => 1.0 / v,
    };
    let plane = Plane {
        width,
        height,
        values: reference
            .depth
            .iter()
            .map(|&z| convert(f64::from(z)))
            .collect(),
    };
    let soft = match how {
        Softening::Blurred(sigma) => plane.blurred(sigma),
        Softening::Guided(sigma) => plane.blurred(sigma).guided(&reference.colour, sigma),
        Softening::Linear(step) => plane.enlarged(step, linear),
        Softening::Cubic(step) => plane.enlarged(step, keys),
        Softening::Jpeg(quality) => plane.packed(quality),
    };
    Reference {
        depth: soft.values.iter().map(|&v| convert(v) as f32).collect(),
        ..reference.clone()
    }
}

/// One number a sample.
struct Plane {
    width: usize,
    height: usize,
    values: Vec<f64>,
}

impl Plane {
    /// The number at a place, that of the border beyond it.
    fn at(&self, x: i64, y: i64) -> f64 {
        let x = x.clamp(0, self.width as i64 - 1) as usize;
        let y = y.clamp(0, self.height as i64 - 1) as usize;
        self.values[y * self.width + x]
    }

    fn of(&self, value: impl Fn(i64, i64) -> f64) -> Self {
        let places = (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y)));
        Self {
            values: places.map(|(x, y)| value(x as i64, y as i64)).collect(),
            ..*self
        }
    }

    fn blurred(&self, sigma: f64) -> Self {
        let reach = (4.0 * sigma).ceil() as i64;
        let weights: Vec<f64> = (-reach..=reach)
            .map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp())
            .collect();
        let total: f64 = weights.iter().sum();
        let mean = |value: &dyn Fn(i64) -> f64| {
            let terms = (-reach..=reach).zip(&weights).map(|(i, w)| w * value(i));
            terms.sum::<f64>() / total
        };
        let rows = self.of(|x, y| mean(&|i| self.at(x + i, y)));
        rows.of(|x, y| mean(&|i| rows.at(x, y + i)))
    }

    /// The mean over a window of this reach, which ends where the plane does.
    fn mean(&self, reach: i64) -> Self {
        let along = |from: i64, count: usize, value: &dyn Fn(i64) -> f64| {
            let window = (from - reach).max(0)..(from + reach + 1).min(count as i64);
            window.clone().map(value).sum::<f64>() / (window.end - window.start) as f64
        };
        let rows = self.of(|x, y| along(x, self.width, &|i| self.at(i, y)));
        rows.of(|x, y| along(y, self.height, &|i| rows.at(x, i)))
    }

    /// The guided filter: fits a straight line over the brightness in each window, and averages the lines of the windows around
    /// a sample.
    fn guided(&self, colours: &[[f32; 3]], sigma: f64) -> Self {
        // Variance of brightness below which a window is flat: a contrast of 0.1.
        const FLAT: f64 = 0.01;
        let reach = (2.0 * sigma).ceil() as i64;
        let guide = Self {
            values: colours
                .iter()
                .map(|rgb| f64::from((rgb[0] + rgb[1] + rgb[2]) / 3.0).sqrt())
                .collect(),
            ..*self
        };
        let product = |a: &Self, b: &Self| Self {
            values: a.values.iter().zip(&b.values).map(|(a, b)| a * b).collect(),
            ..*self
        };
        let (mean_guide, mean) = (guide.mean(reach), self.mean(reach));
        let squares = product(&guide, &guide).mean(reach);
        let products = product(&guide, self).mean(reach);
        let slope = self.of(|x, y| {
            let variance = squares.at(x, y) - mean_guide.at(x, y).powi(2);
            let covariance = products.at(x, y) - mean_guide.at(x, y) * mean.at(x, y);
            covariance / (variance + FLAT)
        });
        let base = self.of(|x, y| mean.at(x, y) - slope.at(x, y) * mean_guide.at(x, y));
        let (slope, base) = (slope.mean(reach), base.mean(reach));
        self.of(|x, y| slope.at(x, y) * guide.at(x, y) + base.at(x, y))
    }

    /// Samples `step / 2`, `step / 2 + step` and so on, and what `weights` make of four neighbours between them.
    fn enlarged(&self, step: usize, weights: fn(f64) -> [f64; 4]) -> Self {
        let first = (step / 2) as i64;
        let between = |along: i64| {
            let place = (along - first) as f64 / step as f64;
            (place.floor() as i64, weights(place - place.floor()))
        };
        let last = |count: usize| (count as i64 - 1 - first) / step as i64;
        let sample = |i: i64, count: usize| first + i.clamp(0, last(count)) * step as i64;
        self.of(|x, y| {
            let ((i, wx), (j, wy)) = (between(x), between(y));
            let mut sum = 0.0;
            for (v, wy) in (-1..=2).zip(wy) {
                for (u, wx) in (-1..=2).zip(wx) {
                    let (x, y) = (sample(i + u, self.width), sample(j + v, self.height));
                    sum += wx * wy * self.at(x, y);
                }
            }
            sum
        })
    }

    /// Rounded to 8 bits, and each block of 8x8 through the quantised cosine transform.
    fn packed(&self, quality: f64) -> Self {
        let least = self.values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = self
            .values
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max);
        // Code 0 would be unknown.
        let unit = (most - least) / 254.0;
        let codes = self.of(|x, y| ((self.at(x, y) - least) / unit).round() + 1.0);
        let scale = if quality < 50.0 {
            50.0 / quality
        } else {
            2.0 - quality / 50.0
        };
        let mut unpacked = self.of(|_, _| 0.0);
        for top in (0..self.height).step_by(8) {
            for left in (0..self.width).step_by(8) {
                let block = quantised(|x, y| codes.at((left + x) as i64, (top + y) as i64), scale);
                for (y, row) in block.iter().enumerate().take(self.height - top) {
                    for (x, code) in row.iter().enumerate().take(self.width - left) {
                        let code = code.round().clamp(1.0, 255.0);
                        unpacked.values[(top + y) * self.width + left + x] =
                            least + (code - 1.0) * unit;
                    }
                }
            }
        }
        unpacked
    }
}

fn linear(t: f64) -> [f64; 4] {
    [0.0, 1.0 - t, t, 0.0]
}

fn keys(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

/// Luminance quantiser of ISO 10918-1, table K.1.
const QUANTISER: [[f64; 8]; 8] = [
    [16.0, 11.0, 10.0, 16.0, 24.0, 40.0, 51.0, 61.0],
    [12.0, 12.0, 14.0, 19.0, 26.0, 58.0, 60.0, 55.0],
    [14.0, 13.0, 16.0, 24.0, 40.0, 57.0, 69.0, 56.0],
    [14.0, 17.0, 22.0, 29.0, 51.0, 87.0, 80.0, 62.0],
    [18.0, 22.0, 37.0, 56.0, 68.0, 109.0, 103.0, 77.0],
    [24.0, 35.0, 55.0, 64.0, 81.0, 104.0, 113.0, 92.0],
    [49.0, 64.0, 78.0, 87.0, 103.0, 121.0, 120.0, 101.0],
    [72.0, 92.0, 95.0, 98.0, 112.0, 100.0, 103.0, 99.0],
];

/// A block of 8x8 numbers as JPEG keeps it.
fn quantised(value: impl Fn(usize, usize) -> f64, scale: f64) -> [[f64; 8]; 8] {
    let wave = |u: usize, x: usize| {
        let norm = if u == 0 { 0.125f64.sqrt() } else { 0.5 };
        norm * (std::f64::consts::PI * (2 * x + 1) as f64 * u as f64 / 16.0).cos()
    };
    let all = || (0..8).flat_map(|v| (0..8).map(move |u| (u, v)));
    let mut kept = [[0.0; 8]; 8];
    for (u, v) in all() {
        let terms = all().map(|(x, y)| value(x, y) * wave(u, x) * wave(v, y));
        let step = (QUANTISER[v][u] * scale).round().max(1.0);
        kept[v][u] = (terms.sum::<f64>() / step).round() * step;
    }
    let mut block = [[0.0; 8]; 8];
    for (x, y) in all() {
        block[y][x] = all()
            .map(|(u, v)| kept[v][u] * wave(u, x) * wave(v, y))
            .sum();
    }
    block
}
