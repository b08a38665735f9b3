//! Headerless files: the scalars and nothing else, described by the user.
//!
//! Takes [`RawOptions`], gives voxels and an axis-aligned lattice. The size of the file must be exactly what the options
//! promise, because a wrong dimension or type is the usual mistake and its size is the only sign.

use std::path::Path;

use crate::Error;
use crate::input::decode::Layout;
use crate::input::decode::stored::Located;
use crate::input::options::RawOptions;
use crate::input::{Parts, cannot_read, decode, invalid, open, open_sized};
use crate::volume::{Lattice, voxel_count};

/// Where the voxels lie, with the size of the file checked.
pub(crate) fn locate(path: &Path, options: &RawOptions) -> Result<Located, Error> {
    let layout = layout(options)?;
    let needed = layout.bytes().map_err(Error::Option)?;
    let (_, held) = open_sized(path)?;
    if options.skip_bytes.checked_add(needed) != Some(held) {
        let ([x, y, z], skip) = (options.dims, options.skip_bytes);
        let name = options.voxel_type.name();
        return Err(invalid(
            path,
            format!(
                "dims {x}x{y}x{z} of {name} need {needed} bytes after skipping {skip}, the file has {held}: \
                 check the dimensions, the type and the bytes to skip"
            ),
        ));
    }
    Ok(Located {
        lattice: Lattice::unnamed(
            options.dims,
            decode::upright(options.spacing, options.origin),
        ),
        voxel_type: options.voxel_type,
        endian: options.endian,
        files: vec![(path.to_owned(), options.skip_bytes)],
    })
}

pub(crate) fn load(path: &Path, options: &RawOptions) -> Result<Parts, Error> {
    let Located { lattice, .. } = locate(path, options)?;
    let mut file = open(path)?;
    std::io::Seek::seek(&mut file, std::io::SeekFrom::Start(options.skip_bytes))
        .map_err(|source| cannot_read(path, source))?;
    let voxels =
        decode::binary(&mut file, &layout(options)?).map_err(|what| invalid(path, what))?;
    Ok(Parts {
        lattice,
        voxels: vec![voxels],
    })
}

fn layout(options: &RawOptions) -> Result<Layout, Error> {
    let count = voxel_count(options.dims).map_err(Error::Option)?;
    Ok(Layout {
        voxel_type: options.voxel_type,
        endian: options.endian,
        count,
    })
}
