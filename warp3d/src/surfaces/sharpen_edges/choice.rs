//! The two surfaces of which a sample inside a ramp is one.

/// The side of a sample inside a ramp.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Choice {
    /// The largest step of the ramp, relative to the larger end. 0: the sample is in no ramp.
    pub(super) step: f32,
    /// Disparity on the surface of less and on that of more disparity.
    pub(super) sides: [f32; 2],
    /// How far depth leans to the second one: from -1 at the first surface to 1 at the second.
    pub(super) lean: f32,
    /// True if the surface turns back at once: what the ramp tells of its disparity is little.
    pub(super) turns: [bool; 2],
}

impl Choice {
    /// Returns true if the sample is inside a ramp.
    pub(super) fn is_inside(&self) -> bool {
        self.step > 0.0
    }

    /// That of two ramps whose step is larger.
    pub(super) fn or_steeper(self, other: Self) -> Self {
        if other.step > self.step { other } else { self }
    }

    /// The same with the surface of less disparity first.
    pub(super) fn ordered(self) -> Self {
        let Self {
            sides: [a, b],
            turns: [u, v],
            ..
        } = self;
        if a <= b {
            return self;
        }
        Self {
            sides: [b, a],
            lean: -self.lean,
            turns: [v, u],
            ..self
        }
    }
}
