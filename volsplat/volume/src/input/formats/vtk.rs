//! VTK's legacy files, `.vtk`: STRUCTURED_POINTS as text or binary.
//!
//! Takes a path, returns the parts of a volume. Lines at the top say how the image lies; then come arrays,
//! each with a line in front, of which one is read: the one that the caller names, or the first. Anything that is no array of values
//! (tables of colours, fields about the whole, metadata) is skipped. Binary numbers are big-endian. Values of cells stand at their centres.
//! Source: VTK File Formats, "Simple Legacy Formats". Limits: grids with one spacing along each axis; no bits.

use std::io;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};

use crate::Error;
use crate::input::decode;
use crate::input::decode::component::Interleaved;
use crate::input::decode::{Layout, component};
use crate::input::file::{Fault, Lines, Parts, excerpt, open_sized, unsupported};
use crate::input::formats::vti::{CELLS_REMARK, others_remark};
use crate::input::options::LoadOptions;
use crate::volume::{Endian, Lattice, VoxelType, Voxels, voxel_count};

/// The first bytes of every file.
pub(crate) const MAGIC: &[u8] = b"# vtk DataFile";

/// How many colours a value of the array has; `None` where it is no colour.
pub(crate) fn colours(path: &Path, array: Option<&str>) -> Result<Option<usize>, Error> {
    let (file, held) = open_sized(path)?;
    let found = || -> Result<Array, Fault> {
        let mut bytes = BufReader::new(file);
        let head = Head::read(&mut bytes)?;
        Arrays::new(&mut bytes, held, head.is_binary).find(array)
    };
    let array = found().map_err(|fault| fault.at(path))?;
    let is_colour = array.voxel_type == VoxelType::U8 && matches!(array.components, 3 | 4);
    Ok(is_colour.then_some(array.components))
}

/// The names of all arrays of a file.
pub(crate) fn array_names(path: &Path) -> Result<(Vec<String>, Option<String>), Error> {
    let (file, held) = open_sized(path)?;
    let mut bytes = BufReader::new(file);
    let head = Head::read(&mut bytes).map_err(|fault| fault.at(path))?;
    let mut arrays = Arrays::new(&mut bytes, held, head.is_binary);
    let read = arrays.find(None).ok().map(|array| array.name);
    Ok((arrays.names(), read))
}

pub(crate) fn load(
    path: &Path,
    options: &LoadOptions,
    components: &[usize],
) -> Result<Parts, Error> {
    let (file, held) = open_sized(path)?;
    let mut bytes = BufReader::new(file);
    let read = || -> Result<(Parts, Vec<String>), Fault> {
        let head = Head::read(&mut bytes)?;
        let arrays = Arrays::new(&mut bytes, held, head.is_binary);
        read(&head, arrays, options, components)
    };
    let (parts, remarks) = { read }().map_err(|fault| fault.at(path))?;
    let name = path.display();
    for remark in remarks {
        options.gate.remark(format!("{name}: {remark}"));
    }
    Ok(parts)
}

/// The chosen array on its grid, and remarks on what was decided.
fn read(
    head: &Head,
    mut arrays: Arrays,
    options: &LoadOptions,
    components: &[usize],
) -> Result<(Parts, Vec<String>), Fault> {
    let array = arrays.find(options.array.as_deref())?;
    let chosen = component::chosen(components, array.components)?;
    let (dims, first) = head.grid(array.centring);
    let layout = Layout {
        voxel_type: array.voxel_type,
        endian: Endian::Big,
        count: voxel_count(dims)?,
    };
    if array.tuples != layout.count {
        let [x, y, z] = dims;
        return Err(Fault::Invalid(format!(
            "the array '{}' has {} values, but DIMENSIONS make {x}x{y}x{z}: expected {}",
            excerpt(&array.name),
            array.tuples,
            layout.count
        )));
    }
    options.gate.ask(layout.bytes()?, "the voxels")?;
    let voxels = arrays.values(&array, &layout, chosen)?;
    let mut remarks = Vec::new();
    if array.centring == Centring::Cells {
        remarks.push(CELLS_REMARK.to_owned());
    }
    if options.array.is_none() {
        remarks.extend(others_remark(&array.name, &arrays.names()));
    }
    let axes = DMat3::from_diagonal(head.spacing);
    let map = DAffine3::from_mat3_translation(axes, head.origin + axes * first);
    let lattice = Lattice::unnamed(dims, map);
    Ok((Parts { lattice, voxels }, remarks))
}

/// Where the values of an array stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Centring {
    Points,
    Cells,
}

/// The facts of the top.
pub(crate) struct Head {
    /// Points along x, y and z.
    points: [usize; 3],
    pub(crate) origin: DVec3,
    pub(crate) spacing: DVec3,
    pub(crate) is_binary: bool,
}

/// The kinds of data that are no image, and what to do with them.
const OTHER_KINDS: [(&str, &str); 4] = [
    (
        "RECTILINEAR_GRID",
        "its spacing changes along an axis: resample it to an image (ParaView: Resample To Image)",
    ),
    (
        "STRUCTURED_GRID",
        "its points lie anywhere: resample it to an image (ParaView: Resample To Image)",
    ),
    (
        "UNSTRUCTURED_GRID",
        "unstructured grids are not supported; resample to an image (ParaView: Resample To Image)",
    ),
    (
        "POLYDATA",
        "it is a mesh: save it as PLY or STL, which the command texmap draws",
    ),
];

/// Most points along an axis: the library that writes this format counts them in 32 bits.
const MOST_POINTS: f64 = i32::MAX as f64;

impl Head {
    /// Reads up to the last line that places the image.
    pub(crate) fn read(bytes: &mut dyn BufRead) -> Result<Self, Fault> {
        let mut lines = Lines::new(bytes);
        let mut next = |what: &str| {
            lines
                .next()?
                .ok_or_else(|| Fault::Invalid(format!("the file ends where {what} is expected")))
        };
        // The mark, and a title of any kind.
        next("its mark")?;
        next("its title")?;
        let coding = next("ASCII or BINARY")?;
        let is_binary = match coding.trim().to_uppercase().as_str() {
            "ASCII" => false,
            "BINARY" => true,
            other => {
                return Err(Fault::Invalid(format!(
                    "line 3 is '{}': expected ASCII or BINARY",
                    excerpt(other)
                )));
            }
        };
        let (mut points, mut origin, mut spacing) = (None, None, None);
        let mut has_kind = false;
        while points.is_none() || origin.is_none() || spacing.is_none() {
            let line = next("DIMENSIONS, ORIGIN or SPACING")?;
            let mut words = line.split_ascii_whitespace();
            let Some(word) = words.next() else { continue };
            let three = || numbers(&line, word);
            match word.to_uppercase().as_str() {
                "DATASET" => {
                    check_kind(words.next().unwrap_or_default())?;
                    has_kind = true;
                }
                _ if !has_kind => {
                    return Err(Fault::Invalid(format!(
                        "'{}': expected DATASET",
                        excerpt(&line)
                    )));
                }
                "DIMENSIONS" => points = Some(three()?),
                "ORIGIN" => origin = Some(three()?),
                "SPACING" | "ASPECT_RATIO" => spacing = Some(three()?),
                _ => {
                    return Err(Fault::Invalid(format!(
                        "'{}': expected DIMENSIONS, ORIGIN or SPACING before the data",
                        excerpt(&line)
                    )));
                }
            }
        }
        let [points, origin, spacing] = [points, origin, spacing].map(Option::unwrap_or_default);
        Ok(Self {
            points: sizes(points)?,
            origin: DVec3::from_array(origin),
            spacing: DVec3::from_array(spacing),
            is_binary,
        })
    }

    /// Number of values along x, y and z, and the index of the first among the points. Cells are one less than points along
    /// an axis, and stand half a step further.
    pub(crate) fn grid(&self, centring: Centring) -> ([usize; 3], DVec3) {
        let (mut dims, mut first) = (self.points, DVec3::ZERO);
        for axis in 0..3 {
            if centring == Centring::Cells && dims[axis] > 1 {
                dims[axis] -= 1;
                first[axis] = 0.5;
            }
        }
        (dims, first)
    }
}

fn check_kind(kind: &str) -> Result<(), Fault> {
    if kind.eq_ignore_ascii_case("STRUCTURED_POINTS") {
        return Ok(());
    }
    let known = OTHER_KINDS
        .iter()
        .find(|(name, _)| kind.eq_ignore_ascii_case(name));
    Err(match known {
        Some((name, advice)) => unsupported(format!("the data set is a {name}: {advice}")),
        None => Fault::Invalid(format!(
            "the data set is '{}': expected STRUCTURED_POINTS",
            excerpt(kind)
        )),
    })
}

fn numbers(line: &str, word: &str) -> Result<[f64; 3], Fault> {
    let found: Option<Vec<f64>> = line
        .split_ascii_whitespace()
        .skip(1)
        .map(|word| word.parse().ok().filter(|value: &f64| value.is_finite()))
        .collect();
    found
        .and_then(|found| found.try_into().ok())
        .ok_or_else(|| {
            Fault::Invalid(format!(
                "'{}': expected three numbers behind {word}",
                excerpt(line)
            ))
        })
}

fn sizes(points: [f64; 3]) -> Result<[usize; 3], Fault> {
    let is_size = |size: &f64| size.fract() == 0.0 && (1.0..=MOST_POINTS).contains(size);
    if points.iter().all(is_size) {
        Ok(points.map(|size| size as usize))
    } else {
        Err(Fault::Invalid(format!(
            "DIMENSIONS are {points:?}: expected three whole numbers from 1 on"
        )))
    }
}

/// An array.
#[derive(Clone, Debug)]
pub(crate) struct Array {
    pub(crate) name: String,
    pub(crate) voxel_type: VoxelType,
    pub(crate) components: usize,
    tuples: usize,
    pub(crate) centring: Centring,
    /// True if a text has shares of 255 where bytes are meant, as colours are written.
    has_shares: bool,
}

/// Most components of a value, as for the newer format.
const MOST_COMPONENTS: usize = 1 << 16;

/// The arrays that follow.
struct Arrays<'a> {
    bytes: &'a mut dyn BufRead,
    /// Length of the file, bytes.
    held: u64,
    is_binary: bool,
    /// Of which kind, and how many values each has; none before the first line that says so.
    section: Option<(Centring, usize)>,
    /// Arrays of a field that are still to come.
    in_field: usize,
}

impl<'a> Arrays<'a> {
    pub(crate) fn new(bytes: &'a mut dyn BufRead, held: u64, is_binary: bool) -> Self {
        Self {
            bytes,
            held,
            is_binary,
            section: None,
            in_field: 0,
        }
    }

    /// The next array of this name, or the next one; the stream then stands at its numbers.
    pub(crate) fn find(&mut self, name: Option<&str>) -> Result<Array, Fault> {
        let mut others = Vec::new();
        while let Some((array, has_place)) = self.next()? {
            if has_place && name.is_none_or(|name| array.name == name) {
                return Ok(array);
            }
            self.pass(&array)?;
            others.push(excerpt(&array.name));
        }
        Err(match name {
            Some(name) => Fault::Option(format!(
                "array={name}: no such array; there are: {}",
                others.join(", ")
            )),
            None => Fault::Invalid("the image has no array".to_owned()),
        })
    }

    /// The names of the arrays that follow, up to the end or to the first that is damaged.
    pub(crate) fn names(&mut self) -> Vec<String> {
        let mut names = Vec::new();
        while let Ok(Some((array, has_place))) = self.next() {
            let passed = self.pass(&array);
            if has_place {
                names.push(array.name);
            }
            if passed.is_err() {
                break;
            }
        }
        names
    }

    /// The numbers of an array at which the stream stands.
    pub(crate) fn values(
        &mut self,
        array: &Array,
        layout: &Layout,
        chosen: Vec<usize>,
    ) -> Result<Vec<Voxels>, Fault> {
        let interleaved = Interleaved {
            scalar_bytes: layout.voxel_type.bytes(),
            components: array.components,
            chosen,
        };
        if self.is_binary {
            let bytes = self.bytes_of(array)?;
            let stream = (&mut *self.bytes).take(bytes);
            return Ok(component::read(stream, layout, &interleaved)?);
        }
        self.bytes_of(array)?;
        let mut texts = vec![Vec::new(); interleaved.chosen.len()];
        let mut word = Vec::new();
        for number in 0..array.tuples * array.components {
            if !decode::next_word(&mut *self.bytes, &mut word)? {
                break;
            }
            let component = number % array.components;
            if array.has_shares && interleaved.chosen.contains(&component) {
                word = byte_of_share(&word);
            }
            for (text, &chosen) in texts.iter_mut().zip(&interleaved.chosen) {
                if chosen == component {
                    text.extend_from_slice(&word);
                    text.push(b' ');
                }
            }
        }
        let decoded = texts
            .iter()
            .map(|text| Ok(decode::text(&mut text.as_slice(), layout)?));
        decoded.collect()
    }

    /// The bytes that an array takes at least; an error where the file is too short for them.
    fn bytes_of(&self, array: &Array) -> Result<u64, Fault> {
        // A number of a text has a character and a space behind it.
        let each = if self.is_binary {
            array.voxel_type.bytes()
        } else {
            2
        };
        let bytes = array.tuples.checked_mul(array.components);
        let bytes = bytes
            .and_then(|numbers| numbers.checked_mul(each))
            .map(|bytes| bytes as u64);
        bytes.filter(|&bytes| bytes <= self.held + 1).ok_or_else(|| {
            Fault::Invalid(format!(
                "the array '{}' promises {} x {} numbers of {}, more than the {} bytes of the file can hold: it is cut off",
                excerpt(&array.name),
                array.tuples,
                array.components,
                array.voxel_type.name(),
                self.held
            ))
        })
    }

    fn pass(&mut self, array: &Array) -> Result<(), Fault> {
        let bytes = self.bytes_of(array)?;
        if self.is_binary {
            return self.pass_bytes(bytes);
        }
        self.pass_words(array.tuples * array.components)
    }

    fn pass_bytes(&mut self, bytes: u64) -> Result<(), Fault> {
        let passed = io::copy(&mut (&mut *self.bytes).take(bytes), &mut io::sink());
        passed.map_err(|error| decode::broken(&error))?;
        Ok(())
    }

    fn pass_words(&mut self, count: usize) -> Result<(), Fault> {
        let mut word = Vec::new();
        for _ in 0..count {
            if !decode::next_word(&mut *self.bytes, &mut word)? {
                break;
            }
        }
        Ok(())
    }

    /// The next array, and whether its values have a place; `None` at the end.
    fn next(&mut self) -> Result<Option<(Array, bool)>, Fault> {
        while let Some(text) = Lines::new(&mut *self.bytes).next()? {
            let line = Line {
                words: text.split_ascii_whitespace().collect(),
                text: &text,
            };
            if line.words.is_empty() {
                continue;
            }
            let found = if self.in_field > 0 {
                self.in_field(&line)?
            } else if self.passed(&line)? {
                None
            } else {
                self.attribute(&line)?
            };
            if let Some(array) = found {
                return Ok(Some((array, self.section.is_some())));
            }
        }
        Ok(None)
    }

    /// The array of a field that a line announces; names of components and the like stand between arrays.
    fn in_field(&mut self, line: &Line) -> Result<Option<Array>, Fault> {
        let Some((components, tuples)) = line.count(1).zip(line.count(2)) else {
            if line.word(0) == "METADATA" {
                self.pass_metadata()?;
                return Ok(None);
            }
            return Err(
                line.fault("the name of an array, its components, its values and their type")
            );
        };
        self.in_field -= 1;
        let array = self.array(line.word(0), line.word(3), components)?;
        Ok(Some(Array { tuples, ..array }))
    }

    /// Takes a line that announces no array, with all that belongs to it; false where it announces one.
    fn passed(&mut self, line: &Line) -> Result<bool, Fault> {
        let keyword = line.word(0).to_uppercase();
        match keyword.as_str() {
            "POINT_DATA" | "CELL_DATA" => {
                let centring = if keyword == "POINT_DATA" {
                    Centring::Points
                } else {
                    Centring::Cells
                };
                let count = line
                    .count(1)
                    .ok_or_else(|| line.fault("a number of values"))?;
                self.section = Some((centring, count));
            }
            "FIELD" => {
                self.in_field = line
                    .count(2)
                    .ok_or_else(|| line.fault("a number of arrays"))?;
            }
            "METADATA" => self.pass_metadata()?,
            "LOOKUP_TABLE" => {
                let entries = line.count(2).and_then(|entries| entries.checked_mul(4));
                let entries = entries.ok_or_else(|| line.fault("a number of entries"))?;
                if self.is_binary {
                    self.pass_bytes(entries as u64)?;
                } else {
                    self.pass_words(entries)?;
                }
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// The array of values at points or in cells that a line announces.
    fn attribute(&mut self, line: &Line) -> Result<Option<Array>, Fault> {
        let counted = |place| {
            line.count(place)
                .ok_or_else(|| line.fault("a number of components"))
        };
        let (kind, components) = match line.word(0).to_uppercase().as_str() {
            "SCALARS" => {
                let components = if line.words.len() > 3 { counted(3)? } else { 1 };
                let table = Lines::new(&mut *self.bytes).next()?.unwrap_or_default();
                if !table
                    .trim_start()
                    .to_uppercase()
                    .starts_with("LOOKUP_TABLE")
                {
                    return Err(Fault::Invalid(format!(
                        "'{}' behind SCALARS: expected LOOKUP_TABLE",
                        excerpt(&table)
                    )));
                }
                (line.word(2), components)
            }
            "VECTORS" | "NORMALS" => (line.word(2), 3),
            "TENSORS" => (line.word(2), 9),
            "TEXTURE_COORDINATES" => (line.word(3), counted(2)?),
            "COLOR_SCALARS" => ("unsigned_char", counted(2)?),
            _ => return Err(line.fault("the line of an array, such as SCALARS or FIELD")),
        };
        if self.section.is_none() {
            return Err(line.fault("POINT_DATA or CELL_DATA before it"));
        }
        let array = self.array(line.word(1), kind, components)?;
        Ok(Some(Array {
            has_shares: line.word(0).eq_ignore_ascii_case("COLOR_SCALARS"),
            ..array
        }))
    }

    /// An array of as many values as there are points or cells.
    fn array(&self, name: &str, kind: &str, components: usize) -> Result<Array, Fault> {
        let (centring, tuples) = self.section.unwrap_or((Centring::Points, 0));
        if !(1..=MOST_COMPONENTS).contains(&components) {
            return Err(Fault::Invalid(format!(
                "the array '{}' has {components} components: expected 1 to {MOST_COMPONENTS}",
                excerpt(name)
            )));
        }
        Ok(Array {
            name: name.to_owned(),
            voxel_type: voxel_type(name, kind)?,
            components,
            tuples,
            centring,
            has_shares: false,
        })
    }

    /// Passes over lines up to an empty one.
    fn pass_metadata(&mut self) -> Result<(), Fault> {
        let mut lines = Lines::new(&mut *self.bytes);
        while lines.next()?.is_some_and(|line| !line.trim().is_empty()) {}
        Ok(())
    }
}

/// The byte that a share from 0 to 1 stands for; what is no such number stays as it is, and is refused as a byte.
fn byte_of_share(word: &[u8]) -> Vec<u8> {
    let share = std::str::from_utf8(word)
        .ok()
        .and_then(|text| text.parse::<f64>().ok());
    match share.filter(|share| (0.0..=1.0).contains(share)) {
        Some(share) => ((255.0 * share).round() as u8).to_string().into_bytes(),
        None => word.to_vec(),
    }
}

/// A line in front of data.
struct Line<'a> {
    words: Vec<&'a str>,
    text: &'a str,
}

impl<'a> Line<'a> {
    /// A word; nothing where there are fewer.
    fn word(&self, place: usize) -> &'a str {
        self.words.get(place).copied().unwrap_or_default()
    }

    fn count(&self, place: usize) -> Option<usize> {
        self.word(place).parse().ok()
    }

    fn fault(&self, expected: &str) -> Fault {
        Fault::Invalid(format!("'{}': expected {expected}", excerpt(self.text)))
    }
}

fn voxel_type(name: &str, kind: &str) -> Result<VoxelType, Fault> {
    Ok(match kind.to_lowercase().as_str() {
        "unsigned_char" => VoxelType::U8,
        "char" | "signed_char" => VoxelType::I8,
        "unsigned_short" => VoxelType::U16,
        "short" => VoxelType::I16,
        "unsigned_int" => VoxelType::U32,
        "int" => VoxelType::I32,
        "unsigned_long" | "vtktypeuint64" => VoxelType::U64,
        "long" | "vtktypeint64" => VoxelType::I64,
        "float" => VoxelType::F32,
        "double" => VoxelType::F64,
        other => {
            return Err(unsupported(format!(
                "the array '{}' is of type '{}': expected numbers, unsigned_char to double",
                excerpt(name),
                excerpt(other)
            )));
        }
    })
}

#[cfg(test)]
mod tests;
