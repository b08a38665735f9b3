//! A Gaussian as the rays of a tile see it: three polynomials of the pixel.
//!
//! With the covariance S, the centre m relative to the ray's origin o, the ray's direction d (camera z grows by 1 along it) and
//! w = d x (m - o), the squared distance of ray and centre in standard deviations is q = w'Sw / d'Kd, where K is the adjugate of S; along
//! the ray the Gaussian peaks at camera z = d'K(m - o) / d'Kd, and its standard deviation there is sqrt(det S / d'Kd). All three
//! numerators and denominators are polynomials of the pixel of degree at most 2. They are expanded about the tile's centre in f64,
//! so that f32 loses nothing in the tile: no term is much greater than the sum.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec2, DVec3};
use resample_core::narrow::single;
use resample_core::{Camera, Projection};

use crate::gaussians::profile::REACH;
use crate::gaussians::project::{InView, LEAST_EXPONENT, adjugate, pixel_variance};

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
    /// 1 / (half length along the ray) over the square root of d'Kd, and its greatest value.
    pub(crate) sharpness: f32,
    pub(crate) sharpest: f32,
    /// log2 of the opacity at q = 0.
    pub(crate) log2_opacity: f32,
    /// Colour in the blend space.
    pub(crate) colour: [f32; 3],
}

/// The tile's place in the picture, and its rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TilePlace {
    /// First column and row, px.
    pub(crate) first: [usize; 2],
    projection: Projection,
    /// Origin and direction of the ray at the tile's centre, camera space.
    origin: DVec3,
    direction: DVec3,
    /// Steps of the rays per px along x and y.
    step: DVec2,
}

impl TilePlace {
    pub(crate) fn new(camera: &Camera, first: [usize; 2], side: usize) -> Self {
        let corner = DVec2::new(first[0] as f64, first[1] as f64);
        let (origin, direction) = camera.ray_in_camera(corner + 0.5 * side as f64);
        Self {
            first,
            projection: camera.projection,
            origin,
            direction,
            step: 1.0 / DVec2::new(camera.fx, camera.fy),
        }
    }
}

impl RayForm {
    /// The Gaussian, widened by a pixel's Gaussian; `None` where it is too faint to be seen.
    #[inline]
    pub(crate) fn new(
        in_view: &InView,
        camera: &Camera,
        place: &TilePlace,
        sigma_px: f64,
    ) -> Option<Self> {
        let centre = in_view.centre();
        let covariance = in_view.widened(pixel_variance(camera, centre.z, sigma_px));
        let adjugate = adjugate(&covariance);
        let towards = match place.projection {
            Projection::Perspective => centre,
            Projection::Orthographic => DVec3::Z,
        };
        // The footprint's area before and after.
        let area2 = towards.dot(adjugate * towards);
        // From the centre itself a Gaussian fills the view: nothing is widened.
        let kept = if area2 > 0.0 {
            (in_view.area2 / area2).clamp(0.0, 1.0).sqrt()
        } else {
            1.0
        };
        let opacity = f64::from(in_view.opacity) * kept;
        let log2_opacity = single(opacity.min(MOST_OPACITY)).log2();
        if !(log2_opacity >= LEAST_EXPONENT) {
            return None;
        }
        let rays = Rays::new(place, centre);
        let density = quadratic(&adjugate, &rays.direction);
        let determinant = covariance.x_axis.dot(adjugate.x_axis);
        let scale = 1.0 / density[0];
        let sharpest = 1.0 / (REACH * THINNEST * centre.z.abs().max(camera.near.abs()));
        let sharpness = (density[0] / determinant).sqrt() * (1.0 / REACH);
        Some(Self {
            distance: scaled(&quadratic(&covariance, &rays.across), scale),
            density: scaled(&density, scale),
            peak: scaled(&rays.peak(&adjugate), scale),
            sharpness: single(sharpness.min(sharpest)),
            sharpest: single(sharpest),
            log2_opacity,
            colour: in_view.colour,
        })
    }

    /// The blocks that the Gaussian may touch, one bit each: `x` and `y` are their centres in px from the tile's, and their rays lie
    /// at most `half` px from these along each axis.
    ///
    /// The square root of w'Sw is a norm of w, so that it changes by at most that of w's own change; d'Kd is convex, so that it is
    /// greatest at a corner of the tile.
    #[inline(always)]
    pub(crate) fn blocks<S: Simd>(
        &self,
        simd: S,
        [x, y]: [f32x16<S>; 2],
        [half, tile_half]: [f32; 2],
    ) -> u16 {
        /// 2 ln 2: q at which an opacity has fallen by a power of two.
        const Q_PER_OCTAVE: f32 = 2.0 * std::f32::consts::LN_2;
        let [.., a, b, c] = self.distance;
        let change = half * (a + c + b.abs()).max(0.0).sqrt();
        let [d0, d1, d2, d3, d4, d5] = self.density;
        let h = tile_half;
        let most = d0 + h * (d1.abs() + d2.abs()) + h * h * (d3 + d5 + d4.abs());
        let q = (self.log2_opacity - LEAST_EXPONENT) * Q_PER_OCTAVE;
        // Rounding of the polynomials: a hundredth.
        let reach = 1.01 * (change + (q * most).max(0.0).sqrt());
        let near =
            polynomial(simd, &self.distance, x, y).simd_le(f32x16::splat(simd, reach * reach));
        near.to_bitmask() as u16
    }
}

#[inline(always)]
fn scaled<const N: usize>(polynomial: &[f64; N], scale: f64) -> [f32; N] {
    let mut scaled = [0.0; N];
    for (to, from) in scaled.iter_mut().zip(polynomial) {
        *to = single(from * scale);
    }
    scaled
}

/// A polynomial at places in px from the tile's centre.
#[inline(always)]
pub(crate) fn polynomial<S: Simd>(simd: S, c: &[f32; 6], x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
    let splat = |value: f32| f32x16::splat(simd, value);
    let along_x = x.mul_add(splat(c[3]), y.mul_add(splat(c[4]), splat(c[1])));
    let along_y = y.mul_add(splat(c[5]), splat(c[2]));
    x.mul_add(along_x, y.mul_add(along_y, splat(c[0])))
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
    #[inline(always)]
    fn new(place: &TilePlace, centre: DVec3) -> Self {
        let d = place.direction;
        let (step_x, step_y) = (DVec3::X * place.step.x, DVec3::Y * place.step.y);
        let m = centre - place.origin;
        match place.projection {
            Projection::Perspective => Self {
                direction: [d, step_x, step_y],
                across: [d.cross(m), step_x.cross(m), step_y.cross(m)],
                to_centre: [m, DVec3::ZERO, DVec3::ZERO],
            },
            Projection::Orthographic => Self {
                direction: [d, DVec3::ZERO, DVec3::ZERO],
                across: [d.cross(m), d.cross(-step_x), d.cross(-step_y)],
                to_centre: [m, -step_x, -step_y],
            },
        }
    }

    /// Linear in both projections: in one the direction changes, in the other the origin.
    #[inline(always)]
    fn peak(&self, adjugate: &DMat3) -> [f64; 3] {
        let [d, dx, dy] = self.direction;
        let [m, mx, my] = self.to_centre;
        let kd = *adjugate * d;
        let km = *adjugate * m;
        [d.dot(km), dx.dot(km) + kd.dot(mx), dy.dot(km) + kd.dot(my)]
    }
}

/// v'Mv of v = a + b x + c y.
#[inline(always)]
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
