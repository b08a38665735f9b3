//! The size of moving frames: as large as the time of the last ones allows.

/// Time that a moving frame may take, ms: with encoding and the browser's own time, 25 frames a second.
const TARGET_MS: f64 = 33.0;

/// Time for which a picture becomes smaller than half of its sides, ms: 10 frames a second.
const SLOW_MS: f64 = 85.0;

/// The step of half the sides.
const HALF: usize = 3;

/// Least side, as a share of the full one: a smaller picture shows too little to steer by.
const LEAST: f64 = 0.25;

/// How fast the size follows: the share of a new estimate.
const SHARE: f64 = 0.5;

/// Scales between which nothing changes, so that the picture does not breathe.
const STEPS: [f64; 7] = [1.0, 0.8, 0.65, 0.5, 0.4, 0.32, LEAST];

/// Chooses the size of moving frames.
#[derive(Clone, Debug)]
pub(crate) struct Ladder {
    /// Time of a full-size frame, ms, as far as it was seen.
    full_ms: f64,
    step: usize,
}

impl Default for Ladder {
    /// Begins in the middle.
    fn default() -> Self {
        Self {
            full_ms: TARGET_MS / (0.5 * 0.5),
            step: HALF,
        }
    }
}

impl Ladder {
    /// Width and height of the next moving frame, px.
    pub(crate) fn size(&self, full: [u32; 2]) -> [u32; 2] {
        let scale = STEPS[self.step];
        full.map(|side| ((f64::from(side) * scale).round() as u32).clamp(1, side.max(1)))
    }

    /// Takes the time of a frame of the present size, ms.
    pub(crate) fn took(&mut self, ms: f64) {
        let scale = STEPS[self.step];
        self.full_ms += SHARE * (ms / (scale * scale) - self.full_ms);
        let allowed_ms = |step: usize| if step < HALF { TARGET_MS } else { SLOW_MS };
        let fits = |step: usize, slack: f64| {
            self.full_ms * STEPS[step].powi(2) <= slack * allowed_ms(step)
        };
        if !fits(self.step, 1.2) {
            self.step = (self.step + 1).min(STEPS.len() - 1);
        } else if self.step > 0 && fits(self.step - 1, 0.9) {
            self.step -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The side of a picture of 800 px after many frames on a machine that takes `full_ms` for the whole.
    fn settled(full_ms: f64) -> u32 {
        let mut ladder = Ladder::default();
        let mut sides = Vec::new();
        for _ in 0..60 {
            let side = ladder.size([800, 600])[0];
            ladder.took(full_ms * (f64::from(side) / 800.0).powi(2));
            sides.push(side);
        }
        let last = &sides[40..];
        assert!(
            last.iter().all(|side| side == &last[0]),
            "it does not breathe: {sides:?}"
        );
        last[0]
    }

    #[test]
    fn the_size_follows_the_time_and_comes_to_rest() {
        assert_eq!(settled(5.0), 800, "fast machines show all pixels");
        assert_eq!(settled(130.0), 400);
        assert_eq!(
            settled(320.0),
            400,
            "half of the sides at ten frames a second"
        );
        assert_eq!(settled(1e6), 200, "never smaller than a quarter");
        assert!(settled(60.0) < settled(35.0));
    }
}
