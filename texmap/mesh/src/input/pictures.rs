//! Picture files: as [`Texture`]s, as far as they fit into memory together, and as [`Surroundings`].

use std::path::Path;

use resample_io::whole_picture::{ImageFormat, Pixels, WholePicture};
use resample_io::{Gate, Part, colour, whole_picture};

use crate::Error;
use crate::input::files;
use crate::scene::{Surroundings, Texels, Texture};

/// Reads a picture file.
///
/// # Errors
///
/// Names the file and its fault: it cannot be read, is not a picture, or claims an impossible size.
pub fn load_picture(path: &Path, gate: &Gate) -> Result<Texture, Error> {
    let bytes = files::read(path)?;
    let format = ImageFormat::from_path(path).ok();
    let name = path.display().to_string();
    decode(&bytes, (format, &name), gate).map_err(|what| Error::Input(format!("{name}: {what}")))
}

/// The pictures of a scene, as far as they fit into memory together.
#[derive(Debug, Default)]
pub(crate) struct Pictures {
    textures: Vec<Texture>,
    bytes: u64,
}

impl Pictures {
    /// Adds a picture and gives its place; the gate says how much memory all of them may take, since a small file can name
    /// many large pictures of one colour.
    pub(crate) fn add(&mut self, texture: Texture, gate: &Gate) -> Result<usize, String> {
        let bytes = self.bytes + texture.bytes();
        gate.ask(bytes, "this picture and those before it")?;
        self.bytes = bytes;
        self.textures.push(texture);
        Ok(self.textures.len() - 1)
    }

    /// The pictures, each at its place.
    pub(crate) fn into_textures(self) -> Vec<Texture> {
        self.textures
    }
}

/// Decodes the bytes of a picture file; `format` counts where the content has no mark.
pub(crate) fn decode(
    bytes: &[u8],
    (format, name): (Option<ImageFormat>, &str),
    gate: &Gate,
) -> Result<Texture, String> {
    let WholePicture {
        width,
        height,
        pixels,
    } = whole_picture::decode(bytes, format, gate)?;
    Ok(Texture {
        name: name.to_owned(),
        width,
        height,
        texels: match pixels {
            Pixels::Srgb8(texels) => Texels::Srgb8(texels.into()),
            Pixels::LinearF32(texels) => Texels::LinearF32(texels),
        },
    })
}

/// Bytes of a pixel of surroundings in memory.
const PIXEL_BYTES: u64 = 12;

/// Reads a picture of the light all around; light below zero counts as none. The gate says how much memory it may take.
pub(crate) fn surroundings(path: &Path, gate: &Gate) -> Result<Surroundings, Error> {
    let part = Part {
        path: path.to_owned(),
        name: None,
    };
    let storage = colour::storage(&part)?;
    let pixels: u64 = storage.size.map(u64::from).iter().product();
    let bytes = pixels.saturating_mul(PIXEL_BYTES + storage.decoder_bytes);
    let packed = std::fs::metadata(path).map_or(0, |file| file.len());
    gate.ask_unpacked(bytes, packed, "the surroundings")
        .map_err(|what| Error::Input(format!("{}: {what}", path.display())))?;
    let picture = colour::read(&part)?;
    let (width, height) = (picture.width, picture.height);
    if width != 2 * height {
        return Err(Error::Input(format!(
            "{}: {width}x{height} pixels, expected an equirectangular picture, twice as wide as high",
            path.display()
        )));
    }
    let rgb = picture.rgb.into_iter();
    Ok(Surroundings {
        width,
        height,
        rgb: rgb.map(|pixel| pixel.map(|light| light.max(0.0))).collect(),
    })
}
