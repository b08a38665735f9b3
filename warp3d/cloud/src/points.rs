//! The points of a scan as they come in, and the check that they can be drawn.

use glam::DVec3;

use resample_core::Error;

/// Points with colours, in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// The place that positions are relative to, world units.
    pub origin_in_world: DVec3,
    /// Places of the points relative to the origin, world units.
    pub positions: Vec<[f32; 3]>,
    /// Colours of the points, sRGB.
    pub colours: Vec<[u8; 3]>,
}

/// Most points of one cloud: 65536 chunks of 65536, the most that tiles can number, end at u32; half of it is kept as a margin.
const MOST_POINTS: usize = 1 << 31;

/// Farthest coordinate of a position: its square, and sums of 64 squares, stay far below the largest f32.
const FARTHEST: f32 = 1e15;

impl PointCloud {
    /// Checks that there are points, a colour for each, and finite places.
    ///
    /// # Errors
    /// [`Error::Input`] names the first thing that is wrong.
    pub fn validate(&self) -> Result<(), Error> {
        let (points, colours) = (self.positions.len(), self.colours.len());
        if points == 0 {
            return Err(Error::Input(
                "the cloud has no points; give at least one".into(),
            ));
        }
        if points > MOST_POINTS {
            return Err(Error::Input(format!(
                "the cloud has {points} points, more than {MOST_POINTS}; split it"
            )));
        }
        if points != colours {
            return Err(Error::Input(format!(
                "the cloud has {points} positions and {colours} colours, expected one colour per position"
            )));
        }
        if !self.origin_in_world.is_finite() {
            return Err(Error::Input(format!(
                "the origin of the cloud is {}, expected finite coordinates",
                self.origin_in_world
            )));
        }
        let usable = |p: &[f32; 3]| p.iter().all(|c| c.abs() <= FARTHEST);
        match self.positions.iter().position(|p| !usable(p)) {
            None => Ok(()),
            Some(index) => Err(Error::Input(format!(
                "point {index} lies at {:?}, expected finite coordinates of at most {FARTHEST:e} from the origin; \
                 remove it",
                self.positions[index]
            ))),
        }
    }
}
