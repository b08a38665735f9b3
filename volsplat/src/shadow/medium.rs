//! Mean extinction between two neighbours in a field.

use resample_core::narrow::single;

use crate::slabs::settings::{ChannelSettings, Reading, Role};
use crate::slabs::table::TransferTable;

/// How numbers at vertices become extinction.
pub(super) enum Medium {
    /// They are scalars of one channel.
    Scalars(Integral),
    /// They are extinction.
    Extinction,
}

/// The integral of a transfer function's extinction over the places of its table.
pub(super) struct Integral {
    scale: f32,
    shift: f32,
    strengths: Vec<f32>,
    /// Sums of the strengths before each place; differences of them stay exact behind opaque peaks.
    sums: Vec<f64>,
}

/// A place in the table, entries from its first, and the integral up to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    at: f32,
    sum: f64,
}

/// Extinction behind a surface, per opacity unit: a twentieth of it lets 1/20 through.
const BEHIND_SURFACE: f32 = 64.0;

/// Two places this close have the strength between them.
const LEAST_SPAN: f32 = 1.0 / 64.0;

impl Medium {
    /// The medium of these channels; `follows_gradient` where extinction depends on the gradient.
    pub(super) fn new(channels: &[ChannelSettings], follows_gradient: bool) -> Self {
        match channels {
            [only]
                if only.reading == Reading::Trilinear
                    && only.role == Role::Extinction
                    && !follows_gradient =>
            {
                Self::Scalars(Integral::new(&only.table))
            }
            _ => Self::Extinction,
        }
    }

    /// A surface at a scalar, of nothing on one side and opaque matter on the other. `table` tells how finely scalars differ.
    pub(super) fn of_surface(table: &TransferTable, scalar: f32) -> Self {
        let [scale, shift] = table.place_of_scalar();
        Self::Scalars(Integral {
            scale,
            shift: shift + 1.0 - (scalar * scale + shift),
            strengths: vec![0.0, BEHIND_SURFACE],
            sums: vec![0.0; 2],
        })
    }

    /// The mean extinction, per opacity unit, where the number goes from one to another evenly.
    #[inline(always)]
    pub(super) fn mean(&self, from: f32, to: f32) -> f32 {
        match self {
            Self::Scalars(integral) => integral.mean(from, to),
            Self::Extinction => 0.5 * (from + to),
        }
    }
}

impl Integral {
    fn new(table: &TransferTable) -> Self {
        let strengths = table.strengths().to_vec();
        let mut sums = vec![0.0];
        let mut sum = 0.0;
        for strength in &strengths {
            sum += f64::from(*strength);
            sums.push(sum);
        }
        let [scale, shift] = table.place_of_scalar();
        Self {
            scale,
            shift,
            strengths,
            sums,
        }
    }

    /// The mean extinction where the scalar goes from one to another evenly.
    #[inline(always)]
    fn mean(&self, from: f32, to: f32) -> f32 {
        self.between(self.place(from), self.place(to))
    }

    /// A scalar's place in the table.
    #[inline(always)]
    pub(super) fn place(&self, scalar: f32) -> Place {
        self.at(scalar * self.scale + self.shift)
    }

    /// The place half of the way between two.
    #[inline(always)]
    pub(super) fn middle(&self, from: Place, to: Place) -> Place {
        self.at(0.5 * (from.at + to.at))
    }

    #[inline(always)]
    fn at(&self, at: f32) -> Place {
        let index = self.index(at);
        let strength = f64::from(self.strengths[index]);
        // Beyond its ends the table goes on as it ends.
        let sum = self.sums[index] + strength * f64::from(at - index as f32);
        Place { at, sum }
    }

    /// The mean extinction between two places.
    #[inline(always)]
    pub(super) fn between(&self, from: Place, to: Place) -> f32 {
        let span = to.at - from.at;
        if span.abs() < LEAST_SPAN {
            return self.strengths[self.index(0.5 * (from.at + to.at))];
        }
        single((to.sum - from.sum) / f64::from(span))
    }

    /// The entry of the table that a place lies in.
    #[inline(always)]
    fn index(&self, place: f32) -> usize {
        let last = self.strengths.len() - 1;
        whole_place(place.clamp(0.0, last as f32)).min(last)
    }
}

#[inline(always)]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "places are 0 or more, and fewer than 2^16"
)]
fn whole_place(place: f32) -> usize {
    place as usize
}
