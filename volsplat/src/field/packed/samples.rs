//! A list of samples that wait to be classified, and of those among them that show something.

use crate::bricks::cells::{CELLS, LAST_CELL, VERTEX_SIDE};

/// Lanes of a vector of packed samples: a block of 4x4 pixels.
pub(super) const LANES: usize = 16;

/// Samples that are classified together: few enough that all that is known of them stays in the first-level cache.
const BATCH: usize = 256;

/// Room for a batch and a vector beyond it.
pub(super) const ROOM: usize = BATCH + LANES;

/// A number for each sample.
pub(super) type Numbers = [f32; ROOM];

/// Samples in the order in which they were found.
#[derive(Clone, Debug)]
pub(crate) struct PackedSamples {
    count: usize,
    /// Number of the cell in the brick, x fastest, below [`PIXEL_SHIFT`], and the pixel's in the tile.
    pub(super) place: [u32; ROOM],
    /// Position in the cell.
    pub(super) share: [Numbers; 3],
    /// The field.
    pub(super) scalar: Numbers,
    /// Camera z; only where depth is wanted.
    pub(super) camera_z: Numbers,
    pub(super) shown: ShownSamples,
    pub(super) between: BetweenSteps,
}

/// Results of one step of a batch that the next one reads. They are kept from batch to batch: clearing the arrays took a twentieth of
/// a frame.
#[derive(Clone, Debug)]
pub(super) struct BetweenSteps {
    /// The faces of the samples' cells, nearer and farther along z.
    pub(super) faces: [[u32; ROOM]; 2],
    /// The scalars at the corners of the cells.
    pub(super) corners: [Numbers; 8],
    /// The differences of bytes at both ends of the four edges along x of the cells of samples that show something.
    pub(super) differences: [[[u32; 2]; ROOM]; 4],
    /// Places in the transfer function's table, extinctions there, and opacity units of a slab.
    pub(super) entry: [i32; ROOM],
    pub(super) strength: Numbers,
    pub(super) units: Numbers,
    /// Gradients and rays of the samples that show something, in the world.
    pub(super) gradient: [Numbers; 3],
    pub(super) ray: [Numbers; 3],
}

/// Samples that show something.
#[derive(Clone, Debug)]
pub(super) struct ShownSamples {
    pub(super) count: usize,
    /// As in [`PackedSamples`].
    pub(super) place: [u32; ROOM],
    pub(super) share: [Numbers; 3],
    pub(super) camera_z: Numbers,
    /// Place in the transfer function's table.
    pub(super) entry: [u32; ROOM],
    pub(super) opacity: Numbers,
    /// What light makes of them.
    pub(super) body: Numbers,
    pub(super) highlight: Numbers,
}

/// Where the pixel begins in a sample's place.
pub(super) const PIXEL_SHIFT: u32 = 16;

/// Bits of a sample's place that are its cell.
pub(super) const CELL_MASK: u32 = CELLS as u32 - 1;

/// The place in the tables of the first vertex of a sample's cell.
#[inline(always)]
pub(super) fn vertex(place: u32) -> usize {
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
    pub(super) fn len(&self) -> usize {
        self.count.min(BATCH)
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Takes so many in, of which there are at most a vector.
    #[inline(always)]
    pub(super) fn grow(&mut self, count: usize) {
        self.count += count;
    }

    /// Whether another vector of samples might not fit.
    #[inline(always)]
    pub(super) fn is_full(&self) -> bool {
        self.count + LANES > BATCH
    }
}
