//! Values of channels at points inside one cell, and their means.
//!
//! Takes the scalars at the corners of a cell and the tables of the channels.

use crate::bricks::cells::CellBrick;
use crate::slabs::channel::{ChannelSettings, Reading, Role, weights_of_tints};

/// Places along a cell's side at which the field is asked, in the middles of as many equal parts.
pub(crate) const POINTS: usize = 4;

/// Places in a cell.
pub(crate) const PER_CELL: usize = POINTS * POINTS * POINTS;

/// Colours times strength, and strength.
pub(crate) type Sum = [f32; 4];

/// Multiplies the colours at the points of a cell by the sum of the tints there.
pub(crate) fn multiply_tints(
    channels: &[ChannelSettings],
    cells: &CellBrick,
    first: usize,
    points: &mut [Sum; PER_CELL],
) {
    let is_tint = |channel: &ChannelSettings| channel.role == Role::Tint;
    if !channels.iter().any(is_tint) {
        return;
    }
    let corners = |number: usize| cells.channel(number).scalars.corners(first);
    let weights = weights_of_tints(channels).map_or([1.0; 8], |(number, least)| {
        corners(number).map(|value| (value - least).max(0.0))
    });
    let sums = at_points(weights);
    let mut tints = [[0.0f32; 4]; PER_CELL];
    for (number, channel) in channels.iter().enumerate() {
        if !is_tint(channel) {
            continue;
        }
        let values = corners(number);
        let products = at_points(std::array::from_fn(|k| weights[k] * values[k]));
        for (i, tint) in tints.iter_mut().enumerate() {
            let value = products[i] / sums[i].max(f32::MIN_POSITIVE);
            for (sum, value) in tint.iter_mut().zip(channel.table.at(value)) {
                *sum += value;
            }
        }
    }
    for (point, tint) in points.iter_mut().zip(&tints) {
        for (value, factor) in point.iter_mut().zip(&tint[..3]) {
            *value *= factor;
        }
    }
}

/// The corner of the cell that is nearest to a point: which half the point lies in, along each axis.
pub(crate) fn nearest_corner(point: usize) -> usize {
    let at = [
        point % POINTS,
        point / POINTS % POINTS,
        point / (POINTS * POINTS),
    ];
    (0..3).map(|axis| (2 * at[axis] / POINTS) << axis).sum()
}

/// Adds the extinction and the colour of a channel at the points of a cell.
pub(crate) fn add_points(
    channel: &ChannelSettings,
    corners: [f32; 8],
    points: &mut [Sum; PER_CELL],
) {
    let mut add = |i: usize, value: f32| {
        let [r, g, b, strength] = channel.table.at(value);
        for (sum, part) in
            points[i]
                .iter_mut()
                .zip([r * strength, g * strength, b * strength, strength])
        {
            *sum += part;
        }
    };
    if channel.reading == Reading::Nearest {
        for i in 0..PER_CELL {
            add(i, corners[nearest_corner(i)]);
        }
        return;
    }
    for (i, value) in at_points(corners).into_iter().enumerate() {
        add(i, value);
    }
}

/// The trilinear mix of the corners of a cell at its points.
fn at_points(corners: [f32; 8]) -> [f32; PER_CELL] {
    let mut values = [0.0; PER_CELL];
    let share = |i: usize| (i as f32 + 0.5) / POINTS as f32;
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    for z in 0..POINTS {
        let face: [f32; 4] = std::array::from_fn(|k| mix(corners[k], corners[k + 4], share(z)));
        for y in 0..POINTS {
            let (left, right) = (
                mix(face[0], face[2], share(y)),
                mix(face[1], face[3], share(y)),
            );
            for x in 0..POINTS {
                values[x + POINTS * (y + POINTS * z)] = mix(left, right, share(x));
            }
        }
    }
    values
}

/// Means over the halves of a cell.
pub(crate) fn halves_of(points: &[Sum; PER_CELL]) -> [Sum; 8] {
    let mut means = [[0.0; 4]; 8];
    for (i, point) in points.iter().enumerate() {
        for (mean, value) in means[nearest_corner(i)].iter_mut().zip(point) {
            *mean += 0.125 * value;
        }
    }
    means
}
