//! Pictures at the ends of the range of numbers, against slow references in f64: one table, which the example `extremes` prints
//! and a test asserts.
//!
//! Every row draws a small scene with the renderer and compares it with its definition, evaluated in f64 (`twin`, and the
//! reference of every sample) or known in closed form.

mod cameras;
mod every_sample;
mod fields;
mod gaussians;
mod meshes;
mod row;
mod sums;
mod twin;
mod voxels;
mod warps;

pub use row::Row;

/// All rows. Rows of many samples have one of `share` of them.
///
/// # Panics
/// A scene cannot be made.
pub fn rows(share: usize) -> Vec<Row> {
    let tables = [
        voxels::rows(),
        cameras::rows(),
        every_sample::rows(),
        fields::rows(),
        gaussians::rows(),
        sums::rows(share),
        meshes::rows(),
        warps::rows(),
    ];
    let table = |table: row::Result<Vec<Row>>| table.expect("scenes that can be made");
    tables.into_iter().flat_map(table).collect()
}
