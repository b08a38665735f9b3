//! The places of a mesh at which its light is found.
//!
//! Every triangle has a grid of places, as many to each of its sides as the light on it needs (mesh colours: Yuksel, Keyser and House
//! 2010); between them light is linear. Triangles that meet smoothly share the places on their edge. Where their grids differ, the finer one takes
//! the values of the coarser one there, so that no seam shows.
//!
//! Takes prepared meshes; gives places, to which `bake` adds their light, round by round, and grids of their indices.

use std::collections::HashMap;

use glam::Vec3;

use crate::light::blocked::grids::{Grid, Grids, MeshGrids, at, lift};
use crate::prepare::{LightKind, PreparedMaterial, PreparedMesh};
use crate::project::cull::Facing;
use resample_core::narrow::{cell, index32};
use resample_mesh::scene::Sides;

/// Most steps along a side of a grid: a power of 2.
const MOST_STEPS: u32 = 64;

/// Longest steps of the first grids, in diagonals of the scene, where triangles are large; and steps below which no grid is divided. Guesses: a
/// shadow narrower than the first may be missed, one narrower than the second is drawn wider.
const FIRST_STEP: f32 = 1.0 / 64.0;
const LEAST_STEP: f32 = 1.0 / 400.0;

/// Places of the first grids, if meshes have fewer corners. A guess: a third of a second of one thread.
const FIRST_PLACES: usize = 20_000;

/// Parts of the even sky's irradiance. A grid is divided where light bends by the first, a triangle without a grid where it
/// differs by the second from corner to corner.
const BEND: f32 = 0.02;
const DIFFERENCE: f32 = 0.12;

/// How often grids are divided.
pub(crate) const ROUNDS: usize = 4;

/// Places that division may add: this many, and half of those of the first grids. A guess: as much time as these.
const MOST_ADDED: usize = 25_000;

/// Faces around a corner without a normal share a place where their normals' cosine is at least this: about 40 degrees. A guess.
const SMOOTH: f32 = 0.77;

/// Parts of a step by which a place lies inside of its triangle, so that it is before walls that meet it there, and above it.
const INSIDE: f32 = 0.02;
const ABOVE: f32 = 0.002;

/// A place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// A little above the surface.
    pub(crate) position: Vec3,
    /// Of length 1.
    pub(crate) normal: Vec3,
    pub(crate) side: Facing,
}

/// A place whose light is the mix of two others': that many parts of the second.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mixed {
    pub(crate) of: [u32; 2],
    pub(crate) share: f32,
}

/// A corner of triangles that meet smoothly.
#[derive(Clone, Copy)]
struct Corner {
    position: Vec3,
    normal: Vec3,
    /// The middle of its first triangle.
    inside: Vec3,
    side: Facing,
}

/// A side of a triangle with its grid.
struct Face {
    mesh: usize,
    side: usize,
    triangle: usize,
    corners: [u32; 3],
    steps: u32,
    longest: f32,
    places: Vec<u32>,
}

/// A place on an edge: its ends' corners, the smaller first, and the share of the second in lowest terms.
type OnEdge = (u32, u32, u32, u32);

/// Faces, corners and places as they grow.
pub(crate) struct Builder {
    corners: Vec<Corner>,
    faces: Vec<Face>,
    pub(crate) places: Vec<Place>,
    on_edges: HashMap<OnEdge, u32>,
    by_corner: HashMap<u32, u32>,
    diagonal: f32,
    /// Places of the first grids.
    first: usize,
}

impl Builder {
    /// The first grids of every mesh whose light can be blocked.
    pub(crate) fn new(
        meshes: &[PreparedMesh],
        materials: &[PreparedMaterial],
        diagonal: f32,
    ) -> Self {
        let mut builder = Self {
            corners: Vec::new(),
            faces: Vec::new(),
            places: Vec::new(),
            on_edges: HashMap::new(),
            by_corner: HashMap::new(),
            diagonal,
            first: 0,
        };
        for (index, mesh) in meshes.iter().enumerate() {
            let material = &materials[mesh.material];
            if material.light != LightKind::Physical {
                continue;
            }
            let sides = if material.sides == Sides::Both { 2 } else { 1 };
            (0..sides).for_each(|side| builder.add(index, mesh, side));
        }
        let step = builder.first_step();
        for face in 0..builder.faces.len() {
            builder.grow(face, builder.faces[face].steps_of(step));
        }
        builder.first = builder.places.len();
        builder
    }

    fn add(&mut self, index: usize, mesh: &PreparedMesh, side: usize) {
        let flip = [1.0, -1.0][side];
        let mut known: HashMap<[u32; 3], Vec<u32>> = HashMap::new();
        for (triangle, ids) in mesh.triangles.iter().enumerate() {
            let positions = ids.map(|i| Vec3::from(mesh.positions[i as usize]));
            let [a, b, c] = positions;
            let flat = (b - a).cross(c - a).normalize_or_zero() * flip;
            if flat == Vec3::ZERO {
                // A triangle without area shows nothing.
                self.faces.push(Face::empty(index, side, triangle));
                continue;
            }
            let middle = (a + b + c) / 3.0;
            let corners = [0, 1, 2].map(|k: usize| {
                let own = mesh.normals.get(ids[k] as usize);
                let own = own.map_or(Vec3::ZERO, |n| Vec3::from(*n).normalize_or_zero() * flip);
                let (normal, least) = match own == Vec3::ZERO {
                    true => (flat, SMOOTH),
                    false => (own, 0.9999),
                };
                let key = positions[k].to_array().map(|x| (x + 0.0).to_bits());
                let list = known.entry(key).or_default();
                let found = list
                    .iter()
                    .find(|&&i| self.corners[i as usize].normal.dot(normal) >= least);
                let corner = *found.unwrap_or(&index32(self.corners.len()));
                if corner as usize == self.corners.len() {
                    list.push(corner);
                    self.corners.push(Corner {
                        position: positions[k],
                        normal,
                        inside: middle,
                        side: [Facing::Front, Facing::Back][side],
                    });
                }
                corner
            });
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            self.faces.push(Face {
                mesh: index,
                side,
                triangle,
                corners,
                steps: 0,
                longest,
                places: Vec::new(),
            });
        }
    }

    /// Longest steps of the first grids: longer ones where there would be too many places.
    fn first_step(&self) -> f32 {
        let most = FIRST_PLACES.max(2 * self.corners.len());
        let mut step = FIRST_STEP * self.diagonal;
        // Places within a face, half of those on its edges and a sixth of those at its corners.
        let places = |step: f32| {
            self.faces
                .iter()
                .map(|face| face.steps_of(step).pow(2) as usize / 2)
                .sum::<usize>()
        };
        while places(step) > most && step < self.diagonal {
            step *= 1.5;
        }
        step
    }

    /// Gives a face a grid of so many steps.
    fn grow(&mut self, index: usize, steps: u32) {
        let face = &self.faces[index];
        if face.longest == 0.0 {
            return;
        }
        let corners = face.corners;
        let mut places = Vec::with_capacity(((steps + 1) * (steps + 2) / 2) as usize);
        for j in 0..=steps {
            for i in 0..=steps - j {
                places.push(self.place(corners, steps, [i, j, steps - i - j]));
            }
        }
        let face = &mut self.faces[index];
        (face.steps, face.places) = (steps, places);
    }

    /// The place so many steps towards each corner.
    fn place(&mut self, corners: [u32; 3], steps: u32, towards: [u32; 3]) -> u32 {
        let next = index32(self.places.len());
        let on: Vec<usize> = (0..3).filter(|&k| towards[k] > 0).collect();
        let known = match on[..] {
            [k] => *self.by_corner.entry(corners[k]).or_insert(next),
            [k, l] => {
                let key = on_edge((corners[k], corners[l]), towards[l], steps);
                *self.on_edges.entry(key).or_insert(next)
            }
            _ => next,
        };
        if known == next {
            self.places.push(self.found(corners, steps, towards));
        }
        known
    }

    fn found(&self, corners: [u32; 3], steps: u32, towards: [u32; 3]) -> Place {
        let corners = corners.map(|i| &self.corners[i as usize]);
        let shares = towards.map(|t| t as f32 / steps as f32);
        let mix =
            |of: fn(&Corner) -> Vec3| (0..3).map(|k| of(corners[k]) * shares[k]).sum::<Vec3>();
        let position = mix(|corner| corner.position);
        let normal = mix(|corner| corner.normal).normalize_or(corners[0].normal);
        let middle = match towards.iter().position(|&t| t == steps) {
            Some(corner) => corners[corner].inside,
            None => corners.iter().map(|corner| corner.position).sum::<Vec3>() / 3.0,
        };
        // Within the plane of a triangle: a step within the plane of the mean normal would lead below a surface that curves inwards.
        let inward = (middle - position) * (INSIDE / steps as f32);
        let step = (middle - position).length() / steps as f32;
        let above = (ABOVE * step)
            .min(1e-4 * self.diagonal)
            .max(1e-6 * self.diagonal);
        let place =
            position + inward + lift(position, corners.map(|c| (c.position, c.normal)), shares);
        Place {
            position: place + normal * above,
            normal,
            side: corners[0].side,
        }
    }

    /// Divides the grids between whose places light bends most, by its brightness at each place; false where nothing is left to divide.
    pub(crate) fn divide(&mut self, brightness: &[f32]) -> bool {
        let bent = |(index, face): (usize, &Face)| {
            let step = face.longest / face.steps.max(1) as f32;
            let is_divisible =
                face.steps > 0 && face.steps < MOST_STEPS && step > LEAST_STEP * self.diagonal;
            is_divisible.then(|| (face.bend(brightness), index))
        };
        let mut bent: Vec<(f32, usize)> = self.faces.iter().enumerate().filter_map(bent).collect();
        bent.retain(|(bend, _)| *bend > 1.0);
        bent.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let most = self.first * 3 / 2 + MOST_ADDED;
        let before = self.places.len();
        for (_, index) in bent {
            if self.places.len() >= most {
                break;
            }
            self.grow(index, 2 * self.faces[index].steps);
        }
        self.places.len() > before
    }

    /// The grids, and the places on edges that take the values of coarser grids beside them; these follow all others.
    pub(crate) fn finish(mut self, meshes: usize) -> (Grids, Vec<Mixed>) {
        let mut least: HashMap<(u32, u32), u32> = HashMap::new();
        for face in self.faces.iter().filter(|face| face.steps > 0) {
            for k in 0..3 {
                let (a, b) = (face.corners[k], face.corners[(k + 1) % 3]);
                let steps = least.entry((a.min(b), a.max(b))).or_insert(face.steps);
                *steps = face.steps.min(*steps);
            }
        }
        let mut mixed = Vec::new();
        let first = index32(self.places.len());
        for face in &mut self.faces {
            for k in 0..3 {
                let l = (k + 1) % 3;
                let (a, b) = (face.corners[k], face.corners[l]);
                let Some(&coarse) = least.get(&(a.min(b), a.max(b))) else {
                    continue;
                };
                if face.steps <= coarse {
                    continue;
                }
                let per_step = face.steps / coarse;
                for step in (0..face.steps).filter(|step| !step.is_multiple_of(per_step)) {
                    let low = step / per_step * per_step;
                    let of = [low, low + per_step].map(|step| face.places[face.along(k, l, step)]);
                    let share = (step - low) as f32 / per_step as f32;
                    let place = face.along(k, l, step);
                    face.places[place] = first + index32(mixed.len());
                    mixed.push(Mixed { of, share });
                }
            }
        }
        let mut grids = Grids {
            meshes: vec![MeshGrids::default(); meshes],
            indices: Vec::new(),
        };
        for face in self.faces {
            let of_side = &mut grids.meshes[face.mesh].grids[face.side];
            debug_assert_eq!(of_side.len(), face.triangle);
            of_side.push(Grid {
                start: index32(grids.indices.len()),
                steps: face.steps,
            });
            grids.indices.extend(face.places);
        }
        (grids, mixed)
    }
}

impl Face {
    fn empty(mesh: usize, side: usize, triangle: usize) -> Self {
        Self {
            mesh,
            side,
            triangle,
            corners: [u32::MAX; 3],
            steps: 0,
            longest: 0.0,
            places: Vec::new(),
        }
    }

    /// Where the place lies that is so many steps from corner `k` to corner `l`.
    fn along(&self, k: usize, l: usize, step: u32) -> usize {
        let mut towards = [0; 3];
        (towards[k], towards[l]) = (self.steps - step, step);
        at(self.steps, towards[0], towards[1]) as usize
    }

    /// How many steps make none longer than `step`, if that is not too many.
    fn steps_of(&self, step: f32) -> u32 {
        let steps = index32(cell((self.longest / step).ceil()));
        steps.clamp(1, MOST_STEPS).next_power_of_two()
    }

    /// How far light is from linear between places: above 1, too far.
    fn bend(&self, brightness: &[f32]) -> f32 {
        let of = |i: u32, j: u32| brightness[self.places[at(self.steps, i, j) as usize] as usize];
        if self.steps == 1 {
            let [a, b, c] = [of(0, 0), of(1, 0), of(0, 1)];
            return (a.max(b).max(c) - a.min(b).min(c)) / DIFFERENCE;
        }
        let mut most = 0.0_f32;
        let mut bent = |a: f32, b: f32, c: f32| most = most.max((a + c - 2.0 * b).abs());
        for j in 0..=self.steps {
            for i in 0..=self.steps - j {
                let k = self.steps - i - j;
                if i > 0 && k > 0 {
                    bent(of(i - 1, j), of(i, j), of(i + 1, j));
                }
                if j > 0 && k > 0 {
                    bent(of(i, j - 1), of(i, j), of(i, j + 1));
                }
                if i > 0 && j > 0 {
                    bent(of(i - 1, j + 1), of(i, j), of(i + 1, j - 1));
                }
            }
        }
        most / BEND
    }
}

fn on_edge((from, to): (u32, u32), step: u32, steps: u32) -> OnEdge {
    let (low, high, step) = if from < to {
        (from, to, step)
    } else {
        (to, from, steps - step)
    };
    let halvings = step.trailing_zeros().min(steps.trailing_zeros());
    (low, high, step >> halvings, steps >> halvings)
}
