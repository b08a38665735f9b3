//! Discs on the screen.
//!
//! Takes discs and a view, returns [`Splat`]s of a tile. A disc's plane gives the depth at each pixel
//! exactly: 1/z is linear on the screen. So is, divided by z, the offset from the disc's middle: the quadratic form taken at the
//! middle, times (z / middle's z)^2, is the exact ellipse of a perspective picture (Botsch et al. 2005).

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16, u32x16};
use fearless_simd_macros::simd;
use resample_core::Projection;
use resample_core::light::{AMBIENT, DIFFUSE};
use resample_core::narrow::single;
use resample_core::point::PIXEL_SIGMA_PX;

use crate::discs::prepare::Disc;
use crate::draw::sizes::{
    APRON_PX, BLOCK_PX, LEAST_HALF_AXIS_PX, MOST_REACH_PX, REACH_SIGMAS, TILE_PX,
};
use crate::draw::splat::{FLAT, Splat};
use crate::draw::view::{Middles, View};
use crate::lanes::{LANES, Lanes, Triple, dot, loaded};
use crate::options::Shade;

/// Least sine of the angle between a ray and a disc's plane: below it the disc counts as so inclined.
const LEAST_SINE: f32 = 1e-3;

/// Largest factor by which an inclined disc's tolerance grows with the length of a ray inside it. A guess.
const MOST_STRETCH: f32 = 4.0;

/// Standard deviations of noise that still belong to a surface: the front of it is found from the nearest of many points,
/// about two deviations before the middle, and the others lie up to two behind.
const THICKNESS_SIGMAS: f32 = 4.0;

/// Screen area of a disc that is seen edge-on, px^2: something of its colour remains. A guess.
const LEAST_AREA_PX2: f32 = 1e-6;

/// Discs that are projected together.
#[derive(Clone, Debug)]
pub(crate) struct Gathered {
    count: usize,
    place: [Lanes; 3],
    normal: [Lanes; 3],
    cut: [Lanes; 3],
    radius: Lanes,
    spacing: Lanes,
    thickness: Lanes,
    colour: [[u8; 3]; LANES],
}

/// Projected discs, as the fields of [`Splat`].
struct Projected {
    seen: u64,
    at: [Lanes; 2],
    z: Lanes,
    depths: [Lanes; 2],
    tolerance: Lanes,
    slope: [Lanes; 2],
    most_change: Lanes,
    deeper: [Lanes; 2],
    gaussian: [Lanes; 3],
    disc: [Lanes; 3],
    cut: [Lanes; 2],
    weight: Lanes,
    light: Lanes,
    disc_box: [[u32; LANES]; 4],
    /// First and last column and row of blocks.
    blend_box: [[u32; LANES]; 4],
}

impl Gathered {
    pub(crate) fn new() -> Self {
        const NONE: Lanes = [0.0; LANES];
        Self {
            count: 0,
            place: [NONE; 3],
            normal: [NONE; 3],
            cut: [NONE; 3],
            radius: NONE,
            spacing: NONE,
            thickness: NONE,
            colour: [[0; 3]; LANES],
        }
    }

    /// Takes up a disc at this place in camera space; there is room for 16.
    #[inline(always)]
    pub(crate) fn push(&mut self, disc: &Disc, place: [f32; 3]) {
        let lane = self.count % LANES;
        for (axis, place) in place.into_iter().enumerate() {
            self.place[axis][lane] = place;
            self.normal[axis][lane] = disc.normal[axis];
            self.cut[axis][lane] = disc.cut[axis];
        }
        self.radius[lane] = disc.radius;
        self.spacing[lane] = disc.spacing;
        self.thickness[lane] = disc.thickness;
        self.colour[lane] = disc.colour;
        self.count = lane + 1;
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    pub(crate) fn is_full(&self) -> bool {
        self.count == LANES
    }

    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }
}

/// Adds the discs that the camera sees in a tile, whose first pixel is `first`, and not beyond the depth `far`, to the tile's splats.
#[simd]
pub(crate) fn project<S: Simd>(
    simd: S,
    view: &View,
    (first, far): ([usize; 2], f32),
    discs: &Gathered,
    to: &mut Vec<Splat>,
) {
    let found = projected(simd, view, (first, far), discs);
    // The series of 1 / (1 - c) and of its square; a parallel picture has the plane itself.
    let wider = match view.projection {
        Projection::Perspective => [2.0, 3.0],
        Projection::Orthographic => [0.0, 0.0],
    };
    let mut seen = found.seen & u64::MAX >> (64 - discs.count.clamp(1, LANES));
    while seen != 0 {
        let lane = seen.trailing_zeros() as usize % LANES;
        seen &= seen - 1;
        let pick = |values: &Lanes| values[lane];
        let light = found.light[lane];
        let [red, green, blue] = discs.colour[lane];
        let [x0, y0, x1, y1] = &found.blend_box;
        let blocks = blocks_of([x0[lane], y0[lane], x1[lane], y1[lane]]);
        to.push(Splat {
            at: [pick(&found.at[0]), pick(&found.at[1])],
            z: pick(&found.z),
            depths: [pick(&found.depths[0]), pick(&found.depths[1])],
            tolerance: pick(&found.tolerance),
            slope: [pick(&found.slope[0]), pick(&found.slope[1])],
            most_change: pick(&found.most_change),
            deeper: [pick(&found.deeper[0]), pick(&found.deeper[1])],
            wider,
            gaussian: [
                pick(&found.gaussian[0]),
                pick(&found.gaussian[1]),
                pick(&found.gaussian[2]),
            ],
            disc: [
                pick(&found.disc[0]),
                pick(&found.disc[1]),
                pick(&found.disc[2]),
            ],
            cut: [pick(&found.cut[0]), pick(&found.cut[1])],
            weight: pick(&found.weight),
            rgb: [
                light * view.linear[usize::from(red)],
                light * view.linear[usize::from(green)],
                light * view.linear[usize::from(blue)],
            ],
            disc_box: [
                found.disc_box[0][lane],
                found.disc_box[1][lane],
                found.disc_box[2][lane],
                found.disc_box[3][lane],
            ],
            blocks,
        });
    }
}

/// The blocks from these first column and row to these last ones, one bit each; the first lie after the last where there is no block.
#[inline(always)]
fn blocks_of([x0, y0, x1, y1]: [u32; 4]) -> u64 {
    /// The first block of each row.
    const STARTS: u64 = 0x0101_0101_0101_0101;
    if x0 > x1 || y0 > y1 {
        return 0;
    }
    let columns = (0b10 << x1) - (1 << x0);
    let rows = STARTS >> (8 * (7 - (y1 - y0))) << (8 * y0);
    columns * rows
}

#[simd]
fn projected<S: Simd>(
    simd: S,
    view: &View,
    (first, far): ([usize; 2], f32),
    discs: &Gathered,
) -> Projected {
    let splat = |value: f32| f32x16::splat(simd, value);
    let load = |values: &Lanes| f32x16::from_slice(simd, values);
    let (zero, one) = (splat(0.0), splat(1.0));
    let from = [first[0] as f64, first[1] as f64];
    let middles = view.middles(simd, loaded(simd, &discs.place), from);
    let Middles {
        place,
        ray,
        at,
        scale,
    } = middles;
    let z = place[2];
    let normal = view.turned(simd, &discs.normal);
    let cut = view.turned(simd, &discs.cut);
    let [focal_x, focal_y] = view.focal;
    // The depth of the plane changes along a ray that nearly lies in it without end.
    let length = dot(&ray, &ray).sqrt();
    let across = dot(&normal, &ray);
    let inclined = across.abs().max(length * LEAST_SINE);
    let toward = across.simd_lt(zero).select(zero - inclined, inclined);
    let slope = slope_of(simd, view.focal, &normal, toward);
    let slant = dot(&cut, &ray);
    let unit = one / scale;
    let cut = [
        (slope[0].mul_add(slant, cut[0] * (1.0 / focal_x))) * unit,
        (slope[1].mul_add(slant, cut[1] * (1.0 / focal_y))) * unit,
    ];
    let larger = splat(view.larger);
    let radius = load(&discs.radius) * larger;
    let spacing = load(&discs.spacing) * larger;
    let sigma = view.sigma(spacing, radius);
    let shape = Shape::of(simd, view.focal, &ray, &normal, across);
    let pixel = single(PIXEL_SIGMA_PX * PIXEL_SIGMA_PX);
    let blurred = shape.covariance(simd, sigma * scale, pixel);
    let edge = LEAST_HALF_AXIS_PX * LEAST_HALF_AXIS_PX;
    let ellipse = shape.covariance(simd, radius * scale, edge);
    let half_depth = radius * normal[0].mul_add(normal[0], normal[1] * normal[1]).sqrt();
    let nearest = z - half_depth;
    let DepthChange {
        grown,
        most_change,
        deeper,
    } = depth_change(simd, view, [z, half_depth], scale);
    let area = (spacing * scale) * (spacing * scale) * shape.area;
    let weight = area.max(splat(LEAST_AREA_PX2))
        / (blurred.determinant.sqrt() * splat(std::f32::consts::TAU));
    let stretch = (length / inclined).min(splat(MOST_STRETCH));
    let behind = stretch * single(view.options.depth_tolerance_spacings);
    let tolerance = behind.mul_add(spacing, load(&discs.thickness) * THICKNESS_SIGMAS);
    let ([disc_box, blend_box], touches) = footprint_boxes(simd, &at, [&ellipse, &blurred], grown);
    let seen = z.simd_gt(splat(view.near)) & blurred.is_usable(simd) & ellipse.is_usable(simd);
    let seen = seen & weight.simd_lt(splat(f32::INFINITY));
    let seen = seen & touches & nearest.simd_le(splat(far));
    let light = light(simd, view, (&ray, length), &normal);
    Projected {
        seen: seen.to_bitmask(),
        at: [lanes(at[0]), lanes(at[1])],
        z: lanes(z),
        depths: [lanes(nearest), lanes(z + half_depth)],
        tolerance: lanes(tolerance),
        slope: [lanes(slope[0]), lanes(slope[1])],
        most_change: lanes(most_change),
        deeper: [lanes(deeper[0]), lanes(deeper[1])],
        gaussian: inverse(simd, &blurred),
        disc: inverse(simd, &ellipse),
        cut: [lanes(cut[0]), lanes(cut[1])],
        weight: lanes(weight),
        light: lanes(light),
        disc_box,
        blend_box,
    }
}

/// The change of z along x and y, as [`Splat`] has it; `toward` is the cosine of ray and normal times the ray's length.
#[inline(always)]
fn slope_of<S: Simd>(
    simd: S,
    [focal_x, focal_y]: [f32; 2],
    normal: &[f32x16<S>; 3],
    toward: f32x16<S>,
) -> [f32x16<S>; 2] {
    let over = f32x16::splat(simd, 0.0) - f32x16::splat(simd, 1.0) / toward;
    [
        normal[0] * over * (1.0 / focal_x),
        normal[1] * over * (1.0 / focal_y),
    ]
}

/// How a disc's depth changes over its footprint.
struct DepthChange<S: Simd> {
    /// By how much its near side is larger on the screen than its middle.
    grown: f32x16<S>,
    most_change: f32x16<S>,
    deeper: [f32x16<S>; 2],
}

#[inline(always)]
fn depth_change<S: Simd>(
    simd: S,
    view: &View,
    [z, half_depth]: [f32x16<S>; 2],
    scale: f32x16<S>,
) -> DepthChange<S> {
    let splat = |value: f32| f32x16::splat(simd, value);
    match view.projection {
        Projection::Perspective => {
            let half = half_depth * scale;
            let is_flat = half.simd_lt(splat(FLAT));
            DepthChange {
                grown: z / (z - half_depth).max(splat(view.near)),
                most_change: is_flat.select(half, splat(-1.0)),
                deeper: [z, z],
            }
        }
        Projection::Orthographic => DepthChange {
            grown: splat(1.0),
            most_change: half_depth,
            deeper: [splat(1.0), splat(0.0)],
        },
    }
}

/// First and last column and row of the pixels that a disc covers, the last exclusive, from the apron's first; and of the blocks that
/// its blend reaches; and whether there are any. Covariances are those of the disc and of the blend; `grown` makes up for the disc's nearer side.
#[inline(always)]
fn footprint_boxes<S: Simd>(
    simd: S,
    at: &[f32x16<S>; 2],
    [ellipse, blurred]: [&Covariance<S>; 2],
    grown: f32x16<S>,
) -> ([[[u32; LANES]; 4]; 2], mask32x16<S>) {
    let splat = |value: f32| f32x16::splat(simd, value);
    let whole = |v: f32x16<S>, to: &mut [u32; LANES]| v.to_int::<u32x16<S>>().store_slice(to);
    let (zero, most) = (splat(0.0), splat(MOST_REACH_PX));
    let side = splat((TILE_PX + 2 * APRON_PX) as f32);
    let blocks = splat((TILE_PX / BLOCK_PX) as f32);
    let mut boxes = [[[0; LANES]; 4]; 2];
    let mut touches = [mask32x16::splat(simd, true); 2];
    for axis in 0..2 {
        let disc = (ellipse.matrix[2 * axis].sqrt() * grown).min(most);
        let blend = (blurred.matrix[2 * axis].sqrt() * grown * single(REACH_SIGMAS)).min(most);
        // Pixels whose centres lie within, counted from the apron's first.
        let low = (at[axis] - disc - 0.5).ceil() + APRON_PX as f32;
        let high = (at[axis] + disc - 0.5).floor() + (APRON_PX + 1) as f32;
        // Subpixels lie up to half a pixel from their pixel's centre: they may be covered where no centre is.
        touches[0] &= low.simd_lt(side + 1.0) & high.simd_gt(splat(-1.0));
        whole(low.max(zero).min(side), &mut boxes[0][axis]);
        whole(high.max(zero).min(side), &mut boxes[0][axis + 2]);
        let per_block = 1.0 / BLOCK_PX as f32;
        let low = ((at[axis] - blend - 0.5).ceil() * per_block).floor();
        let high = ((at[axis] + blend - 0.5).floor() * per_block).floor();
        // One that ends before the tile has its first block after its last.
        let low = high.simd_lt(zero).select(blocks, low.max(zero).min(blocks));
        let high = high.max(zero).min(blocks - 1.0);
        touches[1] &= low.simd_le(high);
        whole(low, &mut boxes[1][axis]);
        whole(high, &mut boxes[1][axis + 2]);
    }
    (boxes, touches[0] | touches[1])
}

#[inline(always)]
fn lanes<S: Simd>(value: f32x16<S>) -> Lanes {
    let mut lanes = [0.0; LANES];
    value.store_slice(&mut lanes);
    lanes
}

/// The inverse of a covariance: of x^2, xy and y^2.
#[inline(always)]
fn inverse<S: Simd>(simd: S, c: &Covariance<S>) -> [Lanes; 3] {
    let over = f32x16::splat(simd, 1.0) / c.determinant;
    let [xx, xy, yy] = c.matrix;
    [lanes(yy * over), lanes(xy * over * -2.0), lanes(xx * over)]
}

/// The light on discs; their normals are turned to the eye.
#[inline(always)]
fn light<S: Simd>(
    simd: S,
    view: &View,
    (ray, length): (&Triple<S>, f32x16<S>),
    normal: &Triple<S>,
) -> f32x16<S> {
    let splat = |value: f32| f32x16::splat(simd, value);
    let facing = || dot(normal, ray) / length;
    match view.options.shade {
        Shade::Unlit => splat(1.0),
        Shade::Headlight => facing().abs().mul_add(splat(DIFFUSE), splat(AMBIENT)),
        Shade::Lambert => {
            let light = loaded(simd, &view.light.map(|c| [c; LANES]));
            let towards = dot(normal, &light);
            let lit = (towards * facing()).simd_lt(splat(0.0));
            let towards = lit.select(towards.abs(), splat(0.0));
            towards.mul_add(splat(DIFFUSE), splat(AMBIENT))
        }
    }
}

/// A unit disc on the screen, before its depth: J (I - n n') J', px^2.
struct Shape<S: Simd> {
    matrix: [f32x16<S>; 3],
    /// The root of the determinant.
    area: f32x16<S>,
}

/// A covariance, px^2: xx, xy, yy.
struct Covariance<S: Simd> {
    matrix: [f32x16<S>; 3],
    determinant: f32x16<S>,
}

impl<S: Simd> Shape<S> {
    /// The rows of J are (f, 0, -f x) and (0, f, -f y) for a ray (x, y, 1). A row less its part along the normal is as long as its
    /// cross product with the normal, which does not cancel.
    #[inline(always)]
    fn of(
        simd: S,
        [focal_x, focal_y]: [f32; 2],
        [x, y, _]: &Triple<S>,
        [nx, ny, nz]: &Triple<S>,
        across: f32x16<S>,
    ) -> Self {
        let (x, y, nx, ny, nz) = (*x, *y, *nx, *ny, *nz);
        let (fx, fy) = (f32x16::splat(simd, focal_x), f32x16::splat(simd, focal_y));
        let first = [x * ny * fx, (x * nx + nz) * fx, ny * fx];
        let second = [(y * ny + nz) * fy, y * nx * fy, nx * fy];
        let mixed = first[0] * second[0] + first[1] * second[1];
        Self {
            matrix: [
                dot(&first, &first),
                mixed - first[2] * second[2],
                dot(&second, &second),
            ],
            area: across.abs() * fx * fy,
        }
    }

    /// The disc's, of this size on the screen, widened by a variance.
    #[inline(always)]
    fn covariance(&self, simd: S, size: f32x16<S>, variance: f32) -> Covariance<S> {
        let variance = f32x16::splat(simd, variance);
        let square = size * size;
        let [xx, xy, yy] = [
            self.matrix[0] * square,
            self.matrix[1] * square,
            self.matrix[2] * square,
        ];
        let area = square * self.area;
        // All terms are positive: nothing cancels.
        let determinant = area.mul_add(area, (xx + yy + variance) * variance);
        Covariance {
            matrix: [xx + variance, xy, yy + variance],
            determinant,
        }
    }
}

impl<S: Simd> Covariance<S> {
    #[inline(always)]
    fn is_usable(&self, simd: S) -> mask32x16<S> {
        let most = f32x16::splat(simd, f32::MAX);
        self.determinant.simd_le(most)
            & self.matrix[0].simd_le(most)
            & self.matrix[2].simd_le(most)
            & self.determinant.simd_gt(f32x16::splat(simd, 0.0))
    }
}
