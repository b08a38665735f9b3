//! Transfer functions: from a scalar to a colour and an opacity, made by hand, by presets or from files.

#[cfg(feature = "input")]
pub(crate) mod files;

mod adjust;
mod automatic;
pub mod colour_map;
mod function;
mod kind;
mod looks;
mod mixed;
pub mod presets;
pub(crate) mod strength;
mod tint;

pub use colour_map::ColourMap;
#[cfg(feature = "input")]
pub use files::FileLook;
pub use function::{ColourEncoding, ColourKnot, OpacityKnot, TransferFunction};
pub use kind::DataKind;
pub use looks::DefaultLook;
pub use presets::{Preset, PresetScale};
pub use resample_volume::volume::histogram::Histogram;
pub use tint::tint;
