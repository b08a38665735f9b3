//! A Gaussian as the rays of a tile see it: three polynomials of the pixel.
//!
//! With the covariance S, the centre m relative to the ray's origin o, the ray's direction d (camera z grows by 1 along it) and
//! w = d x (m - o), the squared distance of ray and centre in standard deviations is q = w'Sw / d'Kd, where K is the adjugate of S; along
//! the ray the Gaussian peaks at camera z = d'K(m - o) / d'Kd, and its standard deviation there is sqrt(det S / d'Kd). All three
//! numerators and denominators are polynomials of the pixel of degree at most 2. They are expanded about the tile's centre in f64,
//! so that f32 loses nothing in the tile: no term is much greater than the sum.

use glam::{DMat3, DVec2, DVec3};
use resample_core::narrow::single;
use resample_core::{Camera, Projection};

use crate::gaussians::project::{InView, LEAST_OPACITY, pixel_variance};

/// Least standard deviation along a ray, as a share of the depth: what f32 tells apart.
const THINNEST: f64 = 1e-6;

/// Greatest opacity: optical depths stay below 14.
pub(crate) const MOST_OPACITY: f64 = 1.0 - 1.0 / 1_048_576.0;

/// The polynomials, in px from the tile's centre: 1, x, y, x^2, xy, y^2.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RayForm {
    /// Of w'Sw.
    pub(crate) distance: [f32; 6],
    /// Of d'Kd.
    pub(crate) density: [f32; 6],
    /// Of d'K(m - o): 1, x, y.
    pub(crate) peak: [f32; 3],
    /// The square of 1 / (standard deviation along the ray) over d'Kd.
    pub(crate) sharpness: f32,
    /// Greatest squared reciprocal of the standard deviation.
    pub(crate) sharpest: f32,
    /// log2 of the opacity at q = 0.
    pub(crate) log2_opacity: f32,
    /// Colour in the blend space.
    pub(crate) colour: [f32; 3],
    /// The 4x4-pixel blocks of the tile that it may touch, one bit each, by rows.
    pub(crate) blocks: u16,
}

/// The tile's place in the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TilePlace {
    /// First column and row, px.
    pub(crate) first: [usize; 2],
    /// Its centre, px.
    pub(crate) centre: DVec2,
}

impl RayForm {
    /// The Gaussian, widened by a pixel's Gaussian; `None` where it is too faint to be seen.
    pub(crate) fn new(
        in_view: &InView,
        camera: &Camera,
        place: &TilePlace,
        sigma_px: f64,
    ) -> Option<Self> {
        let centre = in_view.centre();
        let sharp = in_view.covariance();
        let mut covariance = sharp;
        let [wide_x, wide_y] = pixel_variance(camera, centre.z, sigma_px);
        covariance.x_axis.x += wide_x;
        covariance.y_axis.y += wide_y;
        let adjugate = adjugate(&covariance);
        let opacity = f64::from(in_view.opacity)
            * kept_share(camera, centre, &self::adjugate(&sharp), &adjugate);
        if opacity < LEAST_OPACITY {
            return None;
        }
        let rays = Rays::new(camera, place, centre);
        let determinant = covariance.x_axis.dot(adjugate.x_axis);
        let density = rays.density(&adjugate);
        let scale = 1.0 / density[0];
        let all = |polynomial: [f64; 6]| polynomial.map(|c| single(c * scale));
        let sharpest = 1.0 / (THINNEST * centre.z.abs().max(camera.near.abs())).powi(2);
        Some(Self {
            distance: all(rays.distance(&covariance)),
            density: all(density),
            peak: rays.peak(&adjugate).map(|c| single(c * scale)),
            sharpness: single((density[0] / determinant).min(sharpest)),
            sharpest: single(sharpest),
            log2_opacity: single(opacity.min(MOST_OPACITY).log2()),
            colour: in_view.colour,
            blocks: blocks(in_view, place),
        })
    }
}

/// The share of the opacity that widening leaves: the footprint's area before, over that after.
fn kept_share(camera: &Camera, centre: DVec3, sharp: &DMat3, wide: &DMat3) -> f64 {
    let towards = match camera.projection {
        Projection::Perspective => centre,
        Projection::Orthographic => DVec3::Z,
    };
    let area2 = |adjugate: &DMat3| towards.dot(*adjugate * towards);
    let (before, after) = (area2(sharp), area2(wide));
    if after > before {
        (before / after).max(0.0).sqrt()
    } else {
        1.0
    }
}

/// The rays of a tile relative to a Gaussian's centre, per px along x and y.
struct Rays {
    /// Direction at the tile's centre, and its change.
    direction: [DVec3; 3],
    /// Direction x (m - o) at the tile's centre, and its change.
    across: [DVec3; 3],
    /// m - o at the tile's centre, and its change.
    to_centre: [DVec3; 3],
}

impl Rays {
    fn new(camera: &Camera, place: &TilePlace, centre: DVec3) -> Self {
        let (origin, direction) = camera.ray_in_camera(place.centre);
        let (step_x, step_y) = (DVec3::X / camera.fx, DVec3::Y / camera.fy);
        let to_centre = centre - origin;
        match camera.projection {
            Projection::Perspective => Self {
                direction: [direction, step_x, step_y],
                across: [direction, step_x, step_y].map(|d| d.cross(to_centre)),
                to_centre: [to_centre, DVec3::ZERO, DVec3::ZERO],
            },
            Projection::Orthographic => Self {
                direction: [direction, DVec3::ZERO, DVec3::ZERO],
                across: [to_centre, -step_x, -step_y].map(|m| direction.cross(m)),
                to_centre: [to_centre, -step_x, -step_y],
            },
        }
    }

    fn distance(&self, covariance: &DMat3) -> [f64; 6] {
        quadratic(covariance, &self.across)
    }

    fn density(&self, adjugate: &DMat3) -> [f64; 6] {
        quadratic(adjugate, &self.direction)
    }

    /// Linear in both projections: in one the direction changes, in the other the origin.
    fn peak(&self, adjugate: &DMat3) -> [f64; 3] {
        let [d, dx, dy] = self.direction;
        let [m, mx, my] = self.to_centre.map(|m| *adjugate * m);
        [d.dot(m), dx.dot(m) + d.dot(mx), dy.dot(m) + d.dot(my)]
    }
}

/// v'Mv of v = a + b x + c y.
fn quadratic(matrix: &DMat3, [a, b, c]: &[DVec3; 3]) -> [f64; 6] {
    let (ma, mb, mc) = (*matrix * *a, *matrix * *b, *matrix * *c);
    [
        a.dot(ma),
        2.0 * b.dot(ma),
        2.0 * c.dot(ma),
        b.dot(mb),
        2.0 * b.dot(mc),
        c.dot(mc),
    ]
}

fn adjugate(m: &DMat3) -> DMat3 {
    DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    )
}

/// The blocks of the tile that the pixels of the Gaussian meet.
fn blocks(in_view: &InView, place: &TilePlace) -> u16 {
    let along = |pixels: [u16; 2], first: usize| {
        let begin = usize::from(pixels[0]).max(first) - first;
        let end = (usize::from(pixels[1]).min(first + 16)).saturating_sub(first);
        (begin / 4, end.div_ceil(4))
    };
    let (x0, x1) = along(in_view.columns, place.first[0]);
    let (y0, y1) = along(in_view.rows, place.first[1]);
    let row = ((1u32 << x1) - (1 << x0)) as u16;
    (y0..y1).fold(0, |mask, y| mask | row << (4 * y))
}
