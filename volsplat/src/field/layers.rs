//! Planes beside the colour: where a ray first meets something, which way that faces, how many samples it took.
//!
//! Takes the bricks of cells and a camera, walks one ray through the middle of each pixel, on the sheets that the picture
//! is made of, and gives the planes that were asked for. It is a pass of its own, so that pictures without planes cost
//! nothing. Slow and plain: f64, one sample at a time; stretches without bricks are stepped over.
//! Limits: one channel of scalars in memory, emission and absorption. There are neither points nor splats here: the plane
//! that tells them apart is drawn by the orders of samples.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use resample_core::image::Plane;
use resample_core::{Camera, GridView, OpacityMode};

use super::driver::{FieldPipeline, Source};
use crate::Error;
use crate::bricks::cells::{CELL_SIDE, CellBrick, CellField, VERTEX_SIDE};
use crate::field::settings::FieldSettings;
use crate::look::clip::GridClip;
use crate::look::options::Blend;

/// A plane, or planes that belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Layer {
    /// Camera z at which the ray first meets something: channel depth.first
    ///
    /// World units; +infinity where the ray meets nothing that the transfer function shows. The opacity-weighted mean is
    /// the picture's own depth.
    FirstHit,
    /// Camera z before which half of the ray's opacity lies: channel depth.median
    ///
    /// World units; +infinity where the ray meets nothing. Faint samples before a surface do not move it, as they do the
    /// first hit.
    MedianDepth,
    /// Mean normal, towards the eye, times opacity: channels normal.X, normal.Y, normal.Z
    ///
    /// The mean of the samples' unit normals, weighted by their share of the pixel: minus the gradient of the scalar, in
    /// the world.
    Normal,
    /// Samples in cells that show something until the ray was opaque: channel samples
    Samples,
    /// Share of points in the opacity, the rest being splats: channel selection (every-sample, axis-sheets)
    ///
    /// 0 to 1; 0 where nothing is seen.
    Selection,
}

/// The result of one ray.
#[derive(Clone, Copy, Debug)]
struct Traced {
    first: f64,
    median: f64,
    normal: DVec3,
    samples: u32,
}

/// Halvings of the stretch between two sheets in which something first shows: 1/4096 of a sheet.
const HALVINGS: u32 = 12;

/// No brick here.
const NONE: u32 = u32::MAX;

impl FieldPipeline {
    /// The planes of one picture.
    pub(crate) fn layers(&self, camera: &Camera, wanted: &[Layer]) -> Result<Vec<Plane>, Error> {
        if wanted.is_empty() {
            return Ok(Vec::new());
        }
        let camera = camera.in_unit(self.length);
        let view = self.view(&camera);
        let settings = self.settings(&view, &camera);
        let plain =
            self.options.blend() == Blend::Emission && self.options.gradient_opacity.is_none();
        // Only scenes of one channel of scalars and no mask know what they keep.
        let (Source::Cells(field), Some(_), true) = (&self.source, &self.kept, plain) else {
            return Err(refused());
        };
        let tracer = Tracer::new(field, &self.clip, &view, &settings);
        let (width, height) = (camera.width as usize, camera.height as usize);
        let trace = |i: usize| {
            tracer.trace(DVec2::new(
                (i % width) as f64 + 0.5,
                (i / width) as f64 + 0.5,
            ))
        };
        let traced: Vec<Traced> = (0..width * height).into_par_iter().map(trace).collect();
        let plane = |name: &str, value: &dyn Fn(&Traced) -> f64| Plane {
            name: name.to_owned(),
            values: traced.iter().map(|traced| value(traced) as f32).collect(),
        };
        let mut planes = Vec::new();
        for layer in wanted {
            match layer {
                Layer::FirstHit => {
                    planes.push(plane("depth.first", &|traced| traced.first * self.length))
                }
                Layer::MedianDepth => {
                    planes.push(plane("depth.median", &|traced| traced.median * self.length))
                }
                Layer::Normal => {
                    planes.push(plane("normal.X", &|traced| traced.normal.x));
                    planes.push(plane("normal.Y", &|traced| traced.normal.y));
                    planes.push(plane("normal.Z", &|traced| traced.normal.z));
                }
                Layer::Samples => {
                    planes.push(plane("samples", &|traced| f64::from(traced.samples)))
                }
                Layer::Selection => return Err(refused()),
            }
        }
        Ok(planes)
    }
}

/// The error where there are no cells to walk through.
pub(crate) fn refused() -> Error {
    let what = "planes beside the colour: first hits, normals and sample counts are made of the field of one channel of \
                scalars in memory, without a mask, opacity by the gradient or another blend; the selection in the \
                orders of samples, every-sample and axis-sheets";
    Error::Option(what.into())
}

struct Tracer<'a> {
    bricks: &'a [CellBrick],
    /// The brick of each place in the grid of bricks, x fastest.
    places: Vec<u32>,
    /// Places along each axis.
    along: [usize; 3],
    clip: &'a GridClip,
    view: &'a GridView,
    settings: &'a FieldSettings,
    /// From a gradient in the grid to one in the world.
    world_from_gradient: DMat3,
    /// Camera z between which all bricks lie.
    reach: [f64; 2],
}

/// Where the transmittance passes the middle between 1 and its last value. Each sheet of this thickness counts as
/// fading evenly.
fn median(passed: &[[f64; 2]], thickness: f64) -> f64 {
    let Some([_, last]) = passed.last() else {
        return f64::INFINITY;
    };
    let wanted = 0.5 * (1.0 + last);
    let mut before = 1.0;
    for [z, behind] in passed {
        if *behind <= wanted && *behind < before {
            return z + thickness * ((before - wanted) / (before - behind) - 0.5);
        }
        before = *behind;
    }
    f64::INFINITY
}

/// A sample that lies in a cell.
struct Sample {
    strength: f64,
    /// Per voxel.
    gradient: DVec3,
}

impl<'a> Tracer<'a> {
    fn new(
        field: &'a CellField,
        clip: &'a GridClip,
        view: &'a GridView,
        settings: &'a FieldSettings,
    ) -> Self {
        let place = |brick: &CellBrick| {
            brick
                .bounds
                .corner
                .map(|corner| corner as usize / CELL_SIDE)
        };
        let mut along = [0; 3];
        let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
        for brick in &field.bricks {
            along = std::array::from_fn(|axis| along[axis].max(place(brick)[axis] + 1));
            for corner in brick.bounds.corners_in_grid(0.0) {
                let z = view.camera_from_grid.transform_point3(corner).z;
                reach = [reach[0].min(z), reach[1].max(z)];
            }
        }
        let mut places = vec![NONE; along.iter().product()];
        for (number, brick) in field.bricks.iter().enumerate() {
            let [x, y, z] = place(brick);
            places[x + along[0] * (y + along[1] * z)] = number as u32;
        }
        let world_from_grid = settings.sheets.world_from_camera * view.camera_from_grid.matrix3;
        let world_from_gradient = world_from_grid.inverse().transpose();
        Self {
            bricks: &field.bricks,
            places,
            along,
            clip,
            view,
            settings,
            world_from_gradient,
            reach,
        }
    }

    /// The ray through a position on the screen.
    fn trace(&self, pos_in_screen: DVec2) -> Traced {
        let (origin, direction) = self.view.ray(pos_in_screen);
        let thickness = self.settings.sheets.thickness;
        let at = |camera_z: f64| origin + camera_z * direction;
        let units =
            thickness * self.ray_in_camera(direction).length() / self.settings.sheets.unit_in_world;
        let mut traced = Traced {
            first: f64::INFINITY,
            median: f64::INFINITY,
            normal: DVec3::ZERO,
            samples: 0,
        };
        let mut transmittance = 1.0;
        // The middle of each sheet that shows something, and the transmittance behind it.
        let mut passed: Vec<[f64; 2]> = Vec::new();
        let mut number = (self.reach[0].max(self.view.near) / thickness - 0.5).ceil();
        while transmittance >= f64::from(self.settings.sheets.min_transmittance)
            && transmittance > 0.0
        {
            let z = (number + 0.5) * thickness;
            // Written so that a reach without bricks ends too.
            if !(z <= self.reach[1]) {
                break;
            }
            let sample = match self.sample(at(z)) {
                Ok(sample) => sample,
                Err(leaves) => {
                    // On to the first sheet beyond the empty brick.
                    let beyond = leaves.map_or(z, |[low, high]| exit(origin, direction, low, high));
                    number = (beyond / thickness - 0.5).floor().max(number) + 1.0;
                    continue;
                }
            };
            traced.samples += 1;
            number += 1.0;
            if sample.strength <= 0.0 {
                continue;
            }
            if traced.first == f64::INFINITY {
                traced.first = self.first(&at, [(z - thickness).max(self.view.near), z]);
            }
            let added = sample.strength * units;
            let opacity = match self.settings.sheets.opacity {
                OpacityMode::Extinction => -(-added).exp_m1(),
                OpacityMode::Linear => added.min(1.0),
            };
            let normal = -(self.world_from_gradient * sample.gradient).normalize_or_zero();
            let towards_eye = normal
                .dot(self.settings.sheets.world_from_camera * self.ray_in_camera(direction))
                <= 0.0;
            traced.normal += transmittance * opacity * if towards_eye { normal } else { -normal };
            transmittance *= 1.0 - opacity;
            passed.push([z, transmittance]);
        }
        traced.median = median(&passed, thickness);
        traced
    }

    fn ray_in_camera(&self, direction: DVec3) -> DVec3 {
        self.view.camera_from_grid.transform_vector3(direction)
    }

    /// The camera z between two, of which the second shows something, from which on something shows.
    fn first(&self, at: &impl Fn(f64) -> DVec3, [mut hidden, mut shown]: [f64; 2]) -> f64 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (hidden + shown);
            let shows = self
                .sample(at(middle))
                .is_ok_and(|sample| sample.strength > 0.0);
            if shows {
                shown = middle
            } else {
                hidden = middle
            }
        }
        shown
    }

    /// The sample at a position in the grid; where there is none, the box of the empty brick around it, if it is
    /// inside the grid of bricks.
    fn sample(&self, at: DVec3) -> Result<Sample, Option<[DVec3; 2]>> {
        let side = CELL_SIDE as f64;
        let place = (at / side).floor();
        let inside = (0..3).all(|axis| place[axis] >= 0.0 && place[axis] < self.along[axis] as f64);
        if !inside {
            return Err(None);
        }
        let [x, y, z] = place.to_array().map(|p| p as usize);
        let number = self.places[x + self.along[0] * (y + self.along[1] * z)];
        let Some(brick) = self.bricks.get(number as usize) else {
            return Err(Some([side * place, side * (place + 1.0)]));
        };
        let local = at - side * place;
        let [least, greatest] = brick.bounds.range().map(|end| end.map(f64::from));
        let shown = (0..3).all(|axis| local[axis] >= least[axis] && local[axis] <= greatest[axis]);
        if !shown || !self.clip.keeps(at) {
            return Err(None);
        }
        let (scalar, gradient) = interpolated(brick, local);
        Ok(Sample {
            strength: f64::from(self.settings.sheets.table.at(scalar as f32)[3]),
            gradient,
        })
    }
}

/// The trilinear scalar and its gradient at a position in a brick.
fn interpolated(brick: &CellBrick, local: DVec3) -> (f64, DVec3) {
    let cell = local
        .floor()
        .clamp(DVec3::ZERO, DVec3::splat((CELL_SIDE - 1) as f64));
    let share = local - cell;
    let [x, y, z] = cell.to_array().map(|c| c as usize);
    let (mut scalar, mut gradient) = (0.0, DVec3::ZERO);
    for corner in 0..8usize {
        let bits = [corner & 1, corner >> 1 & 1, corner >> 2];
        let place = x + bits[0] + VERTEX_SIDE * (y + bits[1] + VERTEX_SIDE * (z + bits[2]));
        let value = f64::from(brick.scalars.at(place));
        let weight = |axis: usize| {
            if bits[axis] == 1 {
                share[axis]
            } else {
                1.0 - share[axis]
            }
        };
        let sign = |axis: usize| if bits[axis] == 1 { 1.0 } else { -1.0 };
        scalar += weight(0) * weight(1) * weight(2) * value;
        gradient += value
            * DVec3::new(
                sign(0) * weight(1) * weight(2),
                weight(0) * sign(1) * weight(2),
                weight(0) * weight(1) * sign(2),
            );
    }
    (scalar, gradient)
}

/// Where a ray leaves a box that it is in, in its parameter.
fn exit(origin: DVec3, direction: DVec3, low: DVec3, high: DVec3) -> f64 {
    let ends = ((low - origin) / direction).max((high - origin) / direction);
    // An axis along which the ray does not move gives no end.
    (0..3)
        .map(|axis| ends[axis])
        .filter(|end| !end.is_nan())
        .fold(f64::INFINITY, f64::min)
}
