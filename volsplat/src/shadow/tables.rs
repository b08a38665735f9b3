//! The light at the vertices of bricks.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_core::narrow::{byte, single, whole};
use resample_core::simd::Vectors;

use crate::bricks::cells::{ByteTable, CellBrick, CellField, FaceBytes, FromDifferences, faces_of};
use crate::grid::in_unit;
use crate::light::{FULL_LIGHT, Gains, GradientCurve};
use crate::look::clip::GridClip;
use crate::look::options::Shadow;
use crate::shadow::brightness::{Falls, Lit};
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
        let medium = match self.surface {
            Some(scalar) => Medium::of_surface(&self.channels[0].table, scalar),
            None => Medium::new(self.channels, self.ramp.is_some()),
        };
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
        let are_scalars = matches!(medium, Medium::Scalars(_));
        vertices.of_bricks(|brick, first, numbers| {
            if are_scalars {
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
    fn extinction(
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
