//! The fixed cost of a frame, estimated from coarse pictures and their windows.
//!
//! A window has the same fixed cost as the whole picture, since every brick or triangle is visited first. The counts do
//! not include that part, and in windows of a small picture it may be most of the time. Two sums give it: whole pictures
//! and windows take a fixed time each and, beside it, the same time per count.

/// Coarse pictures, and their windows.
#[derive(Clone, Debug, Default)]
pub(super) struct FixedCost {
    pub(super) whole: Sum,
    pub(super) windows: Sum,
}

/// Sums over pictures or windows.
#[derive(Clone, Debug, Default)]
pub(super) struct Sum {
    number: f64,
    cpu_ms: f64,
    /// By the model, what depends on the counts.
    growing_ms: f64,
}

/// Most of a window's time that is taken for fixed. A guess, so that a disturbed clock leaves a part that grows.
const MOST_FIXED: f64 = 0.9;

impl Sum {
    /// Adds a picture or a window: its CPU time, and the part of it that depends on its counts, by the model.
    pub(super) fn add(&mut self, cpu_ms: f64, growing_ms: f64) {
        self.number += 1.0;
        self.cpu_ms += cpu_ms;
        self.growing_ms += growing_ms;
    }
}

impl FixedCost {
    /// CPU time of each picture or window that its counts do not explain, ms; 0 where no windows were drawn.
    pub(super) fn fixed_ms(&self) -> f64 {
        let Self { whole, windows } = self;
        // number * fixed + growing * factor = time, for both.
        let determinant = windows.number * whole.growing_ms - whole.number * windows.growing_ms;
        if !(determinant > 0.0) {
            return 0.0;
        }
        let fixed =
            (windows.cpu_ms * whole.growing_ms - whole.cpu_ms * windows.growing_ms) / determinant;
        fixed.clamp(0.0, MOST_FIXED * windows.cpu_ms / windows.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(number: f64, growing_ms: f64, [fixed, factor]: [f64; 2]) -> Sum {
        Sum {
            number,
            cpu_ms: number * fixed + factor * growing_ms,
            growing_ms,
        }
    }

    #[test]
    fn the_fixed_part_is_found() {
        for parts in [[0.5, 2.0], [0.0, 1.0], [3.0, 0.5]] {
            let costs = FixedCost {
                whole: sum(8.0, 80.0, parts),
                windows: sum(48.0, 20.0, parts),
            };
            let most = MOST_FIXED * costs.windows.cpu_ms / 48.0;
            let found = costs.fixed_ms();
            assert!(
                (found - parts[0].min(most)).abs() < 1e-12,
                "{parts:?}: {found}"
            );
        }
        assert_eq!(
            FixedCost {
                whole: sum(8.0, 80.0, [1.0; 2]),
                windows: Sum::default()
            }
            .fixed_ms(),
            0.0
        );
    }
}
