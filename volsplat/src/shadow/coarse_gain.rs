//! How much brighter light of a coarse grid has to be, so that surfaces are as bright as under the light of every voxel.
//!
//! Light between vertices several voxels apart changes more slowly across a surface than extinction does. So visible samples get less light than
//! the mean by which pictures are normalised. Takes some boxes of bricks, finds in each the light of
//! every voxel and that of the coarse grid, as if the box were alone, and compares both where matter meets light.
//! Limits: one factor for all of a volume.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};
use resample_core::narrow::single;

use crate::bricks::cells::{CELL_SIDE, CellBrick, CellField, FromDifferences, TABLE_LEN, byte_at};
use crate::grid::{Bounds, in_unit};
use crate::light::FULL_LIGHT;
use crate::look::clip::GridClip;
use crate::shadow::coarse::CoarseGrid;
use crate::shadow::tables::{Caster, LightTables, Reaching};

/// Bricks along a side of a box. Those at its faces, where the box cuts matter, do not count.
pub(crate) const BOX_BRICKS: usize = 4;

/// Most boxes that are looked at. A guess: more cost time, and one factor is found.
const MOST_BOXES: usize = 8;

/// Shares of a box' bricks that show something, between which it counts as holding a surface. Guesses.
const FILLED: [f64; 2] = [0.1, 0.9];

/// The first voxels of some boxes that hold surfaces, of all bricks that show something.
pub(crate) fn boxes(bricks: impl Iterator<Item = Bounds>) -> Vec<[usize; 3]> {
    const SIDE: usize = BOX_BRICKS * CELL_SIDE;
    let mut filled: BTreeMap<[usize; 3], usize> = BTreeMap::new();
    for brick in bricks {
        let [x, y, z] = brick.corner.map(|at| at as usize / SIDE * SIDE);
        *filled.entry([z, y, x]).or_default() += 1;
    }
    let all = BOX_BRICKS.pow(3) as f64;
    let holds_surface =
        |count: usize| (FILLED[0] * all..=FILLED[1] * all).contains(&(count as f64));
    let of = |among: &dyn Fn(usize) -> bool| -> Vec<[usize; 3]> {
        let chosen = filled.iter().filter(|(_, count)| among(**count));
        chosen.map(|([z, y, x], _)| [*x, *y, *z]).collect()
    };
    let surfaces = of(&holds_surface);
    let found = if surfaces.is_empty() {
        of(&|_| true)
    } else {
        surfaces
    };
    let count = found.len().min(MOST_BOXES);
    (0..count)
        .map(|number| found[(2 * number + 1) * found.len() / (2 * count)])
        .collect()
}

/// Light where matter meets it, over all boxes.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    fine: f64,
    coarse: f64,
}

impl Sums {
    fn ratio(&self) -> f32 {
        if self.coarse > 0.0 && self.fine > 0.0 {
            single(self.fine / self.coarse)
        } else {
            1.0
        }
    }
}

/// The factors of the sun's light and of the sky's. `find` finds the light of a caster. Each box is its first voxel and its bricks.
pub(crate) fn factors(
    caster: &Caster,
    grid: CoarseGrid,
    boxes: impl Iterator<Item = ([usize; 3], Vec<CellBrick>)>,
    find: impl Fn(&Caster) -> Reaching,
) -> [f32; 2] {
    let mut sums = [Sums::default(); 2];
    for (first, mut bricks) in boxes {
        let side = |axis: usize| (grid.dims[axis] - first[axis]).min(BOX_BRICKS * CELL_SIDE + 1);
        let own = CoarseGrid {
            dims: [0, 1, 2].map(side),
            ..grid
        };
        for brick in &mut bricks {
            for (corner, first) in brick.bounds.corner.iter_mut().zip(first) {
                *corner -= first as u32;
            }
        }
        let field = CellField::of_bricks(bricks, 0, 0);
        let shift = DVec3::from(first.map(|at| at as f64));
        let world_from_index = *caster.world_from_index * DAffine3::from_translation(shift);
        let nothing_cut = GridClip::default();
        let caster = Caster {
            field: &field,
            world_from_index: &world_from_index,
            clip: &nothing_cut,
            ..caster.clone()
        };
        let fine = find(&caster);
        let coarse = caster.averaged(own);
        let world_from_coarse = own.world_from_index(&world_from_index);
        let light = find(&caster.coarse(&coarse, &world_from_coarse, &nothing_cut));
        let light = light.finer(&coarse, &field.bricks);
        for (sums, [fine, coarse]) in sums
            .iter_mut()
            .zip([[&fine.sun, &light.sun], [&fine.sky, &light.sky]])
        {
            if let (Some(fine), Some(coarse)) = (fine, coarse) {
                compare(&caster, [fine, coarse], sums);
            }
        }
    }
    sums.map(|sums| sums.ratio())
}

/// Adds the light on the matter of the inner bricks of a box.
fn compare(caster: &Caster, [fine, coarse]: [&LightTables; 2], sums: &mut Sums) {
    let from_differences = {
        let in_pictures = in_unit(caster.world_from_index, caster.length);
        FromDifferences::new(&in_pictures.matrix3)
    };
    let end = ((BOX_BRICKS - 1) * CELL_SIDE) as u32;
    for (number, brick) in caster.field.bricks.iter().enumerate() {
        if brick.bounds.corner.iter().any(|&at| at == 0 || at >= end) {
            continue;
        }
        for vertex in 0..TABLE_LEN {
            let strength = f64::from(caster.extinction((brick, vertex), &from_differences));
            let light = |tables: &LightTables| {
                let root = f64::from(byte_at(tables.of_brick(number), vertex));
                f64::from(tables.gain) * (root / f64::from(FULL_LIGHT)).powi(2)
            };
            let (fine, coarse) = (light(fine), light(coarse));
            sums.fine += strength * fine * fine;
            sums.coarse += strength * fine * coarse;
        }
    }
}
