//! Sub-pixels of one triangle that stand beside each other in a row: where they lie in a texture, and how they are lit.
//!
//! The same formulas as for a single position, in loops over the run that compilers turn into vector code.

use glam::Vec4;

use resample_core::light::{AMBIENT, DIFFUSE};

use crate::lookup::{reconstructed, small_footprint};
use crate::mip::Pyramid;
use crate::plane::Plane;
use crate::span::SPAN_PX;
use crate::surface::{Light, Surface, TileView, UvPlanes};

/// Sub-pixels a pixel apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// Position of the first, px from the corner of the tile's border.
    pub(crate) first_px: [f32; 2],
    /// How many they are; at most [`SPAN_PX`].
    pub(crate) len: usize,
}

/// A number for each sub-pixel of a run.
pub(crate) type Lanes = [f32; SPAN_PX];

/// Where a run lies in a texture.
struct Places {
    u: Lanes,
    v: Lanes,
    /// Square of a pixel's longer side there, texels.
    size2: Lanes,
}

impl Run {
    /// Position of the k-th sub-pixel.
    #[inline(always)]
    pub(crate) fn at(&self, k: usize) -> [f32; 2] {
        [self.first_px[0] + k as f32, self.first_px[1]]
    }

    /// A plane's slope along the run and its value at the first sub-pixel.
    #[inline(always)]
    fn line(&self, plane: &Plane) -> [f32; 2] {
        [
            plane[0],
            plane[0] * self.first_px[0] + plane[1] * self.first_px[1] + plane[2],
        ]
    }

    /// The means over sub-pixels of side `side_px` of a texture, into `out`.
    #[inline(always)]
    pub(crate) fn look_up(
        &self,
        surface: &Surface,
        planes: &UvPlanes,
        pyramid: &Pyramid,
        side_px: f32,
        out: &mut [Vec4],
    ) {
        let places = self.places(surface, planes);
        let texel2 = 1.0 / (side_px * side_px);
        for (k, out) in out.iter_mut().enumerate().take(self.len) {
            *out = if places.size2[k] <= texel2 {
                reconstructed(pyramid, places.u[k], places.v[k])
            } else {
                small_footprint(
                    pyramid,
                    &surface.uv_at(planes, self.at(k)),
                    side_px,
                    &planes.borders,
                )
            };
        }
    }

    #[inline(always)]
    fn places(&self, surface: &Surface, planes: &UvPlanes) -> Places {
        let (over_w, u, v) = (&surface.over_w, &planes.u, &planes.v);
        let [w1, w0] = self.line(over_w);
        let [u1, u0] = self.line(u);
        let [v1, v0] = self.line(v);
        let mut places = Places {
            u: [0.0; SPAN_PX],
            v: [0.0; SPAN_PX],
            size2: [0.0; SPAN_PX],
        };
        for k in 0..self.len {
            let x = k as f32;
            let w = 1.0 / (w1 * x + w0);
            let (at_u, at_v) = ((u1 * x + u0) * w, (v1 * x + v0) * w);
            let (ux, uy) = (u[0] - at_u * over_w[0], u[1] - at_u * over_w[1]);
            let (vx, vy) = (v[0] - at_v * over_w[0], v[1] - at_v * over_w[1]);
            places.u[k] = at_u;
            places.v[k] = at_v;
            places.size2[k] = (ux * ux + vx * vx).max(uy * uy + vy * vy) * w * w;
        }
        places
    }

    /// The light that the surface reflects along the run, as a factor of its colour.
    #[inline(always)]
    pub(crate) fn light(&self, surface: &Surface, tile: &TileView, out: &mut Lanes) {
        let towards = match surface.light {
            Light::None => return out[..self.len].fill(1.0),
            // The rays, turned round.
            Light::Eye => {
                let line = |axis: usize| self.line(&tile.rays[axis]);
                [line(0), line(1), line(2)]
            }
            Light::Distant(direction) => [
                [0.0, -direction.x],
                [0.0, -direction.y],
                [0.0, -direction.z],
            ],
        };
        let normal = |axis: usize| self.line(&surface.normal[axis]);
        let normal = [normal(0), normal(1), normal(2)];
        for (k, out) in out.iter_mut().enumerate().take(self.len) {
            let x = k as f32;
            let (mut cosine, mut normal2, mut ray2) = (0.0, 0.0, 0.0);
            for axis in 0..3 {
                let n = normal[axis][0] * x + normal[axis][1];
                let r = towards[axis][0] * x + towards[axis][1];
                cosine -= n * r;
                normal2 += n * n;
                ray2 += r * r;
            }
            let lengths = (normal2 * ray2).sqrt();
            let cosine = if lengths > 0.0 { cosine / lengths } else { 0.0 };
            *out = AMBIENT + DIFFUSE * cosine.max(0.0);
        }
    }
}
