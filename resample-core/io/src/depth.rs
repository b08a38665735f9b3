//! The depth file: EXR channel, PFM, 16-bit PNG, `.npy`, TIFF, and grey pictures of 8 bits.
//!
//! Takes a file and perhaps a channel, gives its numbers as they are stored. The first bytes tell the format. The
//! caller knows the meaning of the numbers.

use super::files::{Part, fault, first_bytes};
use super::receiver::{HeldPlane, Receiver, Room};
use crate::formats::{exr, npy, pfm, raster, tiff};
use crate::picture::{Plane, Stored};
use resample_core::Error;

/// Reads a depth file. An EXR file may name a channel (`ref.exr#Z`); without one the only candidate is taken.
pub fn read(part: &Part) -> Result<Plane, Error> {
    let mut held = HeldPlane::default();
    let stored = decode(part, Room::ENDLESS, &mut held)?;
    Ok(held.plane(stored))
}

/// Gives the numbers of a depth file to `to` piece by piece; what kind they are.
pub fn decode(part: &Part, room: Room, to: &mut dyn Receiver) -> Result<Stored, Error> {
    let path = &part.path;
    let start = first_bytes(path, 8)?;
    if exr::is_exr(&start) {
        return exr::decode_depth(path, part.name.as_deref(), room, to);
    }
    if let Some(name) = &part.name {
        return Err(fault(
            path,
            format!("only an EXR file has channels, leave out ':{name}'"),
        ));
    }
    match start.as_slice() {
        [b'P', b'F' | b'f', ..] => pfm::decode(path, to),
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => npy::decode(path, room, to),
        start if tiff::begins(start) => tiff::decode(path, room, to),
        _ => raster::decode_depth(path, room, to),
    }
}
