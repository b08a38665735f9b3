//! Headerless files: the scalars and nothing else, described by the user.
//!
//! Takes [`RawOptions`], or reads them from the name of the file, and gives voxels and an axis-aligned lattice. The file must have exactly as many
//! bytes as the options require: a wrong dimension or type is the usual mistake, and nothing else shows it.

use std::path::Path;

use crate::Error;
use crate::input::decode::Layout;
use crate::input::decode::stored::Located;
use crate::input::options::RawOptions;
use crate::input::{Parts, cannot_read, decode, invalid, open, open_sized};
use crate::volume::{Endian, Lattice, VoxelType, voxel_count};

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

/// The layout that a name such as `foot_256x256x256_uint8.raw` tells, if the file has as many bytes.
pub(crate) fn of_name(path: &Path) -> Option<RawOptions> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    let words: Vec<&str> = name.split(['_', '-', '.', ' ']).collect();
    let dims = words.iter().find_map(|word| {
        let sizes: Option<Vec<usize>> = word.split('x').map(|size| size.parse().ok()).collect();
        let sizes = <[usize; 3]>::try_from(sizes?).ok()?;
        sizes.iter().all(|&size| size > 0).then_some(sizes)
    })?;
    let voxel_type = words.iter().find_map(|word| type_of(word))?;
    let is_big = ["be", "big", "bigendian", "msb"]
        .iter()
        .any(|word| words.contains(word));
    let raw = RawOptions {
        endian: if is_big { Endian::Big } else { Endian::Little },
        ..RawOptions::new(dims, voxel_type)
    };
    let needed = layout(&raw).ok()?.bytes().ok()?;
    let held = std::fs::metadata(path).ok()?.len();
    (needed == held).then_some(raw)
}

fn type_of(word: &str) -> Option<VoxelType> {
    Some(match word {
        "uint8" | "u8" | "uchar" | "byte" | "8bit" => VoxelType::U8,
        "int8" | "i8" | "s8" | "char" => VoxelType::I8,
        "uint16" | "u16" | "ushort" | "16bit" => VoxelType::U16,
        "int16" | "i16" | "s16" | "short" => VoxelType::I16,
        "uint32" | "u32" | "uint" => VoxelType::U32,
        "int32" | "i32" | "s32" | "int" => VoxelType::I32,
        "float32" | "f32" | "float" => VoxelType::F32,
        "float64" | "f64" | "double" => VoxelType::F64,
        _ => return None,
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

#[cfg(test)]
mod tests {
    use crate::input::test_files::Folder;
    use crate::input::{LoadOptions, load};
    use crate::volume::Voxels;

    #[test]
    fn a_name_tells_the_layout_of_as_many_bytes() {
        let folder = Folder::new();
        let options = LoadOptions::default();
        let path = folder.write(
            "foot_3x2x1_uint16.raw",
            &[&[1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 1]],
        );
        let volume = load(&path, &options).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(volume.voxels, Voxels::U16(vec![1, 2, 3, 4, 5, 262]));
        assert!(
            options.gate.remarks()[0].contains("3x2x1 voxels of u16"),
            "a remark"
        );
        let big = folder.write("Foot-3X2X1-short-be.raw", &[&[0, 1].repeat(6)]);
        assert_eq!(
            load(&big, &options).expect("good").voxels,
            Voxels::I16(vec![1; 6])
        );
        for name in [
            "3x2x1_uint8.raw",
            "3x2_uint16.raw",
            "3x2x1.raw",
            "0x2x1_uint8.raw",
        ] {
            let path = folder.write(name, &[&[0; 12]]);
            let complaint = load(&path, &options).expect_err(name).to_string();
            assert!(complaint.contains("--dims"), "{complaint}");
        }
    }
}
