//! The light at the vertices of bricks.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_core::narrow::{code8, single};

use crate::bricks::cells::{ByteTable, CellField, FaceBytes, FromDifferences, TABLE_LEN, faces_of};
use crate::grid::in_unit;
use crate::light::{FULL_LIGHT, GradientRamp};
use crate::look::clip::GridClip;
use crate::look::options::Shadow;
use crate::shadow::medium::Medium;
use crate::shadow::slices::{Layer, Numbers, layers};
use crate::shadow::sweep::{Matter, Met, Ray, add};
use crate::slabs::settings::ChannelSettings;

/// Directions over the disc of a light that has a size.
const DIRECTIONS: u32 = 16;

/// For each brick of a field, by its number, the square root of the share of light that reaches its vertices, in bytes.
#[derive(Clone, Debug)]
pub(crate) struct ShadowTables {
    faces: Vec<FaceBytes>,
    /// A factor of the diffuse light and the highlight, so that a lit surface is as bright as without shadows.
    pub(crate) gain: f32,
}

/// The field that casts shadows, and how its scalars become extinction.
pub(crate) struct Caster<'a> {
    pub(crate) field: &'a CellField,
    pub(crate) channels: &'a [ChannelSettings],
    pub(crate) ramp: Option<GradientRamp>,
    pub(crate) clip: &'a GridClip,
    pub(crate) world_from_index: &'a DAffine3,
    /// Length in which pictures count, and over which opacity is meant, world units.
    pub(crate) length: f64,
    pub(crate) opacity_unit: f64,
}

impl ShadowTables {
    /// The light from around the unit direction `towards`, which points towards it in the world.
    pub(crate) fn new(caster: &Caster, towards: DVec3, shadow: &Shadow) -> Self {
        let field = caster.field;
        let medium = Medium::new(caster.channels, caster.ramp.is_some());
        let in_pictures = in_unit(caster.world_from_index, caster.length);
        let from_differences = FromDifferences::new(&in_pictures.matrix3);
        let numbers = Numbers {
            channels: caster.channels,
            ramp: caster.ramp,
            from_differences: &from_differences,
            are_scalars: matches!(medium, Medium::Scalars(_)),
        };
        let matter = Matter {
            field,
            numbers: numbers.of_bricks(&field.bricks),
            medium,
            clip: caster.clip,
        };
        let index_from_world = caster.world_from_index.matrix3.inverse();
        let directions = directions(towards, shadow.light_size_deg);
        let weight = 1.0 / directions.len() as f32;
        let mut by_axis: [Vec<Layer>; 3] = [const { Vec::new() }; 3];
        let mut met = Met::default();
        for direction in directions {
            let ray = Ray::new(index_from_world * direction * caster.opacity_unit);
            let layers = &mut by_axis[ray.axes.along];
            if layers.is_empty() {
                *layers = self::layers(field, ray.axes);
            }
            met.add(add(&matter, &ray, (layers, weight)));
        }
        let mut shares = vec![[0.0f32; TABLE_LEN]; field.bricks.len()];
        for layer in by_axis.into_iter().flatten() {
            for (brick, values) in layer.bricks.iter().zip(&layer.values) {
                for (sum, value) in shares[*brick].iter_mut().zip(values) {
                    *sum += value;
                }
            }
        }
        let faces = shares.par_iter().map(|shares| {
            let byte = |share: f32| {
                code8(f64::from(
                    (FULL_LIGHT * share.clamp(0.0, 1.0).sqrt()).round(),
                ))
            };
            let bytes: ByteTable = shares.map(byte);
            *faces_of(&bytes)
        });
        Self {
            faces: faces.collect(),
            gain: single(1.0 / met.mean()),
        }
    }

    /// The light at the vertices of a brick.
    pub(crate) fn of_brick(&self, number: usize) -> &FaceBytes {
        &self.faces[number]
    }
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
    let direction = |number: u32| {
        let from_middle = radius * ((f64::from(number) + 0.5) / f64::from(DIRECTIONS)).sqrt();
        let (sin, cos) = (TURN * f64::from(number)).sin_cos();
        let across = cos * right + sin * up;
        from_middle.cos() * towards + from_middle.sin() * across
    };
    (0..DIRECTIONS).map(direction).collect()
}
