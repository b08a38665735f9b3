//! NIfTI files, versions 1 and 2: `.nii`, `.nii.gz`, and pairs of `.hdr` and `.img`.
//!
//! Takes a path, gives the parts of a volume. The header (`header.rs`) has fixed places for everything; where the image
//! lies in the world is in `geometry.rs`. Stored numbers become real ones by the header's slope and intercept.
//! The source is the description in the reference headers nifti1.h and nifti2.h of the NIfTI initiative.
//! Limits: one scalar volume; colours, complex numbers, 128-bit floats and series of volumes are refused. Extensions are
//! passed over. World coordinates are the format's own: x to the right, y to the front, z to the head.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use resample_io::Gate;

use crate::Error;
use crate::input::decode::Layout;
use crate::input::fault::Fault;
use crate::input::{Parts, cannot_read, decode, invalid, open, open_sized};
use crate::volume::{Lattice, Voxels, voxel_count};

mod geometry;
mod header;

use header::{Header, Place};
pub(super) use header::{MAX_HEADER_BYTES, is_analyze, is_nifti};

/// The first two bytes of a gzip file.
pub(super) const GZIP_MAGIC: &[u8] = &[0x1f, 0x8b];

/// The header beside an image file of a pair, if `path` names one: `brain.hdr` for `brain.img`.
pub(super) fn header_beside(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let stem = ["img", "IMG", "img.gz"]
        .iter()
        .find_map(|end| name.strip_suffix(&format!(".{end}")))?;
    let candidates =
        ["hdr", "HDR", "hdr.gz"].map(|end| path.with_file_name(format!("{stem}.{end}")));
    candidates.into_iter().find(|candidate| candidate.is_file())
}

pub(super) fn load(path: &Path, gate: &Gate) -> Result<Parts, Error> {
    let mut stream = Stream::open(path)?;
    let header = header::read(&mut stream.bytes).map_err(|fault| fault.at(path))?;
    let dims = header.dims().map_err(|fault| fault.at(path))?;
    let voxels = match header.place {
        Place::Attached { skip } => {
            stream
                .skip(header.bytes, skip, gate)
                .map_err(|what| invalid(path, what))?;
            voxels(stream, &header, dims, gate).map_err(|fault| fault.at(path))?
        }
        Place::Beside { skip } => {
            let image = image_beside(path)?;
            gate.note(&image);
            let mut stream = Stream::open(&image)?;
            stream
                .skip(0, skip, gate)
                .map_err(|what| invalid(&image, what))?;
            voxels(stream, &header, dims, gate).map_err(|fault| fault.at(&image))?
        }
    };
    Ok(Parts {
        lattice: Lattice {
            dims,
            world_from_index: geometry::world_from_index(&header),
            up_hint: Some(glam::DVec3::Z),
            space: Some("right-anterior-superior".to_owned()),
            modality: None,
        },
        voxels: header.rescale().apply(voxels),
    })
}

fn voxels(
    mut stream: Stream,
    header: &Header,
    dims: [usize; 3],
    gate: &Gate,
) -> Result<Voxels, Fault> {
    let count = voxel_count(dims)?;
    let layout = Layout {
        voxel_type: header.voxel_type()?,
        endian: header.endian,
        count,
    };
    let needed = layout.bytes()?;
    if stream.is_packed {
        decode::check_deflated(needed, stream.held, gate)?;
    } else if needed != stream.held {
        let ([x, y, z], name, held) = (dims, layout.voxel_type.name(), stream.held);
        return Err(Fault::Invalid(format!(
            "the header promises {x}x{y}x{z} voxels of {name}, which are {needed} bytes, but {held} are there: \
             the file is cut off, or its dim, datatype or vox_offset is wrong"
        )));
    }
    Ok(decode::binary(&mut stream.bytes, &layout)?)
}

/// A file, unpacked if it is packed.
struct Stream {
    bytes: Box<dyn Read>,
    is_packed: bool,
    /// Bytes of the file that are not read yet; of a packed one, its whole length.
    held: u64,
}

impl Stream {
    fn open(path: &Path) -> Result<Self, Error> {
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

    /// Passes over the bytes from `begin`, where the stream stands, to `end`, where the image begins.
    fn skip(&mut self, begin: u64, end: u64, gate: &Gate) -> Result<(), String> {
        let bytes = end - begin;
        if self.is_packed {
            gate.ask_unpacked(bytes, self.held, "the bytes before vox_offset")?;
        }
        let skipped = io::copy(&mut (&mut self.bytes).take(bytes), &mut io::sink());
        let skipped = skipped.map_err(|error| decode::broken(&error))?;
        if skipped < bytes {
            return Err("vox_offset lies behind the end of the file".to_owned());
        }
        if !self.is_packed {
            self.held = self.held.saturating_sub(end);
        }
        Ok(())
    }
}

fn is_gzip(path: &Path) -> Result<bool, Error> {
    let mut head = Vec::new();
    let read = File::take(open(path)?, GZIP_MAGIC.len() as u64).read_to_end(&mut head);
    read.map_err(|source| cannot_read(path, source))?;
    Ok(head == GZIP_MAGIC)
}

/// The image file of a pair, packed or not.
fn image_beside(header: &Path) -> Result<PathBuf, Error> {
    let name = header.file_name().unwrap_or_default().to_string_lossy();
    let stem = name
        .trim_end_matches(".gz")
        .trim_end_matches(".hdr")
        .trim_end_matches(".HDR");
    let candidates =
        ["img", "IMG", "img.gz"].map(|end| header.with_file_name(format!("{stem}.{end}")));
    let found = candidates
        .iter()
        .find(|candidate| candidate.is_file())
        .cloned();
    found.ok_or_else(|| {
        invalid(
            header,
            format!("the header belongs to an image file {stem}.img or {stem}.img.gz, which is not there"),
        )
    })
}

#[cfg(test)]
mod tests;
