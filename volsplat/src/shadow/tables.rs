//! The light at the vertices of bricks.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_core::narrow::{byte, single, whole};
use resample_core::simd::Vectors;

use crate::bricks::cells::{
    ByteTable, CELL_SIDE, CELLS, CellBrick, CellField, FaceBytes, FromDifferences, faces_of,
};
use crate::grid::in_unit;
use crate::light::{FULL_LIGHT, Gains, GradientCurve};
use crate::look::clip::GridClip;
use crate::look::options::{RenderOptions, Shadow};
use crate::shadow::brightness::{Falls, Lit};
use crate::shadow::coarse::{BoxSums, CoarseField, CoarseGrid, Span, Summed};
use crate::shadow::medium::Medium;
use crate::shadow::sharpen::sharpened_roots;
use crate::shadow::sheet::Line;
use crate::shadow::sky::Sky;
use crate::shadow::strengths::{around_vertices, skins};
use crate::shadow::surface::{Surface, divide};
use crate::shadow::sweep::{Blocking, Met, Ray, add};
use crate::shadow::vertices::{Around, Skins, Soft, Vertices};
use crate::slabs::settings::{ChannelSettings, Reading, Role};
use crate::slabs::table::TransferTable;

/// Directions over the disc of a light that has a size: at least, and at most, which one of 10 degrees has. So smaller ones, whose half shadows are
/// narrower, have errors that are no larger and take less time.
const DIRECTIONS: [f64; 2] = [4.0, 16.0];
const MOST_AT_DEG: f64 = 10.0;

/// Most memory that finding light takes for each voxel of the bricks, bytes: 14 for one of shadows and occlusion and 17 for both were measured.
const BYTES_PER_VOXEL: usize = 17;

/// Most memory that light takes for each brick, bytes.
pub(crate) fn brick_bytes(options: &RenderOptions) -> u64 {
    match options.blocks_light() {
        true => (BYTES_PER_VOXEL * CELLS) as u64,
        false => 0,
    }
}

/// The light that reaches the bricks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reaching {
    /// From the light, where shadows are drawn.
    pub(crate) sun: Option<LightTables>,
    /// From the sky, where occlusion is drawn.
    pub(crate) sky: Option<LightTables>,
}

/// The light at the vertices of a brick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BrickLight<'a> {
    pub(crate) sun: Option<&'a FaceBytes>,
    pub(crate) sky: Option<&'a FaceBytes>,
}

impl Reaching {
    /// The light at the vertices of a brick.
    pub(crate) fn of_brick(&self, number: usize) -> BrickLight<'_> {
        BrickLight {
            sun: self.sun.as_ref().map(|tables| &tables.faces[number]),
            sky: self.sky.as_ref().map(|tables| &tables.faces[number]),
        }
    }

    /// The same light at the vertices of bricks of the grid that a coarse field is of.
    pub(crate) fn finer(&self, coarse: &CoarseField, bricks: &[CellBrick]) -> Self {
        let [sun, sky] = [&self.sun, &self.sky].map(|tables| {
            let finer = |tables: &LightTables| tables.finer(coarse, bricks);
            tables.as_ref().map(finer)
        });
        Self { sun, sky }
    }

    /// Takes light that was found.
    pub(crate) fn add(&mut self, found: Self) {
        self.sun = found.sun.or(self.sun.take());
        self.sky = found.sky.or(self.sky.take());
    }

    /// The light times factors of the sun's and of the sky's.
    pub(crate) fn brighter(mut self, [of_sun, of_sky]: [f32; 2]) -> Self {
        for (tables, factor) in [(&mut self.sun, of_sun), (&mut self.sky, of_sky)] {
            if let Some(tables) = tables {
                tables.gain *= factor;
            }
        }
        self
    }

    /// Bytes of memory.
    pub(crate) fn bytes(&self) -> u64 {
        let tables = [&self.sun, &self.sky].into_iter().flatten();
        tables.map(LightTables::bytes).sum()
    }

    /// The factors that keep pictures as bright as without.
    pub(crate) fn gains(&self) -> Gains {
        let of = |tables: &Option<LightTables>| tables.as_ref().map(|tables| tables.gain);
        Gains {
            sun: of(&self.sun),
            sky: of(&self.sky),
        }
    }
}

/// For each brick of a field, by its number, the square root of the share of light that reaches its vertices, in bytes.
#[derive(Clone, Debug)]
pub(crate) struct LightTables {
    faces: Vec<FaceBytes>,
    /// A factor of the light, so that a lit surface is as bright as without shadows.
    pub(super) gain: f32,
}

/// The numbers at the vertices of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Numbers {
    /// Scalars of its channels.
    OfChannels,
    /// Means over boxes: of scalars where an isosurface is drawn, else of extinction per opacity unit.
    OfBoxes,
}

/// The field that casts shadows, and how its scalars become extinction.
#[derive(Clone)]
pub(crate) struct Caster<'a> {
    pub(crate) field: &'a CellField,
    pub(crate) numbers: Numbers,
    pub(crate) channels: &'a [ChannelSettings],
    pub(crate) ramp: Option<GradientCurve>,
    /// The scalar of the surface that is drawn in place of matter.
    pub(crate) surface: Option<f32>,
    pub(crate) clip: &'a GridClip,
    pub(crate) world_from_index: &'a DAffine3,
    /// Length in which pictures count, and over which opacity is meant, world units.
    pub(crate) length: f64,
    pub(crate) opacity_unit: f64,
    /// The light that the sky's share dims.
    pub(crate) sky_falls: Falls,
    pub(crate) level: Vectors,
}

/// The matter of a field.
pub(crate) struct Matter<'a> {
    /// Its vertices, in rows along x; `None` where there is no brick.
    found: Option<Found<'a>>,
    /// How numbers become extinction.
    medium: Medium,
}

/// Matter at vertices.
struct Found<'a> {
    vertices: Vertices<'a>,
    /// Scalars or extinction, NaN where nothing is shown.
    numbers: Vec<f32>,
    /// The mean extinction around them, per opacity unit.
    strengths: Vec<f32>,
    /// How far the matter around them is skin.
    skins: Skins,
    /// The layer around the isosurface, if one is drawn.
    soft: Option<Soft>,
}

impl<'a> Caster<'a> {
    /// From a vertex to the next along each axis, opacity units.
    fn spacing(&self) -> [f32; 3] {
        let axis = |axis| self.world_from_index.transform_vector3(axis).length();
        DVec3::AXES.map(|along| single(axis(along) / self.opacity_unit))
    }

    /// The colours of the numbers at vertices, where they are scalars.
    fn colours(&self, medium: &Medium) -> Option<&'a TransferTable> {
        let are_scalars = matches!(medium, Medium::Scalars(_)) && self.surface.is_none();
        are_scalars.then(|| &self.channels[0].table)
    }

    /// The matter that takes light.
    pub(crate) fn matter(&self) -> Matter<'a> {
        let medium = self.medium();
        let [x, y, z] = self.spacing();
        let step = x.min(y).min(z);
        let found = Vertices::new(self.field, [0, 1, 2]).map(|vertices| {
            let numbers = self.numbers(&vertices, &medium);
            if let Some(scalar) = self.surface {
                let (strengths, soft) = self.soft(&vertices, (&numbers, scalar));
                return Found {
                    skins: Skins::none(&vertices),
                    vertices,
                    numbers,
                    strengths,
                    soft: Some(soft),
                };
            }
            let strengths = around_vertices(&vertices, &numbers, &medium, self.level);
            let skins = skins(&vertices, &strengths, self.clip, step);
            Found {
                vertices,
                numbers,
                strengths,
                skins,
                soft: None,
            }
        });
        Matter { found, medium }
    }

    /// How the numbers at vertices become extinction.
    fn medium(&self) -> Medium {
        match (self.surface, self.numbers) {
            (Some(scalar), _) => Medium::of_surface(&self.channels[0].table, scalar),
            (None, Numbers::OfBoxes) => Medium::Extinction,
            (None, Numbers::OfChannels) => Medium::new(self.channels, self.ramp.is_some()),
        }
    }

    /// The numbers whose means a coarse grid takes.
    pub(crate) fn summed(&self) -> Summed {
        match self.surface {
            Some(scalar) => Summed::Scalars(scalar),
            None => Summed::Extinction,
        }
    }

    /// The sums, in boxes of a coarse grid, of this field, whose cells lie in these spans. No two overlap.
    pub(crate) fn box_sums(&self, grid: CoarseGrid, spans: &[Span]) -> Vec<BoxSums> {
        let of = (grid, self.summed());
        if self.surface.is_some() {
            let of_span = |span| BoxSums::of_scalars(of, &self.field.bricks, span);
            return spans.par_iter().map(of_span).collect();
        }
        let Some(vertices) = Vertices::new(self.field, [0, 1, 2]) else {
            return Vec::new();
        };
        let medium = self.medium();
        let numbers = self.numbers(&vertices, &medium);
        let strengths = around_vertices(&vertices, &numbers, &medium, self.level);
        let of_span = |span| BoxSums::of(of, (&vertices, &strengths), span);
        spans.par_iter().map(of_span).collect()
    }

    /// The means of all of its matter.
    pub(crate) fn averaged(&self, grid: CoarseGrid) -> CoarseField {
        let whole = grid.whole();
        let mut sums = BoxSums::none((grid, self.summed()), &whole);
        let layers = (0..whole[2][1]).step_by(CELL_SIDE);
        let of_layer = |first: usize| {
            let end = (first + CELL_SIDE).min(whole[2][1]);
            [whole[0], whole[1], [first, end]]
        };
        let spans: Vec<Span> = layers.map(of_layer).collect();
        for part in self.box_sums(grid, &spans) {
            sums.add(&part);
        }
        sums.field()
    }

    /// The caster of the means of this one's matter.
    pub(crate) fn coarse<'c>(
        &'c self,
        field: &'c CoarseField,
        world_from_index: &'c DAffine3,
        clip: &'c GridClip,
    ) -> Caster<'c> {
        Caster {
            field: &field.cells,
            numbers: Numbers::OfBoxes,
            clip,
            world_from_index,
            ..self.clone()
        }
    }

    /// The layer around an isosurface, from the scalars at vertices.
    fn soft(&self, vertices: &Vertices, (scalars, scalar): (&[f32], f32)) -> (Vec<f32>, Soft) {
        let units_from_grid = self.world_from_index.matrix3 * (1.0 / self.opacity_unit);
        let surface = Surface {
            vertices,
            scalar,
            scalars,
            normals_from_grid: units_from_grid.inverse().transpose(),
            spacing: self.spacing(),
            axes: units_from_grid.transpose(),
        };
        surface.soft()
    }

    /// The numbers at vertices, NaN where the mask hides them.
    fn numbers(&self, vertices: &Vertices, medium: &Medium) -> Vec<f32> {
        let in_pictures = in_unit(self.world_from_index, self.length);
        let from_differences = FromDifferences::new(&in_pictures.matrix3);
        let are_held = matches!(medium, Medium::Scalars(_)) || self.numbers == Numbers::OfBoxes;
        vertices.of_bricks(|brick, first, numbers| {
            if are_held {
                brick.scalars.copy_row(first, numbers);
            } else {
                for (number, vertex) in numbers.iter_mut().zip(first..) {
                    *number = self.extinction((brick, vertex), &from_differences);
                }
            }
            if let Some(mask) = &brick.mask {
                for (number, kept) in numbers.iter_mut().zip(&mask[first..]) {
                    if *kept == 0 {
                        *number = f32::NAN;
                    }
                }
            }
        })
    }

    /// The sum over the channels.
    pub(super) fn extinction(
        &self,
        (brick, vertex): (&CellBrick, usize),
        from_differences: &FromDifferences,
    ) -> f32 {
        let mut sum = 0.0;
        for (number, channel) in self.channels.iter().enumerate() {
            if channel.role != Role::Extinction {
                continue;
            }
            let cells = brick.channel(number);
            let strength = channel.table.at(cells.scalars.at(vertex))[3];
            let factor = match (&self.ramp, cells.gradients, channel.reading) {
                (Some(ramp), Some(gradients), Reading::Trilinear) => {
                    ramp.of_gradient(gradients.at(vertex, from_differences))
                }
                _ => 1.0,
            };
            sum += strength * factor;
        }
        sum
    }
}

impl LightTables {
    /// The light from around the unit direction `towards`, which points towards it in the world.
    pub(crate) fn of_sun(
        caster: &Caster,
        matter: &Matter,
        towards: DVec3,
        shadow: &Shadow,
    ) -> Self {
        let Some(found) = &matter.found else {
            return Self::none();
        };
        let index_from_world = caster.world_from_index.matrix3.inverse();
        let directions = directions(towards, shadow.light_size_deg);
        let weight = 1.0 / directions.len() as f32;
        let ray = |direction: DVec3| {
            let in_grid = index_from_world * direction * caster.opacity_unit;
            Ray::new(in_grid, direction.as_vec3())
        };
        let rays = directions.into_iter().map(ray).collect();
        let mut met = Met::default();
        let (numbers, medium) = match found.soft {
            Some(_) => (&found.strengths, &Medium::Extinction),
            None => (&found.numbers, &matter.medium),
        };
        let around = found.around(numbers);
        let mut shares = shares(
            around,
            rays,
            |ray| ray.along,
            |matter_of, rays, shares| {
                let blocking = Blocking {
                    matter: matter_of,
                    medium,
                    clip: caster.clip,
                    level: caster.level,
                };
                for ray in rays {
                    met.add(add(&blocking, ray, (&mut *shares, weight)));
                }
            },
        );
        for share in &mut shares {
            *share = share.sqrt();
        }
        // A flat isosurface has all of its light.
        let mean = if found.soft.is_some() {
            1.0
        } else {
            met.mean()
        };
        Self {
            faces: bytes_of(&found.vertices, &shares),
            gain: single(1.0 / mean),
        }
    }

    /// The light of the sky, up to a radius in world units.
    pub(crate) fn of_sky(caster: &Caster, matter: &Matter, radius: f64) -> Self {
        let Some(found) = &matter.found else {
            return Self::none();
        };
        let sky = Sky {
            clip: caster.clip,
            world_from_grid: caster.world_from_index.matrix3,
            radius,
            opacity_unit: caster.opacity_unit,
            is_surface: found.soft.is_some(),
            level: caster.level,
        };
        let lines = sky.lines();
        let add =
            |matter: Around, lines: &[Line], shares: &mut [f32]| sky.add(matter, lines, shares);
        let around = found.around(&found.strengths);
        let mut shares = shares(around, lines.clone(), |line| line.along, add);
        if let Some(soft) = &found.soft {
            divide(&mut shares, soft, &lines);
        }
        let roots = sharpened_roots(&found.vertices, &shares, caster.level);
        let seen = Lit {
            vertices: &found.vertices,
            numbers: &found.numbers,
            medium: &matter.medium,
            colours: caster.colours(&matter.medium),
            falls: caster.sky_falls,
            clip: caster.clip,
            roots: &roots,
            spacing: caster.spacing(),
        }
        .mean_seen();
        Self {
            faces: bytes_of(&found.vertices, &roots),
            gain: single(1.0 / seen),
        }
    }

    /// The same light at the vertices of bricks of the grid that a coarse field is of.
    pub(crate) fn finer(&self, coarse: &CoarseField, bricks: &[CellBrick]) -> Self {
        let of_brick = |brick: &CellBrick| coarse.light_in(&self.faces, brick.bounds.corner);
        Self {
            faces: bricks.par_iter().map(of_brick).collect(),
            gain: self.gain,
        }
    }

    /// The light at the vertices of a brick.
    pub(super) fn of_brick(&self, number: usize) -> &FaceBytes {
        &self.faces[number]
    }

    /// Bytes of memory.
    pub(crate) fn bytes(&self) -> u64 {
        size_of_val(self.faces.as_slice()) as u64
    }

    fn none() -> Self {
        Self {
            faces: Vec::new(),
            gain: 1.0,
        }
    }
}

impl Found<'_> {
    fn around<'n>(&'n self, numbers: &'n [f32]) -> Around<'n> {
        Around {
            vertices: &self.vertices,
            numbers,
            skins: &self.skins,
            soft: self.soft.as_ref(),
        }
    }
}

/// A share for each vertex: what `add` adds to it for each direction. `along` is the axis of a direction.
fn shares<D>(
    matter: Around,
    directions: Vec<D>,
    along: impl Fn(&D) -> usize,
    mut add: impl FnMut(Around, &[D], &mut [f32]),
) -> Vec<f32> {
    let directions = directions.into_iter();
    let (follow_rows, across): (Vec<D>, Vec<D>) = directions.partition(|one| along(one) == 0);
    let mut shares = vec![0.0; matter.numbers.len()];
    add(matter, &across, &mut shares);
    if follow_rows.is_empty() {
        return shares;
    }
    // Directions that follow rows want other rows.
    let vertices = matter.vertices.turned();
    let moved = |numbers: &[f32]| matter.vertices.moved(numbers, &vertices);
    let soft = (matter.soft).map(|soft| soft.moved(matter.vertices, &vertices));
    let turned = Around {
        vertices: &vertices,
        numbers: &moved(matter.numbers),
        skins: &Skins::new(&vertices, moved(&matter.skins.shares)),
        soft: soft.as_ref(),
    };
    let mut more = vec![0.0; shares.len()];
    add(turned, &follow_rows, &mut more);
    for (share, more) in shares
        .iter_mut()
        .zip(vertices.moved(&more, matter.vertices))
    {
        *share += more;
    }
    shares
}

/// The square roots of shares at vertices, in bytes, for each brick.
fn bytes_of(vertices: &Vertices, roots: &[f32]) -> Vec<FaceBytes> {
    let bricks = (0..vertices.field.bricks.len()).into_par_iter();
    let faces = bricks.map(|brick| {
        let of_root = |root: f32| byte(FULL_LIGHT * root.clamp(0.0, 1.0));
        let bytes: ByteTable = vertices.of_brick(brick, roots).map(of_root);
        *faces_of(&bytes)
    });
    faces.collect()
}

/// Unit directions spread evenly over a disc of this diameter around one.
fn directions(towards: DVec3, size_deg: f64) -> Vec<DVec3> {
    if size_deg == 0.0 {
        return vec![towards];
    }
    /// The golden angle: no two directions stand side by side.
    const TURN: f64 = 2.399_963_229_728_653;
    let (right, up) = towards.any_orthonormal_pair();
    let radius = (0.5 * size_deg).to_radians();
    let [least, most] = DIRECTIONS;
    let count = (most * size_deg / MOST_AT_DEG).ceil().clamp(least, most);
    let direction = |number: u64| {
        let number = number as f64;
        let from_middle = radius * ((number + 0.5) / count).sqrt();
        let (sin, cos) = (TURN * number).sin_cos();
        let across = cos * right + sin * up;
        from_middle.cos() * towards + from_middle.sin() * across
    };
    (0..whole(count)).map(direction).collect()
}
