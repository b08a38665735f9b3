//! One range for the depths of a whole sequence.
//!
//! Takes the depth files and what their numbers mean, gives the stored numbers at the far and at the near end, from frames
//! that are evenly spread over all of them: whichever part of the sequence a process draws, it finds the same.

use std::path::PathBuf;

use super::meaning::DepthMeaning;
use super::range::{RangeOf, SHARE};
use crate::Error;
use resample_io::files::fault;
use resample_io::{Part, Room, depth};

/// Frames of a sequence that are looked through, evenly spread: a thing that is missed shows in fewer than one frame of
/// these, so that its numbers are less than [`SHARE`] of all, even if it fills those frames.
const FRAMES: usize = (1.0 / SHARE) as usize;

/// The range of the numbers of a sequence's depth files, the same whichever of its pictures are drawn; `None` where the
/// meaning needs none. A file may take `room` to be decoded; `watch` takes the share that is done.
///
/// # Errors
/// A file that cannot be read, or none that holds a usable number.
pub fn range_of_sequence(
    files: &[Part],
    meaning: &DepthMeaning,
    room: Room,
    watch: &mut dyn FnMut(f64),
) -> Result<Option<[f64; 2]>, Error> {
    if !meaning.may_need_range() {
        return Ok(None);
    }
    let count = files.len().min(FRAMES);
    let is_known = |value| meaning.is_known(value);
    let mut range = RangeOf::new(&is_known);
    for number in 0..count {
        // From the first to the last.
        let place = number * files.len().saturating_sub(1) / count.saturating_sub(1).max(1);
        let stored = depth::decode(&files[place], room, &mut range)?;
        if !meaning.needs_range(stored) {
            return Ok(None);
        }
        watch((number + 1) as f64 / count as f64);
    }
    let named = || {
        files
            .first()
            .map_or_else(PathBuf::new, |file| file.path.clone())
    };
    let nothing = || {
        fault(
            &named(),
            "no depth file of the sequence holds a usable number",
        )
    };
    range.found().map(Some).ok_or_else(nothing)
}
