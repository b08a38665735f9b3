//! Zarr images of a few voxels, each a folder packed into one file.

use super::binary::{gzip, zlib};
use super::volumes::bytes;
use super::{Seed, packed};

pub(super) const WORDS: [&str; 24] = [
    "zarr_format",
    "node_type",
    "shape",
    "data_type",
    "chunk_grid",
    "chunk_shape",
    "codecs",
    "sharding_indexed",
    "index_codecs",
    "index_location",
    "bytes",
    "endian",
    "blosc",
    "zstd",
    "gzip",
    "lz4",
    "transpose",
    "crc32c",
    "fill_value",
    "NaN",
    "dimension_separator",
    "multiscales",
    "coordinateTransformations",
    "omero",
];

pub(super) fn folders() -> Vec<Seed> {
    let v2 = r#"{"zarr_format":2,"shape":[4,3,2],"chunks":[2,3,2],"dtype":"|u1","compressor":null,"fill_value":0,"order":"C","filters":null}"#;
    let gz = r#"{"zarr_format":2,"shape":[4,3,2],"chunks":[2,3,2],"dtype":"<u2","compressor":{"id":"zlib","level":1},"fill_value":0,"order":"F","filters":null,"dimension_separator":"/"}"#;
    let v3 = r#"{"zarr_format":3,"node_type":"array","shape":[4,3,2],"data_type":"uint16","chunk_grid":{"name":"regular","configuration":{"chunk_shape":[2,3,2]}},"chunk_key_encoding":{"name":"default","configuration":{"separator":"/"}},"fill_value":1,"codecs":[{"name":"bytes","configuration":{"endian":"little"}},{"name":"gzip","configuration":{"level":1}}],"attributes":{}}"#;
    let shard = r#"{"zarr_format":3,"node_type":"array","shape":[2,2,2],"data_type":"uint8","chunk_grid":{"name":"regular","configuration":{"chunk_shape":[2,2,2]}},"chunk_key_encoding":{"name":"default"},"fill_value":0,"codecs":[{"name":"sharding_indexed","configuration":{"chunk_shape":[1,2,2],"codecs":[{"name":"bytes"}],"index_codecs":[{"name":"bytes","configuration":{"endian":"little"}},{"name":"crc32c"}],"index_location":"end"}}]}"#;
    let scales = r#"{"multiscales":[{"version":"0.4","axes":[{"name":"c","type":"channel"},{"name":"z","type":"space"},{"name":"y","type":"space"},{"name":"x","type":"space"}],"datasets":[{"path":"0","coordinateTransformations":[{"type":"scale","scale":[1,2,1,1]}]}]}]}"#;
    let four = r#"{"zarr_format":2,"shape":[2,2,2,3],"chunks":[1,2,2,3],"dtype":"|u1","compressor":{"id":"blosc","cname":"lz4","clevel":5,"shuffle":1},"fill_value":0,"order":"C","filters":null}"#;
    let unshuffled = four.replace(r#""shuffle":1"#, r#""shuffle":0"#);
    // A frame of Zstandard with one block, which holds 24 bytes as they are.
    let frame = [
        &[0x28u8, 0xB5, 0x2F, 0xFD, 0x20, 24, 0xC1, 0, 0][..],
        &bytes(),
    ]
    .concat();
    let zstd = v3.replace("gzip", "zstd");
    let index: Vec<u8> = [0u64, 4, 4, 4]
        .iter()
        .flat_map(|n| n.to_le_bytes())
        .collect();
    let sharded = [&bytes()[..8], &index, &[0; 4]].concat();
    let half = &bytes()[..12];
    vec![
        (
            "v2",
            packed(&[(".zarray", v2.as_bytes()), ("0.0.0", half), ("1.0.0", half)]),
        ),
        (
            "v2.zlib",
            packed(&[
                (".zarray", gz.as_bytes()),
                ("0/0/0", &zlib(&bytes())),
                ("1/0/0", &zlib(&bytes())),
            ]),
        ),
        (
            "v3",
            packed(&[("zarr.json", v3.as_bytes()), ("c/0/0/0", &gzip(&bytes()))]),
        ),
        (
            "v3.zstd",
            packed(&[("zarr.json", zstd.as_bytes()), ("c/0/0/0", &frame)]),
        ),
        (
            "v2.lz4",
            packed(&[
                (".zarray", unshuffled.as_bytes()),
                ("0.0.0.0", &blosc_of_lz4()),
            ]),
        ),
        (
            "v3.shard",
            packed(&[("zarr.json", shard.as_bytes()), ("c/0/0/0", &sharded)]),
        ),
        (
            "ome",
            packed(&[
                (".zgroup", br#"{"zarr_format":2}"#),
                (".zattrs", scales.as_bytes()),
                ("0/.zarray", four.as_bytes()),
                ("0/0.0.0.0", &blosc()),
            ]),
        ),
    ]
}

/// Blosc, its data kept as it is: version, flags, size of a number, sizes of data, block and whole.
fn blosc() -> Vec<u8> {
    [
        &[2u8, 1, 2, 1][..],
        &12u32.to_le_bytes(),
        &12u32.to_le_bytes(),
        &28u32.to_le_bytes(),
        &bytes()[..12],
    ]
    .concat()
}

/// Blosc with a block of one stream of LZ4, which holds twelve bytes as they are.
fn blosc_of_lz4() -> Vec<u8> {
    [
        &[2u8, 1, 0x30, 1][..],
        &12u32.to_le_bytes(),
        &12u32.to_le_bytes(),
        &37u32.to_le_bytes(),
        &20u32.to_le_bytes(),
        &13u32.to_le_bytes(),
        &[0xC0],
        &bytes()[..12],
    ]
    .concat()
}
