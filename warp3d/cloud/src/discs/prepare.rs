//! Discs from points: each point gets a normal, a radius, a thickness and, at the border of a surface, a cut.
//!
//! Takes a [`PointCloud`], returns [`Prepared`]: one disc of 52 bytes per point that is kept, neighbours near each other in
//! memory. The plane comes from the nearest points; where they are thick against their width (noise), from more of them.
//! A point that lies far from its neighbours, measured by the spacing that those have, is left out: it is a flying pixel,
//! which a scanner makes where its beam meets two surfaces.

use fearless_simd::prelude::*;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::narrow::{count, single};
use resample_core::simd::SimdLevel;

use crate::discs::cells::{MOST_NEIGHBOURS, Nearest, Place, Tree};
use crate::discs::crowd::{Crowd, NEAR, RING};
use crate::discs::fit::{Plane, plane};
use crate::discs::hull::{Side, sides};
use crate::discs::rows::{self, Limits, Row};
use crate::discs::voronoi::Cell;
use crate::lanes::LANES;
use crate::points::PointCloud;
use resample_core::Error;

/// Points of a fit where the nearest ones are rough: twice the width, four times the points.
const WIDE: usize = 48;

/// A fit is rough above this thickness against its width. A guess.
const ROUGH: f64 = 0.2;

/// The wider fit replaces the near one if it is so much flatter: noise has half the roughness at twice the width, an edge
/// or a ball has the same; the middle of both.
const FLATTER: f64 = 0.75;

/// Discs reach this much farther than the farthest corner of the part of the surface that is nearest to their point: in
/// curved and noisy surfaces the planes of neighbours differ. A guess.
const REACH_MARGIN: f64 = 1.1;

/// Most spacings that a disc reaches: points wholly at random leave a circle of 2.2 spacings empty once in 4 million
/// (exp(-pi r^2)).
const MOST_REACH_SPACINGS: f64 = 2.2;

/// Neighbours nearer than a tenth of a spacing (here its square) in the plane lie above or below the point, or in it: noise.
const LEAST_APART: f64 = 0.01;

/// The mean of points in half a circle lies at 4 / (3 pi) of its radius.
const HALF_MEAN: f64 = 0.42;

/// The mean of 12 points in a whole circle lies at 0.19 of its radius (root mean square); below this it is chance.
const WHOLE_MEAN: f64 = 0.2;

/// A surface ends this many spacings past the outline of a point's neighbours. Half a spacing would be right on a grid; among jittered
/// points the outermost ones lie nearer to the border. Measured on a plane of jittered points two pixels apart: 0.05 covered 0.08 % too
/// much and lacked 0.66 %, 0.1 0.15 and 0.43 %, 0.16 0.38 and 0.23 %, 0.35 1.5 and 0.02 %. At one point a pixel 0.16 lacks less than 0.1 %.
const BORDER_SPACINGS: f64 = 0.16;

/// A point is far from a neighbour at this many of the neighbour's reaches (the distance of its twelfth neighbour). A guess:
/// a scan's spacing changes little within 12 points.
const FAR_REACHES: f32 = 1.6;

/// Points that fill a volume this many times more thinly than nearly all others float: dust, birds, mixed pixels that are one
/// another's neighbours. A sparse surface is far from a scanner, and stays. A guess.
const THIN_REACHES: f32 = 3.0;

/// Thickness over reach above which points fill a volume: 0.45 in a ball in the mean, but a dozen points at random may lie flatter.
const FILLED_PART: f32 = 0.12;

/// Points in a row of the tree's order whose reaches are compared, to look for far points only where one may be.
const BLOCK: usize = 256;

/// Thickness against width of the points around one: below the first they are a surface or its edge, above the second they fill a
/// volume. A box has 0.45 at its edges; a tree's leaves 0.6 to 0.9.
const FILLED: [f64; 2] = [0.45, 0.65];

/// Discs reach at most so many times as far as those of nearly all points: a few far points of a sweeping scanner would hide the
/// scene. A guess.
const LARGEST: f32 = 3.0;

/// The share of the points that are not among the sparsest. A guess.
const USUAL_SHARE: f64 = 0.95;

/// A row of points looks for neighbours as far as this many times the mean distance of the farthest neighbours of the row before:
/// nearly all points have theirs there. A guess.
const ROW_REACHES: f32 = 1.2;

/// The numbers above, as rows of discs need them.
fn limits() -> Limits {
    Limits {
        rough: single(ROUGH),
        whole_mean: single(WHOLE_MEAN),
        half_mean: single(HALF_MEAN),
        least_apart: single(LEAST_APART),
        border_spacings: single(BORDER_SPACINGS),
        reach_margin: single(REACH_MARGIN),
        most_reach_spacings: single(MOST_REACH_SPACINGS),
    }
}

/// In place of a disc that is not made yet.
pub(crate) const NO_DISC: Disc = Disc {
    position: [0.0; 3],
    normal: [0.0; 3],
    cut: [0.0; 3],
    radius: 0.0,
    spacing: 0.0,
    thickness: 0.0,
    colour: [0; 3],
};

/// A disc of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// The middle relative to the origin, world units.
    pub position: [f32; 3],
    /// Unit normal; its sign means nothing.
    pub normal: [f32; 3],
    /// Cut of a disc at the border of a surface: offsets from the middle whose product with this is above 1 lie outside. 0
    /// elsewhere; per world unit.
    pub cut: [f32; 3],
    /// Radius of the disc: with it discs cover all that lies between their points, world units.
    pub radius: f32,
    /// Mean distance between the points here: the root of the area that one has, world units.
    pub spacing: f32,
    /// Standard deviation of the points from their plane, world units.
    pub thickness: f32,
    /// Colour, sRGB.
    pub colour: [u8; 3],
}

/// Points that got no disc.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Points far from all others.
    pub isolated: u64,
    /// Points with 12 others in the same place, or without any other: they have no spacing.
    pub without_spacing: u64,
}

/// The fate of points far from all others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Floating {
    /// They get no disc.
    #[default]
    LeftOut,
    /// They get a disc as large as their distance from the others asks for.
    Kept,
}

/// Discs of a cloud.
#[derive(Clone, Debug, PartialEq)]
pub struct Prepared {
    /// The place that discs are relative to, world units.
    pub origin_in_world: DVec3,
    /// Discs; those of neighbouring points lie near each other.
    pub discs: Vec<Disc>,
    /// The number in the cloud of each disc's point.
    pub points: Vec<u32>,
    /// How many points are left out.
    pub left_out: LeftOut,
}

/// The most memory that making discs of so many points takes beside the cloud, bytes: a place in the tree with its share of the splits, a disc, a
/// reach and a copy of it, a fate.
pub fn prepare_bytes(points: usize) -> u64 {
    const EACH: usize = size_of::<Place>() + 1 + size_of::<Disc>() + 2 * size_of::<f32>() + 1;
    EACH as u64 * points as u64
}

/// Makes discs of points.
///
/// # Errors
/// [`Error::Input`] for a cloud that [`PointCloud::validate`] refuses.
pub fn prepare(cloud: &PointCloud) -> Result<Prepared, Error> {
    prepare_with(cloud, Floating::LeftOut)
}

/// Makes discs of points, and decides about those far from all others.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_with(cloud: &PointCloud, floating: Floating) -> Result<Prepared, Error> {
    cloud.validate()?;
    let tree = Tree::new(&cloud.positions);
    let mut discs = vec![NO_DISC; tree.places.len()];
    let mut reaches = vec![0.0; tree.places.len()];
    let level = SimdLevel::Auto.resolve();
    let blocks = discs.par_chunks_mut(BLOCK);
    let blocks = blocks.zip(reaches.par_chunks_mut(BLOCK)).enumerate();
    blocks.for_each(|(block, (discs, reaches))| {
        let mut fitter = Fitter::new(&tree, cloud);
        dispatch!(level, simd => fitter.fit(simd, block * BLOCK, (discs, reaches)));
    });
    let thin = THIN_REACHES * usual_most(reaches.clone());
    let keep: Vec<Keep> = discs
        .par_chunks(BLOCK)
        .enumerate()
        .flat_map_iter(|(block, discs)| kept(&tree, (&reaches, thin), discs, block * BLOCK))
        .collect();
    drop(reaches);
    let counted = |what| keep.par_iter().filter(|&&k| k == what).count() as u64;
    let has_disc = |keep: Keep| match (keep, floating) {
        (Keep::Kept, _) | (Keep::Isolated, Floating::Kept) => true,
        (Keep::Isolated, Floating::LeftOut) | (Keep::WithoutSpacing, _) => false,
    };
    let left_out = LeftOut {
        isolated: match floating {
            Floating::LeftOut => counted(Keep::Isolated),
            Floating::Kept => 0,
        },
        without_spacing: counted(Keep::WithoutSpacing),
    };
    let kept = keep.iter().filter(|&&keep| has_disc(keep)).count();
    let mut points = Vec::with_capacity(kept);
    let places = tree.places.iter().zip(&keep);
    points.extend(places.filter_map(|(place, keep)| has_disc(*keep).then_some(place.index)));
    drop(tree);
    let mut fates = keep.iter();
    discs.retain(|_| fates.next().is_some_and(|&keep| has_disc(keep)));
    discs.shrink_to_fit();
    limit(&mut discs);
    Ok(Prepared {
        origin_in_world: cloud.origin_in_world,
        discs,
        points,
        left_out,
    })
}

/// The value that nearly all others stay below; 0 where there is no value.
fn usual_most(mut values: Vec<f32>) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let place = count((USUAL_SHARE * (values.len() - 1) as f64) as u64);
    *values.select_nth_unstable_by(place, f32::total_cmp).1
}

/// Makes the largest discs smaller.
fn limit(discs: &mut [Disc]) {
    let usual = usual_most(discs.iter().map(|disc| disc.radius).collect());
    for disc in discs {
        let part = (LARGEST * usual / disc.radius).min(1.0);
        disc.radius *= part;
        disc.spacing *= part;
    }
}

impl Prepared {
    /// Gives each disc the colour, sRGB, that `colour` says for it and for the number of its point in the cloud.
    pub fn recolour(&mut self, colour: impl Fn(&Disc, usize) -> [u8; 3] + Sync) {
        let pairs = self.discs.par_iter_mut().zip(&self.points);
        pairs.for_each(|(disc, &point)| disc.colour = colour(disc, point as usize));
    }
}

/// The fate of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Keep {
    Kept,
    Isolated,
    WithoutSpacing,
}

/// Makes discs of places that follow one another in the tree's order, so that each is near the one before it.
struct Fitter<'a> {
    tree: &'a Tree,
    cloud: &'a PointCloud,
    crowd: Crowd,
    near: Nearest,
    wide: Nearest,
    /// The place before this one and the distance of its farthest near neighbour.
    before: Option<(Vec3, f32)>,
    /// Offsets of neighbours in the plane.
    flat: [DVec2; MOST_NEIGHBOURS],
    /// Corners and sides of an outline.
    corners: Vec<DVec2>,
    ends: Vec<Side>,
}

impl<'a> Fitter<'a> {
    fn new(tree: &'a Tree, cloud: &'a PointCloud) -> Self {
        Self {
            tree,
            cloud,
            crowd: Crowd::new(),
            near: Nearest::new(),
            wide: Nearest::new(),
            before: None,
            flat: [DVec2::ZERO; MOST_NEIGHBOURS],
            corners: Vec::new(),
            ends: Vec::new(),
        }
    }

    /// Makes the discs of a block, whose first place has this slot.
    #[inline(always)]
    fn fit<S: Simd>(&mut self, simd: S, first: usize, (discs, reaches): (&mut [Disc], &mut [f32])) {
        let limits = limits();
        let mut distance = ROW_REACHES * self.fitted(first).1;
        let rows = discs.chunks_mut(LANES).zip(reaches.chunks_mut(LANES));
        for (row, (discs, reaches)) in rows.enumerate() {
            let first = first + row * LANES;
            let (tree, count) = (self.tree, discs.len());
            self.crowd.find(simd, tree, first, distance);
            let found = self.crowd.found;
            let row = rows::fitted(simd, &self.crowd.offsets, &limits);
            // Colours lie far apart in memory, and are waited for together.
            let mut colours = [[0; 3]; LANES];
            for (to, place) in colours.iter_mut().zip(&tree.places[first..first + count]) {
                *to = self.cloud.colours[place.index as usize];
            }
            let mut sum = 0.0;
            for (lane, (disc, reach)) in discs.iter_mut().zip(reaches).enumerate() {
                let is_usual = found & row.usual & 1 << lane != 0;
                (*disc, *reach) = match is_usual {
                    true => self.of_row(&row, first + lane, lane, colours[lane]),
                    false => self.fitted(first + lane),
                };
                sum += *reach;
            }
            distance = ROW_REACHES * sum / count as f32;
        }
    }

    #[inline(always)]
    fn of_row(&self, row: &Row, slot: usize, lane: usize, colour: [u8; 3]) -> (Disc, f32) {
        let place = self.tree.places[slot];
        let disc = Disc {
            position: place.at.to_array(),
            normal: [
                row.normal[0][lane],
                row.normal[1][lane],
                row.normal[2][lane],
            ],
            cut: [0.0; 3],
            radius: row.radius[lane],
            spacing: row.spacing[lane],
            thickness: row.thickness[lane],
            colour,
        };
        (disc, row.reach[lane])
    }

    /// The disc of a place, and its reach: the distance of its farthest near neighbour.
    fn fitted(&mut self, slot: usize) -> (Disc, f32) {
        let place = self.tree.places[slot];
        // The neighbours of the place before are neighbours of this one, farther by the step between them.
        let bound = self
            .before
            .map_or(f32::INFINITY, |(at, reach)| reach + at.distance(place.at));
        self.tree.nearest(place.at, NEAR, bound, &mut self.near);
        let squares = self.near.squares();
        let reach = squares[squares.len() - 1].sqrt();
        self.before = (squares.len() == NEAR).then_some((place.at, reach));
        let mut plane = plane_of(self.tree, place.at, &self.near);
        let mut has_wide = false;
        // A point that noise has moved off the surface is put back.
        let mut back = Vec3::ZERO;
        if plane.roughness() > ROUGH {
            self.tree
                .nearest(place.at, WIDE, f32::INFINITY, &mut self.wide);
            has_wide = true;
            let wide = plane_of(self.tree, place.at, &self.wide);
            if wide.roughness() < FLATTER * plane.roughness() {
                plane = wide;
                back = (plane.normal * plane.offset).as_vec3();
            }
        }
        let (spacing, mut edge) = edge_of(self.tree, place.at, &self.near, &plane, &mut self.flat);
        if edge.past < edge.radius {
            // More neighbours tell the end of a surface from a gap between its points.
            if !has_wide {
                self.tree
                    .nearest(place.at, WIDE, f32::INFINITY, &mut self.wide);
            }
            edge = self.outline_of(place.at, &plane, spacing);
        }
        let cut = match edge.past < edge.radius {
            true => (edge.outward / edge.past).as_vec3(),
            false => Vec3::ZERO,
        };
        let disc = Disc {
            position: (place.at + back).to_array(),
            normal: plane.normal.as_vec3().to_array(),
            cut: cut.to_array(),
            radius: single(edge.radius * part_of_rough(plane.roughness())),
            spacing: single(spacing),
            thickness: single(plane.deviations[0]),
            colour: self.cloud.colours[place.index as usize],
        };
        (disc, reach)
    }

    /// Finds where the surface ends around a point by the outline of its wide neighbours: at the outline's nearest side.
    fn outline_of(&mut self, at: Vec3, plane: &Plane, spacing: f64) -> Edge {
        let axes = plane.normal.any_orthonormal_pair();
        let flat = &mut self.flat[..self.wide.squares().len()];
        flatten(self.tree, at, &self.wide, axes, flat);
        let mut places = self.flat;
        let places = &mut places[..self.wide.squares().len()];
        sides(places, &mut self.corners, &mut self.ends);
        let margin = BORDER_SPACINGS * spacing;
        for (_, past) in &mut self.ends {
            *past = past.max(0.0) + margin;
        }
        let nearest = self.ends.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let &(outward, past) = nearest.unwrap_or(&(DVec2::ZERO, f64::INFINITY));
        let flat = &self.flat[..self.wide.squares().len()];
        let radius = reach_of(&self.wide, flat, &self.ends, spacing) + plane.deviations[0];
        Edge {
            outward: outward.x * axes.0 + outward.y * axes.1,
            past,
            radius: clamped(radius, spacing),
        }
    }
}

/// A radius between its limits: where points lie off their plane, neighbours' planes are tilted, and seen aslant they part.
fn clamped(radius: f64, spacing: f64) -> f64 {
    radius.clamp(0.5 * spacing, MOST_REACH_SPACINGS * spacing)
}

/// The part of a disc's radius that is drawn: all on a surface, where points fill a volume, as leaves do, half of it.
fn part_of_rough(roughness: f64) -> f64 {
    let rough = (roughness - FILLED[0]) / (FILLED[1] - FILLED[0]);
    1.0 - 0.5 * rough.clamp(0.0, 1.0)
}

fn plane_of(tree: &Tree, at: Vec3, nearest: &Nearest) -> Plane {
    plane(
        at,
        nearest
            .slots()
            .iter()
            .map(|&slot| tree.places[slot as usize].at),
    )
}

/// The root of the area of one point, where this part of the circle around it has points.
fn spacing_of(near: &Nearest, part: f64) -> f64 {
    let squares = near.squares();
    let others = (squares.len() - 1).min(RING);
    // The circle through a neighbour holds the point itself and half of that neighbour beside those within.
    let points = (others as f64 + 0.5).max(1.0);
    (part * std::f64::consts::PI * f64::from(squares[others]) / points).sqrt()
}

/// How far the surface goes around a point.
struct Edge {
    /// Unit direction in the plane in which fewest neighbours lie.
    outward: DVec3,
    /// Where the surface ends there, world units.
    past: f64,
    /// Radius of the disc, world units.
    radius: f64,
}

/// Finds the spacing, and where the surface may end around a point, which is away from the mean of its neighbours. `flat` is filled
/// with the neighbours' offsets in the plane.
fn edge_of(
    tree: &Tree,
    at: Vec3,
    near: &Nearest,
    plane: &Plane,
    flat: &mut [DVec2; MOST_NEIGHBOURS],
) -> (f64, Edge) {
    let axes = plane.normal.any_orthonormal_pair();
    let squares = near.squares();
    let flat = &mut flat[..squares.len()];
    flatten(tree, at, near, axes, flat);
    let sum: DVec2 = flat.iter().sum();
    let reach = f64::from(squares[squares.len() - 1]).sqrt();
    let mean = sum / squares.len() as f64;
    let outward = (-mean).normalize_or_zero();
    let extents = flat.iter().map(|&offset| outward.dot(offset));
    let mean_part = mean.length() / reach.max(f64::MIN_POSITIVE);
    let one_sided = (mean_part - WHOLE_MEAN) / (HALF_MEAN - WHOLE_MEAN);
    let part = 1.0 - 0.5 * one_sided.clamp(0.0, 1.0);
    let spacing = spacing_of(near, part);
    let past = extents.fold(0.0, f64::max) + BORDER_SPACINGS * spacing;
    let radius = reach_of(near, flat, &[(outward, past)], spacing) + plane.deviations[0];
    let (u, v) = axes;
    let edge = Edge {
        outward: outward.x * u + outward.y * v,
        past,
        radius: clamped(radius, spacing),
    };
    (spacing, edge)
}

/// Fills in the neighbours' offsets in the plane of these axes.
fn flatten(tree: &Tree, at: Vec3, near: &Nearest, (u, v): (DVec3, DVec3), flat: &mut [DVec2]) {
    for (flat, &slot) in flat.iter_mut().zip(near.slots()) {
        let offset = (tree.places[slot as usize].at - at).as_dvec3();
        *flat = DVec2::new(offset.dot(u), offset.dot(v));
    }
}

/// How far a point's cell between its neighbours, whose offsets in the plane are given, and the surface's ends goes.
fn reach_of(near: &Nearest, flat: &[DVec2], ends: &[Side], spacing: f64) -> f64 {
    let mut cell = Cell::square(MOST_REACH_SPACINGS * spacing);
    let mut reached = cell.farthest_square();
    for (&neighbour, &square) in flat.iter().zip(near.squares()) {
        // A neighbour twice as far as the farthest corner cuts nothing, and no later one does.
        if f64::from(square) > 4.0 * reached {
            break;
        }
        let length_squared = neighbour.length_squared();
        if length_squared > LEAST_APART * spacing * spacing && length_squared < 4.0 * reached {
            cell.keep_nearer_than(neighbour);
            reached = cell.farthest_square();
        }
    }
    for &(outward, past) in ends {
        cell.keep(outward, past);
    }
    REACH_MARGIN * cell.farthest_square().sqrt()
}

/// The fates of the points of a block, whose first one has this slot. `thin` is the reach beyond which points that fill a volume float.
fn kept<'a>(
    tree: &'a Tree,
    (reaches, thin): (&'a [f32], f32),
    block: &'a [Disc],
    first: usize,
) -> impl Iterator<Item = Keep> + 'a {
    let own = &reaches[first..first + block.len()];
    let mut sorted = own.to_vec();
    let middle = sorted.len() / 2;
    let usual = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
    let floats = move |disc: &Disc, reach: f32, slot: usize| {
        let is_dust = reach > thin && disc.thickness > FILLED_PART * reach;
        is_dust || (reach > FAR_REACHES * usual && is_far(tree, reaches, slot))
    };
    let judge = move |(i, (disc, &reach)): (usize, (&Disc, &f32))| {
        if !(reach > 0.0) {
            Keep::WithoutSpacing
        } else if floats(disc, reach, first + i) {
            Keep::Isolated
        } else {
            Keep::Kept
        }
    };
    block.iter().zip(own).enumerate().map(judge)
}

/// Returns true if most neighbours have nearer ones than this place.
fn is_far(tree: &Tree, reaches: &[f32], slot: usize) -> bool {
    let mut near = Nearest::new();
    tree.nearest(tree.places[slot].at, NEAR, f32::INFINITY, &mut near);
    let neighbours = || {
        near.slots()
            .iter()
            .zip(near.squares())
            .filter(|(s, _)| **s as usize != slot)
    };
    let far =
        neighbours().filter(|(s, square)| square.sqrt() > FAR_REACHES * reaches[**s as usize]);
    2 * far.count() > neighbours().count()
}
