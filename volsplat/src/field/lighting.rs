//! The light at the vertices of a field's bricks, made before the first picture that needs it.
//!
//! Takes the bricks, the clip and the options; keeps light until one of them changes, whatever the camera does. Where the options ask for a coarser
//! grid, or voxels stay in their file, light is found on every second voxel or fewer, and bricks take it from there.

use glam::DVec3;
use resample_volume::Watch;

use crate::bricks::cells::{CELL_SIDE, CellBrick, CellField};
use crate::field::driver::{FieldPipeline, Source};
use crate::light::GradientCurve;
use crate::look::options::{Light, LightGrid, Occlusion, RenderOptions, Shading, Shadow};
use crate::shadow::brightness::Falls;
use crate::shadow::coarse::{CoarseField, CoarseGrid, averaged};
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

/// The light at the vertices of the bricks, as far as it is known.
#[derive(Clone, Debug, Default)]
pub(super) struct FieldLight {
    /// On the grid that was asked for.
    whole: Reaching,
    grid: LightGrid,
    /// On a coarse one, while pictures move and the other is not known.
    moving: Reaching,
    /// Matter on the grid that light was found on last, where that is not the volume's own.
    coarse: Option<CoarseField>,
}

impl FieldLight {
    /// No light yet; `grid` is that which the options ask for.
    pub(super) fn none(grid: LightGrid) -> Self {
        Self {
            grid: match grid {
                LightGrid::AtHand => LightGrid::Auto,
                asked => asked,
            },
            ..Self::default()
        }
    }

    /// Forgets the light, and the matter that it was found in.
    pub(super) fn forget(&mut self) {
        self.forget_reaching();
        self.coarse = None;
    }

    /// Forgets the light, and not the matter.
    pub(super) fn forget_reaching(&mut self) {
        self.whole = Reaching::default();
        self.moving = Reaching::default();
    }

    /// Takes options that may ask for other light.
    pub(super) fn update(&mut self, before: &RenderOptions, options: &RenderOptions) {
        let both = [&mut self.whole, &mut self.moving];
        let changes_sun = before.shadow != options.shadow || before.light != options.light;
        let of_sky = |options: &RenderOptions| {
            let RenderOptions {
                occlusion, shading, ..
            } = options;
            (*occlusion, *shading, options.shadow.is_some())
        };
        let changes_sky = of_sky(before) != of_sky(options);
        for light in both {
            light.sun = light.sun.take().filter(|_| !changes_sun);
            light.sky = light.sky.take().filter(|_| !changes_sky);
        }
        let asked = options.light_grid;
        if asked != LightGrid::AtHand && asked != self.grid {
            self.forget();
            self.grid = asked;
        }
    }

    /// The light that is drawn.
    pub(super) fn drawn(&self, options: &RenderOptions) -> &Reaching {
        let lacks_some = (options.shadow.is_some() && self.whole.sun.is_none())
            || (options.occlusion.is_some() && self.whole.sky.is_none());
        match options.light_grid {
            LightGrid::AtHand if lacks_some => &self.moving,
            _ => &self.whole,
        }
    }

    /// Matter on a coarse grid, where light is found on one.
    pub(super) fn coarse(&self) -> Option<&CoarseField> {
        self.coarse.as_ref()
    }
}

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
        (known.sun, known.sky) = (
            found.sun.or(known.sun.take()),
            found.sky.or(known.sky.take()),
        );
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
            .unwrap_or_else(|| averaged(&caster, grid));
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
