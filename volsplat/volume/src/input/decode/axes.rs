//! Shared by readers: the axes of a lattice.

use glam::{DAffine3, DMat3, DVec3};

/// Axes of size 1 are added until there are three: at right angles to the others, as long as the shortest of them.
pub(crate) fn complete(mut columns: Vec<DVec3>) -> DMat3 {
    let shortest = columns
        .iter()
        .map(|column| column.length())
        .fold(f64::INFINITY, f64::min);
    let length = if shortest > 0.0 && shortest.is_finite() {
        shortest
    } else {
        1.0
    };
    if columns.is_empty() {
        columns.push(DVec3::X * length);
    }
    if columns.len() == 1 {
        let across = columns[0]
            .try_normalize()
            .map_or(DVec3::Y, DVec3::any_orthonormal_vector);
        columns.push(across * length);
    }
    if columns.len() == 2 {
        let normal = columns[0]
            .cross(columns[1])
            .try_normalize()
            .unwrap_or(DVec3::Z);
        columns.push(normal * length);
    }
    DMat3::from_cols(columns[0], columns[1], columns[2])
}

/// A lattice along the world's axes.
pub(crate) fn upright(spacing: [f64; 3], origin: [f64; 3]) -> DAffine3 {
    let axes = DMat3::from_diagonal(DVec3::from_array(spacing));
    DAffine3::from_mat3_translation(axes, DVec3::from_array(origin))
}
