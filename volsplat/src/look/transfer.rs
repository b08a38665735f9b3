//! Transfer functions, and the named looks that join one with its light.

pub use resample_volume::transfer::*;
