//! Voxels that stay in their file: any box of them is read when it is asked for.
//!
//! Takes what a reader found out about a file whose scalars lie in it plainly, one after another, and gives boxes of
//! typed voxels. Reads are positioned, so that many threads read at once and the file is never mapped: a file that
//! shrinks meanwhile is an error and not a crash.
//! Limits: plain scalars, x fastest; several files hold whole slices in equal shares.

use std::fs::File;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::Error;
use crate::input::decode::Layout;
use crate::input::{cannot_read, decode, invalid, open};
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
            let what = format!("voxel {at:?} is NaN or infinite; say what replaces it");
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
fn read_exact_at(part: &StoredFile, bytes: &mut [u8], place: u64) -> std::io::Result<()> {
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
