//! The footprint of a ball-shaped kernel: which pixels it touches, and at what distance their rays pass its centre.
//!
//! Everything is computed in the kernel's own grid (see [`crate::camera::view`]), where the kernel is a ball of radius r at c
//! relative to the eye, and the ray of a pixel has direction w. With delta the pixel offset from the projected
//! centre, c x w = c x (delta.x wx + delta.y wy), because c and the ray through it are parallel. Hence
//! d^2 = |c x w|^2 / |w|^2 is a quadratic form of delta over a function of the pixel alone. The form does not cancel
//! for small far samples; |c|^2 - (c.w)^2/|w|^2 would.
//!
//! Source: Yuan, Nguyen, Xu, Chen, "Hybrid Forward Resampling and Volume Rendering", Volume Graphics 2003, section
//! 4.2 and Appendix A, for the two affine forms and the index correction. We differ in the correction's denominator
//! (see [`index2_from_ellipse`]) and add the exact form.

use glam::{DVec2, DVec3};

use crate::camera::Projection;
use crate::camera::view::GridView;
use crate::kernels::conic::{Conic, Ellipse};

/// How the distance from a kernel's centre to a pixel's ray is found, in perspective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum FootprintMode {
    /// The outline is an ellipse around the projected centre (Appendix A, small-angle form); the index is affine.
    AffineApprox,
    /// The outline is the exact ellipse around its midpoint (Appendix A); the index is affine in it.
    Affine,
    /// As `Affine`, with the index corrected by the cone angle (section 4.2, with the printed error repaired).
    Table,
    /// The exact distance from centre to ray: a quadratic form times a map that only the pixel decides.
    Exact,
}

impl FootprintMode {
    /// Every mode, from the coarsest to the exact one.
    pub const ALL: [Self; 4] = [Self::AffineApprox, Self::Affine, Self::Table, Self::Exact];
}

/// A ball in the grid as one view sees it: what all modes are made from.
#[derive(Clone, Copy, Debug)]
pub struct BallGeometry {
    /// Projection of the centre, px.
    pub projected_px: DVec2,
    /// |c x w|^2 (orthographic: |offset x w|^2) as a form of the pixel offset from `projected_px` (xx, xy, yy).
    pub cross_form: [f64; 3],
    /// The exact outline.
    pub outline: Ellipse,
    /// Squared sine of the half cone angle under which the eye sees the ball, in the grid; 0 in orthographic views.
    pub sin2_cone: f64,
    /// Radius, grid units.
    pub radius: f64,
}

/// A footprint: a position on the screen to the squared index q = (d/r)^2.
#[derive(Clone, Copy, Debug)]
pub struct Footprint {
    mode: FootprintMode,
    /// Affine modes: the ellipse whose form is q (or i^2). Exact: the ellipse holds the cross form instead.
    ellipse: Ellipse,
    sin2_cone: f64,
    radius2: f64,
}

impl BallGeometry {
    /// The ball of `radius` (grid units) at grid position `centre`, or `None` if it is not wholly in front of the eye
    /// plane: then its outline is no ellipse and the modes below do not apply.
    pub fn new(view: &GridView, centre: DVec3, radius: f64) -> Option<Self> {
        match view.projection {
            Projection::Perspective => Self::perspective(view, centre, radius),
            Projection::Orthographic => Self::orthographic(view, centre, radius),
        }
    }

    fn perspective(view: &GridView, centre: DVec3, radius: f64) -> Option<Self> {
        let c = centre - view.origin;
        let depth = (view.camera_from_grid.matrix3 * c).z;
        // Extent of the ball along camera z: the norm of that row of the linear map.
        let depth_reach = radius * view.camera_from_grid.matrix3.row(2).length();
        if !(depth > depth_reach) {
            return None;
        }
        let pos_in_camera = view.camera_from_grid.matrix3 * c;
        let projected_px = view.focal * pos_in_camera.truncate() / depth + view.principal_px;
        let (a, b) = (c.cross(view.wx), c.cross(view.wy));
        let cross_form = [a.dot(a), a.dot(b), b.dot(b)];
        // The outline is {cross form = r^2 |w|^2}; around the projected centre |w|^2 expands as
        // |c/depth|^2 + 2 n.delta + N(delta).
        let r2 = radius * radius;
        let n = DVec2::new(view.wx.dot(c), view.wy.dot(c)) / depth;
        let conic = Conic {
            xx: cross_form[0] - r2 * view.wx.dot(view.wx),
            xy: cross_form[1] - r2 * view.wx.dot(view.wy),
            yy: cross_form[2] - r2 * view.wy.dot(view.wy),
            x: -r2 * n.x,
            y: -r2 * n.y,
            one: -r2 * c.length_squared() / (depth * depth),
        };
        let mut outline = conic.ellipse()?;
        outline.centre_px += projected_px;
        Some(Self {
            projected_px,
            cross_form,
            outline,
            sin2_cone: r2 / c.length_squared(),
            radius,
        })
    }

    fn orthographic(view: &GridView, centre: DVec3, radius: f64) -> Option<Self> {
        let pos_in_camera = view.camera_from_grid.transform_point3(centre);
        let projected_px = view.focal * pos_in_camera.truncate() + view.principal_px;
        let (a, b) = (view.wx.cross(view.w0), view.wy.cross(view.w0));
        let cross_form = [a.dot(a), a.dot(b), b.dot(b)];
        let scale = 1.0 / (radius * radius * view.w0.length_squared());
        let outline = Ellipse {
            centre_px: projected_px,
            form: cross_form.map(|f| f * scale),
        };
        let finite = outline.form.iter().all(|f| f.is_finite()) && projected_px.is_finite();
        finite.then_some(Self {
            projected_px,
            cross_form,
            outline,
            sin2_cone: 0.0,
            radius,
        })
    }

    /// The outline of Appendix A's small-angle form: axes C'B' and C'F' around the projected centre.
    ///
    /// For a sphere these are the radial direction and its perpendicular; for a stretched grid they are the direction
    /// towards the outline's midpoint and the one conjugate to it.
    pub fn approximate_outline(&self) -> Ellipse {
        let [xx, xy, yy] = self.outline.form;
        let apply = |v: DVec2| DVec2::new(xx * v.x + xy * v.y, xy * v.x + yy * v.y);
        let offset = self.outline.centre_px - self.projected_px;
        let along = offset.try_normalize().unwrap_or(DVec2::X);
        let across = apply(along).perp();
        let (along_dual, across_dual) = (apply(along), apply(across));
        let (along_norm2, across_norm2) = (along.dot(along_dual), across.dot(across_dual));
        let rest = 1.0 - offset.dot(apply(offset));
        // From the projected centre to the outline, away from the axis: the paper's C'B'.
        let reach = offset.dot(along) + (1.0 / along_norm2).sqrt();
        let (u, v) = (
            along_dual / (along_norm2 * reach),
            across_dual / (across_norm2 * rest).sqrt(),
        );
        let form = [
            u.x * u.x + v.x * v.x,
            u.x * u.y + v.x * v.y,
            u.y * u.y + v.y * v.y,
        ];
        Ellipse {
            centre_px: self.projected_px,
            form,
        }
    }
}

impl Footprint {
    /// The footprint of a ball in one of the modes.
    pub fn new(mode: FootprintMode, ball: &BallGeometry) -> Self {
        let ellipse = match mode {
            FootprintMode::AffineApprox => ball.approximate_outline(),
            FootprintMode::Affine | FootprintMode::Table => ball.outline,
            FootprintMode::Exact => Ellipse {
                centre_px: ball.projected_px,
                form: ball.cross_form,
            },
        };
        Self {
            mode,
            ellipse,
            sin2_cone: ball.sin2_cone,
            radius2: ball.radius * ball.radius,
        }
    }

    /// q = (d/r)^2 at a screen position: 0 where the ray meets the centre, 1 on the outline.
    pub fn index2(&self, view: &GridView, pos_in_screen: DVec2) -> f64 {
        let value = self.ellipse.value(pos_in_screen);
        match self.mode {
            FootprintMode::AffineApprox | FootprintMode::Affine => value,
            FootprintMode::Table => index2_from_ellipse(value, self.sin2_cone),
            FootprintMode::Exact => {
                value / (self.radius2 * view.ray(pos_in_screen).1.length_squared())
            }
        }
    }
}

/// The squared index (d/r)^2 from the squared index i^2 in the outline's ellipse, for a cone of half angle alpha.
///
/// The paper's derivation gives d/r = sin(atan(i tan alpha)) / sin alpha (its last line prints tan alpha in the
/// denominator, with which a tangent ray, i = 1, would not give 1). Squared, the arcs cancel:
/// d^2/r^2 = i^2 / (cos^2 alpha + i^2 sin^2 alpha): one division, cheaper than the table made from it.
pub fn index2_from_ellipse(i2: f64, sin2_cone: f64) -> f64 {
    i2 / (1.0 - sin2_cone + i2 * sin2_cone)
}

// Point or splat: the choice of primitive for each sample.
//
// The choice is called selection, because "classification" already names the mapping of scalars by a transfer function.

/// The choice between points and splats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum SelectMode {
    /// A sample whose spacing projects to less than the threshold is a point, the others are splats.
    Hybrid,
    /// Every sample is a point: fast, with holes where samples are magnified.
    Points,
    /// Every sample is a splat: minified ones fall between pixels and alias.
    Splats,
    /// Every sample is its footprint convolved with the pixel's Gaussian: covariances add (Heckbert 1989).
    Ewa,
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DMat3};

    use super::*;
    use crate::camera::{Camera, LookAt};

    fn view(grid: DAffine3) -> GridView {
        let pose = LookAt {
            position: DVec3::new(3.0, 4.0, -7.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
        };
        GridView::new(
            &Camera::perspective(&pose, 0.9, [320, 240]).expect("valid"),
            &grid,
        )
    }

    fn distance2(view: &GridView, pixel: DVec2, centre: DVec3) -> f64 {
        let (origin, direction) = view.ray(pixel);
        (centre - origin)
            .cross(direction.normalize())
            .length_squared()
    }

    #[test]
    fn exact_mode_is_the_ray_distance_in_a_sheared_grid() {
        let grid = DAffine3::from_mat3_translation(
            DMat3::from_cols(
                DVec3::new(1.0, 0.1, 0.0),
                DVec3::new(0.3, 0.5, -0.2),
                DVec3::new(0.0, 0.4, 2.0),
            ),
            DVec3::new(0.5, -0.2, 0.1),
        );
        let view = view(grid);
        let centre = DVec3::new(0.4, 1.2, -0.3);
        let ball = BallGeometry::new(&view, centre, 0.7).expect("in front");
        let footprint = Footprint::new(FootprintMode::Exact, &ball);
        for i in 0..40 {
            let pixel = ball.projected_px + DVec2::from_angle(f64::from(i)) * f64::from(i);
            let (got, expected) = (
                footprint.index2(&view, pixel) * 0.49,
                distance2(&view, pixel, centre),
            );
            assert!(
                (got - expected).abs() < 1e-12 * (1.0 + expected),
                "{got} against {expected}"
            );
        }
    }

    #[test]
    fn outline_is_where_rays_touch_the_ball() {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let mut view = view(DAffine3::from_scale(DVec3::new(1.0, 0.5, 2.0)));
            view.projection = projection;
            let centre = DVec3::new(1.0, -2.0, 0.5);
            let ball = BallGeometry::new(&view, centre, 1.3).expect("in front");
            for i in 0..60 {
                let direction = DVec2::from_angle(0.1 * f64::from(i));
                let length = 1.0
                    / ball
                        .outline
                        .value(ball.outline.centre_px + direction)
                        .sqrt();
                let edge = ball.outline.centre_px + length * direction;
                let distance = distance2(&view, edge, centre).sqrt();
                assert!(
                    (distance - 1.3).abs() < 1e-9,
                    "{projection:?}: a tangent ray passes at {distance}"
                );
            }
        }
    }

    #[test]
    fn appendix_a_axes_of_a_sphere() {
        // On the axis of symmetry everything is known: the ellipse runs from f tan(theta - alpha) to
        // f tan(theta + alpha), and C'F' is f tan(alpha) / cos(theta).
        let (theta, alpha, focal) = (0.5f64, 0.2f64, 300.0);
        let camera = Camera {
            projection: Projection::Perspective,
            width: 100,
            height: 100,
            fx: focal,
            fy: focal,
            cx: 0.0,
            cy: 0.0,
            camera_from_world: DAffine3::IDENTITY,
            near: 1e-3,
        };
        let view = GridView::new(&camera, &DAffine3::IDENTITY);
        let ball = BallGeometry::new(
            &view,
            DVec3::new(theta.sin(), 0.0, theta.cos()) * 5.0,
            5.0 * alpha.sin(),
        );
        let ball = ball.expect("in front");
        let (near, far) = (focal * (theta - alpha).tan(), focal * (theta + alpha).tan());
        assert!(
            (ball.outline.centre_px - DVec2::new(0.5 * (near + far), 0.0)).length() < 1e-9,
            "midpoint"
        );
        assert!(
            (ball.outline.half_extent_px().x - 0.5 * (far - near)).abs() < 1e-9,
            "R1"
        );
        let approximate = ball.approximate_outline();
        let half = approximate.half_extent_px();
        assert!(
            (approximate.centre_px.x - focal * theta.tan()).abs() < 1e-9,
            "C'"
        );
        assert!(
            (half.x - (far - focal * theta.tan())).abs() < 1e-9,
            "C'B' is {}",
            half.x
        );
        assert!(
            (half.y - focal * alpha.tan() / theta.cos()).abs() < 1e-9,
            "C'F' is {}",
            half.y
        );
    }

    #[test]
    fn a_ball_that_reaches_the_eye_plane_has_no_ellipse() {
        let view = view(DAffine3::IDENTITY);
        assert!(
            BallGeometry::new(&view, view.origin, 1.0).is_none(),
            "eye inside"
        );
        let beside = view.origin + 5.0 * view.wx.normalize();
        assert!(
            BallGeometry::new(&view, beside, 0.1).is_none(),
            "on the eye plane"
        );
    }

    #[test]
    fn the_approximate_outline_meets_the_outline_on_its_axes() {
        let view = view(DAffine3::IDENTITY);
        let ball = BallGeometry::new(&view, DVec3::new(2.0, -1.0, 0.5), 1.3).expect("in front");
        let [xx, xy, yy] = ball.outline.form;
        let along = (ball.outline.centre_px - ball.projected_px).normalize();
        let across = DVec2::new(xx * along.x + xy * along.y, xy * along.x + yy * along.y).perp();
        let approximate = ball.approximate_outline();
        for direction in [along, across.normalize(), -across.normalize()] {
            // Halving finds where the outline is met.
            let (mut inside, mut outside) = (0.0, 1e4);
            for _ in 0..100 {
                let middle = 0.5 * (inside + outside);
                if ball.outline.value(ball.projected_px + middle * direction) < 1.0 {
                    inside = middle;
                } else {
                    outside = middle;
                }
            }
            let value = approximate.value(ball.projected_px + inside * direction);
            assert!((value - 1.0).abs() < 1e-9, "{direction}: {value}");
        }
        let behind = approximate.value(2.0 * ball.projected_px - ball.outline.centre_px);
        let before = approximate.value(ball.outline.centre_px);
        assert!(
            (behind - before).abs() < 1e-9,
            "even about the projected centre"
        );
    }

    #[test]
    fn a_ball_is_seen_where_all_of_it_is_before_the_eye() {
        let eye = DVec3::new(3.0, 4.0, -7.0);
        let ahead = -eye.normalize();
        // The grid is three times as coarse as the world.
        let view = view(DAffine3::from_scale(DVec3::splat(3.0)));
        for (distance, seen) in [(2.0, false), (2.09, false), (2.11, true), (40.0, true)] {
            let ball = BallGeometry::new(&view, (eye + distance * ahead) / 3.0, 0.7);
            assert_eq!(ball.is_some(), seen, "{distance} from the eye, radius 2.1");
        }
    }

    #[test]
    fn the_index_in_an_ellipse_keeps_its_ends() {
        for sin2 in [0.0, 0.3, 0.9] {
            assert_eq!(index2_from_ellipse(0.0, sin2), 0.0);
            assert!((index2_from_ellipse(1.0, sin2) - 1.0).abs() < 1e-15);
        }
        // At 60 degrees, half way out: sin(atan(tan 60 / 2)) / sin 60, squared.
        let wanted = (0.5 * 60f64.to_radians().tan()).atan().sin().powi(2) / 0.75;
        assert!((index2_from_ellipse(0.25, 0.75) - wanted).abs() < 1e-15);
    }
}
