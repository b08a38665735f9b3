//! Transfer functions: from a scalar to a colour and an opacity, made by hand, by presets or from files.

pub(crate) mod function;
pub mod colour_map;
mod adjust;
mod automatic;
mod channel;
pub mod presets;
#[cfg(feature = "input")]
mod files;
pub mod plot;

pub use automatic::DataKind;
pub use channel::{ChannelColours, ChannelStyle, EMISSION_OPACITY, usual_colour};
pub use colour_map::{ColourMap, tint};
#[cfg(feature = "input")]
pub use files::FileLook;
pub use function::{ColourEncoding, ColourKnot, OpacityKnot, TransferFunction};
pub use presets::{DefaultLook, Preset, PresetScale};
pub use resample_volume::volume::histogram::Histogram;
