//! Discs on the screen, listed by tile.
//!
//! Takes discs and a camera, returns [`Splat`]s in chunks of the source. A disc's plane gives the depth at each pixel
//! exactly: 1/z is linear on the screen. So is, divided by z, the offset from the disc's middle: the quadratic form taken at the
//! middle, times (z / middle's z)^2, is the exact ellipse of a perspective picture (Botsch et al. 2005).

use glam::{DAffine3, DVec2, DVec3, Vec3};
use rayon::prelude::*;
use resample_core::image::linear_from_srgb;
use resample_core::light::{AMBIENT, DIFFUSE};
use resample_core::narrow::{pixel, side, single};
use resample_core::point::PIXEL_SIGMA_PX;
use resample_core::tile::{ChunkBins, MAX_CHUNK_LEN, TileGrid};
use resample_core::{Camera, Projection};

use crate::cloud::options::{CloudOptions, Shade};
use crate::cloud::prepare::{Disc, Prepared};

/// Footprints of the blend end at this many standard deviations, where a weight is 1/50 of that in the middle.
pub(crate) const REACH_SIGMAS: f64 = 2.8;

/// A tile also needs the pixels around it: the pixel's Gaussian reaches 1.5 px.
pub(crate) const APRON_PX: usize = 1;

/// Least half axis of a disc that is seen edge-on, px: keeps its form finite. An eighth of a subpixel of coverage.
const LEAST_HALF_AXIS_PX: f64 = 1.0 / 32.0;

/// Largest reach of a disc from its middle, px: one that the eye stands on would cover the picture in every tile. A guess.
const MOST_REACH_PX: f64 = 512.0;

/// Least sine of the angle between a ray and a disc's plane: below it the disc counts as so inclined.
const LEAST_SINE: f64 = 1e-3;

/// Largest factor by which an inclined disc's tolerance grows with the length of a ray inside it. A guess.
const MOST_STRETCH: f64 = 4.0;

/// Standard deviations of noise that still belong to a surface: the front of it is found from the nearest of many points,
/// about two deviations before the middle, and the others lie up to two behind.
const THICKNESS_SIGMAS: f64 = 4.0;

/// A disc on the screen. Forms are of the offset of a pixel's centre from the disc's middle, px.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Splat {
    /// The disc's middle, px.
    pub(crate) at: [f32; 2],
    /// Camera z of the middle, world units.
    pub(crate) z: f32,
    /// Camera z changes by at most this over the disc, world units.
    pub(crate) half_depth: f32,
    /// A form at a pixel is at least that of the pixel's ray over this: the square of the middle's depth over the nearest depth.
    pub(crate) slack: f32,
    /// How far behind it other discs belong to its surface, world units.
    pub(crate) tolerance: f32,
    /// Perspective: change of z of the middle over z; orthographic: change of z, world units. Per px.
    pub(crate) slope: [f32; 2],
    /// The blend's Gaussian exp(-q / 2): xx, twice xy, yy.
    pub(crate) gaussian: [f32; 3],
    /// The disc itself, q <= 1: xx, twice xy, yy.
    pub(crate) disc: [f32; 3],
    /// The disc's cut: what is above 1 lies outside.
    pub(crate) cut: [f32; 2],
    /// Weight in the middle, 1/px^2: the disc's share of the surface over the Gaussian's area.
    pub(crate) weight: f32,
    /// Linear colour.
    pub(crate) rgb: [f32; 3],
    /// First pixel column and row and the ends, of the disc; exclusive.
    pub(crate) disc_box: [u16; 4],
    /// As `disc_box`, of the blend's footprint.
    pub(crate) blend_box: [u16; 4],
}

/// How discs are projected: all that does not depend on the disc.
#[derive(Clone, Debug)]
pub(crate) struct Projector<'a> {
    camera: &'a Camera,
    camera_from_disc: DAffine3,
    options: &'a CloudOptions,
    linear: [f32; 256],
    /// Towards the distant light, camera space, unit length.
    light: DVec3,
    /// How much larger discs are than they were prepared, because others are left out.
    larger: f64,
}

/// The derivatives of a place on the screen and of a plane's depth there.
struct Local {
    /// Rows: change of screen x and y per world unit, px.
    from_camera: [DVec3; 2],
    /// Camera-space change of the place where a pixel's ray meets the plane, per px along x and y.
    hit: [DVec3; 2],
    slope: DVec2,
    sine: f64,
}

/// Projects the discs into chunks, which are kept from frame to frame.
pub(crate) fn project(
    prepared: &Prepared,
    camera: &Camera,
    options: &CloudOptions,
    chunks: &mut Vec<ChunkBins<Splat>>,
) {
    let projector = Projector::new(prepared.origin_in_world, camera, options);
    let grid = TileGrid::new(camera.width as usize, camera.height as usize);
    let count = prepared.discs.len().div_ceil(MAX_CHUNK_LEN);
    chunks.resize_with(count, ChunkBins::default);
    let discs = prepared.discs.par_chunks(MAX_CHUNK_LEN);
    chunks
        .par_iter_mut()
        .zip(discs)
        .enumerate()
        .for_each(|(number, (bins, discs))| {
            bins.clear();
            let drawn = discs.iter().step_by(options.every as usize);
            for splat in drawn.filter_map(|disc| projector.splat(disc)) {
                let [x0, y0, x1, y1] = union(grown(splat.disc_box), splat.blend_box);
                let apron = side(APRON_PX);
                let columns = [
                    x0.saturating_sub(apron),
                    (x1 + apron).min(side(camera.width as usize)),
                ];
                let rows = [
                    y0.saturating_sub(apron),
                    (y1 + apron).min(side(camera.height as usize)),
                ];
                bins.push(splat, 0, grid.rect(columns, rows));
            }
            bins.bin(number);
        });
}

fn union(a: [u16; 4], b: [u16; 4]) -> [u16; 4] {
    [
        a[0].min(b[0]),
        a[1].min(b[1]),
        a[2].max(b[2]),
        a[3].max(b[3]),
    ]
}

impl<'a> Projector<'a> {
    fn new(origin_in_world: DVec3, camera: &'a Camera, options: &'a CloudOptions) -> Self {
        let pose = &camera.camera_from_world;
        // The camera's place relative to the origin first: both may lie 1e7 units from 0.
        let offset = pose.matrix3 * (origin_in_world - camera.eye_in_world());
        let linear = |code: usize| linear_from_srgb(code as f32 / 255.0);
        Self {
            camera,
            camera_from_disc: DAffine3::from_mat3_translation(pose.matrix3, offset),
            options,
            linear: std::array::from_fn(linear),
            light: (pose.matrix3 * options.light).normalize_or_zero(),
            larger: f64::from(options.every).sqrt(),
        }
    }

    /// The splat of a disc; `None` where the camera does not see it.
    fn splat(&self, disc: &Disc) -> Option<Splat> {
        let camera = self.camera;
        let rotation = self.camera_from_disc.matrix3;
        let vector = |v: [f32; 3]| rotation * Vec3::from(v).as_dvec3();
        let middle = vector(disc.position) + self.camera_from_disc.translation;
        if !(middle.z > camera.near) {
            return None;
        }
        let at = camera.screen_from_camera(middle);
        let (normal, cut) = (vector(disc.normal), vector(disc.cut));
        let local = self.local(middle, normal);
        let (spacing, radius) = (
            self.larger * f64::from(disc.spacing),
            self.larger * f64::from(disc.radius),
        );
        // The blend reaches wherever the disc covers.
        let sigma = (self.options.sigma_spacings * spacing).max(radius / REACH_SIGMAS);
        let shape = local.gram(normal);
        let pixel = PIXEL_SIGMA_PX * PIXEL_SIGMA_PX;
        let blurred = plus(shape.map(|g| g * sigma * sigma), pixel);
        let edge = LEAST_HALF_AXIS_PX * LEAST_HALF_AXIS_PX;
        let ellipse = plus(shape.map(|g| g * radius * radius), edge);
        let (gaussian, disc_form) = (inverse(blurred)?, inverse(ellipse)?);
        let half_depth = radius * (1.0 - normal.z * normal.z).max(0.0).sqrt();
        // A disc's near side is larger on the screen than its middle says.
        let grown = match camera.projection {
            Projection::Perspective => middle.z / (middle.z - half_depth).max(camera.near),
            Projection::Orthographic => 1.0,
        };
        let boxed = |covariance: [f64; 3], deviations: f64| {
            let reach =
                DVec2::new(covariance[0], covariance[2]).map(f64::sqrt) * (deviations * grown);
            self.pixel_box(at, reach.min(DVec2::splat(MOST_REACH_PX)))
        };
        let (disc_box, blend_box) = (boxed(ellipse, 1.0)?, boxed(blurred, REACH_SIGMAS)?);
        let weight = weight(shape, spacing, blurred);
        let splat = Splat {
            at: [single(at.x), single(at.y)],
            z: single(middle.z),
            half_depth: single(half_depth),
            // A little more, for rounding.
            slack: single(1.001 * (middle.z / (middle.z - half_depth).max(0.0)).powi(2)),
            tolerance: single(self.tolerance(disc, local.sine)),
            slope: [single(local.slope.x), single(local.slope.y)],
            gaussian,
            disc: disc_form,
            cut: local.hit.map(|h| single(cut.dot(h))),
            weight: single(weight),
            rgb: self.colour(disc, middle, normal),
            disc_box,
            blend_box,
        };
        (splat.weight.is_finite() && at.is_finite()).then_some(splat)
    }

    /// The linear colour of a disc under the light, camera space; its normal is turned to the eye.
    fn colour(&self, disc: &Disc, middle: DVec3, normal: DVec3) -> [f32; 3] {
        let eye = match self.camera.projection {
            Projection::Perspective => -middle.normalize_or_zero(),
            Projection::Orthographic => DVec3::NEG_Z,
        };
        let facing = normal.dot(eye);
        let lit = match self.options.shade {
            Shade::Unlit => 1.0,
            Shade::Headlight => AMBIENT + DIFFUSE * single(facing.abs()),
            Shade::Lambert => {
                let towards = normal
                    .dot(self.light)
                    .copysign(normal.dot(self.light) * facing);
                AMBIENT + DIFFUSE * single(towards.max(0.0))
            }
        };
        disc.colour.map(|code| lit * self.linear[usize::from(code)])
    }

    /// How far behind a disc others belong to its surface, seen at an angle of this sine.
    fn tolerance(&self, disc: &Disc, sine: f64) -> f64 {
        let stretch = (1.0 / sine).min(MOST_STRETCH);
        let spacings = self.options.depth_tolerance_spacings * stretch;
        spacings * self.larger * f64::from(disc.spacing)
            + THICKNESS_SIGMAS * f64::from(disc.thickness)
    }

    fn local(&self, middle: DVec3, normal: DVec3) -> Local {
        let camera = self.camera;
        let focal = DVec2::new(camera.fx, camera.fy);
        match camera.projection {
            Projection::Perspective => {
                let ray = middle / middle.z;
                let least = LEAST_SINE * middle.length();
                let toward = normal.dot(middle);
                let sine = (toward.abs() / middle.length()).max(LEAST_SINE);
                let toward = least.max(toward.abs()).copysign(toward);
                let slope = normal.truncate() / focal * (-middle.z / toward);
                let step = focal.recip() * middle.z;
                Local {
                    from_camera: [
                        DVec3::new(1.0, 0.0, -ray.x) * (focal.x / middle.z),
                        DVec3::new(0.0, 1.0, -ray.y) * (focal.y / middle.z),
                    ],
                    hit: [
                        DVec3::X * step.x + ray * (slope.x * middle.z),
                        DVec3::Y * step.y + ray * (slope.y * middle.z),
                    ],
                    slope,
                    sine,
                }
            }
            Projection::Orthographic => {
                let sine = normal.z.abs().max(LEAST_SINE);
                let slope = -normal.truncate() / focal / sine.copysign(normal.z);
                Local {
                    from_camera: [DVec3::X * focal.x, DVec3::Y * focal.y],
                    hit: [
                        DVec3::new(1.0 / focal.x, 0.0, slope.x),
                        DVec3::new(0.0, 1.0 / focal.y, slope.y),
                    ],
                    slope,
                    sine,
                }
            }
        }
    }

    /// The pixels whose centres lie within `reach` of `at`; `None` where none of the picture nor next to it does.
    fn pixel_box(&self, at: DVec2, reach: DVec2) -> Option<[u16; 4]> {
        let size = DVec2::new(f64::from(self.camera.width), f64::from(self.camera.height));
        let (first, end) = ((at - reach - 0.5).ceil(), (at + reach - 0.5).floor() + 1.0);
        let near = first.cmple(size + 1.0).all() && end.cmpge(DVec2::NEG_ONE).all();
        let (first, end) = (first.clamp(DVec2::ZERO, size), end.clamp(DVec2::ZERO, size));
        near.then_some([pixel(first.x), pixel(first.y), pixel(end.x), pixel(end.y)])
    }
}

/// The pixels of a box and those next to it.
pub(crate) fn grown([x0, y0, x1, y1]: [u16; 4]) -> [u16; 4] {
    [x0.saturating_sub(1), y0.saturating_sub(1), x1 + 1, y1 + 1]
}

impl Local {
    /// J (I - n n') J': what a unit disc's covariance is on the screen, px^2 per world unit^2; xx, xy, yy.
    fn gram(&self, normal: DVec3) -> [f64; 3] {
        let [x, y] = self.from_camera;
        let (nx, ny) = (x.dot(normal), y.dot(normal));
        [x.dot(x) - nx * nx, x.dot(y) - nx * ny, y.dot(y) - ny * ny]
    }
}

/// The screen area of a point's part of the surface over that of its blurred Gaussian.
fn weight(shape: [f64; 3], spacing: f64, blurred: [f64; 3]) -> f64 {
    let determinant = |[xx, xy, yy]: [f64; 3]| (xx * yy - xy * xy).max(0.0);
    let area_px2 = spacing * spacing * determinant(shape).sqrt();
    // Seen edge-on an area vanishes; something of its colour remains. A millionth of a pixel is a guess.
    area_px2.max(1e-6) / (std::f64::consts::TAU * determinant(blurred).sqrt())
}

fn plus(covariance: [f64; 3], variance: f64) -> [f64; 3] {
    [
        covariance[0] + variance,
        covariance[1],
        covariance[2] + variance,
    ]
}

/// The form xx, twice xy, yy of a covariance; `None` where it is not finite.
fn inverse([xx, xy, yy]: [f64; 3]) -> Option<[f32; 3]> {
    let determinant = xx * yy - xy * xy;
    let form = [yy, -2.0 * xy, xx].map(|c| single(c / determinant));
    (determinant > 0.0 && form.iter().all(|f| f.is_finite())).then_some(form)
}
