//! The budget of planning: a small share of the exact run, and beyond that only what planning has saved already.
//!
//! Counted in milliseconds of the built-in model, which reads no clock. At any time, the sum of past tries, the next try and the
//! whole run under the best setting so far stay under the cost of the exact run and that share: so a run with
//! `--max-error` is never much dearer than the exact one, however the tries end.

/// Largest share of the exact run that planning may lose. A tenth is promised; the rest is for what the model does not know.
const MOST_LOSS: f64 = 0.095;

/// Costs of the exact run, and of the best one so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    /// Pictures of the run.
    pub(super) pictures: f64,
    /// Cost of a picture under the exact setting.
    pub(super) exact_ms: f64,
    /// Cost of a picture under the best setting that keeps the bound.
    pub(super) best_ms: f64,
    /// Cost of all windows under the exact setting.
    pub(super) windows_ms: f64,
}

impl Budget {
    /// Whether a setting of usual `cost`, of the exact one, is worth a try after `spent_ms`.
    pub(super) fn affords(&self, cost: f64, spent_ms: f64) -> bool {
        let try_ms = cost * self.windows_ms;
        let run_ms = self.pictures * self.best_ms;
        let most_ms = (1.0 + MOST_LOSS) * self.pictures * self.exact_ms;
        let won_ms = run_ms - self.pictures * cost * self.exact_ms;
        spent_ms + try_ms + run_ms <= most_ms && won_ms > try_ms
    }

    /// Takes note of a setting that keeps the bound.
    pub(super) fn won(&mut self, frame_ms: f64) {
        self.best_ms = self.best_ms.min(frame_ms);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_try_needs_what_it_costs_and_something_to_win() {
        let mut budget = Budget {
            pictures: 10.0,
            exact_ms: 10.0,
            best_ms: 10.0,
            windows_ms: 5.0,
        };
        assert!(budget.affords(0.5, 6.0), "2.5 after 6 of 9.5");
        assert!(!budget.affords(0.5, 7.5), "2.5 after 7.5 of 9.5");
        assert!(!budget.affords(1.0, 0.0), "nothing to win");
        budget.won(5.0);
        assert!(budget.affords(0.4, 40.0), "half of the run was saved");
        assert!(!budget.affords(0.48, 0.0), "2.4 to win 2");
    }
}
