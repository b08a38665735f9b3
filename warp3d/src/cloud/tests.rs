//! Surfaces by formula, sampled at random, against their antialiased truth; extremes.

mod scenes;

use glam::DVec3;
use resample_core::{Camera, Image, LookAt};

use crate::cloud::{Blend, CloudFrame, CloudOptions, CloudRenderer, PointCloud, prepare};
use scenes::{Scene, Shape, against, truth};

/// A camera at (0.6, -0.8, -3) on the origin, whose picture is `height` px high.
fn camera(height: u32, fov_rad: f64) -> Camera {
    let pose = LookAt {
        position: DVec3::new(0.6, -0.8, -3.0),
        target: DVec3::ZERO,
        up: DVec3::new(0.0, -1.0, 0.0),
    };
    Camera::perspective(&pose, fov_rad, [height * 4 / 3, height]).unwrap()
}

fn drawn(cloud: &PointCloud, camera: &Camera, options: &CloudOptions) -> CloudFrame {
    let prepared = prepare(cloud).unwrap();
    CloudRenderer::new(prepared, options).unwrap().render(camera).unwrap()
}

#[test]
fn measures() {
    for shape in [Shape::Plane, Shape::Sphere] {
        for (name, per_px) in [("one point a px", 1.0), ("twice", 0.25), ("minified 2", 4.0)] {
            let camera = camera(192, 0.9);
            let scene = Scene { shape, waves: 5.0 };
            let cloud = scene.sampled(per_px, &camera);
            let expected = truth(&scene, &camera);
            for blend in [Blend::Linear] {
                for sigma in [0.42] {
                    let options = CloudOptions { blend, sigma_spacings: sigma, ..CloudOptions::default() };
                    let frame = drawn(&cloud, &camera, &options);
                    let found = against(&frame.image, &expected);
                    eprintln!("{shape:?} {name} {blend:?} {sigma}: {found:?} {:?} of {}", frame.stats.left_out, cloud.positions.len());
                    if sigma == 0.42 && blend == Blend::Linear { save(&frame.image, &format!("{shape:?}_{per_px}")); save(&expected, &format!("{shape:?}_truth")); }
                }
            }
        }
    }
}

fn save(image: &Image, name: &str) {
    let mut bytes = format!("P6 {} {} 255\n", image.width, image.height).into_bytes();
    for p in image.clone().over_background([0.1, 0.0, 0.2]).srgb8() { bytes.extend(p); }
    std::fs::write(format!("/tmp/w-d/{name}.ppm"), bytes).unwrap();
}
