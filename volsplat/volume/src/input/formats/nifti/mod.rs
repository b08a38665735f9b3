//! NIfTI files, versions 1 and 2: `.nii`, `.nii.gz`, and pairs of `.hdr` and `.img`.
//!
//! Takes a path, gives the parts of a volume. The header (`header.rs`) has fixed places for everything; where the image
//! lies in the world is in `geometry.rs`. Stored numbers become real ones by the header's slope and intercept.
//! The source is the description in the reference headers nifti1.h and nifti2.h of the NIfTI initiative.
//! Of volumes over time, of vectors and of colours (RGB24, RGBA32) one is read.
//! Limits: complex numbers and 128-bit floats are refused. Extensions are passed over. World coordinates are the format's own: x to the right, y to the front, z to the head.

use std::io::Read;
use std::path::{Path, PathBuf};

use resample_io::Gate;

use crate::Error;
use crate::input::decode::component::Interleaved;
use crate::input::decode::packed::Stream;
use crate::input::decode::{Layout, component};
use crate::input::fault::{Fault, unsupported};
use crate::input::{Parts, decode, invalid};
use crate::volume::{Lattice, Voxels, voxel_count};

mod geometry;
mod header;

use header::{Header, Place, Shape};
pub(crate) use header::{MAX_HEADER_BYTES, is_analyze, is_nifti};

/// The header beside an image file of a pair, if `path` names one: `brain.hdr` for `brain.img`.
pub(crate) fn header_beside(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let stem = ["img", "IMG", "img.gz"]
        .iter()
        .find_map(|end| name.strip_suffix(&format!(".{end}")))?;
    let candidates =
        ["hdr", "HDR", "hdr.gz"].map(|end| path.with_file_name(format!("{stem}.{end}")));
    candidates.into_iter().find(|candidate| candidate.is_file())
}

/// The volume to read out of several.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Choice {
    /// Component of a vector or a colour, counted from 0.
    pub(crate) component: Option<usize>,
    /// Point in time, counted from 0.
    pub(crate) time: Option<usize>,
}

/// How many colours a voxel has; `None` where it is a number.
pub(crate) fn colours(path: &Path) -> Result<Option<usize>, Error> {
    let header = header::read(&mut Stream::open(path)?.bytes).map_err(|fault| fault.at(path))?;
    Ok(Some(header.colours()).filter(|&colours| colours > 1))
}

pub(crate) fn load(path: &Path, choice: Choice, gate: &Gate) -> Result<Parts, Error> {
    let mut stream = Stream::open(path)?;
    let header = header::read(&mut stream.bytes).map_err(|fault| fault.at(path))?;
    let chosen = Chosen::of(&header, choice).map_err(|fault| fault.at(path))?;
    if let Some(remark) = chosen.remark(path, choice) {
        gate.remark(remark);
    }
    let dims = chosen.shape.dims;
    let voxels = match header.place {
        Place::Attached { skip } => {
            stream
                .skip(header.bytes, skip, gate)
                .map_err(|what| invalid(path, what))?;
            voxels(stream, &header, &chosen, gate).map_err(|fault| fault.at(path))?
        }
        Place::Beside { skip } => {
            let image = image_beside(path)?;
            gate.note(&image);
            let mut stream = Stream::open(&image)?;
            stream
                .skip(0, skip, gate)
                .map_err(|what| invalid(&image, what))?;
            voxels(stream, &header, &chosen, gate).map_err(|fault| fault.at(&image))?
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

/// The volume that is read, among those that there are.
struct Chosen {
    shape: Shape,
    /// Volumes before it.
    volumes_before: usize,
    /// Its colour, where a voxel has several.
    colour: usize,
}

impl Chosen {
    fn of(header: &Header, choice: Choice) -> Result<Self, Fault> {
        let shape = header.shape()?;
        let colours = header.colours();
        let vector_or_colour = match (shape.vectors, colours) {
            (1, colours) => component::chosen(choice.component, colours)?,
            (vectors, 1) => component::chosen(choice.component, vectors)?,
            (vectors, _) => {
                return Err(unsupported(format!(
                    "vectors of {vectors} colours: save one of them as a volume first"
                )));
            }
        };
        let (vector, colour) = if colours > 1 {
            (0, vector_or_colour)
        } else {
            (vector_or_colour, 0)
        };
        let time = choice.time.unwrap_or(0);
        if time >= shape.times {
            return Err(Fault::Option(format!(
                "time={time}: the file holds {} point(s) in time, counted from 0",
                shape.times
            )));
        }
        let before = vector
            .checked_mul(shape.times)
            .and_then(|volumes| volumes.checked_add(time));
        Ok(Self {
            shape,
            volumes_before: before.ok_or_else(|| TOO_MANY.to_owned())?,
            colour,
        })
    }

    /// The note where nobody chose among several.
    fn remark(&self, path: &Path, choice: Choice) -> Option<String> {
        let (times, name) = (self.shape.times, path.display());
        (times > 1 && choice.time.is_none()).then(|| {
            format!("{name}: holds {times} volumes over time, the first is read: {name}#time=N names another, from 0 on")
        })
    }
}

const TOO_MANY: &str = "dim promises more volumes than can be addressed";

fn voxels(
    mut stream: Stream,
    header: &Header,
    chosen: &Chosen,
    gate: &Gate,
) -> Result<Voxels, Fault> {
    let Shape {
        dims,
        times,
        vectors,
    } = chosen.shape;
    let colours = header.colours();
    let layout = Layout {
        voxel_type: header.voxel_type()?,
        endian: header.endian,
        count: voxel_count(dims)?,
    };
    let kept = layout.bytes()?;
    let of_volumes = |volumes: usize| {
        let bytes = kept.checked_mul(colours as u64)?;
        bytes.checked_mul(volumes as u64)
    };
    let volumes = times.checked_mul(vectors).and_then(of_volumes);
    let (Some(one), Some(before), Some(all)) =
        (of_volumes(1), of_volumes(chosen.volumes_before), volumes)
    else {
        return Err(Fault::Invalid(TOO_MANY.to_owned()));
    };
    if stream.is_packed {
        decode::check_expansion(all, stream.held)?;
        // What lies before it is unpacked too.
        decode::check_deflated(before.saturating_add(one), stream.held, gate)?;
    } else if all != stream.held {
        let ([x, y, z], name, held) = (dims, layout.voxel_type.name(), stream.held);
        let several = match (times * vectors, colours) {
            (1, 1) => String::new(),
            (1, colours) => format!(" in {colours} colours"),
            (volumes, _) => format!(" in {volumes} volumes"),
        };
        return Err(Fault::Invalid(format!(
            "the header promises {x}x{y}x{z} voxels of {name}{several}, which are {all} bytes, but {held} are there: \
             the file is cut off, or its dim, datatype or vox_offset is wrong"
        )));
    }
    stream.pass(before)?;
    let mut bytes = stream.bytes;
    if one == all {
        // Packed data must end where the header says.
        return component_of(&mut bytes, &layout, (colours, chosen.colour));
    }
    component_of(&mut bytes.take(one), &layout, (colours, chosen.colour))
}

fn component_of(
    bytes: &mut dyn Read,
    layout: &Layout,
    (components, chosen): (usize, usize),
) -> Result<Voxels, Fault> {
    let interleaved = Interleaved {
        scalar_bytes: layout.voxel_type.bytes(),
        components,
        chosen,
    };
    Ok(component(bytes, layout, interleaved)?)
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
