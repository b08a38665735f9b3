//! Three-dimensional Gaussians: soft ellipsoids with an opacity and a colour that depends on the direction of view.
//!
//! [`Gaussians`] holds them in 99 bytes each at most (spherical harmonics of degree 3), as the readers of files and programs push
//! them. Nothing that is not finite gets in.

mod extent;
mod harmonics;
#[cfg(feature = "input")]
mod formats;
#[cfg(feature = "input")]
mod load;

use glam::{DVec3, Quat, Vec3};
use resample_core::narrow::single;

pub use harmonics::{Harmonics, basis};
#[cfg(feature = "input")]
pub use load::{GaussianFormat, GaussianLoadOptions, gaussian_format_of, is_gaussians, load};

/// The space in which colours are blended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BlendSpace {
    /// Display-referred, with the curve of sRGB: as nearly all files are trained.
    #[default]
    Srgb,
    /// Linear light.
    Linear,
}

/// One Gaussian, without the harmonics beyond the constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// Centre, relative to the origin of all, world units.
    pub centre: Vec3,
    /// From the axes of the Gaussian to the world; a unit quaternion.
    pub rotation: Quat,
    /// Standard deviations along its axes, world units, at least 0.
    pub scales: Vec3,
    /// Opacity at its centre, 0 to 1.
    pub opacity: f32,
    /// Colour without the harmonics of higher degrees: 0.5 + 0.282 times the coefficient of degree 0. In the blend space, usually
    /// 0 to 1.
    pub colour: Vec3,
}

/// Why a Gaussian cannot be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// A number is NaN or infinite.
    #[error("{0} is not a finite number")]
    NotFinite(&'static str),
    /// A quaternion of no length.
    #[error("the rotation is a quaternion of length 0")]
    NoRotation,
    /// A number of coefficients that no degree has.
    #[error("{0} coefficients of spherical harmonics; expected {1}")]
    Coefficients(usize, usize),
}

/// Three-dimensional Gaussians in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gaussians {
    /// World position that the centres are relative to.
    pub origin_in_world: DVec3,
    /// The space in which their colours are blended.
    pub blend_space: BlendSpace,
    centres: Vec<Vec3>,
    /// x, y and z of unit quaternions whose w is at least 0.
    rotations: Vec<[f32; 3]>,
    scales: Vec<Vec3>,
    opacities: Vec<f32>,
    colours: Vec<Vec3>,
    harmonics: Harmonics,
}

impl Gaussians {
    /// None yet, with room for `count`; harmonics of `degree` (0 to 3).
    pub fn with_capacity(degree: usize, count: usize) -> Self {
        Self {
            origin_in_world: DVec3::ZERO,
            blend_space: BlendSpace::Srgb,
            centres: Vec::with_capacity(count),
            rotations: Vec::with_capacity(count),
            scales: Vec::with_capacity(count),
            opacities: Vec::with_capacity(count),
            colours: Vec::with_capacity(count),
            harmonics: Harmonics::with_capacity(degree, count),
        }
    }

    /// Adds one. `coefficients` are those of degrees 1 to [`degree`](Self::degree), red, green and blue of each in turn.
    ///
    /// Rotations are normalised, scales taken without their sign, opacities brought into 0 to 1.
    ///
    /// # Errors
    /// A number that is not finite, a quaternion of length 0, another number of coefficients.
    pub fn push(&mut self, gaussian: &Gaussian, coefficients: &[f32]) -> Result<(), Refused> {
        let wanted = self.harmonics.per_gaussian();
        if coefficients.len() != wanted {
            return Err(Refused::Coefficients(coefficients.len(), wanted));
        }
        let named = [
            ("centre", gaussian.centre.is_finite()),
            ("rotation", gaussian.rotation.is_finite()),
            ("scale", gaussian.scales.is_finite()),
            ("opacity", gaussian.opacity.is_finite()),
            ("colour", gaussian.colour.is_finite()),
            (
                "a coefficient of the spherical harmonics",
                coefficients.iter().all(|c| c.is_finite()),
            ),
        ];
        if let Some((name, _)) = named.iter().find(|(_, is_finite)| !is_finite) {
            return Err(Refused::NotFinite(name));
        }
        // In f64, whose squares cannot overflow.
        let rotation = gaussian.rotation.as_dquat();
        let length = rotation.length();
        if length == 0.0 {
            return Err(Refused::NoRotation);
        }
        let unit = rotation / length.copysign(rotation.w);
        self.centres.push(gaussian.centre);
        self.rotations.push([unit.x, unit.y, unit.z].map(single));
        self.scales.push(gaussian.scales.abs());
        self.opacities.push(gaussian.opacity.clamp(0.0, 1.0));
        self.colours.push(gaussian.colour);
        self.harmonics.push(coefficients);
        Ok(())
    }

    /// Gaussians.
    pub fn len(&self) -> usize {
        self.centres.len()
    }

    /// Returns true if there are no Gaussians.
    pub fn is_empty(&self) -> bool {
        self.centres.is_empty()
    }

    /// Degree of the spherical harmonics, 0 to 3.
    pub fn degree(&self) -> usize {
        self.harmonics.degree()
    }

    /// Bytes of all.
    pub fn bytes(&self) -> usize {
        self.len() * (4 * (3 + 3 + 3 + 1 + 3)) + self.harmonics.bytes()
    }

    /// Gaussian `index`.
    pub fn get(&self, index: usize) -> Gaussian {
        let [x, y, z] = self.rotations[index];
        let w2 = 1.0 - (f64::from(x).powi(2) + f64::from(y).powi(2) + f64::from(z).powi(2));
        Gaussian {
            centre: self.centres[index],
            rotation: Quat::from_xyzw(x, y, z, single(w2.max(0.0).sqrt())),
            scales: self.scales[index],
            opacity: self.opacities[index],
            colour: self.colours[index],
        }
    }

    /// Centres, relative to the origin of all, world units.
    pub fn centres(&self) -> &[Vec3] {
        &self.centres
    }

    /// The coefficients of degrees 1 and more of Gaussian `index`.
    pub fn coefficients(&self, index: usize) -> impl Iterator<Item = f32> {
        self.harmonics.coefficients(index)
    }

    /// The colour of Gaussian `index` seen along `direction`, a unit vector from the eye to its centre in world space: at least 0,
    /// in the blend space.
    pub fn colour_towards(&self, index: usize, direction: Vec3) -> Vec3 {
        let colour = self.colours[index] + self.harmonics.towards(index, direction);
        colour.max(Vec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaussian() -> Gaussian {
        Gaussian {
            centre: Vec3::new(1.0, -2.0, 3.0),
            rotation: Quat::from_xyzw(0.2, -0.4, 0.1, -0.8),
            scales: Vec3::new(0.1, -0.2, 0.0),
            opacity: 1.5,
            colour: Vec3::new(0.5, 0.25, 2.0),
        }
    }

    #[test]
    fn a_gaussian_comes_back_normalised() {
        let mut all = Gaussians::with_capacity(0, 1);
        all.push(&gaussian(), &[]).expect("taken");
        let got = all.get(0);
        let wanted = gaussian().rotation.normalize();
        assert!(got.rotation.dot(wanted).abs() > 1.0 - 1e-6, "{got:?}");
        assert!(got.rotation.w >= 0.0);
        assert_eq!(got.scales, Vec3::new(0.1, 0.2, 0.0));
        assert_eq!(got.opacity, 1.0);
        assert_eq!(got.colour, gaussian().colour);
    }

    #[test]
    fn what_is_not_finite_is_refused() {
        let mut all = Gaussians::with_capacity(1, 1);
        let scales = Vec3::new(1.0, f32::NAN, 1.0);
        let bad = Gaussian {
            scales,
            ..gaussian()
        };
        assert_eq!(all.push(&bad, &[0.0; 9]), Err(Refused::NotFinite("scale")));
        let flat = Gaussian {
            rotation: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0),
            ..gaussian()
        };
        assert_eq!(all.push(&flat, &[0.0; 9]), Err(Refused::NoRotation));
        let short = all.push(&gaussian(), &[0.0; 8]);
        assert_eq!(short, Err(Refused::Coefficients(8, 9)));
        assert!(all.is_empty());
    }

    #[test]
    fn a_gaussian_of_degree_three_takes_less_than_a_hundred_bytes() {
        let mut all = Gaussians::with_capacity(3, 1);
        all.push(&gaussian(), &[0.25; 45]).expect("taken");
        assert_eq!(all.bytes(), 99);
    }
}
