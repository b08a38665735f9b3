//! COLMAP's models of cameras, as text and binary.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read, Seek};
use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};
use resample_core::camera::PixelCentre;
use resample_io::files::{self, read_text};

use crate::input::cameras::distortion::Distortion;
use crate::input::cameras::entry::{CameraSet, Entry, Lens, LensModel, Names};
use crate::input::cameras::text::{content, numbers, rotation};

// COLMAP's text model: `images.txt`, with `cameras.txt` beside it.
//
// An image has two lines: `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, and its points, which may be empty. Poses
// are world-to-camera; axes x right, y down, z forward; pixel centres at one half. The picture's name is the camera's.
// Source: COLMAP's description of its output formats.

type Lenses<'a> = HashMap<&'a str, LensModel>;

pub(super) fn is_it(text: &str) -> bool {
    let first = content(text).next();
    first.is_some_and(|(_, words)| words.len() >= 10 && numbers(&words[..9]).is_some())
}

pub(super) fn read(path: &Path, text: &str) -> Result<CameraSet, String> {
    let beside = path.with_file_name("cameras.txt");
    let cameras = read_text(&beside)
        .map_err(|error| format!("its lenses must stand in a cameras.txt beside it: {error}"))?;
    let lenses = lenses(&cameras).map_err(|what| format!("{}: {what}", beside.display()))?;
    let mut entries = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((index, line)) = lines.next() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        entries.push(image(line, &lenses).map_err(|what| format!("line {}: {what}", index + 1))?);
        // The line of points, empty without points.
        lines.next();
    }
    Ok(CameraSet {
        format: "COLMAP model",
        entries,
        pair: None,
        names: Names::Words,
    })
}

fn image(line: &str, lenses: &Lenses) -> Result<Entry, String> {
    let expected = "expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME";
    let words: Vec<&str> = line.split_whitespace().collect();
    let [_, pose @ .., _, _] = words.get(..10).ok_or(expected)? else {
        return Err(expected.into());
    };
    let pose = numbers(pose).ok_or(expected)?;
    let (id, name) = (words[8], words[9..].join(" "));
    let lens = lenses
        .get(id)
        .ok_or_else(|| format!("no camera {id} in cameras.txt"))?;
    lens.entry(name, camera_from_world(&pose)?)
}

/// The pose of `QW QX QY QZ TX TY TZ`.
fn camera_from_world(pose: &[f64]) -> Result<DAffine3, String> {
    let &[w, x, y, z, tx, ty, tz] = pose else {
        return Err("expected a quaternion and a translation".into());
    };
    let turn = rotation(DQuat::from_xyzw(x, y, z, w))?;
    Ok(DAffine3::from_rotation_translation(
        turn,
        DVec3::new(tx, ty, tz),
    ))
}

fn lenses(text: &str) -> Result<Lenses<'_>, String> {
    let mut lenses = HashMap::new();
    for (number, words) in content(text) {
        let lens = lens(&words).map_err(|what| format!("line {number}: {what}"))?;
        lenses.insert(words[0], lens);
    }
    Ok(lenses)
}

fn lens(words: &[&str]) -> Result<LensModel, String> {
    let expected = "expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS";
    let [_, model, width, height, parameters @ ..] = words else {
        return Err(expected.into());
    };
    let side = |word: &str| word.parse::<u32>().map_err(|_| expected.to_owned());
    let size = [side(width)?, side(height)?];
    lens_of_model(model, size, &numbers(parameters).ok_or(expected)?)
}

// COLMAP's binary model: `images.bin`, with `cameras.bin` beside it.
//
// Little-endian. Cameras: a count, then number, model, width, height and parameters of each. Images: a count, then
// number, quaternion (w first), translation, camera, the name up to a zero byte, and a list of points of 24 bytes each,
// which is passed over. Source: COLMAP's description of its output formats. Every count is checked against the bytes
// that are left.

/// Bytes of a camera without parameters.
const CAMERA_BYTES: u64 = 24;
/// Bytes of an image with an empty name and without points.
const IMAGE_BYTES: u64 = 73;
/// Bytes of a point of an image: x, y and the number of its point in space.
const POINT_BYTES: u64 = 24;
/// Longest name of a picture, bytes. A guess: eight times the longest path of common systems would be as good.
const LONGEST_NAME: u64 = 4096;

/// A file, and how many of its bytes are left.
struct Source<R> {
    reader: R,
    left: u64,
}

/// Reads the images of a binary model.
pub(crate) fn read_binary(path: &Path) -> Result<CameraSet, String> {
    let beside = path.with_file_name("cameras.bin");
    let lenses = binary_lenses(
        &mut open(&beside)
            .map_err(|what| format!("its lenses must stand in a cameras.bin beside it: {what}"))?,
    )
    .map_err(|what| format!("{}: {what}", beside.display()))?;
    let mut source = open(path)?;
    let count = source.count(IMAGE_BYTES, "images")?;
    let entries = (0..count).map(|index| {
        binary_image(&mut source, &lenses).map_err(|what| format!("image {index}: {what}"))
    });
    Ok(CameraSet {
        format: "COLMAP model",
        entries: entries.collect::<Result<_, _>>()?,
        pair: None,
        names: Names::Words,
    })
}

fn open(path: &Path) -> Result<Source<BufReader<std::fs::File>>, String> {
    let (file, left) = files::open(path).map_err(|error| error.to_string())?;
    Ok(Source {
        reader: BufReader::new(file),
        left,
    })
}

fn binary_lenses<R: BufRead + Seek>(
    source: &mut Source<R>,
) -> Result<HashMap<i32, LensModel>, String> {
    let count = source.count(CAMERA_BYTES, "cameras")?;
    let mut lenses = HashMap::new();
    for index in 0..count {
        let mut one = || -> Result<(i32, LensModel), String> {
            let number = source.i32()?;
            let (name, parameters) = by_number(source.i32()?)?;
            let size = [source.side()?, source.side()?];
            let parameters = source.numbers(parameters)?;
            Ok((number, lens_of_model(name, size, &parameters)?))
        };
        let (number, lens) = one().map_err(|what| format!("camera {index}: {what}"))?;
        lenses.insert(number, lens);
    }
    Ok(lenses)
}

fn binary_image<R: BufRead + Seek>(
    source: &mut Source<R>,
    lenses: &HashMap<i32, LensModel>,
) -> Result<Entry, String> {
    source.i32()?;
    let pose = source.numbers(7)?;
    let camera = source.i32()?;
    let name = source.name()?;
    let points = source.count(POINT_BYTES, "points")?;
    source.pass(points * POINT_BYTES)?;
    let lens = lenses
        .get(&camera)
        .ok_or_else(|| format!("no camera {camera} in cameras.bin"))?;
    lens.entry(name, camera_from_world(&pose)?)
}

impl<R: BufRead + Seek> Source<R> {
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut bytes = [0; N];
        self.reader
            .read_exact(&mut bytes)
            .map_err(|error| format!("the file ends too early: {error}"))?;
        self.left = self.left.saturating_sub(N as u64);
        Ok(bytes)
    }

    fn i32(&mut self) -> Result<i32, String> {
        Ok(i32::from_le_bytes(self.bytes()?))
    }

    fn u64(&mut self) -> Result<u64, String> {
        Ok(u64::from_le_bytes(self.bytes()?))
    }

    /// A width or height, px.
    fn side(&mut self) -> Result<u32, String> {
        let px = self.u64()?;
        u32::try_from(px).map_err(|_| format!("a side of {px} pixels"))
    }

    fn numbers(&mut self, count: usize) -> Result<Vec<f64>, String> {
        (0..count)
            .map(|_| Ok(f64::from_le_bytes(self.bytes()?)))
            .collect()
    }

    /// A count of things of at least `bytes` each, all of which the file must hold.
    fn count(&mut self, bytes: u64, things: &str) -> Result<u64, String> {
        let count = self.u64()?;
        if count.saturating_mul(bytes) > self.left {
            return Err(format!(
                "it states {count} {things}, but only {} bytes are left: is this file of COLMAP's binary model?",
                self.left
            ));
        }
        Ok(count)
    }

    fn name(&mut self) -> Result<String, String> {
        let mut name = Vec::new();
        (&mut self.reader)
            .take(LONGEST_NAME)
            .read_until(0, &mut name)
            .map_err(|error| error.to_string())?;
        self.left = self.left.saturating_sub(name.len() as u64);
        if name.pop() != Some(0) {
            return Err("the picture's name has no end".into());
        }
        String::from_utf8(name).map_err(|_| "the picture's name is not UTF-8".to_owned())
    }

    fn pass(&mut self, bytes: u64) -> Result<(), String> {
        let offset = i64::try_from(bytes).map_err(|error| error.to_string())?;
        self.reader
            .seek(std::io::SeekFrom::Current(offset))
            .map_err(|error| error.to_string())?;
        self.left -= bytes;
        Ok(())
    }
}

// COLMAP's lens models: from a model's name and parameters to a lens and its distortion.
//
// Limits: the thin prism of THIN_PRISM_FISHEYE, FOV and newer models are not read.

/// Number, name and parameter count of the models that are read, as COLMAP's sources list them.
const MODELS: [(i32, &str, usize); 9] = [
    (0, "SIMPLE_PINHOLE", 3),
    (1, "PINHOLE", 4),
    (2, "SIMPLE_RADIAL", 4),
    (3, "RADIAL", 5),
    (4, "OPENCV", 8),
    (5, "OPENCV_FISHEYE", 8),
    (6, "FULL_OPENCV", 12),
    (8, "SIMPLE_RADIAL_FISHEYE", 4),
    (9, "RADIAL_FISHEYE", 5),
];

/// Name and parameter count of the model with this number.
fn by_number(number: i32) -> Result<(&'static str, usize), String> {
    let found = MODELS.iter().find(|(own, _, _)| *own == number);
    found
        .map(|&(_, name, count)| (name, count))
        .ok_or_else(|| not_read(&format!("number {number}")))
}

/// The lens of a model's parameters.
fn lens_of_model(name: &str, size: [u32; 2], parameters: &[f64]) -> Result<LensModel, String> {
    let (_, _, count) = MODELS
        .iter()
        .find(|(_, own, _)| *own == name)
        .ok_or_else(|| not_read(name))?;
    if parameters.len() != *count || parameters.iter().any(|value| !value.is_finite()) {
        return Err(format!(
            "the lens model {name} has {} parameters, expected {count} finite numbers",
            parameters.len()
        ));
    }
    let has_two_focals = matches!(
        name,
        "PINHOLE" | "OPENCV" | "OPENCV_FISHEYE" | "FULL_OPENCV"
    );
    let (focals, rest) = parameters.split_at(1 + usize::from(has_two_focals));
    let (centre, coefficients) = rest.split_at(2);
    Ok(LensModel {
        lens: Lens {
            fx: focals[0],
            fy: focals[focals.len() - 1],
            cx: centre[0],
            cy: centre[1],
            pixel_centre: PixelCentre::Half,
        },
        size,
        distortion: if name.ends_with("FISHEYE") {
            Some(fish_eye(coefficients))
        } else {
            distortion(coefficients)
        },
    })
}

/// The coefficients in COLMAP's order: k1, k2, p1, p2, k3, k4, k5, k6, as far as the model has them.
fn distortion(coefficients: &[f64]) -> Option<Distortion> {
    let mut k = [0.0; 8];
    k[..coefficients.len()].copy_from_slice(coefficients);
    Distortion::new([k[0], k[1], k[4], k[5], k[6], k[7]], [k[2], k[3]])
}

/// The coefficients of a fish eye: k1 to k4, as far as the model has them.
fn fish_eye(coefficients: &[f64]) -> Distortion {
    let mut k = [0.0; 4];
    k[..coefficients.len()].copy_from_slice(coefficients);
    Distortion::fish_eye(k)
}

fn not_read(model: &str) -> String {
    let names: Vec<_> = MODELS.iter().map(|(_, name, _)| *name).collect();
    format!(
        "the lens model {model} is not read, only {}: undistort the pictures first (colmap image_undistorter)",
        names.join(", ")
    )
}
