//! The metadata of a Zarr array: shape, type, chunks, how they are packed and what their files are called.
//!
//! Takes the folder of an array; version 3 describes it in `zarr.json`, version 2 in `.zarray`. Both end in one [`Array`].

use std::path::Path;

use serde_json::Value;

use crate::Error;
use crate::input::file::{Fault, unsupported};
use crate::input::formats::zarr::codecs::{Codecs, Packing, Shard, len};
use crate::input::formats::zarr::store::Store;
use crate::input::invalid;
use crate::volume::{Endian, VoxelType};

/// Largest file of metadata, bytes: consolidated metadata of a whole screen has a few megabytes. A guess.
const MAX_BYTES: u64 = 64 << 20;

/// Reads a file of metadata; `None` where the file is missing.
pub(crate) fn json(store: &Store, path: &Path) -> Result<Option<Value>, Error> {
    let Some(text) = store.read_small(path, MAX_BYTES)? else {
        return Ok(None);
    };
    let value: Value = serde_json::from_slice(&text)
        .map_err(|error| invalid(path, format!("not JSON: {error}")))?;
    if !value.is_object() {
        return Err(invalid(path, "expected a JSON object of metadata"));
    }
    Ok(Some(value))
}

/// An array.
#[derive(Debug)]
pub(crate) struct Array {
    pub(crate) shape: Vec<usize>,
    /// The shape of a chunk.
    pub(crate) chunk: Vec<usize>,
    pub(crate) voxel_type: VoxelType,
    pub(crate) codecs: Codecs,
    /// The bytes of an element that was never written.
    pub(crate) fill: Vec<u8>,
    /// The prefix of a chunk's file name, and the separator of its numbers.
    name: (&'static str, char),
}

/// Most bytes of one chunk: what Blosc can pack at once. Larger ones are a forgery.
const MAX_CHUNK_BYTES: usize = 1 << 31;

impl Array {
    /// The file of a chunk, relative to the array's folder.
    pub(crate) fn key(&self, index: &[usize]) -> String {
        let numbers: Vec<String> = index.iter().map(usize::to_string).collect();
        let (begin, separator) = self.name;
        format!("{begin}{}", numbers.join(&separator.to_string()))
    }

    /// The bytes of this many elements that were never written.
    pub(crate) fn filled(&self, count: usize) -> Result<Vec<u8>, String> {
        crate::input::formats::zarr::codecs::filled(&self.fill, count)
    }
}

pub(crate) fn read(store: &Store, folder: &Path) -> Result<Array, Error> {
    let (v3, v2) = (folder.join("zarr.json"), folder.join(".zarray"));
    let (path, array) = match (json(store, &v3)?, json(store, &v2)?) {
        (Some(meta), _) => (v3, version_3(&meta)),
        (None, Some(meta)) => (v2, version_2(&meta)),
        (None, None) => {
            return Err(invalid(
                folder,
                "no Zarr array: neither zarr.json nor .zarray is there",
            ));
        }
    };
    let checked = array.and_then(|array| check(&array).map(|()| array).map_err(Fault::Invalid));
    checked.map_err(|fault| fault.at(&path))
}

fn check(array: &Array) -> Result<(), String> {
    let (shape, chunk) = (&array.shape, &array.chunk);
    if shape.is_empty() || shape.len() != chunk.len() || shape.contains(&0) || chunk.contains(&0) {
        return Err(format!(
            "shape {shape:?} and chunks {chunk:?}: expected as many numbers in both, each at least 1"
        ));
    }
    let bytes = len(chunk).and_then(|count| count.checked_mul(array.voxel_type.bytes()));
    if bytes.is_none_or(|bytes| bytes > MAX_CHUNK_BYTES) {
        return Err(format!(
            "chunks {chunk:?} are larger than {MAX_CHUNK_BYTES} bytes"
        ));
    }
    check_shards(&array.codecs, chunk)
}

/// Each shard is cut into whole chunks, which may be shards again.
fn check_shards(codecs: &Codecs, chunk: &[usize]) -> Result<(), String> {
    let Some(shard) = &codecs.shard else {
        return Ok(());
    };
    let mut pairs = shard.chunk.iter().zip(chunk);
    let fits = shard.chunk.len() == chunk.len()
        && pairs.all(|(inner, outer)| *inner > 0 && outer.is_multiple_of(*inner));
    if !fits {
        return Err(format!(
            "shards of {chunk:?} cannot be cut into chunks of {:?}",
            shard.chunk
        ));
    }
    check_shards(&shard.codecs, &shard.chunk)
}

fn version_3(meta: &Value) -> Result<Array, Fault> {
    let name = meta["data_type"].as_str().unwrap_or("a record");
    let voxel_type = type_of(name)?;
    if meta["chunk_grid"]["name"] != "regular" {
        return Err(unsupported(format!(
            "chunk grid {}: expected a regular one",
            meta["chunk_grid"]["name"]
        )));
    }
    let chunk = sizes(
        &meta["chunk_grid"]["configuration"]["chunk_shape"],
        "chunk_shape",
    )?;
    let encoding = &meta["chunk_key_encoding"];
    let separator = encoding["configuration"]["separator"].as_str();
    let name = match (encoding["name"].as_str(), separator) {
        (Some("default"), None | Some("/")) => ("c/", '/'),
        (Some("default"), Some(".")) => ("c.", '.'),
        (Some("v2"), None | Some(".")) => ("", '.'),
        (Some("v2"), Some("/")) => ("", '/'),
        _ => return Err(unsupported(format!("chunk key encoding {encoding}"))),
    };
    let codecs = codecs_3(&meta["codecs"], voxel_type, chunk.len())?;
    Ok(Array {
        shape: sizes(&meta["shape"], "shape")?,
        chunk,
        voxel_type,
        fill: fill(&meta["fill_value"], voxel_type, codecs.innermost().endian)?,
        codecs,
        name,
    })
}

/// The type of the filter `delta`, which must be that of the elements.
fn differences(settings: &Value, voxel_type: VoxelType) -> Result<VoxelType, Fault> {
    let names = [&settings["dtype"], &settings["astype"]];
    for name in names.iter().filter_map(|name| name.as_str()) {
        // A sign of the byte order may stand first.
        let name = name.trim_start_matches(['<', '>', '|', '=']);
        if type_of(name)? != voxel_type {
            return Err(unsupported(
                "differences of another type than the elements: write the array without the filter 'delta'",
            ));
        }
    }
    Ok(voxel_type)
}

fn shuffle(settings: &Value) -> Result<Packing, Fault> {
    let size = settings["elementsize"].as_u64().unwrap_or(4);
    match size {
        1..=8 => Ok(Packing::Shuffle(size as usize)),
        _ => Err(Fault::Invalid(format!(
            "the filter 'shuffle' has elements of {size} bytes: expected 1 to 8"
        ))),
    }
}

fn codecs_3(list: &Value, voxel_type: VoxelType, axes: usize) -> Result<Codecs, Fault> {
    let mut codecs = Codecs {
        order: (0..axes).collect(),
        ..Codecs::default()
    };
    for codec in list.as_array().into_iter().flatten() {
        let settings = &codec["configuration"];
        match codec["name"].as_str().unwrap_or("") {
            "transpose" => codecs.order = permutation(&settings["order"], axes)?,
            "bytes" => {
                codecs.endian = if settings["endian"] == "big" {
                    Endian::Big
                } else {
                    Endian::Little
                }
            }
            "blosc" => codecs.packings.push(Packing::Blosc),
            "gzip" => codecs.packings.push(Packing::Gzip),
            "zstd" => codecs.packings.push(Packing::Zstd),
            "crc32c" => codecs.packings.push(Packing::Crc32c),
            "numcodecs.delta" if codecs.packings.is_empty() && codecs.delta.is_none() => {
                codecs.delta = Some(differences(settings, voxel_type)?);
            }
            "numcodecs.shuffle" => codecs.packings.push(shuffle(settings)?),
            "numcodecs.zlib" => codecs.packings.push(Packing::Zlib),
            "sharding_indexed" => {
                let index = codecs_3(&settings["index_codecs"], VoxelType::U64, axes + 1)?;
                codecs.shard = Some(Box::new(Shard {
                    chunk: sizes(&settings["chunk_shape"], "chunk_shape")?,
                    codecs: codecs_3(&settings["codecs"], voxel_type, axes)?,
                    index_is_first: settings["index_location"] == "start",
                    index_packings: index.packings,
                }));
            }
            other => {
                return Err(unsupported(format!(
                    "codec '{other}': write the array with zstd, gzip or blosc"
                )));
            }
        }
    }
    // Inside shards the scalars have the byte order of the inner codecs.
    codecs.endian = codecs.innermost().endian;
    Ok(codecs)
}

fn permutation(order: &Value, axes: usize) -> Result<Vec<usize>, Fault> {
    let order = match order.as_str() {
        Some("C") => return Ok((0..axes).collect()),
        Some("F") => return Ok((0..axes).rev().collect()),
        _ => sizes(order, "order")?,
    };
    let mut sorted = order.clone();
    sorted.sort_unstable();
    if sorted.into_iter().eq(0..axes) {
        return Ok(order);
    }
    Err(Fault::Invalid(format!(
        "codec transpose: order {order:?} is no order of {axes} axes"
    )))
}

fn version_2(meta: &Value) -> Result<Array, Fault> {
    let dtype = meta["dtype"].as_str().unwrap_or("a record");
    let (order, name) = dtype.split_at_checked(1).unwrap_or(("", ""));
    let voxel_type = type_of(name)?;
    let endian = if order == ">" {
        Endian::Big
    } else {
        Endian::Little
    };
    let chunk = sizes(&meta["chunks"], "chunks")?;
    let mut packings = Vec::new();
    let mut delta = None;
    for filter in meta["filters"].as_array().into_iter().flatten() {
        match filter["id"].as_str().unwrap_or("?") {
            "delta" if packings.is_empty() && delta.is_none() => {
                delta = Some(differences(filter, voxel_type)?);
            }
            "shuffle" => packings.push(shuffle(filter)?),
            other => {
                return Err(unsupported(format!(
                    "filter '{other}' before the compressor: write the array without it"
                )));
            }
        }
    }
    let compressor = &meta["compressor"];
    packings.extend(match (compressor.is_null(), compressor["id"].as_str()) {
        (true, _) => None,
        (_, Some("blosc")) => Some(Packing::Blosc),
        (_, Some("zlib")) => Some(Packing::Zlib),
        (_, Some("gzip")) => Some(Packing::Gzip),
        (_, Some("zstd")) => Some(Packing::Zstd),
        (_, Some("lz4")) => Some(Packing::Lz4),
        (_, Some("bz2")) => Some(Packing::Bzip2),
        (_, other) => {
            let other = other.unwrap_or("?");
            return Err(unsupported(format!(
                "compressor '{other}': write the array with zstd, zlib or blosc"
            )));
        }
    });
    let axes = chunk.len();
    let stored: Vec<usize> = if meta["order"] == "F" {
        (0..axes).rev().collect()
    } else {
        (0..axes).collect()
    };
    let separator = if meta["dimension_separator"] == "/" {
        '/'
    } else {
        '.'
    };
    Ok(Array {
        shape: sizes(&meta["shape"], "shape")?,
        chunk,
        voxel_type,
        fill: fill(&meta["fill_value"], voxel_type, endian)?,
        codecs: Codecs {
            endian,
            order: stored,
            packings,
            delta,
            shard: None,
        },
        name: ("", separator),
    })
}

fn type_of(name: &str) -> Result<VoxelType, Fault> {
    Ok(match name {
        "uint8" | "u1" | "bool" | "b1" => VoxelType::U8,
        "int8" | "i1" => VoxelType::I8,
        "uint16" | "u2" => VoxelType::U16,
        "int16" | "i2" => VoxelType::I16,
        "uint32" | "u4" => VoxelType::U32,
        "int32" | "i4" => VoxelType::I32,
        "uint64" | "u8" => VoxelType::U64,
        "int64" | "i8" => VoxelType::I64,
        "float32" | "f4" => VoxelType::F32,
        "float64" | "f8" => VoxelType::F64,
        other => {
            return Err(unsupported(format!(
                "elements of type '{other}': expected one number of 8 to 64 bits"
            )));
        }
    })
}

fn sizes(list: &Value, name: &str) -> Result<Vec<usize>, Fault> {
    let numbers = list
        .as_array()
        .map(Vec::as_slice)
        .unwrap_or_default()
        .iter();
    let sizes: Option<Vec<usize>> = numbers
        .map(|n| n.as_u64().and_then(|n| usize::try_from(n).ok()))
        .collect();
    sizes.filter(|sizes| !sizes.is_empty()).ok_or_else(|| {
        Fault::Invalid(format!(
            "\"{name}\" is {list}: expected a list of whole numbers"
        ))
    })
}

/// The bytes of an element that was never written.
fn fill(value: &Value, voxel_type: VoxelType, endian: Endian) -> Result<Vec<u8>, Fault> {
    let number = match (value, value.as_str()) {
        (Value::Null, _) | (Value::Bool(false), _) => 0.0,
        (Value::Bool(true), _) => 1.0,
        (_, Some("NaN")) => f64::NAN,
        (_, Some("Infinity")) => f64::INFINITY,
        (_, Some("-Infinity")) => f64::NEG_INFINITY,
        _ => value.as_f64().ok_or_else(|| {
            Fault::Invalid(format!("\"fill_value\" is {value}: expected a number"))
        })?,
    };
    let mut bytes = match voxel_type {
        VoxelType::U8 => (number as u8).to_le_bytes().to_vec(),
        VoxelType::I8 => (number as i8).to_le_bytes().to_vec(),
        VoxelType::U16 => (number as u16).to_le_bytes().to_vec(),
        VoxelType::I16 => (number as i16).to_le_bytes().to_vec(),
        VoxelType::U32 => (number as u32).to_le_bytes().to_vec(),
        VoxelType::I32 => (number as i32).to_le_bytes().to_vec(),
        VoxelType::U64 => (number as u64).to_le_bytes().to_vec(),
        VoxelType::I64 => (number as i64).to_le_bytes().to_vec(),
        VoxelType::F32 => (number as f32).to_le_bytes().to_vec(),
        VoxelType::F64 => number.to_le_bytes().to_vec(),
    };
    if endian == Endian::Big {
        bytes.reverse();
    }
    Ok(bytes)
}
