//! Slices in PNG or JPEG pictures: a folder, or a pattern such as `slices/*.png`.
//!
//! Takes paths in the order of the slices, gives the parts of a volume. All headers are looked at first: every slice must have
//! the size of the first. Grey pictures of 8 or 16 bits give their numbers as they are stored, three equal channels too;
//! colours give one of red, green and blue in 8 bits, or their brightness. Pictures say no spacing, so it is 1 unless the caller says another.
//! The decoding is the crate `image`'s.

use std::path::{Path, PathBuf};

use glam::DVec3;
use rayon::prelude::*;
use resample_core::image::srgb8_from_linear;
use resample_io::{Gate, Part, Picture, Plane, Stored, colour, depth};

use crate::Error;
use crate::input::decode;
use crate::input::decode::component;
use crate::input::file::{Parts, invalid};
use crate::input::options::LoadOptions;
use crate::volume::{Lattice, Voxels};

/// Bytes of a pixel while a slice is read: its number and its colours.
const PIXEL_BYTES: u64 = 2 + 16;

/// Red, green and blue.
const COLOURS: usize = 3;

/// Red, green and blue in the brightness of linear light (Rec. 709).
const BRIGHTNESS: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Returns true if a file that begins with `head` is such a picture.
pub(crate) fn begins(head: &[u8]) -> bool {
    head.starts_with(b"\x89PNG\r\n\x1a\n") || head.starts_with(b"\xff\xd8\xff")
}

/// How many colours a pixel of the middle slice has; `None` where it is grey or cannot be read, or where the slices do not fit
/// the memory.
pub(crate) fn colours(files: &[PathBuf], gate: &Gate) -> Option<usize> {
    let file = files.get(files.len() / 2)?;
    ask(size(file).ok()?, files.len(), gate).ok()?;
    let middle = part(file);
    let is_colour = depth::read(&middle).is_err() && colour::read(&middle).is_ok();
    is_colour.then_some(3)
}

/// Reads the slices: the chosen of red, green and blue, or the brightness. Errors and notes name `path`, the folder or pattern.
pub(crate) fn load(
    files: &[PathBuf],
    path: &Path,
    options: &LoadOptions,
    components: &[usize],
) -> Result<Parts, Error> {
    let gate = &options.gate;
    let first = files.first().ok_or_else(|| invalid(path, "no slices"))?;
    let [width, height] = size(first)?;
    for file in files {
        let [w, h] = size(file)?;
        if [w, h] != [width, height] {
            let what = format!(
                "a slice of {w}x{h} pixels, but {} has {width}x{height}: slices of a volume have one size; name them alone \
                 by a pattern such as 'slice*.png'",
                first.display()
            );
            return Err(invalid(file, what));
        }
        gate.note(file);
    }
    ask([width, height], files.len(), gate).map_err(|what| invalid(path, what))?;
    let slices = files.par_iter().map(|file| slice(file, components));
    let mut slices = slices.collect::<Result<Vec<Slice>, Error>>()?;
    let is_colour = slices.iter().any(|slice| slice.is_colour);
    if is_colour {
        widen(&mut slices);
    }
    match components {
        [] if is_colour => gate.remark(format!(
            "{}: slices in colour are read by their brightness",
            path.display()
        )),
        [] => {}
        chosen => {
            let held = if is_colour { COLOURS } else { 1 };
            component::chosen(chosen, held).map_err(|fault| fault.at(path))?;
        }
    }
    if options.spacing.is_none() {
        gate.remark(format!(
            "{}: {} slices in the natural order of their names, with a spacing of 1: --spacing X,Y,Z says another",
            path.display(),
            files.len()
        ));
    }
    let lattice = Lattice {
        // Rows run from the top of a picture down.
        up_hint: Some(DVec3::NEG_Y),
        ..Lattice::unnamed(
            [width as usize, height as usize, files.len()],
            decode::upright([1.0; 3], [0.0; 3]),
        )
    };
    Ok(Parts {
        lattice,
        voxels: joined(slices, files)?,
    })
}

/// One slice.
struct Slice {
    voxels: Vec<Voxels>,
    is_colour: bool,
}

/// Asks for the memory of so many slices of a size, before the first of them is decoded.
fn ask([width, height]: [u32; 2], slices: usize, gate: &Gate) -> Result<(), String> {
    let pixels = (u64::from(width) * u64::from(height)).saturating_mul(slices as u64);
    gate.ask(pixels.saturating_mul(PIXEL_BYTES), "the slices")
}

fn size(path: &Path) -> Result<[u32; 2], Error> {
    colour::size(&part(path)).map_err(|error| named(path, error))
}

fn part(path: &Path) -> Part {
    Part {
        path: path.to_owned(),
        name: None,
    }
}

/// An error that names the file already.
fn named(path: &Path, error: resample_core::Error) -> Error {
    let text = error.to_string();
    let name = format!("{}: ", path.display());
    invalid(path, text.strip_prefix(&name).unwrap_or(&text))
}

fn slice(path: &Path, components: &[usize]) -> Result<Slice, Error> {
    if let Ok(plane) = depth::read(&part(path)) {
        return Ok(Slice {
            voxels: vec![grey(plane); components.len().max(1)],
            is_colour: false,
        });
    }
    // Either colours or broken: the second reader says what is wrong.
    let picture = colour::read(&part(path)).map_err(|error| named(path, error))?;
    Ok(Slice {
        voxels: match components {
            [] => vec![brightness(&picture)],
            // A number beyond is refused when all slices are known.
            numbers => numbers
                .iter()
                .map(|&number| of_component(&picture, number.min(COLOURS - 1)))
                .collect(),
        },
        is_colour: true,
    })
}

/// Numbers as they are stored, which are whole.
fn grey(plane: Plane) -> Voxels {
    match plane.stored {
        Stored::Code(most) if most <= u32::from(u8::MAX) => {
            Voxels::U8(plane.values.iter().map(|&value| value as u8).collect())
        }
        Stored::Code(_) => Voxels::U16(plane.values.iter().map(|&value| value as u16).collect()),
        Stored::Float => Voxels::F32(plane.values),
    }
}

/// How bright a picture is on a screen, of 255.
fn brightness(picture: &Picture) -> Voxels {
    let of = |rgb: &[f32; 3]| {
        let light: f32 = rgb
            .iter()
            .zip(BRIGHTNESS)
            .map(|(&v, share)| v * share)
            .sum();
        srgb8_from_linear(light)
    };
    Voxels::U8(picture.rgb.iter().map(of).collect())
}

/// Red, green or blue as a screen takes it, of 255.
fn of_component(picture: &Picture, number: usize) -> Voxels {
    let of = |rgb: &[f32; 3]| srgb8_from_linear(rgb[number]);
    Voxels::U8(picture.rgb.iter().map(of).collect())
}

/// Brings slices of 16 bits to 8 where others have colours, which have 8.
fn widen(slices: &mut [Slice]) {
    for voxels in slices.iter_mut().flat_map(|slice| &mut slice.voxels) {
        if let Voxels::U16(values) = voxels {
            *voxels = Voxels::U8(values.iter().map(|&value| (value / 257) as u8).collect());
        }
    }
}

fn joined(slices: Vec<Slice>, files: &[PathBuf]) -> Result<Vec<Voxels>, Error> {
    if let Some(first) = slices.first().map(|slice| slice.voxels[0].clone())
        && let Some((_, file)) = slices
            .iter()
            .zip(files)
            .find(|(slice, _)| !decode::same_type(&first, &slice.voxels[0]))
    {
        return Err(invalid(
            file,
            "a slice of another number type than the slices before it: save all with 8 or all with 16 bits",
        ));
    }
    decode::joined(slices.into_iter().map(|slice| Ok(slice.voxels)))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use resample_io::Picture;

    use super::{brightness, of_component};
    use crate::input::test_files::Folder;
    use crate::input::{Format, LoadOptions, format_of, load, load_colours};
    use crate::volume::Voxels;

    /// A grey PNG of 2x1 pixels of 8 bits, whose data is stored without packing.
    fn png(values: [u8; 2]) -> Vec<u8> {
        let chunk = |name: &[u8; 4], data: &[u8]| {
            let body = [name.as_slice(), data].concat();
            let mut crc = flate2::Crc::new();
            crc.update(&body);
            [
                &(data.len() as u32).to_be_bytes()[..],
                &body,
                &crc.sum().to_be_bytes(),
            ]
            .concat()
        };
        let head = [
            &2u32.to_be_bytes()[..],
            &1u32.to_be_bytes(),
            &[8, 0, 0, 0, 0],
        ]
        .concat();
        let data = crate::input::test_files::zlib(&[0, values[0], values[1]]);
        [
            b"\x89PNG\r\n\x1a\n".to_vec(),
            chunk(b"IHDR", &head),
            chunk(b"IDAT", &data),
            chunk(b"IEND", &[]),
        ]
        .concat()
    }

    #[test]
    fn slices_come_in_the_order_of_their_numbers() {
        let folder = Folder::new();
        folder.write("notes.txt", &[b"text"]);
        for (name, values) in [("s10.png", [9, 10]), ("s2.png", [3, 4]), ("s1.png", [1, 2])] {
            folder.write(name, &[&png(values)]);
        }
        for typed in ["", "s*.png"] {
            let path = folder.path(typed);
            let second = LoadOptions {
                component: Some(1),
                ..LoadOptions::default()
            };
            let refused = load(&path, &second).expect_err("grey").to_string();
            assert!(refused.contains("1 component"), "{refused}");
            assert!(load_colours(&path, &second).expect("readable").is_none());
            assert_eq!(format_of(&path).expect("readable"), Some(Format::Pictures));
            let options = LoadOptions::default();
            let volume = load(&path, &options).expect("good slices");
            assert_eq!(volume.dims, [2, 1, 3]);
            assert_eq!(volume.voxels, Voxels::U8(vec![1, 2, 3, 4, 9, 10]));
            assert!(options.gate.remarks()[0].contains("3 slices in the natural order"));
            assert_eq!(
                options.gate.files().len(),
                3,
                "none of them is written over"
            );
        }
        let spaced = LoadOptions {
            spacing: Some([0.5, 0.5, 2.0]),
            ..LoadOptions::default()
        };
        let volume = load(&folder.path(""), &spaced).expect("good slices");
        assert_eq!(
            (volume.spacing(), spaced.gate.remarks().len()),
            ([0.5, 0.5, 2.0], 0)
        );
    }

    #[test]
    fn colours_are_read_by_their_brightness() {
        let picture = Picture {
            width: 3,
            height: 1,
            rgb: vec![[1.0; 3], [0.0; 3], [0.0, 1.0, 0.0]],
            coverage: None,
        };
        assert_eq!(brightness(&picture), Voxels::U8(vec![255, 0, 220]));
        assert_eq!(of_component(&picture, 0), Voxels::U8(vec![255, 0, 0]));
        assert_eq!(of_component(&picture, 1), Voxels::U8(vec![255, 0, 255]));
    }

    #[test]
    fn a_broken_slice_and_one_picture_are_refused_by_name() {
        let folder = Folder::new();
        let one = folder.write("s1.png", &[&png([1, 2])]);
        folder.write("s2.png", &[&png([1, 2])[..40]]);
        let refused = |path: &Path| {
            load(path, &LoadOptions::default())
                .expect_err("bad")
                .to_string()
        };
        assert!(refused(&folder.path("")).contains("s2.png"));
        assert!(refused(&one).contains("named by their folder"));
    }
}
