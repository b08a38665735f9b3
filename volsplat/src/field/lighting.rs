//! The light at the vertices of a field's bricks, made before the first picture that needs it.
//!
//! Takes the bricks, the clip and the options; keeps light until one of them changes, whatever the camera does. Where the options ask for a coarser
//! grid, or voxels stay in their file, light is found on every second voxel or fewer, and bricks take it from there.

use glam::DVec3;
use resample_volume::Watch;

use crate::bricks::cells::{CELL_SIDE, CellBrick, CellField};
use crate::field::driver::{FieldPipeline, Source};
use crate::light::GradientCurve;
use crate::look::options::{Light, LightGrid, Occlusion, Shading, Shadow};
use crate::shadow::brightness::Falls;
use crate::shadow::coarse::{CoarseField, CoarseGrid};
use crate::shadow::coarse_gain;
use crate::shadow::tables::{Caster, LightTables, Numbers, Reaching};
use resample_core::Stop;

use crate::Error;

/// The radius of occlusion, diagonals of the visible part. A habit.
const OCCLUSION_RADIUS: f64 = 0.1;

/// The light that is to be found.
#[derive(Clone, Copy)]
struct Wanted {
    /// Shadows, and the direction towards the light.
    sun: Option<(Shadow, DVec3)>,
    /// The radius of occlusion, world units.
    sky: Option<f64>,
}

/// Steps of the grid of moving pictures, voxels: their light takes a quarter to a tenth of the time.
const MOVING_STEP: usize = 4;

impl FieldPipeline {
    /// Makes the light at the vertices of the bricks where the options ask for shadows or occlusion and nothing has changed since.
    pub(super) fn block_light(&mut self, (watch, stop): (&mut Watch, &Stop)) -> Result<(), Error> {
        let sun = match (self.options.shadow, self.options.light) {
            (Some(shadow), Light::Towards(towards)) => Some((shadow, towards)),
            _ => None,
        };
        let sky = self.options.occlusion;
        if sun.is_none() && sky.is_none() {
            self.light.forget_reaching();
            return Ok(());
        }
        let known = self.light.drawn(&self.options);
        let wanted = Wanted {
            sun: sun.filter(|_| known.sun.is_none()),
            sky: sky
                .filter(|_| known.sky.is_none())
                .map(|sky| self.radius(sky)),
        };
        if wanted.sun.is_none() && wanted.sky.is_none() {
            return Ok(());
        }
        let coarse = self.light.coarse.take();
        let (found, coarse) = self.found(wanted, coarse, (watch, stop))?;
        let light = &mut self.light;
        light.coarse = coarse;
        let known = match (self.options.light_grid, &self.source) {
            (LightGrid::AtHand, Source::Cells(_)) => &mut light.moving,
            _ => &mut light.whole,
        };
        known.add(found);
        Ok(())
    }

    /// The light that is wanted, and the matter on the coarse grid that it was found on; `known` is that of before.
    fn found(
        &self,
        wanted: Wanted,
        known: Option<CoarseField>,
        (watch, stop): (&mut Watch, &Stop),
    ) -> Result<(Reaching, Option<CoarseField>), Error> {
        let nothing = CellField::of_bricks(Vec::new(), 0, 0);
        let caster = self.caster(&nothing);
        let field = match &self.source {
            Source::Cells(field) => field,
            Source::Streamed(cells) => {
                let coarse = match known {
                    Some(coarse) => coarse,
                    None => cells.averaged(&caster, self.options.light_grid, (watch, stop))?,
                };
                let light = self.found_in(&coarse, &caster, wanted);
                let bricks = |first: [usize; 3]| Ok((first, cells.bricks_in_box(first)?));
                let light = self.held(light, (&caster, coarse.grid(), wanted), bricks)?;
                return Ok((light, Some(coarse)));
            }
        };
        let caster = Caster { field, ..caster };
        let step = match self.options.light_grid {
            LightGrid::Auto | LightGrid::Every(1) => return Ok((wanted.found(&caster), None)),
            LightGrid::Every(step) => step as usize,
            LightGrid::AtHand => MOVING_STEP,
        };
        let grid = CoarseGrid {
            step,
            dims: self.dims,
        };
        let coarse = known
            .filter(|known| known.grid() == grid)
            .unwrap_or_else(|| caster.averaged(grid));
        let light = self.found_in(&coarse, &caster, wanted);
        let bricks = |first: [usize; 3]| Ok((first, bricks_in_box(field, first)));
        let light = self.held(light, (&caster, grid, wanted), bricks)?;
        Ok((light.finer(&coarse, &field.bricks), Some(coarse)))
    }

    fn radius(&self, sky: Occlusion) -> f64 {
        let of_visible = || {
            let [low, high] = self.bounds_in_world()?;
            Some(OCCLUSION_RADIUS * (high - low).length())
        };
        sky.radius.or_else(of_visible).unwrap_or(1.0)
    }

    /// How matter in these bricks takes light.
    fn caster<'a>(&'a self, field: &'a CellField) -> Caster<'a> {
        let curve = self.options.gradient_opacity.as_ref();
        // Beside shadows the sky dims ambient light alone.
        let dims_ambient = self.options.shadow.is_some() || self.options.shading == Shading::None;
        Caster {
            field,
            numbers: Numbers::OfChannels,
            channels: &self.channels,
            ramp: curve.map(|curve| GradientCurve::new(curve, self.length)),
            surface: self.iso.map(|iso| iso.value),
            clip: &self.clip,
            world_from_index: &self.world_from_index,
            length: self.length,
            opacity_unit: self.options.opacity_unit_in_world(self.smallest_spacing),
            sky_falls: if dims_ambient {
                Falls::Evenly
            } else {
                Falls::FromEye
            },
            level: self.options.simd.resolve(),
        }
    }

    /// The light at the vertices of a coarse grid.
    fn found_in(&self, coarse: &CoarseField, caster: &Caster, wanted: Wanted) -> Reaching {
        let grid = coarse.grid();
        let world_from_index = grid.world_from_index(&self.world_from_index);
        let clip = self.clip.coarser(grid.step);
        wanted.found(&caster.coarse(coarse, &world_from_index, &clip))
    }

    /// Light of a coarse grid, so that surfaces are as bright as under that of every voxel. `bricks` gives those in a box.
    fn held(
        &self,
        light: Reaching,
        (caster, grid, wanted): (&Caster, CoarseGrid, Wanted),
        bricks: impl Fn([usize; 3]) -> Result<([usize; 3], Vec<CellBrick>), Error>,
    ) -> Result<Reaching, Error> {
        // An isosurface keeps all of its light on any grid.
        if caster.surface.is_some() {
            return Ok(light);
        }
        let boxes = coarse_gain::boxes(self.source.bounds()).into_iter();
        let boxes = boxes.map(bricks).collect::<Result<Vec<_>, Error>>()?;
        let find = |caster: &Caster| wanted.found(caster);
        Ok(light.brighter(coarse_gain::factors(caster, grid, boxes.into_iter(), find)))
    }
}

/// The bricks of a field in the box with this first voxel.
fn bricks_in_box(field: &CellField, first: [usize; 3]) -> Vec<CellBrick> {
    let side = coarse_gain::BOX_BRICKS * CELL_SIDE;
    let is_inside = |brick: &&CellBrick| {
        let corner = brick.bounds.corner;
        (0..3).all(|axis| (first[axis]..first[axis] + side).contains(&(corner[axis] as usize)))
    };
    field.bricks.iter().filter(is_inside).cloned().collect()
}

impl Wanted {
    fn found(&self, caster: &Caster) -> Reaching {
        // Inside of the pool, many small steps in parallel cost little.
        rayon::scope(|_| {
            let matter = caster.matter();
            Reaching {
                sun: self.sun.map(|(shadow, towards)| {
                    let towards = towards.normalize_or(DVec3::Z);
                    LightTables::of_sun(caster, &matter, towards, &shadow)
                }),
                sky: self
                    .sky
                    .map(|radius| LightTables::of_sky(caster, &matter, radius)),
            }
        })
    }
}
