//! How far each footprint is from the distance of rays: `cargo run -p resample-core --example footprint`.

use std::error::Error;

use glam::{DAffine3, DVec2, DVec3};
use resample_core::footprint::{BallGeometry, Footprint};
use resample_core::{Camera, FootprintMode, GridView, LookAt};

fn main() -> Result<(), Box<dyn Error>> {
    let pose = LookAt {
        position: DVec3::ZERO,
        target: DVec3::Z,
        up: DVec3::NEG_Y,
    };
    let camera = Camera::perspective(&pose, 1.5, [640, 480])?;
    let view = GridView::new(&camera, &DAffine3::IDENTITY);
    // A large ball far from the middle of the picture: half a cone of 15 degrees, 30 degrees off the axis.
    let centre = 10.0 * DVec3::new(0.5, 0.0, 0.75f64.sqrt());
    let radius = 10.0 * 15f64.to_radians().sin();
    let ball = BallGeometry::new(&view, centre, radius).ok_or("the ball lies behind the eye")?;

    for mode in FootprintMode::ALL {
        let footprint = Footprint::new(mode, &ball);
        let mut worst = 0.0f64;
        for pixel in 0..640 * 480 {
            let at = DVec2::new(f64::from(pixel % 640) + 0.5, f64::from(pixel / 640) + 0.5);
            let (origin, direction) = view.ray(at);
            let distance = (centre - origin).cross(direction).length() / direction.length();
            if distance < radius {
                let index = footprint.index2(&view, at).max(0.0).sqrt();
                worst = worst.max((index - distance / radius).abs());
            }
        }
        println!("{mode:?}: largest error of d/r {worst:.1e}");
    }
    Ok(())
}
