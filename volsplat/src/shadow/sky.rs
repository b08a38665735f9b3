//! The share of the sky that each vertex of the bricks sees: the mean, over directions, of the transmittance up to a radius.
//!
//! Directions come in pairs along lines of vertices. Depths are summed along each line once, and the depth between two vertices is the
//! difference of their sums, which serves both of them: one looks ahead and one looks back.

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::narrow::{count, single, whole};
use resample_core::simd::Vectors;

use crate::look::clip::{Cut, GridClip};
use crate::shadow::sheet::{Course, Line, Sheet, SheetRow, Sums};
use crate::shadow::vertices::Around;

/// Steps across slices from which on a line moves by a whole vertex in each slice: lines that move in some slices alone are ragged, which shows as
/// hatching. With whole steps directions are less evenly spread. In matter of cells twice as long as wide, ragged lines are better, 43 dB and
/// 33 from cubes; around isosurfaces of three times as long, whole ones are, 24.5 dB and 23.9.
const WHOLE_IN_MATTER: f64 = 0.55;
const WHOLE_AROUND_SURFACE: f64 = 0.3;

/// The sky around the vertices of a field.
pub(super) struct Sky<'a> {
    pub(super) clip: &'a GridClip,
    pub(super) world_from_grid: DMat3,
    /// World units.
    pub(super) radius: f64,
    pub(super) opacity_unit: f64,
    /// True if an isosurface is drawn.
    pub(super) is_surface: bool,
    pub(super) level: Vectors,
}

impl Sky<'_> {
    /// One of each two opposite directions.
    pub(super) fn lines(&self) -> Vec<Line> {
        let spacing = [0, 1, 2].map(|axis| self.world_from_grid.col(axis).length());
        let least_whole = if self.is_surface {
            WHOLE_AROUND_SURFACE
        } else {
            WHOLE_IN_MATTER
        };
        let mut lines = Vec::new();
        let mut directions = Vec::new();
        // One of each two opposite neighbours of a vertex: 13 of 26.
        for number in 14..27 {
            let signs = [number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1].map(f64::from);
            // Along the diagonals of a cube in the world, or of a cell where it is not much longer than wide: from vertex to vertex.
            let step = DVec3::from([0, 1, 2].map(|axis| signs[axis] / spacing[axis]));
            let step = step / step.abs().max_element();
            let nearest = |step: f64| {
                if step.abs() < least_whole {
                    step
                } else {
                    step.signum()
                }
            };
            let step = DVec3::from(step.to_array().map(nearest));
            // Slices across z and y are made of rows along x.
            let along = (0..3).rev().find(|axis| step[*axis].abs() == 1.0);
            let along = along.unwrap_or(2);
            let step = step / step[along];
            let in_world = self.world_from_grid * step;
            directions.push(in_world.normalize_or_zero());
            let slices = self.radius / in_world.length();
            lines.push(Line {
                along,
                step,
                length: single(in_world.length() / self.opacity_unit),
                reach: count(whole(slices.floor())),
                fraction: single(slices - slices.floor()),
                weight: 0.0,
                direction: in_world.normalize_or_zero().as_vec3(),
            });
        }
        for (line, share) in lines.iter_mut().zip(shares_of_sky(&directions)) {
            line.weight = single(0.5 * share);
        }
        lines
    }

    /// Adds the transmittance along these lines, both ways, to the shares that vertices see. No line follows their rows.
    pub(super) fn add(&self, matter: Around, lines: &[Line], shares: &mut [f32]) {
        let is_cut = |bounds: &_| !matches!(self.clip.cut(bounds), Cut::By(0));
        let cut =
            (!self.clip.is_whole()).then(|| matter.vertices.of(|brick| is_cut(&brick.bounds)));
        // Lines of the same sheets go through memory together.
        let courses = lines.iter().map(|line| Course::new(matter.vertices, line));
        let courses: Vec<Course> = courses.collect();
        for courses in courses.chunk_by(Course::has_sheets_of) {
            let mut sheets: Vec<Vec<SheetRow>> = Vec::new();
            sheets.resize_with(courses[0].sheets(), || {
                std::iter::repeat_with(|| None)
                    .take(courses[0].slices())
                    .collect()
            });
            for (row, shares) in matter.vertices.split(shares).into_iter().enumerate() {
                let [sheet, slice] = courses[0].sheet_of_row(matter.vertices, row);
                sheets[sheet][slice] = Some((row, shares));
            }
            let sums = || courses.iter().map(Sums::new).collect::<Vec<Sums>>();
            let sheets = sheets.into_par_iter();
            sheets.for_each_init(sums, |sums, mut rows| {
                for (course, sums) in courses.iter().zip(sums) {
                    let sheet = Sheet {
                        matter,
                        cut: cut.as_ref().map(|cut| (cut, self.clip)),
                        course,
                    };
                    dispatch!(self.level, simd => sheet.walk(simd, sums, &mut rows));
                }
            });
        }
    }
}

/// The share of the sphere that is nearest to each line.
fn shares_of_sky(lines: &[DVec3]) -> Vec<f64> {
    /// So many places give shares to about 1 %.
    const PLACES: u32 = 20_000;
    const TURN: f64 = 2.399_963_229_728_653;
    let mut counts = vec![0.0; lines.len()];
    for place in 0..PLACES {
        let z = (f64::from(place) + 0.5) / f64::from(PLACES) * 2.0 - 1.0;
        let (sin, cos) = (TURN * f64::from(place)).sin_cos();
        let flat = (1.0 - z * z).sqrt();
        let at = DVec3::new(flat * cos, flat * sin, z);
        let nearest = (0..lines.len()).fold(0, |nearest, line| {
            let is_nearer = lines[line].dot(at).abs() > lines[nearest].dot(at).abs();
            if is_nearer { line } else { nearest }
        });
        counts[nearest] += 1.0 / f64::from(PLACES);
    }
    counts
}
