//! A list of samples that wait to be classified, and of those among them that show something.

use crate::bricks::cells::{CELLS, LAST_CELL, VERTEX_SIDE};

/// Lanes of a vector of packed samples: a block of 4x4 pixels.
pub(crate) const LANES: usize = 16;

/// Samples that are classified together: few enough that all that is known of them stays in the first-level cache.
const BATCH: usize = 256;

/// Room for a batch and a vector beyond it.
pub(crate) const ROOM: usize = BATCH + LANES;

/// A number for each sample.
pub(crate) type Numbers = [f32; ROOM];

/// Samples in the order in which they were found.
#[derive(Clone, Debug)]
pub(crate) struct PackedSamples {
    count: usize,
    /// Number of the cell in the brick, x fastest, below [`PIXEL_SHIFT`], and the pixel's in the tile.
    pub(crate) place: [u32; ROOM],
    /// Position in the cell.
    pub(crate) share: [Numbers; 3],
    /// The field.
    pub(crate) scalar: Numbers,
    /// Camera z; only where depth is wanted.
    pub(crate) camera_z: Numbers,
    pub(crate) shown: ShownSamples,
    pub(crate) between: BetweenSteps,
}

/// Results of one step of a batch that the next one reads. They are kept from batch to batch: clearing the arrays took a twentieth of
/// a frame.
#[derive(Clone, Debug)]
pub(crate) struct BetweenSteps {
    /// The faces of the samples' cells, nearer and farther along z.
    pub(crate) faces: [[u32; ROOM]; 2],
    /// The scalars at the corners of the cells.
    pub(crate) corners: [Numbers; 8],
    /// The places in the tables of the first vertices of the cells of samples that show something.
    pub(crate) vertex: [u32; ROOM],
    /// The differences of bytes at both ends of the four edges along x of the cells of samples that show something.
    pub(crate) differences: [[[u32; 2]; ROOM]; 4],
    /// Places in the transfer function's table, extinctions there, and opacity units of a slab.
    pub(crate) entry: [i32; ROOM],
    pub(crate) strength: Numbers,
    pub(crate) units: Numbers,
    /// Gradients and rays of the samples that show something, in the world.
    pub(crate) gradient: [Numbers; 3],
    pub(crate) ray: [Numbers; 3],
}

/// Samples that show something.
#[derive(Clone, Debug)]
pub(crate) struct ShownSamples {
    pub(crate) count: usize,
    /// As in [`PackedSamples`].
    pub(crate) place: [u32; ROOM],
    pub(crate) share: [Numbers; 3],
    pub(crate) camera_z: Numbers,
    /// Place in the transfer function's table.
    pub(crate) entry: [u32; ROOM],
    pub(crate) opacity: Numbers,
    /// Factors of the colour by light.
    pub(crate) body: Numbers,
    pub(crate) highlight: Numbers,
}

/// Where the pixel begins in a sample's place.
pub(crate) const PIXEL_SHIFT: u32 = 16;

/// Bits of a sample's place that are its cell.
pub(crate) const CELL_MASK: u32 = CELLS as u32 - 1;

/// The place in the tables of the first vertex of a sample's cell.
#[inline(always)]
pub(crate) fn vertex(place: u32) -> usize {
    let cell = (place & CELL_MASK) as usize;
    (cell + (cell >> 3 & 7) + (2 * (VERTEX_SIDE - 1) + 1) * (cell >> 6)).min(LAST_CELL)
}

impl Default for PackedSamples {
    fn default() -> Self {
        let zero = [0.0; ROOM];
        Self {
            count: 0,
            place: [0; ROOM],
            share: [zero; 3],
            scalar: zero,
            camera_z: zero,
            shown: ShownSamples {
                count: 0,
                place: [0; ROOM],
                share: [zero; 3],
                camera_z: zero,
                entry: [0; ROOM],
                opacity: zero,
                body: zero,
                highlight: zero,
            },
            between: BetweenSteps {
                faces: [[0; ROOM]; 2],
                corners: [zero; 8],
                vertex: [0; ROOM],
                differences: [[[0; 2]; ROOM]; 4],
                entry: [0; ROOM],
                strength: zero,
                units: zero,
                gradient: [zero; 3],
                ray: [zero; 3],
            },
        }
    }
}

impl PackedSamples {
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.count.min(BATCH)
    }

    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Takes so many in, of which there are at most a vector.
    #[inline(always)]
    pub(crate) fn grow(&mut self, count: usize) {
        self.count += count;
    }

    /// Returns true if another vector of samples might not fit.
    #[inline(always)]
    pub(crate) fn is_full(&self) -> bool {
        self.count + LANES > BATCH
    }
}
