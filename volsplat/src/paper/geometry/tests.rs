//! The f32 block geometry against its f64 twin in `resample_core::footprint` and `resample_core::view`.
//!
//! Random grids (sheared, stretched), random cameras, every footprint mode. A position on the screen carries f32's error
//! relative to its distance from the first pixel, so the bounds hold for footprints of more than a few pixels in a
//! picture of 640; relative to a smaller one the same error is larger.

use glam::{DAffine3, DMat3, DVec2};
use resample_core::footprint::BallGeometry;
use resample_core::view::largest_eigenvalue;
use resample_core::{Camera, KernelShape, LookAt};

use crate::paper::geometry::*;

/// A stream of numbers in 0..1 that look random and never change (a linear congruence, high bits taken).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn vector(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.next() - 0.5, self.next() - 0.5, self.next() - 0.5) * 2.0 * half
    }

    /// Axes of length 0.3 to 3, sheared by up to 30 percent; far from the origin.
    fn grid(&mut self) -> DAffine3 {
        let size = DVec3::new(1.0, 1.0, 1.0).map(|_| 10f64.powf(self.next() - 0.5));
        let axes =
            DVec3::AXES.map(|axis| axis * size.dot(axis) + self.vector(0.3) * size.dot(axis));
        DAffine3::from_mat3_translation(
            DMat3::from_cols(axes[0], axes[1], axes[2]),
            self.vector(1e5),
        )
    }

    /// A camera 10 to 60 voxels from the brick's middle that looks somewhere near it.
    fn camera(&mut self, grid: &DAffine3, projection: Projection) -> Camera {
        let middle = grid.transform_point3(DVec3::splat(7.5));
        let away = self.vector(1.0).normalize() * (15.0 + 45.0 * self.next());
        let position = middle + grid.transform_vector3(away);
        let target = middle + grid.transform_vector3(self.vector(4.0));
        let pose = LookAt {
            position,
            target,
            up: DVec3::new(0.1, 1.0, 0.05),
        };
        match projection {
            Projection::Perspective => Camera::perspective(&pose, 0.3 + self.next(), [640, 480]),
            Projection::Orthographic => {
                Camera::orthographic(&pose, 10.0 + 40.0 * self.next(), [640, 480])
            }
        }
        .expect("a valid camera")
    }
}

/// Largest errors found, each relative to the named quantity.
#[derive(Debug, Default)]
struct Worst {
    /// Centre of the form, in half widths of the outline.
    centre: f64,
    /// Value of the form times the pixel's map, on the outline (where it is 1) and halfway.
    index: f64,
    /// Half the box, and its middle, in half boxes.
    bounds: f64,
    /// Spacing, mass, depth, cone.
    relative: f64,
}

fn raise(worst: &mut f64, error: f64) {
    // The negation raises on a NaN too.
    if !(error <= *worst) {
        *worst = error;
    }
}

/// A block that holds samples spread over a brick, with the f64 positions.
fn filled(numbers: &mut Numbers, lens: &Lens) -> (Block, Vec<DVec3>) {
    let mut block = Block::default();
    let corner = DVec3::new(0.0, 0.0, 0.0);
    let mut positions = Vec::new();
    for i in 0..BLOCK {
        let at =
            DVec3::new(numbers.next(), numbers.next(), numbers.next()).map(|x| (x * 16.0).floor());
        (block.x[i], block.y[i], block.z[i]) = (at.x as f32, at.y as f32, at.z as f32);
        positions.push(corner + at);
    }
    lens.fill(lens.at_corner(corner), &mut block);
    (block, positions)
}

fn wide(x: f32) -> f64 {
    f64::from(x)
}

/// Compares every sample of random blocks with the twin.
fn measure(mode: FootprintMode, projection: Projection) -> Worst {
    let mut numbers = Numbers(7);
    let kernel = Kernel::new(KernelShape::Gaussian);
    let mut worst = Worst::default();
    for _ in 0..60 {
        let grid = numbers.grid();
        let camera = numbers.camera(&grid, projection);
        let view = GridView::new(&camera, &grid);
        let choices = SampleOptions {
            footprint: mode,
            select: SelectMode::Splats,
            ..SampleOptions::default()
        };
        let lens = Lens::new(&view, 0, &kernel, &choices, 0.7);
        let (block, positions) = filled(&mut numbers, &lens);
        for (i, at) in positions.iter().enumerate() {
            let Some(ball) = BallGeometry::new(&view, *at, kernel.radius()) else {
                continue;
            };
            // Nearly open outlines lose digits by nature: the extremes have their own tests.
            if view.camera_from_grid.transform_point3(*at).z > 1.5 * wide(lens.depth_reach) {
                let case = Case {
                    block: &block,
                    i,
                    view: &view,
                    ball: &ball,
                    mode,
                };
                compare(&mut worst, &case, *at);
            }
        }
    }
    worst
}

/// A sample of a block, and its ball.
#[derive(Clone, Copy)]
struct Case<'a> {
    block: &'a Block,
    i: usize,
    view: &'a GridView,
    ball: &'a BallGeometry,
    mode: FootprintMode,
}

fn compare(worst: &mut Worst, case: &Case, at: DVec3) {
    let Case {
        block,
        i,
        view,
        ball,
        mode,
    } = *case;
    let ellipse = match mode {
        FootprintMode::AffineApprox => ball.approximate_outline(),
        _ => ball.outline,
    };
    let half = ellipse.half_extent_px();
    let centre = if mode == FootprintMode::Exact {
        ball.projected_px
    } else {
        ellipse.centre_px
    };
    let got = DVec2::new(wide(block.form_x[i]), wide(block.form_y[i]));
    raise(
        &mut worst.centre,
        ((got - centre) / half).abs().max_element(),
    );
    let middle = DVec2::new(wide(block.middle_x[i]), wide(block.middle_y[i]));
    let extent = DVec2::new(wide(block.half_width[i]), wide(block.half_height[i]));
    raise(
        &mut worst.bounds,
        ((middle - ellipse.centre_px) / half).abs().max_element(),
    );
    raise(&mut worst.bounds, (extent / half - 1.0).abs().max_element());
    compare_index(worst, case, ellipse);

    let in_camera = view.camera_from_grid.transform_point3(at);
    let depth = if view.projection == Projection::Perspective {
        in_camera.length()
    } else {
        in_camera.z
    };
    let spacing2 = largest_eigenvalue(view.gram_px2(in_camera));
    // World volume over the opacity unit of 0.7, times the pixels per world area across the ray.
    let area = view.focal.x * view.focal.y * view.cell_volume() / 0.7
        * if view.projection == Projection::Perspective {
            depth / in_camera.z.powi(3)
        } else {
            1.0
        };
    for (got, truth) in [
        (block.depth[i], depth),
        (block.spacing2_px2[i], spacing2),
        (block.area_px2[i], area),
    ] {
        raise(&mut worst.relative, (wide(got) / truth - 1.0).abs());
    }
    raise(
        &mut worst.relative,
        (wide(block.sin2_cone[i]) - ball.sin2_cone).abs(),
    );
}

/// The squared index at places on the outline and halfway to it, from the block's form in f64.
fn compare_index(worst: &mut Worst, case: &Case, ellipse: resample_core::conic::Ellipse) {
    let Case {
        block,
        i,
        view,
        ball,
        mode,
    } = *case;
    for step in 0..16 {
        let direction = DVec2::from_angle(f64::from(step) * std::f64::consts::TAU / 16.0)
            * ellipse.half_extent_px();
        let on_outline = direction / ellipse.value(ellipse.centre_px + direction).sqrt();
        for share in [0.5, 1.0] {
            let pixel = ellipse.centre_px + share * on_outline;
            let [dx, dy] = [
                pixel.x - wide(block.form_x[i]),
                pixel.y - wide(block.form_y[i]),
            ];
            let form = [block.form_xx[i], block.form_xy[i], block.form_yy[i]].map(wide);
            let value = form[0] * dx * dx + 2.0 * form[1] * dx * dy + form[2] * dy * dy;
            let scale = match mode {
                FootprintMode::Exact => {
                    1.0 / (ball.radius.powi(2) * view.ray(pixel).1.length_squared())
                }
                _ => 1.0,
            };
            let truth = match mode {
                FootprintMode::Exact => {
                    let (origin, ray) = view.ray(pixel);
                    let to_centre = ball_centre(view, ball) - origin;
                    to_centre.cross(ray.normalize()).length_squared() / ball.radius.powi(2)
                }
                _ => share * share,
            };
            raise(&mut worst.index, (value * scale - truth).abs());
        }
    }
}

/// The ball's centre, back from its projection: its distance along that ray follows from the cone in perspective, and
/// does not matter for parallel rays.
fn ball_centre(view: &GridView, ball: &BallGeometry) -> DVec3 {
    let (origin, ray) = view.ray(ball.projected_px);
    match view.projection {
        Projection::Perspective => origin + ray.normalize() * ball.radius / ball.sin2_cone.sqrt(),
        Projection::Orthographic => origin,
    }
}

#[test]
fn blocks_agree_with_their_f64_twin() {
    for projection in [Projection::Perspective, Projection::Orthographic] {
        for mode in FootprintMode::ALL {
            let worst = measure(mode, projection);
            println!("{mode:?}, {projection:?}: {worst:?}");
            assert!(
                worst.centre < 2e-5,
                "{mode:?}, {projection:?}: a centre is off by {}",
                worst.centre
            );
            assert!(
                worst.bounds < 2e-5,
                "{mode:?}, {projection:?}: a box is off by {}",
                worst.bounds
            );
            assert!(
                worst.index < 5e-5,
                "{mode:?}, {projection:?}: an index is off by {}",
                worst.index
            );
            assert!(
                worst.relative < 2e-6,
                "{mode:?}, {projection:?}: {} of spacing or mass",
                worst.relative
            );
        }
    }
}
