//! All planes of an EXR file that `output` wrote: colour, depth, and those with names of their own.

use std::path::Path;

use anyhow::{Result, anyhow, bail};
use exr::prelude::{FlatSamples, read_first_flat_layer_from_file};
use resample_core::Image;
use resample_core::image::Plane;

use super::{broken, check_exr};

/// The picture in full precision.
pub(crate) fn read_planes(path: &Path) -> Result<Image> {
    check_exr(path)?;
    let layer = read_first_flat_layer_from_file(path)
        .map_err(|error| anyhow!("{}: {error}", broken(path)))?
        .layer_data;
    let mut image = Image::transparent(layer.size.width(), layer.size.height());
    for channel in layer.channel_data.list {
        let FlatSamples::F32(values) = channel.sample_data else {
            bail!("{}: expected floating point of 32 bits", broken(path));
        };
        if values.len() != image.rgba.len() {
            bail!("{}: its channels have unlike sizes", broken(path));
        }
        let name = channel.name.to_string();
        match ["R", "G", "B", "A"].iter().position(|known| *known == name) {
            Some(index) => {
                for (pixel, value) in image.rgba.iter_mut().zip(values) {
                    pixel[index] = value;
                }
            }
            None if name == "Z" => image.depth = Some(values),
            None => image.planes.push(Plane { name, values }),
        }
    }
    Ok(image)
}
