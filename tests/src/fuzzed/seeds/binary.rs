//! Numbers as bytes.

pub(super) fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

pub(super) fn doubles(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

pub(super) fn shorts(numbers: &[u16]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

pub(super) fn words(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

pub(super) fn zlib(bytes: &[u8]) -> Vec<u8> {
    packed(
        flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast()),
        bytes,
        |e| e.finish(),
    )
}

pub(super) fn gzip(bytes: &[u8]) -> Vec<u8> {
    packed(
        flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast()),
        bytes,
        |e| e.finish(),
    )
}

pub(super) fn deflate(bytes: &[u8]) -> Vec<u8> {
    packed(
        flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::fast()),
        bytes,
        |e| e.finish(),
    )
}

fn packed<E: std::io::Write>(
    mut encoder: E,
    bytes: &[u8],
    finish: impl FnOnce(E) -> std::io::Result<Vec<u8>>,
) -> Vec<u8> {
    encoder.write_all(bytes).expect("in memory");
    finish(encoder).expect("in memory")
}
