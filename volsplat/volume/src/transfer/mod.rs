//! Transfer functions: from a scalar to a colour and an opacity, made by hand, from a histogram or from files.

mod function;
pub mod colour_map;
mod adjust;
mod automatic;
mod channel;
#[cfg(feature = "input")]
mod files;
mod shading;
mod blend;
mod gradient;
mod presets;
pub mod plot;

pub use crate::volume::histogram::Histogram;
pub use automatic::{DataKind, background_end};
pub use blend::{Blend, Isosurface};
pub use channel::{ChannelColours, ChannelStyle, EMISSION_OPACITY, usual_colour};
pub use colour_map::{ColourMap, tint};
#[cfg(feature = "input")]
pub use files::FileLook;
pub use function::{
    ColourEncoding, ColourKnot, OpacityKnot, TransferFunction, classified, strength_of,
};
pub use gradient::GradientOpacity;
pub use presets::{DefaultLook, Preset, PresetScale};
pub use shading::Shading;
