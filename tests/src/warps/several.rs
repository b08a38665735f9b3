//! Scenes that several references see: ray-traced ones with the truth, and two real ones.
//!
//! Gives a target, its picture, and references in the order in which they are added. Each pixel of the target has, for each
//! reference, the share of it that this reference sees.
//!
//! Limits: of the real scenes, visibility follows from the measured depth maps, whose edges are off by a pixel or two.

use glam::DVec3;
use resample_core::{Camera, Image};
use warp3d::Reference;

use crate::warps::filtered::{filtered, filtered_scene};
use crate::warps::pairs::{art_between, livingroom_between};
use crate::warps::scenes::{AnalyticScene, camera};
use crate::warps::truth::Truth;

/// A target that several references see.
pub struct SeveralViews {
    /// Its name.
    pub name: String,
    /// The references, the first one first.
    pub references: Vec<Reference>,
    /// The camera to warp to.
    pub target: Camera,
    /// The true picture, and its depth.
    pub image: Image,
    /// Camera z of the target, world units.
    pub depth: Vec<f32>,
    /// For each reference, the share of each pixel that it sees, 0 to 1.
    pub seen: Vec<Vec<f32>>,
}

/// Where the references of the ray-traced scenes stand: nearest first, then to the other side, then farther off, above, before and behind.
const EYES: [(DVec3, f64); 5] = [
    (DVec3::new(-0.12, 0.0, 0.0), 0.0),
    (DVec3::new(0.2, 0.02, 0.03), -0.02),
    (DVec3::new(0.02, -0.3, -0.3), 0.01),
    (DVec3::new(-0.5, 0.1, 0.4), 0.06),
    (DVec3::new(0.6, 0.15, -0.1), -0.05),
];

impl SeveralViews {
    /// `scene` by one ray a pixel centre, from the five eyes.
    pub fn traced(name: &str, scene: &AnalyticScene) -> Self {
        let (target, from) = cameras();
        let references: Vec<Reference> = from.iter().map(|c| scene.reference(c)).collect();
        let truths: Vec<Truth> = from.iter().map(|c| scene.truth(&target, c)).collect();
        Self::new(name, target, references, truths)
    }

    /// `scene` with every pixel a mean over its Gaussian, as pictures are taken, from the five eyes.
    pub fn filtered(name: &str, scene: &AnalyticScene) -> Self {
        let (target, from) = cameras();
        let reference = |camera: &Camera| Reference {
            colour: filtered(scene, camera),
            ..scene.reference(camera)
        };
        let references: Vec<Reference> = from.iter().map(reference).collect();
        let truth = |camera: &Camera| filtered_scene(name, scene, camera, &target).truth;
        let truths: Vec<Truth> = from.iter().map(truth).collect();
        Self::new(name, target, references, truths)
    }

    fn new(name: &str, target: Camera, references: Vec<Reference>, truths: Vec<Truth>) -> Self {
        Self {
            name: name.into(),
            references,
            target,
            image: truths[0].image.clone(),
            depth: truths[0].depth.clone(),
            seen: truths.into_iter().map(|truth| truth.seen).collect(),
        }
    }

    /// The real scenes that are there.
    pub fn real(test: &str) -> Vec<Self> {
        [art_between(test), livingroom_between(test)]
            .into_iter()
            .flatten()
            .collect()
    }

    /// The truth, visible where one of the first `count` references sees the whole pixel.
    pub fn truth(&self, count: usize) -> Truth {
        self.truth_where(|shares| shares[..count].iter().fold(0.0, |a, &b| a.max(b)))
    }

    /// The truth, visible where all of the first `count` references see the whole pixel.
    pub fn truth_of_all(&self, count: usize) -> Truth {
        self.truth_where(|shares| shares[..count].iter().fold(1.0, |a, &b| a.min(b)))
    }

    fn truth_where(&self, of: impl Fn(&[f32]) -> f32) -> Truth {
        let shares = |at: usize| self.seen.iter().map(|s| s[at]).collect::<Vec<f32>>();
        Truth {
            image: self.image.clone(),
            depth: self.depth.clone(),
            seen: (0..self.depth.len()).map(|at| of(&shares(at))).collect(),
        }
    }
}

fn cameras() -> (Camera, Vec<Camera>) {
    let view = |eye, yaw| camera([320, 240], 260.0, eye, yaw);
    let from = EYES.iter().map(|&(eye, yaw)| view(eye, yaw)).collect();
    (view(DVec3::new(0.03, 0.01, 0.02), 0.0), from)
}
