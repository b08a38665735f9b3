//! Transfer functions: from a scalar to a colour and an opacity, made by hand, by presets or from files.

mod adjust;
mod automatic;
pub mod colour_map;
#[cfg(feature = "input")]
mod colour_space;
#[cfg(feature = "input")]
mod curve;
#[cfg(feature = "input")]
mod file;
mod function;
pub mod histogram;
mod kind;
#[cfg(feature = "input")]
mod knots;
mod looks;
mod mixed;
#[cfg(feature = "input")]
mod paraview;
pub mod presets;
#[cfg(feature = "input")]
mod slicer;
pub(crate) mod strength;
mod tint;

pub use colour_map::ColourMap;
#[cfg(feature = "input")]
pub use file::FileLook;
pub use function::{ColourEncoding, ColourKnot, OpacityKnot, TransferFunction};
pub use histogram::Histogram;
pub use kind::DataKind;
pub use looks::DefaultLook;
pub use presets::{Preset, PresetScale};
pub use tint::tint;
