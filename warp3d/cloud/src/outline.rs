//! The extent of a scan, for framing: its box without far points, and a sample of the discs inside it.

use glam::{DVec3, Vec3};
use resample_core::narrow::{count, whole};

use crate::discs::prepare::Prepared;

/// Share of the points at each end of an axis that may lie far away. A guess: birds and dust are fewer.
const FAR_SHARE: f64 = 0.001;

/// Points beyond the rest by more than this part of the longest side are far. A guess: the top of a tower is nearer.
const FAR: f32 = 0.5;

/// Cells along the longest side, of each of which one point stands for all: a cell is less than two pixels of a picture of 200.
const CELLS: f32 = 128.0;

/// The extent of a scan, for framing.
pub struct CloudOutline {
    /// Two corners of the box, world units.
    pub bounds: [DVec3; 2],
    /// Points inside it that stand for all.
    pub points: Vec<DVec3>,
    /// Points outside of it.
    pub far: usize,
}

impl CloudOutline {
    /// The box of discs, and those that stand for all.
    pub fn of(prepared: &Prepared) -> Self {
        let [low, high] = bounds(prepared);
        let origin = prepared.origin_in_world;
        let size = (high - low).max_element();
        let scale = if size > 0.0 { CELLS / size } else { 0.0 };
        let cells = ((high - low) * scale).floor().as_usizevec3() + 1;
        let mut is_taken = vec![false; cells.x * cells.y * cells.z];
        let (mut points, mut far) = (Vec::new(), 0);
        for disc in &prepared.discs {
            let at = Vec3::from(disc.position);
            if at.cmplt(low).any() || at.cmpgt(high).any() {
                far += 1;
                continue;
            }
            let cell = ((at - low) * scale).floor().as_usizevec3().min(cells - 1);
            let taken = &mut is_taken[(cell.z * cells.y + cell.y) * cells.x + cell.x];
            if !*taken {
                *taken = true;
                points.push(origin + at.as_dvec3());
            }
        }
        Self {
            bounds: [low, high].map(|corner| origin + corner.as_dvec3()),
            points,
            far,
        }
    }
}

/// The box around the discs, relative to their origin, without what lies far beyond nearly all of them.
fn bounds(prepared: &Prepared) -> [Vec3; 2] {
    let discs = &prepared.discs;
    let skipped = count(whole(FAR_SHARE * discs.len() as f64));
    let mut along: Vec<f32> = Vec::with_capacity(discs.len());
    // Of each axis: the least, the usual least, the usual most, the most.
    let ends: [[f32; 4]; 3] = std::array::from_fn(|axis| {
        along.clear();
        along.extend(discs.iter().map(|disc| disc.position[axis]));
        let last = along.len() - 1;
        let mut nth = |place: usize| *along.select_nth_unstable_by(place, f32::total_cmp).1;
        [nth(0), nth(skipped), nth(last - skipped), nth(last)]
    });
    let reach = FAR * ends.iter().map(|e| e[2] - e[1]).fold(0.0, f32::max);
    let low = ends.map(|[least, usual, ..]| if usual - least > reach { usual } else { least });
    let high = ends.map(|[.., usual, most]| if most - usual > reach { usual } else { most });
    [low.into(), high.into()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discs::prepare::{Floating, prepare_with};
    use crate::points::PointCloud;

    #[test]
    fn a_few_far_points_do_not_move_the_box() {
        let mut positions: Vec<[f32; 3]> = (0..10_000u16)
            .map(|i| [f32::from(i % 100), f32::from(i / 100), 0.0])
            .collect();
        // A flock of birds.
        positions.extend((0..8u8).map(|i| [50.0, f32::from(i), 900.0]));
        let cloud = PointCloud {
            origin_in_world: DVec3::splat(1e6),
            colours: vec![[0; 3]; positions.len()],
            positions,
        };
        let prepared = prepare_with(&cloud, Floating::Kept).expect("points");
        let shown = CloudOutline::of(&prepared);
        assert_eq!(shown.far, 8);
        assert_eq!(shown.bounds[1] - 1e6, DVec3::new(99.0, 99.0, 0.0));
        assert_eq!(
            shown.points.len(),
            10_000,
            "a cell is smaller than a spacing"
        );
    }
}
