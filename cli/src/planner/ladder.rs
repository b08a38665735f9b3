//! The planner's ladders: for each application one list of settings, from cheap to exact.
//!
//! Its rungs lose less and cost more, and each of them wins on the measured front of real scenes. The options that were
//! typed are kept: they are left out of every rung, and of the exact setting too.

use anyhow::Result;
use volsplat::Subpixels;
use warp3d::args::MethodName;

use crate::args::{Given, OrderName, RenderArgs};
use crate::order;
use crate::setting::Setting;
use crate::values::word;

/// A setting beyond the typed one.
#[derive(Clone, Debug)]
pub(super) struct Rung {
    pub(super) setting: Setting,
    /// Its usual cost, of the exact setting: the trade of the scenes in `docs/results`, rounded up. It only decides
    /// whether a try is worth its cost.
    pub(super) cost: f64,
}

/// What may be chosen for one command.
#[derive(Clone, Debug)]
pub(super) struct Ladder {
    /// From cheap to exact, without the exact setting itself.
    pub(super) rungs: Vec<Rung>,
    /// The most exact setting.
    pub(super) exact: Setting,
    /// The cheapest setting, for a coarse look.
    pub(super) coarse: Setting,
    /// Where a coarse look must be cheap, it shows every so many pixels only.
    pub(super) coarse_step: u32,
    /// Most pictures of a sequence that are looked at coarsely, for the one with the most contrast.
    pub(super) coarse_looks: usize,
}

/// Share of the allowed error that the proven bound gets.
const PROVEN_SHARE: f64 = 0.25;

/// What proven bounds with a share of the error usually cost, of the exact ones (trade of volumes: 0.3 to 0.73).
const PROVEN_COST: f64 = 0.7;

/// The transmittance of the exact settings: a four-hundredth of a step of an 8-bit picture. 0 would take many times as
/// long.
const LEAST_TRANSMITTANCE: f32 = 1e-5;

/// Slab in voxels, sub-pixels, cost.
const FIELD: [(f64, u32, f64); 8] = [
    (2.0, 1, 0.01),
    (2.0, 2, 0.018),
    (1.0, 2, 0.032),
    (1.0, 4, 0.07),
    (0.5, 4, 0.12),
    (0.5, 8, 0.28),
    (0.25, 8, 0.53),
    (0.125, 8, 1.0),
];

/// Sub-pixels of a mesh, cost.
const MESH: [(u32, f64); 4] = [(1, 0.1), (2, 0.25), (4, 0.5), (8, 1.0)];

/// Sub-pixels of a warp, cost.
const WARP: [(u32, f64); 4] = [(1, 0.7), (2, 0.7), (4, 0.75), (8, 1.0)];

/// Cost of the nearest pixel, of the exact warp.
const NEAREST_COST: f64 = 0.1;

impl Ladder {
    /// The ladder of an application beyond the typed setting, for an allowed error or, without one, for a time.
    pub(super) fn of(typed: &Setting, allowed: Option<f64>) -> Result<Self> {
        let ladder = match typed {
            Setting::Volume(args) if draws_field(args) => field(),
            Setting::Volume(_) => samples(),
            Setting::Mesh(_) => mesh(),
            Setting::Depth(_) => warp(),
        };
        ladder.beyond(typed, allowed.and_then(|bound| proven(typed, bound)))
    }

    fn beyond(self, typed: &Setting, proven: Option<Setting>) -> Result<Self> {
        let exact = self.exact.without(typed);
        let mut rungs: Vec<Rung> = Vec::new();
        for rung in self.rungs {
            let (mut setting, mut cost) = (rung.setting, rung.cost);
            if let Some(proven) = &proven {
                (setting, cost) = (setting.with(proven)?, PROVEN_COST * cost);
            }
            let setting = setting.without(typed);
            // Rungs that differ in what was typed are one.
            rungs.retain(|other| other.setting != setting);
            if setting != exact && typed.with(&setting)?.is_legal() {
                rungs.push(Rung { setting, cost });
            }
        }
        let mut coarse = self.coarse.without(typed);
        if !typed.with(&coarse)?.is_legal() {
            coarse = rungs
                .first()
                .map_or(exact.clone(), |rung| rung.setting.clone());
        }
        Ok(Self {
            rungs,
            exact,
            coarse,
            ..self
        })
    }
}

/// Whether a volume's field is drawn.
fn draws_field(given: &Given<RenderArgs>) -> bool {
    order_of(given) == OrderName::Field
}

fn order_of(given: &Given<RenderArgs>) -> OrderName {
    // Contradicting options are refused when the volume is opened.
    order::order(given)
        .ok()
        .flatten()
        .unwrap_or(OrderName::Field)
}

/// The option whose value is a proven bound on its own error; it gets a share of the error that is allowed.
fn proven(typed: &Setting, bound: f64) -> Option<Setting> {
    let Setting::Volume(_) = typed else {
        return None;
    };
    let share = ((PROVEN_SHARE * bound) as f32).max(LEAST_TRANSMITTANCE);
    Some(Setting::volume(&["min-transmittance"], |args| {
        args.min_transmittance = share;
    }))
}

fn field() -> Ladder {
    let of = |slab: f64, subpixels: u32| {
        Setting::volume(&["slab", "subpixels"], |args| {
            args.field.slab_voxels = slab;
            args.subpixels = Subpixels::Fixed(subpixels);
        })
    };
    let exact = Setting::volume(&["slab", "subpixels", "min-transmittance"], |args| {
        args.field.slab_voxels = 0.125;
        args.subpixels = Subpixels::Fixed(8);
        args.min_transmittance = LEAST_TRANSMITTANCE;
    });
    let rung = |(slab, subpixels, cost)| Rung {
        setting: of(slab, subpixels),
        cost,
    };
    Ladder {
        rungs: FIELD.map(rung).to_vec(),
        exact,
        coarse: of(2.0, 1),
        coarse_step: 1,
        coarse_looks: 24,
    }
}

/// The orders of samples have nothing to climb: only the proven bounds are free.
fn samples() -> Ladder {
    let exact = Setting::volume(&["min-transmittance"], |args| {
        args.min_transmittance = LEAST_TRANSMITTANCE;
    });
    Ladder {
        rungs: vec![Rung {
            setting: Setting::volume(&[], |_| ()),
            cost: 1.0,
        }],
        coarse: exact.clone(),
        exact,
        // It costs as much as the exact setting.
        coarse_step: 4,
        coarse_looks: 24,
    }
}

fn mesh() -> Ladder {
    let of = |subpixels| Setting::mesh(&["subpixels"], |options| options.subpixels = subpixels);
    Ladder {
        rungs: MESH
            .map(|(n, cost)| Rung {
                setting: of(n),
                cost,
            })
            .to_vec(),
        exact: of(8),
        coarse: of(1),
        // The cheapest setting takes a tenth of the exact one's time.
        coarse_step: 4,
        coarse_looks: 24,
    }
}

fn warp() -> Ladder {
    let hybrid = |subpixels| {
        Setting::depth(&["method", "subpixels"], |args| {
            args.method = MethodName::Hybrid;
            args.subpixels = Some(subpixels);
        })
    };
    let nearest = Setting::depth(&["method"], |args| args.method = MethodName::Nearest);
    let cheapest = Rung {
        setting: nearest.clone(),
        cost: NEAREST_COST,
    };
    let others = WARP.map(|(n, cost)| Rung {
        setting: hybrid(n),
        cost,
    });
    Ladder {
        rungs: std::iter::once(cheapest).chain(others).collect(),
        exact: hybrid(8),
        coarse: nearest,
        coarse_step: 1,
        // A coarse warp takes a tenth of an exact one: six of 64 pictures are a hundredth of the run.
        coarse_looks: 6,
    }
}

/// The name of the kind of work that a setting does: pictures of one name take times of one model.
pub(super) fn kind(setting: &Setting) -> String {
    match setting {
        Setting::Volume(given) => {
            let subpixels = match given.options.subpixels {
                Subpixels::Fixed(n) => n.to_string(),
                Subpixels::Auto => "auto".into(),
            };
            format!("volsplat {} {subpixels}", order_of(given).name())
        }
        Setting::Mesh(given) => {
            let options = &given.options;
            format!("texmap {} {}", word(options.method), options.subpixels)
        }
        Setting::Depth(given) => {
            let args = &given.options;
            format!(
                "warp3d {} {}",
                word(args.method),
                args.subpixels.unwrap_or(4)
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(typed: &Setting, allowed: Option<f64>) -> Vec<String> {
        let ladder = Ladder::of(typed, allowed).expect("a ladder");
        let names = ladder.rungs.iter().map(|rung| rung.setting.name());
        names.collect::<Result<_>>().expect("names")
    }

    #[test]
    fn options_that_were_typed_are_no_choice() {
        let free = Setting::volume(&[], |_| ());
        assert_eq!(names(&free, None).len(), FIELD.len());
        assert_eq!(names(&free, None)[3], "slab 1, subpixels 4");
        let fixed = Setting::volume(&["slab"], |args| args.field.slab_voxels = 1.0);
        assert_eq!(
            names(&fixed, None),
            ["subpixels 1", "subpixels 2", "subpixels 4", "subpixels 8"],
            "one rung of each"
        );
        let ladder = Ladder::of(&fixed, None).expect("a ladder");
        assert!(!ladder.exact.name().expect("a name").contains("slab"));
        let samples = Setting::volume(&["order"], |args| args.order = Some(OrderName::EverySample));
        assert_eq!(names(&samples, Some(0.004)), ["min-transmittance 0.001"]);
        assert_eq!(
            names(&Setting::mesh(&[], |_| ()), None),
            ["subpixels 1", "subpixels 2", "subpixels 4"]
        );
        assert_eq!(
            names(&Setting::depth(&[], |_| ()), None).len(),
            WARP.len(),
            "and the nearest pixel"
        );
    }

    #[test]
    fn proven_bounds_get_their_share() {
        let free = names(&Setting::volume(&[], |_| ()), Some(0.004));
        assert_eq!(
            free.len(),
            FIELD.len(),
            "the last rung is not the exact setting"
        );
        assert!(free[0].contains("min-transmittance 0.001"), "{}", free[0]);
        let typed = Setting::volume(&["min-transmittance"], |args| args.min_transmittance = 0.5);
        assert!(!names(&typed, Some(0.004))[0].contains("min-transmittance"));
    }
}
