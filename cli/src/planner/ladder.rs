//! The planner's ladders: for each application one list of settings, from cheap to exact, and the default.
//!
//! Its rungs lose less and cost more, and each of them wins on the measured front of real scenes. The options that were
//! typed are kept: they are left out of every rung, and of the exact setting too.

use anyhow::Result;
use texmap::Method;
use volsplat::Subpixels;
use warp3d::args::MethodName;

use crate::args::OrderName;
use crate::args::volume::order;
use crate::open::setting::Setting;

/// A setting beyond the typed one.
#[derive(Clone, Debug)]
pub(super) struct Rung {
    pub(super) setting: Setting,
    /// The work of each pixel, in any unit: the place on the ladder. 0 where only a measurement can tell.
    pub(super) work: f64,
}

/// The settings that may be chosen for one command.
#[derive(Clone, Debug)]
pub(super) struct Ladder {
    /// From cheap to exact, without the default; the last one is the exact setting.
    pub(super) rungs: Vec<Rung>,
    /// The default setting.
    pub(super) default: Rung,
    /// A cheap setting for a preview, which shows the covered area and the contrast.
    pub(super) preview: Rung,
}

/// The ends of a ladder.
pub(crate) struct Ends {
    /// Quick enough to steer by.
    pub(crate) quick: Setting,
    /// The most exact one.
    pub(crate) exact: Setting,
    /// The options of the most exact one that were not typed.
    pub(crate) exact_words: Vec<String>,
}

/// The ends of the ladder of a setting, each laid over it.
pub(crate) fn ends(typed: &Setting) -> Result<Ends> {
    let ladder = Ladder::of(typed, None)?;
    // The cheapest field has stripes, and the cheapest warp tears surfaces. A look-up in a pyramid costs the same however
    // small the picture is, and does not sparkle.
    let quick = match typed {
        Setting::Mesh(_) => Setting::mesh(&["method", "subpixels"], |options| {
            options.method = Method::BackwardTrilinear;
            options.subpixels = 1;
        }),
        Setting::Volume(_) => Setting::volume(&["subpixels"], |args| {
            args.subpixels = Subpixels::Fixed(1);
        }),
        Setting::Depth(_) if ladder.rungs.len() > 1 => ladder.rungs[1].setting.clone(),
        Setting::Depth(_) => ladder.cheapest().setting.clone(),
    };
    let quick = typed.with(&quick)?;
    Ok(Ends {
        quick: if quick.is_legal() {
            quick
        } else {
            typed.clone()
        },
        exact: typed.with(&ladder.exact().setting)?,
        exact_words: ladder.exact().setting.words()?,
    })
}

/// Share of the allowed error that early termination, which bounds its own error, may take.
const TERMINATION_SHARE: f64 = 0.25;

/// The transmittance of the exact settings: a four-hundredth of a step of an 8-bit picture. 0 would take many times as
/// long.
const LEAST_TRANSMITTANCE: f32 = 1e-5;

/// Slab in voxels, and sub-pixels. The last one is the exact setting. Each is on the front of error and time of the engine, the
/// aneurism, the lobster or the tooth at 128 or 320 px; slabs of 2 and 1 with more sub-pixels are not. Slabs of an eighth with 4x4 keep
/// largest errors that those of a quarter exceed with 8x8 too (aneurism, 400 px: 0.018), for a quarter of the exact one's work.
const FIELD: [(f64, u32); 12] = [
    (2.0, 1),
    (1.0, 1),
    (0.5, 1),
    (1.0, 2),
    (0.5, 2),
    (0.25, 2),
    (0.5, 4),
    (0.25, 4),
    (0.5, 8),
    (0.125, 4),
    (0.25, 8),
    (0.125, 8),
];

/// Sub-pixels of a mesh, and the time of a picture, of the exact one.
const MESH: [(u32, f64); 4] = [(1, 0.1), (2, 0.25), (4, 0.5), (8, 1.0)];

/// Sub-pixels of a warp, and the time of a picture, of the exact one.
const WARP: [(u32, f64); 4] = [(1, 0.65), (2, 0.7), (4, 0.75), (8, 1.0)];

/// Time of the nearest pixel, of the exact warp.
const NEAREST: f64 = 0.1;

impl Ladder {
    /// The ladder of an application beyond the typed setting; `allowed` is the error, where one was asked for.
    pub(super) fn of(typed: &Setting, allowed: Option<f64>) -> Result<Self> {
        let (rungs, default, preview) = match typed {
            Setting::Volume(given) => {
                let default = Setting::volume(&[], |_| ());
                match order::order(given) {
                    // Contradicting options are refused when the volume is opened.
                    Ok(None | Some(OrderName::Field)) | Err(_) => {
                        (field(allowed), default, field_preview())
                    }
                    Ok(Some(_)) => (samples(), default.clone(), rung(1.0, default)),
                }
            }
            Setting::Mesh(_) => (mesh(), Setting::mesh(&[], |_| ()), mesh_preview()),
            Setting::Depth(_) => {
                let rungs = warp();
                let nearest = rungs[0].clone();
                (rungs, Setting::depth(&[], |_| ()), nearest)
            }
        };
        let mut ladder = Self {
            rungs: Vec::new(),
            default: rung(0.0, default),
            preview: rung(preview.work, preview.setting.without(typed)),
        };
        if !typed.with(&ladder.preview.setting)?.is_legal() {
            ladder.preview = ladder.default.clone();
        }
        ladder.add(rungs, typed)?;
        Ok(ladder)
    }

    /// Adds the rungs beyond the typed setting.
    fn add(&mut self, all: Vec<Rung>, typed: &Setting) -> Result<()> {
        let options = typed.with(&self.default.setting)?;
        let Self { rungs, default, .. } = self;
        for Rung { setting, work } in all {
            let setting = setting.without(typed);
            let whole = typed.with(&setting)?;
            // Typed options can make two rungs the same setting, and one of them may be the default.
            rungs.retain(|other| other.setting != setting);
            if whole.draws_like(&options) {
                default.work = work;
            } else if whole.is_legal() {
                rungs.push(rung(work, setting));
            }
        }
        if rungs.is_empty() {
            rungs.push(default.clone());
        }
        Ok(())
    }

    /// The most exact setting.
    pub(super) fn exact(&self) -> &Rung {
        self.rungs.last().unwrap_or(&self.default)
    }

    /// The cheapest setting that takes at least this work; the exact setting if all take less.
    pub(super) fn at_work(&self, work: f64) -> &Rung {
        let mut rungs = self.rungs.iter();
        rungs.find(|rung| rung.work >= work).unwrap_or(self.exact())
    }

    /// The rungs below and above another one.
    pub(super) fn around(&self, other: &Rung) -> (&[Rung], &[Rung]) {
        let below = self.rungs.partition_point(|rung| rung.work < other.work);
        self.rungs.split_at(below)
    }

    /// The cheapest setting.
    pub(super) fn cheapest(&self) -> &Rung {
        self.rungs.first().unwrap_or(&self.default)
    }
}

fn rung(work: f64, setting: Setting) -> Rung {
    Rung { setting, work }
}

/// Voxels of the smallest spacing beyond which a slab is no choice for an error: it leaves voxels out along that axis, so that a
/// thin thing between two planes is in no window and in no picture. Along the other axes the same slab is shorter in voxels.
const LONGEST_SLAB: f64 = 1.0;

/// One sample a voxel and a pixel: cheap, without the stripes of longer slabs, whose contrast is not the picture's.
fn field_preview() -> Rung {
    let setting = Setting::volume(&["slab", "subpixels"], |args| {
        args.field.slab_voxels = LONGEST_SLAB;
        args.subpixels = Subpixels::Fixed(1);
    });
    rung(1.0 / LONGEST_SLAB, setting)
}

/// The work of the field is in proportion to its samples: sub-pixels along two sides, and slabs.
fn field(allowed: Option<f64>) -> Vec<Rung> {
    let exact = FIELD.len() - 1;
    let of = |(place, (slab, subpixels)): (usize, (f64, u32))| {
        let transmittance = match allowed {
            _ if place == exact => Some(LEAST_TRANSMITTANCE),
            Some(bound) => Some(((TERMINATION_SHARE * bound) as f32).max(LEAST_TRANSMITTANCE)),
            None => None,
        };
        let names = ["slab", "subpixels", "min-transmittance"];
        let names = &names[..2 + usize::from(transmittance.is_some())];
        let setting = Setting::volume(names, |args| {
            args.field.slab_voxels = slab;
            args.subpixels = Subpixels::Fixed(subpixels);
            if let Some(transmittance) = transmittance {
                args.min_transmittance = transmittance;
            }
        });
        rung(f64::from(subpixels).powi(2) / slab, setting)
    };
    let is_choice =
        |(_, (slab, _)): &(usize, (f64, u32))| allowed.is_none() || *slab <= LONGEST_SLAB;
    FIELD
        .into_iter()
        .enumerate()
        .filter(is_choice)
        .map(of)
        .collect()
}

/// The orders of samples have nothing to climb: only early termination is free.
fn samples() -> Vec<Rung> {
    let exact = Setting::volume(&["min-transmittance"], |args| {
        args.min_transmittance = LEAST_TRANSMITTANCE;
    });
    vec![rung(1.0, exact)]
}

fn mesh() -> Vec<Rung> {
    let of = |subpixels| Setting::mesh(&["subpixels"], |options| options.subpixels = subpixels);
    MESH.map(|(n, work)| rung(work, of(n))).to_vec()
}

/// The nearest texel shows contrast well enough, and is cheap even where a texture is far larger than the picture.
fn mesh_preview() -> Rung {
    let setting = Setting::mesh(&["method", "subpixels"], |options| {
        options.method = Method::BackwardNearest;
        options.subpixels = 1;
    });
    rung(0.05, setting)
}

fn warp() -> Vec<Rung> {
    let hybrid = |(subpixels, work)| {
        let setting = Setting::depth(&["method", "subpixels"], |args| {
            args.method = MethodName::Hybrid;
            args.subpixels = Some(subpixels);
        });
        rung(work, setting)
    };
    let nearest = Setting::depth(&["method"], |args| args.method = MethodName::Nearest);
    let mut rungs = vec![rung(NEAREST, nearest)];
    rungs.extend(WARP.map(hybrid));
    rungs
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
        assert_eq!(names(&free, None)[3], "slab 1, subpixels 2");
        let fixed = Setting::volume(&["slab"], |args| args.field.slab_voxels = 1.0);
        let expected = ["subpixels 1", "subpixels 2", "subpixels 4"];
        assert_eq!(names(&fixed, None)[..3], expected, "one rung of each");
        let ladder = Ladder::of(&fixed, None).expect("a ladder");
        let exact = ladder.exact().setting.name().expect("a name");
        assert!(!exact.contains("slab"), "{exact}");
        let samples = Setting::volume(&["order"], |args| args.order = Some(OrderName::EverySample));
        assert_eq!(names(&samples, Some(0.004)), ["min-transmittance 0.00001"]);
    }

    #[test]
    fn the_default_has_its_place_where_it_is_a_rung() {
        let mesh = Ladder::of(&Setting::mesh(&[], |_| ()), None).expect("a ladder");
        assert_eq!((mesh.rungs.len(), mesh.default.work), (3, 0.5));
        let warp = Ladder::of(&Setting::depth(&[], |_| ()), None).expect("a ladder");
        assert_eq!((warp.rungs.len(), warp.default.work), (4, 0.75));
        let typed = Setting::mesh(&["subpixels"], |options| options.subpixels = 2);
        let nothing = Ladder::of(&typed, None).expect("a ladder");
        assert_eq!(nothing.rungs.len(), 1, "nothing is free");
        assert_eq!(nothing.exact().setting, nothing.default.setting);
    }

    #[test]
    fn early_termination_gets_its_share() {
        let free = names(&Setting::volume(&[], |_| ()), Some(0.004));
        assert!(free[0].contains("min-transmittance 0.001"), "{}", free[0]);
        let typed = Setting::volume(&["min-transmittance"], |args| args.min_transmittance = 0.5);
        assert!(!names(&typed, Some(0.004))[0].contains("min-transmittance"));
    }
}
