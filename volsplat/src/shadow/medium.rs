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

    /// The integral up to a place.
    #[inline(always)]
    fn up_to(&self, place: f32) -> f64 {
        let last = self.strengths.len() - 1;
        let inside = place.clamp(0.0, last as f32);
        let index = whole_place(inside).min(last);
        let strength = f64::from(self.strengths[index]);
        // Beyond its ends the table goes on as it ends.
        self.sums[index] + strength * f64::from(place - index as f32)
    }

    #[inline(always)]
    fn mean(&self, from: f32, to: f32) -> f32 {
        let (from, to) = (
            from.mul_add(self.scale, self.shift),
            to.mul_add(self.scale, self.shift),
        );
        let span = to - from;
        if span.abs() < LEAST_SPAN {
            let last = self.strengths.len() - 1;
            let middle = (0.5 * (from + to)).clamp(0.0, last as f32);
            return self.strengths[whole_place(middle)];
        }
        single((self.up_to(to) - self.up_to(from)) / f64::from(span))
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
