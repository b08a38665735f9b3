//! Polygons to triangles, concave ones included.
//!
//! Takes the corners of a polygon in space, gives triples of corner numbers that wind as the polygon does. The polygon is
//! laid into the plane of its mean normal (Newell's), and ears are cut off one by one: a corner whose triangle turns the
//! right way and holds no other corner.
//! Limits: a polygon that crosses itself has no such division; its remainder becomes a fan. So does one of more
//! than [`MAX_EARS`] corners, because the time grows with the cube of their number in the worst case.

use glam::{DVec2, DVec3};

/// Most corners that are cut ear by ear: 512^3 steps are a tenth of a second.
const MAX_EARS: usize = 512;

/// Most corners of a polygon that is read; real ones have some hundred. As a fan, more of them would lie over one another.
pub(crate) const MAX_CORNERS: usize = 1 << 16;

/// Refuses a polygon of more corners than any program writes.
pub(crate) fn check(corners: usize) -> Result<(), String> {
    if corners <= MAX_CORNERS {
        return Ok(());
    }
    Err(format!(
        "a polygon of {corners} corners: at most {MAX_CORNERS} are read"
    ))
}

/// Triangles of a polygon of at least three corners.
pub(crate) fn triangles(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let mut triangles = Vec::with_capacity(corners.len().saturating_sub(2));
    if corners.len() > 3 && corners.len() <= MAX_EARS {
        let flat = in_plane(corners);
        // To cut an ear changes its neighbours: the search goes on at the one before it.
        let mut start = 0;
        while left.len() > 3 {
            let mut places = (0..left.len()).map(|step| (start + step) % left.len());
            let Some(ear) = places.find(|&at| is_ear(&flat, &left, at)) else {
                break;
            };
            triangles.push(around(&left, ear));
            left.remove(ear);
            start = ear.saturating_sub(1);
        }
    }
    triangles.extend((2..left.len()).map(|at| [left[0], left[at - 1], left[at]]));
    triangles
}

/// The corners in the plane of the mean normal, so that the polygon winds counter-clockwise.
fn in_plane(corners: &[DVec3]) -> Vec<DVec2> {
    let origin = corners[0];
    let points: Vec<DVec3> = corners.iter().map(|corner| corner - origin).collect();
    let next = points.iter().cycle().skip(1);
    let normal: DVec3 = points.iter().zip(next).map(|(a, b)| a.cross(*b)).sum();
    let normal = normal.try_normalize().unwrap_or(DVec3::Z);
    let (right, up) = normal.any_orthonormal_pair();
    points
        .iter()
        .map(|point| DVec2::new(point.dot(right), point.dot(up)))
        .collect()
}

fn around(left: &[usize], at: usize) -> [usize; 3] {
    let count = left.len();
    [
        left[(at + count - 1) % count],
        left[at],
        left[(at + 1) % count],
    ]
}

fn is_ear(flat: &[DVec2], left: &[usize], at: usize) -> bool {
    let corners = around(left, at);
    let [a, b, c] = corners.map(|corner| flat[corner]);
    let turns_left = (b - a).perp_dot(c - b) > 0.0;
    let inside = |point: DVec2| {
        (b - a).perp_dot(point - a) >= 0.0
            && (c - b).perp_dot(point - b) >= 0.0
            && (a - c).perp_dot(point - c) >= 0.0
    };
    // A corner at the place of one of the three, as at a slit, is not in the way.
    let in_the_way = |&corner: &usize| {
        let point = flat[corner];
        !corners.contains(&corner) && point != a && point != b && point != c && inside(point)
    };
    turns_left && !left.iter().any(in_the_way)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[[f32; 3]], triangles: &[[usize; 3]]) -> (f64, f64) {
        let at = |i: usize| DVec3::from_array(corners[i].map(f64::from));
        let signed = triangles
            .iter()
            .map(|&[a, b, c]| 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).z);
        signed.fold((0.0, 0.0), |(sum, absolute), area| {
            (sum + area, absolute + area.abs())
        })
    }

    fn in_space(polygon: &[[f32; 3]]) -> Vec<DVec3> {
        polygon
            .iter()
            .map(|corner| DVec3::from_array(corner.map(f64::from)))
            .collect()
    }

    #[test]
    fn concave_polygons_are_covered_once() {
        let arrow = [
            [0.0, 0.0, 0.0],
            [2.0, -1.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 1.0, 0.0],
        ];
        let comb: Vec<[f32; 3]> = (0..40)
            .map(|i| [i as f32, if i % 2 == 0 { 5.0 } else { 1.0 }, 0.0])
            .chain([[40.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
            .rev()
            .collect();
        for polygon in [arrow.to_vec(), comb] {
            let triangles = triangles(&in_space(&polygon));
            assert_eq!(
                triangles.len(),
                polygon.len() - 2,
                "as many triangles as a polygon has"
            );
            let (signed, absolute) = area(&polygon, &triangles);
            assert!(
                (signed.abs() - absolute).abs() < 1e-9,
                "all wind one way: {signed} against {absolute}"
            );
        }
    }

    #[test]
    fn hopeless_polygons_still_give_triangles() {
        let line = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [3.0, 0.0, 0.0],
        ];
        let bow = [
            [0.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        for polygon in [line, bow, [[f32::NAN; 3]; 4]] {
            assert_eq!(
                triangles(&in_space(&polygon)).len(),
                2,
                "{polygon:?} has four corners"
            );
        }
        let many: Vec<[f32; 3]> = (0..100_000)
            .map(|i| [(i as f32).sin(), (i as f32).cos(), 0.0])
            .collect();
        assert_eq!(
            triangles(&in_space(&many)).len(),
            many.len() - 2,
            "a polygon of any size ends"
        );
    }
}
