//! Slices of a volume as pictures: beside the viewer's picture, and standing in the volume.
//!
//! A single volume is grey between the values of its window; channels add their colours as on a display; labels have their
//! own colours.

use anyhow::Result;
use resample_core::Image;
use resample_core::image::{linear_from_srgb, srgb_from_linear};
use resample_core::narrow::single;
use volsplat::volume::{Between, Lattice, Slice};
use volsplat::{LabelLook, Volume};

use crate::look::file_channel::ShownChannel;
use crate::open::volume::data::Content;
use crate::values;

/// A slice.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Cut<'a> {
    /// The slice at a voxel along an axis of the grid.
    Voxels(usize, usize),
    /// The slice on a grid with one layer, such as [`Lattice::on_plane`] gives.
    Grid(&'a Lattice),
}

impl Cut<'_> {
    fn of(self, volume: &Volume, between: Between) -> Result<Slice> {
        match self {
            Self::Voxels(axis, index) => Ok(volume.slice(axis, index)),
            Self::Grid(grid) => Ok(volume.on_grid(grid, between, 0.0)?.slice(2, 0)),
        }
    }
}

/// The picture of a slice, black and white at the ends of the window.
pub(crate) fn picture(content: &Content, cut: Cut, [low, high]: [f64; 2]) -> Result<Image> {
    let volumes = content.volumes()?;
    let shown: Vec<&ShownChannel> = content
        .shown_channels()
        .into_iter()
        .map(|(shown, _)| shown)
        .collect();
    let labels = content.labels();
    let mut codes: Vec<[f64; 3]> = Vec::new();
    let mut size = [0; 2];
    for (place, volume) in volumes.iter().take(shown.len().max(1)).enumerate() {
        if shown.is_empty() && !labels.is_empty() {
            let slice = cut.of(volume, Between::Nearest)?;
            (codes, size) = (painted(&slice, &labels), slice.size);
            break;
        }
        let slice = cut.of(volume, Between::Linear)?;
        size = slice.size;
        codes.resize(slice.values.len(), [0.0; 3]);
        let look = shown.get(place).map(|shown| &shown.look);
        let window = look.and_then(|look| look.window).unwrap_or([low, high]);
        let colour = look.and_then(|look| values::colour(look.word.as_deref()?).ok());
        let strength = look.map_or(1.0, |look| look.opacity.unwrap_or(1.0));
        let gamma = look.and_then(|look| look.gamma).unwrap_or(1.0);
        let colour = colour.map_or([1.0; 3], |rgb| {
            rgb.map(|light| f64::from(srgb_from_linear(light)))
        });
        add(
            &mut codes,
            &slice,
            &Ramp {
                window,
                gamma,
                colour: colour.map(|code| code * strength),
            },
        );
    }
    let mut image = Image::transparent(size[0], size[1]);
    for (pixel, code) in image.rgba.iter_mut().zip(codes) {
        let [r, g, b] = code.map(|code| linear_from_srgb(single(code.clamp(0.0, 1.0))));
        *pixel = [r, g, b, 1.0];
    }
    Ok(image)
}

/// How a channel becomes display colours.
struct Ramp {
    window: [f64; 2],
    gamma: f64,
    colour: [f64; 3],
}

fn add(codes: &mut [[f64; 3]], slice: &Slice, ramp: &Ramp) {
    let [low, high] = ramp.window;
    let scale = 1.0 / (high - low).max(f64::MIN_POSITIVE);
    for (code, value) in codes.iter_mut().zip(&slice.values) {
        let share = ((value - low) * scale).clamp(0.0, 1.0).powf(ramp.gamma);
        // A voxel without a value is black.
        let share = if share.is_nan() { 0.0 } else { share };
        code.iter_mut()
            .zip(ramp.colour)
            .for_each(|(code, colour)| *code += share * colour);
    }
}

/// The colours of labels; a voxel without one is black.
fn painted(slice: &Slice, labels: &[(i64, LabelLook)]) -> Vec<[f64; 3]> {
    let code = |value: &f64| {
        let look = labels.iter().find(|(label, _)| *label as f64 == *value);
        look.map_or([0.0; 3], |(_, look)| {
            look.rgb.map(|light| f64::from(srgb_from_linear(light)))
        })
    };
    slice.values.iter().map(code).collect()
}
