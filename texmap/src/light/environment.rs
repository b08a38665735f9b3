//! The light around the scene, prepared for look-ups: as it is, and blurred by each roughness.
//!
//! Takes a formula or an equirectangular picture; gives octahedral maps of radiance, one for each of [`LEVELS`] roughnesses,
//! each seen through the GGX lobe of a surface that is looked at along its normal (Karis 2013); the irradiance of matt
//! surfaces in nine spherical harmonics (Ramamoorthi and Hanrahan 2001); and the table of reflectance. A lobe's mean is
//! taken from copies of the map that are as coarse as its samples are apart (Křivánek and Colbert 2008).
//!
//! Small bright lights are kept apart (`suns`). Limits: a lobe in blurred light does not stretch at grazing angles; light comes from infinitely far away.

use glam::{Quat, Vec3, Vec4};
use rayon::prelude::*;
use resample_mesh::scene::Surroundings;

use crate::light::around::{Blurred, LEVELS, direction_of_texel, folded, square_from_direction};
use crate::light::reflectance::{Reflectance, half_vector, visibility};
use crate::light::suns::{self, Sun};
use crate::options::Shadows;

/// Texels along the sides of the maps: a lobe spans a few texels of its own.
const SIDES: [usize; LEVELS] = [256, 256, 128, 128, 64, 64, 32, 32, 32, 32, 32, 32, 32];

/// Samples of a lobe: narrow lobes are covered by few.
const SAMPLES: [usize; LEVELS] = [0, 24, 64, 96, 128, 128, 128, 128, 128, 128, 128, 128, 128];

/// The first level that lacks small bright lights: its lobe is some times wider than they are, and those before it show them as they are.
pub(crate) const WITHOUT_SUNS: usize = 2;

/// Texels along the side of the sharpest map of a picture: finer than a screen shows of a mirrored room.
const PICTURE_SIDE: usize = 512;

/// The light around the scene.
#[derive(Clone, Debug)]
pub(crate) struct Environment {
    /// Radiance by roughness, the smoothest first.
    pub(crate) blurred: Blurred,
    /// Irradiance over pi of a surface with normal (x, y, z) is the sum of these times 1, x, y, z, xy, yz, zx,
    /// 3 y^2 - 1, z^2 - x^2.
    pub(crate) irradiance: [Vec3; 9],
    pub(crate) reflectance: Reflectance,
    /// Lights that are not in the levels from [`WITHOUT_SUNS`] on.
    pub(crate) suns: Vec<Sun>,
    /// All light but theirs, where something may block it.
    pub(crate) sky: Option<Map>,
}

/// Radiance on the octahedral square, with a border of one texel.
#[derive(Clone, Debug)]
pub(crate) struct Map {
    /// Texels along a side, without the border.
    pub(crate) side: usize,
    /// Rows of `side` + 2 texels.
    pub(crate) texels: Vec<Vec4>,
}

impl Environment {
    /// The built-in studio, or the surroundings of a picture, turned about +y by an angle in radians.
    pub(crate) fn new(picture: Option<&Surroundings>, turn_rad: f32, shadows: Shadows) -> Self {
        let turn = Quat::from_rotation_y(-turn_rad);
        let coarser = Map::sharp(picture, turn).with_coarser();
        let mut without = None;
        let mut suns = Vec::new();
        if let Some((found, rest)) = picture.and_then(suns::extract_suns) {
            suns = found;
            suns.iter_mut()
                .for_each(|sun| sun.direction = turn.inverse() * sun.direction);
            without = Some(Map::sharp(Some(&rest), turn).with_coarser());
        }
        let irradiance = irradiance(
            coarser
                .iter()
                .find(|map| map.side <= 64)
                .unwrap_or(&coarser[0]),
        );
        let sky = (shadows != Shadows::None).then(|| {
            let maps = without.as_ref().unwrap_or(&coarser);
            // Cells of a sky are as large as the texels of this map.
            let map = maps.iter().find(|map| map.side <= 128);
            map.unwrap_or(&maps[0]).clone()
        });
        let of_level = |level: usize| match &without {
            Some(without) if level >= WITHOUT_SUNS => without,
            _ => &coarser,
        };
        let maps: Vec<Map> = (1..LEVELS)
            .map(|level| blurred(of_level(level), level))
            .collect();
        let mut levels = Blurred::default();
        let mut own = &coarser[0];
        for next in &maps {
            levels.push(own.side, own.with(next));
            own = next;
        }
        Self {
            blurred: levels,
            irradiance,
            reflectance: Reflectance::new(),
            suns,
            sky,
        }
    }
}

impl Map {
    /// The studio, or a picture, as it is.
    fn sharp(picture: Option<&Surroundings>, turn: Quat) -> Self {
        match picture {
            None => Self::new(SIDES[0], |d| radiance(turn * d)),
            Some(picture) => {
                // As many looks at the picture as it has pixels in a texel.
                let side = (2 * picture.height.next_power_of_two()).clamp(64, PICTURE_SIDE);
                let looks = picture.height.div_ceil(side).clamp(2, 8);
                Self::fine(side, looks, |d| seen(picture, turn * d))
            }
        }
    }

    /// Its texels, and what another map has at their places.
    fn with<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = [Vec4; 2]> + 'a {
        let (side, stride) = (self.side, self.side + 2);
        (0..stride * stride).map(move |at| {
            if other.side == side {
                return [self.texels[at], other.texels[at]];
            }
            let inside = folded([at % stride, at / stride].map(|k| k as isize - 1), side);
            let direction = direction_of_texel(inside, side).normalize();
            [self.texels[at], other.at(direction)]
        })
    }

    /// The map and its ever coarser copies.
    fn with_coarser(self) -> Vec<Self> {
        let mut coarser = vec![self];
        while let Some(next) = coarser.last().filter(|map| map.side > 4).map(Self::halved) {
            coarser.push(next);
        }
        coarser
    }

    /// A map with the given radiance at texels' centres.
    fn new(side: usize, radiance: impl Fn(Vec3) -> Vec3 + Sync) -> Self {
        let stride = side + 2;
        let texel = |at: usize| {
            let inside = folded([at % stride, at / stride].map(|k| k as isize - 1), side);
            radiance(direction_of_texel(inside, side).normalize()).extend(0.0)
        };
        let texels = (0..stride * stride).into_par_iter().map(texel).collect();
        Self { side, texels }
    }

    /// As [`Map::new`], with the mean of `looks` times `looks` places in each texel.
    fn fine(side: usize, looks: usize, radiance: impl Fn(Vec3) -> Vec3 + Sync) -> Self {
        Self::new(side, |middle| {
            let [x, y] = square_from_direction(middle);
            let step = 2.0 / (side * looks) as f32;
            let place = |at: f32, k: usize| at + (k as f32 + 0.5 - 0.5 * looks as f32) * step;
            let mut sum = Vec3::ZERO;
            for k in 0..looks * looks {
                let at = [place(x, k % looks), place(y, k / looks)];
                sum += radiance(super::around::direction_from_square(at).normalize());
            }
            sum / (looks * looks) as f32
        })
    }

    /// The mean of two by two texels.
    fn halved(&self) -> Self {
        let stride = self.side + 2;
        let side = self.side / 2;
        let texel = |[x, y]: [usize; 2]| {
            let first = (2 * y + 1) * stride + 2 * x + 1;
            let rows = [first, first + stride];
            rows.iter()
                .map(|&at| self.texels[at] + self.texels[at + 1])
                .sum::<Vec4>()
                * 0.25
        };
        let all = 0..(side + 2) * (side + 2);
        let texels = all.map(|at| {
            let place = [at % (side + 2), at / (side + 2)].map(|k| k as isize - 1);
            texel(folded(place, side))
        });
        Self {
            side,
            texels: texels.collect(),
        }
    }

    /// The mix of the four texels around a direction.
    pub(crate) fn at(&self, direction: Vec3) -> Vec4 {
        let [x, y] =
            square_from_direction(direction).map(|at| (at * 0.5 + 0.5) * self.side as f32 + 0.5);
        let last = self.side as f32;
        let (x0, y0) = (x.floor().clamp(0.0, last), y.floor().clamp(0.0, last));
        let first = y0 as usize * (self.side + 2) + x0 as usize;
        let row = |at: usize| self.texels[at].lerp(self.texels[at + 1], x - x0);
        row(first).lerp(row(first + self.side + 2), y - y0)
    }
}

/// The radiance that a lobe of a level's roughness sees, for every direction.
fn blurred(maps: &[Map], level: usize) -> Map {
    let roughness = level as f32 / (LEVELS - 1) as f32;
    let alpha = roughness * roughness;
    let count = SAMPLES[level];
    // Solid angle of a texel of the sharpest map, on the mean.
    let texel = 4.0 * std::f32::consts::PI / (maps[0].side * maps[0].side) as f32;
    let mut lobe = Vec::new();
    for k in 0..count {
        let half = half_vector(k, count, alpha);
        let light = 2.0 * half.z * half - Vec3::Z;
        if light.z <= 0.0 {
            continue;
        }
        let spread = 1.0 + half.z * half.z * (alpha * alpha - 1.0);
        let density = alpha * alpha / (4.0 * std::f32::consts::PI * spread * spread);
        let apart = 1.0 / (count as f32 * density);
        // What reaches the eye along the normal, over the density.
        let weight = 4.0 * visibility(light.z, 1.0, alpha) * light.z;
        lobe.push((light, weight, 0.5 * (apart / texel).log2()));
    }
    Map::new(SIDES[level], |normal| {
        let (side, above) = normal.any_orthonormal_pair();
        let (mut sum, mut whole) = (Vec4::ZERO, 0.0);
        for &(light, weight, lod) in &lobe {
            let direction = light.x * side + light.y * above + light.z * normal;
            let lod = lod.clamp(0.0, (maps.len() - 1) as f32);
            let (first, share) = (lod as usize, lod.fract());
            let mut radiance = maps[first].at(direction);
            if share > 0.0 {
                radiance = radiance.lerp(maps[first + 1].at(direction), share);
            }
            sum += radiance * weight;
            whole += weight;
        }
        (sum / whole).truncate()
    })
}

/// Of the mean over the sphere: 1 / (mean of the basis' square) and the cosine's factors 1, 2/3, 1/4.
pub(crate) const FACTORS: [f32; 9] = [
    1.0,
    3.0 * 2.0 / 3.0,
    3.0 * 2.0 / 3.0,
    3.0 * 2.0 / 3.0,
    15.0 / 4.0,
    15.0 / 4.0,
    15.0 / 4.0,
    1.25 / 4.0,
    3.75 / 4.0,
];

/// See [`Environment::irradiance`]: the nine products with the cosine's own harmonics.
fn irradiance(map: &Map) -> [Vec3; 9] {
    let mut sums = [Vec3::ZERO; 9];
    let mut whole = 0.0;
    for at in 0..map.side * map.side {
        let [x, y] = [at % map.side, at / map.side];
        let place = direction_of_texel([x, y], map.side);
        // The square's area over the sphere's there.
        let solid = place.length().powi(-3);
        let direction = place.normalize();
        let radiance = map.texels[(y + 1) * (map.side + 2) + x + 1].truncate();
        whole += solid;
        for (sum, basis) in sums.iter_mut().zip(basis(direction)) {
            *sum += radiance * (solid * basis);
        }
    }
    let mut scaled = sums;
    for (sum, factor) in scaled.iter_mut().zip(FACTORS) {
        *sum *= factor / whole;
    }
    scaled
}

pub(crate) fn basis(d: Vec3) -> [f32; 9] {
    [
        1.0,
        d.x,
        d.y,
        d.z,
        d.x * d.y,
        d.y * d.z,
        d.z * d.x,
        3.0 * d.y * d.y - 1.0,
        d.z * d.z - d.x * d.x,
    ]
}

/// Radiance of the picture in a direction of unit length, bilinear.
fn seen(picture: &Surroundings, d: Vec3) -> Vec3 {
    let (width, height) = (picture.width as isize, picture.height as isize);
    let across = (d.x.atan2(-d.z) / std::f32::consts::TAU + 0.5) * width as f32 - 0.5;
    let down = d.y.clamp(-1.0, 1.0).acos() / std::f32::consts::PI * height as f32 - 0.5;
    let (x0, y0) = (across.floor(), down.floor());
    let texel = |x: isize, y: isize| {
        let row = y.clamp(0, height - 1);
        Vec3::from(picture.rgb[(row * width + x.rem_euclid(width)) as usize])
    };
    let (x, y) = (x0 as isize, y0 as isize);
    let row = |y: isize| texel(x, y).lerp(texel(x + 1, y), across - x0);
    row(y).lerp(row(y + 1), down - y0)
}

// The built-in surroundings: a neutral studio, grey walls with soft lamps.
//
// A formula, so that it has no file. Every lamp is a smooth step in the angle from its middle, so that a chrome ball shows
// no jagged rim. Colours are grey: a white matt surface stays white. Sizes and strengths are guesses, chosen by eye on
// real models and scaled so that white matt surfaces shine 0.4 to 0.9.

/// A lamp: a rectangle on the unit cube's face that `towards` points at, with soft edges.
struct Lamp {
    towards: Vec3,
    /// Half of its width and height at distance 1.
    half: [f32; 2],
    /// How far its edge reaches, at distance 1.
    soft: f32,
    radiance: f32,
}

/// A key light from the upper left, a fill from the right, a strip behind, and one overhead.
const LAMPS: [Lamp; 5] = [
    Lamp {
        towards: Vec3::new(-0.65, 0.6, 0.75),
        half: [0.5, 0.4],
        soft: 0.12,
        radiance: 3.6,
    },
    Lamp {
        towards: Vec3::new(1.0, 0.25, 0.4),
        half: [0.3, 0.65],
        soft: 0.15,
        radiance: 1.2,
    },
    Lamp {
        towards: Vec3::new(0.5, 0.45, -1.0),
        half: [0.6, 0.25],
        soft: 0.12,
        radiance: 2.2,
    },
    Lamp {
        towards: Vec3::new(-0.9, 0.1, -0.7),
        half: [0.2, 0.6],
        soft: 0.12,
        radiance: 1.6,
    },
    Lamp {
        towards: Vec3::new(0.05, 1.0, -0.1),
        half: [0.6, 0.6],
        soft: 0.3,
        radiance: 1.3,
    },
];

/// Radiance of the walls at the floor, at the horizon and overhead.
const WALLS: [f32; 3] = [0.12, 0.3, 0.42];

/// Radiance that comes from a direction of unit length.
pub(crate) fn radiance(direction: Vec3) -> Vec3 {
    let [floor, horizon, ceiling] = WALLS;
    let up = direction.y;
    let mut sum = if up < 0.0 {
        horizon + (floor - horizon) * smooth(0.0, 0.6, -up)
    } else {
        horizon + (ceiling - horizon) * smooth(0.0, 1.0, up)
    };
    for lamp in &LAMPS {
        sum += lamp.radiance * lamp.share(direction);
    }
    Vec3::splat(sum)
}

impl Lamp {
    fn share(&self, direction: Vec3) -> f32 {
        let forward = self.towards.normalize();
        let side = if forward.y.abs() > 0.9 {
            Vec3::X
        } else {
            forward.cross(Vec3::Y).normalize()
        };
        let above = side.cross(forward);
        let depth = direction.dot(forward);
        if depth <= 0.0 {
            return 0.0;
        }
        let within = |at: f32, half: f32| {
            1.0 - smooth(half - self.soft, half + self.soft, (at / depth).abs())
        };
        within(direction.dot(side), self.half[0]) * within(direction.dot(above), self.half[1])
    }
}

/// From 0 at `low` to 1 at `high`, flat at both ends.
fn smooth(low: f32, high: f32, at: f32) -> f32 {
    let t = ((at - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_light_stays_even() {
        let white = Surroundings {
            width: 8,
            height: 4,
            rgb: vec![[2.0; 3]; 32],
        };
        let environment = Environment::new(Some(&white), 0.3, Shadows::None);
        for [r, g, b, _, next @ .., _] in environment.blurred.texels() {
            for light in [r, g, b].into_iter().chain(next) {
                assert!((light - 2.0).abs() < 1e-4, "{light}");
            }
        }
        let [first, rest @ ..] = environment.irradiance;
        assert!(
            (first - Vec3::splat(2.0)).abs().max_element() < 1e-5,
            "{first}"
        );
        assert!(
            rest.iter().all(|part| part.abs().max_element() < 2e-3),
            "{rest:?}"
        );
    }

    #[test]
    fn the_middle_of_a_picture_lies_ahead_and_its_right_to_the_right() {
        let mut rgb = vec![[0.0; 3]; 64 * 32];
        rgb[16 * 64 + 32] = [1.0; 3];
        rgb[16 * 64 + 48] = [0.5; 3];
        let picture = Surroundings {
            width: 64,
            height: 32,
            rgb,
        };
        assert!(seen(&picture, -Vec3::Z).x > 0.2);
        assert!(seen(&picture, Vec3::X).x > 0.1);
        assert_eq!(seen(&picture, Vec3::Z), Vec3::ZERO);
    }
}
