//! The scenes in which texture filters are compared: textured surfaces with a fixed camera and a supersampled truth.
//!
//! Gives cameras and truths by name. The truth is the bilinearly reconstructed texture in linear light through a
//! filter of the pixel, 1024 samples a pixel: a Gaussian of sigma 0.5 px, or the pixel's square.
//!
//! Limits: scenes and truths are part of the test data; where they are absent a scene gives `None`.

use glam::{DMat3, DVec3};
use resample_core::camera::{Camera, Intrinsics, PixelCentre};
use resample_core::{Image, LookAt};
use resample_io::rendered;
use serde_json::Value;
use texmap::{LoadOptions, Scene};

use crate::data::data_file;

/// Picture side, px.
pub const SIDE_PX: u32 = 512;

/// A scene of the comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureScene {
    /// The checkerboard plane of the paper's Figure 5: magnified in front, minified behind.
    CheckerPlane,
    /// A slanted Siemens star.
    Siemens,
    /// A photograph tiled 8x8 on a slanted quad, minified 8 to 30 times.
    PhotoMinified,
    /// A small mesh with a large texture, minified about 4 times.
    Avocado,
}

/// The filter of the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TruthFilter {
    /// Gaussian, sigma 0.5 px.
    Gaussian,
    /// The pixel's square.
    Box,
}

impl TextureScene {
    /// All four.
    pub const ALL: [Self; 4] = [
        Self::CheckerPlane,
        Self::Siemens,
        Self::PhotoMinified,
        Self::Avocado,
    ];

    /// As in the file names.
    pub fn name(self) -> &'static str {
        match self {
            Self::CheckerPlane => "checker_fig5",
            Self::Siemens => "siemens",
            Self::PhotoMinified => "astro_min",
            Self::Avocado => "avocado",
        }
    }

    /// The textured surface; `None`, with a visible skip line for `test`, where it is absent.
    ///
    /// # Panics
    /// If the file is there and cannot be read.
    pub fn scene(self, test: &str) -> Option<Scene> {
        let path = data_file(test, &format!("texture-truth/{}/scene.glb", self.name()))?;
        Some(
            texmap::load(&path, &LoadOptions::default())
                .expect("the scene is readable")
                .scene,
        )
    }

    /// The camera of the truth; `None`, with a visible skip line for `test`, where the data is absent.
    ///
    /// # Panics
    /// If the file is there and not what it should be.
    pub fn camera(self, test: &str) -> Option<Camera> {
        let path = data_file(test, &format!("texture-truth/{}/scene.json", self.name()))?;
        let text = std::fs::read_to_string(path).expect("the scene file is readable");
        let json: Value = serde_json::from_str(&text).expect("the scene file is JSON");
        let entry =
            |row: usize, column: usize| json["cam"][row][column].as_f64().expect("a 4x4 matrix");
        let column = |c: usize| DVec3::new(entry(0, c), entry(1, c), entry(2, c));
        let (right, up, back, position) = (column(0), column(1), column(2), column(3));
        let fov_y_rad = json["fov"].as_f64().expect("a field of view").to_radians();
        let near = json["near"].as_f64().expect("a near plane");
        let rotation = DMat3::from_cols(right, -up, -back).transpose();
        Some(square_camera(
            fov_y_rad,
            rotation,
            -(rotation * position),
            near,
        ))
    }

    /// A truth; `None`, with a visible skip line for `test`, where it is absent.
    ///
    /// # Panics
    /// If the file is there and cannot be read.
    pub fn truth(self, test: &str, filter: TruthFilter) -> Option<Image> {
        let file = match filter {
            TruthFilter::Gaussian => "truth_gauss.exr",
            TruthFilter::Box => "truth_box.exr",
        };
        let path = data_file(test, &format!("texture-truth/{}/{file}", self.name()))?;
        Some(rendered::read(&path).expect("the truth is a readable picture"))
    }
}

/// A camera with square pixels and the principal point in the middle.
fn square_camera(fov_y_rad: f64, rotation: DMat3, translation: DVec3, near: f64) -> Camera {
    let focal = 0.5 * f64::from(SIDE_PX) / (0.5 * fov_y_rad).tan();
    let intrinsics = Intrinsics {
        width: SIDE_PX,
        height: SIDE_PX,
        fx: focal,
        fy: focal,
        cx: 0.5 * f64::from(SIDE_PX),
        cy: 0.5 * f64::from(SIDE_PX),
        pixel_centre: PixelCentre::Half,
    };
    Camera::from_intrinsics(&intrinsics, rotation, translation, near)
        .expect("a camera of the data is valid")
}

/// A camera at `position` that looks at `target`, y up, for analytic scenes.
///
/// # Panics
/// If the pose gives no direction.
pub fn looking_camera(position: DVec3, target: DVec3, fov_y_deg: f64, size: [u32; 2]) -> Camera {
    let pose = LookAt {
        position,
        target,
        up: DVec3::Y,
    };
    Camera::perspective(&pose, fov_y_deg.to_radians(), size).expect("a pose with a direction")
}
