//! The motion that the camera's own movement gives to things at rest: a smooth function of place and inverse depth.
//!
//! Takes motion and inverse depth at places on the screen, gives the function that most of them follow. To first order in time the camera's turn moves a place by
//! a quadratic function of it, and its way by inverse depth times a linear one (Longuet-Higgins and Prazdny 1980, equations 2.6 to 2.8).
//! The fit averages thousands of places, so its error is small: a sample that is hidden for many pictures drifts less than along its neighbours' motion.

use glam::Vec2;

/// Terms: 1, x, y, x^2, xy, y^2, and inverse depth times 1, x, y.
const TERMS: usize = 9;

/// Rounds of weights: in the first half the camera moves sideways alone, so that no curve bends towards things that move by themselves.
const ROUNDS: usize = 12;

/// The terms of a camera that moves sideways: 1, and inverse depth.
const SIDEWAYS: [usize; 2] = [0, 6];

/// Most places that are looked at.
const PLACES: usize = 6_000;

/// A place follows the camera if its motion is as near as this, px of the picture in which it was found.
const NEAR_PX: f32 = 0.35;

/// Least share of the places that must follow it.
const LEAST_SHARE: f64 = 0.6;

/// The motion of things at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ego {
    x: [f64; TERMS],
    y: [f64; TERMS],
    width: f64,
    height: f64,
    /// The largest inverse depth.
    scale: f64,
}

/// A place, its inverse depth, and its motion.
pub(crate) type Moved = ([usize; 2], f32, Vec2);

impl Ego {
    /// The motion that most places follow; none if they follow none.
    pub(crate) fn of(places: &[Moved], [width, height]: [usize; 2]) -> Option<Self> {
        let step = (places.len() / PLACES).max(1);
        let places: Vec<Moved> = places.iter().copied().step_by(step).collect();
        let largest = places.iter().map(|place| place.1).fold(0.0, f32::max);
        if places.len() < 10 * TERMS || !(largest > 0.0) {
            return None;
        }
        let mut ego = Self {
            x: [0.0; TERMS],
            y: [0.0; TERMS],
            width: width as f64,
            height: height as f64,
            scale: f64::from(largest),
        };
        let mut weights = vec![1.0f64; places.len()];
        let mut follow = 0;
        for round in 0..ROUNDS {
            let fitted = ego.fitted(&places, &weights, round < 3)?;
            (ego.x, ego.y) = fitted;
            follow = 0;
            for (weight, &(at, nearness, way)) in weights.iter_mut().zip(&places) {
                let apart = (ego.way(at, nearness) - way).length();
                follow += usize::from(apart <= NEAR_PX);
                // Cauchy's weights: places that follow something else count ever less.
                *weight = 1.0 / (1.0 + f64::from(apart / NEAR_PX).powi(2) * 4.0);
            }
        }
        (follow as f64 >= LEAST_SHARE * places.len() as f64).then_some(ego)
    }

    /// The motion of a thing at rest at a place, px.
    pub(crate) fn way(&self, at: [usize; 2], nearness: f32) -> Vec2 {
        let terms = self.terms(at, nearness);
        let sum =
            |factors: &[f64; TERMS]| terms.iter().zip(factors).map(|(t, f)| t * f).sum::<f64>();
        glam::DVec2::new(sum(&self.x), sum(&self.y)).as_vec2()
    }

    fn terms(&self, [x, y]: [usize; 2], nearness: f32) -> [f64; TERMS] {
        let x = 2.0 * (x as f64 + 0.5) / self.width - 1.0;
        let y = 2.0 * (y as f64 + 0.5) / self.height - 1.0;
        let q = f64::from(nearness) / self.scale;
        [1.0, x, y, x * x, x * y, y * y, q, q * x, q * y]
    }

    /// Weighted least squares; a small ridge keeps the system solvable where terms depend on each other.
    fn fitted(
        &self,
        places: &[Moved],
        weights: &[f64],
        sideways: bool,
    ) -> Option<([f64; TERMS], [f64; TERMS])> {
        let mut matrix = [[0.0; TERMS]; TERMS];
        let (mut right_x, mut right_y) = ([0.0; TERMS], [0.0; TERMS]);
        let mut total = 0.0;
        for (&(at, nearness, way), &weight) in places.iter().zip(weights) {
            let terms = self.terms(at, nearness);
            for (row, &a) in matrix.iter_mut().zip(&terms) {
                for (value, &b) in row.iter_mut().zip(&terms) {
                    *value += weight * a * b;
                }
            }
            for (index, &a) in terms.iter().enumerate() {
                right_x[index] += weight * a * f64::from(way.x);
                right_y[index] += weight * a * f64::from(way.y);
            }
            total += weight;
        }
        for (index, row) in matrix.iter_mut().enumerate() {
            let left_out = sideways && !SIDEWAYS.contains(&index);
            row[index] += total * if left_out { 1e6 } else { 1e-6 };
        }
        let x = solved(matrix, right_x)?;
        Some((x, solved(matrix, right_y)?))
    }
}

/// The solution of a symmetric positive system, by Gaussian elimination.
fn solved(mut matrix: [[f64; TERMS]; TERMS], mut right: [f64; TERMS]) -> Option<[f64; TERMS]> {
    for pivot in 0..TERMS {
        let divisor = matrix[pivot][pivot];
        if !(divisor > 0.0) {
            return None;
        }
        let above = matrix[pivot];
        for row in pivot + 1..TERMS {
            let factor = matrix[row][pivot] / divisor;
            for (value, above) in matrix[row].iter_mut().zip(&above) {
                *value -= factor * above;
            }
            right[row] -= factor * right[pivot];
        }
    }
    for row in (0..TERMS).rev() {
        let known: f64 = (row + 1..TERMS)
            .map(|column| matrix[row][column] * right[column])
            .sum();
        right[row] = (right[row] - known) / matrix[row][row];
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_is_found_behind_what_moves_by_itself() {
        let (width, height) = (160usize, 90usize);
        let truth = |x: f32, y: f32, q: f32| {
            Vec2::new(0.4 + 1.5 * q + 0.002 * x, -0.2 + 0.3 * q - 0.001 * y)
        };
        let places: Vec<Moved> = (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let q = 0.2 + 0.5 * ((x / 20 + y / 15) % 3) as f32 / 2.0;
                let noise = 0.05 * ((i as f32 * 0.618).fract() - 0.5);
                let own = if x > 110 {
                    Vec2::new(6.0, 0.0)
                } else {
                    Vec2::ZERO
                };
                (
                    [x, y],
                    q,
                    truth(x as f32, y as f32, q) + own + Vec2::splat(noise),
                )
            })
            .collect();
        let ego = Ego::of(&places, [width, height]).expect("most follow the camera");
        let mut worst = 0f32;
        for &([x, y], q, _) in places.iter().filter(|place| place.0[0] <= 110) {
            worst = worst.max((ego.way([x, y], q) - truth(x as f32, y as f32, q)).length());
        }
        assert!(worst < 0.05, "{worst} px");
        assert_eq!(Ego::of(&places[..20], [width, height]), None);
        let wild: Vec<Moved> = places
            .iter()
            .enumerate()
            .map(|(i, &(at, q, _))| {
                (
                    at,
                    q,
                    Vec2::new((i as f32 * 0.618).fract(), (i as f32 * 0.414).fract()) * 20.0,
                )
            })
            .collect();
        assert_eq!(Ego::of(&wild, [width, height]), None, "nothing in common");
    }
}
