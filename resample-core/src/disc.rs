//! The footprint of a flat sample: a unit disc in the tangent plane of a surface (a texel, a pixel of a depth image).
//!
//! The disc is p + u tu + v tv with u^2 + v^2 <= 1, in camera space. The map from (u, v, 1) to the screen is the
//! homography H = [tu tv p]; a pixel's (u, v) is H^-1 of its ray, divided by the third component (exact), or comes
//! from the Jacobian at the centre (affine: classical EWA, Heckbert 1989). The same mode names serve as for balls;
//! the index table corrects a ball's cone and has no meaning here.

use glam::{DMat2, DMat3, DVec2, DVec3};

use crate::camera::{Camera, Projection};
use crate::conic::{Conic, Ellipse};

/// A unit disc in a tangent plane, in camera space (world units).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Centre.
    pub centre: DVec3,
    /// The half axis along u.
    pub tangent_u: DVec3,
    /// The half axis along v.
    pub tangent_v: DVec3,
}

/// A disc as one camera sees it.
#[derive(Clone, Copy, Debug)]
pub struct DiscFootprint {
    /// From homogeneous screen positions (px) to (u, v, 1) times a factor.
    disc_from_screen: DMat3,
    /// Projection of the centre, px.
    pub projected_px: DVec2,
    /// Displacement on the screen (px) per unit of u and v, at the centre.
    pub jacobian_screen_from_disc: DMat2,
}

impl DiscFootprint {
    /// The footprint of `disc`, or `None` where it has none: its centre is not in front of the eye, or it is seen
    /// edge-on.
    pub fn new(camera: &Camera, disc: &Disc) -> Option<Self> {
        let intrinsic = DMat3::from_cols(
            DVec3::new(camera.fx, 0.0, 0.0),
            DVec3::new(0.0, camera.fy, 0.0),
            DVec3::new(camera.cx, camera.cy, 1.0),
        );
        let on_screen = |v: DVec3, is_point: bool| match camera.projection {
            Projection::Perspective => intrinsic * v,
            Projection::Orthographic => {
                intrinsic * v.truncate().extend(if is_point { 1.0 } else { 0.0 })
            }
        };
        let screen_from_disc = DMat3::from_cols(
            on_screen(disc.tangent_u, false),
            on_screen(disc.tangent_v, false),
            on_screen(disc.centre, true),
        );
        let depth = screen_from_disc.z_axis.z;
        let projected_px = screen_from_disc.z_axis.truncate() / depth;
        let column = |c: DVec3| (c.truncate() - projected_px * c.z) / depth;
        let jacobian = DMat2::from_cols(
            column(screen_from_disc.x_axis),
            column(screen_from_disc.y_axis),
        );
        let area = jacobian.determinant();
        let sizes = jacobian.x_axis.length() * jacobian.y_axis.length();
        // Edge-on: the parallelogram has lost all but rounding of its area.
        if !(depth > 0.0 && area.abs() > 1e-12 * sizes) {
            return None;
        }
        let disc_from_screen = screen_from_disc.inverse();
        let usable = disc_from_screen.is_finite() && projected_px.is_finite();
        usable.then_some(Self {
            disc_from_screen,
            projected_px,
            jacobian_screen_from_disc: jacobian,
        })
    }

    /// (u, v) where the pixel's ray meets the tangent plane; `None` where it meets it behind the eye or not at all.
    pub fn uv_exact(&self, pos_in_screen: DVec2) -> Option<DVec2> {
        let h = self.disc_from_screen * pos_in_screen.extend(1.0);
        // The factor is 1 / camera z of the hit: positive in front.
        (h.z > 0.0).then(|| h.truncate() / h.z)
    }

    /// (u, v) by the Jacobian at the centre.
    pub fn uv_affine(&self, pos_in_screen: DVec2) -> DVec2 {
        self.jacobian_screen_from_disc.inverse() * (pos_in_screen - self.projected_px)
    }

    /// The exact outline u^2 + v^2 = 1; open where the disc crosses the eye plane. Behind the eye it has a second
    /// nappe: ask [`Self::uv_exact`] as well where the outline is no ellipse.
    pub fn outline(&self) -> Conic {
        let m = self.disc_from_screen.transpose();
        let (u, v, w) = (m.x_axis, m.y_axis, m.z_axis);
        let form = |a: DVec3, i: usize, j: usize| a[i] * a[j];
        let entry = |i: usize, j: usize| form(u, i, j) + form(v, i, j) - form(w, i, j);
        Conic {
            xx: entry(0, 0),
            xy: entry(0, 1),
            yy: entry(1, 1),
            x: entry(0, 2),
            y: entry(1, 2),
            one: entry(2, 2),
        }
    }

    /// The outline of the affine footprint.
    pub fn outline_affine(&self) -> Ellipse {
        let inverse = self.jacobian_screen_from_disc.inverse();
        let (x, y) = (inverse.x_axis, inverse.y_axis);
        Ellipse {
            centre_px: self.projected_px,
            form: [x.dot(x), x.dot(y), y.dot(y)],
        }
    }

    /// Covariance on the screen (xx, xy, yy), px^2, of a kernel with unit variance in u and v.
    pub fn covariance_px2(&self) -> [f64; 3] {
        let (a, b) = (
            self.jacobian_screen_from_disc.x_axis,
            self.jacobian_screen_from_disc.y_axis,
        );
        [
            a.x * a.x + b.x * b.x,
            a.x * a.y + b.x * b.y,
            a.y * a.y + b.y * b.y,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::LookAt;

    fn camera(projection: Projection) -> Camera {
        let pose = LookAt {
            position: DVec3::ZERO,
            target: DVec3::Z,
            up: -DVec3::Y,
        };
        match projection {
            Projection::Perspective => Camera::perspective(&pose, 0.8, [200, 160]).expect("valid"),
            Projection::Orthographic => {
                Camera::orthographic(&pose, 4.0, [200, 160]).expect("valid")
            }
        }
    }

    fn disc() -> Disc {
        Disc {
            centre: DVec3::new(0.3, -0.2, 3.0),
            tangent_u: DVec3::new(0.5, 0.1, 0.4),
            tangent_v: DVec3::new(-0.1, 0.3, -0.2),
        }
    }

    #[test]
    fn exact_uv_is_the_inverse_of_projecting_the_disc() {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let camera = camera(projection);
            let footprint = DiscFootprint::new(&camera, &disc()).expect("visible");
            for i in 0..50 {
                let uv = DVec2::from_angle(f64::from(i)) * 0.03 * f64::from(i);
                let point = disc().centre + uv.x * disc().tangent_u + uv.y * disc().tangent_v;
                let pixel = camera.screen_from_camera(point);
                let back = footprint.uv_exact(pixel).expect("in front");
                assert!(
                    (back - uv).length() < 1e-9,
                    "{projection:?}: {back} against {uv}"
                );
                let outline = footprint.outline().value(pixel);
                assert_eq!(
                    outline < 0.0,
                    uv.length() < 1.0,
                    "{projection:?}: outline at {uv}"
                );
            }
        }
    }

    #[test]
    fn affine_uv_agrees_to_first_order_and_is_exact_without_perspective() {
        let flat = DiscFootprint::new(&camera(Projection::Orthographic), &disc()).expect("visible");
        let pixel = flat.projected_px + DVec2::new(5.0, -7.0);
        assert!((flat.uv_affine(pixel) - flat.uv_exact(pixel).expect("in front")).length() < 1e-10);
        let deep = DiscFootprint::new(&camera(Projection::Perspective), &disc()).expect("visible");
        let error = |step: f64| {
            let pixel = deep.projected_px + DVec2::new(step, step);
            (deep.uv_affine(pixel) - deep.uv_exact(pixel).expect("in front")).length()
        };
        assert!(
            error(1.0) > 0.0 && error(0.1) < 0.011 * error(1.0),
            "second order: {} {}",
            error(1.0),
            error(0.1)
        );
    }

    #[test]
    fn discs_that_cannot_be_seen_have_no_footprint() {
        let camera = camera(Projection::Perspective);
        let behind = Disc {
            centre: DVec3::new(0.0, 0.0, -1.0),
            ..disc()
        };
        let edge_on = Disc {
            tangent_u: DVec3::X,
            tangent_v: DVec3::Z,
            centre: DVec3::Z * 2.0,
        };
        let collapsed = Disc {
            tangent_u: DVec3::ZERO,
            ..disc()
        };
        for disc in [behind, edge_on, collapsed] {
            assert!(DiscFootprint::new(&camera, &disc).is_none(), "{disc:?}");
        }
    }

    #[test]
    fn a_disc_across_the_eye_plane_keeps_an_exact_map() {
        let camera = camera(Projection::Perspective);
        let long = Disc {
            centre: DVec3::Z,
            tangent_u: DVec3::new(0.0, 0.2, 3.0),
            tangent_v: DVec3::X,
        };
        let footprint = DiscFootprint::new(&camera, &long).expect("the centre is in front");
        assert!(
            footprint.outline().ellipse().is_none(),
            "the outline is open"
        );
        let inside = camera.screen_from_camera(long.centre + 0.9 * long.tangent_u);
        let uv = footprint.uv_exact(inside).expect("in front");
        assert!((uv - DVec2::new(0.9, 0.0)).length() < 1e-9, "{uv}");
    }
}
