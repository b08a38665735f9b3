//! Small bright lights of a picture of surroundings, found and taken out of it.
//!
//! A light is a bright spot that lies within one of [`CORES_RAD`] of its middle. Only the radiance that it has above its surroundings is taken out. A
//! spot counts wholly if it is small, holds much of all light, and is much brighter than its surroundings. Between these limits a part of it
//! is taken out, so that a picture does not jump when a light changes a little. Limits: [`MOST`] lights, round ones; larger and longer ones
//! stay in the picture.

use std::borrow::Cow;
use std::f32::consts::{PI, TAU};

use glam::Vec3;
use resample_core::narrow::cell;
use resample_mesh::scene::Surroundings;

use crate::light::suns::{MOST, Sun};

/// Half the angles of the part of the sky that may be a light: the first that holds one counts.
const CORES_RAD: [f32; 3] = [0.045, 0.09, 0.18];

/// Half the angle of the ring around it that is no light, as a part of its own.
const RING: f32 = 1.8;

/// Radii, as parts of the core's, between which a light becomes too large for it. A guess.
const LARGE: [f32; 2] = [0.45, 0.65];

/// A light counts from the first to the second of these parts of all light, and of these ratios of its radiance to that around it. Guesses: nobody
/// misses the highlight of a weaker one.
const PART: [f32; 2] = [0.01, 0.02];
const CONTRAST: [f32; 2] = [8.0, 16.0];

/// Most bright spots that are looked at. A guess.
const MOST_SPOTS: usize = 24;

/// A bright spot of a picture, if it is a light.
pub(super) struct Spot {
    pub(super) sun: Sun,
    /// Pixels, and half the angle that they fill.
    pub(super) core: Vec<usize>,
    pub(super) core_rad: f32,
    /// The mean radiance around the light.
    around: Vec3,
    /// The part of the light that is taken out of the picture, 0 to 1.
    share: f32,
}

impl Spot {
    /// The radiance of one of its pixels without the light.
    pub(super) fn without(&self, radiance: Vec3) -> Vec3 {
        radiance.lerp(self.around, self.share)
    }

    fn strength(&self) -> f32 {
        self.sun.power.element_sum() * self.share
    }
}

/// The lights of a picture, as far as they are taken out of it.
pub(super) fn bright_spots(picture: &Surroundings) -> Vec<Spot> {
    let mut spots = candidates(picture);
    let strength_order = |a: &Spot, b: &Spot| b.strength().total_cmp(&a.strength());
    spots.sort_by(strength_order);
    // Where there are more, each counts by how much stronger it is than the first that has no place: two that change
    // places are both left in the picture.
    if let Some(first_out) = spots.get(MOST).map(Spot::strength) {
        spots.truncate(MOST);
        for spot in &mut spots {
            spot.share *= (spot.strength() / first_out - 1.0).clamp(0.0, 1.0);
        }
    }
    spots.retain(|spot| spot.share > 0.0);
    for spot in &mut spots {
        spot.sun.power *= spot.share;
    }
    spots
}

/// The lights among the brightest spots of a picture, one more than have a place.
fn candidates(picture: &Surroundings) -> Vec<Spot> {
    let grid = Grid::new(picture);
    let whole = grid.total_light(picture);
    let [.., largest] = CORES_RAD;
    let mut rest = Cow::Borrowed(picture);
    let mut looked_at = vec![false; picture.rgb.len()];
    let mut spots = Vec::new();
    for _ in 0..MOST_SPOTS {
        if spots.len() > MOST {
            break;
        }
        let mut peak = None;
        let mut most = 0.0;
        for (at, pixel) in rest.rgb.iter().enumerate() {
            if bright(pixel) > most && !looked_at[at] {
                (peak, most) = (Some(at), bright(pixel));
            }
        }
        let Some(peak) = peak else { break };
        // No spot that is as bright at most can hold enough light.
        if f64::from(most * PI * largest * largest) < f64::from(PART[0]) * whole {
            break;
        }
        match grid.spot(&rest, peak, whole) {
            Some(spot) => {
                let rgb = &mut rest.to_mut().rgb;
                for &at in &spot.core {
                    looked_at[at] = true;
                    rgb[at] = spot.without(Vec3::from(rgb[at])).to_array();
                }
                spots.push(spot);
            }
            None => leave_aside(&rest, peak, &mut looked_at),
        }
    }
    spots
}

/// Marks the pixels around a bright pixel that are at least half as bright and connected with it.
fn leave_aside(picture: &Surroundings, from: usize, looked_at: &mut [bool]) {
    let (width, height) = (picture.width, picture.height);
    let least = 0.5 * bright(&picture.rgb[from]);
    let mut open = vec![from];
    looked_at[from] = true;
    while let Some(at) = open.pop() {
        let (x, y) = (at % width, at / width);
        let beside = [
            y * width + (x + 1) % width,
            y * width + (x + width - 1) % width,
            y.saturating_sub(1) * width + x,
            (y + 1).min(height - 1) * width + x,
        ];
        for next in beside {
            if !looked_at[next] && bright(&picture.rgb[next]) >= least {
                looked_at[next] = true;
                open.push(next);
            }
        }
    }
}

fn bright([r, g, b]: &[f32; 3]) -> f32 {
    r + g + b
}

/// Directions of the pixels of a picture, whose middle lies towards -z.
struct Grid {
    width: usize,
    height: usize,
    /// Sine and cosine of the angle from +y, by row.
    rows: Vec<[f32; 2]>,
    /// Of the angle from -z towards +x, by column.
    columns: Vec<[f32; 2]>,
}

impl Grid {
    fn new(picture: &Surroundings) -> Self {
        let (width, height) = (picture.width, picture.height);
        let row = |y: usize| (y as f32 + 0.5) / height as f32 * PI;
        let column = |x: usize| ((x as f32 + 0.5) / width as f32 - 0.5) * TAU;
        Self {
            width,
            height,
            rows: (0..height).map(|y| row(y).sin_cos().into()).collect(),
            columns: (0..width).map(|x| column(x).sin_cos().into()).collect(),
        }
    }

    /// Towards the centre of a pixel.
    fn direction(&self, at: usize) -> Vec3 {
        let [sin, cos] = self.rows[at / self.width];
        let [across, ahead] = self.columns[at % self.width];
        Vec3::new(sin * across, cos, -sin * ahead)
    }

    /// Solid angle of a pixel.
    fn solid(&self, at: usize) -> f32 {
        self.pixel_solid() * self.rows[at / self.width][0]
    }

    /// Solid angle of a pixel at the equator.
    fn pixel_solid(&self) -> f32 {
        (TAU / self.width as f32) * (PI / self.height as f32)
    }

    /// All light.
    fn total_light(&self, picture: &Surroundings) -> f64 {
        let rows = picture.rgb.chunks_exact(self.width).zip(&self.rows);
        let of_row = |(pixels, [sin, _]): (&[[f32; 3]], &[f32; 2])| {
            let sum: f64 = pixels.iter().map(|pixel| f64::from(bright(pixel))).sum();
            sum * f64::from(sin * self.pixel_solid())
        };
        rows.map(of_row).sum()
    }

    /// The pixels within an angle of a direction, and a few more.
    fn near(&self, middle: Vec3, reach_rad: f32) -> impl Iterator<Item = usize> {
        let (width, height) = (self.width, self.height);
        let row = cell(middle.y.clamp(-1.0, 1.0).acos() / PI * height as f32);
        let rows = cell((reach_rad / PI * height as f32).ceil()) + 1;
        let rows = row.saturating_sub(rows)..(row + rows + 1).min(height);
        let turn = middle.x.atan2(-middle.z) / TAU + 0.5;
        let column = cell(turn * width as f32);
        let sine = (1.0 - middle.y * middle.y).max(0.0).sqrt();
        rows.flat_map(move |y| {
            // The law of cosines on the sphere: how far a row lies within the angle to either side.
            let [sin, cos] = self.rows[y];
            let cosine = (reach_rad.cos() - cos * middle.y) / (sin * sine).max(f32::MIN_POSITIVE);
            let half = cosine.clamp(-1.0, 1.0).acos() / TAU * width as f32;
            let half = cell(half.ceil()) + 1;
            let (first, count) = (column + width - half, (2 * half + 1).min(width));
            (first..first + count).map(move |x| y * width + x % width)
        })
    }

    /// The light around a pixel, as far as it is one: in the part of the sky that has most of it.
    fn spot(&self, picture: &Surroundings, peak: usize, whole: f64) -> Option<Spot> {
        let spots = CORES_RAD.map(|core_rad| self.spot_within(picture, (peak, core_rad), whole));
        let larger = |a: Spot, b: Spot| if b.share > a.share { b } else { a };
        spots.into_iter().flatten().reduce(larger)
    }

    /// The light around a pixel within an angle, as far as it is one.
    fn spot_within(
        &self,
        picture: &Surroundings,
        (peak, core_rad): (usize, f32),
        whole: f64,
    ) -> Option<Spot> {
        let mut core = Core::new(self, picture, (self.direction(peak), core_rad))?;
        // A light that is small enough lies all but wholly around its brightest pixel.
        if f64::from(core.power.element_sum()) < 0.5 * f64::from(PART[0]) * whole {
            return None;
        }
        for _ in 0..STEPS {
            core = Core::new(self, picture, (core.middle, core_rad))?;
        }
        let total = core.power.element_sum();
        let mean2 = core.pixels.iter().map(|&at| {
            let away2 = self.direction(at).distance_squared(core.middle);
            core.above(self, picture, at).element_sum() * away2
        });
        // Of a disc it is half of its radius squared.
        let radius2 = 2.0 * mean2.sum::<f32>() / total;
        let part = (f64::from(total) / whole) as f32;
        let contrast = total / (core.around.element_sum() * core.solid).max(f32::MIN_POSITIVE);
        let share = rising(PART, part)
            * rising(CONTRAST, contrast)
            * (1.0 - rising(LARGE, radius2.sqrt() / core_rad));
        (core.is_resolved && share > 0.0).then(|| Spot {
            sun: Sun::new(core.middle, core.power, radius2),
            around: core.around,
            core: core.pixels,
            core_rad,
            share,
        })
    }
}

/// The light around a pixel, above what lies around it.
struct Core {
    pixels: Vec<usize>,
    around: Vec3,
    power: Vec3,
    /// Towards its middle.
    middle: Vec3,
    solid: f32,
    is_resolved: bool,
}

impl Core {
    fn new(grid: &Grid, picture: &Surroundings, (middle, core_rad): (Vec3, f32)) -> Option<Self> {
        let ring_rad = RING * core_rad;
        let (mut pixels, mut ring, mut ring_solid) = (Vec::new(), Vec3::ZERO, 0.0);
        for at in grid.near(middle, ring_rad) {
            let away2 = grid.direction(at).distance_squared(middle);
            if away2 < core_rad * core_rad {
                pixels.push(at);
            } else if away2 < ring_rad * ring_rad {
                let solid = grid.solid(at);
                ring += Vec3::from(picture.rgb[at]) * solid;
                ring_solid += solid;
            }
        }
        let mut core = Self {
            around: ring / ring_solid.max(f32::MIN_POSITIVE),
            pixels,
            power: Vec3::ZERO,
            middle: Vec3::ZERO,
            solid: 0.0,
            is_resolved: false,
        };
        for &at in &core.pixels {
            let light = core.above(grid, picture, at);
            core.power += light;
            core.middle += grid.direction(at) * light.element_sum();
            core.solid += grid.solid(at);
        }
        core.middle = core.middle.try_normalize()?;
        // Pixels of a coarse picture are larger than a light may be.
        let core_area = PI * core_rad * core_rad;
        let ring_area = PI * ring_rad * ring_rad - core_area;
        core.is_resolved = core.solid > 0.5 * core_area && ring_solid > 0.5 * ring_area;
        Some(core)
    }

    fn above(&self, grid: &Grid, picture: &Surroundings, at: usize) -> Vec3 {
        (Vec3::from(picture.rgb[at]) - self.around).max(Vec3::ZERO) * grid.solid(at)
    }
}

/// Looks for the middle of a light, which is not its brightest pixel.
const STEPS: usize = 3;

/// From 0 to 1 between two numbers.
fn rising([low, high]: [f32; 2], at: f32) -> f32 {
    ((at - low) / (high - low)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(lights: &[(Vec3, f32, f32)]) -> Surroundings {
        let mut sky = Surroundings {
            width: 720,
            height: 360,
            rgb: vec![[0.5; 3]; 720 * 360],
        };
        let grid = Grid::new(&sky);
        for at in 0..sky.rgb.len() {
            let d = grid.direction(at);
            for &(towards, radius, light) in lights {
                if d.distance(towards.normalize()) < radius {
                    sky.rgb[at] = [light; 3];
                }
            }
        }
        sky
    }

    #[test]
    fn small_bright_lights_are_taken_out_and_large_or_dim_ones_stay() {
        let (first, second) = (Vec3::new(0.3, 0.8, 0.2), Vec3::new(-1.0, 0.1, 0.4));
        let two = sky(&[(first, 0.01, 4000.0), (second, 0.015, 900.0)]);
        let spots = bright_spots(&two);
        assert_eq!(spots.len(), 2);
        assert!(spots[0].sun.direction.distance(first.normalize()) < 1e-3);
        let disc = PI * 0.01 * 0.01 * 4000.0;
        let power = spots[0].sun.power.x;
        assert!((power / disc - 1.0).abs() < 0.1, "{power} of {disc}");
        for spot in &spots {
            for &at in &spot.core {
                let left = spot.without(Vec3::from(two.rgb[at])).x;
                assert!(left < 0.6, "{left} in an even sky");
            }
        }
        let large = sky(&[(first, 0.3, 4000.0)]);
        assert!(bright_spots(&large).is_empty(), "a large lamp");
        let dim = sky(&[(first, 0.01, 2.0)]);
        assert!(bright_spots(&dim).is_empty(), "a dim one");
        assert!(bright_spots(&sky(&[])).is_empty(), "an even sky");
    }

    #[test]
    fn lamps_of_some_degrees_are_lights_of_their_size() {
        // Beside a pole, across the seam of the picture, and elsewhere.
        for towards in [
            Vec3::new(0.05, 1.0, 0.02),
            Vec3::new(0.01, 0.2, 1.0),
            Vec3::new(1.0, -0.3, 0.2),
        ] {
            let mut level = 0;
            for radius in [0.02, 0.035, 0.06, 0.08] {
                // As strong as a seventh of all light.
                let above = 1.0 / (PI * radius * radius);
                let spots = bright_spots(&sky(&[(towards, radius, 0.5 + above)]));
                let [spot] = &spots[..] else {
                    panic!("{} lights of {radius} at {towards}", spots.len())
                };
                let found = (8.0 * spot.sun.alpha2).sqrt();
                let pixel = PI / 360.0;
                assert!((found - radius).abs() < 0.5 * pixel, "{found} of {radius}");
                assert!(spot.sun.direction.distance(towards.normalize()) < 0.5 * pixel);
                let power = spot.sun.power.x;
                assert!((power - 1.0).abs() < 0.15, "{power} at {radius}");
                assert!(spot.sun.first_level >= level);
                level = spot.sun.first_level;
            }
            assert!(
                level > 2,
                "the largest lamp is in the levels of narrow lobes"
            );
        }
    }
}
