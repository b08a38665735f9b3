//! Scenes for level of detail: real and procedural volumes, seen from given pixels a voxel and from many sides.
//!
//! Gives each with its transfer function and a camera for a wanted size. The real volumes are part of the test data;
//! those that are absent are left out, with a visible skip line.

use glam::DVec3;
use resample_core::{Camera, LookAt};
use volsplat::procedural::{blobs, checker_box, marschner_lobb};
use volsplat::{LoadOptions, RawOptions, TransferFunction, Volume, VoxelType};

use crate::data::data_file;
use crate::volumes::peer_scenes;
use crate::volumes::scenes::transfer;

/// A volume with its transfer function.
pub struct Subject {
    /// Its name in tables.
    pub name: &'static str,
    /// The volume.
    pub volume: Volume,
    /// Its transfer function.
    pub transfer: TransferFunction,
}

/// Vertical field of view, degrees.
const FOV_Y_DEG: f64 = 30.0;

/// Share of the picture's height that the volume's diagonal fills.
const FILL: f64 = 0.9;

/// Largest picture side, px.
const MOST_PX: f64 = 400.0;

/// All subjects that are there.
pub fn subjects(test: &str) -> Vec<Subject> {
    let mut all = real(test);
    all.extend(procedural());
    all
}

/// Volumes made from formulas.
///
/// # Panics
/// Never: the sizes are good.
pub fn procedural() -> Vec<Subject> {
    let white = [1.0; 3];
    let made = |volume: Result<Volume, volsplat::Error>| volume.expect("a good size");
    vec![
        Subject {
            name: "checker box, 100^3",
            volume: made(checker_box(100, 10)),
            transfer: transfer(
                &[(85.0, [0.9, 0.2, 0.1]), (170.0, [0.1, 0.3, 0.9])],
                &[(85.0, 0.02), (170.0, 0.1)],
            ),
        },
        Subject {
            name: "checker box, opaque, 100^3",
            volume: made(checker_box(100, 10)),
            transfer: transfer(
                &[(85.0, [0.9, 0.2, 0.1]), (170.0, [0.1, 0.3, 0.9])],
                &[(85.0, 0.8), (170.0, 0.8)],
            ),
        },
        Subject {
            name: "blobs, 128^3",
            volume: made(blobs(128)),
            transfer: transfer(
                &[(0.0, [0.1, 0.2, 1.0]), (2.0, [1.0, 0.3, 0.1])],
                &[(0.1, 0.0), (1.5, 0.1), (3.0, 0.2)],
            ),
        },
        Subject {
            name: "Marschner-Lobb, 128^3",
            volume: made(marschner_lobb(128)),
            transfer: transfer(
                &[(0.0, [0.2, 0.4, 1.0]), (1.0, white)],
                &[(0.0, 0.0), (1.0, 0.05)],
            ),
        },
        Subject {
            name: "Marschner-Lobb, surface, 41^3",
            volume: made(marschner_lobb(41)),
            transfer: transfer(
                &[(0.0, [0.2, 0.4, 1.0]), (1.0, white)],
                &[(0.45, 0.0), (0.55, 0.9)],
            ),
        },
    ]
}

/// The subjects of a zoom-out: the Aneurism, where it is there, and the Checker Box.
pub fn zoom_subjects(test: &str) -> Vec<Subject> {
    let mut all: Vec<Subject> = real(test)
        .into_iter()
        .filter(|subject| subject.name == "aneurism")
        .collect();
    all.extend(
        procedural()
            .into_iter()
            .filter(|subject| subject.name.starts_with("checker box")),
    );
    all
}

/// The real volumes that are there.
///
/// # Panics
/// If a file is there and cannot be read.
pub fn real(test: &str) -> Vec<Subject> {
    let mut all: Vec<Subject> = peer_scenes::Subject::ALL
        .into_iter()
        .filter_map(|subject| {
            let volume = subject.volume(test)?;
            Some(Subject {
                name: subject.name(),
                volume,
                transfer: subject.transfer(),
            })
        })
        .collect();
    all.extend(lobster(test));
    all
}

fn lobster(test: &str) -> Option<Subject> {
    let path = data_file(test, "volumes/raw/lobster_301x324x56_uint8.raw")?;
    let raw = Some(RawOptions::new([301, 324, 56], VoxelType::U8));
    let options = LoadOptions {
        raw,
        ..LoadOptions::default()
    };
    let volume = volsplat::load(&path, &options).expect("the volume is as large as its name says");
    let transfer = transfer(
        &[
            (0.0, [0.2, 0.1, 0.1]),
            (60.0, [0.9, 0.4, 0.2]),
            (255.0, [1.0, 0.9, 0.8]),
        ],
        &[(20.0, 0.0), (50.0, 0.02), (90.0, 0.3), (255.0, 0.8)],
    );
    Some(Subject {
        name: "lobster",
        volume,
        transfer,
    })
}

impl Subject {
    /// A camera that sees the middle of the volume at this many pixels a voxel, in view `number` of many: the picture
    /// is just large enough, at most 400 px.
    ///
    /// # Panics
    /// If `px` is not above 0.
    pub fn camera(&self, px: f64, number: usize) -> Camera {
        let extent = DVec3::from(self.volume.dims.map(|n| (n - 1) as f64));
        let middle = self.volume.world_from_index.transform_point3(0.5 * extent);
        let spacing = self.volume.smallest_spacing();
        let side = (px * extent.length() / FILL).clamp(8.0, MOST_PX).round();
        let focal = 0.5 * side / (0.5 * FOV_Y_DEG.to_radians()).tan();
        let position = middle + direction(number) * focal / px * spacing;
        let look_at = LookAt {
            position,
            target: middle,
            up: DVec3::new(0.1, 1.0, 0.05),
        };
        Camera::perspective(&look_at, FOV_Y_DEG.to_radians(), [side as u32; 2])
            .expect("a view of the volume")
    }
}

/// Picture side of a zoom-out, px: a truth of 64 such frames takes minutes on two cores.
const ZOOM_PX: f64 = 64.0;

impl Subject {
    /// A camera that the volume fills, or `times` as far away.
    ///
    /// # Panics
    /// If `times` is not above 0.
    pub fn zoomed(&self, times: f64) -> Camera {
        let extent =
            DVec3::from(self.volume.dims.map(|n| (n - 1) as f64)) * self.volume.smallest_spacing();
        let middle = self
            .volume
            .world_from_index
            .transform_point3(extent / (2.0 * self.volume.smallest_spacing()));
        let distance = 0.5 * extent.length() / FILL / (0.5 * FOV_Y_DEG.to_radians()).tan();
        let position = middle + direction(0) * distance * times;
        let look_at = LookAt {
            position,
            target: middle,
            up: DVec3::Y,
        };
        let size = [ZOOM_PX as u32; 2];
        Camera::perspective(&look_at, FOV_Y_DEG.to_radians(), size).expect("a view of the volume")
    }
}

/// Directions spread over the sphere: one along an axis, one along a diagonal, then a golden spiral.
fn direction(number: usize) -> DVec3 {
    match number {
        0 => DVec3::new(0.62, 0.38, 0.69).normalize(),
        1 => DVec3::Z,
        _ => {
            let height = 1.0 - 2.0 * ((number as f64 * 0.618_034).fract());
            let turn = number as f64 * 2.399_963;
            let ring = (1.0 - height * height).sqrt();
            DVec3::new(ring * turn.cos(), height, ring * turn.sin())
        }
    }
}
