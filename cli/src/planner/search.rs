//! The search: which settings are tried, and which of them is taken.
//!
//! Two ladders of a way make a grid whose error falls and whose cost rises along both. So the settings that just keep a
//! bound lie along a staircase, which is walked from the corner of the cheapest rung of the one and the most exact of the
//! other, at one try a step. One ladder is climbed down for an error, so that the first try is the likeliest to save
//! something, and up for a time. A walk ends where its judge does not think the next try worth its cost. Of what was
//! tried and is good enough, the cheapest is taken (or, for a time, the most exact).

use anyhow::Result;

use super::ladders::{Family, Ladder, Way};

/// A setting that was tried.
#[derive(Clone, Debug)]
pub(super) struct Tried {
    /// Words, names and values in turn.
    pub(super) setting: Vec<String>,
    /// The predicted error of the worst picture.
    pub(super) error: f64,
    /// What it is predicted to take, ms; of a bound on the error, by a model that is the same everywhere.
    pub(super) cost_ms: f64,
    /// Whether it keeps what was asked for.
    pub(super) keeps: Keeps,
}

/// Whether a setting keeps what was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Keeps {
    Yes,
    No,
}

/// What is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Goal {
    /// The least cost that keeps a bound on the error.
    LeastCost,
    /// The least error that keeps a bound on the time.
    LeastError,
}

/// What proven bounds with a share of the error usually cost, of the exact ones (trade of volumes: 0.3 to 0.73).
const PROVEN_COST: f64 = 0.7;

/// A setting that may be tried.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) setting: Vec<String>,
    /// What it usually costs, of the exact setting.
    pub(super) cost: f64,
}

/// Tries a setting; `None` where that is not worth its cost.
pub(super) type Judge<'a> = dyn FnMut(Candidate) -> Result<Option<Tried>> + 'a;

/// Tries settings of all ways; `extra` words go with each. The last way is the most exact one and is walked as a whole;
/// of the others only rungs up to the best of it are tried, because more of them would cost more than it does.
pub(super) fn tried(
    family: &Family,
    (goal, extra): (Goal, &[String]),
    judge: &mut Judge,
) -> Result<Vec<Tried>> {
    let Some((last, others)) = family.ways.split_last() else {
        return Ok(Vec::new());
    };
    let mut all = match goal {
        Goal::LeastCost if last.ladders.len() < 2 => descent(last, extra, judge)?,
        Goal::LeastCost | Goal::LeastError => staircase(last, (goal, extra), judge)?,
    };
    // Where the last way has nothing cheaper than the exact setting, the others are even less exact.
    let others = if goal == Goal::LeastCost && best(goal, &all).is_none() {
        &[]
    } else {
        others
    };
    for way in others {
        // A way beside others has one ladder, or none.
        let rung_of = |t: &Tried| {
            way.ladders
                .first()
                .and_then(|ladder| rung(ladder, &t.setting))
        };
        let mut next = best(goal, &all).and_then(rung_of).unwrap_or(0);
        while let Some(found) = judge(candidate(way, [next, 0], extra))? {
            let keeps = found.keeps;
            all.push(found);
            // What keeps an error may do with less; what takes too long must.
            let go_on = (goal == Goal::LeastCost) == (keeps == Keeps::Yes);
            if !go_on || next == 0 {
                break;
            }
            next -= 1;
        }
    }
    Ok(all)
}

/// Tries the settings of a way with one ladder or none, from the most exact down, until one does not keep the bound.
fn descent(way: &Way, extra: &[String], judge: &mut Judge) -> Result<Vec<Tried>> {
    let mut all = Vec::new();
    let rungs = way.ladders.first().map_or(1, |ladder| ladder.rungs.len());
    // The last rung without other words is the exact setting.
    let tops = if extra.is_empty() { rungs - 1 } else { rungs };
    for rung in (0..tops).rev() {
        let Some(found) = judge(candidate(way, [rung, 0], extra))? else {
            break;
        };
        let keeps = found.keeps;
        all.push(found);
        if keeps == Keeps::No {
            break;
        }
    }
    Ok(all)
}

/// Tries the settings of a way along the border between those that keep the bound and those that do not.
fn staircase(way: &Way, (goal, extra): (Goal, &[String]), judge: &mut Judge) -> Result<Vec<Tried>> {
    let mut all = Vec::new();
    let lengths = [0, 1].map(|k| way.ladders.get(k).map_or(1, |ladder| ladder.rungs.len()));
    let (mut low, mut high) = (0, lengths[1]);
    while low < lengths[0] && high > 0 {
        let Some(found) = judge(candidate(way, [low, high - 1], extra))? else {
            break;
        };
        // What keeps the bound may do with less; what does not needs more.
        let more = match goal {
            Goal::LeastCost => found.keeps == Keeps::No,
            Goal::LeastError => found.keeps == Keeps::Yes,
        };
        if more {
            low += 1
        } else {
            high -= 1
        }
        all.push(found);
    }
    Ok(all)
}

/// The rung of a ladder that a setting stands on.
fn rung(ladder: &Ladder, setting: &[String]) -> Option<usize> {
    let value = setting
        .chunks(2)
        .find(|pair| pair[0] == ladder.option)?
        .get(1)?;
    ladder.rungs.iter().position(|rung| rung == value)
}

/// The best of what keeps the bound.
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

fn candidate(way: &Way, rungs: [usize; 2], extra: &[String]) -> Candidate {
    let climbed = way
        .ladders
        .iter()
        .zip(rungs)
        .flat_map(|(ladder, rung)| [ladder.option, ladder.rungs[rung]]);
    let words = way
        .words
        .iter()
        .cloned()
        .chain(climbed.map(str::to_owned))
        .chain(extra.iter().cloned());
    let proven = if extra.is_empty() { 1.0 } else { PROVEN_COST };
    Candidate {
        setting: words.collect(),
        cost: proven * way.cost(rungs),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::ladders;

    /// Error and cost of a grid where both ladders count alike.
    fn judge(goal: Goal, bound: f64) -> impl FnMut(Candidate) -> Result<Option<Tried>> {
        move |Candidate { setting, .. }| {
            let value = |name: &str| -> f64 {
                let at = setting
                    .iter()
                    .position(|word| word == name)
                    .expect("both ladders");
                setting[at + 1].parse().expect("a number")
            };
            let (slab, subpixel) = (value("--slab"), value("--subpixel"));
            let (error, cost_ms) = (slab * slab + 1.0 / subpixel, subpixel * subpixel / slab);
            let keeps = match goal {
                Goal::LeastCost => error <= bound,
                Goal::LeastError => cost_ms <= bound,
            };
            Ok(Some(Tried {
                setting,
                error,
                cost_ms,
                keeps: if keeps { Keeps::Yes } else { Keeps::No },
            }))
        }
    }

    fn search(goal: Goal, bound: f64) -> (Tried, usize) {
        let words = ladders::owned(&["volsplat", "a.nrrd", "-o", "b.png"]);
        let command = crate::words::parsed(&words).expect("good").command;
        let family = ladders::family(&command, &words);
        let all = tried(&family, (goal, &[]), &mut judge(goal, bound)).expect("no error");
        (
            best(goal, &all).expect("something keeps it").clone(),
            all.len(),
        )
    }

    #[test]
    fn the_staircase_finds_the_best_of_the_whole_grid() {
        let (slabs, subpixels) = ([2.0, 1.0, 0.5, 0.25, 0.125], [1.0_f64, 2.0, 4.0, 8.0]);
        let grid = || {
            slabs
                .iter()
                .flat_map(|s: &f64| subpixels.iter().map(move |n| (s * s + 1.0 / n, n * n / s)))
        };
        for bound in [0.2, 0.4, 1.0, 3.0] {
            let (found, tries) = search(Goal::LeastCost, bound);
            let least = grid()
                .filter(|(e, _)| *e <= bound)
                .map(|(_, c)| c)
                .fold(f64::INFINITY, f64::min);
            assert_eq!(found.cost_ms, least, "the cheapest under {bound}");
            assert!(tries <= 8, "{tries} tries of 20");
        }
        for bound in [1.0, 4.0, 40.0] {
            let (found, _) = search(Goal::LeastError, bound);
            let least = grid()
                .filter(|(_, c)| *c <= bound)
                .map(|(e, _)| e)
                .fold(f64::INFINITY, f64::min);
            assert_eq!(found.error, least, "the most exact within {bound}");
        }
    }
}
