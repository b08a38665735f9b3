//! The end of every reader: Gaussians in the order of the file, without those that cannot be drawn.
//!
//! Takes the numbers of one Gaussian after another, gives [`Gaussians`] around an origin of their own. Training leaves a few numbers
//! that are NaN or beyond f32 in most large files; such a Gaussian is left out and counted, and a file of nothing else is refused.

use glam::{DVec3, Quat, Vec3};
use resample_io::Gate;

use crate::gaussians::{Gaussian, Gaussians, Refused};
use crate::input::Fault;

/// The constant of the spherical harmonics of degree 0: sqrt(1/4pi).
pub(crate) const C0: f32 = 0.282_094_8;

/// Highest degree that is kept.
pub(crate) const MOST_DEGREE: usize = 3;

/// Positions this far from the origin are kept relative to the first one: an f32 beyond has steps of more than 2^-9 units.
const FAR: f64 = 16_384.0;

/// One Gaussian as files have it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stored {
    /// Centre, in world space.
    pub(crate) centre: DVec3,
    /// From the axes of the Gaussian to the world, of any length.
    pub(crate) rotation: Quat,
    /// Standard deviations, world units.
    pub(crate) scales: Vec3,
    /// 0 to 1.
    pub(crate) opacity: f32,
    /// 0.5 + 0.282 times the coefficients of degree 0.
    pub(crate) colour: Vec3,
}

/// Collects Gaussians.
pub(crate) struct Sink {
    all: Gaussians,
    read: u64,
    left_out: u64,
    /// The first that was left out, counted from 0, and why.
    first: Option<(u64, Refused)>,
}

/// Numbers of one Gaussian of a degree beyond the constant.
pub(crate) fn coefficients_of(degree: usize) -> usize {
    3 * ((degree + 1) * (degree + 1) - 1)
}

/// Asks for the memory of some Gaussians and of `more` bytes that their reader needs beside them.
pub(crate) fn ask(gate: &Gate, degree: usize, count: u64, more: u64) -> Result<(), Fault> {
    let floats = 4 * (3 + 3 + 3 + 1 + 3);
    let harmonics = match degree {
        0 => 0,
        _ => 2 + coefficients_of(degree),
    };
    let bytes = count.saturating_mul((floats + harmonics) as u64);
    let what = format!("{count} Gaussians");
    gate.ask(bytes.saturating_add(more), &what)
        .map_err(Fault::Invalid)
}

impl Sink {
    /// Room for so many Gaussians; the caller has asked for it.
    pub(crate) fn with_capacity(degree: usize, count: u64) -> Self {
        let count = usize::try_from(count).unwrap_or(0);
        Self {
            all: Gaussians::with_capacity(degree, count),
            read: 0,
            left_out: 0,
            first: None,
        }
    }

    /// Takes the next one, with its coefficients of degrees 1 and more, red, green and blue of each in turn.
    pub(crate) fn push(&mut self, stored: &Stored, coefficients: &[f32]) {
        if self.all.is_empty() && stored.centre.is_finite() {
            let is_far = stored.centre.abs().max_element() >= FAR;
            self.all.origin_in_world = match is_far {
                true => stored.centre.round(),
                false => DVec3::ZERO,
            };
        }
        let gaussian = Gaussian {
            centre: (stored.centre - self.all.origin_in_world).as_vec3(),
            rotation: stored.rotation,
            scales: stored.scales,
            opacity: stored.opacity,
            colour: stored.colour,
        };
        if let Err(why) = self.all.push(&gaussian, coefficients) {
            self.left_out += 1;
            self.first.get_or_insert((self.read, why));
        }
        self.read += 1;
    }

    /// The Gaussians; notes say how many were left out.
    pub(crate) fn finish(self, notes: &mut Vec<String>) -> Result<Gaussians, Fault> {
        let Self {
            all,
            read,
            left_out,
            first,
        } = self;
        let Some((number, why)) = first else {
            return match read {
                0 => Err(Fault::Invalid(
                    "it holds no Gaussian: there is nothing to draw".to_owned(),
                )),
                _ => Ok(all),
            };
        };
        if all.is_empty() {
            return Err(Fault::Invalid(format!(
                "none of its {read} Gaussians can be drawn: of number {number}, {why}"
            )));
        }
        notes.push(format!(
            "{left_out} of {read} Gaussians are left out: of the first such, number {number}, {why}"
        ));
        Ok(all)
    }
}

/// The part of light that stays, from the logarithm of odds with which training works.
pub(crate) fn from_logit(logit: f32) -> f32 {
    1.0 / (1.0 + (-logit).exp())
}

/// A quaternion from three components and the place of the largest, which is positive; the order of the four is the caller's.
pub(crate) fn smallest_three(three: [f32; 3], largest: usize) -> [f32; 4] {
    let [a, b, c] = three;
    let rest = (1.0 - (a * a + b * b + c * c)).max(0.0).sqrt();
    let mut others = three.into_iter();
    std::array::from_fn(|place| match place == largest {
        true => rest,
        false => others.next().unwrap_or(0.0),
    })
}
