//! The search: which rungs of a ladder are tried, and which of them is taken.
//!
//! The error falls along the ladder and the cost rises, so halving finds the rung that just keeps the bound.
//! A rung that its judge does not think worth a try counts as too dear. Of the tried rungs that are good enough, the cheapest
//! is taken (or, for a time, the most exact).

use anyhow::Result;

use super::ladder::Rung;
use crate::setting::Setting;

/// A setting that was tried.
#[derive(Clone, Debug)]
pub(super) struct Tried {
    pub(super) setting: Setting,
    /// The predicted error of the worst picture.
    pub(super) error: f64,
    /// Its predicted time, ms; for a bound on the error by a model that is the same everywhere.
    pub(super) cost_ms: f64,
    /// Whether it keeps the bound.
    pub(super) keeps: Keeps,
}

/// Whether a setting keeps the bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Keeps {
    Yes,
    No,
}

/// The goal of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Goal {
    /// The least cost that keeps a bound on the error.
    LeastCost,
    /// The least error that keeps a bound on the time.
    LeastError,
}

/// Tries a rung; `None` where that is not worth its cost.
pub(super) type Judge<'a> = dyn FnMut(&Rung) -> Result<Option<Tried>> + 'a;

/// The rungs that were tried.
pub(super) fn tried(rungs: &[Rung], goal: Goal, judge: &mut Judge) -> Result<Vec<Tried>> {
    let mut all = Vec::new();
    let (mut low, mut high) = (0, rungs.len());
    while low < high {
        let middle = (low + high) / 2;
        let found = judge(&rungs[middle])?;
        // A rung that keeps an error may do with less; one that does not needs more. For a time it is the other way.
        let more = match (&found, goal) {
            (None, _) => false,
            (Some(found), Goal::LeastCost) => found.keeps == Keeps::No,
            (Some(found), Goal::LeastError) => found.keeps == Keeps::Yes,
        };
        if more {
            low = middle + 1;
        } else {
            high = middle;
        }
        all.extend(found);
    }
    Ok(all)
}

/// The best of those that keep the bound.
pub(super) fn best(goal: Goal, tried: &[Tried]) -> Option<&Tried> {
    let good = tried.iter().filter(|t| t.keeps == Keeps::Yes);
    match goal {
        Goal::LeastCost => good.min_by(|a, b| a.cost_ms.total_cmp(&b.cost_ms)),
        // Of equal errors the cheaper one.
        Goal::LeastError => good.min_by(|a, b| {
            a.error
                .total_cmp(&b.error)
                .then(a.cost_ms.total_cmp(&b.cost_ms))
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rungs() -> Vec<Rung> {
        let rung = |k: u32| Rung {
            setting: Setting::mesh(&["subpixels"], |options| options.subpixels = k),
            cost: f64::from(k),
        };
        (1..=8).map(rung).collect()
    }

    /// Costs are 1 to 8, errors the inverse; rungs above `affordable` are not tried.
    fn search(goal: Goal, bound: f64, affordable: f64) -> (Option<f64>, usize) {
        let all = tried(&rungs(), goal, &mut |rung| {
            let keeps = match goal {
                Goal::LeastCost => 1.0 / rung.cost <= bound,
                Goal::LeastError => rung.cost <= bound,
            };
            Ok((rung.cost <= affordable).then(|| Tried {
                setting: rung.setting.clone(),
                error: 1.0 / rung.cost,
                cost_ms: rung.cost,
                keeps: if keeps { Keeps::Yes } else { Keeps::No },
            }))
        });
        let all = all.expect("no error");
        (best(goal, &all).map(|found| found.cost_ms), all.len())
    }

    #[test]
    fn halving_finds_the_best_rung() {
        for (bound, cost) in [(1.0, 1.0), (0.5, 2.0), (0.3, 4.0), (0.125, 8.0)] {
            let (found, tries) = search(Goal::LeastCost, bound, 9.0);
            assert_eq!(found, Some(cost), "the cheapest under {bound}");
            assert!(tries <= 4, "{tries} tries of 8");
        }
        assert_eq!(
            search(Goal::LeastCost, 0.1, 9.0).0,
            None,
            "no rung is exact enough"
        );
        for (bound, cost) in [(8.5, 8.0), (3.0, 3.0), (1.0, 1.0)] {
            assert_eq!(search(Goal::LeastError, bound, 9.0).0, Some(cost));
        }
        assert_eq!(
            search(Goal::LeastCost, 0.5, 2.5).0,
            Some(2.0),
            "below what is too dear"
        );
    }
}
