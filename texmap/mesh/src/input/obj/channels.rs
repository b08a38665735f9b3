//! Pictures of MTL files whose channels come from several files: colour with alpha, and roughness with metal.
//!
//! A number is taken at the place of each texel of the first picture. Numbers are the codes of a file and not light.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use resample_core::image::srgb_from_linear;
use resample_io::Gate;

use crate::input::pictures::load_picture;
use crate::scene::{Texels, Texture};

/// The channel of a picture that holds a number (`-imfchan`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Channel {
    /// The mean of the three colours.
    Mean,
    Red,
    Green,
    Blue,
    Alpha,
}

impl Channel {
    /// The channel that a text begins with; luminance and what is not known are the mean.
    pub(super) fn of_word(text: &str) -> Self {
        match text.split_whitespace().next() {
            Some("r") => Self::Red,
            Some("g") => Self::Green,
            Some("b") => Self::Blue,
            Some("m") => Self::Alpha,
            _ => Self::Mean,
        }
    }
}

/// Codes of a picture, as large as it is.
struct Codes {
    size: [usize; 2],
    codes: Vec<u8>,
}

impl Codes {
    fn new(texture: &Texture, channel: Channel) -> Self {
        let of = |[r, g, b, a]: [u8; 4]| match channel {
            Channel::Mean => ((u16::from(r) + u16::from(g) + u16::from(b)) / 3) as u8,
            Channel::Red => r,
            Channel::Green => g,
            Channel::Blue => b,
            Channel::Alpha => a,
        };
        Self {
            size: [texture.width, texture.height],
            codes: texels(texture).into_iter().map(of).collect(),
        }
    }

    /// The code at the place of texel `index` of a picture of another size.
    fn at(&self, index: usize, [width, height]: [usize; 2]) -> u8 {
        let column = ((index % width) * 2 + 1) * self.size[0] / (2 * width);
        let row = ((index / width) * 2 + 1) * self.size[1] / (2 * height);
        self.codes[row * self.size[0] + column]
    }
}

/// A picture of roughness (green) and metal (blue), each from a channel of a file; without a file it is 1.
pub(super) fn roughness_and_metal(
    files: &[Option<(PathBuf, Channel)>; 2],
    gate: &Gate,
) -> Result<Texture, String> {
    let mut read = [None, None];
    for (read, file) in read.iter_mut().zip(files) {
        if let Some((path, channel)) = file {
            let texture = load_picture(path, gate).map_err(|error| error.to_string())?;
            *read = Some((Codes::new(&texture, *channel), texture.name));
        }
    }
    let Some((largest, name)) = read
        .iter()
        .flatten()
        .max_by_key(|(codes, _)| codes.codes.len())
    else {
        return Err("no picture of roughness or metal".into());
    };
    let size = largest.size;
    let code = |k: usize, index: usize| {
        let codes = read[k].as_ref();
        codes.map_or(u8::MAX, |(codes, _)| codes.at(index, size))
    };
    let texels: Vec<_> = (0..size[0] * size[1])
        .map(|index| [u8::MAX, code(0, index), code(1, index), u8::MAX])
        .collect();
    Ok(Texture {
        name: name.clone(),
        width: size[0],
        height: size[1],
        texels: Texels::Srgb8(texels.into()),
    })
}

/// A picture with colour from one file and alpha from another: its alpha channel where it has one, else how bright it
/// is. The alpha is taken at the place of each texel of the colour; without a colour, it is white.
pub(super) fn with_alpha(
    colour: Option<&Path>,
    alpha: &Path,
    gate: &Gate,
) -> Result<Texture, String> {
    let load = |path: &Path| load_picture(path, gate).map_err(|error| error.to_string());
    let mask = load(alpha)?;
    let is_opaque = texels(&mask).iter().all(|texel| texel[3] == u8::MAX);
    let channel = match is_opaque {
        true => Channel::Mean,
        false => Channel::Alpha,
    };
    let values = Codes::new(&mask, channel);
    let Some(colour) = colour else {
        let texels: Vec<_> = values.codes.iter().map(|&a| [255, 255, 255, a]).collect();
        return Ok(Texture {
            texels: Texels::Srgb8(texels.into()),
            ..mask
        });
    };
    let mut picture = load(colour)?;
    let (width, height) = (picture.width, picture.height);
    let at = |index: usize| values.at(index, [width, height]);
    match &mut picture.texels {
        Texels::Srgb8(texels) => Arc::make_mut(texels)
            .iter_mut()
            .enumerate()
            .for_each(|(index, texel)| texel[3] = at(index)),
        Texels::LinearF32(texels) => {
            texels
                .iter_mut()
                .enumerate()
                .for_each(|(index, texel)| texel[3] = f32::from(at(index)) / 255.0);
        }
    }
    Ok(picture)
}

/// The codes of a picture, as on a screen.
fn texels(texture: &Texture) -> Vec<[u8; 4]> {
    let byte = |channel: f32| (channel * 255.0).round() as u8;
    match &texture.texels {
        Texels::Srgb8(texels) => texels.to_vec(),
        Texels::LinearF32(texels) => texels
            .iter()
            .map(|&[r, g, b, a]| {
                let [r, g, b] = [r, g, b].map(|c| byte(srgb_from_linear(c)));
                [r, g, b, byte(a)]
            })
            .collect(),
    }
}
