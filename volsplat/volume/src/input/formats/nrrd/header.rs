//! The head of an NRRD file: from lines to typed fields, and from those to the volume's axes and their place in the world.
//!
//! Takes a reader at the start of the file and returns a [`Header`]; only fields that place or size the data are kept.
//! Lines end in LF or CR LF, field names and values ignore case, comments and key/value pairs are skipped, and
//! the head ends at the first empty line or at the end of the file.
//!
//! [`derive()`] returns three dims and the affine map. Axes of size 1 that are not needed are dropped, missing ones
//! (a picture, a line) are added with size 1. One axis that is not in space, such as colours, vectors or time, holds
//! components, of which one is read; a second one is refused with the remedy.

use std::collections::HashMap;
use std::io::BufRead;
use std::str::FromStr;

use glam::{DAffine3, DVec3};

use crate::input::data_files::DataFiles;
use crate::input::decode;
use crate::input::file::{Fault, Lines, excerpt};
use crate::volume::{Endian, Lattice, VoxelType};

/// How the numbers are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Raw,
    Text,
    Hex,
    Gzip,
    Bzip2,
}

impl FromStr for Encoding {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.to_lowercase().as_str() {
            "raw" => Ok(Self::Raw),
            "txt" | "text" | "ascii" => Ok(Self::Text),
            "hex" => Ok(Self::Hex),
            "gz" | "gzip" => Ok(Self::Gzip),
            "bz2" | "bzip2" => Ok(Self::Bzip2),
            _ => Err(format!(
                "field 'encoding' is '{text}': expected raw, text, hex, gzip or bzip2"
            )),
        }
    }
}

/// The facts of the head, each list with one entry per axis, the fastest axis first.
pub(crate) struct Header {
    pub(crate) voxel_type: VoxelType,
    pub(crate) endian: Endian,
    pub(crate) encoding: Encoding,
    pub(crate) sizes: Vec<usize>,
    pub(crate) kinds: Vec<String>,
    /// NaN where not known.
    pub(crate) spacings: Vec<f64>,
    /// `None` for an axis that is not in space; an empty list if the field is absent.
    pub(crate) directions: Vec<Option<Vec<f64>>>,
    pub(crate) origin: Option<Vec<f64>>,
    pub(crate) space: Option<String>,
    pub(crate) data_files: DataFiles,
    pub(crate) line_skip: u64,
    /// -1 means that the data is at the end of the file.
    pub(crate) byte_skip: i64,
    /// Bytes of the head: where attached data begins.
    pub(crate) bytes: u64,
}

/// The greatest dimension that the format's own library allows.
const MAX_DIMENSION: usize = 16;

pub(crate) fn read(reader: &mut dyn BufRead) -> Result<Header, Fault> {
    let mut lines = Lines::new(reader);
    let magic = lines.next()?.unwrap_or_default();
    if !matches!(
        magic.as_str(),
        "NRRD0001" | "NRRD0002" | "NRRD0003" | "NRRD0004" | "NRRD0005"
    ) {
        return Err(Fault::Unsupported(format!(
            "version '{magic}': versions NRRD0001 to NRRD0005 are read"
        )));
    }
    let mut fields = Fields::default();
    let mut listed = Vec::new();
    while let Some(line) = lines.next()?.filter(|line| !line.is_empty()) {
        if fields.data_file_is_list() {
            listed.push(line);
        } else {
            fields.add(&line)?;
        }
    }
    fields.into_header(listed, lines.bytes)
}

#[derive(Default)]
struct Fields {
    /// Lower-case names without spaces to the text behind the colon.
    by_name: HashMap<String, String>,
}

impl Fields {
    fn add(&mut self, line: &str) -> Result<(), String> {
        if line.starts_with('#') {
            return Ok(());
        }
        let Some(colon) = line.find(':') else {
            return Err(format!(
                "header line '{}': expected 'field: value'",
                excerpt(line)
            ));
        };
        if line[colon..].starts_with(":=") {
            return Ok(());
        }
        // "data file" and "datafile" are the same field, and so are the skips.
        let name: String = line[..colon].to_lowercase().split_whitespace().collect();
        let value = line[colon + 1..].trim().to_owned();
        match self.by_name.insert(name, value) {
            None => Ok(()),
            Some(_) => Err(format!("field '{}' is given twice", line[..colon].trim())),
        }
    }

    fn data_file_is_list(&self) -> bool {
        let first = self
            .by_name
            .get("datafile")
            .and_then(|value| value.split_whitespace().next());
        first.is_some_and(|word| word.eq_ignore_ascii_case("list"))
    }

    fn into_header(self, listed: Vec<String>, bytes: u64) -> Result<Header, Fault> {
        let voxel_type = self.voxel_type()?;
        let encoding = self.required("encoding")?.parse()?;
        let sizes = self.sizes()?;
        let dimension = sizes.len();
        let mut kinds = self.words("kinds", dimension)?;
        kinds.resize(dimension, "domain".to_owned());
        let mut spacings = self.numbers("spacings", dimension)?;
        spacings.resize(dimension, f64::NAN);
        Ok(Header {
            endian: self.endian(voxel_type, encoding)?,
            directions: self.directions(dimension)?,
            origin: self.origin()?,
            space: self.by_name.get("space").cloned(),
            data_files: DataFiles::parse(
                self.by_name.get("datafile").map(String::as_str),
                listed,
                dimension,
            )?,
            line_skip: self.skip("lineskip", 0)? as u64,
            byte_skip: self.skip("byteskip", -1)?,
            voxel_type,
            encoding,
            sizes,
            kinds,
            spacings,
            bytes,
        })
    }

    fn required(&self, name: &str) -> Result<&str, String> {
        let value = self.by_name.get(name).map(String::as_str);
        value.ok_or_else(|| format!("the header has no field '{name}'"))
    }

    fn voxel_type(&self) -> Result<VoxelType, Fault> {
        let name = self.required("type")?;
        if name.eq_ignore_ascii_case("block") {
            return Err(Fault::Unsupported(
                "type block (opaque records): convert it to a number type".to_owned(),
            ));
        }
        Ok(name
            .parse()
            .map_err(|what| format!("field 'type': {what}"))?)
    }

    fn endian(&self, voxel_type: VoxelType, encoding: Encoding) -> Result<Endian, String> {
        match self.by_name.get("endian") {
            Some(text) => text
                .parse()
                .map_err(|what| format!("field 'endian': {what}")),
            None if voxel_type.bytes() == 1 || encoding == Encoding::Text => Ok(Endian::Little),
            None => Err(format!(
                "the header has no field 'endian', which type {} needs",
                voxel_type.name()
            )),
        }
    }

    fn sizes(&self) -> Result<Vec<usize>, String> {
        let dimension: usize = parse("dimension", self.required("dimension")?)?;
        if !(1..=MAX_DIMENSION).contains(&dimension) {
            return Err(format!(
                "field 'dimension' is {dimension}: expected 1 to {MAX_DIMENSION}"
            ));
        }
        self.required("sizes")?;
        let words = self.words("sizes", dimension)?;
        let sizes: Vec<usize> = words
            .iter()
            .map(|word| parse("sizes", word))
            .collect::<Result<_, _>>()?;
        if sizes.contains(&0) {
            return Err(format!(
                "field 'sizes' is {}: each must be at least 1",
                words.join(" ")
            ));
        }
        Ok(sizes)
    }

    /// The words of a per-axis field; none if it is absent.
    fn words(&self, name: &str, dimension: usize) -> Result<Vec<String>, String> {
        let Some(text) = self.by_name.get(name) else {
            return Ok(Vec::new());
        };
        let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
        if words.len() == dimension {
            return Ok(words);
        }
        let held = words.len();
        Err(format!(
            "field '{name}' has {held} entries, but 'dimension' is {dimension}"
        ))
    }

    fn numbers(&self, name: &str, dimension: usize) -> Result<Vec<f64>, String> {
        self.words(name, dimension)?
            .iter()
            .map(|word| parse(name, word))
            .collect()
    }

    fn directions(&self, dimension: usize) -> Result<Vec<Option<Vec<f64>>>, String> {
        let Some(text) = self.by_name.get("spacedirections") else {
            return Ok(Vec::new());
        };
        let vectors = parse_vectors("space directions", text)?;
        if vectors.len() == dimension {
            return Ok(vectors);
        }
        let held = vectors.len();
        Err(format!(
            "field 'space directions' has {held} entries, but 'dimension' is {dimension}"
        ))
    }

    fn origin(&self) -> Result<Option<Vec<f64>>, String> {
        let Some(text) = self.by_name.get("spaceorigin") else {
            return Ok(None);
        };
        match parse_vectors("space origin", text)?.as_slice() {
            [one] => Ok(one.clone()),
            _ => Err(format!(
                "field 'space origin' is '{}': expected one vector (x,y,z)",
                excerpt(text)
            )),
        }
    }

    fn skip(&self, name: &str, least: i64) -> Result<i64, String> {
        let Some(text) = self.by_name.get(name) else {
            return Ok(0);
        };
        let count: i64 = parse(name, text)?;
        if count < least {
            return Err(format!(
                "field '{name}' is {count}: expected at least {least}"
            ));
        }
        Ok(count)
    }
}

fn parse<T: FromStr>(name: &str, word: &str) -> Result<T, String> {
    word.parse().map_err(|_| {
        format!(
            "field '{name}' holds '{}': expected a number",
            excerpt(word)
        )
    })
}

/// The vectors of a field such as `(1,0,0) none (0, 0, 1)`; `none` gives `None`.
fn parse_vectors(name: &str, text: &str) -> Result<Vec<Option<Vec<f64>>>, String> {
    let fault = || {
        format!(
            "field '{name}' is '{}': expected vectors such as (1,0,0) or none",
            excerpt(text)
        )
    };
    let mut vectors = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        if let Some(inside) = rest.strip_prefix('(') {
            let (inside, after) = inside.split_once(')').ok_or_else(fault)?;
            let numbers = inside
                .split(',')
                .map(|word| word.trim().parse())
                .collect::<Result<Vec<f64>, _>>();
            vectors.push(Some(numbers.map_err(|_| fault())?));
            rest = after.trim_start();
        } else {
            let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            if !word.eq_ignore_ascii_case("none") {
                return Err(fault());
            }
            vectors.push(None);
            rest = after.trim_start();
        }
    }
    Ok(vectors)
}

/// The axes of a scalar volume.
pub(crate) struct Geometry {
    pub(crate) lattice: Lattice,
    /// The axis along which the components of a voxel lie, where there are several.
    pub(crate) components: Option<usize>,
}

pub(crate) fn derive(header: &Header) -> Result<Geometry, Fault> {
    let (spatial, components) = spatial_axes(header)?;
    let mut dims = [1; 3];
    let mut columns = Vec::new();
    for (dim, &axis) in dims.iter_mut().zip(&spatial) {
        *dim = header.sizes[axis];
        columns.push(axis_in_world(header, axis, columns.len())?);
    }
    let origin = header
        .origin
        .as_deref()
        .map_or(Ok(DVec3::ZERO), |origin| in_space("space origin", origin))?;
    let lattice = Lattice {
        dims,
        world_from_index: DAffine3::from_mat3_translation(decode::complete(columns), origin),
        up_hint: header.space.as_deref().and_then(up_of),
        space: header.space.clone(),
        modality: None,
        unit: None,
        window: None,
    };
    Ok(Geometry {
        lattice,
        components,
    })
}

/// The one to three axes that are the volume's, in file order, and the axis of a voxel's components.
fn spatial_axes(header: &Header) -> Result<(Vec<usize>, Option<usize>), Fault> {
    let is_spatial = |axis: usize| {
        let kind = header.kinds[axis].to_lowercase();
        let has_direction = header.directions.get(axis).is_none_or(Option::is_some);
        has_direction && matches!(kind.as_str(), "domain" | "space" | "none" | "???" | "stub")
    };
    let mut axes = Vec::new();
    let mut components = None;
    for axis in 0..header.sizes.len() {
        match (is_spatial(axis), header.sizes[axis]) {
            (true, _) => axes.push(axis),
            (false, 1) => {}
            (false, _) if components.is_none() => components = Some(axis),
            (false, size) => return Err(not_scalar(&header.kinds[axis], axis, size)),
        }
    }
    // Of more than three, those of size 1 go, the slowest first.
    while axes.len() > 3 {
        let Some(place) = axes.iter().rposition(|&axis| header.sizes[axis] == 1) else {
            let count = axes.len();
            return Err(Fault::Unsupported(format!(
                "{count} axes are longer than 1: a volume has three, so cut out one volume first"
            )));
        };
        axes.remove(place);
    }
    Ok((axes, components))
}

fn not_scalar(kind: &str, axis: usize, size: usize) -> Fault {
    let what = if matches!(kind, "domain" | "space" | "none" | "???") {
        "not in space"
    } else {
        kind
    };
    Fault::Unsupported(format!(
        "axis {axis} of size {size} is {what}, and another axis is not in space either: cut out one component or one time first"
    ))
}

fn axis_in_world(header: &Header, axis: usize, place: usize) -> Result<DVec3, Fault> {
    if let Some(direction) = header.directions.get(axis).and_then(Option::as_deref) {
        return in_space("space directions", direction);
    }
    let spacing = header.spacings[axis];
    // NaN is how the format writes a spacing that is not known.
    Ok(DVec3::AXES[place] * if spacing.is_nan() { 1.0 } else { spacing })
}

/// Two to four components as a vector of space; the fourth, which would be time, must be 0.
fn in_space(name: &str, components: &[f64]) -> Result<DVec3, Fault> {
    match *components {
        [x, y] => Ok(DVec3::new(x, y, 0.0)),
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        [x, y, z, 0.0] => Ok(DVec3::new(x, y, z)),
        _ => {
            let count = components.len();
            Err(Fault::Unsupported(format!(
                "field '{name}' has a vector of {count} components: space has three"
            )))
        }
    }
}

/// In the anatomical spaces the third coordinate grows towards the head.
fn up_of(space: &str) -> Option<DVec3> {
    let space = space.trim_matches('"').to_lowercase();
    let anatomical = [
        "right-anterior-superior",
        "ras",
        "left-anterior-superior",
        "las",
        "left-posterior-superior",
        "lps",
    ];
    let spatial = space.strip_suffix("-time").unwrap_or(&space);
    let known = anatomical.contains(&spatial) || matches!(spatial, "rast" | "last" | "lpst");
    known.then_some(DVec3::Z)
}
