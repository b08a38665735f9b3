//! Popping: how much a picture changes from frame to frame while the view turns through 45 degrees.
//!
//! Takes a volume and options, gives the mean absolute change of all pixels and channels for each step of an even turn
//! from [`ARC_DEG`] before the diagonal to as far behind it. On a smooth turn the changes stay alike over so short an
//! arc; an order of compositing that rests on the axes of the volume jumps where another axis faces the eye.

use glam::{DQuat, DVec3};
use resample_core::{Camera, Image};
use volsplat::procedural::{CHECKER_VALUES, checker_box};
use volsplat::{RenderOptions, Renderer, TransferFunction, Volume};

use crate::volumes::scenes::{perspective, transfer};

/// Frames after the first.
pub const STEPS: u32 = 64;

/// From the diagonal on both sides, degrees: steps of 1/8 degree, so that the turn itself changes little.
pub const ARC_DEG: f64 = 4.0;

/// A view that turns around a centre.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    /// The point in the middle of the picture, world units.
    pub centre: DVec3,
    /// The eye at 0 degrees, from the centre.
    pub eye: DVec3,
    /// Vertical field of view, degrees.
    pub fov_y_deg: f64,
    /// Picture side, px.
    pub side_px: u32,
}

impl Turn {
    /// Around a volume that fills -1..1.
    pub fn around_unit_box(side_px: u32) -> Self {
        Self {
            centre: DVec3::ZERO,
            eye: DVec3::new(0.0, 1.3, -5.0),
            fov_y_deg: 40.0,
            side_px,
        }
    }

    /// The camera after a turn about y.
    pub fn camera(&self, angle_deg: f64) -> Camera {
        let eye = self.centre + DQuat::from_rotation_y(angle_deg.to_radians()) * self.eye;
        perspective(eye, self.centre, self.fov_y_deg, [self.side_px; 2])
    }

    /// The camera of a step of the turn through 45 degrees.
    pub fn step(&self, step: u32) -> Camera {
        self.camera(45.0 + ARC_DEG * (2.0 * f64::from(step) / f64::from(STEPS) - 1.0))
    }
}

/// The changes of a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Changes {
    /// Median change from frame to frame.
    pub median: f64,
    /// Largest change.
    pub largest: f64,
    /// The step at which it happens, 1 to [`STEPS`].
    pub at: u32,
}

impl Changes {
    /// Largest over median: 1 for an even turn.
    pub fn ratio(&self) -> f64 {
        self.largest / self.median
    }

    /// Draws the turn and measures it.
    ///
    /// # Panics
    /// If the options are out of range.
    pub fn measure(
        subject: (&Volume, &TransferFunction),
        turn: &Turn,
        options: &RenderOptions,
    ) -> Self {
        let mut renderer = Renderer::new(subject.0, subject.1, options).expect("valid options");
        let mut frame = |step| {
            renderer
                .render(&turn.step(step))
                .expect("a valid camera")
                .image
        };
        let mut before = frame(0);
        let mut changes = Vec::new();
        for step in 1..=STEPS {
            let next = frame(step);
            changes.push((change(&before, &next), step));
            before = next;
        }
        changes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (largest, at) = changes[changes.len() - 1];
        Self {
            median: changes[changes.len() / 2].0,
            largest,
            at,
        }
    }
}

/// Red and white cells, so dense that a change of order shows.
pub fn checkers(voxels_per_axis: usize) -> (Volume, TransferFunction) {
    let volume = checker_box(voxels_per_axis, voxels_per_axis / 5).expect("a good size");
    let [low, high] = CHECKER_VALUES.map(f64::from);
    let look = transfer(
        &[(low, [0.9, 0.1, 0.1]), (high, [0.9; 3])],
        &[(low, 0.1), (high, 0.3)],
    );
    (volume, look)
}

/// Mean absolute difference over all pixels and channels.
fn change(a: &Image, b: &Image) -> f64 {
    let channels = a.rgba.iter().flatten().zip(b.rgba.iter().flatten());
    let sum: f64 = channels.map(|(a, b)| f64::from((a - b).abs())).sum();
    sum / (4 * a.rgba.len()) as f64
}
