//! The matter of a volume that stays in its file, on the finest grid that fits the memory.
//!
//! Takes every visible brick once, a layer of them at a time; gives means over boxes of voxels, in which light is found.

use rayon::prelude::*;
use resample_volume::Watch;

use crate::bricks::cells::{CELL_SIDE, CellBrick, CellField};
use crate::field::streamed::StreamedCells;
use crate::look::options::LightGrid;
use crate::shadow::coarse::{BoxSums, CoarseField, CoarseGrid};
use crate::shadow::coarse_gain::BOX_BRICKS;
use crate::shadow::tables::Caster;
use resample_core::Stop;

use crate::Error;

/// Steps of the grid, voxels: those that end where bricks do.
const STEPS: [usize; 3] = [2, 4, 8];

/// Bytes that each vertex takes while its box is summed.
const SUM_BYTES: u64 = 8;

/// Bytes that each visible vertex takes while light is found: its brick, numbers, strengths, skin and shares in two orders, roots, and two
/// tables of light.
const LIGHT_BYTES: u64 = 48;

impl StreamedCells {
    /// The means of the matter. [`Error::Option`] where they do not fit the memory.
    pub(crate) fn averaged(
        &self,
        caster: &Caster,
        asked: LightGrid,
        (watch, stop): (&mut Watch, &Stop),
    ) -> Result<CoarseField, Error> {
        let grid = self.light_grid(asked)?;
        let whole = grid.whole();
        let mut sums = BoxSums::none((grid, caster.summed()), &whole);
        let [layers, rows] = self.index.layers_and_rows();
        for layer in 0..layers {
            if stop.is_asked() {
                return Err(Error::Stopped);
            }
            let rows = (0..rows).into_par_iter();
            let of_row = |row: usize| -> Result<Vec<BoxSums>, Error> {
                let at = [layer, row];
                let all = self.index.row(at).iter().copied().enumerate();
                let (bricks, _) = self.load_row(at, all)?;
                let field = CellField::of_bricks(bricks, 0, 0);
                let span = |axis: usize, number: usize| {
                    let first = number * CELL_SIDE;
                    [first, (first + CELL_SIDE).min(whole[axis][1])]
                };
                let caster = Caster {
                    field: &field,
                    ..caster.clone()
                };
                Ok(caster.box_sums(grid, &[[whole[0], span(1, row), span(2, layer)]]))
            };
            let parts = rows.map(of_row).collect::<Result<Vec<_>, Error>>()?;
            for part in parts.iter().flatten() {
                sums.add(part);
            }
            watch((layer + 1) as f64 / layers as f64);
        }
        Ok(sums.field())
    }

    /// The visible bricks in the box with this first voxel.
    pub(crate) fn bricks_in_box(&self, first: [usize; 3]) -> Result<Vec<CellBrick>, Error> {
        let [x, y, z] = first.map(|at| at / CELL_SIDE);
        let [layers, rows] = self.index.layers_and_rows();
        let mut found = Vec::new();
        for layer in z..(z + BOX_BRICKS).min(layers) {
            for row in y..(y + BOX_BRICKS).min(rows) {
                let at = [layer, row];
                let of_row = self.index.row(at).iter().copied().enumerate();
                let inside =
                    of_row.filter(|(_, brick)| (x..x + BOX_BRICKS).contains(&brick.column.into()));
                found.extend(self.load_row(at, inside)?.0);
            }
        }
        Ok(found)
    }

    /// The grid that was asked for, or the finest that fits.
    fn light_grid(&self, asked: LightGrid) -> Result<CoarseGrid, Error> {
        let dims = self.reader.stored.dims();
        let visible = (self.index.bricks.len() * CELL_SIDE.pow(3)) as u64;
        let bytes = |grid: &CoarseGrid| {
            let seen = visible / (grid.step as u64).pow(3);
            SUM_BYTES * grid.len() as u64 + LIGHT_BYTES * seen
        };
        let least = match asked {
            LightGrid::Auto | LightGrid::AtHand => STEPS[0],
            LightGrid::Every(step) => step as usize,
        };
        let mut grids = STEPS
            .into_iter()
            .filter(|step| *step >= least)
            .map(|step| CoarseGrid { step, dims });
        let fits = |grid: &CoarseGrid| bytes(grid) <= self.budget.light;
        grids.find(fits).ok_or_else(|| {
            let coarsest = CoarseGrid {
                step: STEPS[2],
                dims,
            };
            let needed = bytes(&coarsest) * self.budget.total / self.budget.light.max(1);
            Error::Option(format!(
                "{} bytes of memory are too little for shadows and occlusion, which take at least {needed}: allow more memory, or leave them out",
                self.budget.total
            ))
        })
    }
}
