//! The light around the scene, prepared for look-ups: as it is, and blurred by each roughness.
//!
//! Takes a formula or an equirectangular picture; gives octahedral maps of radiance, one for each of [`LEVELS`] roughnesses,
//! each seen through the GGX lobe of a surface that is looked at along its normal (Karis 2013); the irradiance of matt
//! surfaces in nine spherical harmonics (Ramamoorthi and Hanrahan 2001); and the table of reflectance. A lobe's mean is
//! taken from copies of the map that are as coarse as its samples are apart (Křivánek and Colbert 2008).
//!
//! Small bright lights are kept apart (`suns`). Limits: a lobe in blurred light does not stretch at grazing angles; light comes from infinitely far away.

mod blur;
mod bright_spots;
pub(crate) mod irradiance;
mod map;
mod picture;
mod studio;

use std::sync::{Arc, Mutex, PoisonError};

use glam::{Quat, Vec3};
use resample_core::simd::Vectors;
use resample_mesh::scene::Surroundings;

use crate::light::around::{Blurred, LEVELS};
use crate::light::environment::blur::{Pyramid, SIDES};
use crate::light::environment::bright_spots::{Spot, bright_spots};
use crate::light::environment::irradiance::irradiance;
use crate::light::environment::map::{Map, blurred_of};
use crate::light::environment::picture::{Disc, Equirect};
use crate::light::reflectance::Reflectance;
use crate::light::suns::Sun;
use crate::options::Shadows;

/// The light around the scene.
#[derive(Clone, Debug)]
pub(crate) struct Environment {
    /// Radiance by roughness, the smoothest first.
    pub(crate) blurred: Blurred,
    /// Irradiance over pi of a surface with normal (x, y, z), without that of the suns, is the sum of these times
    /// [`irradiance::basis`].
    pub(crate) irradiance: [Vec3; 9],
    pub(crate) reflectance: Reflectance,
    /// Lights that are not in all levels; see [`Sun::first_level`].
    pub(crate) suns: Vec<Sun>,
    /// All light but theirs, where something may block it.
    pub(crate) sky: Option<Map>,
}

/// A studio, and the name of the vector instructions that made it.
type Kept = (&'static str, Arc<Environment>);

/// Studios of this process: many scenes stand in the same one.
static STUDIOS: Mutex<Vec<Kept>> = Mutex::new(Vec::new());

impl Environment {
    /// As [`Environment::new`]; a studio that is not turned is made once.
    pub(crate) fn shared(
        picture: Option<&Surroundings>,
        turn_rad: f32,
        (shadows, vectors): (Shadows, Vectors),
    ) -> Arc<Self> {
        let make = || Arc::new(Self::new(picture, turn_rad, (shadows, vectors)));
        if picture.is_some() || turn_rad != 0.0 || shadows != Shadows::None {
            return make();
        }
        let kept = || STUDIOS.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |kept: &&Kept| kept.0 == vectors.name();
        let found = kept().iter().find(same).map(|kept| kept.1.clone());
        // The lock is not held meanwhile. Two threads may make the studio at the same time; both make the same one.
        found.unwrap_or_else(|| {
            let made = make();
            kept().push((vectors.name(), made.clone()));
            made
        })
    }

    /// The built-in studio, or the surroundings of a picture, turned about +y by an angle in radians.
    pub(crate) fn new(
        picture: Option<&Surroundings>,
        turn_rad: f32,
        (shadows, vectors): (Shadows, Vectors),
    ) -> Self {
        let mut source = Source::new(picture, turn_rad);
        let mut coarser = source.map(vectors).with_coarser();
        let mut pyramid = Pyramid::new(&coarser);
        let mut maps = vec![coarser[0].clone()];
        for level in 1..LEVELS {
            if source.take_out_suns(level) {
                let mut map = coarser.swap_remove(0);
                source.redraw(&mut map, level, vectors);
                coarser = map.with_coarser();
                pyramid = Pyramid::new(&coarser);
            }
            maps.push(pyramid.blurred(level, vectors));
        }
        let at_most = |side: usize| {
            let map = coarser.iter().find(|map| map.side <= side);
            map.unwrap_or(&coarser[0])
        };
        Self {
            blurred: blurred_of(&maps.iter().collect::<Vec<_>>()),
            irradiance: irradiance(at_most(64)),
            reflectance: Reflectance::new(),
            suns: source.suns(),
            // Cells of a sky are as large as the texels of this map.
            sky: (shadows != Shadows::None).then(|| at_most(128).clone()),
        }
    }
}

/// Where light comes from.
struct Source {
    /// Without it, the studio.
    picture: Option<Equirect>,
    /// Small bright lights of the picture.
    spots: Vec<Spot>,
    turn: Quat,
}

impl Source {
    fn new(picture: Option<&Surroundings>, turn_rad: f32) -> Self {
        let turn = Quat::from_rotation_y(-turn_rad);
        let Some(picture) = picture else {
            let (picture, spots) = (None, Vec::new());
            return Self {
                picture,
                spots,
                turn,
            };
        };
        let picture = picture::reduced(picture);
        let mut spots = bright_spots(&picture);
        for spot in &mut spots {
            spot.sun.direction = turn.inverse() * spot.sun.direction;
        }
        Self {
            picture: Some(Equirect::new(&picture, turn_rad)),
            spots,
            turn,
        }
    }

    fn map(&self, vectors: Vectors) -> Map {
        match &self.picture {
            Some(picture) => picture.map(vectors),
            None => studio::map(SIDES[0], self.turn),
        }
    }

    fn suns(self) -> Vec<Sun> {
        self.spots.into_iter().map(|spot| spot.sun).collect()
    }

    /// Takes those lights out of the picture that are first missing in a level. Returns false if there are no such lights.
    fn take_out_suns(&mut self, level: usize) -> bool {
        let Some(picture) = &mut self.picture else {
            return false;
        };
        let mut is_changed = false;
        for spot in self
            .spots
            .iter()
            .filter(|spot| spot.sun.first_level == level)
        {
            for &pixel in &spot.core {
                picture.change(pixel, |radiance| spot.without(radiance));
            }
            is_changed = true;
        }
        is_changed
    }

    /// Draws a map anew where lights are first missing in a level.
    fn redraw(&self, map: &mut Map, level: usize, vectors: Vectors) {
        let leaving = self
            .spots
            .iter()
            .filter(|spot| spot.sun.first_level == level);
        let parts: Vec<Disc> = leaving
            .map(|spot| Disc {
                direction: spot.sun.direction,
                radius_rad: spot.core_rad,
            })
            .collect();
        if let Some(picture) = &self.picture {
            picture.redraw(map, &parts, vectors);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resample_core::simd::SimdLevel;

    #[test]
    fn even_light_stays_even() {
        let white = Surroundings {
            width: 8,
            height: 4,
            rgb: vec![[2.0; 3]; 32],
        };
        let how = (Shadows::None, SimdLevel::Auto.resolve());
        let environment = Environment::new(Some(&white), 0.3, how);
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
}
