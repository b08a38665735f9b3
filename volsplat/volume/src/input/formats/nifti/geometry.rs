//! Where a NIfTI image lies in the world.
//!
//! The header can say it in three ways, and this is their order of trust: the matrix (sform), the turn and spacing
//! (qform), the spacing alone. All lead to x right, y front, z head, in the header's unit, mostly millimetres.

use glam::{DAffine3, DMat3, DVec3};

use crate::input::formats::nifti::header::Header;

pub(crate) fn world_from_index(header: &Header) -> DAffine3 {
    if header.sform_code > 0 {
        let [x, y, z] = header.srow;
        let column = |index: usize| DVec3::new(x[index], y[index], z[index]);
        let matrix = DMat3::from_cols(column(0), column(1), column(2));
        return DAffine3::from_mat3_translation(matrix, column(3));
    }
    let spacing = DVec3::new(
        length(header.pixdim[1]),
        length(header.pixdim[2]),
        length(header.pixdim[3]),
    );
    if header.qform_code > 0 {
        // The format mirrors the third axis where pixdim[0] is negative; 0 counts as positive.
        let third = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
        let scale = DMat3::from_diagonal(spacing * DVec3::new(1.0, 1.0, third));
        let offset = DVec3::from_array(header.qoffset);
        return DAffine3::from_mat3_translation(rotation(header.quaternion) * scale, offset);
    }
    DAffine3::from_scale(spacing)
}

/// Spacings that are 0 or not finite stand for "not known" in real files; the sign means nothing.
fn length(pixdim: f64) -> f64 {
    if pixdim == 0.0 || !pixdim.is_finite() {
        1.0
    } else {
        pixdim.abs()
    }
}

/// The rotation of a unit quaternion whose first part a >= 0 is not stored.
fn rotation([b, c, d]: [f64; 3]) -> DMat3 {
    let squares = b * b + c * c + d * d;
    // Rounding of singles can make the stored part longer than 1: then a is 0 and the rest is brought to length 1.
    let (a, scale) = if squares < 1.0 {
        ((1.0 - squares).sqrt(), 1.0)
    } else {
        (0.0, squares.sqrt().recip())
    };
    let [b, c, d] = [b * scale, c * scale, d * scale];
    DMat3::from_cols(
        DVec3::new(
            a * a + b * b - c * c - d * d,
            2.0 * (b * c + a * d),
            2.0 * (b * d - a * c),
        ),
        DVec3::new(
            2.0 * (b * c - a * d),
            a * a + c * c - b * b - d * d,
            2.0 * (c * d + a * b),
        ),
        DVec3::new(
            2.0 * (b * d + a * c),
            2.0 * (c * d - a * b),
            a * a + d * d - c * c - b * b,
        ),
    )
}
