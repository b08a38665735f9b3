//! Texture maps of MTL files: their options and their files.
//!
//! Takes the text of a `map_` line, gives where and how a picture lies. A name is looked for as it stands, with
//! back-slashes as slashes, then by its last part beside the MTL file, and then without regard to capitals: files written
//! on another system keep working.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use resample_core::image::srgb_from_linear;
use resample_io::Gate;

use crate::input::files::{Names, excerpt};
use crate::input::pictures::load_picture;
use crate::scene::{Texels, Texture};

/// A map as it is written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// Its file, as it is named.
    pub file: String,
    /// Factor of u and v.
    pub scale: [f32; 2],
    /// Added to u and v, v from the bottom.
    pub offset: [f32; 2],
    /// True if the border goes on outside, instead of the picture again.
    pub clamp: bool,
    /// The channel of a map of numbers.
    pub channel: Channel,
    /// Factor of bumps or normals.
    pub strength: f32,
}

impl Map {
    /// Reads options and name; the name is all that follows the last option.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        let mut map = Self {
            file: String::new(),
            scale: [1.0; 2],
            offset: [0.0; 2],
            clamp: false,
            channel: Channel::Mean,
            strength: 1.0,
        };
        let mut rest = text.trim();
        while let Some((option, after)) = option(rest) {
            rest = match option {
                "-s" => numbers_into(&mut map.scale, after)?,
                "-o" => numbers_into(&mut map.offset, after)?,
                "-t" => numbers_into(&mut [0.0; 2], after)?,
                "-mm" => skipped(after, 2),
                "-clamp" => {
                    map.clamp = after.starts_with("on");
                    skipped(after, 1)
                }
                "-bm" => {
                    let mut strength = [1.0; 2];
                    let rest = numbers_into(&mut strength, after)?;
                    map.strength = strength[0];
                    rest
                }
                "-imfchan" => {
                    map.channel = Channel::of_word(after);
                    skipped(after, 1)
                }
                "-blendu" | "-blendv" | "-cc" | "-boost" | "-texres" | "-type" | "-colorspace" => {
                    skipped(after, 1)
                }
                _ => break,
            };
        }
        if rest.is_empty() {
            return Err("a map without a file".into());
        }
        rest.trim_matches('"').clone_into(&mut map.file);
        Ok(map)
    }
}

/// The file that a name in another file means; the error names it and says why it is not read.
pub(super) fn find(names: &Names, name: &str) -> Result<PathBuf, String> {
    let absent = || format!("{} is not there", excerpt(name));
    let name = name.trim().trim_matches('"').replace('\\', "/");
    if name.is_empty() || name.contains('\0') {
        return Err(absent());
    }
    let last = name.rsplit('/').next().unwrap_or(&name);
    let relative = !Path::new(&name).is_absolute();
    let mut spelt = [Some(name.as_str()).filter(|_| relative), Some(last)]
        .into_iter()
        .flatten()
        .filter(|name| !name.is_empty());
    match spelt.find(|name| names.folder.join(name).is_file()) {
        Some(name) => names.file(name),
        None => names.file(&in_any_case(names.folder, last).ok_or_else(absent)?),
    }
}

/// An option at the start of a text, and what follows it.
fn option(text: &str) -> Option<(&str, &str)> {
    let (word, rest) = text.split_once(|c: char| c.is_whitespace())?;
    word.starts_with('-').then_some((word, rest.trim_start()))
}

/// Reads one to three numbers, of which the first two count; one number stands for itself alone.
fn numbers_into<'a>(numbers: &mut [f32; 2], text: &'a str) -> Result<&'a str, String> {
    let mut rest = text;
    for place in 0..3 {
        let (word, after) = rest
            .split_once(|c: char| c.is_whitespace())
            .unwrap_or((rest, ""));
        let number: f32 = match word.parse() {
            Ok(number) => number,
            Err(_) if place > 0 => break,
            Err(_) => return Err(format!("'{}' is no number", excerpt(word))),
        };
        if !number.is_finite() {
            return Err("a number of a map is not finite".into());
        }
        if let Some(slot) = numbers.get_mut(place) {
            *slot = number;
        }
        rest = after.trim_start();
    }
    Ok(rest)
}

fn skipped(text: &str, words: usize) -> &str {
    (0..words).fold(text, |rest, _| {
        rest.split_once(|c: char| c.is_whitespace())
            .map_or("", |(_, rest)| rest.trim_start())
    })
}

fn in_any_case(folder: &Path, name: &str) -> Option<String> {
    // A folder of more files is not one of a model.
    const LOOKED_AT: usize = 10_000;
    let entries = std::fs::read_dir(folder).ok()?.take(LOOKED_AT).flatten();
    let same = |path: &PathBuf| {
        path.file_name()
            .is_some_and(|file| file.eq_ignore_ascii_case(name))
    };
    entries
        .map(|entry| entry.path())
        .filter(|path| path.is_file())
        .find(same)
        .and_then(|path| Some(path.file_name()?.to_str()?.to_owned()))
}

// Pictures of MTL files whose channels come from several files: colour with alpha, and roughness with metal.
//
// A number is taken at the place of each texel of the first picture. Numbers are the codes of a file and not light.

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
    fn of_word(text: &str) -> Self {
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

#[cfg(test)]
mod tests {
    use resample_io::Gate;

    use super::*;

    #[test]
    fn options_are_read_and_names_keep_their_spaces() {
        let map = Map::read("-s 2 3 1 -o 0.5 -bm 1.5 -clamp on my wood.png").expect("a map");
        let expected = Map {
            file: "my wood.png".into(),
            scale: [2.0, 3.0],
            offset: [0.5, 0.0],
            clamp: true,
            channel: Channel::Mean,
            strength: 1.5,
        };
        assert_eq!(map, expected, "each option by its own arguments");
        assert_eq!(
            Map::read("-mm 0 1 a.png").expect("a map").file,
            "a.png",
            "two arguments"
        );
        assert_eq!(
            Map::read("-dash.png").expect("a map").file,
            "-dash.png",
            "a name may begin with a dash"
        );
        for bad in ["", "-s 1 1 1", "-clamp on", "-s x a.png"] {
            assert!(Map::read(bad).is_err(), "'{bad}' names no file");
        }
    }

    #[test]
    fn names_of_other_systems_are_found() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("tex")).expect("a folder");
        std::fs::write(folder.path().join("tex/a.png"), "").expect("written");
        std::fs::write(folder.path().join("Wood B.PNG"), "").expect("written");
        let gate = Gate::default();
        let names = Names {
            folder: folder.path(),
            root: folder.path(),
            gate: &gate,
        };
        let found = |name: &str| {
            let path = find(&names, name).ok()?;
            Some(path.strip_prefix(folder.path()).map(PathBuf::from))
        };
        assert_eq!(
            found("tex\\a.png"),
            Some(Ok("tex/a.png".into())),
            "back-slashes"
        );
        assert_eq!(
            found("C:\\other\\wood b.png"),
            Some(Ok("Wood B.PNG".into())),
            "the last part, in any case"
        );
        assert_eq!(found("nothing.png"), None, "what is not there");
        assert_eq!(
            found("/etc/passwd"),
            None,
            "absolute names are not followed"
        );
    }
}
