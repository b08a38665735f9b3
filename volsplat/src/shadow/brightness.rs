//! The mean light of the matter that can be seen, over views along both directions of the three axes of the grid.

use glam::DVec3;
use rayon::prelude::*;
use resample_core::narrow::{count, whole};

use crate::bricks::cells::{CellField, Table};
use crate::look::clip::GridClip;
use crate::shadow::medium::Medium;
use crate::shadow::places::Places;
use crate::shadow::slices::VertexBox;

/// Most rays along a side of a view. So few that a view costs little; the mean of six views of 64 x 64 rays is known to about 0.3 %.
const MOST_RAYS: usize = 64;

/// The golden ratio's fraction: multiples of it are spread evenly.
const GOLDEN: f32 = 0.618_034;

/// Parts of the way between two vertices: light and matter change steeply in surfaces.
const PARTS: usize = 8;

/// The matter that is seen, and the light on it.
pub(super) struct Lit<'a> {
    pub(super) field: &'a CellField,
    pub(super) places: &'a Places,
    /// For each brick, the numbers at its vertices.
    pub(super) numbers: &'a [Table],
    pub(super) medium: &'a Medium,
    pub(super) clip: &'a GridClip,
    /// For each brick, the share of light at its vertices.
    pub(super) shares: &'a [Table],
    /// From a vertex to the next along each axis, opacity units.
    pub(super) spacing: [f32; 3],
}

impl Lit<'_> {
    /// The mean share over what six views see, in which each place counts as it does in their pictures; 1 where nothing is seen.
    pub(super) fn mean_seen(&self) -> f64 {
        let Some(within) = VertexBox::of(self.field) else {
            return 1.0;
        };
        let mut sum = Seen::default();
        for along in 0..3 {
            let sides = [1, 2].map(|side| within.len((along + side) % 3));
            let rays = sides.map(|side| side.min(MOST_RAYS));
            let of_ray = |ray: usize| {
                let mut first = within.low;
                let mut share = [0.0; 2];
                for (side, number) in [ray % rays[0], ray / rays[0]].into_iter().enumerate() {
                    let pitch = (sides[side] - 1) as f32 / rays[side] as f32;
                    // Somewhere between vertices, another place for each ray.
                    let jitter = (GOLDEN * (ray + side * rays[0]) as f32).fract();
                    let at = (number as f32 + jitter) * pitch;
                    let vertex = count(whole(f64::from(at))).min(sides[side].saturating_sub(2));
                    first[(along + 1 + side) % 3] += vertex;
                    share[side] = at - vertex as f32;
                }
                self.both_ways(&within, (first, along), share)
            };
            let seen: Vec<Seen> = (0..rays[0] * rays[1]).into_par_iter().map(of_ray).collect();
            // Pixels are as large in each view.
            let area_of_ray = [0, 1].map(|side| {
                let pitch = sides[side].saturating_sub(1) as f64 / rays[side] as f64;
                pitch * f64::from(self.spacing[(along + 1 + side) % 3])
            });
            let area = area_of_ray[0] * area_of_ray[1];
            for ray in seen {
                sum.opacity += area * ray.opacity;
                sum.light += area * ray.light;
            }
        }
        if sum.opacity > 0.0 {
            sum.light / sum.opacity
        } else {
            1.0
        }
    }

    /// A ray along an axis, and the one that comes back.
    fn both_ways(
        &self,
        within: &VertexBox,
        (first, along): ([usize; 3], usize),
        share: [f32; 2],
    ) -> Seen {
        let across = [1, 2].map(|side| (along + side) % 3);
        let at_vertex = |at: [usize; 3]| {
            let found = self.places.of_vertex(self.field, at);
            found.map_or([f32::NAN; 2], |[brick, place]| {
                let root = self.shares[brick][place].sqrt();
                [self.numbers[brick][place], root]
            })
        };
        let between = |number: usize| {
            let corners = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|beside| {
                let mut at = first;
                at[along] += number;
                for side in 0..2 {
                    let axis = across[side];
                    at[axis] = (at[axis] + beside[side]).min(within.high[axis]);
                }
                at_vertex(at)
            });
            [0, 1].map(|part| {
                let mix = |from: f32, to: f32, share: f32| from + share * (to - from);
                let [a, b, c, d] = corners.map(|corner| corner[part]);
                mix(mix(a, b, share[0]), mix(c, d, share[0]), share[1])
            })
        };
        let vertices: Vec<[f32; 2]> = (0..within.len(along)).map(between).collect();
        let mut origin = DVec3::from(first.map(|at| at as f64));
        for side in 0..2 {
            origin[across[side]] += f64::from(share[side]);
        }
        origin[along] = within.low[along] as f64;
        let kept = self.clip.interval(origin, DVec3::AXES[along]);
        let length = self.spacing[along];
        let mut seen = Seen::default();
        let mut parts = Vec::new();
        for (number, ends) in vertices.windows(2).enumerate() {
            let [[from, root_from], [to, root_to]] = [ends[0], ends[1]];
            if from.is_nan() || to.is_nan() {
                continue;
            }
            for part in 0..PARTS {
                let share = |part: usize| part as f32 / PARTS as f32;
                let at = |part: usize| from + share(part) * (to - from);
                let middle = share(part) + 0.5 * share(1);
                if !(kept[0]..=kept[1]).contains(&(number as f64 + f64::from(middle))) {
                    continue;
                }
                let depth = self.medium.mean(at(part), at(part + 1)) * length * share(1);
                if depth > 0.0 {
                    let root = root_from + middle * (root_to - root_from);
                    parts.push([depth, root * root].map(f64::from));
                }
            }
        }
        seen.add_ray(parts.iter());
        seen.add_ray(parts.iter().rev());
        seen
    }
}

/// Sums over pixels.
#[derive(Default)]
struct Seen {
    opacity: f64,
    /// Opacity times light.
    light: f64,
}

impl Seen {
    /// Adds a ray of parts, each with its optical depth and its light.
    fn add_ray<'a>(&mut self, parts: impl Iterator<Item = &'a [f64; 2]>) {
        let mut transmittance = 1.0;
        for &[depth, light] in parts {
            let opacity = transmittance * -(-depth).exp_m1();
            self.opacity += opacity;
            self.light += opacity * light;
            transmittance -= opacity;
            if transmittance < 1e-3 {
                break;
            }
        }
    }
}
