//! Transfer functions of files: a colour map of ParaView, or a volume property of 3D Slicer.
//!
//! Takes a path and a volume, gives the function, and the light and the unit of opacity where the file says them. The content
//! decides the format: JSON with `volumeProperties` and text are Slicer's, other JSON is ParaView's. What a file leaves out
//! is made from the volume: opacity by its histogram, colours as the default map over its values.

#[cfg(feature = "input")]
pub(crate) mod colour_space;
#[cfg(feature = "input")]
pub(crate) mod curve;
#[cfg(feature = "input")]
pub(crate) mod paraview;
#[cfg(feature = "input")]
pub(crate) mod slicer;

use std::path::Path;

use crate::volume::Described;
use resample_io::files::read_json;
use serde_json::Value;

use super::automatic::opacities;
use crate::Error;
use crate::transfer::files::curve::Knots;
use crate::transfer::{ColourEncoding, ColourMap, OpacityKnot, TransferFunction};
use crate::transfer::{GradientOpacity, Shading};

/// A transfer function of a file, and what the file says beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct FileLook {
    /// From a scalar to colour and opacity.
    pub function: TransferFunction,
    /// The light, where the file says.
    pub shading: Option<Shading>,
    /// Length over which its opacities are meant, world units, where the file says.
    pub opacity_unit: Option<f64>,
    /// Opacity by the gradient, where the file changes it.
    pub gradient_opacity: Option<GradientOpacity>,
    /// Ignored parts of the file, one sentence each, for people.
    pub notes: Vec<String>,
}

/// Longest file that is read; a map of a thousand knots has 100 kB. A guess.
const MAX_FILE_BYTES: u64 = 1 << 24;

impl FileLook {
    /// Reads a colour map of ParaView (`RGBPoints`, `Points`, `ColorSpace`) or a volume property of Slicer (`.vp`, `.vp.json`).
    ///
    /// Without opacities they are those of [`TransferFunction::automatic`] for this volume; without colours the default map
    /// spans the volume's values. Errors name the file, the key and the place in its list.
    pub fn load(
        path: &Path,
        encoding: ColourEncoding,
        volume: &dyn Described,
    ) -> Result<Self, Error> {
        let mut knots = read(path, encoding)?;
        let colours = knots.colours.take().unwrap_or_else(|| {
            let (low, high) = volume.value_range();
            ColourMap::default().knots(low, high)
        });
        let opacities = knots
            .opacities
            .take()
            .unwrap_or_else(|| opacities(&volume.histogram()));
        let function = TransferFunction::new(colours, opacities)?;
        Ok(Self::of(function, knots, volume, 1.0))
    }

    /// As [`FileLook::load`], with the file's knots moved to span the volume's values, as
    /// [`TransferFunction::rescaled`] does it; for maps that are written over 0..1.
    ///
    /// What is made from the volume is not moved.
    pub fn load_rescaled(
        path: &Path,
        encoding: ColourEncoding,
        volume: &dyn Described,
    ) -> Result<Self, Error> {
        let mut knots = read(path, encoding)?;
        let (low, high) = volume.value_range();
        let stretch = (high - low) / knots.span();
        let function = match (knots.colours.take(), knots.opacities.take()) {
            (Some(colours), Some(opacities)) => {
                TransferFunction::new(colours, opacities)?.rescaled(low, high)
            }
            (Some(colours), None) => {
                // The one opacity knot lies on a colour knot, so the colours alone decide how all is moved.
                let placeholder = OpacityKnot {
                    value: colours[0].value,
                    opacity: 0.0,
                };
                let colours = TransferFunction::new(colours, vec![placeholder])?
                    .rescaled(low, high)
                    .colours;
                TransferFunction::new(colours, opacities(&volume.histogram()))?
            }
            (None, opacities) => {
                let opacities = opacities.unwrap_or_default();
                let ends = opacities.first().zip(opacities.last());
                let (first, last) = ends.map_or((low, high), |(a, b)| (a.value, b.value));
                let colours = ColourMap::default().knots(first, last);
                TransferFunction::new(colours, opacities)?.rescaled(low, high)
            }
        };
        Ok(Self::of(function, knots, volume, stretch))
    }

    /// The look of a file whose values were made `stretch` times as large.
    fn of(function: TransferFunction, knots: Knots, volume: &dyn Described, stretch: f64) -> Self {
        let spacings = volume.lattice().spacing();
        let per_unit = 3.0 * stretch / spacings.iter().sum::<f64>();
        // A stretch of a single value says nothing.
        let is_known = per_unit > 0.0 && per_unit.is_finite();
        let gradient = knots.gradient.filter(|_| is_known);
        Self {
            gradient_opacity: gradient.map(|curve| curve.scaled(per_unit)),
            function,
            shading: knots.shading,
            opacity_unit: knots.opacity_unit,
            notes: knots.notes,
        }
    }
}

fn read(path: &Path, encoding: ColourEncoding) -> Result<Knots, Error> {
    let cannot_read = |source| Error::Read {
        path: path.to_owned(),
        source,
    };
    let bytes = read_json(path, MAX_FILE_BYTES).map_err(cannot_read)?;
    parse(&bytes, encoding).map_err(|what| Error::Invalid {
        path: path.to_owned(),
        what,
    })
}

/// The knots of a file's bytes.
pub(crate) fn parse(bytes: &[u8], encoding: ColourEncoding) -> Result<Knots, String> {
    let is_property = bytes.trim_ascii_start().first().is_some_and(|&first| {
        first.is_ascii_digit()
            && std::str::from_utf8(bytes).is_ok_and(|text| text.lines().count() > 1)
    });
    if is_property {
        return slicer::parse_text(&String::from_utf8_lossy(bytes), encoding);
    }
    let document: Value = serde_json::from_slice(bytes).map_err(|error| {
        format!("no valid JSON, and not the nine lines of a Slicer .vp file: {error}")
    })?;
    if document.get("volumeProperties").is_some() {
        return slicer::parse_document(&document, encoding);
    }
    paraview::parse(&document, encoding)
}
