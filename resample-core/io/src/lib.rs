//! Files of numbers: pictures and depths, row by row, and what several readers need of arrays and of TIFF files.
//!
//! The format of a file follows from its content, never from its name. A header's claims are held against the length of the
//! file before anything is allocated. [`colour`] and [`depth`] give pictures and depths, into memory or, through a
//! [`Receiver`], wherever the caller keeps them; [`whole_picture`] decodes a
//! picture's bytes at once; [`film`] reads and makes films, by way of ffmpeg; [`write`](mod@write) gives the bytes of PNG, EXR and WebP; [`npy`], [`ply`] and [`tiff`] read headers and tables for readers of other things. [`names`] are those of numbered pictures, [`listed`] finds the files of such a name or of a list. [`gate`] says
//! which names inside files are followed, and how much memory their data may take.
//! Limits: one picture a file.
//!
//! ```
//! use resample_io::{Part, colour};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let path = std::env::temp_dir().join("resample-io-example.ppm");
//! std::fs::write(&path, "P3 2 1 255 255 0 0 0 0 255")?;
//! assert_eq!(colour::size(&Part::from_text(&path.to_string_lossy()))?, [2, 1]);
//! # std::fs::remove_file(&path)?;
//! # Ok(())
//! # }
//! ```

pub mod gate;
pub mod memory;
pub mod refused;
pub mod files;
mod picture;
pub mod receiver;
mod formats;
pub mod colour;
pub mod depth;
pub mod whole_picture;
pub mod camera_file;
pub mod figure;
pub mod film;
pub mod names;
pub mod write;

pub use crate::picture::{Plane, Stored};
pub use files::{MAX_PIXELS, Part};
pub use formats::{exr, npy, ply, rendered, tiff};
pub use gate::{Gate, Outside};
pub use names::FrameNames;
pub use names::listed;
pub use picture::Picture;
pub use receiver::{Receiver, Room};

#[cfg(test)]
mod tests;
