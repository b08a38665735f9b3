//! The grid of rows and columns in which a scanner on a tripod takes its points, and those of them that say nothing of a surface.
//!
//! Takes the points of one station relative to the scanner, gives the fate of each. Two kinds are left out.
//! - **Mixed points**: a beam that meets the edge of one surface before another gives a range between both. Such a point lies
//!   between its two neighbours on a line of the grid, far behind the one and far before the other, and continues the surface of
//!   neither: on a plane the inverse of the range is nearly linear in the beam's angle, however aslant it is seen.
//! - **Crowded points**: near the poles of the grid, the beams of a row lie much closer than rows. Of so many, one is kept.
//!
//! Limits: edges and wires that are one beam wide stay, since they lie before both neighbours; a range that is mixed over two beams and
//! more is not found.

use glam::Vec3;
use rayon::prelude::*;
use resample_core::narrow::{count, whole};

/// A step of range between neighbours is a jump if it is so many times as long as rows are apart there: surfaces that the beam
/// meets at 7 degrees or less have such steps. A guess.
const JUMP: f32 = 8.0;

/// A point continues a surface if it lies off it by less than this part of the smaller jump. A guess.
const CONTINUES: f32 = 0.25;

/// Share of the beams of columns that must lie about as far apart as usual: otherwise the grid is not that of a scanner at the origin.
const EVEN_SHARE: f64 = 0.9;

/// Columns, or beams of a row, that stand for all where angles are measured.
const SAMPLED: usize = 256;

/// Lines through a point on which neighbours lie.
const LINES: [[isize; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];

/// Points of one station.
#[derive(Clone, Debug, Default)]
pub struct StationGrid {
    /// Columns and rows. Rows are lines of one elevation, or columns are.
    pub size: [usize; 2],
    /// Places relative to the scanner, column by column; not finite where a beam has no return.
    pub places: Vec<Vec3>,
}

/// The fate of a point of a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GridFate {
    /// It stays.
    #[default]
    Kept,
    /// It lies between two surfaces.
    Mixed,
    /// Another of its row stands for it.
    Crowded,
}

impl StationGrid {
    /// The fate of each point, in the order of the places; `None` where they are no grid of a scanner at the origin.
    pub fn fates(&self) -> Option<Vec<GridFate>> {
        let [columns, rows] = self.size;
        if columns < 3 || rows < 3 || columns.checked_mul(rows) != Some(self.places.len()) {
            return None;
        }
        if let Some(usual) = self.usual_angle() {
            return Some(self.fates_by(usual));
        }
        let turned = self.turned();
        let usual = turned.usual_angle()?;
        let fates = turned.fates_by(usual);
        let places = (0..fates.len()).map(|index| fates[index % rows * columns + index / rows]);
        Some(places.collect())
    }

    /// Rows as columns.
    fn turned(&self) -> Self {
        let [columns, rows] = self.size;
        let indices = 0..self.places.len();
        let place = |index: usize| self.places[index % columns * rows + index / columns];
        Self {
            size: [rows, columns],
            places: indices.map(place).collect(),
        }
    }

    fn fates_by(&self, usual: f32) -> Vec<GridFate> {
        let rows = self.size[1];
        let per_row = (0..rows).into_par_iter();
        let per_row: Vec<usize> = per_row.map(|row| self.columns_of(row, usual)).collect();
        let fate = |index: usize| {
            let (column, row) = (index / rows, index % rows);
            match () {
                () if self.is_mixed([column, row], usual) => GridFate::Mixed,
                () if !column.is_multiple_of(per_row[row]) => GridFate::Crowded,
                () => GridFate::Kept,
            }
        };
        let indices = (0..self.places.len()).into_par_iter();
        indices.map(fate).collect()
    }

    fn place(&self, [column, row]: [usize; 2]) -> Option<Vec3> {
        let is_inside = column < self.size[0] && row < self.size[1];
        let place = is_inside.then(|| self.places[column * self.size[1] + row])?;
        (place.is_finite() && place != Vec3::ZERO).then_some(place)
    }

    /// The angle between two beams.
    fn angle(&self, a: [usize; 2], b: [usize; 2]) -> Option<f32> {
        let (a, b) = (self.place(a)?, self.place(b)?);
        Some(a.cross(b).length().atan2(a.dot(b)))
    }

    /// The usual angle between the beams of a column; `None` where they are not evenly apart.
    fn usual_angle(&self) -> Option<f32> {
        let [columns, rows] = self.size;
        let sampled = (0..columns).step_by(columns.div_ceil(SAMPLED));
        let pairs = sampled.flat_map(|column| (1..rows).map(move |row| [column, row]));
        let mut down: Vec<f32> = pairs
            .filter_map(|[column, row]| self.angle([column, row - 1], [column, row]))
            .collect();
        let usual = median(&mut down).filter(|usual| *usual > 0.0)?;
        let is_even = |angle: &&f32| (0.5..2.0).contains(&(**angle / usual));
        let even = down.iter().filter(is_even).count();
        (even as f64 >= EVEN_SHARE * down.len() as f64).then_some(usual)
    }

    /// Of how many points of a row one is kept.
    fn columns_of(&self, row: usize, usual: f32) -> usize {
        let columns = self.size[0];
        let sampled = (1..columns).step_by(columns.div_ceil(SAMPLED));
        let angles = sampled.filter_map(|column| self.angle([column - 1, row], [column, row]));
        let across = median(&mut angles.collect::<Vec<f32>>()).unwrap_or(usual);
        let most = count(whole(f64::from(usual) / f64::from(across)));
        most.clamp(1, columns)
    }

    fn is_mixed(&self, at: [usize; 2], usual: f32) -> bool {
        let Some(range) = self.place(at).map(Vec3::length) else {
            return false;
        };
        let jump = JUMP * usual * range;
        LINES
            .iter()
            .any(|&line| self.is_between(at, (range, jump), line))
    }

    /// Returns true if a point lies between its neighbours on a line and continues the surface of neither.
    fn is_between(&self, at: [usize; 2], (range, jump): (f32, f32), line: [isize; 2]) -> bool {
        let neighbour = |steps: isize| {
            let column = at[0].checked_add_signed(line[0] * steps)?;
            let row = at[1].checked_add_signed(line[1] * steps)?;
            self.place([column, row]).map(Vec3::length)
        };
        let (Some(before), Some(behind)) = (neighbour(-1), neighbour(1)) else {
            return false;
        };
        let (step, other) = (range - before, behind - range);
        if step.abs().min(other.abs()) < jump || step * other < 0.0 {
            return false;
        }
        let near = CONTINUES * step.abs().min(other.abs());
        // Where nothing lies beyond, as at the border of the grid, it may do so.
        let continues = |next: f32, steps: isize| {
            neighbour(steps).is_none_or(|beyond| {
                let inverse = 2.0 / next - 1.0 / beyond;
                inverse > 0.0 && (1.0 / inverse - range).abs() < near
            })
        };
        !continues(before, -2) && !continues(behind, 2)
    }
}

fn median(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns and rows of a half turn.
    const SIZE: [usize; 2] = [180, 90];

    /// The grid of ranges over elevations from -89 to 89 degrees.
    fn grid(range: impl Fn(Vec3, [usize; 2]) -> f32) -> StationGrid {
        let place = |index: usize| {
            let at = [index / SIZE[1], index % SIZE[1]];
            let (sin, cos) = (2.0 * at[0] as f32).to_radians().sin_cos();
            let (up, out) = (2.0 * at[1] as f32 - 89.0).to_radians().sin_cos();
            let towards = Vec3::new(out * cos, out * sin, up);
            range(towards, at) * towards
        };
        StationGrid {
            size: SIZE,
            places: (0..SIZE[0] * SIZE[1]).map(place).collect(),
        }
    }

    /// The distance to a floor, a ceiling and round walls of this radius: of wide ones the floor is seen at a few degrees.
    fn hall(towards: Vec3, radius: f32) -> f32 {
        let wall = radius / towards.truncate().length();
        wall.min(0.6 / towards.z.abs())
    }

    fn count_of(fates: &[GridFate], wanted: GridFate) -> usize {
        fates.iter().filter(|fate| **fate == wanted).count()
    }

    #[test]
    fn a_floor_at_a_grazing_angle_is_kept_and_poles_are_thinned() {
        let fates = grid(|towards, _| hall(towards, 30.0))
            .fates()
            .expect("a grid");
        assert_eq!(count_of(&fates, GridFate::Mixed), 0);
        let in_row = |row: usize| {
            let kept = |column: &usize| fates[column * SIZE[1] + row] == GridFate::Kept;
            (0..SIZE[0]).filter(kept).count()
        };
        assert_eq!(in_row(45), 180, "the horizon");
        assert_eq!(in_row(75), 90, "61 degrees: beams are half as far apart");
        assert!((3..=5).contains(&in_row(0)), "the pole: {}", in_row(0));
    }

    #[test]
    fn points_between_a_post_and_a_wall_are_mixed() {
        let beam = |column: usize| column % 20;
        let range = |towards: Vec3, at: [usize; 2]| match beam(at[0]) {
            4..=6 if (41..49).contains(&at[1]) => 0.5,
            // Between both, nearer to the one or the other.
            7 if (41..49).contains(&at[1]) => {
                0.5 + (0.1 + 0.07 * (at[1] % 8) as f32) * hall(towards, 4.0)
            }
            _ => hall(towards, 4.0),
        };
        let all = grid(range);
        let fates = all.fates().expect("a grid");
        let wrong = (0..fates.len()).filter(|index| {
            let is_mixed = beam(index / SIZE[1]) == 7 && (41..49).contains(&(index % SIZE[1]));
            (fates[*index] == GridFate::Mixed) != is_mixed
        });
        let mixed = count_of(&fates, GridFate::Mixed);
        let wrong = wrong.count();
        assert!(
            mixed > 68 && wrong < 4,
            "{mixed} are mixed, {wrong} wrongly so or not"
        );
        // A wire is before both neighbours.
        let wire = grid(|towards, at| {
            if beam(at[0]) == 4 {
                0.5
            } else {
                hall(towards, 4.0)
            }
        });
        let fates = wire.fates().expect("a grid");
        assert_eq!(count_of(&fates, GridFate::Mixed), 0);
        let turned = all.turned().fates().expect("a grid");
        assert_eq!(count_of(&turned, GridFate::Mixed), mixed, "rows as columns");
    }

    #[test]
    fn other_grids_have_no_fates() {
        let mut moved = grid(|towards, _| hall(towards, 30.0));
        for place in &mut moved.places {
            *place += Vec3::new(25.0, 3.0, 0.0);
        }
        assert_eq!(moved.fates(), None, "a scanner that stands elsewhere");
        let nothing = grid(|_, _| f32::NAN);
        assert_eq!(nothing.fates(), None, "no returns");
        let short = StationGrid {
            size: [1000, 1000],
            ..nothing
        };
        assert_eq!(short.fates(), None, "lacks places");
    }
}
