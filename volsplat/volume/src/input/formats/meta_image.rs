//! MetaImage files, `.mha` with attached and `.mhd` with detached data.
//!
//! Takes a path, returns the parts of a volume. The header is a list of `Key = Value` lines whose last key,
//! ElementDataFile, says where the data is: behind the header, in one file, a list of files or a numbered series. The
//! data is binary, zlib-compressed or text. Keys have aliases (Offset, Position and Origin mean the same).
//! TransformMatrix lists one axis of the image after the other: its first row is the direction of the first axis.
//! The source is the description of MetaIO, ITK's library for this format.
//! Limits: scalars, or one chosen component; "CenterOfRotation" and the intensity function are ignored, as ITK does,
//! and so is "CompressedDataSize": the whole stream is unpacked, and its length must fit the size of the image.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use glam::{DAffine3, DVec3};
use resample_io::Gate;

use crate::Error;
use crate::input::data_files::DataFiles;
use crate::input::decode::component::Interleaved;
use crate::input::decode::stored::Located;
use crate::input::decode::{Layout, component};
use crate::input::file::{Fault, Lines, excerpt, unsupported};
use crate::input::{Parts, decode, invalid, open, open_sized};
use crate::volume::{Endian, Lattice, VoxelType, Voxels, voxel_count};

pub(crate) fn load(path: &Path, components: &[usize], gate: &Gate) -> Result<Parts, Error> {
    let header = read(&mut BufReader::new(open(path)?)).map_err(|fault| fault.at(path))?;
    let chosen = component::chosen(components, header.channels).map_err(|fault| fault.at(path))?;
    let voxels = voxels(path, &header, chosen, gate)?;
    Ok(Parts {
        voxels,
        lattice: header.lattice,
    })
}

/// How many bytes of colour a voxel has; `None` where it is a number.
pub(crate) fn colours(path: &Path) -> Result<Option<usize>, Error> {
    let header = read(&mut BufReader::new(open(path)?)).map_err(|fault| fault.at(path))?;
    Ok(Some(header.channels).filter(|_| header.voxel_type == VoxelType::U8))
}

/// Where the voxels lie; `None` where they are packed or have several components.
pub(crate) fn locate(path: &Path, gate: &Gate) -> Result<Option<Located>, Error> {
    let header = read(&mut BufReader::new(open(path)?)).map_err(|fault| fault.at(path))?;
    if header.encoding != Encoding::Raw || header.channels != 1 {
        return Ok(None);
    }
    let data = data_files(path, &header, vec![0], gate)?;
    let place = |DataFile { name, data }| {
        let begin = data.begin(&header).map_err(|fault| fault.at(&name))?;
        Ok((name, begin))
    };
    Ok(Some(Located {
        voxel_type: header.voxel_type,
        endian: header.endian,
        files: data.into_iter().map(place).collect::<Result<_, Error>>()?,
        lattice: header.lattice,
    }))
}

/// The data files, opened.
fn data_files(
    path: &Path,
    header: &Header,
    chosen: Vec<usize>,
    gate: &Gate,
) -> Result<Vec<DataFile>, Error> {
    let count = voxel_count(header.lattice.dims)
        .map_err(|what| invalid(path, format!("DimSize: {what}")))?;
    let files = header
        .data_files
        .paths(path, &header.lattice.dims, gate)
        .map_err(|fault| fault.at(path))?;
    let start = if header.data_files == DataFiles::Attached {
        header.bytes
    } else {
        0
    };
    let layout = Layout {
        voxel_type: header.voxel_type,
        endian: header.endian,
        count: count / files.len(),
    };
    let interleaved = Interleaved {
        scalar_bytes: header.voxel_type.bytes(),
        components: header.channels,
        chosen,
    };
    let opened = |name: PathBuf| {
        let (file, total) = open_sized(&name)?;
        let data = Data {
            file,
            total,
            start,
            layout,
            interleaved: interleaved.clone(),
        };
        Ok(DataFile { name, data })
    };
    files.into_iter().map(opened).collect()
}

fn voxels(
    path: &Path,
    header: &Header,
    chosen: Vec<usize>,
    gate: &Gate,
) -> Result<Vec<Voxels>, Error> {
    let files = data_files(path, header, chosen, gate)?.into_iter();
    let decoded = files.map(|file| {
        let voxels = file.data.decode(header, gate);
        voxels.map_err(|fault| fault.at(&file.name))
    });
    let voxels = decode::joined(decoded)?;
    if voxels.is_empty() {
        return Err(invalid(path, "ElementDataFile names no file"));
    }
    Ok(voxels)
}

/// A data file and its name.
struct DataFile {
    name: PathBuf,
    data: Data,
}

/// One data file.
struct Data {
    file: File,
    /// Its length in bytes.
    total: u64,
    /// Where the data begins if HeaderSize does not say it.
    start: u64,
    layout: Layout,
    interleaved: Interleaved,
}

impl Data {
    fn decode(mut self, header: &Header, gate: &Gate) -> Result<Vec<Voxels>, Fault> {
        let needed = self.needed()?;
        let skip = self.begin(header)?;
        let held = self.total.saturating_sub(skip);
        match header.encoding {
            Encoding::Zlib => decode::check_deflated(needed, held, gate)?,
            // A digit and a separator for every value but the last.
            Encoding::Text if 2 * self.layout.count as u64 - 1 > held => {
                return Err(Fault::Invalid(format!(
                    "{} values cannot stand in {held} bytes",
                    self.layout.count
                )));
            }
            Encoding::Raw | Encoding::Text => {}
        }
        self.file
            .seek(SeekFrom::Start(skip))
            .map_err(|error| decode::broken(&error))?;
        let mut file = BufReader::new(self.file);
        Ok(match header.encoding {
            Encoding::Raw => component::read(file, &self.layout, &self.interleaved)?,
            Encoding::Zlib => {
                let unpacked = flate2::bufread::ZlibDecoder::new(file);
                component::read(unpacked, &self.layout, &self.interleaved)?
            }
            Encoding::Text if self.interleaved.components > 1 => {
                return Err(Fault::Unsupported(
                    "several channels as text: save the data as binary".to_owned(),
                ));
            }
            Encoding::Text => vec![decode::text(&mut file, &self.layout)?],
        })
    }

    /// Bytes that plain data takes.
    fn needed(&self) -> Result<u64, String> {
        let needed = self
            .layout
            .bytes()?
            .checked_mul(self.interleaved.components as u64);
        needed.ok_or_else(|| "the voxels take more bytes than can be counted".to_owned())
    }

    /// The first byte of the data. Plain data must fill the rest of the file.
    fn begin(&self, header: &Header) -> Result<u64, Fault> {
        let needed = self.needed()?;
        let skip = self.skip(header, needed)?;
        let held = self.total.saturating_sub(skip);
        if header.encoding == Encoding::Raw && held != needed {
            return Err(Fault::Invalid(wrong_length(header, needed, held)));
        }
        Ok(skip)
    }

    /// Bytes of the file before the data. HeaderSize counts from the beginning of the file, attached or not.
    fn skip(&self, header: &Header, needed: u64) -> Result<u64, String> {
        match (header.header_size, header.encoding) {
            (0, _) => Ok(self.start),
            (-1, Encoding::Raw) => self.total.checked_sub(needed).ok_or_else(|| {
                format!(
                    "{} needs {needed} bytes, the file has {}",
                    header.described(),
                    self.total
                )
            }),
            (-1, _) => Err("HeaderSize = -1 is for plain binary data only".to_owned()),
            (size, _) => Ok(size.unsigned_abs()),
        }
    }
}

fn wrong_length(header: &Header, needed: u64, held: u64) -> String {
    format!(
        "{} needs {needed} bytes of data, there are {held}: check DimSize, ElementType, ElementNumberOfChannels and \
         HeaderSize",
        header.described()
    )
}

/// How the data is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Raw,
    Zlib,
    Text,
}

/// The facts of the header.
pub(crate) struct Header {
    pub(crate) lattice: Lattice,
    pub(crate) voxel_type: VoxelType,
    pub(crate) endian: Endian,
    pub(crate) encoding: Encoding,
    /// Components of a voxel, at least 1.
    pub(crate) channels: usize,
    /// Bytes before the data; -1 means that the data is at the end of the file.
    header_size: i64,
    pub(crate) data_files: DataFiles,
    /// Bytes of the header: where attached data begins.
    pub(crate) bytes: u64,
}

/// Keys with which a header can begin: a first line with another key is no MetaImage.
const FIRST_KEYS: [&str; 13] = [
    "objecttype",
    "objectsubtype",
    "comment",
    "ndims",
    "name",
    "id",
    "parentid",
    "color",
    "binarydata",
    "compresseddata",
    "transformmatrix",
    "dimsize",
    "elementtype",
];

/// Greatest NDims; MetaIO has the same bound.
const MAX_DIMENSION: usize = 10;

pub(crate) fn begins(head: &[u8]) -> bool {
    let line = head.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let Some(at) = line.iter().position(|&byte| byte == b'=') else {
        return false;
    };
    let key = String::from_utf8_lossy(&line[..at]).trim().to_lowercase();
    FIRST_KEYS.contains(&key.as_str())
}

pub(crate) fn read(reader: &mut dyn BufRead) -> Result<Header, Fault> {
    let mut lines = Lines::new(reader);
    let mut fields = Fields::default();
    let data_file = loop {
        let Some(line) = lines.next()? else {
            return Err(Fault::Invalid(
                "the header has no ElementDataFile, which must be its last line".to_owned(),
            ));
        };
        let Some((key, value)) = line.split_once('=') else {
            if line.trim().is_empty() {
                continue;
            }
            return Err(Fault::Invalid(format!(
                "header line '{}': expected 'Key = Value'",
                excerpt(&line)
            )));
        };
        let (key, value) = (key.trim().to_lowercase(), value.trim().to_owned());
        if key == "elementdatafile" {
            break value;
        }
        fields.add(key, value)?;
    };
    let bytes = lines.bytes;
    let mut listed = Vec::new();
    if data_file
        .split_whitespace()
        .next()
        .is_some_and(|word| word.eq_ignore_ascii_case("list"))
    {
        while let Some(line) = lines.next()? {
            listed.extend(Some(line).filter(|line| !line.trim().is_empty()));
        }
    }
    fields.into_header(&data_file, listed, bytes)
}

impl Header {
    /// Size and type for a message.
    pub(crate) fn described(&self) -> String {
        let ([x, y, z], name, channels) =
            (self.lattice.dims, self.voxel_type.name(), self.channels);
        format!("an image of {x}x{y}x{z} voxels of {channels} x {name}")
    }
}

#[derive(Default)]
struct Fields {
    /// Lower-case keys to values.
    by_key: HashMap<String, String>,
}

impl Fields {
    fn add(&mut self, key: String, value: String) -> Result<(), String> {
        match self.by_key.insert(key.clone(), value) {
            Some(_) if key != "comment" => {
                Err(format!("the key '{}' is given twice", excerpt(&key)))
            }
            _ => Ok(()),
        }
    }

    fn into_header(
        self,
        data_file: &str,
        listed: Vec<String>,
        bytes: u64,
    ) -> Result<Header, Fault> {
        self.check_kind()?;
        let sizes = self.sizes()?;
        let mut dims = [1; 3];
        dims.iter_mut()
            .zip(&sizes)
            .for_each(|(dim, &size)| *dim = size);
        let is_anatomical = self.is_anatomical();
        let is_local = data_file.eq_ignore_ascii_case("local");
        let named = (!is_local).then_some(data_file);
        Ok(Header {
            lattice: Lattice {
                dims,
                world_from_index: self.world_from_index(sizes.len())?,
                // The third coordinate grows towards the head in the space that ITK writes.
                up_hint: is_anatomical.then_some(DVec3::Z),
                space: is_anatomical.then(|| "left-posterior-superior".to_owned()),
                modality: None,
                unit: None,
                window: None,
            },
            voxel_type: self.voxel_type()?,
            endian: self.endian()?,
            encoding: self.encoding()?,
            channels: self.channels()?,
            header_size: self.header_size()?,
            // Lists and series hold slices of the axes that are read; a fourth axis has size 1.
            data_files: DataFiles::parse(named, listed, dims.len())?,
            bytes,
        })
    }

    fn get(&self, keys: &[&str]) -> Option<&str> {
        keys.iter()
            .find_map(|key| self.by_key.get(*key))
            .map(String::as_str)
    }

    fn check_kind(&self) -> Result<(), Fault> {
        match self.get(&["objecttype"]) {
            Some(kind) if !kind.eq_ignore_ascii_case("image") => Err(unsupported(format!(
                "unsupported ObjectType '{}' (expected Image)",
                excerpt(kind)
            ))),
            _ => Ok(()),
        }
    }

    /// The sizes of the axes: at least one, and beyond the third only 1.
    fn sizes(&self) -> Result<Vec<usize>, Fault> {
        let dimension: usize = number("NDims", self.get(&["ndims"]).unwrap_or("3"))?;
        if !(1..=MAX_DIMENSION).contains(&dimension) {
            return Err(Fault::Invalid(format!(
                "NDims is {dimension}: expected 1 to {MAX_DIMENSION}"
            )));
        }
        let text = self
            .get(&["dimsize"])
            .ok_or_else(|| "the header has no DimSize".to_owned())?;
        let sizes: Vec<usize> = numbers("DimSize", text, dimension)?;
        if sizes.contains(&0) {
            return Err(Fault::Invalid(format!(
                "DimSize is {}: each must be at least 1",
                excerpt(text)
            )));
        }
        if sizes.iter().skip(3).any(|&size| size > 1) {
            return Err(unsupported(format!(
                "DimSize is {}: a volume has three axes, so cut out one volume first",
                excerpt(text)
            )));
        }
        Ok(sizes)
    }

    fn world_from_index(&self, dimension: usize) -> Result<DAffine3, String> {
        let vector = |keys: &[&str]| {
            self.get(keys)
                .map(|text| numbers::<f64>(keys[0], text, dimension))
                .transpose()
        };
        let spacing =
            vector(&["elementspacing", "elementsize"])?.unwrap_or_else(|| vec![1.0; dimension]);
        if !spacing
            .iter()
            .take(3)
            .all(|&length| length > 0.0 && length.is_finite())
        {
            return Err(format!(
                "ElementSpacing is {spacing:?}: each must be finite and above 0"
            ));
        }
        let origin = vector(&["offset", "position", "origin"])?.unwrap_or_default();
        let directions = match self.get(&["transformmatrix", "rotation", "orientation"]) {
            Some(text) => numbers::<f64>("TransformMatrix", text, dimension * dimension)?,
            None => identity(dimension),
        };
        let rows = directions.chunks(dimension).zip(&spacing);
        let columns = rows
            .take(3)
            .map(|(row, &length)| in_space(row) * length)
            .collect();
        Ok(DAffine3::from_mat3_translation(
            decode::complete(columns),
            in_space(&origin),
        ))
    }

    /// Three letters such as RAI; "???" is how the format writes that they are not known.
    fn is_anatomical(&self) -> bool {
        let letters = self
            .get(&["anatomicalorientation"])
            .unwrap_or_default()
            .to_uppercase();
        letters.len() == 3 && letters.bytes().all(|letter| b"RLAPIS".contains(&letter))
    }

    fn voxel_type(&self) -> Result<VoxelType, Fault> {
        let name = self
            .get(&["elementtype"])
            .ok_or_else(|| "the header has no ElementType".to_owned())?;
        // In a MetaImage, long has four bytes on every machine.
        match name.to_uppercase().as_str() {
            "MET_UCHAR" => Ok(VoxelType::U8),
            "MET_CHAR" | "MET_ASCII_CHAR" => Ok(VoxelType::I8),
            "MET_USHORT" => Ok(VoxelType::U16),
            "MET_SHORT" => Ok(VoxelType::I16),
            "MET_UINT" | "MET_ULONG" => Ok(VoxelType::U32),
            "MET_INT" | "MET_LONG" => Ok(VoxelType::I32),
            "MET_ULONG_LONG" => Ok(VoxelType::U64),
            "MET_LONG_LONG" => Ok(VoxelType::I64),
            "MET_FLOAT" => Ok(VoxelType::F32),
            "MET_DOUBLE" => Ok(VoxelType::F64),
            _ => Err(unsupported(format!(
                "ElementType is '{}': expected a number type from MET_UCHAR to MET_DOUBLE",
                excerpt(name)
            ))),
        }
    }

    fn endian(&self) -> Result<Endian, String> {
        let is_big = self.flag(&["binarydatabyteordermsb", "elementbyteordermsb"], false)?;
        Ok(if is_big { Endian::Big } else { Endian::Little })
    }

    fn encoding(&self) -> Result<Encoding, String> {
        let is_binary = self.flag(&["binarydata"], true)?;
        let is_packed = self.flag(&["compresseddata"], false)?;
        match (is_binary, is_packed) {
            (true, true) => Ok(Encoding::Zlib),
            (true, false) => Ok(Encoding::Raw),
            (false, false) => Ok(Encoding::Text),
            (false, true) => Err("CompressedData is for BinaryData = True only".to_owned()),
        }
    }

    fn flag(&self, keys: &[&str], absent: bool) -> Result<bool, String> {
        match self.get(keys).map(str::to_lowercase).as_deref() {
            None => Ok(absent),
            Some("true" | "t" | "1") => Ok(true),
            Some("false" | "f" | "0") => Ok(false),
            Some(text) => Err(format!(
                "{} is '{}': expected True or False",
                keys[0],
                excerpt(text)
            )),
        }
    }

    fn channels(&self) -> Result<usize, String> {
        let channels = number(
            "ElementNumberOfChannels",
            self.get(&["elementnumberofchannels"]).unwrap_or("1"),
        )?;
        // More components than this fit no real image, and products with it must not overflow.
        if (1..=1 << 16).contains(&channels) {
            return Ok(channels);
        }
        Err(format!(
            "ElementNumberOfChannels is {channels}: expected 1 to 65536"
        ))
    }

    fn header_size(&self) -> Result<i64, String> {
        let size: i64 = number("HeaderSize", self.get(&["headersize"]).unwrap_or("0"))?;
        if size < -1 {
            return Err(format!("HeaderSize is {size}: expected at least -1"));
        }
        Ok(size)
    }
}

fn identity(dimension: usize) -> Vec<f64> {
    let is_diagonal = |index: usize| index.is_multiple_of(dimension + 1);
    (0..dimension * dimension)
        .map(|index| if is_diagonal(index) { 1.0 } else { 0.0 })
        .collect()
}

/// The first three components; missing ones are 0.
fn in_space(components: &[f64]) -> DVec3 {
    let at = |index: usize| components.get(index).copied().unwrap_or(0.0);
    DVec3::new(at(0), at(1), at(2))
}

fn numbers<T: FromStr>(key: &str, text: &str, count: usize) -> Result<Vec<T>, String> {
    let values = text
        .split_whitespace()
        .map(|word| number(key, word))
        .collect::<Result<Vec<T>, _>>()?;
    if values.len() == count {
        return Ok(values);
    }
    Err(format!(
        "{key} is '{}': expected {count} numbers",
        excerpt(text)
    ))
}

fn number<T: FromStr>(key: &str, word: &str) -> Result<T, String> {
    word.parse()
        .map_err(|_| format!("{key} holds '{}': expected a number", excerpt(word)))
}

#[cfg(test)]
mod tests;
