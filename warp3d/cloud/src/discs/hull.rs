//! The outline of a point's neighbours in their plane: the lines where a surface may end.
//!
//! Takes offsets in the plane, returns the sides of their convex hull (Andrew 1979).

use glam::DVec2;

/// A side of a hull: the outward unit direction, and how far from the origin the side lies along it.
pub(crate) type Side = (DVec2, f64);

/// Adds the sides of the hull of these places; `corners` is reused storage. Places on a line have two sides.
pub(crate) fn sides(places: &mut [DVec2], corners: &mut Vec<DVec2>, to: &mut Vec<Side>) {
    places.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    corners.clear();
    add_half(places.iter(), corners);
    add_half(places.iter().rev(), corners);
    to.clear();
    for pair in corners.windows(2) {
        let along = pair[1] - pair[0];
        if let Some(outward) = DVec2::new(along.y, -along.x).try_normalize() {
            to.push((outward, outward.dot(pair[0])));
        }
    }
}

/// Adds the corners of one half of the hull, from the first place to the last; the last of the other half is the first of this.
fn add_half<'a>(places: impl Iterator<Item = &'a DVec2>, corners: &mut Vec<DVec2>) {
    let first = corners.len().saturating_sub(1);
    for &place in places {
        while corners.len() >= first + 2 {
            let [.., before, last] = corners[..] else {
                break;
            };
            if (last - before).perp_dot(place - last) > 0.0 {
                break;
            }
            corners.pop();
        }
        corners.push(place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_has_its_four_sides() {
        let mut places: Vec<DVec2> = (0..25)
            .map(|i| DVec2::new(f64::from(i % 5) - 1.0, f64::from(i / 5) - 2.0))
            .collect();
        let (mut corners, mut found) = (Vec::new(), Vec::new());
        sides(&mut places, &mut corners, &mut found);
        let mut distances: Vec<f64> = found.iter().map(|(_, distance)| *distance).collect();
        distances.sort_by(f64::total_cmp);
        assert_eq!(distances, [1.0, 2.0, 2.0, 3.0]);
        assert!(found.iter().all(|(outward, _)| outward.is_normalized()));
    }
}
