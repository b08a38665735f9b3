//! Fewer windows, where they hold more of a picture's work than of its area.
//!
//! Windows stand where contrast is, and there the work is too: those of a sparse volume may take three times what their
//! area tells. The counts of the coarse picture and of its windows tell what share of a picture they take; draws are left
//! out first, then whole pictures, until the run can afford the rest.

use super::super::look::{Effort, least_views};
use super::{Pilot, places};
use crate::commands::Parts;
use crate::planner::model::{Counts, Model};

/// Share of the exact run that the windows may take under the exact setting. The tries of a search that finds something take
/// about a third of that beside: together they stay under what planning may lose ([`crate::planner::purse`]).
const MOST_SHARE: f64 = 0.07;

/// What all windows may take under the exact setting.
pub(super) struct Limit {
    /// The kind of work of the exact setting.
    pub(super) path: String,
    /// In pictures.
    most: f64,
}

impl Limit {
    pub(super) fn new(path: String, (pictures, effort): (usize, Effort)) -> Self {
        let most = match effort {
            Effort::Affordable => MOST_SHARE * pictures as f64,
            Effort::Any => f64::INFINITY,
        };
        Self { path, most }
    }

    /// What windows take of a picture, by the counts of the coarse picture and of its windows.
    fn share(&self, model: &Model, (whole, windows): (&Counts, &[Counts])) -> f64 {
        let fixed = model.fixed_share(&self.path, whole);
        let own: f64 = windows
            .iter()
            .map(|counts| model.growing_ms(&self.path, counts))
            .sum();
        let all = model.growing_ms(&self.path, whole).max(f64::MIN_POSITIVE);
        own / all * (1.0 - fixed) + fixed * windows.len() as f64
    }
}

impl Pilot {
    /// How many of the draws of one of `views` pictures can be afforded, but no fewer than parts of a picture need.
    pub(super) fn affordable_draws(
        &self,
        views: usize,
        counts: (&Counts, &[Counts]),
        (parts, draws): (Parts, usize),
    ) -> usize {
        let limit = &self.limit;
        let share = limit.share(&self.model, counts) * views as f64;
        match parts {
            Parts::Windows { least, .. } if share > limit.most => {
                ((draws as f64 * limit.most / share) as usize).clamp(least.min(draws), draws)
            }
            _ => draws,
        }
    }

    /// Leaves out pictures until the windows can be afforded; whether they can.
    pub(super) fn thinned(&mut self) -> bool {
        loop {
            let limit = &self.limit;
            let coarse = self.views.iter().filter_map(|view| view.coarse.as_ref());
            let share: f64 = coarse
                .map(|(whole, windows)| limit.share(&self.model, (whole, windows.as_slice())))
                .sum();
            if share <= limit.most {
                return true;
            }
            let (all, least) = (self.views.len(), least_views(self.pictures));
            if all <= least {
                return false;
            }
            let mut kept = places(all, (all / 2).max(least));
            let unrest = |&view: &usize| self.views[view].unrest;
            if let Some(worst) = (0..all).max_by(|a, b| unrest(a).total_cmp(&unrest(b))) {
                include(&mut kept, worst);
            }
            let mut place = 0;
            self.views.retain(|_| {
                place += 1;
                kept.contains(&(place - 1))
            });
        }
    }
}

/// Puts a place into a list, instead of the nearest one.
pub(super) fn include(list: &mut [usize], place: usize) {
    if let Some(nearest) = list.iter_mut().min_by_key(|other| other.abs_diff(place)) {
        *nearest = place;
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use glam::DVec3;
    use resample_core::{Camera, Image, LookAt};

    use super::super::{Took, View};
    use super::*;
    use crate::planner::model::COUNTS;
    use crate::planner::windows;

    fn counts(pairs: f64) -> Counts {
        let mut counts = [0.0; COUNTS];
        (counts[0], counts[2]) = (1.0, pairs);
        counts
    }

    /// A kind of work that costs its tile pairs, and `frame_ms` a frame.
    fn model(frame_ms: f64) -> Model {
        let coefficients = [frame_ms, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0];
        let cpu_ms = BTreeMap::from([("volsplat x".to_owned(), coefficients)]);
        Model {
            cpu_ms,
            wall_per_cpu: BTreeMap::new(),
        }
    }

    /// Eight views of a sequence, whose windows hold six tenths of the work; the sixth has the most contrast.
    fn pilot(pictures: usize, effort: Effort) -> Pilot {
        let pose = LookAt {
            position: DVec3::new(0.0, 0.0, 5.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
        };
        let camera = Camera::perspective(&pose, 0.5, [96, 96]).expect("a camera");
        let view = |place: usize| View {
            camera,
            windows: windows::spread(&camera, &Image::transparent(96, 96), (16, 6)),
            coarse: Some((counts(100.0), vec![counts(20.0); 3])),
            unrest: if place == 5 { 2.0 } else { 1.0 },
            exact: Vec::new(),
        };
        Pilot {
            views: (0..8).map(view).collect(),
            pictures,
            guard_px: 0,
            exact: None,
            cpu_ms: 0.0,
            model_ms: 0.0,
            model: model(0.0),
            took: Took::default(),
            limit: Limit::new("volsplat x".into(), (pictures, effort)),
        }
    }

    #[test]
    fn pictures_are_left_out_until_the_rest_can_be_afforded() {
        let pilot = |pictures| pilot(pictures, Effort::Affordable);
        let mut long = pilot(100);
        assert!(long.thinned() && long.views.len() == 8, "4.8 of 7 pictures");
        let mut short = pilot(64);
        assert!(
            short.thinned() && short.views.len() == 4,
            "2.4 of 4.5 pictures"
        );
        assert!(
            short.views.iter().any(|view| view.unrest > 1.0),
            "the one with the most contrast stays"
        );
        assert!(
            !pilot(8).thinned(),
            "two views would take 1.2 of 0.6 pictures"
        );
    }

    #[test]
    fn draws_are_left_out_first_but_not_below_the_least() {
        let parts = Parts::Windows {
            side_px: 16,
            least: 6,
            guard_px: 0,
        };
        let draws = |effort, windows: &[Counts]| {
            pilot(1, effort).affordable_draws(1, (&counts(100.0), windows), (parts, 18))
        };
        assert_eq!(draws(Effort::Affordable, &[counts(5.0)]), 18, "a twentieth");
        assert_eq!(
            draws(Effort::Affordable, &[counts(10.0)]),
            12,
            "a tenth, where 0.07 are allowed"
        );
        assert_eq!(draws(Effort::Affordable, &[counts(60.0)]), 6, "no fewer");
        assert_eq!(draws(Effort::Any, &[counts(60.0)]), 18, "whatever it takes");
    }

    #[test]
    fn windows_count_by_their_work_and_by_what_each_frame_takes() {
        let limit = Limit::new("volsplat x".into(), (10, Effort::Affordable));
        let share = limit.share(&model(1.0), (&counts(90.0), &[counts(30.0), counts(15.0)]));
        assert!(
            (share - (0.5 * 0.9 + 2.0 * 0.1)).abs() < 1e-12,
            "half of the work and two frames: {share}"
        );
        assert!((limit.most - 0.7).abs() < 1e-12);
        assert_eq!(
            Limit::new(String::new(), (1, Effort::Any)).most,
            f64::INFINITY
        );
    }

    #[test]
    fn the_nearest_place_gives_way() {
        let mut list = vec![1, 4, 7];
        include(&mut list, 5);
        assert_eq!(list, [1, 5, 7]);
    }
}
