//! The colour spaces of FLIP: linear sRGB, CIE XYZ, the opponent space YCxCz, and CIELAB with the Hunt effect.
//!
//! Takes and gives one colour at a time as three f64. The matrix to XYZ is computed from the chromaticities that define
//! sRGB, so no rounded table stands between two directions of a conversion. White is the white of sRGB (D65) in all.
//!
//! Sources: IEC 61966-2-1 (sRGB primaries and white); CIE 15 (CIELAB); the colour pipeline of the FLIP paper (the linear
//! opponent space, the Hunt effect and the HyAB distance, with the sources it names for them).
//!
//! Limits: no clamping; callers keep RGB within 0..=1 where that matters.

use glam::{DMat3, DVec2, DVec3};

/// CIE xy chromaticities of the sRGB primaries red, green, blue.
const PRIMARIES_XY: [DVec2; 3] = [
    DVec2::new(0.64, 0.33),
    DVec2::new(0.30, 0.60),
    DVec2::new(0.15, 0.06),
];
/// Chromaticity of the white point D65 as sRGB rounds it.
const WHITE_XY: DVec2 = DVec2::new(0.3127, 0.3290);

/// Conversions that share one pair of matrices.
pub(super) struct ColourSpace {
    xyz_from_rgb: DMat3,
    rgb_from_xyz: DMat3,
    white_xyz: DVec3,
}

impl ColourSpace {
    /// The space of a standard screen: columns are the primaries, scaled so that RGB (1, 1, 1) is white of Y = 1.
    pub(super) fn srgb() -> Self {
        let white_xyz = xyz_of_unit_luminance(WHITE_XY);
        let [red, green, blue] = PRIMARIES_XY.map(xyz_of_unit_luminance);
        let primaries = DMat3::from_cols(red, green, blue);
        let xyz_from_rgb = primaries * DMat3::from_diagonal(primaries.inverse() * white_xyz);
        Self {
            xyz_from_rgb,
            rgb_from_xyz: xyz_from_rgb.inverse(),
            white_xyz,
        }
    }

    /// YCxCz of linear RGB. White is (100, 0, 0).
    pub(super) fn opponent_from_rgb(&self, rgb: DVec3) -> DVec3 {
        let relative = self.xyz_from_rgb * rgb / self.white_xyz;
        DVec3::new(
            116.0 * relative.y - 16.0,
            500.0 * (relative.x - relative.y),
            200.0 * (relative.y - relative.z),
        )
    }

    /// The inverse of [`Self::opponent_from_rgb`]; may leave 0..=1.
    pub(super) fn rgb_from_opponent(&self, opponent: DVec3) -> DVec3 {
        let y = (opponent.x + 16.0) / 116.0;
        let relative = DVec3::new(y + opponent.y / 500.0, y, y - opponent.z / 200.0);
        self.rgb_from_xyz * (relative * self.white_xyz)
    }

    /// CIELAB of linear RGB, with a and b scaled by L / 100: dark colours look less colourful (the Hunt effect).
    pub(super) fn hunt_lab_from_rgb(&self, rgb: DVec3) -> DVec3 {
        let relative = self.xyz_from_rgb * rgb / self.white_xyz;
        let response = DVec3::new(
            lightness_response(relative.x),
            lightness_response(relative.y),
            lightness_response(relative.z),
        );
        let lightness = 116.0 * response.y - 16.0;
        let a = 500.0 * (response.x - response.y);
        let b = 200.0 * (response.y - response.z);
        DVec3::new(lightness, 0.01 * lightness * a, 0.01 * lightness * b)
    }
}

/// Lightness difference plus the Euclidean distance of the two chromatic parts (HyAB).
pub(super) fn hyab_distance(a: DVec3, b: DVec3) -> f64 {
    let difference = a - b;
    difference.x.abs() + difference.y.hypot(difference.z)
}

/// The curve of CIELAB: a cube root, continued as its tangent below (6/29)^3.
fn lightness_response(relative: f64) -> f64 {
    const JOIN: f64 = 6.0 / 29.0;
    if relative > JOIN * JOIN * JOIN {
        relative.cbrt()
    } else {
        relative / (3.0 * JOIN * JOIN) + 4.0 / 29.0
    }
}

/// XYZ of a chromaticity at Y = 1.
fn xyz_of_unit_luminance(xy: DVec2) -> DVec3 {
    DVec3::new(xy.x / xy.y, 1.0, (1.0 - xy.x - xy.y) / xy.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_matrix_is_that_of_srgb() {
        // IEC 61966-2-1 prints the matrix to four decimals.
        let expected = DMat3::from_cols_array(&[
            0.4124, 0.2126, 0.0193, 0.3576, 0.7152, 0.1192, 0.1805, 0.0722, 0.9505,
        ]);
        let found = ColourSpace::srgb().xyz_from_rgb;
        assert!(found.abs_diff_eq(expected, 1e-4), "sRGB to XYZ is {found}");
    }

    #[test]
    fn white_black_and_round_trip() {
        let space = ColourSpace::srgb();
        let white = DVec3::new(100.0, 0.0, 0.0);
        assert!(
            space
                .opponent_from_rgb(DVec3::ONE)
                .abs_diff_eq(white, 1e-10),
            "YCxCz of white"
        );
        assert!(
            space
                .hunt_lab_from_rgb(DVec3::ONE)
                .abs_diff_eq(white, 1e-10),
            "CIELAB of white"
        );
        assert!(
            space
                .hunt_lab_from_rgb(DVec3::ZERO)
                .abs_diff_eq(DVec3::ZERO, 1e-10),
            "CIELAB of black"
        );
        let colour = DVec3::new(0.1, 0.7, 0.4);
        let back = space.rgb_from_opponent(space.opponent_from_rgb(colour));
        assert!(
            back.abs_diff_eq(colour, 1e-12),
            "{colour} came back as {back}"
        );
    }
}
