//! The light at the vertices of bricks.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_core::narrow::{code8, single, whole};
use resample_core::simd::Vectors;

use crate::bricks::cells::{
    ByteTable, CellField, FaceBytes, FromDifferences, TABLE_LEN, Table, faces_of,
};
use crate::grid::in_unit;
use crate::light::{FULL_LIGHT, Gains, GradientRamp};
use crate::look::clip::GridClip;
use crate::look::options::Shadow;
use crate::shadow::brightness::{Falls, Lit};
use crate::shadow::medium::Medium;
use crate::shadow::places::Places;
use crate::shadow::sharpen::sharpened;
use crate::shadow::sky::Sky;
use crate::shadow::slices::{Axes, LayerTables, Numbers, Stack};
use crate::shadow::strengths::{around_vertices, skins};
use crate::shadow::sweep::{Blocking, Met, Ray, add};
use crate::slabs::settings::ChannelSettings;
use crate::slabs::table::TransferTable;

/// Directions over the disc of a light that has a size: at least, and at most, which one of 10 degrees has. So smaller ones, whose half shadows are
/// narrower, have errors that are no larger and take less time.
const DIRECTIONS: [f64; 2] = [4.0, 16.0];
const MOST_AT_DEG: f64 = 10.0;

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
    gain: f32,
}

/// The field that casts shadows, and how its scalars become extinction.
pub(crate) struct Caster<'a> {
    pub(crate) field: &'a CellField,
    pub(crate) channels: &'a [ChannelSettings],
    pub(crate) ramp: Option<GradientRamp>,
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
    /// The slices across z; `None` where there is no brick.
    stack: Option<Stack<'a>>,
    /// For each brick, the numbers at its vertices.
    numbers: Vec<Table>,
    /// How they become extinction.
    medium: Medium,
    /// For each brick, the mean extinction around its vertices, per opacity unit.
    strengths: Vec<Table>,
    /// For each brick, how far the matter around its vertices is skin.
    skins: Vec<Table>,
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
        let (numbers, medium) = self.numbers();
        let stack = Stack::new(self.field, Axes::across(2));
        let [x, y, z] = self.spacing();
        let step = x.min(y).min(z);
        let found = stack.as_ref().map(|stack| {
            let strengths = around_vertices(stack, &numbers, &medium);
            let skins = skins(stack, &strengths, self.clip, step);
            (strengths, skins)
        });
        let (strengths, skins) = found.unwrap_or_default();
        Matter {
            stack,
            numbers,
            medium,
            strengths,
            skins,
        }
    }

    /// The numbers at the vertices of the bricks, and how they become extinction.
    fn numbers(&self) -> (Vec<Table>, Medium) {
        let medium = match self.surface {
            Some(scalar) => Medium::of_surface(&self.channels[0].table, scalar),
            None => Medium::new(self.channels, self.ramp.is_some()),
        };
        let in_pictures = in_unit(self.world_from_index, self.length);
        let from_differences = FromDifferences::new(&in_pictures.matrix3);
        let numbers = Numbers {
            channels: self.channels,
            ramp: self.ramp,
            from_differences: &from_differences,
            are_scalars: matches!(medium, Medium::Scalars(_)),
        };
        (numbers.of_bricks(&self.field.bricks), medium)
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
        let field = caster.field;
        let blocking = Blocking {
            numbers: &matter.numbers,
            medium: &matter.medium,
            skins: &matter.skins,
            clip: caster.clip,
        };
        let index_from_world = caster.world_from_index.matrix3.inverse();
        let directions = directions(towards, shadow.light_size_deg);
        let weight = 1.0 / directions.len() as f32;
        let mut by_axis: [Option<(Stack, LayerTables)>; 3] = [const { None }; 3];
        let mut met = Met::default();
        for direction in directions {
            let ray = Ray::new(index_from_world * direction * caster.opacity_unit);
            let of_axis = &mut by_axis[ray.axes.along];
            if of_axis.is_none() {
                *of_axis = Stack::new(field, ray.axes).map(|stack| {
                    let tables = stack.tables();
                    (stack, tables)
                });
            }
            if let Some((stack, tables)) = of_axis {
                met.add(add(&blocking, (&ray, stack), (tables, weight)));
            }
        }
        let mut shares = vec![[0.0f32; TABLE_LEN]; field.bricks.len()];
        for (stack, tables) in by_axis.into_iter().flatten() {
            stack.add_to_bricks(&tables, &mut shares);
        }
        Self {
            faces: bytes_of(&shares),
            gain: single(1.0 / met.mean()),
        }
    }

    /// The light of the sky, up to a radius in world units.
    pub(crate) fn of_sky(caster: &Caster, matter: &Matter, radius: f64) -> Self {
        let field = caster.field;
        let Some(stack) = &matter.stack else {
            return Self {
                faces: Vec::new(),
                gain: 1.0,
            };
        };
        let sky = Sky {
            field,
            strengths: &matter.strengths,
            skins: &matter.skins,
            clip: caster.clip,
            world_from_grid: caster.world_from_index.matrix3,
            radius,
            opacity_unit: caster.opacity_unit,
            level: caster.level,
        };
        let shares = sharpened(stack, &sky.shares());
        let seen = Lit {
            field,
            places: &Places::new(field),
            numbers: &matter.numbers,
            medium: &matter.medium,
            colours: caster.colours(&matter.medium),
            falls: caster.sky_falls,
            clip: caster.clip,
            shares: &shares,
            spacing: caster.spacing(),
        }
        .mean_seen();
        Self {
            faces: bytes_of(&shares),
            gain: single(1.0 / seen),
        }
    }
}

/// The square roots of shares, in bytes.
fn bytes_of(shares: &[Table]) -> Vec<FaceBytes> {
    let faces = shares.par_iter().map(|shares| {
        let byte = |share: f32| {
            code8(f64::from(
                (FULL_LIGHT * share.clamp(0.0, 1.0).sqrt()).round(),
            ))
        };
        let bytes: ByteTable = shares.map(byte);
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
