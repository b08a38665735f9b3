//! Discs from points: each point gets a normal, a radius, a thickness and, at the border of a surface, a cut.
//!
//! Takes a [`PointCloud`], returns [`Prepared`]: one disc of 52 bytes per point that is kept, neighbours near each other in
//! memory. The plane comes from the nearest points; where they are thick against their width (noise), from more of them.
//! A point that lies far from its neighbours, measured by the spacing that those have, is left out: it is a flying pixel,
//! which a scanner makes where its beam meets two surfaces.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use resample_core::narrow::single;

use crate::Error;
use crate::cloud::cells::{Nearest, Place, Tree};
use crate::cloud::fit::{Plane, plane};
use crate::cloud::points::PointCloud;
use crate::cloud::voronoi::Cell;

/// Points of a fit, the point itself among them: two rings around it on a grid have 8 and 16. A guess.
const NEAR: usize = 13;

/// The neighbour whose distance says how far points lie apart: the first ring has six. Those of the second ring lie past the
/// border of a surface for twice as many points.
const RING: usize = 6;

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

/// A surface ends this many spacings past the outermost of a point's neighbours. Half a spacing would be right on a grid; among
/// jittered points the outermost one lies nearer to the border. Measured on a plane of jittered points two pixels apart: 0.3
/// covered 2.9 % too much, 0.1 2.1 %, 0 lacks three times as much as 0.1.
const BORDER_SPACINGS: f64 = 0.05;

/// A point is far from a neighbour at this many of the neighbour's reaches (the distance of its twelfth neighbour). A guess:
/// a scan's spacing changes little within 12 points.
const FAR_REACHES: f32 = 1.6;

/// Points in a row of the tree's order whose reaches are compared, to look for far points only where one may be.
const BLOCK: usize = 256;

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

/// The most memory that making discs of so many points takes beside the cloud, bytes: a place in the tree with its axis, a fit, a
/// fate, a disc and its number.
pub fn prepare_bytes(points: usize) -> u64 {
    const EACH: usize = size_of::<Place>() + 1 + size_of::<(Disc, f32)>() + 1 + size_of::<Disc>() + 4;
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
    let slots = 0..tree.places.len();
    let fitted: Vec<(Disc, f32)> = slots
        .into_par_iter()
        .map(|slot| fitted(&tree, slot, cloud))
        .collect();
    let keep: Vec<Keep> = fitted
        .par_chunks(BLOCK)
        .enumerate()
        .flat_map_iter(|(block, discs)| kept(&tree, &fitted, discs, block * BLOCK))
        .collect();
    let count = |what| keep.par_iter().filter(|&&k| k == what).count() as u64;
    let has_disc = |keep: Keep| match (keep, floating) {
        (Keep::Kept, _) | (Keep::Isolated, Floating::Kept) => true,
        (Keep::Isolated, Floating::LeftOut) | (Keep::WithoutSpacing, _) => false,
    };
    let left_out = LeftOut {
        isolated: match floating {
            Floating::LeftOut => count(Keep::Isolated),
            Floating::Kept => 0,
        },
        without_spacing: count(Keep::WithoutSpacing),
    };
    let places = tree.places.iter().zip(&keep);
    let points = places.filter_map(|(place, keep)| has_disc(*keep).then_some(place.index));
    let points = points.collect();
    drop(tree);
    let pairs = fitted.into_iter().zip(keep);
    let discs = pairs.filter_map(|((disc, _), keep)| has_disc(keep).then_some(disc));
    Ok(Prepared {
        origin_in_world: cloud.origin_in_world,
        discs: discs.collect(),
        points,
        left_out,
    })
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

/// The disc of a place, and its reach: the distance of its farthest near neighbour.
fn fitted(tree: &Tree, slot: usize, cloud: &PointCloud) -> (Disc, f32) {
    let place = tree.places[slot];
    let near = tree.nearest(place.at, NEAR);
    let mut plane = plane_of(tree, place.at, &near);
    if plane.roughness() > ROUGH {
        let wide = plane_of(tree, place.at, &tree.nearest(place.at, WIDE));
        if wide.roughness() < FLATTER * plane.roughness() {
            plane = wide;
        }
    }
    let others = near.squares().len() - 1;
    let reach = near.squares()[others].sqrt();
    let (spacing, mut edge) = edge_of(tree, place.at, &near, &plane, None);
    if edge.past < edge.radius {
        // More neighbours tell the end of a surface from a gap between its points.
        let wide = tree.nearest(place.at, WIDE);
        edge = edge_of(tree, place.at, &wide, &plane, Some(spacing)).1;
    }
    let cut = match edge.past < edge.radius {
        true => (edge.outward / edge.past).as_vec3(),
        false => Vec3::ZERO,
    };
    let disc = Disc {
        position: place.at.to_array(),
        normal: plane.normal.as_vec3().to_array(),
        cut: cut.to_array(),
        radius: single(edge.radius),
        spacing: single(spacing),
        thickness: single(plane.deviations[0]),
        colour: cloud.colours[place.index as usize],
    };
    (disc, reach)
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

/// Finds where the surface ends around a point, which is away from the mean of its neighbours, and, where it is not known
/// yet, the spacing.
fn edge_of(
    tree: &Tree,
    at: Vec3,
    near: &Nearest,
    plane: &Plane,
    spacing: Option<f64>,
) -> (f64, Edge) {
    let offset = |&slot: &u32| {
        let offset = (tree.places[slot as usize].at - at).as_dvec3();
        offset - plane.normal * plane.normal.dot(offset)
    };
    let squares = near.squares();
    let reach = f64::from(squares[squares.len() - 1]).sqrt();
    let mean = near.slots().iter().map(offset).sum::<DVec3>() / squares.len() as f64;
    let outward = (-mean).normalize_or_zero();
    let extents = near.slots().iter().map(|slot| outward.dot(offset(slot)));
    let mean_part = mean.length() / reach.max(f64::MIN_POSITIVE);
    let one_sided = (mean_part - WHOLE_MEAN) / (HALF_MEAN - WHOLE_MEAN);
    let part = 1.0 - 0.5 * one_sided.clamp(0.0, 1.0);
    let spacing = spacing.unwrap_or_else(|| spacing_of(near, part));
    let past = extents.fold(0.0, f64::max) + BORDER_SPACINGS * spacing;
    let radius = reach_of(tree, at, near, plane, (outward, past), spacing);
    let edge = Edge {
        outward,
        past,
        radius,
    };
    (spacing, edge)
}

/// The radius of a point's disc: how far its cell between the neighbours and the surface's end goes.
fn reach_of(
    tree: &Tree,
    at: Vec3,
    near: &Nearest,
    plane: &Plane,
    (outward, past): (DVec3, f64),
    spacing: f64,
) -> f64 {
    let (u, v) = plane.normal.any_orthonormal_pair();
    let flat = |offset: DVec3| DVec2::new(offset.dot(u), offset.dot(v));
    let most = MOST_REACH_SPACINGS * spacing;
    let mut cell = Cell::square(most);
    for (&slot, &square) in near.slots().iter().zip(near.squares()) {
        let reached = cell.farthest_square();
        // A neighbour twice as far as the farthest corner cuts nothing, and no later one does.
        if f64::from(square) > 4.0 * reached {
            break;
        }
        let neighbour = flat((tree.places[slot as usize].at - at).as_dvec3());
        if neighbour.length_squared() > LEAST_APART * spacing * spacing {
            cell.keep_nearer_than(neighbour);
        }
    }
    cell.keep(flat(outward), past);
    // Where points lie off their plane, neighbours' planes are tilted, and seen aslant they part.
    let radius = REACH_MARGIN * cell.farthest_square().sqrt() + plane.deviations[0];
    radius.clamp(0.5 * spacing, most)
}

/// The fates of the points of a block, whose first one has this slot.
fn kept<'a>(
    tree: &'a Tree,
    all: &'a [(Disc, f32)],
    block: &'a [(Disc, f32)],
    first: usize,
) -> impl Iterator<Item = Keep> + 'a {
    let mut reaches: Vec<f32> = block.iter().map(|(_, reach)| *reach).collect();
    let middle = reaches.len() / 2;
    let usual = *reaches.select_nth_unstable_by(middle, f32::total_cmp).1;
    let judge = move |(i, &(_, reach)): (usize, &(Disc, f32))| {
        if !(reach > 0.0) {
            Keep::WithoutSpacing
        } else if reach > FAR_REACHES * usual && is_far(tree, all, first + i) {
            Keep::Isolated
        } else {
            Keep::Kept
        }
    };
    block.iter().enumerate().map(judge)
}

/// Returns true if most neighbours have nearer ones than this place.
fn is_far(tree: &Tree, all: &[(Disc, f32)], slot: usize) -> bool {
    let near = tree.nearest(tree.places[slot].at, NEAR);
    let neighbours = || {
        near.slots()
            .iter()
            .zip(near.squares())
            .filter(|(s, _)| **s as usize != slot)
    };
    let far = neighbours().filter(|(s, square)| square.sqrt() > FAR_REACHES * all[**s as usize].1);
    2 * far.count() > neighbours().count()
}
