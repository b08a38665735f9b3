//! The surfaces at each pixel near an edge, grouped once, for all the pixels whose Gaussian reaches it.
//!
//! Pieces of joined cells that share a corner are one surface, as their numbers alone show; other pieces are
//! one if the one lies on the plane of the other.

use crate::surfaces::patch::{Patch, share_a_corner};
use crate::surfaces::piece::NO_PATCH;
use crate::surfaces::surface::Surfaces;

/// One surface in one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SlotPart {
    /// The places of the finer lattice that see it, one bit each.
    pub(crate) places: u64,
    /// One of its pieces.
    pub(crate) id: u32,
    /// The plane of that piece.
    pub(crate) patch: Patch,
}

/// The parts of the slots of a band.
#[derive(Clone, Debug, Default)]
pub(crate) struct SlotParts {
    parts: Vec<SlotPart>,
    /// First part of each slot, and the end.
    first: Vec<u32>,
}

impl SlotParts {
    /// Groups the places of every slot: the first `count` of each `stride` of `pieces`.
    pub(super) fn group(
        &mut self,
        surfaces: &Surfaces,
        pieces: &[u32],
        [count, stride]: [usize; 2],
    ) {
        self.parts.clear();
        self.first.clear();
        self.first.push(0);
        // The last piece of each part of the slot at hand.
        let mut last = Vec::new();
        for places in pieces.chunks_exact(stride) {
            let begin = self.parts.len();
            last.clear();
            for (place, &piece) in places[..count]
                .iter()
                .enumerate()
                .filter(|(_, piece)| **piece != NO_PATCH)
            {
                let parts = &mut self.parts[begin..];
                match find(surfaces, parts, &last, piece) {
                    Ok(part) => {
                        parts[part].places |= 1 << place;
                        last[part] = piece;
                    }
                    Err(patch) => {
                        self.parts.push(SlotPart {
                            places: 1 << place,
                            id: piece,
                            patch,
                        });
                        last.push(piece);
                    }
                }
            }
            self.first.push(self.parts.len() as u32);
        }
    }

    /// The parts of a slot.
    pub(crate) fn of_slot(&self, slot: usize) -> &[SlotPart] {
        &self.parts[self.first[slot] as usize..self.first[slot + 1] as usize]
    }
}

/// The part that a piece belongs to, or the plane of a new one.
fn find(surfaces: &Surfaces, parts: &[SlotPart], last: &[u32], id: u32) -> Result<usize, Patch> {
    let near = last
        .iter()
        .position(|&last| share_a_corner(surfaces, last, id));
    if let Some(part) = near {
        return Ok(part);
    }
    let patch = Patch::new(surfaces, id);
    let tolerance = surfaces.tolerance;
    parts
        .iter()
        .position(|part| one_surface(&part.patch, &patch, tolerance))
        .ok_or(patch)
}

/// Two pixels are separate from this part of the tolerance on: one surface must not hold a jump across which
/// colours are taken apart, four tolerances, at up to three samples' distance.
const STRICTLY: f32 = 0.75;

/// Returns true if two pieces are of the same surface beyond doubt.
pub(super) fn one_beyond_doubt(surfaces: &Surfaces, a: u32, b: u32) -> bool {
    let plane = |id: u32| Patch::new(surfaces, id);
    share_a_corner(surfaces, a, b)
        || one_surface(&plane(a), &plane(b), STRICTLY * surfaces.tolerance)
}

/// Returns true if two pieces are of one plane: the one lies on the other's, as far away as it is, and slopes as it does.
pub(crate) fn one_surface(a: &Patch, b: &Patch, tolerance: f32) -> bool {
    let allowed = f64::from(tolerance) * b.disparity.abs();
    let distance = (a.place - b.place).abs().max_element();
    let expected = a.disparity_at(b.place);
    (expected - b.disparity).abs() <= allowed * (2.0 + distance)
        && (a.slope - b.slope).abs().max_element() <= 2.0 * allowed
}
