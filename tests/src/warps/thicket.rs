//! Leaves and twigs before a wall, with depth as networks give it: how clean the rims are that a new view shows.
//!
//! Gives the scene with its true views, the reference with depth that was blurred, filtered by the picture or coded in 8
//! bits, and the figures of the band around true depth edges. All bodies differ strongly in hue, so that a colour
//! tells whose it is. A *stray* pixel has a colour that the truth lacks in the 5x5 pixels around; a *foreign* pixel has a hue
//! that the truth lacks there at any brightness, and is counted in filled holes too. A *speck* is a stray pixel, seen or filled,
//! that is like at most two of its eight neighbours: leaves narrower than the blur, which stand in the wrong place, are no specks.
//!
//! Limits: colours are compared after a square root, which stands for the curve of a display.

use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use resample_core::{Camera, Image};
use warp3d::Reference;
use warp3d::input::{self, DepthKind, DepthMeaning, Picture, Plane, Stored};

use crate::warps::filtered::filtered_scene;
use crate::warps::scenes::{AnalyticScene, Body, camera};
use crate::warps::soft::{Numbers, Softening, softened};
use crate::warps::truth::{Truth, WarpScene};

/// Pixels of a view.
const SIZE: [u32; 2] = [320, 240];

/// About which distance views turn, world units.
const PIVOT: f64 = 6.0;

/// How far the band reaches to either side of a true depth edge, px.
const BAND_PX: i64 = 6;

/// Neighbours in inverse depth, one this many times the other, have an edge between them.
const EDGE_RATIO: f32 = 1.08;

/// Pixels in each direction whose true colours a pixel may have.
const AROUND_PX: i64 = 2;

/// Difference of a channel, after the square root, from which on a colour is another: 25 of 255 steps are seen at normal size.
const OTHER: f32 = 0.1;

/// Most by which a colour of a body is brighter or darker than another of it, after the square root: the pattern goes from
/// 0.25 to 0.95.
const BRIGHTER: f32 = 2.0;

/// How a depth map came to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Made {
    /// Exact.
    Exact,
    /// Softened in inverse depth.
    Soft(Softening),
    /// The same, and then in codes of 8 bits, nearer ones larger.
    Coded(Softening),
}

/// The figures of a band.
#[derive(Clone, Copy, Debug, Default)]
pub struct BandFigures {
    /// PSNR over pixels of the band that the reference sees wholly, dB.
    pub psnr_db: f64,
    /// PSNR of the edge band with its filled holes, dB.
    pub filled_db: f64,
    /// Stray pixels, of those that the reference sees wholly.
    pub stray: usize,
    /// Foreign pixels.
    pub foreign: usize,
    /// Specks.
    pub specks: usize,
    /// Pixels of the band.
    pub count: usize,
}

/// The scene.
pub fn thicket() -> AnalyticScene {
    let wall = Body::Card(DVec3::Z * 9.0, DVec3::X * 14.0, DVec3::Y * 10.0);
    let mut bodies = vec![(wall, 1.7, [0.95, 0.9, 0.75])];
    // Centre, half length and half width, turn.
    let mut leaf = |at: [f64; 3], half: [f64; 2], turn_rad: f64, tint: [f64; 3]| {
        let turn = DMat3::from_rotation_z(turn_rad);
        let [u, v] = [turn * DVec3::X * half[0], turn * DVec3::Y * half[1]];
        bodies.push((Body::Leaf(at.into(), u, v), 0.9, tint));
    };
    let (green, red, blue) = ([0.05, 0.5, 0.06], [0.8, 0.06, 0.05], [0.06, 0.1, 0.8]);
    leaf([-1.3, -0.5, 4.0], [0.55, 0.55], 0.0, red);
    leaf([1.2, 0.7, 5.0], [0.8, 0.5], 0.5, blue);
    // Leaves of 3 to 16 px in width.
    for k in 0..9 {
        let turn = 0.7 * f64::from(k);
        let at = [-1.6 + 0.4 * f64::from(k), -0.2 + 0.5 * turn.sin(), 4.2];
        leaf(at, [0.45, 0.025 * f64::from(k % 5 + 1)], turn, green);
    }
    // Twigs of 1.5 to 5 px, across the view.
    for k in 0..4 {
        let turn = DMat3::from_rotation_z(-0.9 + 0.55 * f64::from(k));
        let half = 0.010 * f64::from(k + 1);
        let at = DVec3::new(-0.4 + 0.4 * f64::from(k), 0.4, 3.6 + 0.1 * f64::from(k));
        let twig = Body::Card(at, turn * DVec3::X * 1.2, turn * DVec3::Y * half);
        bodies.push((twig, 0.8, [0.25, 0.08, 0.02]));
    }
    AnalyticScene(bodies)
}

/// The camera of the reference.
fn start() -> Camera {
    camera(SIZE, 260.0, DVec3::ZERO, 0.0)
}

/// The camera turned about the pivot, by angles to the side and upwards.
fn turned(aside_deg: f64, up_deg: f64) -> Camera {
    let turn = DMat3::from_rotation_y(aside_deg.to_radians())
        * DMat3::from_rotation_x(-up_deg.to_radians());
    let pivot = DVec3::Z * PIVOT;
    let swayed = DAffine3 {
        matrix3: turn,
        translation: pivot - turn * pivot,
    };
    let start = start();
    Camera {
        camera_from_world: swayed * start.camera_from_world,
        ..start
    }
}

/// The scene from its reference and from new views: a pair of eyes, and a sway of three degrees.
pub fn views() -> Vec<WarpScene> {
    let scene = thicket();
    let at = |x: f64| camera(SIZE, 260.0, DVec3::X * x, 0.0);
    let cameras = [
        ("left", at(-0.12)),
        ("right", at(0.12)),
        ("sway aside", turned(3.0, 1.5)),
        ("sway up", turned(0.0, 3.0)),
    ];
    cameras
        .iter()
        .map(|(name, to)| filtered_scene(name, &scene, &start(), to))
        .collect()
}

/// `reference` with depth as it is `made`.
pub fn with_depth(reference: &Reference, made: Made) -> Reference {
    match made {
        Made::Exact => reference.clone(),
        Made::Soft(how) => softened(reference, Numbers::Inverse, how),
        Made::Coded(how) => coded(&softened(reference, Numbers::Inverse, how)),
    }
}

/// Depth in codes of 8 bits between planes at 1 and 10.
fn coded(reference: &Reference) -> Reference {
    let meaning = DepthMeaning {
        near_far: Some([1.0, 10.0]),
        range: Some([0.0, 255.0]),
        ..DepthMeaning::of(DepthKind::Relative)
    };
    let code = |&z: &f32| (255.0 * (1.0 / f64::from(z) - 0.1) / 0.9).round() as f32;
    let [width, height] = SIZE.map(|side| side as usize);
    let picture = Picture {
        width,
        height,
        rgb: reference.colour.clone(),
        coverage: None,
    };
    let plane = Plane {
        width,
        height,
        values: reference.depth.iter().map(code).collect(),
        stored: Stored::Code(255),
    };
    input::reference(
        picture,
        &plane,
        reference.camera,
        &meaning,
        Path::new("depth"),
    )
    .expect("complete")
}

/// Compares `image`, in which everything is filled, with `truth` in the band around the edges of truth.
pub fn in_band(image: &Image, truth: &Truth) -> BandFigures {
    let size = [image.width as i64, image.height as i64];
    let visible = truth.visible();
    let mut figures = BandFigures::default();
    let (mut seen, mut all) = ([0.0f64; 2], [0.0f64; 2]);
    for i in band(&truth.depth, size) {
        let (own, truth_there) = (display(image.rgba[i]), display(truth.image.rgba[i]));
        let error = (0..3).map(|c| f64::from(own[c] - truth_there[c]).powi(2));
        let error = error.sum::<f64>() / 3.0;
        all = [all[0] + error, all[1] + 1.0];
        let near: Vec<[f32; 3]> = around(i, size, AROUND_PX)
            .map(|at| display(truth.image.rgba[at]))
            .collect();
        figures.count += 1;
        let is_stray = near.iter().all(|&t| distance(own, t, 1.0) > OTHER);
        let is_like = |&at: &usize| distance(own, display(image.rgba[at]), 1.0) <= OTHER;
        // One of them is the pixel itself.
        let is_alone = around(i, size, 1).filter(is_like).count() <= 3;
        figures.specks += usize::from(is_stray && is_alone);
        figures.foreign += usize::from(near.iter().all(|&t| is_foreign(own, t)));
        if visible[i] {
            seen = [seen[0] + error, seen[1] + 1.0];
            figures.stray += usize::from(is_stray);
        }
    }
    let psnr = |[sum, count]: [f64; 2]| -10.0 * (sum / count.max(1.0)).log10();
    BandFigures {
        psnr_db: psnr(seen),
        filled_db: psnr(all),
        ..figures
    }
}

/// The pixels near an edge of depth.
fn band(depth: &[f32], size: [i64; 2]) -> Vec<usize> {
    let [width, height] = size;
    let differ = |a: f32, b: f32| a.max(b) > EDGE_RATIO * a.min(b);
    let mut is_near = vec![false; depth.len()];
    for (i, &z) in depth.iter().enumerate() {
        let (x, y) = (i as i64 % width, i as i64 / width);
        let at = |x: i64, y: i64| depth[(y.min(height - 1) * width + x.min(width - 1)) as usize];
        if differ(z, at(x + 1, y)) || differ(z, at(x, y + 1)) {
            for v in (y - BAND_PX).max(0)..(y + BAND_PX + 1).min(height) {
                for u in (x - BAND_PX).max(0)..(x + BAND_PX + 1).min(width) {
                    is_near[(v * width + u) as usize] = true;
                }
            }
        }
    }
    (0..depth.len()).filter(|&i| is_near[i]).collect()
}

/// The pixels up to `reach` away from one, and itself.
fn around(i: usize, [width, height]: [i64; 2], reach: i64) -> impl Iterator<Item = usize> {
    let (x, y) = (i as i64 % width, i as i64 / width);
    let steps = -reach..=reach;
    let places = steps
        .clone()
        .flat_map(move |v| steps.clone().map(move |u| (x + u, y + v)));
    places
        .filter(move |&(u, v)| u >= 0 && v >= 0 && u < width && v < height)
        .map(move |(u, v)| (v * width + u) as usize)
}

fn display(pixel: [f32; 4]) -> [f32; 3] {
    [0, 1, 2].map(|c| pixel[c].max(0.0).sqrt())
}

/// The largest difference of a channel from `truth` made `brighter`.
fn distance(own: [f32; 3], truth: [f32; 3], brighter: f32) -> f32 {
    let of = |c: usize| (own[c] - brighter * truth[c]).abs();
    of(0).max(of(1)).max(of(2))
}

/// Whether a colour is none of this hue.
fn is_foreign(own: [f32; 3], truth: [f32; 3]) -> bool {
    const STEPS: i32 = 16;
    (-STEPS..=STEPS).all(|k| {
        let brighter = BRIGHTER.powf(k as f32 / STEPS as f32);
        distance(own, truth, brighter) > OTHER
    })
}
