//! The two-view scenes with ray-traced truth on which depth-image warpers are compared.
//!
//! Gives a reference view, the target cameras and the true pictures with their depth and the share of each pixel that
//! the reference sees. The files hold EXR channels R, G, B, Z (and `visible`), and cameras in the OpenCV convention with whole numbers
//! at pixel centres.
//!
//! Limits: the scenes are part of the test data; where they are absent a scene gives `None`.

use std::path::Path;

use exr::prelude::read_first_flat_layer_from_file;
use glam::{DMat3, DVec3};
use resample_core::{Camera, Image, Intrinsics, PixelCentre};
use serde_json::Value;
use warp3d::Reference;

use crate::data::data_file;

/// The names of the scenes.
pub const SCENES: [&str; 4] = ["stereo", "sphere", "minify4", "magnify4"];

/// A reference view and one true view.
pub struct WarpScene {
    /// Its name.
    pub name: String,
    /// The view that is warped.
    pub reference: Reference,
    /// The camera to warp to.
    pub target: Camera,
    /// The truth.
    pub truth: Truth,
}

/// A true picture.
pub struct Truth {
    /// Linear colour, opaque.
    pub image: Image,
    /// Camera z, world units.
    pub depth: Vec<f32>,
    /// Share of what the pixel's filter gathers that the reference sees, 0 to 1.
    pub seen: Vec<f32>,
}

/// Share from which on a pixel counts as visible: all of its samples, up to rounding. With this mask, a Lanczos lookup at
/// the true depth gives the published figures of the scenes' ceiling (41.6, 34.3, 22.3, 24.2 dB; here 41.5, 34.3, 22.2, 24.2); with
/// pixels of which half is seen it would give 38.0 and 32.6 on the first two.
const WHOLLY: f32 = 0.999;

impl Truth {
    /// The pixels that the reference sees wholly: over these errors are measured.
    pub fn visible(&self) -> Vec<bool> {
        self.seen.iter().map(|&share| share >= WHOLLY).collect()
    }
}

/// Near plane of every camera here, world units: before everything.
const NEAR: f64 = 1e-3;

impl WarpScene {
    /// The scene of this name; `None`, with a visible skip line for `test`, where it is absent.
    ///
    /// # Panics
    /// If a file is there and cannot be read.
    pub fn load(test: &str, name: &str) -> Option<Self> {
        let file = |file: &str| data_file(test, &format!("warp-truth/{name}/{file}"));
        let (reference, target, cameras) =
            (file("ref.exr")?, file("target.exr")?, file("cameras.json")?);
        let cameras: Value =
            serde_json::from_str(&std::fs::read_to_string(cameras).expect("readable"))
                .expect("JSON");
        let from = channels(&reference);
        let colour = colours(&from);
        let depth = from
            .plane("Z")
            .iter()
            .map(|&z| if z.is_finite() { z } else { f32::NAN })
            .collect();
        let reference = Reference {
            camera: camera(&cameras["ref"]),
            colour,
            depth,
        };
        let to = channels(&target);
        let mut image = Image::transparent(to.size[0], to.size[1]);
        for (pixel, [r, g, b]) in image.rgba.iter_mut().zip(colours(&to)) {
            *pixel = [r, g, b, 1.0];
        }
        let truth = Truth {
            image,
            depth: to.plane("Z").to_vec(),
            seen: to.plane("visible").to_vec(),
        };
        Some(Self {
            name: name.into(),
            reference,
            target: camera(&cameras["targets"][0]),
            truth,
        })
    }
}

/// The planes of an EXR file's first layer.
struct Channels {
    size: [usize; 2],
    planes: Vec<(String, Vec<f32>)>,
}

impl Channels {
    fn plane(&self, name: &str) -> &[f32] {
        let found = self.planes.iter().find(|(channel, _)| channel == name);
        &found.unwrap_or_else(|| panic!("a channel {name}")).1
    }
}

fn channels(path: &Path) -> Channels {
    let image = read_first_flat_layer_from_file(path).expect("a readable EXR file");
    let layer = image.layer_data;
    let planes = layer.channel_data.list.iter();
    Channels {
        size: [layer.size.width(), layer.size.height()],
        planes: planes
            .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()))
            .collect(),
    }
}

fn colours(channels: &Channels) -> Vec<[f32; 3]> {
    let [r, g, b] = ["R", "G", "B"].map(|name| channels.plane(name));
    (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect()
}

fn camera(value: &Value) -> Camera {
    let number = |name: &str| value[name].as_f64().expect("a number");
    let list = |name: &str| -> Vec<f64> {
        value[name]
            .as_array()
            .expect("a list")
            .iter()
            .map(|v| v.as_f64().expect("a number"))
            .collect()
    };
    let intrinsics = Intrinsics {
        width: number("W") as u32,
        height: number("H") as u32,
        fx: number("fx"),
        fy: number("fy"),
        cx: number("cx"),
        cy: number("cy"),
        pixel_centre: PixelCentre::Integer,
    };
    let rotation = DMat3::from_cols_slice(&list("R")).transpose();
    Camera::from_intrinsics(&intrinsics, rotation, DVec3::from_slice(&list("t")), NEAR)
        .expect("a camera")
}
