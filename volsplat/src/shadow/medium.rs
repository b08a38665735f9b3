//! Mean extinction between two neighbours in a field.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16};
use resample_core::narrow::{cell, single};

use crate::slabs::settings::{ChannelSettings, Reading, Role};
use crate::slabs::table::{PLACES, TransferTable};

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
    /// The last place; beyond it the table goes on as it ends.
    last: f32,
    /// Below this place all is transparent.
    first_shown: f32,
    strengths: Box<[f32; PLACES]>,
    /// Sums of the strengths before each place; differences of them stay exact behind opaque peaks.
    sums: Box<[f64; PLACES]>,
}

/// A place in the table, entries from its first, and the integral up to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    at: f32,
    sum: f64,
}

/// Sixteen places in the table. The integrals up to them are the sums up to their entries, and the rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places<S: Simd> {
    pub(super) at: f32x16<S>,
    pub(super) sums: [f64; 16],
    pub(super) rest: f32x16<S>,
    pub(super) strengths: f32x16<S>,
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
                let table = &only.table;
                Self::Scalars(Integral::new(table.place_of_scalar(), table.strengths()))
            }
            _ => Self::Extinction,
        }
    }

    /// A surface at a scalar, of nothing on one side and opaque matter on the other. `table` tells how finely scalars differ.
    pub(super) fn of_surface(table: &TransferTable, scalar: f32) -> Self {
        let [scale, shift] = table.place_of_scalar();
        let shift = shift + 1.0 - (scalar * scale + shift);
        Self::Scalars(Integral::new([scale, shift], &[0.0, BEHIND_SURFACE]))
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
    /// A scalar's place is itself times the scale plus the shift; the table has a strength for each place.
    fn new([scale, shift]: [f32; 2], of_places: &[f32]) -> Self {
        let mut strengths = Box::new([0.0; PLACES]);
        let mut sums = Box::new([0.0; PLACES]);
        let mut sum = 0.0;
        let transparent = of_places.iter().take_while(|strength| **strength == 0.0);
        let first_shown = match transparent.count() {
            0 => f32::NEG_INFINITY,
            place => place as f32,
        };
        for (place, strength) in of_places.iter().enumerate() {
            (strengths[place], sums[place]) = (*strength, sum);
            sum += f64::from(*strength);
        }
        Self {
            scale,
            shift,
            last: (of_places.len() - 1) as f32,
            first_shown,
            strengths,
            sums,
        }
    }

    /// The mean extinction where the scalar goes from one to another evenly.
    #[inline(always)]
    fn mean(&self, from: f32, to: f32) -> f32 {
        let [from, to] = [from, to].map(|scalar| self.at(scalar * self.scale + self.shift));
        let span = to.at - from.at;
        if span.abs() < LEAST_SPAN {
            return self.strengths[self.index(0.5 * (from.at + to.at))];
        }
        single((to.sum - from.sum) / f64::from(span))
    }

    #[inline(always)]
    fn at(&self, at: f32) -> Place {
        let index = self.index(at);
        let strength = f64::from(self.strengths[index]);
        let sum = self.sums[index] + strength * f64::from(at - index as f32);
        Place { at, sum }
    }

    /// The entry of the table that a place lies in.
    #[inline(always)]
    fn index(&self, place: f32) -> usize {
        cell(place.clamp(0.0, self.last)) % PLACES
    }

    /// The places of scalars; any place where they are NaN.
    #[inline(always)]
    pub(super) fn places<S: Simd>(&self, simd: S, scalars: f32x16<S>) -> Places<S> {
        let at = scalars.mul_add(
            f32x16::splat(simd, self.scale),
            f32x16::splat(simd, self.shift),
        );
        self.places_at(simd, at)
    }

    /// The places half of the way to others.
    #[inline(always)]
    pub(super) fn middle<S: Simd>(
        &self,
        simd: S,
        from: &Places<S>,
        scalars: f32x16<S>,
    ) -> Places<S> {
        let at = scalars.mul_add(
            f32x16::splat(simd, self.scale),
            f32x16::splat(simd, self.shift),
        );
        self.places_at(simd, (from.at + at) * 0.5)
    }

    #[inline(always)]
    fn places_at<S: Simd>(&self, simd: S, at: f32x16<S>) -> Places<S> {
        let is_shown = at.simd_ge(f32x16::splat(simd, self.first_shown));
        if !is_shown.any_true() {
            let none = f32x16::splat(simd, 0.0);
            return Places {
                at,
                sums: [0.0; 16],
                rest: none,
                strengths: none,
            };
        }
        let bounded = at
            .max(f32x16::splat(simd, 0.0))
            .min(f32x16::splat(simd, self.last));
        let entries = bounded.to_int::<i32x16<S>>();
        let (mut sums, mut strengths) = ([0.0; 16], [0.0; 16]);
        for lane in 0..16 {
            let entry = entries[lane] as usize % PLACES;
            (sums[lane], strengths[lane]) = (self.sums[entry], self.strengths[entry]);
        }
        let strengths = f32x16::simd_from(simd, strengths);
        Places {
            at,
            sums,
            rest: strengths * (at - entries.to_float::<f32x16<S>>()),
            strengths,
        }
    }

    /// The mean extinction between places; NaN where one is.
    #[inline(always)]
    pub(super) fn between<S: Simd>(&self, simd: S, from: &Places<S>, to: &Places<S>) -> f32x16<S> {
        let mut sums = [0.0; 16];
        for (sum, (from, to)) in sums.iter_mut().zip(from.sums.iter().zip(&to.sums)) {
            *sum = single(to - from);
        }
        let span = to.at - from.at;
        let mean = (f32x16::simd_from(simd, sums) + (to.rest - from.rest)) / span;
        let is_short = span.abs().simd_lt(f32x16::splat(simd, LEAST_SPAN));
        is_short.select(to.strengths, mean)
    }
}
