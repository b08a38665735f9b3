//! The grid of rows and columns in which a scanner on a tripod takes its points: which of them say nothing of a surface.
//!
//! Takes the points of one station, by column and row, relative to the scanner. Two kinds are left out.
//! - **Mixed points**: a beam that meets the edge of one surface before another gives a range between both. Such a point lies
//!   between its two neighbours on a line of the grid, far before the one and far behind the other, and continues neither the surface
//!   on the one side nor that on the other: on a plane the inverse of the range is linear in the beam's angle, however aslant it is seen.
//! - **Crowded points**: near the poles of the grid, beams of a row lie much closer than rows. Of so many, one is kept.
//!
//! Limits: points of wires and edges that are one beam wide stay, since they lie before both neighbours. A range that is mixed over two beams
//! and more is not found.

use glam::Vec3;

/// A step between neighbours is a jump if it is so many times as long as the beams are apart there: a surface has such steps at
/// 7 degrees and less from the beam. A guess.
const JUMP: f32 = 8.0;

/// A point continues a surface if it lies off it by less than this part of the smaller jump. A guess.
const CONTINUES: f32 = 0.25;

/// Share of the beams whose neighbours must lie about as far apart as usual: otherwise the places are not relative to the scanner.
const EVEN_SHARE: f64 = 0.9;

/// Points of one station.
#[derive(Clone, Debug, Default)]
pub struct StationGrid {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Places relative to the scanner, column by column; not finite where a beam has no return.
    pub places: Vec<Vec3>,
}

/// The fate of a point of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OfGrid {
    /// It stays.
    Kept,
    /// It lies between two surfaces.
    Mixed,
    /// Others of its row stand for it.
    Crowded,
}

impl StationGrid {
    /// The fate of each point, in the order of the places; `None` where the grid is none of a scanner at the origin.
    pub fn fates(&self) -> Option<Vec<OfGrid>> {
        let [columns, rows] = self.size;
        if columns < 3 || rows < 3 || columns.checked_mul(rows) != Some(self.places.len()) {
            return None;
        }
        let per_row = self.columns_of_rows()?;
        let fate = |index: usize| {
            let at = [index / rows, index % rows];
            match () {
                () if self.is_mixed(at) => OfGrid::Mixed,
                () if !at[0].is_multiple_of(per_row[at[1]]) => OfGrid::Crowded,
                () => OfGrid::Kept,
            }
        };
        Some((0..self.places.len()).map(fate).collect())
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

    /// Of each row, of how many columns one is kept; `None` where neighbouring beams are not evenly apart.
    fn columns_of_rows(&self) -> Option<Vec<usize>> {
        let [columns, rows] = self.size;
        let mut down: Vec<f32> = (0..columns)
            .flat_map(|column| (1..rows).map(move |row| (column, row)))
            .filter_map(|(column, row)| self.angle([column, row - 1], [column, row]))
            .collect();
        let usual = median(&mut down)?;
        let even = down
            .iter()
            .filter(|angle| (0.5..2.0).contains(&(**angle / usual)));
        if (even.count() as f64) < EVEN_SHARE * down.len() as f64 {
            return None;
        }
        let of_row = |row: usize| {
            let angles =
                (1..columns).filter_map(|column| self.angle([column - 1, row], [column, row]));
            let mut angles: Vec<f32> = angles.collect();
            let across = median(&mut angles).unwrap_or(usual);
            // Of a row of one place, one point is kept.
            (1..columns)
                .rev()
                .find(|&n| n as f32 * across <= usual)
                .unwrap_or(1)
        };
        Some((0..rows).map(of_row).collect())
    }

    fn is_mixed(&self, at: [usize; 2]) -> bool {
        let lines = [[1, 0], [0, 1], [1, 1], [1, -1]];
        let Some(place) = self.place(at) else {
            return false;
        };
        lines
            .iter()
            .any(|&line| self.is_between(at, place.length(), line))
    }

    /// Returns true if a point lies between its neighbours on a line and continues the surface of neither.
    fn is_between(&self, at: [usize; 2], range: f32, [dx, dy]: [isize; 2]) -> bool {
        let neighbour = |steps: isize| {
            let column = at[0].checked_add_signed(dx * steps)?;
            let row = at[1].checked_add_signed(dy * steps)?;
            let angle = self.angle(at, [column, row])?;
            Some((self.place([column, row])?.length(), angle))
        };
        let (Some((before, a)), Some((behind, b))) = (neighbour(-1), neighbour(1)) else {
            return false;
        };
        let (step, other) = (range - before, behind - range);
        let is_jump = step.abs() > JUMP * a * range && other.abs() > JUMP * b * range;
        if !is_jump || step * other < 0.0 {
            return false;
        }
        let near = CONTINUES * step.abs().min(other.abs());
        let continues = |next: f32, steps: isize| {
            neighbour(steps).is_some_and(|(beyond, _)| {
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
