//! Stored numbers to the numbers that they stand for: slope times the stored value plus intercept.
//!
//! Takes voxels and two factors, gives voxels of the smallest type that holds every result: an integer type where both
//! factors are whole (as in computed tomography), else single precision for stored numbers of up to 16 bits and for
//! singles, double precision for the rest.

use rayon::prelude::*;

use crate::volume::{Voxels, scalar, with_voxels};

/// A linear map of every stored number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rescale {
    /// Finite and not 0.
    pub(crate) slope: f64,
    /// Finite.
    pub(crate) intercept: f64,
}

impl Rescale {
    /// Changes nothing.
    pub(crate) const NONE: Self = Self {
        slope: 1.0,
        intercept: 0.0,
    };

    pub(crate) fn apply(self, voxels: Voxels) -> Voxels {
        if self == Self::NONE {
            return voxels;
        }
        if let Some(whole) = self.whole(&voxels) {
            return whole;
        }
        match voxels {
            Voxels::U32(_) | Voxels::I32(_) | Voxels::F64(_) => {
                Voxels::F64(self.mapped(&voxels, |v| v))
            }
            _ => Voxels::F32(self.mapped(&voxels, |v| v as f32)),
        }
    }

    /// The results as integers, if all are and fit.
    fn whole(self, voxels: &Voxels) -> Option<Voxels> {
        let is_integer = !matches!(voxels, Voxels::F32(_) | Voxels::F64(_));
        if !is_integer
            || voxels.is_empty()
            || self.slope.fract() != 0.0
            || self.intercept.fract() != 0.0
        {
            return None;
        }
        let ends: [f64; 2] = voxels.finite_range().into();
        let ends = ends.map(|end| self.of(end));
        let fits = |low: f64, high: f64| ends.iter().all(|end| (low..=high).contains(end));
        // All values are whole and within the range of the type, so the conversions are exact.
        if fits(0.0, f64::from(u8::MAX)) {
            Some(Voxels::U8(self.mapped(voxels, |v| v as u8)))
        } else if fits(f64::from(i8::MIN), f64::from(i8::MAX)) {
            Some(Voxels::I8(self.mapped(voxels, |v| v as i8)))
        } else if fits(0.0, f64::from(u16::MAX)) {
            Some(Voxels::U16(self.mapped(voxels, |v| v as u16)))
        } else if fits(f64::from(i16::MIN), f64::from(i16::MAX)) {
            Some(Voxels::I16(self.mapped(voxels, |v| v as i16)))
        } else if fits(0.0, f64::from(u32::MAX)) {
            Some(Voxels::U32(self.mapped(voxels, |v| v as u32)))
        } else if fits(f64::from(i32::MIN), f64::from(i32::MAX)) {
            Some(Voxels::I32(self.mapped(voxels, |v| v as i32)))
        } else {
            None
        }
    }

    fn of(self, stored: f64) -> f64 {
        stored * self.slope + self.intercept
    }

    fn mapped<T: Clone + Default + Send>(
        self,
        voxels: &Voxels,
        to: impl Fn(f64) -> T + Sync + Send,
    ) -> Vec<T> {
        let mut mapped = vec![T::default(); voxels.len()];
        let mut rest = mapped.as_mut_slice();
        let mut parts = Vec::new();
        for part in voxels.parts() {
            let (own, others) = rest.split_at_mut(part.len());
            parts.push((own, part));
            rest = others;
        }
        parts.into_par_iter().for_each(|(mapped, part)| {
            with_voxels!(voxels, stored => {
                for (mapped, &value) in mapped.iter_mut().zip(&stored[part]) {
                    *mapped = to(self.of(scalar(value)));
                }
            });
        });
        mapped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_factors_give_the_smallest_integer_type() {
        let rescale = |slope, intercept, voxels| Rescale { slope, intercept }.apply(voxels);
        let stored = || Voxels::U16(vec![0, 1024, 4095]);
        assert_eq!(
            rescale(1.0, -1024.0, stored()),
            Voxels::I16(vec![-1024, 0, 3071]),
            "Hounsfield units"
        );
        assert_eq!(rescale(1.0, 0.0, stored()), stored(), "nothing to do");
        assert_eq!(
            rescale(-1.0, 4095.0, stored()),
            Voxels::U16(vec![4095, 3071, 0]),
            "reversed"
        );
        assert_eq!(
            rescale(1e6, 0.0, stored()),
            Voxels::U32(vec![0, 1_024_000_000, 4_095_000_000]),
            "large"
        );
        assert_eq!(
            rescale(2.0, -3.0, Voxels::I8(vec![0, 1])),
            Voxels::I8(vec![-3, -1]),
            "small"
        );
        assert_eq!(
            rescale(1.0, -5.0, Voxels::U16(vec![0, 40_005])),
            Voxels::I32(vec![-5, 40_000]),
            "below 0 and beyond 16 bits with a sign"
        );
        assert_eq!(
            rescale(-1.0, 100.0, Voxels::U8(vec![0, 250])),
            Voxels::I16(vec![100, -150]),
            "below 0 and beyond 8 bits with a sign"
        );
        assert_eq!(
            rescale(1.0, -5.0, Voxels::U32(vec![0, 3_000_000_005])),
            Voxels::F64(vec![-5.0, 3e9]),
            "below 0 and beyond 32 bits with a sign"
        );
    }

    #[test]
    fn fractions_give_floats_of_the_right_width() {
        let shifted = Rescale {
            slope: 2.0,
            intercept: 0.5,
        };
        assert_eq!(
            shifted.apply(Voxels::U8(vec![0, 3])),
            Voxels::F32(vec![0.5, 6.5]),
            "a fraction in the intercept alone"
        );
        let half = Rescale {
            slope: 0.5,
            intercept: 1.0,
        };
        assert_eq!(
            half.apply(Voxels::U8(vec![0, 3])),
            Voxels::F32(vec![1.0, 2.5])
        );
        assert_eq!(
            half.apply(Voxels::I32(vec![i32::MAX])),
            Voxels::F64(vec![1_073_741_824.5]),
            "exact"
        );
        assert_eq!(half.apply(Voxels::F64(vec![3.0])), Voxels::F64(vec![2.5]));
        let large = Rescale {
            slope: 1e9,
            intercept: 0.0,
        };
        assert_eq!(
            large.apply(Voxels::I32(vec![-5, 5])),
            Voxels::F64(vec![-5e9, 5e9]),
            "no integer holds it"
        );
    }
}
