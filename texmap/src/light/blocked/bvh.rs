//! A tree of boxes around triangles, and rays through it, sixteen at a time.
//!
//! Built by the surface area heuristic over bins of centres (Wald 2007). Every triangle is in one leaf, so that a ray meets it once,
//! and what it lets through can be multiplied in any order.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16};
use glam::Vec3;

use crate::screen::Lanes;
use resample_core::narrow::{cell, index32};

/// Triangles of a leaf.
const LEAF: usize = 4;

/// Bins along an axis in which splits are looked for.
const BINS: usize = 16;

/// Triangles from which on both halves are built at the same time.
const PARALLEL: usize = 4096;

/// Levels after which halves have as many triangles each, so that the depth has a bound.
const BALANCED: usize = 40;

/// Boxes that wait at most: one for each level, of which there are no more than 32 balanced ones.
const WAITING: usize = BALANCED + 40;

/// Rays that carry less light than this have ended.
const DARK: f32 = 1.0 / 256.0;

/// A triangle that blocks light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blocker {
    pub(crate) corners: [Vec3; 3],
    /// The share of light that it takes, 0..=1.
    pub(crate) opacity: f32,
}

/// A triangle as rays meet it.
#[derive(Clone, Copy, Debug, Default)]
struct Facet {
    corner: Vec3,
    edges: [Vec3; 2],
    opacity: f32,
}

/// A box, and what is in it.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Of a leaf, its first triangle; else the first of both halves, which stand beside each other.
    next: u32,
    /// Triangles of a leaf; 0 else.
    count: u32,
}

/// The tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    facets: Vec<Facet>,
}

/// Sixteen parallel rays: what depends on their direction alone is computed once for all.
pub(crate) struct Rays<S: Simd> {
    from: Vector<S>,
    towards: Vec3,
    /// One over each part of `towards`, and `from` times that.
    per_step: Vec3,
    from_in_steps: Vector<S>,
}

/// Sixteen vectors. Not an array: one that is not taken apart at compile time is copied for every use.
#[derive(Clone, Copy)]
pub(crate) struct Vector<S: Simd> {
    pub(crate) x: f32x16<S>,
    pub(crate) y: f32x16<S>,
    pub(crate) z: f32x16<S>,
}

impl<S: Simd> Vector<S> {
    /// The same vector in all places.
    #[inline(always)]
    pub(crate) fn splat(simd: S, v: Vec3) -> Self {
        Self {
            x: f32x16::splat(simd, v.x),
            y: f32x16::splat(simd, v.y),
            z: f32x16::splat(simd, v.z),
        }
    }

    #[inline(always)]
    pub(crate) fn load(simd: S, lanes: &[Lanes; 3]) -> Self {
        Self {
            x: f32x16::from_slice(simd, &lanes[0]),
            y: f32x16::from_slice(simd, &lanes[1]),
            z: f32x16::from_slice(simd, &lanes[2]),
        }
    }

    #[inline(always)]
    pub(crate) fn dot(&self, other: &Self) -> f32x16<S> {
        self.x
            .mul_add(other.x, self.y.mul_add(other.y, self.z * other.z))
    }
}

impl<S: Simd> Rays<S> {
    /// Rays from places towards one direction.
    #[inline(always)]
    pub(crate) fn new(simd: S, from: Vector<S>, towards: Vec3) -> Self {
        let per_step = Vec3::new(
            reciprocal(towards.x),
            reciprocal(towards.y),
            reciprocal(towards.z),
        );
        let step = Vector::splat(simd, per_step);
        Self {
            from,
            towards,
            per_step,
            from_in_steps: Vector {
                x: from.x * step.x,
                y: from.y * step.y,
                z: from.z * step.z,
            },
        }
    }
}

/// One over a part of a direction. No part is 0, so that no product of an infinite number and 0 arises.
#[inline(always)]
fn reciprocal(part: f32) -> f32 {
    1.0 / part.abs().max(1e-9).copysign(part)
}

/// A triangle with its box, while the tree is built.
#[derive(Clone, Copy)]
struct Boxed {
    low: Vec3,
    high: Vec3,
    index: u32,
}

impl Boxed {
    fn middle(&self) -> Vec3 {
        self.low + self.high
    }
}

impl Tree {
    pub(crate) fn new(blockers: &[Blocker]) -> Self {
        let mut boxed: Vec<Boxed> = blockers.iter().enumerate().map(boxed).collect();
        if boxed.is_empty() {
            return Self::default();
        }
        let mut nodes = vec![Node::default(); 2 * boxed.len() - 1];
        build(&mut nodes, 0, &mut boxed, 0, 0);
        let nodes = packed(&nodes);
        let facets = boxed.iter().map(|boxed| {
            let blocker = &blockers[boxed.index as usize];
            let [a, b, c] = blocker.corners;
            Facet {
                corner: a,
                edges: [b - a, c - a],
                opacity: blocker.opacity,
            }
        });
        Self {
            nodes,
            facets: facets.collect(),
        }
    }

    /// The box around all triangles.
    pub(crate) fn bounds(&self) -> Option<[Vec3; 2]> {
        self.nodes.first().map(|node| [node.low, node.high])
    }

    /// Takes from `light` what triangles on the rays block.
    #[inline(always)]
    pub(crate) fn block_in<S: Simd>(&self, simd: S, rays: &Rays<S>, light: &mut Lanes) {
        self.follow::<S, false>(simd, rays, light);
    }

    /// Adds to `crossed` how often each ray leaves a body less how often it enters one.
    #[inline(always)]
    pub(crate) fn cross_in<S: Simd>(&self, simd: S, rays: &Rays<S>, crossed: &mut Lanes) {
        self.follow::<S, true>(simd, rays, crossed);
    }

    /// Follows rays until they are dark, or whole ones to count crossings.
    #[inline(always)]
    fn follow<S: Simd, const CROSSINGS: bool>(&self, simd: S, rays: &Rays<S>, sums: &mut Lanes) {
        if self.nodes.is_empty() {
            return;
        }
        let dark = f32x16::splat(simd, if CROSSINGS { f32::MIN } else { DARK });
        let mut sum = f32x16::from_slice(simd, sums);
        let mut waiting = [0; WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let at = waiting[count] as usize;
            let node = &self.nodes[at];
            if node.count > 0 {
                let first = node.next as usize;
                for facet in &self.facets[first..first + node.count as usize] {
                    let (met, det) = met(simd, facet, rays);
                    let added = if CROSSINGS {
                        // Edges turn counter-clockwise as seen from the front.
                        sum - f32x16::splat(simd, det.signum())
                    } else {
                        sum * f32x16::splat(simd, 1.0 - facet.opacity)
                    };
                    sum = met.select(added, sum);
                }
                if !sum.simd_gt(dark).any_true() {
                    break;
                }
                continue;
            }
            let alive = sum.simd_gt(dark);
            for child in [node.next as usize + 1, node.next as usize] {
                if (is_met(simd, &self.nodes[child], rays) & alive).any_true() {
                    waiting[count] = index32(child);
                    count += 1;
                }
            }
        }
        sum.store_slice(sums);
    }
}

fn boxed((index, blocker): (usize, &Blocker)) -> Boxed {
    let [a, b, c] = blocker.corners;
    Boxed {
        low: a.min(b).min(c),
        high: a.max(b).max(c),
        index: index32(index),
    }
}

/// The rays that meet a box.
#[inline(always)]
fn is_met<S: Simd>(simd: S, node: &Node, rays: &Rays<S>) -> mask32x16<S> {
    let (low, high) = (node.low * rays.per_step, node.high * rays.per_step);
    let near = Vector::splat(simd, low.min(high));
    let far = Vector::splat(simd, low.max(high));
    let from = &rays.from_in_steps;
    let near = (near.x - from.x).max(near.y - from.y).max(near.z - from.z);
    let far = (far.x - from.x).min(far.y - from.y).min(far.z - from.z);
    near.max(f32x16::splat(simd, 0.0)).simd_le(far)
}

/// The rays that meet a triangle (Möller and Trumbore 1997), and a number that is above 0 if they meet its front.
#[inline(always)]
fn met<S: Simd>(simd: S, facet: &Facet, rays: &Rays<S>) -> (mask32x16<S>, f32) {
    let [a, b] = facet.edges;
    let across = rays.towards.cross(b);
    let det = a.dot(across);
    // Rays in the triangle's plane give infinite numbers and none, for which comparisons are false.
    let per_det = 1.0 / det;
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let corner = Vector::splat(simd, facet.corner);
    let from = Vector {
        x: rays.from.x - corner.x,
        y: rays.from.y - corner.y,
        z: rays.from.z - corner.z,
    };
    let u = from.dot(&Vector::splat(simd, across * per_det));
    let v = from.dot(&Vector::splat(simd, a.cross(rays.towards) * per_det));
    let distance = from.dot(&Vector::splat(simd, a.cross(b) * per_det));
    let inside = u.simd_ge(zero) & v.simd_ge(zero) & (u + v).simd_le(one) & distance.simd_gt(zero);
    (inside, det)
}

/// Fills `nodes`, whose first is the tree's `offset`-th, with the tree of some triangles, whose first is the `start`-th of all.
fn build(nodes: &mut [Node], offset: usize, boxed: &mut [Boxed], start: usize, depth: usize) {
    let (mut low, mut high) = (boxed[0].low, boxed[0].high);
    for one in &boxed[1..] {
        (low, high) = (low.min(one.low), high.max(one.high));
    }
    nodes[0] = Node {
        low,
        high,
        next: index32(start),
        count: index32(boxed.len()),
    };
    if boxed.len() <= LEAF {
        return;
    }
    let first = split(boxed, depth);
    let (nodes, rest) = nodes.split_at_mut(2 * first);
    nodes[0].count = 0;
    nodes[0].next = index32(offset + 2 * first);
    let is_large = boxed.len() >= PARALLEL;
    let (one, other) = boxed.split_at_mut(first);
    let mut one = || build(&mut nodes[1..], offset + 1, one, start, depth + 1);
    let mut other = || build(rest, offset + 2 * first, other, start + first, depth + 1);
    if is_large {
        rayon::join(one, other);
    } else {
        one();
        other();
    }
}

/// The nodes that are used, both halves of each beside each other: a tree of fewer lines of memory.
fn packed(nodes: &[Node]) -> Vec<Node> {
    let mut packed = vec![nodes[0]];
    // Nodes by their places in the new list and in the old one.
    let mut waiting = vec![(0, 0)];
    while let Some((new, old)) = waiting.pop() {
        if nodes[old].count > 0 {
            continue;
        }
        let (first, second) = (old + 1, nodes[old].next as usize);
        let at = packed.len();
        packed[new].next = index32(at);
        packed.extend([nodes[first], nodes[second]]);
        waiting.extend([(at + 1, second), (at, first)]);
    }
    packed
}

/// A bin of triangles.
#[derive(Clone, Copy)]
struct Bin {
    low: Vec3,
    high: Vec3,
    count: usize,
}

impl Bin {
    const EMPTY: Self = Self {
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
        count: 0,
    };

    fn with(self, other: &Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            count: self.count + other.count,
        }
    }

    /// Half the surface, times the number of triangles.
    fn cost(&self) -> f32 {
        let size = (self.high - self.low).max(Vec3::ZERO);
        (size.x * size.y + size.y * size.z + size.z * size.x) * self.count as f32
    }
}

/// Orders triangles so that those of the first half come first; gives how many these are.
fn split(boxed: &mut [Boxed], depth: usize) -> usize {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for one in boxed.iter() {
        (low, high) = (low.min(one.middle()), high.max(one.middle()));
    }
    let size = high - low;
    let axis = size.max_position();
    let half = boxed.len() / 2;
    let spread = size[axis];
    if depth >= BALANCED || !(spread > 0.0 && spread.is_finite()) {
        boxed.select_nth_unstable_by(half, |a, b| {
            let order = a.middle()[axis].total_cmp(&b.middle()[axis]);
            order.then(a.index.cmp(&b.index))
        });
        return half;
    }
    let per_bin = BINS as f32 / spread;
    let bin_of = |one: &Boxed| cell((one.middle()[axis] - low[axis]) * per_bin).min(BINS - 1);
    let mut bins = [Bin::EMPTY; BINS];
    for one in boxed.iter() {
        let bin = &mut bins[bin_of(one)];
        *bin = bin.with(&Bin {
            low: one.low,
            high: one.high,
            count: 1,
        });
    }
    let mut behind = [Bin::EMPTY; BINS];
    behind[BINS - 1] = bins[BINS - 1];
    for k in (0..BINS - 1).rev() {
        behind[k] = behind[k + 1].with(&bins[k]);
    }
    let (mut best, mut least, mut before) = (0, f32::INFINITY, Bin::EMPTY);
    for k in 0..BINS - 1 {
        before = before.with(&bins[k]);
        let cost = before.cost() + behind[k + 1].cost();
        if before.count > 0 && behind[k + 1].count > 0 && cost < least {
            (best, least) = (k, cost);
        }
    }
    // The first bin and the last have one each, so that there is a split.
    boxed.sort_by_key(|one| bin_of(one) > best);
    boxed.partition_point(|one| bin_of(one) <= best)
}
