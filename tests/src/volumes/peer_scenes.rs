//! The six views in which volume renderers are compared: two volumes, three distances each, 400x400 px.
//!
//! Gives volumes, transfer functions, cameras and truths. "close" magnifies every voxel, "far" minifies every voxel to
//! half a pixel, "mixed" does both in one wide-angle picture. Opacity is per voxel, without shading; the truth is the
//! trilinear, post-classified integral, once with one ray a pixel centre and once antialiased.
//!
//! Limits: the volumes and truths are part of the test data; where they are absent a scene gives `None`.

use std::path::PathBuf;

use glam::{DQuat, DVec3};
use resample_core::{Camera, Image, LookAt};
use resample_io::rendered;
use volsplat::transfer::{ColourKnot, OpacityKnot};
use volsplat::{LoadOptions, RawOptions, TransferFunction, Volume, VoxelType};

use crate::data::data_file;

/// Picture side, px.
pub const SIDE_PX: u32 = 400;

/// A volume of the comparison. Voxels are 8-bit, at unit spacing, the first at the origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// CT of an engine block, 256x256x128.
    Engine,
    /// Angiography of an aneurism, 256x256x256.
    Aneurism,
}

/// How far the camera stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distance {
    /// Every voxel is larger than a pixel; 30 degrees high.
    Close,
    /// The volume's centre has one voxel a pixel; 60 degrees high.
    Mixed,
    /// The volume's centre has two voxels a pixel; 30 degrees high.
    Far,
}

/// One view of one volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scene {
    /// The subject.
    pub subject: Subject,
    /// From where.
    pub distance: Distance,
}

/// The picture that is the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Truth {
    /// One ray through each pixel's centre.
    Point,
    /// The mean over each pixel's square.
    Area,
}

/// A camera pose with its field of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Eye, target and up, voxels.
    pub look_at: LookAt,
    /// Vertical field of view, radians.
    pub fov_y_rad: f64,
}

impl Scene {
    /// All six, subject by subject, from close to far.
    pub const ALL: [Self; 6] = [
        Self {
            subject: Subject::Engine,
            distance: Distance::Close,
        },
        Self {
            subject: Subject::Engine,
            distance: Distance::Mixed,
        },
        Self {
            subject: Subject::Engine,
            distance: Distance::Far,
        },
        Self {
            subject: Subject::Aneurism,
            distance: Distance::Close,
        },
        Self {
            subject: Subject::Aneurism,
            distance: Distance::Mixed,
        },
        Self {
            subject: Subject::Aneurism,
            distance: Distance::Far,
        },
    ];

    /// Such as `engine close`.
    pub fn name(&self) -> String {
        format!("{} {}", self.subject.name(), self.distance.name())
    }

    /// Where the camera stands.
    pub fn pose(&self) -> Pose {
        let extent = DVec3::from(self.subject.dims().map(|n| (n - 1) as f64));
        let (centre, radius) = (0.5 * extent, 0.5 * extent.length());
        let fov_y_rad: f64 = if self.distance == Distance::Mixed {
            60f64
        } else {
            30.0
        }
        .to_radians();
        let focal_px = 0.5 * f64::from(SIDE_PX) / (0.5 * fov_y_rad).tan();
        let from_centre = match self.distance {
            // A cube of 256 voxels is seen from 420; the far side stays just above one pixel per voxel.
            Distance::Close => (420.0 * radius / 220.8).min(0.97 * focal_px - radius),
            Distance::Mixed => focal_px.max(1.08 * radius),
            Distance::Far => 2.0 * focal_px,
        };
        let position = centre + from_centre * DVec3::new(0.62, 0.38, 0.69).normalize();
        Pose {
            look_at: LookAt {
                position,
                target: centre,
                up: DVec3::Y,
            },
            fov_y_rad,
        }
    }

    /// A truth of this view; `None`, with a visible skip line for `test`, where it is absent.
    ///
    /// # Panics
    /// If the file is there and cannot be read.
    pub fn truth(&self, test: &str, truth: Truth) -> Option<Image> {
        let (subject, distance) = (self.subject.name(), self.distance.name());
        let file = format!(
            "volume-truth/{subject}_{distance}_{SIDE_PX}_{}.exr",
            truth.name()
        );
        Some(rendered::read(&data_file(test, &file)?).expect("the truth is a readable picture"))
    }
}

impl Truth {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Point, Self::Area];

    /// As in the file names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Area => "area",
        }
    }
}

impl Distance {
    /// As in the file names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Close => "close",
            Self::Mixed => "mixed",
            Self::Far => "far",
        }
    }
}

impl Pose {
    /// The pose after the eye has moved about the target, around the up axis.
    pub fn turned(&self, angle_rad: f64) -> Self {
        let LookAt {
            position,
            target,
            up,
        } = self.look_at;
        let around = DQuat::from_axis_angle(up, angle_rad);
        Self {
            look_at: LookAt {
                position: target + around * (position - target),
                ..self.look_at
            },
            ..*self
        }
    }

    /// The camera for a picture of [`SIDE_PX`].
    ///
    /// # Panics
    /// If the pose is degenerate, which those of the scenes are not.
    pub fn camera(&self) -> Camera {
        Camera::perspective(&self.look_at, self.fov_y_rad, [SIDE_PX; 2])
            .expect("a pose that has a direction")
    }
}

impl Subject {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Engine, Self::Aneurism];

    /// As in the file names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Engine => "engine",
            Self::Aneurism => "aneurism",
        }
    }

    /// Voxels along x, y and z.
    pub fn dims(self) -> [usize; 3] {
        match self {
            Self::Engine => [256, 256, 128],
            Self::Aneurism => [256; 3],
        }
    }

    /// The volume; `None`, with a visible skip line for `test`, where it is absent.
    ///
    /// # Panics
    /// If the file is there and cannot be read.
    pub fn volume(self, test: &str) -> Option<Volume> {
        let [x, y, z] = self.dims();
        let path: PathBuf = data_file(
            test,
            &format!("volumes/raw/{}_{x}x{y}x{z}_uint8.raw", self.name()),
        )?;
        let options = LoadOptions {
            raw: Some(RawOptions::new(self.dims(), VoxelType::U8)),
            ..LoadOptions::default()
        };
        Some(volsplat::load(&path, &options).expect("the volume is as large as its name says"))
    }

    /// The transfer function of the comparison: opacity per voxel, linear colour.
    ///
    /// # Panics
    /// Never: the knots ascend.
    pub fn transfer(self) -> TransferFunction {
        let (opacities, colours): (&[[f64; 2]], &[[f64; 4]]) = match self {
            Self::Engine => (&ENGINE_OPACITIES, &ENGINE_COLOURS),
            Self::Aneurism => (&ANEURISM_OPACITIES, &ANEURISM_COLOURS),
        };
        let colour = |k: &[f64; 4]| ColourKnot {
            value: k[0],
            rgb: [k[1] as f32, k[2] as f32, k[3] as f32],
        };
        let opacity = |k: &[f64; 2]| OpacityKnot {
            value: k[0],
            opacity: k[1],
        };
        let colours = colours.iter().map(colour).collect();
        TransferFunction::new(colours, opacities.iter().map(opacity).collect())
            .expect("the knots ascend")
    }
}

/// Value and opacity.
const ENGINE_OPACITIES: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [70.0, 0.0],
    [110.0, 0.05],
    [150.0, 0.08],
    [200.0, 0.4],
    [255.0, 0.7],
];

/// Value and linear red, green, blue.
const ENGINE_COLOURS: [[f64; 4]; 5] = [
    [0.0, 0.0, 0.0, 0.0],
    [90.0, 0.35, 0.45, 0.6],
    [150.0, 0.6, 0.65, 0.7],
    [195.0, 0.9, 0.6, 0.2],
    [255.0, 1.0, 0.9, 0.6],
];

const ANEURISM_OPACITIES: [[f64; 2]; 5] = [
    [0.0, 0.0],
    [24.0, 0.0],
    [80.0, 0.35],
    [140.0, 0.8],
    [255.0, 0.9],
];

const ANEURISM_COLOURS: [[f64; 4]; 4] = [
    [0.0, 0.6, 0.1, 0.1],
    [90.0, 0.9, 0.2, 0.15],
    [180.0, 1.0, 0.75, 0.6],
    [255.0, 1.0, 1.0, 0.95],
];
