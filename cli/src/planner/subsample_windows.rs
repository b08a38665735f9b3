//! Fewer windows, where they hold more of a picture's work than of its area.
//!
//! Windows stand where contrast is, and the work is there too: the windows of a sparse volume may take three times the
//! share of their area. The counts of the coarse picture and of its windows give their share of a picture; draws are left
//! out first, then whole pictures, until the run can afford the rest.

use super::look::{Effort, include, least_views, places};
use super::model::{Counts, Model, Work};
use crate::opened::Parts;

/// Share of the exact run that the windows may take under the exact setting. The tries of a search that finds something
/// take about a third of that beside: together they stay under the budget of planning ([`super::budget`]).
const MOST_SHARE: f64 = 0.07;

/// The work of all windows under the exact setting is kept below this.
pub(super) struct Limit {
    /// The kind of work of the exact setting.
    kind: String,
    /// In pictures.
    most: f64,
}

/// A view, as far as leaving it out is concerned.
#[derive(Clone, Copy, Debug)]
pub(super) struct ViewShare {
    /// The share of a picture that its windows take.
    pub(super) share: f64,
    /// Contrast per covered pixel.
    pub(super) contrast: f64,
}

impl Limit {
    pub(super) fn new(kind: String, (pictures, effort): (usize, Effort)) -> Self {
        let most = match effort {
            Effort::Affordable => MOST_SHARE * pictures as f64,
            Effort::Any => f64::INFINITY,
        };
        Self { kind, most }
    }

    /// The work of a picture with these counts under the exact setting.
    pub(super) fn work(&self, counts: Counts) -> Work {
        Work {
            kind: self.kind.clone(),
            counts,
        }
    }

    /// The share of a picture that its windows take, by the counts of the coarse picture and of its windows.
    pub(super) fn share(&self, model: &Model, whole: Counts, windows: &[Counts]) -> f64 {
        let whole = self.work(whole);
        let fixed = model.fixed_share(&whole);
        let growing = windows
            .iter()
            .map(|&counts| model.growing_ms(&self.work(counts)));
        let all = model.growing_ms(&whole).max(f64::MIN_POSITIVE);
        growing.sum::<f64>() / all * (1.0 - fixed) + fixed * windows.len() as f64
    }

    /// How many draws can be afforded where views with all of them take `share` of a picture, but no fewer than parts of
    /// a picture need.
    pub(super) fn draws(&self, share: f64, parts: Parts, draws: usize) -> usize {
        match parts {
            Parts::Windows { least, .. } if share > self.most => {
                ((draws as f64 * self.most / share) as usize).clamp(least.min(draws), draws)
            }
            _ => draws,
        }
    }

    /// The views that can be afforded, the one with the most contrast among them; `None` where too few can.
    pub(super) fn kept(&self, views: &[ViewShare], pictures: usize) -> Option<Vec<usize>> {
        let mut kept: Vec<usize> = (0..views.len()).collect();
        while kept.iter().map(|&view| views[view].share).sum::<f64>() > self.most {
            let least = least_views(pictures);
            if kept.len() <= least {
                return None;
            }
            let mut fewer: Vec<usize> = places(kept.len(), (kept.len() / 2).max(least));
            let contrast = |&place: &usize| views[kept[place]].contrast;
            if let Some(most) = (0..kept.len()).max_by(|a, b| contrast(a).total_cmp(&contrast(b))) {
                include(&mut fewer, most);
            }
            kept = fewer.into_iter().map(|place| kept[place]).collect();
        }
        Some(kept)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::model::COUNTS;
    use super::*;

    fn counts(pairs: f64) -> Counts {
        let mut counts = [0.0; COUNTS];
        (counts[0], counts[2]) = (1.0, pairs);
        counts
    }

    fn limit(pictures: usize, effort: Effort) -> Limit {
        Limit::new("volsplat x".into(), (pictures, effort))
    }

    /// Eight views whose windows hold six tenths of the work; the sixth has the most contrast.
    fn kept(pictures: usize) -> Option<Vec<usize>> {
        let view = |place: usize| ViewShare {
            share: 0.6,
            contrast: if place == 5 { 2.0 } else { 1.0 },
        };
        let views: Vec<ViewShare> = (0..8).map(view).collect();
        limit(pictures, Effort::Affordable).kept(&views, pictures)
    }

    #[test]
    fn pictures_are_left_out_until_the_rest_can_be_afforded() {
        assert_eq!(
            kept(100).map(|kept| kept.len()),
            Some(8),
            "4.8 of 7 pictures"
        );
        let short = kept(64).expect("2.4 of 4.5 pictures");
        assert!(short.len() == 4 && short.contains(&5), "{short:?}");
        assert_eq!(kept(8), None, "two views would take 1.2 of 0.6 pictures");
    }

    #[test]
    fn draws_are_left_out_first_but_not_below_the_least() {
        let parts = Parts::Windows {
            side_px: 16,
            least: 6,
            guard_px: 0,
        };
        let draws = |share| limit(1, Effort::Affordable).draws(share, parts, 18);
        assert_eq!((draws(0.05), draws(0.1), draws(0.6)), (18, 12, 6));
        assert_eq!(
            limit(1, Effort::Any).draws(0.6, parts, 18),
            18,
            "at any cost"
        );
    }

    #[test]
    fn windows_count_by_their_work_and_by_the_fixed_cost_of_each() {
        // A frame costs 1 ms, a tile pair a tenth.
        let coefficients = [1.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0];
        let model = Model {
            cpu_ms: BTreeMap::from([("volsplat x".to_owned(), coefficients)]),
            wall_per_cpu: BTreeMap::new(),
        };
        let limit = limit(10, Effort::Affordable);
        let share = limit.share(&model, counts(90.0), &[counts(30.0), counts(15.0)]);
        assert!(
            (share - (0.5 * 0.9 + 2.0 * 0.1)).abs() < 1e-12,
            "half of the work and two frames: {share}"
        );
    }
}
