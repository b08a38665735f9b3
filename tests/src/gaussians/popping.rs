//! Jumps of pixels while the view turns: the second differences of a pixel over equal steps of the camera. A picture that changes
//! smoothly has small ones, and a pop is one as large as its jump.

use std::sync::Arc;

use glam::DVec3;
use resample_core::image::srgb_from_linear;
use resample_core::{Camera, Image};
use volsplat::{GaussianOptions, GaussianRenderer, Gaussians};

use super::scenes::camera;
use super::twin::GaussianTwin;

/// A turn around the vertical axis.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    /// The eye at its beginning.
    pub eye: DVec3,
    /// Degrees of a step.
    pub step_deg: f64,
    /// Steps.
    pub steps: usize,
    /// Vertical field of view, degrees.
    pub fov_y_deg: f64,
    /// Pixels.
    pub size: [u32; 2],
}

/// A pixel and the middle of three steps, with its second difference.
#[derive(Clone, Copy, Debug)]
pub struct Jump {
    /// Column and row.
    pub pixel: [usize; 2],
    /// The step in the middle.
    pub step: usize,
    /// The greatest of red, green, blue and opacity, in the blend space.
    pub size: f64,
}

impl Turn {
    /// The camera of a step.
    pub fn camera(&self, step: usize) -> Camera {
        let angle = (step as f64 * self.step_deg).to_radians();
        let turned = glam::DQuat::from_rotation_y(angle) * self.eye;
        camera(turned, self.fov_y_deg, self.size)
    }

    /// The greatest jump of each pixel, the greatest first.
    pub fn jumps(&self, gaussians: &Arc<Gaussians>, options: &GaussianOptions) -> Vec<Jump> {
        let mut renderer = GaussianRenderer::new(gaussians.clone(), options).expect("options");
        let mut draw = |step| renderer.render(&self.camera(step)).expect("a frame").image;
        let mut last = [draw(0), draw(1)];
        let width = last[0].width;
        let mut greatest: Vec<Jump> = (0..last[0].rgba.len())
            .map(|at| Jump {
                pixel: [at % width, at / width],
                step: 1,
                size: 0.0,
            })
            .collect();
        for step in 1..self.steps {
            let next = draw(step + 1);
            for jump in &mut greatest {
                let [x, y] = jump.pixel;
                let of = |image: &Image| blended(image.pixel(x, y));
                let size = second_difference([of(&last[0]), of(&last[1]), of(&next)]);
                if size > jump.size {
                    (jump.step, jump.size) = (step, size);
                }
            }
            let [_, middle] = last;
            last = [middle, next];
        }
        greatest.sort_by(|a, b| b.size.total_cmp(&a.size));
        greatest
    }

    /// The second difference of the truth where and when a jump was found.
    pub fn true_jump(&self, gaussians: &Gaussians, jump: &Jump) -> f64 {
        let [x, y] = jump.pixel;
        let of = |step| GaussianTwin::new(gaussians, &self.camera(step)).pixel(x, y);
        second_difference([jump.step - 1, jump.step, jump.step + 1].map(of))
    }
}

/// A pixel in the blend space, times opacity.
pub fn blended([r, g, b, opacity]: [f32; 4]) -> [f64; 4] {
    let encoded = |c: f32| f64::from(srgb_from_linear(c / opacity.max(1e-9)) * opacity);
    [encoded(r), encoded(g), encoded(b), f64::from(opacity)]
}

fn second_difference([before, at, after]: [[f64; 4]; 3]) -> f64 {
    let of = |channel: usize| (before[channel] - 2.0 * at[channel] + after[channel]).abs();
    (0..4).map(of).fold(0.0, f64::max)
}
