//! SOG, the Gaussians of PlayCanvas in pictures: a folder with `meta.json`, or a ZIP archive of one. Versions 1 and 2.
//!
//! Takes a path, gives Gaussians. A pixel stands for the same Gaussian in all pictures, in rows from the top: 16 bits of each
//! coordinate in two pictures, after x -> sign(x) ln(1 + |x|); scales and colours by tables (`meta`); the three smaller ones of
//! w x y z with the place of the largest, 252 to 255, in alpha; and the place of the other coefficients in a palette of 64
//! entries a row.
//! Source: the specification of the format by PlayCanvas; version 1 from its reader. The coordinates stay as they are.
//! Limits: streamed scenes of several levels are not read.

mod meta;

use std::path::{Path, PathBuf};

use glam::{DVec3, Quat, Vec3};
use resample_io::Gate;
use resample_io::whole_picture::{self, Pixels};

use super::sink::{self, MOST_DEGREE, Sink, Stored};
use crate::Error;
use crate::gaussians::Gaussians;
use crate::input::decode::zip;
use crate::input::decode::zip::Archive;
use crate::input::{Fault, open_sized};
use meta::{Meta, Table};

/// The name of the description.
const META: &str = "meta.json";

/// Entries of a row of the palette.
const ENTRIES_OF_ROW: usize = 64;

/// Where the pictures are.
enum Source {
    Folder(PathBuf),
    /// An archive, and the folder of the description in it.
    Archive(Archive, String),
}

/// The description's path: in a folder, or the file itself.
fn description(path: &Path) -> PathBuf {
    match path.is_dir() {
        true => path.join(META),
        false => path.to_owned(),
    }
}

/// Returns true if a folder or a text is a scene: its description has places and rotations.
pub(crate) fn begins(path: &Path) -> bool {
    let json = resample_io::files::read_small(&description(path), meta::MAX_BYTES);
    json.is_ok_and(|json| Meta::read(&json).is_ok())
}

/// Returns true if a ZIP archive has a description.
pub(crate) fn is_bundle(path: &Path) -> bool {
    let archive = open_sized(path)
        .ok()
        .and_then(|(file, held)| Archive::open(file, held).ok());
    archive.is_some_and(|archive| archive.find(META).is_some())
}

/// Reads a folder, a description or an archive.
pub(crate) fn load(path: &Path, gate: &Gate, notes: &mut Vec<String>) -> Result<Gaussians, Error> {
    let mut read = || {
        let (mut source, json) = open(path, gate)?;
        let meta = Meta::read(&json)?;
        Pictures::read(&meta, &mut source, gate)?.gaussians(&meta, notes)
    };
    read().map_err(|fault| fault.at(path))
}

fn open(path: &Path, gate: &Gate) -> Result<(Source, Vec<u8>), Fault> {
    let unreadable = |error: std::io::Error| Fault::Invalid(format!("cannot be read: {error}"));
    let description = description(path);
    let (file, held) = resample_io::files::open_regular(&description).map_err(unreadable)?;
    let head = resample_io::files::first_bytes(&description, 4).unwrap_or_default();
    if head != zip::MAGIC {
        let json = resample_io::files::read_small(&description, meta::MAX_BYTES);
        let folder = description.parent().unwrap_or(Path::new("")).to_owned();
        return Ok((Source::Folder(folder), json.map_err(unreadable)?));
    }
    let mut archive = Archive::open(file, held)?;
    let none = || Fault::Invalid(format!("the archive holds no {META}: expected Gaussians"));
    let name = archive.find(META).ok_or_else(none)?.to_owned();
    let json = archive.read(&name, gate)?;
    let folder = name.trim_end_matches(META).to_owned();
    Ok((Source::Archive(archive, folder), json))
}

impl Source {
    fn bytes(&mut self, name: &str, gate: &Gate) -> Result<Vec<u8>, Fault> {
        match self {
            Self::Archive(archive, folder) => archive.read(&format!("{folder}{name}"), gate),
            Self::Folder(folder) => {
                let path = gate.named_file(name, folder, folder)?;
                let read = resample_io::files::read_whole(&path);
                let unreadable = |error| Fault::Invalid(format!("{}: {error}", path.display()));
                read.map_err(unreadable)
            }
        }
    }

    /// The pixels of a picture that has at least so many.
    fn picture(&mut self, name: &str, least: u64, gate: &Gate) -> Result<Picture, Fault> {
        let located = |what: String| Fault::Invalid(format!("picture '{name}': {what}"));
        let bytes = self.bytes(name, gate)?;
        let picture = whole_picture::decode(&bytes, None, gate).map_err(located)?;
        let Pixels::Srgb8(pixels) = picture.pixels else {
            return Err(located("expected 8 bits in each channel".to_owned()));
        };
        if (pixels.len() as u64) < least {
            let got = pixels.len();
            return Err(located(format!(
                "it has {got} pixels for {least} Gaussians"
            )));
        }
        Ok(Picture {
            width: picture.width,
            pixels,
        })
    }
}

struct Picture {
    width: usize,
    pixels: Vec<[u8; 4]>,
}

/// The pixels of all attributes.
struct Pictures {
    count: u64,
    low: Picture,
    high: Picture,
    scales: Picture,
    quats: Picture,
    colours: Picture,
    palette: Option<Palette>,
}

/// The coefficients beyond the constant.
struct Palette {
    degree: usize,
    entries: Picture,
    labels: Picture,
    tables: [Table; 3],
}

impl Pictures {
    fn read(meta: &Meta, source: &mut Source, gate: &Gate) -> Result<Self, Fault> {
        let count = meta.count()?;
        let mut picture = |name| source.picture(name, count, gate);
        let low = picture(meta.means.file("means", 0)?)?;
        // The number of Gaussians is now held against a picture.
        let beside = count.saturating_mul(4 * 6);
        let degree = meta.sh_n.as_ref().map_or(0, |_| MOST_DEGREE);
        sink::ask(gate, degree, count, beside)?;
        Ok(Self {
            count,
            low,
            high: picture(meta.means.file("means", 1)?)?,
            scales: picture(meta.scales.file("scales", 0)?)?,
            quats: picture(meta.quats.file("quats", 0)?)?,
            colours: picture(meta.sh0.file("sh0", 0)?)?,
            palette: Palette::read(meta, source, count, gate)?,
        })
    }

    fn gaussians(&self, meta: &Meta, notes: &mut Vec<String>) -> Result<Gaussians, Fault> {
        if meta.antialias {
            notes.push("its Gaussians were trained with an anti-aliasing filter".to_owned());
        }
        let (ranges, scales, colours) = (meta.ranges()?, meta.scales()?, meta.colours()?);
        let degree = self.palette.as_ref().map_or(0, |palette| palette.degree);
        let mut coefficients = vec![0.0; sink::coefficients_of(degree)];
        let mut sink = Sink::with_capacity(degree, self.count);
        for index in 0..self.count as usize {
            let [low, high, scale, quat, colour] = [
                &self.low,
                &self.high,
                &self.scales,
                &self.quats,
                &self.colours,
            ]
            .map(|picture| picture.pixels[index]);
            if let Some(palette) = &self.palette {
                palette.coefficients(index, &mut coefficients)?;
            }
            let value = |table: &Table, byte: u8| table[usize::from(byte)];
            let scales = std::array::from_fn(|axis| value(&scales[axis], scale[axis]));
            let [r, g, b, opacity] =
                std::array::from_fn(|channel| value(&colours[channel], colour[channel]));
            let stored = Stored {
                centre: centre(low, high, &ranges),
                rotation: rotation(quat, index)?,
                scales: Vec3::from_array(scales),
                opacity,
                colour: Vec3::new(r, g, b),
            };
            sink.push(&stored, &coefficients);
        }
        sink.finish(notes)
    }
}

fn centre(low: [u8; 4], high: [u8; 4], ranges: &[[f32; 2]; 3]) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|axis| {
        let code = u16::from_le_bytes([low[axis], high[axis]]);
        let [least, most] = ranges[axis].map(f64::from);
        let place = least + (most - least) * (f64::from(code) / 65_535.0);
        place.signum() * place.abs().exp_m1()
    }))
}

fn rotation(pixel: [u8; 4], index: usize) -> Result<Quat, Fault> {
    let [a, b, c, mode] = pixel;
    let Some(largest) = mode.checked_sub(252) else {
        return Err(Fault::Invalid(format!(
            "the rotation of Gaussian {index} has alpha {mode}: expected 252 to 255; the pictures must not lose values when they are packed"
        )));
    };
    let three = [a, b, c].map(|byte| (f32::from(byte) / 255.0 - 0.5) * 2f32.sqrt());
    let [w, x, y, z] = sink::smallest_three(three, usize::from(largest));
    Ok(Quat::from_xyzw(x, y, z, w))
}

impl Palette {
    fn read(
        meta: &Meta,
        source: &mut Source,
        count: u64,
        gate: &Gate,
    ) -> Result<Option<Self>, Fault> {
        let Some(attribute) = &meta.sh_n else {
            return Ok(None);
        };
        let entries = source.picture(attribute.file("shN", 0)?, 0, gate)?;
        let fits =
            |degree: &usize| entries.width == ENTRIES_OF_ROW * sink::coefficients_of(*degree) / 3;
        let degree = (1..=MOST_DEGREE).find(fits);
        let degree = degree.filter(|degree| attribute.bands().is_none_or(|bands| bands == *degree));
        let Some(degree) = degree else {
            return Err(Fault::Invalid(format!(
                "the palette of 'shN' is {} pixels wide: expected 192, 512 or 960 for 1, 2 or 3 bands",
                entries.width
            )));
        };
        Ok(Some(Self {
            degree,
            entries,
            labels: source.picture(attribute.file("shN", 1)?, count, gate)?,
            tables: attribute.tables("shN")?,
        }))
    }

    fn coefficients(&self, index: usize, coefficients: &mut [f32]) -> Result<(), Fault> {
        let [low, high, ..] = self.labels.pixels[index];
        let label = usize::from(u16::from_le_bytes([low, high]));
        let per_entry = coefficients.len() / 3;
        let first =
            label / ENTRIES_OF_ROW * self.entries.width + label % ENTRIES_OF_ROW * per_entry;
        let Some(pixels) = self.entries.pixels.get(first..first + per_entry) else {
            return Err(Fault::Invalid(format!(
                "Gaussian {index} takes entry {label} of the palette, which has {}",
                self.entries.pixels.len() / per_entry
            )));
        };
        for (rgb, pixel) in coefficients.chunks_exact_mut(3).zip(pixels) {
            for (channel, value) in rgb.iter_mut().enumerate() {
                *value = self.tables[channel][usize::from(pixel[channel])];
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
