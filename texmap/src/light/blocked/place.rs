//! The light at a place.

use glam::Vec3;

use crate::light::around::square_from_direction;
use resample_core::narrow::cell;

/// Spherical harmonics of light.
pub(crate) const HARMONICS: usize = 9;

/// Cells along the side of the maps of visibility, the sharpest first.
pub(crate) const SIDES: [usize; 2] = [8, 4];

/// Where each map begins; each has a border of one cell.
pub(crate) const STARTS: [usize; 2] = [0, 10 * 10];

/// Cells of all maps.
pub(crate) const CELLS: usize = 10 * 10 + 6 * 6;

/// Where a place says whether it counts: beside red, green and blue of the first harmonic.
pub(crate) const COUNTS: usize = 3;

/// The light at a place.
#[derive(Clone, Debug)]
pub(crate) struct PlaceLight {
    /// The light that arrives, as the environment's irradiance: nine harmonics of red, green and blue. Beside the first stands 1, or 0 where
    /// the place lies inside of something and does not count.
    pub(crate) harmonics: [[f32; 4]; HARMONICS],
    /// The share of the light from each direction that arrives, in 255ths, on octahedral squares.
    pub(crate) visible: [u8; CELLS],
}

/// The cell of the sharpest maps in which a direction of any length lies.
pub(crate) fn cell_of(direction: Vec3) -> usize {
    let [x, y] = square_from_direction(direction).map(|at| {
        let at = (at * 0.5 + 0.5) * SIDES[0] as f32;
        cell(at).min(SIDES[0] - 1)
    });
    y * SIDES[0] + x
}
