//! The camera as discs are met by it: in f32, with places relative to blocks of discs.
//!
//! Takes a camera and discs, returns a [`View`]. A place is its offset from the first disc of its block, turned, plus that
//! disc's place before the camera, which is found in f64: the camera may lie 1e7 units from 0, and from the origin of the discs.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;
use resample_core::image::linear_from_srgb;
use resample_core::narrow::single;
use resample_core::simd::Vectors;
use resample_core::{Camera, Projection};

use crate::discs::prepare::{Disc, Prepared};
use crate::draw::groups::{Group, Groups};
use crate::draw::sizes::{BLOCK_DISCS, REACH_SIGMAS};
use crate::draw::splat::Splat;
use crate::lanes::{Lanes, Triple, loaded};
use crate::options::CloudOptions;

/// The first disc of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Base {
    in_disc_space: [f32; 3],
    in_camera: [f32; 3],
}

/// All that does not depend on the disc.
#[derive(Clone, Debug)]
pub(crate) struct View<'a> {
    pub(crate) discs: &'a [Disc],
    pub(crate) groups: &'a Groups,
    bases: Vec<Base>,
    pub(crate) projection: Projection,
    /// Width and height of the picture, px.
    pub(crate) size: [usize; 2],
    /// Rows of the rotation from discs to the camera.
    rows: [[f32; 3]; 3],
    pub(crate) focal: [f32; 2],
    /// The principal point, px.
    pub(crate) centre: [f64; 2],
    pub(crate) near: f32,
    pub(crate) options: &'a CloudOptions,
    pub(crate) linear: [f32; 256],
    /// Towards the distant light, camera space, unit length.
    pub(crate) light: [f32; 3],
    /// How much larger discs are than they were prepared, because others are left out.
    pub(crate) larger: f32,
    pub(crate) level: Vectors,
}

/// Where the middles of discs lie.
#[derive(Clone, Copy)]
pub(crate) struct Middles<S: Simd> {
    /// Camera space.
    pub(crate) place: Triple<S>,
    /// Along the rays through them; z is 1.
    pub(crate) ray: Triple<S>,
    /// Screen, px from the place that was asked for.
    pub(crate) at: [f32x16<S>; 2],
    /// Screen units, of the focal length, per world unit.
    pub(crate) scale: f32x16<S>,
}

impl<'a> View<'a> {
    pub(crate) fn new(
        prepared: &'a Prepared,
        groups: &'a Groups,
        camera: &Camera,
        options: &'a CloudOptions,
        level: Vectors,
    ) -> Self {
        let pose = &camera.camera_from_world;
        // The camera's place relative to the origin first: both may lie 1e7 units from 0.
        let offset = pose.matrix3 * (prepared.origin_in_world - camera.eye_in_world());
        let camera_from_disc = DAffine3::from_mat3_translation(pose.matrix3, offset);
        let base = |block: &[Disc]| Base {
            in_disc_space: block[0].position,
            in_camera: singles(
                camera_from_disc.transform_point3(Vec3::from(block[0].position).as_dvec3()),
            ),
        };
        let linear = |code: usize| linear_from_srgb(code as f32 / 255.0);
        Self {
            discs: &prepared.discs,
            groups,
            bases: prepared
                .discs
                .par_chunks(BLOCK_DISCS * groups.every)
                .map(base)
                .collect(),
            projection: camera.projection,
            size: [camera.width as usize, camera.height as usize],
            rows: [0, 1, 2].map(|row| singles(pose.matrix3.row(row))),
            focal: [single(camera.fx), single(camera.fy)],
            centre: [camera.cx, camera.cy],
            near: single(camera.near),
            options,
            linear: std::array::from_fn(linear),
            light: singles((pose.matrix3 * options.light).normalize_or_zero()),
            larger: single(f64::from(options.every).sqrt()),
            level,
        }
    }

    /// The unit normal of a splat of the tile whose first pixel is `first`, turned to the eye: along it the splat's depth changes as its
    /// slope says.
    pub(crate) fn normal_of(&self, splat: &Splat, first: [usize; 2]) -> Vec3 {
        let across = [0, 1].map(|axis: usize| splat.slope[axis] * self.focal[axis]);
        let along = match self.projection {
            Projection::Perspective => {
                let ray = [0, 1].map(|axis: usize| {
                    let from = self.centre[axis] - first[axis] as f64;
                    (splat.at[axis] - single(from)) / self.focal[axis]
                });
                -1.0 - across[0] * ray[0] - across[1] * ray[1]
            }
            Projection::Orthographic => -1.0,
        };
        Vec3::new(across[0], across[1], along).normalize_or_zero()
    }

    /// Turns a vector of camera space into the world.
    pub(crate) fn in_world(&self, v: Vec3) -> Vec3 {
        let [first, second, third] = self.rows.map(Vec3::from);
        v.x * first + v.y * second + v.z * third
    }

    /// The first disc of the block of a group: its place, and that in camera space.
    #[inline(always)]
    pub(crate) fn base(&self, group: &Group) -> ([f32; 3], [f32; 3]) {
        let base = &self.bases[group.first as usize / (BLOCK_DISCS * self.groups.every)];
        (base.in_disc_space, base.in_camera)
    }

    /// Turns vectors into camera space.
    #[inline(always)]
    pub(crate) fn turned<S: Simd>(&self, simd: S, v: &[Lanes; 3]) -> Triple<S> {
        let [x, y, z] = loaded(simd, v);
        let row = |[a, b, c]: [f32; 3]| {
            let splat = |value: f32| f32x16::splat(simd, value);
            x.mul_add(splat(a), y.mul_add(splat(b), z * splat(c)))
        };
        let [first, second, third] = self.rows;
        [row(first), row(second), row(third)]
    }

    /// Where discs lie in camera space, from the offsets from the first discs of their blocks and from the places of those.
    #[inline(always)]
    pub(crate) fn places<S: Simd>(
        &self,
        simd: S,
        offset: &[Lanes; 3],
        base: &Triple<S>,
    ) -> Triple<S> {
        let turned = self.turned(simd, offset);
        [
            turned[0] + base[0],
            turned[1] + base[1],
            turned[2] + base[2],
        ]
    }

    /// Standard deviation of the blend of discs of these sizes: it reaches wherever the disc covers.
    #[inline(always)]
    pub(crate) fn sigma<S: Simd>(&self, spacing: f32x16<S>, radius: f32x16<S>) -> f32x16<S> {
        let sigma = spacing * single(self.options.sigma_spacings);
        sigma.max(radius * single(1.0 / REACH_SIGMAS))
    }

    /// Where places lie on the screen, relative to `from`, px.
    #[inline(always)]
    pub(crate) fn middles<S: Simd>(&self, simd: S, place: Triple<S>, from: [f64; 2]) -> Middles<S> {
        let splat = |value: f32| f32x16::splat(simd, value);
        let (zero, one) = (splat(0.0), splat(1.0));
        let centre = [
            splat(single(self.centre[0] - from[0])),
            splat(single(self.centre[1] - from[1])),
        ];
        let focal = [splat(self.focal[0]), splat(self.focal[1])];
        match self.projection {
            Projection::Perspective => {
                let scale = one / place[2];
                let (x, y) = (place[0] * scale, place[1] * scale);
                Middles {
                    place,
                    ray: [x, y, one],
                    at: [
                        x.mul_add(focal[0], centre[0]),
                        y.mul_add(focal[1], centre[1]),
                    ],
                    scale,
                }
            }
            Projection::Orthographic => Middles {
                place,
                ray: [zero, zero, one],
                at: [
                    place[0].mul_add(focal[0], centre[0]),
                    place[1].mul_add(focal[1], centre[1]),
                ],
                scale: one,
            },
        }
    }
}

fn singles(v: DVec3) -> [f32; 3] {
    [single(v.x), single(v.y), single(v.z)]
}
