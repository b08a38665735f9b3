//! Amira's and Avizo's regular grids, `.am`: a header in text, and sections of numbers, each behind a line `@1`, `@2` and so on.
//!
//! `define Lattice` has the sizes, `BoundingBox` the places of the first and the last voxels, and a line such as `Lattice { float[3] Velocity }
//! @1` the type, the components and the name of a section, plain or packed (`HxByteRLE`, `HxZip`).
//! Limits: uniform coordinates, one lattice; meshes, curved grids and line sets are refused.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use crate::Error;
use crate::input::decode;
use crate::input::decode::component::Interleaved;
use crate::input::decode::{Layout, component};
use crate::input::file::{Fault, Lines, Parts, excerpt, unsupported};
use crate::input::{LoadOptions, axes, open_sized};
use crate::volume::{Endian, Lattice, VoxelType, Voxels, map_voxels, voxel_count};

/// The first words of a file.
const MARKS: [&str; 2] = ["# AmiraMesh", "# Avizo"];

/// A section of numbers.
struct Section {
    label: String,
    name: String,
    voxel_type: VoxelType,
    components: usize,
    packing: Packing,
}

/// How the bytes of a section are packed, and their number.
#[derive(Clone, Copy)]
enum Packing {
    None,
    Runs(u64),
    Zlib(u64),
}

/// The facts above the sections.
#[derive(Default)]
struct Header {
    /// `None` for text.
    endian: Option<Endian>,
    dims: Option<[usize; 3]>,
    bounds: Option<[f64; 6]>,
    unit: Option<String>,
    sections: Vec<Section>,
    /// The line of the first section.
    label: String,
}

/// Returns true if a file that begins with `head` is of this format.
pub(crate) fn begins(head: &[u8]) -> bool {
    MARKS.iter().any(|mark| head.starts_with(mark.as_bytes()))
}

/// The names of the arrays, and of the first, which is the default.
pub(crate) fn array_names(path: &Path) -> Result<(Vec<String>, Option<String>), Error> {
    let (file, _) = open_sized(path)?;
    let header = header(&mut BufReader::new(file)).map_err(|fault| fault.at(path))?;
    let names: Vec<String> = (header.sections.into_iter())
        .map(|section| section.name)
        .collect();
    let first = names.first().cloned();
    Ok((names, first))
}

/// Reads the wanted components of the chosen array, or of the first.
pub(crate) fn load(
    path: &Path,
    options: &LoadOptions,
    components: &[usize],
) -> Result<Parts, Error> {
    let (file, held) = open_sized(path)?;
    read(&mut BufReader::new(file), held, (options, components)).map_err(|fault| fault.at(path))
}

fn read(
    file: &mut dyn BufRead,
    held: u64,
    (options, components): (&LoadOptions, &[usize]),
) -> Result<Parts, Fault> {
    let header = header(file)?;
    let dims = header.dims.ok_or_else(|| {
        unsupported("it has no 'define Lattice X Y Z': only regular grids are read")
    })?;
    let names = || -> Vec<&str> {
        let sections = header.sections.iter();
        sections.map(|section| section.name.as_str()).collect()
    };
    let wanted = match &options.array {
        None => 0,
        Some(name) => (header
            .sections
            .iter()
            .position(|section| section.name == *name))
        .ok_or_else(|| Fault::Option(format!("array={name}: it holds {}", names().join(", "))))?,
    };
    let section = (header.sections.get(wanted))
        .ok_or_else(|| unsupported("it has no numbers on its lattice"))?;
    let count = voxel_count(dims)?;
    let bytes_of = |section: &Section| {
        let scalars = (count as u64).saturating_mul(section.components as u64);
        scalars.saturating_mul(section.voxel_type.bytes() as u64)
    };
    let needed = bytes_of(section);
    options.gate.ask_unpacked(needed, held, "the voxels")?;
    let mut label = header.label.clone();
    for before in &header.sections[..wanted] {
        if header.endian.is_none() {
            return Err(unsupported("of text, only the first array is read"));
        }
        expect(&label, &before.label)?;
        let bytes = match before.packing {
            Packing::None => bytes_of(before),
            Packing::Runs(bytes) | Packing::Zlib(bytes) => bytes,
        };
        let passed = std::io::copy(&mut (&mut *file).take(bytes), &mut std::io::sink());
        if passed.is_ok_and(|passed| passed < bytes) {
            return Err(Fault::Invalid("it is cut off".to_owned()));
        }
        label = next_label(file)?;
    }
    expect(&label, &section.label)?;
    let chosen = component::chosen(components, section.components)?;
    let voxels = numbers(file, section, (count, header.endian), chosen)?;
    Ok(Parts {
        lattice: Lattice {
            unit: header.unit.clone(),
            ..Lattice::unnamed(dims, placed(dims, header.bounds))
        },
        voxels,
    })
}

/// Unpacks the wanted components of a section.
fn numbers(
    file: &mut dyn BufRead,
    section: &Section,
    (count, endian): (usize, Option<Endian>),
    chosen: Vec<usize>,
) -> Result<Vec<Voxels>, Fault> {
    let layout = Layout {
        voxel_type: section.voxel_type,
        endian: endian.unwrap_or(Endian::Little),
        count,
    };
    let interleaved = Interleaved {
        scalar_bytes: section.voxel_type.bytes(),
        components: section.components,
        chosen,
    };
    if endian.is_none() {
        return text(file, &layout, &interleaved);
    }
    let needed = layout.bytes()?.saturating_mul(section.components as u64);
    Ok(match section.packing {
        Packing::None => component::read(file.take(needed), &layout, &interleaved)?,
        Packing::Zlib(bytes) => {
            let plain = flate2::bufread::ZlibDecoder::new(file.take(bytes));
            component::read(plain, &layout, &interleaved)?
        }
        Packing::Runs(bytes) => {
            let plain = runs(&mut file.take(bytes), needed)?;
            component::read(plain.as_slice(), &layout, &interleaved)?
        }
    })
}

fn text(
    file: &mut dyn BufRead,
    layout: &Layout,
    interleaved: &Interleaved,
) -> Result<Vec<Voxels>, Fault> {
    let count = layout.count.checked_mul(interleaved.components);
    let all = Layout {
        count: count.ok_or_else(|| "more numbers than can be counted".to_owned())?,
        ..*layout
    };
    let all = decode::text(file, &all)?;
    let of = |&number: &usize| {
        map_voxels!(&all, values => {
            values.iter().skip(number).step_by(interleaved.components).copied().collect()
        })
    };
    Ok(interleaved.chosen.iter().map(of).collect())
}

/// Amira's runs: a byte below 128 repeats the next one so often; of others, the lower bits count bytes that follow as they are.
fn runs(file: &mut dyn Read, needed: u64) -> Result<Vec<u8>, Fault> {
    let mut packed = Vec::new();
    let failed = |error| Fault::Invalid(format!("it cannot be read: {error}"));
    file.read_to_end(&mut packed).map_err(failed)?;
    let mut plain = Vec::new();
    let mut rest = packed.as_slice();
    while let [control, after @ ..] = rest {
        let count = usize::from(control & 0x7f);
        let taken = if control & 0x80 == 0 { 1 } else { count };
        let Some((bytes, after)) = after.split_at_checked(taken) else {
            break;
        };
        match (control & 0x80 == 0, bytes) {
            (true, [byte]) => plain.resize(plain.len() + count, *byte),
            _ => plain.extend(bytes),
        }
        if plain.len() as u64 > needed {
            break;
        }
        rest = after;
    }
    Ok(plain)
}

fn expect(found: &str, label: &str) -> Result<(), Fault> {
    if found.trim() == label {
        return Ok(());
    }
    Err(Fault::Invalid(format!(
        "expected the line {label} before its numbers, found '{}'",
        excerpt(found)
    )))
}

fn next_label(file: &mut dyn BufRead) -> Result<String, Fault> {
    let mut lines = Lines::new(file);
    while let Some(line) = lines.next()? {
        if !line.trim().is_empty() {
            return Ok(line);
        }
    }
    Err(Fault::Invalid("it ends before its last section".to_owned()))
}

/// Voxels stand from end to end of the bounds.
fn placed(dims: [usize; 3], bounds: Option<[f64; 6]>) -> glam::DAffine3 {
    let bounds = bounds.unwrap_or([0.0; 6]);
    let step = |axis: usize| {
        let step = (bounds[2 * axis + 1] - bounds[2 * axis]) / (dims[axis].max(2) - 1) as f64;
        if step > 0.0 { step } else { 1.0 }
    };
    let spacing = [0, 1, 2].map(step);
    decode::upright(spacing, [bounds[0], bounds[2], bounds[4]])
}

fn header(file: &mut dyn BufRead) -> Result<Header, Fault> {
    let mut lines = Lines::new(file);
    let mut header = Header::default();
    let first = lines.next()?.unwrap_or_default();
    header.endian = match first.as_str() {
        line if line.contains("BINARY-LITTLE-ENDIAN") => Some(Endian::Little),
        line if line.contains("BINARY") => Some(Endian::Big),
        _ => None,
    };
    loop {
        let line = lines
            .next()?
            .ok_or_else(|| Fault::Invalid("it ends before its numbers".to_owned()))?;
        let text = line.trim();
        if text.starts_with('@') {
            header.label = text.to_owned();
            return Ok(header);
        }
        let words: Vec<&str> = (text.split([' ', '\t', ',', '"']))
            .filter(|word| !word.is_empty())
            .collect();
        match words.as_slice() {
            ["define", "Lattice", sizes @ ..] => header.dims = Some(sizes_of(sizes, text)?),
            ["BoundingBox", ends @ ..] => header.bounds = bounds_of(ends),
            ["CoordType", kind] if *kind != "uniform" => {
                return Err(unsupported(format!(
                    "its coordinates are {kind}: only uniform ones are read"
                )));
            }
            ["Coordinates", unit] => header.unit = axes::unit(unit),
            ["Lattice", "{", ..] => header.sections.push(section(text)?),
            _ => {}
        }
    }
}

fn sizes_of(words: &[&str], line: &str) -> Result<[usize; 3], Fault> {
    let sizes: Option<Vec<usize>> = words.iter().map(|word| word.parse().ok()).collect();
    let sizes = sizes.and_then(|sizes| <[usize; 3]>::try_from(sizes).ok());
    let sizes = sizes.filter(|sizes| sizes.iter().all(|&size| size > 0));
    sizes.ok_or_else(|| {
        Fault::Invalid(format!(
            "expected three sizes above 0, found '{}'",
            excerpt(line)
        ))
    })
}

fn bounds_of(words: &[&str]) -> Option<[f64; 6]> {
    let ends: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
    let ends = <[f64; 6]>::try_from(ends?).ok()?;
    ends.iter().all(|end| end.is_finite()).then_some(ends)
}

/// From a line such as `Lattice { float[3] Velocity } @1(HxZip,1234)`.
fn section(line: &str) -> Result<Section, Fault> {
    let wrong = || Fault::Invalid(format!("cannot be understood: '{}'", excerpt(line)));
    let (inner, place) = line.split_once('}').ok_or_else(wrong)?;
    let inner = inner.split_once('{').ok_or_else(wrong)?.1;
    let mut words = inner.split_whitespace();
    let (of, name) = words.next().zip(words.next()).ok_or_else(wrong)?;
    let (of, components) = match of.split_once('[') {
        None => (of, 1),
        Some((of, count)) => {
            let count = count.trim_end_matches(']').parse().map_err(|_| wrong())?;
            (of, count)
        }
    };
    let voxel_type = match of {
        "byte" => VoxelType::U8,
        "short" => VoxelType::I16,
        "ushort" => VoxelType::U16,
        "int" | "int32" => VoxelType::I32,
        "uint" | "uint32" => VoxelType::U32,
        "float" => VoxelType::F32,
        "double" => VoxelType::F64,
        other => return Err(unsupported(format!("its numbers are of type {other}"))),
    };
    let place = place.trim().trim_start_matches('=').trim();
    let (label, packing) = match place.split_once('(') {
        None => (place, Packing::None),
        Some((label, packed)) => {
            let (method, bytes) = packed
                .trim_end_matches(')')
                .split_once(',')
                .ok_or_else(wrong)?;
            let bytes = bytes.trim().parse().map_err(|_| wrong())?;
            let packing = match method.trim() {
                "HxByteRLE" => Packing::Runs(bytes),
                "HxZip" => Packing::Zlib(bytes),
                other => return Err(unsupported(format!("its numbers are packed by {other}"))),
            };
            (label, packing)
        }
    };
    Ok(Section {
        label: label.trim().to_owned(),
        name: name.to_owned(),
        voxel_type,
        components,
        packing,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::test_files::{Folder, check_components, survive_damage, zlib};
    use crate::input::{Format, arrays_of, format_of, load};

    fn file(kind: &str, fields: &str, data: &[&[u8]]) -> Vec<u8> {
        let head = format!(
            "# AmiraMesh {kind} 2.1\n\ndefine Lattice 4 3 2\n\nParameters {{\n    Units {{\n        Coordinates \"µm\"\n    }}\n    \
             BoundingBox 1 7 0 2 -1 1,\n    CoordType \"uniform\"\n}}\n\n{fields}\n# Data section follows\n"
        );
        [&[head.as_bytes()], data].concat().concat()
    }

    const LITTLE: &str = "BINARY-LITTLE-ENDIAN";

    #[test]
    fn plain_and_packed_sections_give_the_same_numbers() {
        let bytes: Vec<u8> = (0..24).map(|i| if i < 20 { 7 } else { i }).collect();
        let runs = [20, 7, 0x84, 20, 21, 22, 23];
        let packed = zlib(&bytes);
        let text: Vec<String> = bytes.iter().map(u8::to_string).collect();
        let text = format!("@1\n{}\n", text.join(" "));
        let field = |packing: &str| format!("Lattice {{ byte Labels }} @1{packing}\n");
        let folder = Folder::new();
        for bytes in [
            file(LITTLE, &field(""), &[b"@1\n", &bytes, b"\n"]),
            file(LITTLE, &field("(HxByteRLE,7)"), &[b"@1\n", &runs, b"\n"]),
            file(
                LITTLE,
                &field(&format!("(HxZip,{})", packed.len())),
                &[b"@1\n", &packed, b"\n"],
            ),
            file("3D ASCII", &field(""), &[text.as_bytes()]),
        ] {
            let path = folder.write("a.am", &[&bytes]);
            assert_eq!(format_of(&path).expect("readable"), Some(Format::Amira));
            let volume = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
            let expected = (0..24).map(|i| if i < 20 { 7 } else { i }).collect();
            assert_eq!(
                (volume.dims, volume.voxels),
                ([4, 3, 2], Voxels::U8(expected))
            );
            assert_eq!(
                volume.world_from_index.translation.to_array(),
                [1.0, 0.0, -1.0]
            );
            assert_eq!(volume.world_from_index.matrix3.x_axis.x, 2.0);
            assert_eq!(volume.unit.as_deref(), Some("µm"));
        }
    }

    #[test]
    fn arrays_and_components_are_chosen() {
        let fields = "Lattice { byte Labels } @1\nLattice { short[2] Flow } = @2\n";
        let flow: Vec<u8> = (0..48i16).flat_map(i16::to_be_bytes).collect();
        let bytes = file(
            "BINARY",
            fields,
            &[b"@1\n", &[5; 24], b"\n\n@2\n", &flow, b"\n"],
        );
        let folder = Folder::new();
        let path = folder.write("a.am", &[&bytes]);
        let names = vec!["Labels".to_owned(), "Flow".to_owned()];
        assert_eq!(
            arrays_of(&path).expect("readable"),
            (names, Some("Labels".to_owned()))
        );
        assert_eq!(
            load(&path, &LoadOptions::default())
                .expect("the first")
                .value(3),
            5.0
        );
        let named = |name: &str, component| LoadOptions {
            array: Some(name.to_owned()),
            component,
            ..LoadOptions::default()
        };
        check_components(&path, &named("Flow", None), 2);
        assert_eq!(
            load(&path, &named("Flow", Some(1))).expect("two").value(2),
            5.0
        );
        for (options, part) in [
            (named("Flow", None), "2 components"),
            (named("Flow", Some(2)), "component=2"),
            (named("None", None), "Labels, Flow"),
        ] {
            let complaint = load(&path, &options).expect_err(part).to_string();
            assert!(complaint.contains(part), "{complaint}");
        }
        survive_damage(&bytes, &LoadOptions::default(), 300);
    }
}
