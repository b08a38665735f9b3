//! Pictures: textures, as far as they fit into memory together, and surroundings.
//!
//! Takes files or the bytes of pictures, gives [`Texture`]s and [`Surroundings`]. Readers of formats list the pictures that their materials use, and
//! have them decoded ahead, on all threads.

use std::borrow::Cow;
use std::collections::HashMap;
use std::hash::Hash;
use std::path::Path;

use rayon::prelude::*;
use resample_io::whole_picture::{self, ImageFormat, Pixels, WholePicture};
use resample_io::{Gate, Part, colour};

use crate::Error;
use crate::input::files;
#[cfg(feature = "compressed")]
use crate::input::ktx2;
use crate::scene::{Surroundings, Texels, Texture};

/// Reads a picture file.
///
/// # Errors
///
/// Names the file and its fault: it cannot be read, is not a picture, or claims an impossible size.
pub fn load_picture(path: &Path, gate: &Gate) -> Result<Texture, Error> {
    let picture = Packed::of_file(path)?;
    let decoded = picture.decode(gate);
    decoded.map_err(|what| Error::Input(format!("{}: {what}", picture.name)))
}

/// A picture as a file holds it.
pub(super) struct Packed<'a> {
    /// For messages, and the name of the texture.
    pub name: String,
    pub bytes: Cow<'a, [u8]>,
    /// The format, which counts where the content has no mark.
    pub format: Option<ImageFormat>,
}

impl Packed<'static> {
    pub(super) fn of_file(path: &Path) -> Result<Self, Error> {
        Ok(Self {
            name: path.display().to_string(),
            bytes: Cow::Owned(files::read(path)?),
            format: ImageFormat::from_path(path).ok(),
        })
    }
}

impl Packed<'_> {
    /// Decodes it; the gate says how much memory it may take.
    pub(super) fn decode(&self, gate: &Gate) -> Result<Texture, String> {
        #[cfg(feature = "compressed")]
        if ktx2::is_ktx2(&self.bytes) {
            return ktx2::decode(&self.bytes, &self.name, gate);
        }
        let WholePicture {
            width,
            height,
            pixels,
        } = whole_picture::decode(&self.bytes, self.format, gate)?;
        Ok(Texture {
            name: self.name.clone(),
            width,
            height,
            texels: match pixels {
                Pixels::Srgb8(texels) => Texels::Srgb8(texels.into()),
                Pixels::LinearF32(texels) => Texels::LinearF32(texels),
            },
        })
    }

    /// The memory that the texture takes, bytes. An error if the head shows that the picture cannot be decoded.
    fn decoded_bytes(&self) -> Result<u64, String> {
        #[cfg(feature = "compressed")]
        if ktx2::is_ktx2(&self.bytes) {
            return Ok(ktx2::unpacked_bytes(&self.bytes));
        }
        whole_picture::decoded_bytes(&self.bytes, self.format)
    }
}

/// Pictures that were decoded before a material used them, each a texture or the fault of its file.
pub(super) type Decoded<K> = HashMap<K, Result<Texture, String>>;

/// Decoding takes this many times the memory of the texture: the decoder's pixels and the texture's exist side by side.
const DECODING_SHARE: u64 = 2;

/// Decodes pictures on all threads, from the first on, as many as memory has room for. The iterator is read on one thread, in order.
pub(super) fn decode_all<'a, K: Eq + Hash + Send>(
    pictures: impl Iterator<Item = (K, Packed<'a>)>,
    gate: &Gate,
) -> Decoded<K> {
    let mut bytes = 0u64;
    let fitting = pictures.take_while(|(_, picture)| {
        let texture = picture.decoded_bytes().unwrap_or(0);
        bytes = bytes.saturating_add(texture.saturating_mul(DECODING_SHARE));
        gate.ask(bytes, &picture.name).is_ok()
    });
    let fitting: Vec<_> = fitting.collect();
    let decoded = fitting.into_par_iter();
    decoded
        .map(|(key, picture)| (key, picture.decode(gate)))
        .collect()
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

    /// A picture by its place.
    pub(crate) fn get(&self, place: usize) -> &Texture {
        &self.textures[place]
    }

    /// The pictures, each at its place.
    pub(crate) fn into_textures(self) -> Vec<Texture> {
        self.textures
    }
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

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::RgbImage;
    use resample_io::Outside;

    use super::*;

    /// 4 x 4 pixels of one grey.
    fn grey(code: u8) -> Packed<'static> {
        let mut bytes = Cursor::new(Vec::new());
        let picture = RgbImage::from_pixel(4, 4, [code; 3].into());
        picture
            .write_to(&mut bytes, ImageFormat::Png)
            .expect("memory");
        Packed {
            name: format!("grey {code}"),
            bytes: bytes.into_inner().into(),
            format: None,
        }
    }

    #[test]
    fn pictures_decoded_ahead_are_those_decoded_alone() {
        let gate = Gate::default();
        let cut = Packed {
            bytes: grey(9).bytes[..50].to_vec().into(),
            ..grey(9)
        };
        let all = [grey(1), grey(2), cut, grey(3)];
        let expected = all.each_ref().map(|picture| picture.decode(&gate));
        let decoded = decode_all(all.into_iter().enumerate(), &gate);
        assert_eq!(decoded.len(), 4);
        for (at, expected) in expected.iter().enumerate() {
            let [ahead, alone] = [&decoded[&at], expected].map(|found| format!("{found:?}"));
            assert_eq!(ahead, alone, "picture {at}");
        }
        assert!(expected[2].is_err() && expected[3].is_ok());
    }

    #[cfg(feature = "compressed")]
    #[test]
    fn a_forged_size_is_beyond_any_memory() {
        // A KTX2 of 2^32 - 1 pixels a side, whose blocks have 2^64 - 1 bytes.
        let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
        bytes.resize(104, 0xff);
        let forged = Packed {
            bytes: bytes.into(),
            ..grey(1)
        };
        let pictures = [grey(1), forged, grey(2)];
        let decoded = decode_all(pictures.into_iter().enumerate(), &Gate::default());
        assert!(decoded.len() == 1 && decoded[&0].is_ok());
    }

    #[test]
    fn what_does_not_fit_into_memory_is_not_decoded_ahead() {
        // Each keeps 64 bytes, and its decoder as many.
        for (budget, fitting) in [(127, 0), (128, 1), (255, 1), (256, 2), (10_000, 4)] {
            let gate = Gate::new(Outside::Refused, Some(budget));
            let pictures = [1, 2, 3, 4].map(|code| (code, grey(code)));
            let decoded = decode_all(pictures.into_iter(), &gate);
            assert_eq!(decoded.len(), fitting, "in {budget} bytes");
            assert!((1..=fitting as u8).all(|code| decoded.contains_key(&code)));
        }
    }
}
