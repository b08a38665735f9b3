//! NRRD files, versions 1 to 5, with attached or detached data.
//!
//! Takes a path, returns the parts of a volume. The header (`header.rs`) says what the numbers are, which of the axes are the volume's and
//! where they lie; then the data is found, unpacked and decoded. The claims of the header are compared with the size of the file
//! before anything is allocated: exactly for raw data, by the greatest possible expansion for packed data and text.
//! The source is the definition of the NRRD file format of the Teem library, version 1.9 and later.
//! Limits: scalar volumes, or one of several components; "block" types, and the fields that do not place or size the data ("axis mins", "centers",
//! "thicknesses", units, "measurement frame", "old min", key/value pairs), are ignored. World coordinates are
//! kept as the file has them: nothing is flipped between anatomical conventions.

mod header;

use std::fs::File;
use std::io;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use resample_io::Gate;

use crate::Error;
use crate::input::data_files::DataFiles;
use crate::input::decode::component::Interleaved;
use crate::input::decode::stored::Located;
use crate::input::decode::{DEFLATE_EXPANSION, Layout, component};
use crate::input::file::Fault;
use crate::input::formats::nrrd::header::{Encoding, Header};
use crate::input::{Parts, cannot_read, decode, invalid, open, open_sized};
use crate::volume::{VoxelType, Voxels};

/// The first bytes of every NRRD file; one digit of version follows.
pub(crate) const MAGIC: &[u8] = b"NRRD000";

pub(crate) fn load(path: &Path, components: &[usize], gate: &Gate) -> Result<Parts, Error> {
    let mut reader = BufReader::new(open(path)?);
    let header = header::read(&mut reader).map_err(|fault| fault.at(path))?;
    let geometry = header::derive(&header).map_err(|fault| fault.at(path))?;
    let held = geometry.components.map_or(1, |axis| header.sizes[axis]);
    let chosen = component::chosen(components, held).map_err(|fault| fault.at(path))?;
    let voxels = read(
        path,
        &header,
        geometry.components.map(|axis| SomeOf { axis, chosen }),
        gate,
    )?;
    Ok(Parts {
        lattice: geometry.lattice,
        voxels,
    })
}

/// How many bytes of colour a voxel has; `None` where it is a number.
pub(crate) fn colours(path: &Path) -> Result<Option<usize>, Error> {
    let header = header::read(&mut BufReader::new(open(path)?)).map_err(|fault| fault.at(path))?;
    let geometry = header::derive(&header).map_err(|fault| fault.at(path))?;
    let count = geometry.components.map(|axis| header.sizes[axis]);
    Ok(count.filter(|_| header.voxel_type == VoxelType::U8))
}

/// Where the voxels lie; `None` where they are packed.
pub(crate) fn locate(path: &Path, gate: &Gate) -> Result<Option<Located>, Error> {
    let header = header::read(&mut BufReader::new(open(path)?)).map_err(|fault| fault.at(path))?;
    let geometry = header::derive(&header).map_err(|fault| fault.at(path))?;
    if geometry.components.is_some() {
        return Ok(None);
    }
    let Some(files) = locate_files(path, &header, gate)? else {
        return Ok(None);
    };
    Ok(Some(Located {
        lattice: geometry.lattice,
        voxel_type: header.voxel_type,
        endian: header.endian,
        files,
    }))
}

/// Some of the components that lie along an axis.
pub(crate) struct SomeOf {
    axis: usize,
    chosen: Vec<usize>,
}

pub(crate) fn read(
    path: &Path,
    header: &Header,
    some_of: Option<SomeOf>,
    gate: &Gate,
) -> Result<Vec<Voxels>, Error> {
    let (files, start, layout) = files(path, header, gate)?;
    let interleaved = interleaved(path, header, some_of, files.len())?;
    let stored = Stored {
        layout,
        interleaved,
    };
    let decoded = |file: &PathBuf| {
        let packed = Packed::open(file, start, header)?;
        let voxels = packed.decode(header.encoding, &stored, gate);
        voxels.map_err(|fault| fault.at(file))
    };
    let voxels = decode::joined(files.iter().map(decoded))?;
    if voxels.is_empty() {
        return Err(invalid(path, "field 'data file' names no file"));
    }
    Ok(voxels)
}

/// The files of plain data, each with its first byte; `None` where the data is packed.
fn locate_files(
    path: &Path,
    header: &Header,
    gate: &Gate,
) -> Result<Option<Vec<(PathBuf, u64)>>, Error> {
    if header.encoding != Encoding::Raw {
        return Ok(None);
    }
    let (files, start, layout) = files(path, header, gate)?;
    let place = |file: PathBuf| {
        let packed = Packed::open(&file, start, header)?;
        let needed = layout.bytes().map_err(|what| invalid(&file, what))?;
        let skip = packed
            .raw_skip(&layout, needed)
            .map_err(|what| invalid(&file, what))?;
        Ok((file, packed.begin + skip))
    };
    files
        .into_iter()
        .map(place)
        .collect::<Result<_, Error>>()
        .map(Some)
}

/// The values of one data file: all of them, and the components that are read.
struct Stored {
    layout: Layout,
    interleaved: Interleaved,
}

impl Stored {
    fn decode(&self, stream: impl Read) -> Result<Vec<Voxels>, String> {
        let layout = Layout {
            count: self.layout.count / self.interleaved.components,
            ..self.layout
        };
        component::read(stream, &layout, &self.interleaved)
    }
}

/// The data files, the first byte of each behind a header of its own, and what one of them holds.
fn files(path: &Path, header: &Header, gate: &Gate) -> Result<(Vec<PathBuf>, u64, Layout), Error> {
    let count = value_count(&header.sizes).map_err(|what| invalid(path, what))?;
    let files = header
        .data_files
        .paths(path, &header.sizes, gate)
        .map_err(|fault: Fault| fault.at(path))?;
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
    Ok((files, start, layout))
}

/// How the components that are read lie between the others: the axes before its own make up one "scalar".
fn interleaved(
    path: &Path,
    header: &Header,
    some_of: Option<SomeOf>,
    files: usize,
) -> Result<Interleaved, Error> {
    let bytes = header.voxel_type.bytes();
    let Some(SomeOf { axis, chosen }) = some_of else {
        return Ok(Interleaved {
            scalar_bytes: bytes,
            components: 1,
            chosen: vec![0],
        });
    };
    if files > 1 || header.encoding == Encoding::Text {
        let what = "one component of a text, or out of several data files: write the data to one binary file first";
        return Err(Fault::Unsupported(what.to_owned()).at(path));
    }
    let inner = value_count(&header.sizes[..axis]).map_err(|what| invalid(path, what))?;
    Ok(Interleaved {
        scalar_bytes: inner.saturating_mul(bytes),
        components: header.sizes[axis],
        chosen,
    })
}

/// Number of values of all axes together.
fn value_count(sizes: &[usize]) -> Result<usize, String> {
    let count = sizes
        .iter()
        .try_fold(1usize, |count, &size| count.checked_mul(size));
    count.ok_or_else(|| {
        format!("field 'sizes' is {sizes:?}: more values than this machine can count")
    })
}

/// Bytes up to and including the given number of line ends, read from where the file stands.
fn skip_lines(file: &mut File, lines: u64) -> io::Result<u64> {
    let mut reader = BufReader::new(file);
    let mut skipped = 0;
    for line in 0..lines {
        let got = reader.skip_until(b'\n')?;
        if got == 0 {
            let what = format!("'line skip' is {lines}, but there are only {line} lines");
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, what));
        }
        skipped += got as u64;
    }
    Ok(skipped)
}

/// The bytes of one data file behind the head and the skipped lines.
struct Packed {
    file: File,
    /// Where they begin in the file.
    begin: u64,
    /// How many there are.
    held: u64,
    byte_skip: i64,
}

impl Packed {
    fn open(path: &Path, start: u64, header: &Header) -> Result<Self, Error> {
        let (mut file, total) = open_sized(path)?;
        let mut begin = || -> io::Result<u64> {
            file.seek(SeekFrom::Start(start))?;
            skip_lines(&mut file, header.line_skip)
        };
        let skipped = begin().map_err(|source| cannot_read(path, source))?;
        let held = total.saturating_sub(start + skipped);
        Ok(Self {
            file,
            begin: start + skipped,
            held,
            byte_skip: header.byte_skip,
        })
    }

    fn decode(
        self,
        encoding: Encoding,
        stored: &Stored,
        gate: &Gate,
    ) -> Result<Vec<Voxels>, Fault> {
        let layout = &stored.layout;
        let needed = layout.bytes()?;
        if encoding == Encoding::Raw {
            let skip = self.raw_skip(layout, needed)?;
            return Ok(stored.decode(self.behind(skip)?)?);
        }
        let Ok(skip) = u64::try_from(self.byte_skip) else {
            return Err(Fault::Unsupported(
                "'byte skip: -1' with an encoding other than raw".to_owned(),
            ));
        };
        let unpacked = needed.saturating_add(skip);
        Ok(match encoding {
            Encoding::Text => {
                // A digit and a separator for every value but the last.
                self.refuse_beyond(2 * layout.count as u64 - 1, self.held, "text")?;
                vec![decode::text(&mut self.behind(skip)?, layout)?]
            }
            Encoding::Hex => {
                self.refuse_beyond(needed.saturating_mul(2), self.held, "hex text")?;
                stored.decode(HexReader::new(self.behind(skip)?))?
            }
            Encoding::Bzip2 => {
                // It expands up to a million times, so its size says little; memory grows only as data arrives.
                gate.ask_unpacked(unpacked, self.held, "the voxels")?;
                let stream = bzip2::bufread::MultiBzDecoder::new(self.behind(0)?);
                stored.decode(after_skip(stream, skip)?)?
            }
            Encoding::Gzip | Encoding::Raw => {
                let possible = self.held.saturating_mul(DEFLATE_EXPANSION);
                self.refuse_beyond(unpacked, possible, "unpacked data")?;
                gate.ask_unpacked(unpacked, self.held, "the voxels")?;
                let stream = flate2::bufread::MultiGzDecoder::new(self.behind(0)?);
                stored.decode(after_skip(stream, skip)?)?
            }
        })
    }

    /// Bytes before plain data, which must fill the rest of the file.
    fn raw_skip(&self, layout: &Layout, needed: u64) -> Result<u64, String> {
        // -1 means that the data is the end of the file, whatever stands before it.
        let skip = match u64::try_from(self.byte_skip) {
            Ok(skip) => skip,
            Err(_) => self.held.saturating_sub(needed),
        };
        if skip.checked_add(needed) != Some(self.held) {
            let (count, name, held) = (layout.count, layout.voxel_type.name(), self.held);
            return Err(format!(
                "{count} values of {name} need {needed} bytes after skipping {skip}, there are {held}: \
                 check 'sizes', 'type' and the skips"
            ));
        }
        Ok(skip)
    }

    /// The bytes behind those that are skipped.
    fn behind(mut self, skip: u64) -> Result<BufReader<File>, String> {
        let place = SeekFrom::Start(self.begin.saturating_add(skip));
        self.file
            .seek(place)
            .map_err(|error| decode::broken(&error))?;
        Ok(BufReader::new(self.file))
    }

    fn refuse_beyond(&self, needed: u64, possible: u64, what: &str) -> Result<(), String> {
        if needed <= possible {
            return Ok(());
        }
        Err(format!(
            "the header needs {needed} bytes of {what}, but the {} bytes there give at most {possible}: \
             the file is cut off or 'sizes' is wrong",
            self.held
        ))
    }
}

/// An unpacked stream behind its first `skip` bytes.
fn after_skip(mut stream: impl Read, skip: u64) -> Result<impl Read, String> {
    let skipped = io::copy(&mut (&mut stream).take(skip), &mut io::sink());
    let skipped = skipped.map_err(|error| decode::broken(&error))?;
    if skipped < skip {
        return Err(format!(
            "'byte skip' is {skip}, but the unpacked data has {skipped} bytes"
        ));
    }
    Ok(stream)
}

/// Unpacks hexadecimal text.
struct HexReader<R> {
    text: R,
    /// The first digit of a byte whose second one has not come yet.
    high: Option<u8>,
}

impl<R: BufRead> HexReader<R> {
    pub(crate) fn new(text: R) -> Self {
        Self { text, high: None }
    }
}

impl<R: BufRead> Read for HexReader<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut written = 0;
        while written == 0 && !bytes.is_empty() {
            let text = self.text.fill_buf()?;
            if text.is_empty() {
                return if self.high.is_none() {
                    Ok(0)
                } else {
                    Err(fault("half a byte at the end"))
                };
            }
            let mut used = 0;
            for &character in text {
                if written == bytes.len() {
                    break;
                }
                used += 1;
                if character.is_ascii_whitespace() {
                    continue;
                }
                let digit = char::from(character)
                    .to_digit(16)
                    .ok_or_else(|| fault("not a hexadecimal digit"))?
                    as u8;
                match self.high.take() {
                    None => self.high = Some(digit),
                    Some(high) => {
                        bytes[written] = high << 4 | digit;
                        written += 1;
                    }
                }
            }
            self.text.consume(used);
        }
        Ok(written)
    }
}

fn fault(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("hex data: {what}"))
}

#[cfg(test)]
mod tests;
