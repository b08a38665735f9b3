//! The mean light of the matter that can be seen, over views along both directions of the three axes of the grid.

use glam::DVec3;
use rayon::prelude::*;
use resample_core::light::{AMBIENT, DIFFUSE};
use resample_core::narrow::{count, whole};

use crate::look::clip::GridClip;
use crate::shadow::medium::Medium;
use crate::shadow::vertices::Vertices;
use crate::slabs::table::TransferTable;

/// Most rays along a side of a view. So few that a view costs little; the mean of six views of 48 x 48 rays is known to about 0.4 %.
const MOST_RAYS: usize = 48;

/// Rays end where less than this is left.
const LEAST: f64 = 1e-3;

/// The golden ratio's fraction: multiples of it are spread evenly.
const GOLDEN: f32 = 0.618_034;

/// Parts of the way between two vertices: light and matter change steeply in surfaces.
const PARTS: usize = 8;

/// Optical depth up to which such a way is one part: light that falls off evenly within it is right to a hundredth of that.
const THIN: f32 = 0.125;

/// How the light falls that the sky's share dims.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Falls {
    /// Alike on all surfaces.
    Evenly,
    /// From the eye: less on surfaces that are seen from the side.
    FromEye,
}

/// The matter that is seen, and the light on it.
pub(super) struct Lit<'a> {
    pub(super) vertices: &'a Vertices<'a>,
    pub(super) numbers: &'a [f32],
    pub(super) medium: &'a Medium,
    /// The colours of the numbers, where they are scalars.
    pub(super) colours: Option<&'a TransferTable>,
    pub(super) falls: Falls,
    pub(super) clip: &'a GridClip,
    /// Square roots of the share of light at the vertices.
    pub(super) roots: &'a [f32],
    /// From a vertex to the next along each axis, opacity units.
    pub(super) spacing: [f32; 3],
}

impl Lit<'_> {
    /// The mean share over what six views see, in which each place counts by its opacity and its brightness, as it does in their pictures; 1
    /// where nothing is seen.
    pub(super) fn mean_seen(&self) -> f64 {
        let within = self.vertices.within;
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
                self.both_ways(first, along, share)
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
    fn both_ways(&self, first: [usize; 3], along: usize, share: [f32; 2]) -> Seen {
        let within = self.vertices.within;
        let across = [1, 2].map(|side| (along + side) % 3);
        let mut origin = DVec3::from(first.map(|at| at as f64));
        for side in 0..2 {
            origin[across[side]] += f64::from(share[side]);
        }
        origin[along] = within.low[along] as f64;
        let ray = Ray {
            first,
            along,
            across,
            share,
            kept: self.clip.interval(origin, DVec3::AXES[along]),
        };
        let steps = within.len(along) - 1;
        let mut seen = Seen::default();
        let mut parts = Vec::new();
        let mut transmittance = 1.0;
        let mut from = self.vertex(&ray, 0);
        for number in 0..steps {
            let to = self.vertex(&ray, number + 1);
            let known = parts.len();
            self.add_parts(&ray, number, [&from, &to], &mut parts);
            seen.add(parts[known..].iter(), &mut transmittance);
            if transmittance < LEAST {
                break;
            }
            from = to;
        }
        let is_whole = transmittance >= LEAST;
        transmittance = 1.0;
        if is_whole {
            seen.add(parts.iter().rev(), &mut transmittance);
            return seen;
        }
        let mut to = self.vertex(&ray, steps);
        for number in (0..steps).rev() {
            let from = self.vertex(&ray, number);
            parts.clear();
            self.add_parts(&ray, number, [&from, &to], &mut parts);
            seen.add(parts.iter().rev(), &mut transmittance);
            if transmittance < LEAST {
                break;
            }
            to = from;
        }
        seen
    }

    /// The place of a ray in a slice.
    fn vertex(&self, ray: &Ray, number: usize) -> Vertex {
        let within = &self.vertices.within;
        let mut corners = [[f32::NAN; 2]; 4];
        for (beside, corner) in corners.iter_mut().enumerate() {
            let mut at = ray.first;
            at[ray.along] += number;
            for side in 0..2 {
                let axis = ray.across[side];
                at[axis] = (at[axis] + (beside >> side & 1)).min(within.high[axis]);
            }
            let Some(found) = self.vertices.find(at) else {
                return Vertex::HIDDEN;
            };
            *corner = [self.numbers[found], self.roots[found]];
        }
        let [x, y] = ray.share;
        let mix = |from: f32, to: f32, share: f32| from + share * (to - from);
        let [[a, root_a], [b, root_b], [c, root_c], [d, root_d]] = corners;
        let slopes = [mix(b - a, d - c, y), mix(c - a, d - b, x)];
        Vertex {
            number: mix(mix(a, b, x), mix(c, d, x), y),
            root: mix(mix(root_a, root_b, x), mix(root_c, root_d, x), y),
            slopes: [0, 1].map(|side: usize| slopes[side] / self.spacing[ray.across[side]]),
        }
    }

    /// Adds the parts between two slices that absorb light.
    fn add_parts(&self, ray: &Ray, number: usize, ends: [&Vertex; 2], parts: &mut Vec<[f64; 3]>) {
        let (from, to) = (ends[0].number, ends[1].number);
        let length = self.spacing[ray.along];
        if from.is_nan() || to.is_nan() {
            return;
        }
        let whole = self.medium.mean(from, to) * length;
        if whole <= 0.0 {
            return;
        }
        let parts_of_way = if whole < THIN { 1 } else { PARTS };
        let lit = self.lit(ends, length);
        for part in 0..parts_of_way {
            let share = |part: usize| part as f32 / parts_of_way as f32;
            let at = |part: usize| from + share(part) * (to - from);
            let middle = share(part) + 0.5 * share(1);
            if !(ray.kept[0]..=ray.kept[1]).contains(&(number as f64 + f64::from(middle))) {
                continue;
            }
            let depth = self.medium.mean(at(part), at(part + 1)) * length * share(1);
            if depth > 0.0 {
                let root = ends[0].root + middle * (ends[1].root - ends[0].root);
                let brightness = lit * self.luminance(from + middle * (to - from));
                parts.push([depth, root * root, brightness].map(f64::from));
            }
        }
    }

    /// The light on the matter between two vertices of a ray.
    fn lit(&self, ends: [&Vertex; 2], length: f32) -> f32 {
        if self.falls == Falls::Evenly {
            return 1.0;
        }
        let along = (ends[1].number - ends[0].number) / length;
        let across = [0, 1].map(|side| 0.5 * (ends[0].slopes[side] + ends[1].slopes[side]));
        let slope = (along * along + across[0] * across[0] + across[1] * across[1]).sqrt();
        let cos = if slope > 0.0 {
            along.abs() / slope
        } else {
            1.0
        };
        AMBIENT + DIFFUSE * cos
    }

    fn luminance(&self, number: f32) -> f32 {
        self.colours.map_or(1.0, |table| {
            let [red, green, blue, _] = table.at(number);
            0.2126 * red + 0.7152 * green + 0.0722 * blue
        })
    }
}

/// A ray along an axis of the grid.
struct Ray {
    /// The vertex before its first place, and how far on that place is across the ray.
    first: [usize; 3],
    share: [f32; 2],
    along: usize,
    across: [usize; 2],
    /// The slices that a clip keeps.
    kept: [f64; 2],
}

/// A place of a ray among the vertices around it.
#[derive(Clone, Copy)]
struct Vertex {
    number: f32,
    /// Square root of the share of light.
    root: f32,
    /// Of the number across the ray, per opacity unit.
    slopes: [f32; 2],
}

impl Vertex {
    /// Where nothing is shown.
    const HIDDEN: Self = Self {
        number: f32::NAN,
        root: f32::NAN,
        slopes: [f32::NAN; 2],
    };
}

/// Sums over pixels.
#[derive(Default)]
struct Seen {
    /// Opacity times brightness without occlusion.
    opacity: f64,
    /// The same, times light.
    light: f64,
}

impl Seen {
    /// Adds parts of a ray, each with its optical depth, its light, and its brightness.
    fn add<'a>(&mut self, parts: impl Iterator<Item = &'a [f64; 3]>, transmittance: &mut f64) {
        for &[depth, light, brightness] in parts {
            let opacity = *transmittance * -(-depth).exp_m1();
            self.opacity += opacity * brightness;
            self.light += opacity * brightness * light;
            *transmittance -= opacity;
            if *transmittance < LEAST {
                break;
            }
        }
    }
}
