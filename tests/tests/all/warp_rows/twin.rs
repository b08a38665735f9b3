//! A row drawn by brute force in f64: every sub-pixel asks every piece of its row.

use glam::DVec3;
use resample_core::Camera;
use warp3d::Reference;

/// Departure of inverse depth that separates surfaces: exact depth's, relative.
const TOLERANCE: f64 = 0.004;

/// Least squared contrast that says where an edge lies, and how far the farther surface goes on behind the nearer one, samples.
const CONTRAST2: f64 = 3.0 * 0.016 * 0.016;
const BEHIND: f64 = 0.05;

/// Sub-pixels see two parts of one surface that are farther from each other than this, samples.
const FAR: f64 = 2.0;

/// A surface of a row: its samples' inverse depths and colours, and how far it reaches beyond the first and the last.
struct Surface {
    first: usize,
    nearness: Vec<f64>,
    spline: Vec<DVec3>,
    reach: [f64; 2],
}

/// The nearest surface at a sub-pixel.
#[derive(Clone, Copy)]
struct Seen {
    surface: usize,
    place: f64,
}

/// Premultiplied colour and coverage of each pixel of `target`.
pub(super) fn picture(reference: &Reference, target: &Camera) -> Vec<[f64; 4]> {
    let lens = &reference.camera;
    let width = lens.width as usize;
    let rows: Vec<Vec<Surface>> = (0..lens.height as usize)
        .map(|y| {
            let row = y * width..(y + 1) * width;
            surfaces(&reference.depth[row.clone()], &reference.colour[row])
        })
        .collect();
    let scale = [target.fx / lens.fx, target.fy / lens.fy];
    let moved = (target.camera_from_world * lens.camera_from_world.inverse())
        .translation
        .x;
    // Where a place of a row lies, samples from the first one's centre, at an inverse depth.
    let x = |place: f64, nearness: f64| {
        target.cx + scale[0] * (place + 0.5 - lens.cx) + target.fx * moved * nearness
    };
    let mut picture = Vec::new();
    for y in 0..target.height {
        let middle = (f64::from(y) + 0.5 - target.cy) / scale[1] + lens.cy - 0.5;
        let variance = 0.25 * (1.0 / (scale[1] * scale[1]) - 1.0);
        let weights: Vec<f64> = (0..rows.len())
            .map(|row| {
                let apart = (row as f64 - middle).abs();
                match variance > 1e-6 {
                    true if apart <= 3.0 * variance.sqrt() + 1.0 => {
                        (-0.5 * apart * apart / variance).exp()
                    }
                    true => 0.0,
                    false => (1.0 - apart).max(0.0),
                }
            })
            .collect();
        let sum: f64 = weights.iter().sum();
        let mut line = vec![[0.0; 4]; target.width as usize];
        for (surfaces, weight) in rows.iter().zip(&weights) {
            if weight / sum < 1e-4 {
                continue;
            }
            for (to, pixel) in
                line.iter_mut()
                    .zip(row(surfaces, &x, scale[0], target.width as usize))
            {
                *to = std::array::from_fn(|c| to[c] + weight / sum * pixel[c]);
            }
        }
        picture.extend(line.iter().map(|pixel| pixel.map(|v| v.max(0.0))));
    }
    picture
}

/// The pixels of a row of `width`.
fn row(
    surfaces: &[Surface],
    x: &dyn Fn(f64, f64) -> f64,
    scale: f64,
    width: usize,
) -> Vec<[f64; 4]> {
    let columns = (1.0 / scale).ceil() as usize;
    let of_column = if columns == 1 { 4 } else { 2 };
    let of_pixel = columns * of_column;
    let fine = width * of_pixel;
    let seen: Vec<Option<Seen>> = (0..fine)
        .map(|s| nearest(surfaces, x, (s as f64 + 0.5) / of_pixel as f64))
        .collect();
    let is_edge = |s: usize| match (seen[s - 1], seen[s]) {
        (Some(a), Some(b)) => a.surface != b.surface || (a.place - b.place).abs() > FAR,
        (None, None) => false,
        _ => true,
    };
    // The samples are filtered by their own Gaussian: the variance that a larger pixel adds, px^2.
    let variance = 0.25 * (1.0 - scale * scale);
    let column = |column: usize| {
        let behind = column * of_column + of_column / 2;
        match (seen[behind - 1], seen[behind]) {
            (Some(a), Some(b)) if a.surface == b.surface => {
                surfaces[a.surface].colour(0.5 * (a.place + b.place))
            }
            _ => DVec3::ZERO,
        }
    };
    let pixel = |p: usize| {
        let window = (p * of_pixel).saturating_sub(of_pixel)..((p + 2) * of_pixel).min(fine);
        let middle = (p as f64 + 0.5) * of_pixel as f64;
        let edges: Vec<usize> = (window.start + 1..window.end)
            .filter(|&s| is_edge(s))
            .collect();
        if edges.is_empty() {
            if seen[window.start].is_none() {
                return [0.0; 4];
            }
            if columns == 1 {
                return column(p).extend(1.0).to_array();
            }
            let (mut sum, mut total) = (DVec3::ZERO, 0.0);
            for k in 0..3 * columns {
                let apart = (k as f64 + 0.5) / columns as f64 - 1.5;
                let weight = (-0.5 * apart * apart / variance).exp();
                let at = (p * columns + k)
                    .saturating_sub(columns)
                    .min(width * columns - 1);
                sum += weight * column(at);
                total += weight;
            }
            return (sum / total).extend(1.0).to_array();
        }
        let weight = |s: usize| {
            let apart = (s as f64 + 0.5 - middle) / of_pixel as f64;
            (-0.5 * apart * apart / 0.25).exp()
        };
        let inside: f64 = window.clone().map(weight).sum();
        let mut sum = [0.0; 4];
        let ends = edges.iter().copied().chain([window.end]);
        let mut first = window.start;
        for end in ends {
            if let Some(Seen { surface, .. }) = seen[first] {
                let part: f64 = (first..end).map(weight).sum();
                let place = |s: usize| weight(s) * seen[s].map_or(0.0, |seen| seen.place);
                let place: f64 = (first..end).map(place).sum();
                let colour = surfaces[surface]
                    .colour(place / part)
                    .extend(1.0)
                    .to_array();
                sum = std::array::from_fn(|c| sum[c] + part / inside * colour[c]);
            }
            first = end;
        }
        sum
    };
    (0..width).map(pixel).collect()
}

/// The nearest piece at a place of the screen.
fn nearest(surfaces: &[Surface], x: &dyn Fn(f64, f64) -> f64, at: f64) -> Option<Seen> {
    let mut best: Option<(f64, Seen)> = None;
    for (number, surface) in surfaces.iter().enumerate() {
        let last = surface.nearness.len() - 1;
        let places = (0..=last).map(|i| ((surface.first + i) as f64, surface.nearness[i]));
        let mut ends: Vec<(f64, f64)> = places.collect();
        ends.insert(0, (ends[0].0 - surface.reach[0], ends[0].1));
        ends.push((ends[last + 1].0 + surface.reach[1], ends[last + 1].1));
        for pair in ends.windows(2) {
            let [from, to] = [0, 1].map(|k| x(pair[k].0, pair[k].1));
            if !(from <= at && at < to) {
                continue;
            }
            let share = (at - from) / (to - from);
            let nearness = pair[0].1 + share * (pair[1].1 - pair[0].1);
            if best.is_none_or(|(least, _)| nearness > least) {
                let place = pair[0].0 + share * (pair[1].0 - pair[0].0);
                best = Some((
                    nearness,
                    Seen {
                        surface: number,
                        place,
                    },
                ));
            }
        }
    }
    best.map(|(_, seen)| seen)
}

/// The surfaces of a row, their colours taken apart where they meet.
fn surfaces(depth: &[f32], colour: &[[f32; 3]]) -> Vec<Surface> {
    let nearness: Vec<f64> = depth.iter().map(|z| 1.0 / f64::from(*z)).collect();
    let given: Vec<DVec3> = colour
        .iter()
        .map(|c| DVec3::from_array(c.map(f64::from)))
        .collect();
    let mut own = given.clone();
    let is_linked = |left: usize| {
        let (a, b) = (nearness[left], nearness[left + 1]);
        (a - b).abs() <= TOLERANCE * a.min(b)
    };
    let cuts: Vec<usize> = (1..depth.len())
        .filter(|&right| !is_linked(right - 1))
        .collect();
    let mut reaches = vec![[0.5; 2]; depth.len()];
    for &right in &cuts {
        let left = right - 1;
        if nearness[left].is_nan() || nearness[right].is_nan() {
            // A surface ends half way to a sample of unknown depth, plus the overlap that the farther surface has.
            let behind = usize::from(!(nearness[left] < nearness[right]));
            reaches[[left, right][behind]][1 - behind] += BEHIND;
            continue;
        }
        let inside = [
            if left > 0 && is_linked(left - 1) {
                left - 1
            } else {
                left
            },
            if right + 1 < depth.len() && is_linked(right) {
                right + 1
            } else {
                right
            },
        ];
        let pure = inside.map(|i| {
            if i == inside[0] && i != left {
                own[i]
            } else {
                given[i]
            }
        });
        let across = pure[1] - pure[0];
        let (mut of_right, mut of_left) = (0.0, 0.0);
        if across.length_squared() >= CONTRAST2 {
            let share = |v: DVec3| (v.dot(across) / across.length_squared()).clamp(0.0, 0.5);
            of_right = share(given[left] - pure[0]);
            of_left = share(pure[1] - given[right]);
            own[left] = (own[left] - of_right * across).max(DVec3::ZERO);
            own[right] = (own[right] + of_left * across).max(DVec3::ZERO);
        }
        let place = 0.5 - of_right + of_left;
        let behind = match nearness[left] < nearness[right] {
            true => [BEHIND, 0.0],
            false => [0.0, BEHIND],
        };
        reaches[left][1] = place + behind[0];
        reaches[right][0] = 1.0 - place + behind[1];
    }
    let firsts = [0].into_iter().chain(cuts.iter().copied());
    let ends = cuts.iter().copied().chain([depth.len()]);
    let surface = |(first, end): (usize, usize)| Surface {
        first,
        nearness: nearness[first..end].to_vec(),
        spline: spline(&own[first..end]),
        reach: [reaches[first][0], reaches[end - 1][1]],
    };
    let is_known = |surface: &Surface| !surface.nearness[0].is_nan();
    firsts.zip(ends).map(surface).filter(is_known).collect()
}

/// A number brought into a line that is mirrored at its ends.
fn mirrored(i: isize, count: usize) -> usize {
    let last = count as isize - 1;
    match last {
        0 => 0,
        _ => (last - (i.rem_euclid(2 * last) - last).abs()) as usize,
    }
}

/// The coefficients of the cubic spline through the values of a line that is mirrored at its ends, by Gauss-Seidel.
fn spline(values: &[DVec3]) -> Vec<DVec3> {
    let count = values.len();
    let mut found = values.to_vec();
    for _ in 0..80 {
        for i in 0..count as isize {
            let beside = found[mirrored(i - 1, count)] + found[mirrored(i + 1, count)];
            found[i as usize] = (6.0 * values[i as usize] - beside) / 4.0;
        }
    }
    match count {
        1 => values.to_vec(),
        _ => found,
    }
}

impl Surface {
    /// The colour at a place of the row; beyond the ends that of the ends.
    fn colour(&self, place: f64) -> DVec3 {
        let count = self.spline.len();
        let at = (place - self.first as f64).clamp(0.0, (count - 1) as f64);
        let basis = |t: f64| match t.abs() {
            t if t < 1.0 => (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
            t if t < 2.0 => (2.0 - t).powi(3) / 6.0,
            _ => 0.0,
        };
        let first = at.floor() as isize - 1;
        (first..first + 4)
            .map(|i| basis(at - i as f64) * self.spline[mirrored(i, count)])
            .sum()
    }
}
