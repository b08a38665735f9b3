//! The axes of the world: three arrows in a corner, or a box around the scene with numbers.

use glam::{DVec2, DVec3};
use resample_core::Camera;
use resample_core::narrow::{cell, single};

use crate::figure::canvas::Canvas;
use crate::figure::parts::Axes;
use crate::figure::place::{camera_from_world, projected};
use crate::figure::text::Anchor;
use crate::figure::ticks::{number, ticks};

/// Length of an arrow, ems.
const ARROW_EMS: f64 = 2.6;

/// Colours of x, y and z, linear light: red, green and blue that show on black and on white.
const COLOURS: [[f32; 3]; 3] = [[0.8, 0.05, 0.05], [0.05, 0.45, 0.05], [0.1, 0.2, 0.9]];

/// Draws the directions of the axes at the lower right.
pub(super) fn directions(canvas: &mut Canvas, camera: &Camera, axes: &Axes) {
    let Some(camera_from_world) = camera_from_world(camera) else {
        return;
    };
    let em = canvas.em;
    let [width, height] = canvas.size;
    let middle = DVec2::new(width, height) - DVec2::splat((ARROW_EMS + 1.6) * em);
    let mut order: Vec<(usize, DVec3)> = (0..3)
        .map(|axis| {
            (
                axis,
                camera_from_world.matrix3.col(axis).normalize_or_zero(),
            )
        })
        .collect();
    // Those that point away first: nearer ones lie over them.
    order.sort_by(|a, b| b.1.z.total_cmp(&a.1.z));
    for (axis, direction) in order {
        let tip = middle + ARROW_EMS * em * direction.truncate();
        canvas.coloured_line(middle, tip, COLOURS[axis], None);
        let side = DVec2::new(-direction.y, direction.x).normalize_or_zero();
        let back = direction.truncate().normalize_or_zero();
        // An arrow towards the eye shows no head.
        let head = 0.35 * em * direction.truncate().length();
        for turn in [-0.5, 0.5] {
            canvas.coloured_line(tip, tip - head * (back + turn * side), COLOURS[axis], None);
        }
        let beyond = middle + (ARROW_EMS + 0.8) * em * direction.truncate();
        canvas.text(&axes.names[axis], em, beyond, Anchor::MIDDLE);
    }
}

/// Draws the box, and numbers along the edges that stand outside.
pub(super) fn boxed(canvas: &mut Canvas, camera: &Camera, axes: &Axes, [low, high]: [DVec3; 2]) {
    let corner = |bits: usize| {
        let pick = |axis: usize| {
            if bits >> axis & 1 == 0 {
                low[axis]
            } else {
                high[axis]
            }
        };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    for bits in 0..8 {
        for axis in (0..3).filter(|axis| bits >> axis & 1 == 0) {
            let ends = [bits, bits | 1 << axis].map(|bits| projected(camera, corner(bits)));
            if let [Some(from), Some(to)] = ends {
                canvas.deep_line(from, to);
            }
        }
    }
    let Some((middle, _)) = projected(camera, 0.5 * (low + high)) else {
        return;
    };
    for axis in 0..3 {
        let edges = (0..8).filter(|bits| bits >> axis & 1 == 0);
        let outside = |bits: &usize| {
            let (at, _) = projected(camera, 0.5 * (corner(*bits) + corner(bits | 1 << axis)))?;
            // The lower left edge of two that are equally far out.
            let out = at - middle;
            Some((*bits, out.length() + 1e-3 * (out.y - out.x)))
        };
        let Some((bits, _)) = edges
            .filter_map(|bits| outside(&bits))
            .max_by(|a, b| a.1.total_cmp(&b.1))
        else {
            continue;
        };
        edge(
            canvas,
            camera,
            (axes, axis),
            [corner(bits), corner(bits | 1 << axis)],
            middle,
        );
    }
}

/// Numbers along an edge, and its name in its middle, both away from the middle of the box.
fn edge(
    canvas: &mut Canvas,
    camera: &Camera,
    (axes, axis): (&Axes, usize),
    [from, to]: [DVec3; 2],
    middle: DVec2,
) {
    let [Some((start, _)), Some((end, _))] = [from, to].map(|end| projected(camera, end)) else {
        return;
    };
    let em = canvas.em;
    let along = (end - start).normalize_or_zero();
    let mut out = DVec2::new(-along.y, along.x);
    if out.dot(0.5 * (start + end) - middle) < 0.0 {
        out = -out;
    }
    let length = start.distance(end);
    if length < 2.0 * em {
        // An edge that points at the eye has no room for numbers.
        return;
    }
    // A wide number needs more room beside the next one than above it.
    let room = em * (1.6 + 2.4 * along.x.abs());
    let most = cell(single((length / room).clamp(1.0, 8.0)));
    for value in ticks(from[axis], to[axis], most) {
        let share = (value - from[axis]) / (to[axis] - from[axis]);
        let Some((at, _)) = projected(camera, from.lerp(to, share)) else {
            continue;
        };
        canvas.line(at, at + 0.3 * em * out);
        let words = number(value);
        canvas.text(&words, em, at + 0.6 * em * out, towards(out));
    }
    let unit = axes.unit.as_deref().map(|unit| format!(" ({unit})"));
    let name = axes.names[axis].clone() + &unit.unwrap_or_default();
    canvas.text(
        &name,
        em,
        0.5 * (start + end) + 3.4 * em * out,
        towards(out),
    );
}

/// The side of a text's box that is next to its edge.
fn towards(out: DVec2) -> Anchor {
    Anchor(0.5 - 0.5 * out)
}
