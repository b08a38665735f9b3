//! Transfer functions: from a scalar to a colour and an opacity, made by hand, by presets or from files.

#[cfg(feature = "input")]
pub(crate) mod files;

mod adjust;
mod automatic;
pub mod colour_map;
pub(crate) mod function;
pub mod presets;

pub use automatic::DataKind;
pub use colour_map::ColourMap;
pub use colour_map::tint;
#[cfg(feature = "input")]
pub use files::FileLook;
pub use function::{ColourEncoding, ColourKnot, OpacityKnot, TransferFunction};
pub use presets::DefaultLook;
pub use presets::{Preset, PresetScale};
pub use resample_volume::volume::histogram::Histogram;
