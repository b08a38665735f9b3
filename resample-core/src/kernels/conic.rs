//! Conics in the plane: outlines of projected balls and discs.
//!
//! A conic is kept as the six coefficients of its quadratic, negative inside. It is an ellipse only while the whole
//! ball or disc lies in front of the eye plane; beyond that it opens into a parabola or a hyperbola, and the scan
//! conversion takes those too.

use glam::DVec2;

/// xx x^2 + 2 xy x y + yy y^2 + 2 x x + 2 y y + one; inside where negative. Coordinates in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conic {
    /// Coefficient of x^2.
    pub xx: f64,
    /// Half the coefficient of x y.
    pub xy: f64,
    /// Coefficient of y^2.
    pub yy: f64,
    /// Half the coefficient of x.
    pub x: f64,
    /// Half the coefficient of y.
    pub y: f64,
    /// Constant term.
    pub one: f64,
}

/// An ellipse: centre (px) and the quadratic form (xx, xy, yy) of the offset from it that is 1 on the outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Centre, px.
    pub centre_px: DVec2,
    /// The form, px^-2; positive definite.
    pub form: [f64; 3],
}

impl Conic {
    /// The quadratic at a position (px): negative inside.
    pub fn value(&self, p: DVec2) -> f64 {
        (self.xx * p.x + 2.0 * (self.xy * p.y + self.x)) * p.x
            + (self.yy * p.y + 2.0 * self.y) * p.y
            + self.one
    }

    /// The same conic as an ellipse, or `None` if it is open, empty or degenerate.
    pub fn ellipse(&self) -> Option<Ellipse> {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        if !(determinant > 0.0 && self.xx > 0.0) {
            return None;
        }
        let centre_px = DVec2::new(
            (self.xy * self.y - self.yy * self.x) / determinant,
            (self.xy * self.x - self.xx * self.y) / determinant,
        );
        let depth = -self.value(centre_px);
        let form = [self.xx / depth, self.xy / depth, self.yy / depth];
        (depth > 0.0 && form.iter().all(|f| f.is_finite())).then_some(Ellipse { centre_px, form })
    }
}

impl Ellipse {
    /// The form at a position: 0 at the centre, 1 on the outline.
    pub fn value(&self, p: DVec2) -> f64 {
        let d = p - self.centre_px;
        self.form[0] * d.x * d.x + 2.0 * self.form[1] * d.x * d.y + self.form[2] * d.y * d.y
    }

    /// Half width and half height of the bounding box, px.
    pub fn half_extent_px(&self) -> DVec2 {
        let determinant = self.form[0] * self.form[2] - self.form[1] * self.form[1];
        DVec2::new(
            (self.form[2] / determinant).sqrt(),
            (self.form[0] / determinant).sqrt(),
        )
    }

    /// The outline as a conic.
    pub fn conic(&self) -> Conic {
        let [xx, xy, yy] = self.form;
        let c = self.centre_px;
        let (x, y) = (-(xx * c.x + xy * c.y), -(xy * c.x + yy * c.y));
        Conic {
            xx,
            xy,
            yy,
            x,
            y,
            one: -(x * c.x + y * c.y) - 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ellipse_and_conic_are_the_same_curve() {
        let ellipse = Ellipse {
            centre_px: DVec2::new(12.5, -3.25),
            form: [0.5, 0.2, 0.3],
        };
        let back = ellipse.conic().ellipse().expect("still an ellipse");
        assert!((back.centre_px - ellipse.centre_px).length() < 1e-12);
        for (a, b) in back.form.iter().zip(ellipse.form) {
            assert!((a - b).abs() < 1e-12, "{back:?}");
        }
        let edge = ellipse.centre_px + DVec2::new(0.0, (1.0f64 / 0.3).sqrt());
        assert!(
            ellipse.conic().value(edge).abs() < 1e-12 && (ellipse.value(edge) - 1.0).abs() < 1e-12
        );
    }

    #[test]
    fn bounding_box_touches_the_outline() {
        let ellipse = Ellipse {
            centre_px: DVec2::new(1.0, 2.0),
            form: [0.5, 0.2, 0.3],
        };
        let half = ellipse.half_extent_px();
        let steps = 100_000;
        let mut reach = DVec2::ZERO;
        for i in 0..steps {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(steps);
            let direction = DVec2::from_angle(angle);
            let length = 1.0 / ellipse.value(ellipse.centre_px + direction).sqrt();
            reach = reach.max((length * direction).abs());
        }
        assert!((reach - half).length() < 1e-8, "{reach} against {half}");
    }

    #[test]
    fn open_and_empty_conics_are_no_ellipses() {
        let hyperbola = Conic {
            xx: 1.0,
            xy: 0.0,
            yy: -1.0,
            x: 0.0,
            y: 0.0,
            one: -1.0,
        };
        let empty = Conic {
            xx: 1.0,
            xy: 0.0,
            yy: 1.0,
            x: 0.0,
            y: 0.0,
            one: 1.0,
        };
        assert_eq!((hyperbola.ellipse(), empty.ellipse()), (None, None));
    }
}
