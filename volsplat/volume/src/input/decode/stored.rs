//! Files of plain scalars: voxels that stay in their file and are read box by box, and files that gzip packed as a whole.
//!
//! Takes the places of scalars that lie in a file plainly, one after another, and returns boxes of
//! typed voxels. Reads are positioned, so that many threads read at once and the file is never mapped: a file that
//! shrinks meanwhile is an error and not a crash.
//! Limits: plain scalars, x fastest; several files hold whole slices in equal shares.

use std::fs::File;
use std::io;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use resample_io::Gate;

use crate::Error;
use crate::input::decode::Layout;
use crate::input::{cannot_read, decode, invalid, open, open_sized};
use crate::source::{Region, VoxelSource};
use crate::volume::{Endian, Lattice, NanPolicy, VoxelType, Voxels};

/// Where the plain scalars of a volume lie, as a reader of headers finds it.
pub(crate) struct Located {
    pub(crate) lattice: Lattice,
    pub(crate) voxel_type: VoxelType,
    pub(crate) endian: Endian,
    /// The files in the order of the slices, each with its first byte of data. Their sizes have been checked.
    pub(crate) files: Vec<(PathBuf, u64)>,
}

/// The voxels of a volume, in their files.
#[derive(Debug)]
pub(crate) struct Stored {
    dims: [usize; 3],
    voxel_type: VoxelType,
    endian: Endian,
    parts: Vec<StoredFile>,
    nan: NanPolicy,
}

/// One file of voxels.
#[derive(Debug)]
struct StoredFile {
    path: PathBuf,
    file: File,
    /// Its first byte of data.
    begin: u64,
}

impl Stored {
    /// Opens the files. `None` where they do not hold whole slices.
    pub(crate) fn open(located: &Located, nan: NanPolicy) -> Result<Option<Self>, Error> {
        let dims = located.lattice.dims;
        if !dims[2].is_multiple_of(located.files.len()) {
            return Ok(None);
        }
        let part = |(path, begin): &(PathBuf, u64)| {
            Ok(StoredFile {
                path: path.clone(),
                file: open(path)?,
                begin: *begin,
            })
        };
        let parts = located.files.iter().map(part);
        Ok(Some(Self {
            dims,
            voxel_type: located.voxel_type,
            endian: located.endian,
            parts: parts.collect::<Result<_, Error>>()?,
            nan,
        }))
    }

    /// Plain scalars from the first byte of one file on; errors call it by a name.
    pub(crate) fn of_file(
        name: &Path,
        file: File,
        dims: [usize; 3],
        layout: &Layout,
        nan: NanPolicy,
    ) -> Self {
        let path = name.to_owned();
        Self {
            dims,
            voxel_type: layout.voxel_type,
            endian: layout.endian,
            parts: vec![StoredFile {
                path,
                file,
                begin: 0,
            }],
            nan,
        }
    }

    fn read_slice(&self, region: &Region, slice: usize) -> Result<Voxels, Error> {
        let Region {
            first: [x, y, z],
            size: [columns, rows, _],
        } = *region;
        let bytes_each = self.voxel_type.bytes();
        let slices_each = self.dims[2] / self.parts.len();
        let part = &self.parts[(z + slice) / slices_each];
        let place = |row: usize| {
            let voxel = x + self.dims[0] * (y + row + self.dims[1] * ((z + slice) % slices_each));
            part.begin + voxel as u64 * bytes_each as u64
        };
        let mut bytes = vec![0; columns * rows * bytes_each];
        let read = if columns == self.dims[0] {
            read_exact_at(part, &mut bytes, place(0))
        } else {
            let mut each = bytes.chunks_exact_mut(columns * bytes_each).enumerate();
            each.try_for_each(|(row, bytes)| read_exact_at(part, bytes, place(row)))
        };
        read.map_err(|source| cannot_read(&part.path, source))?;
        let layout = Layout {
            voxel_type: self.voxel_type,
            endian: self.endian,
            count: columns * rows,
        };
        let mut voxels = decode::binary(&mut bytes.as_slice(), &layout)
            .map_err(|what| invalid(&part.path, what))?;
        if let NanPolicy::Replace(value) = self.nan {
            voxels.replace_non_finite(value).map_err(Error::Option)?;
        }
        if let Some(index) = voxels.first_non_finite() {
            let at = (x + index % columns, y + index / columns, z + slice);
            let what = format!("voxel {at:?} is NaN or infinite: give --nan-as VALUE");
            return Err(invalid(&part.path, what));
        }
        Ok(voxels)
    }
}

impl VoxelSource for Stored {
    fn dims(&self) -> [usize; 3] {
        self.dims
    }

    fn voxel_type(&self) -> VoxelType {
        self.voxel_type
    }

    fn read(&self, region: &Region) -> Result<Voxels, Error> {
        let [_, _, slices] = region.size;
        let read = (0..slices)
            .into_par_iter()
            .map(|z| self.read_slice(region, z));
        let mut read = read.collect::<Result<Vec<Voxels>, Error>>()?.into_iter();
        let mut voxels = read.next().unwrap_or(Voxels::U8(Vec::new()));
        voxels.reserve_exact(voxels.len() * (slices - 1));
        read.for_each(|slice| decode::append(&mut voxels, slice));
        Ok(voxels)
    }
}

#[cfg(unix)]
fn read_exact_at(part: &StoredFile, bytes: &mut [u8], place: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(&part.file, bytes, place)
}

#[cfg(windows)]
fn read_exact_at(part: &StoredFile, bytes: &mut [u8], place: u64) -> std::io::Result<()> {
    let mut done = 0;
    while done < bytes.len() {
        let at = place + done as u64;
        match std::os::windows::fs::FileExt::seek_read(&part.file, &mut bytes[done..], at)? {
            0 => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            read => done += read,
        }
    }
    Ok(())
}

/// The first two bytes of a gzip file.
pub(crate) const GZIP_MAGIC: &[u8] = &[0x1f, 0x8b];

/// A file, unpacked if it is packed.
pub(crate) struct Stream {
    pub(crate) bytes: Box<dyn Read>,
    pub(crate) is_packed: bool,
    /// Bytes of the file that are not read yet; of a packed one, its whole length.
    pub(crate) held: u64,
}

impl Stream {
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let (file, held) = open_sized(path)?;
        let is_packed = is_gzip(path)?;
        let file = BufReader::new(file);
        let bytes: Box<dyn Read> = if is_packed {
            Box::new(flate2::bufread::MultiGzDecoder::new(file))
        } else {
            Box::new(file)
        };
        Ok(Self {
            bytes,
            is_packed,
            held,
        })
    }

    /// The first bytes, a header of a fixed size.
    pub(crate) fn header(&mut self, size: usize) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        let got = (&mut self.bytes).take(size as u64).read_to_end(&mut bytes);
        got.map_err(|error| decode::broken(&error))?;
        if bytes.len() < size {
            return Err(format!(
                "the header needs {size} bytes, the file has {}: it is cut off",
                bytes.len()
            ));
        }
        Ok(bytes)
    }

    /// Passes over the bytes from `begin`, where the stream stands, to `end`, where the image begins.
    pub(crate) fn skip(&mut self, begin: u64, end: u64, gate: &Gate) -> Result<(), String> {
        let bytes = end - begin;
        if self.is_packed {
            gate.ask_unpacked(bytes, self.held, "the bytes before the voxels")?;
        }
        let skipped = self.copied(bytes)?;
        if skipped < bytes {
            return Err("vox_offset lies behind the end of the file".to_owned());
        }
        if !self.is_packed {
            self.held = self.held.saturating_sub(end);
        }
        Ok(())
    }

    /// Passes over the volumes before the one that is read.
    pub(crate) fn pass(&mut self, bytes: u64) -> Result<(), String> {
        let passed = self.copied(bytes)?;
        if passed < bytes {
            return Err(format!(
                "the data ends early: the volume begins behind {bytes} bytes, {passed} are there"
            ));
        }
        Ok(())
    }

    /// Reads bytes and keeps none of them; how many there were.
    fn copied(&mut self, bytes: u64) -> Result<u64, String> {
        let copied = io::copy(&mut (&mut self.bytes).take(bytes), &mut io::sink());
        copied.map_err(|error| decode::broken(&error))
    }
}

fn is_gzip(path: &Path) -> Result<bool, Error> {
    let mut head = Vec::new();
    let read = File::take(open(path)?, GZIP_MAGIC.len() as u64).read_to_end(&mut head);
    read.map_err(|source| cannot_read(path, source))?;
    Ok(head == GZIP_MAGIC)
}
