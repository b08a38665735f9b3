//! Small good files of every format, from which fuzzing begins; made here, byte by byte.

mod arrays;
mod binary;
mod gaussians;
mod meshes;
mod pictures;
mod texts;
mod volumes;
mod zarr;

use super::Reader;

/// A file's name for people, and its bytes. Files whose name ends in `.cut` are the beginning of a good one, and refused.
pub type Seed = (&'static str, Vec<u8>);

/// The files that a reader's fuzzing begins with.
pub fn of(reader: Reader) -> Vec<Seed> {
    match reader {
        Reader::Volume => volumes::files(),
        Reader::Zarr => zarr::folders(),
        Reader::Gaussians => gaussians::files(),
        Reader::Mesh => meshes::files(),
        Reader::Colour => pictures::colours(),
        Reader::Depth => pictures::depths(),
        Reader::Cameras => texts::cameras(),
        Reader::Transfer => texts::tables(),
    }
}

/// Words that the formats know, for a fuzzer's dictionary.
pub fn words(reader: Reader) -> &'static [&'static str] {
    match reader {
        Reader::Volume => &volumes::WORDS,
        Reader::Zarr => &zarr::WORDS,
        Reader::Gaussians => &gaussians::WORDS,
        Reader::Mesh => &meshes::WORDS,
        Reader::Colour | Reader::Depth => &pictures::WORDS,
        Reader::Cameras => &texts::CAMERA_WORDS,
        Reader::Transfer => &texts::TABLE_WORDS,
    }
}

/// Several files as one: a line with a mark and the name before each.
pub fn packed(files: &[(&str, &[u8])]) -> Vec<u8> {
    let parts = files
        .iter()
        .map(|(name, bytes)| [b"\n@@", name.as_bytes(), b"\n", bytes].concat());
    parts.collect::<Vec<_>>().concat()
}
