//! MetaImage files, `.mha` with attached and `.mhd` with detached data.
//!
//! Takes a path, gives the parts of a volume. The header (`header.rs`) is a list of `Key = Value` lines whose last key,
//! ElementDataFile, says where the data is: behind the header, in one file, a list of files or a numbered series. The
//! data is binary, zlib-compressed or text. The source is the description of MetaIO, ITK's library for this format.
//! Limits: scalars, or one chosen component; "CenterOfRotation" and the intensity function are left aside, as ITK does,
//! and so is "CompressedDataSize": the whole stream is unpacked, and its length must fit the size of the image.

use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use resample_io::Gate;

use crate::Error;
use crate::input::data_files::DataFiles;
use crate::input::decode::Layout;
use crate::input::decode::component::{Interleaved, chosen};
use crate::input::decode::stored::Located;
use crate::input::fault::Fault;
use crate::input::{Parts, decode, invalid, open, open_sized};
use crate::volume::{VoxelType, Voxels, voxel_count};

mod header;

use header::{Encoding, Header};

/// Returns true if a file that begins with `head` is a MetaImage.
pub(crate) fn begins(head: &[u8]) -> bool {
    header::begins(head)
}

pub(crate) fn load(path: &Path, component: Option<usize>, gate: &Gate) -> Result<Parts, Error> {
    let header = header::read(&mut BufReader::new(open(path)?)).map_err(|fault| fault.at(path))?;
    let chosen = chosen(component, header.channels).map_err(|fault| fault.at(path))?;
    let voxels = voxels(path, &header, chosen, gate)?;
    Ok(Parts {
        voxels,
        lattice: header.lattice,
    })
}

/// How many bytes of colour a voxel has; `None` where it is a number.
pub(crate) fn colours(path: &Path) -> Result<Option<usize>, Error> {
    let header = header::read(&mut BufReader::new(open(path)?)).map_err(|fault| fault.at(path))?;
    Ok(Some(header.channels).filter(|_| header.voxel_type == VoxelType::U8))
}

/// Where the voxels lie; `None` where they are packed or have several components.
pub(crate) fn locate(path: &Path, gate: &Gate) -> Result<Option<Located>, Error> {
    let header = header::read(&mut BufReader::new(open(path)?)).map_err(|fault| fault.at(path))?;
    if header.encoding != Encoding::Raw || header.channels != 1 {
        return Ok(None);
    }
    let data = data_files(path, &header, 0, gate)?;
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
    chosen: usize,
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
            interleaved,
        };
        Ok(DataFile { name, data })
    };
    files.into_iter().map(opened).collect()
}

fn voxels(path: &Path, header: &Header, chosen: usize, gate: &Gate) -> Result<Voxels, Error> {
    let files = data_files(path, header, chosen, gate)?.into_iter();
    let decoded = files.map(|file| {
        let voxels = file.data.decode(header, gate);
        voxels.map_err(|fault| fault.at(&file.name))
    });
    decode::joined(decoded)?.ok_or_else(|| invalid(path, "ElementDataFile names no file"))
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
    fn decode(mut self, header: &Header, gate: &Gate) -> Result<Voxels, Fault> {
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
            Encoding::Raw => decode::component(file, &self.layout, self.interleaved)?,
            Encoding::Zlib => {
                let unpacked = flate2::bufread::ZlibDecoder::new(file);
                decode::component(unpacked, &self.layout, self.interleaved)?
            }
            Encoding::Text if self.interleaved.components > 1 => {
                return Err(Fault::Unsupported(
                    "several channels as text: save the data as binary".to_owned(),
                ));
            }
            Encoding::Text => decode::text(&mut file, &self.layout)?,
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

#[cfg(test)]
mod tests;
