//! COLMAP's binary model: `images.bin`, with `cameras.bin` beside it.
//!
//! Little-endian. Cameras: a count, then number, model, width, height and parameters of each. Images: a count, then
//! number, quaternion (w first), translation, camera, the name up to a zero byte, and a list of points of 24 bytes each,
//! which is passed over. Source: COLMAP's description of its output formats. Every count is checked against the bytes
//! that are left.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read, Seek};
use std::path::Path;

use super::{camera_from_world, lens};
use crate::input::cameras::entry::{CameraSet, Entry, LensModel, Names};
use resample_io::files;

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
pub(crate) fn read(path: &Path) -> Result<CameraSet, String> {
    let beside = path.with_file_name("cameras.bin");
    let lenses = lenses(
        &mut open(&beside)
            .map_err(|what| format!("its lenses must stand in a cameras.bin beside it: {what}"))?,
    )
    .map_err(|what| format!("{}: {what}", beside.display()))?;
    let mut source = open(path)?;
    let count = source.count(IMAGE_BYTES, "images")?;
    let entries = (0..count)
        .map(|index| image(&mut source, &lenses).map_err(|what| format!("image {index}: {what}")));
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

fn lenses<R: BufRead + Seek>(source: &mut Source<R>) -> Result<HashMap<i32, LensModel>, String> {
    let count = source.count(CAMERA_BYTES, "cameras")?;
    let mut lenses = HashMap::new();
    for index in 0..count {
        let mut one = || -> Result<(i32, LensModel), String> {
            let number = source.i32()?;
            let (name, parameters) = lens::by_number(source.i32()?)?;
            let size = [source.side()?, source.side()?];
            let parameters = source.numbers(parameters)?;
            Ok((number, lens::model(name, size, &parameters)?))
        };
        let (number, lens) = one().map_err(|what| format!("camera {index}: {what}"))?;
        lenses.insert(number, lens);
    }
    Ok(lenses)
}

fn image<R: BufRead + Seek>(
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
