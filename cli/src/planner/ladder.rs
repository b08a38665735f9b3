//! The planner's ladders: for each application one list of settings, from cheap to exact, and the default.
//!
//! Its rungs lose less and cost more, and each of them wins on the measured front of real scenes. The options that were
//! typed are kept: they are left out of every rung, and of the exact setting too.

use anyhow::Result;
use texmap::Method;
use volsplat::{LightGrid, PixelSamples, Subpixels};
use warp3d::args::MethodName;

use crate::args::OrderName;
use crate::args::volume::order;
use crate::open::setting::{
    Choices, DepthChoice, GaussianChoice, MeshChoice, PointsChoice, Setting, VolumeChoice,
};

/// Choices beyond the typed setting.
#[derive(Clone, Debug)]
pub(super) struct Rung {
    pub(super) choices: Choices,
    /// The work of each pixel, in any unit: the place on the ladder. 0 where only a measurement can tell.
    pub(super) work: f64,
}

impl Rung {
    /// A volume's setting that others are compared with, and that stands on no ladder: its work is measured.
    pub(super) fn aside(choices: Choices) -> Self {
        Self { choices, work: 0.0 }
    }
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
        Setting::Mesh(_) => Choices::of([
            MeshChoice::Method(Method::BackwardTrilinear),
            MeshChoice::Subpixels(1),
        ]),
        Setting::Volume(given) => {
            let blocks_light = given.options.blocks_light() && !given.has("light-grid");
            let light = blocks_light.then_some(VolumeChoice::LightGrid(LightGrid::AtHand));
            let one = VolumeChoice::Subpixels(Subpixels::Fixed(1));
            Choices::of([one].into_iter().chain(light))
        }
        Setting::Gaussians(_) => ladder.cheapest().choices.clone(),
        Setting::Depth(_) if ladder.rungs.len() > 1 => ladder.rungs[1].choices.clone(),
        Setting::Depth(_) => ladder.cheapest().choices.clone(),
        Setting::Points(_) => points_preview().choices.without(typed),
    };
    let quick = typed.with(&quick)?;
    Ok(Ends {
        quick: if quick.is_legal() {
            quick
        } else {
            typed.clone()
        },
        exact: typed.with(&ladder.exact().choices)?,
        exact_words: ladder.exact().choices.words(),
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

/// Error of a slab, samples, and the time of a picture, of the exact one. The last one is the exact setting. With one sample a thicker slab
/// saves nothing. On a helmet of small Gaussians and a yard with a sky, each loses less than the one before.
const GAUSSIANS: [(f32, PixelSamples, f64); 4] = [
    (0.06, PixelSamples::One, 0.3),
    (0.02, PixelSamples::Auto, 0.5),
    (0.02, PixelSamples::Four, 0.8),
    (0.005, PixelSamples::Four, 1.0),
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
        let (rungs, preview) = match typed {
            Setting::Volume(given) => {
                match order::order(given) {
                    // Contradicting options are refused when the volume is opened.
                    Ok(None | Some(OrderName::Field)) | Err(_) => (field(allowed), field_preview()),
                    Ok(Some(_)) => (samples(), rung(1.0, Choices::default())),
                }
            }
            Setting::Gaussians(_) => {
                let rungs = gaussians(allowed);
                let cheapest = rungs[0].clone();
                (rungs, cheapest)
            }
            Setting::Mesh(_) => (mesh(), mesh_preview()),
            Setting::Depth(_) => {
                let rungs = warp();
                let nearest = rungs[0].clone();
                (rungs, nearest)
            }
            Setting::Points(_) => (points(), points_preview()),
        };
        let mut ladder = Self {
            rungs: Vec::new(),
            default: rung(0.0, Choices::default()),
            preview: rung(preview.work, preview.choices.without(typed)),
        };
        if !typed.with(&ladder.preview.choices)?.is_legal() {
            ladder.preview = ladder.default.clone();
        }
        ladder.add(rungs, typed)?;
        Ok(ladder)
    }

    /// Adds the rungs beyond the typed setting.
    fn add(&mut self, all: Vec<Rung>, typed: &Setting) -> Result<()> {
        let Self { rungs, default, .. } = self;
        for Rung { choices, work } in all {
            let choices = choices.without(typed);
            let whole = typed.with(&choices)?;
            // Typed options can make two rungs the same setting, and one of them may be the default.
            rungs.retain(|other| other.choices != choices);
            if whole.draws_like(typed) {
                default.work = work;
            } else if whole.is_legal() {
                rungs.push(rung(work, choices));
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

fn rung(work: f64, choices: Choices) -> Rung {
    Rung { choices, work }
}

/// Voxels of the smallest spacing beyond which a slab is no choice for an error: it leaves voxels out along that axis, so that a
/// thin thing between two planes is in no window and in no picture. Along the other axes the same slab is shorter in voxels.
const LONGEST_SLAB: f64 = 1.0;

/// One sample a voxel and a pixel: cheap, without the stripes of longer slabs, whose contrast is not the picture's.
fn field_preview() -> Rung {
    let choices = Choices::of([
        VolumeChoice::Slab(LONGEST_SLAB),
        VolumeChoice::Subpixels(Subpixels::Fixed(1)),
    ]);
    rung(1.0 / LONGEST_SLAB, choices)
}

/// The work of the field is in proportion to its samples: sub-pixels along two sides, and slabs.
fn field(allowed: Option<f64>) -> Vec<Rung> {
    let exact = FIELD.len() - 1;
    let of = |(place, (slab, subpixels)): (usize, (f64, u32))| {
        let transmittance = termination(place == exact, allowed);
        let samples = [
            VolumeChoice::Slab(slab),
            VolumeChoice::Subpixels(Subpixels::Fixed(subpixels)),
        ];
        let termination = transmittance.map(VolumeChoice::MinTransmittance);
        let choices = Choices::of(samples.into_iter().chain(termination));
        rung(f64::from(subpixels).powi(2) / slab, choices)
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
    let exact = [VolumeChoice::MinTransmittance(LEAST_TRANSMITTANCE)];
    vec![rung(1.0, Choices::of(exact))]
}

fn gaussians(allowed: Option<f64>) -> Vec<Rung> {
    let exact = GAUSSIANS.len() - 1;
    let of = |(place, (slab_error, samples, work)): (usize, (f32, PixelSamples, f64))| {
        let transmittance =
            termination(place == exact, allowed).map(GaussianChoice::MinTransmittance);
        let choices = [
            GaussianChoice::SlabError(slab_error),
            GaussianChoice::Samples(samples),
        ];
        rung(work, Choices::of(choices.into_iter().chain(transmittance)))
    };
    GAUSSIANS.into_iter().enumerate().map(of).collect()
}

/// The least transmittance of a setting; `None` leaves the default.
fn termination(is_exact: bool, allowed: Option<f64>) -> Option<f32> {
    match allowed {
        _ if is_exact => Some(LEAST_TRANSMITTANCE),
        Some(bound) => Some(((TERMINATION_SHARE * bound) as f32).max(LEAST_TRANSMITTANCE)),
        None => None,
    }
}

fn mesh() -> Vec<Rung> {
    let of = |(n, work)| rung(work, Choices::of([MeshChoice::Subpixels(n)]));
    MESH.map(of).to_vec()
}

/// The nearest texel shows contrast well enough, and is cheap even where a texture is far larger than the picture.
fn mesh_preview() -> Rung {
    let choices = Choices::of([
        MeshChoice::Method(Method::BackwardNearest),
        MeshChoice::Subpixels(1),
    ]);
    rung(0.05, choices)
}

fn warp() -> Vec<Rung> {
    let hybrid = |(subpixels, work)| {
        let choices = [
            DepthChoice::Method(MethodName::Hybrid),
            DepthChoice::Subpixels(subpixels),
        ];
        rung(work, Choices::of(choices))
    };
    let nearest = [DepthChoice::Method(MethodName::Nearest)];
    let mut rungs = vec![rung(NEAREST, Choices::of(nearest))];
    rungs.extend(WARP.map(hybrid));
    rungs
}

/// One point of so many, sub-pixels, and the time of a picture, of the exact one. The blend is no rung: a mean costs as much.
const POINTS: [(u32, u32, f64); 7] = [
    (16, 1, 0.1),
    (8, 2, 0.17),
    (4, 4, 0.3),
    (2, 4, 0.5),
    (1, 2, 0.8),
    (1, 4, 0.85),
    (1, 8, 1.0),
];

fn points() -> Vec<Rung> {
    let of = |(every, subpixels, work)| {
        let choices = [
            PointsChoice::Every(every),
            PointsChoice::Subpixels(subpixels),
        ];
        rung(work, Choices::of(choices))
    };
    POINTS.map(of).to_vec()
}

/// A picture of an eighth of the points shows the covered area and the contrast.
fn points_preview() -> Rung {
    let choices = Choices::of([PointsChoice::Every(8), PointsChoice::Subpixels(1)]);
    rung(0.15, choices)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Drawing;
    use crate::open::setting::Choice;

    fn names(typed: &Setting, allowed: Option<f64>) -> Vec<String> {
        let ladder = Ladder::of(typed, allowed).expect("a ladder");
        let names = ladder.rungs.iter().map(|rung| rung.choices.name());
        names.collect()
    }

    /// The default of a command that draws this file, with choices typed.
    fn typed<T: Into<Choice>>(drawing: &Drawing, choices: impl IntoIterator<Item = T>) -> Setting {
        let setting = drawing.setting().with(&Choices::of(choices));
        setting.expect("its own choices")
    }

    fn volume(choices: &[VolumeChoice]) -> Setting {
        typed(&Drawing::Volsplat(Box::default()), choices.iter().copied())
    }

    fn mesh(choices: &[MeshChoice]) -> Setting {
        typed(&Drawing::Texmap(Box::default()), choices.iter().copied())
    }

    #[test]
    fn options_that_were_typed_are_no_choice() {
        let free = volume(&[]);
        assert_eq!(names(&free, None).len(), FIELD.len());
        assert_eq!(names(&free, None)[3], "slab 1, subpixels 2");
        let fixed = volume(&[VolumeChoice::Slab(1.0)]);
        let expected = ["subpixels 1", "subpixels 2", "subpixels 4"];
        assert_eq!(names(&fixed, None)[..3], expected, "one rung of each");
        let ladder = Ladder::of(&fixed, None).expect("a ladder");
        let exact = ladder.exact().choices.name();
        assert!(!exact.contains("slab"), "{exact}");
        let samples = volume(&[VolumeChoice::Order(OrderName::EverySample)]);
        assert_eq!(names(&samples, Some(0.004)), ["min-transmittance 0.00001"]);
    }

    #[test]
    fn the_default_has_its_place_where_it_is_a_rung() {
        let free = Ladder::of(&mesh(&[]), None).expect("a ladder");
        assert_eq!((free.rungs.len(), free.default.work), (3, 0.5));
        let warp = Drawing::Warp3d(Box::default()).setting();
        let warp = Ladder::of(&warp, None).expect("a ladder");
        assert_eq!((warp.rungs.len(), warp.default.work), (4, 0.75));
        let nothing = Ladder::of(&mesh(&[MeshChoice::Subpixels(2)]), None).expect("a ladder");
        assert_eq!(nothing.rungs.len(), 1, "nothing is free");
        assert_eq!(nothing.exact().choices, nothing.default.choices);
    }

    #[test]
    fn early_termination_gets_its_share() {
        let free = names(&volume(&[]), Some(0.004));
        assert!(free[0].contains("min-transmittance 0.001"), "{}", free[0]);
        let typed = volume(&[VolumeChoice::MinTransmittance(0.5)]);
        assert!(!names(&typed, Some(0.004))[0].contains("min-transmittance"));
    }
}
