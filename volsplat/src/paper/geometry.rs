//! Block geometry: where a block of samples falls on the screen and what footprint each has there, in f32.
//!
//! `resample_core::footprint` and `resample_core::view` have the formulas in f64; here they are loops over arrays, which
//! become vector code. Positions are relative to the eye.

use glam::{DVec3, Vec3};
use resample_core::point::PIXEL_SIGMA_PX;
use resample_core::{FootprintMode, GridView, Kernel, Projection, SelectMode};

use crate::look::options::SampleOptions;

/// Samples of a block: enough to amortise the loop heads, few enough for the arrays to stay in the first-level cache.
pub(crate) const BLOCK: usize = 64;

type Lanes = [f32; BLOCK];

/// The geometry of a block of samples, structure of arrays. Lanes past the block's samples hold leftovers.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Block {
    /// Place in the brick (input).
    pub(crate) x: Lanes,
    pub(crate) y: Lanes,
    pub(crate) z: Lanes,
    /// Camera z, world units.
    pub(crate) camera_z: Lanes,
    /// Distance from the eye; camera z in orthographic views.
    pub(crate) depth: Lanes,
    /// Projection of the centre, px.
    pub(crate) screen_x: Lanes,
    pub(crate) screen_y: Lanes,
    /// Square of the larger half axis of the projected unit ball of the grid, px^2: the spacing on the screen.
    pub(crate) spacing2_px2: Lanes,
    /// Optical depth summed over the screen, px^2, of a sample of unit strength.
    pub(crate) area_px2: Lanes,
    /// Centre of the splat's form, px.
    pub(crate) form_x: Lanes,
    /// Centre of the splat's form, px.
    pub(crate) form_y: Lanes,
    /// The form's coefficients.
    pub(crate) form_xx: Lanes,
    /// The form's coefficients.
    pub(crate) form_xy: Lanes,
    /// The form's coefficients.
    pub(crate) form_yy: Lanes,
    /// Factor from the sample's strength to the splat's.
    pub(crate) splat_scale: Lanes,
    /// Squared sine of the half cone angle.
    pub(crate) sin2_cone: Lanes,
    /// Middle of the outline's box, px.
    pub(crate) middle_x: Lanes,
    /// Middle of the outline's box, px.
    pub(crate) middle_y: Lanes,
    /// Half the box, px.
    pub(crate) half_width: Lanes,
    /// Half the box, px.
    pub(crate) half_height: Lanes,
    grid: [Lanes; 3],
    camera: [Lanes; 3],
    gram: [Lanes; 3],
    /// The outline's form around its midpoint, 1 on the outline: xx, xy, yy.
    outline: [Lanes; 3],
}

/// The view and the kernel of a frame, f32, as the block loops want them.
#[derive(Clone, Debug)]
pub(crate) struct Lens {
    view: GridView,
    mode: FootprintMode,
    select: SelectMode,
    parallel: bool,
    axes: [Vec3; 3],
    focal: [f32; 2],
    principal: [f32; 2],
    wx: Vec3,
    wy: Vec3,
    radius2: f32,
    /// r^2 times the outer products of wx and wy: xx, xy, yy.
    ray_form: [f32; 3],
    /// |c x w|^2 is this form of the pixel offset in orthographic views.
    parallel_form: [f32; 3],
    parallel_w2: f32,
    variance: f32,
    /// Cell volume times focal lengths over the opacity unit.
    area_scale: f32,
    units_per_world: f32,
    /// Reach of the kernel along camera z, world units.
    pub(crate) depth_reach: f32,
    /// Near plane, world units.
    pub(crate) near: f32,
    /// From the forms of this layer to those that the tiles' maps, made for the first layer, suit.
    pub(crate) form_factor: f32,
    /// The same for line integrals.
    pub(crate) length_factor: f32,
}

impl Default for Block {
    fn default() -> Self {
        let l = [0.0; BLOCK];
        Self {
            x: l,
            y: l,
            z: l,
            camera_z: l,
            depth: l,
            screen_x: l,
            screen_y: l,
            spacing2_px2: l,
            area_px2: l,
            form_x: l,
            form_y: l,
            form_xx: l,
            form_xy: l,
            form_yy: l,
            splat_scale: l,
            sin2_cone: l,
            middle_x: l,
            middle_y: l,
            half_width: l,
            half_height: l,
            grid: [l; 3],
            camera: [l; 3],
            gram: [l; 3],
            outline: [l; 3],
        }
    }
}

impl Lens {
    /// The lens of a layer whose spacing is the first's, halved `halvings` times; strengths are per `unit` (world).
    pub(crate) fn new(
        view: &GridView,
        halvings: u32,
        kernel: &Kernel,
        choices: &SampleOptions,
        unit: f64,
    ) -> Self {
        let (mode, select) = (choices.footprint, choices.select);
        let side = 0.5f32.powi(halvings as i32);
        // The exact form is in square units of the layer; the others are 1 on the outline.
        let is_exact = mode == FootprintMode::Exact && select != SelectMode::Ewa;
        let radius2 = kernel.radius() * kernel.radius();
        let outer = |a: DVec3, b: DVec3| [a.dot(a), a.dot(b), b.dot(b)];
        let scaled = |form: [f64; 3], by: f64| form.map(|f| (f * by) as f32);
        let m = view.camera_from_grid.matrix3;
        Self {
            view: *view,
            mode,
            select,
            parallel: view.projection == Projection::Orthographic,
            axes: [m.x_axis.as_vec3(), m.y_axis.as_vec3(), m.z_axis.as_vec3()],
            focal: [view.focal.x as f32, view.focal.y as f32],
            principal: [view.principal_px.x as f32, view.principal_px.y as f32],
            wx: view.wx.as_vec3(),
            wy: view.wy.as_vec3(),
            radius2: radius2 as f32,
            ray_form: scaled(outer(view.wx, view.wy), radius2),
            parallel_form: scaled(outer(view.wx.cross(view.w0), view.wy.cross(view.w0)), 1.0),
            parallel_w2: view.w0.length_squared() as f32,
            variance: kernel.variance() as f32,
            area_scale: (view.cell_volume() * view.focal.x * view.focal.y / unit) as f32,
            units_per_world: (1.0 / unit) as f32,
            depth_reach: (kernel.radius() * m.row(2).length()) as f32,
            near: view.near as f32,
            form_factor: if is_exact { side * side } else { 1.0 },
            length_factor: side,
        }
    }

    /// The position of a grid corner in camera space, and in the grid relative to the eye.
    pub(crate) fn at_corner(&self, corner: DVec3) -> [Vec3; 2] {
        let in_camera = self.view.camera_from_grid.transform_point3(corner);
        [in_camera.as_vec3(), (corner - self.view.origin).as_vec3()]
    }

    /// Computes everything but the inputs of `block`.
    #[inline(always)]
    pub(crate) fn fill(&self, corner: [Vec3; 2], block: &mut Block) {
        self.fill_positions(corner, block);
        if self.parallel {
            self.fill_parallel(block);
        } else {
            self.fill_perspective(block);
        }
        for i in 0..BLOCK {
            let [xx, xy, yy] = [block.gram[0][i], block.gram[1][i], block.gram[2][i]];
            let half_difference = 0.5 * (xx - yy);
            block.spacing2_px2[i] =
                0.5 * (xx + yy) + (half_difference * half_difference + xy * xy).sqrt();
        }
        match (self.select, self.mode) {
            (SelectMode::Ewa, _) => self.fill_ewa(block),
            (_, FootprintMode::AffineApprox) => self.fill_affine_approx(block),
            (_, FootprintMode::Affine | FootprintMode::Table) => fill_affine(block),
            (_, FootprintMode::Exact) => {}
        }
    }

    #[inline(always)]
    fn fill_positions(&self, [in_camera, in_grid]: [Vec3; 2], block: &mut Block) {
        let [ax, ay, az] = self.axes;
        for i in 0..BLOCK {
            let (x, y, z) = (block.x[i], block.y[i], block.z[i]);
            block.camera[0][i] = in_camera.x + x * ax.x + y * ay.x + z * az.x;
            block.camera[1][i] = in_camera.y + x * ax.y + y * ay.y + z * az.y;
            block.camera[2][i] = in_camera.z + x * ax.z + y * ay.z + z * az.z;
            block.camera_z[i] = block.camera[2][i];
            block.grid[0][i] = in_grid.x + x;
            block.grid[1][i] = in_grid.y + y;
            block.grid[2][i] = in_grid.z + z;
        }
    }

    #[inline(always)]
    fn fill_perspective(&self, block: &mut Block) {
        let ([fx, fy], [px, py], [ax, ay, az]) = (self.focal, self.principal, self.axes);
        for i in 0..BLOCK {
            let (cx, cy, cz) = (block.camera[0][i], block.camera[1][i], block.camera[2][i]);
            let inverse_z = 1.0 / cz;
            let (u, v) = (cx * inverse_z, cy * inverse_z);
            let depth = (cx * cx + cy * cy + cz * cz).sqrt();
            block.depth[i] = depth;
            block.screen_x[i] = fx * u + px;
            block.screen_y[i] = fy * v + py;
            let scale_x = fx * inverse_z;
            let scale_y = fy * inverse_z;
            // The Jacobian of the projection, one column per grid axis.
            let (x0, y0) = (scale_x * (ax.x - u * ax.z), scale_y * (ax.y - v * ax.z));
            let (x1, y1) = (scale_x * (ay.x - u * ay.z), scale_y * (ay.y - v * ay.z));
            let (x2, y2) = (scale_x * (az.x - u * az.z), scale_y * (az.y - v * az.z));
            block.gram[0][i] = x0 * x0 + x1 * x1 + x2 * x2;
            block.gram[1][i] = x0 * y0 + x1 * y1 + x2 * y2;
            block.gram[2][i] = y0 * y0 + y1 * y1 + y2 * y2;
            // dV = |v| dl dA with |v| = depth / z; the screen is focal / z times the plane at z.
            block.area_px2[i] = self.area_scale * depth * inverse_z * inverse_z * inverse_z;
        }
        self.fill_perspective_outline(block);
    }

    /// The exact form around the projected centre, and the box of the exact outline around its midpoint.
    #[inline(always)]
    fn fill_perspective_outline(&self, block: &mut Block) {
        let (wx, wy) = (self.wx, self.wy);
        for i in 0..BLOCK {
            let c = [block.grid[0][i], block.grid[1][i], block.grid[2][i]];
            let inverse_z = 1.0 / block.camera_z[i];
            let a = [
                c[1] * wx.z - c[2] * wx.y,
                c[2] * wx.x - c[0] * wx.z,
                c[0] * wx.y - c[1] * wx.x,
            ];
            let b = [
                c[1] * wy.z - c[2] * wy.y,
                c[2] * wy.x - c[0] * wy.z,
                c[0] * wy.y - c[1] * wy.x,
            ];
            let xx = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
            let xy = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let yy = b[0] * b[0] + b[1] * b[1] + b[2] * b[2];
            let c2 = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
            let nx = (wx.x * c[0] + wx.y * c[1] + wx.z * c[2]) * inverse_z;
            let ny = (wy.x * c[0] + wy.y * c[1] + wy.z * c[2]) * inverse_z;
            let (oxx, oxy, oyy) = (
                xx - self.ray_form[0],
                xy - self.ray_form[1],
                yy - self.ray_form[2],
            );
            let inverse_det = 1.0 / (oxx * oyy - oxy * oxy);
            let shift_x = self.radius2 * inverse_det * (oyy * nx - oxy * ny);
            let shift_y = self.radius2 * inverse_det * (oxx * ny - oxy * nx);
            let depth = self.radius2 * (c2 * inverse_z * inverse_z + nx * shift_x + ny * shift_y);
            block.form_x[i] = block.screen_x[i];
            block.form_y[i] = block.screen_y[i];
            block.form_xx[i] = xx;
            block.form_xy[i] = xy;
            block.form_yy[i] = yy;
            block.splat_scale[i] = 1.0;
            block.sin2_cone[i] = self.radius2 / c2;
            block.middle_x[i] = block.screen_x[i] + shift_x;
            block.middle_y[i] = block.screen_y[i] + shift_y;
            block.half_width[i] = (depth * oyy * inverse_det).sqrt();
            block.half_height[i] = (depth * oxx * inverse_det).sqrt();
            let inverse_depth = 1.0 / depth;
            block.outline[0][i] = oxx * inverse_depth;
            block.outline[1][i] = oxy * inverse_depth;
            block.outline[2][i] = oyy * inverse_depth;
        }
    }

    #[inline(always)]
    fn fill_parallel(&self, block: &mut Block) {
        let ([fx, fy], [px, py]) = (self.focal, self.principal);
        let [xx, xy, yy] = self.parallel_form;
        let scale = self.radius2 * self.parallel_w2;
        let inverse_det = 1.0 / (xx * yy - xy * xy);
        let half = [
            (scale * yy * inverse_det).sqrt(),
            (scale * xx * inverse_det).sqrt(),
        ];
        let gram = self.axes.iter().fold([0.0; 3], |g, a| {
            let (x, y) = (fx * a.x, fy * a.y);
            [g[0] + x * x, g[1] + x * y, g[2] + y * y]
        });
        for i in 0..BLOCK {
            block.depth[i] = block.camera_z[i];
            block.screen_x[i] = fx * block.camera[0][i] + px;
            block.screen_y[i] = fy * block.camera[1][i] + py;
            (block.gram[0][i], block.gram[1][i], block.gram[2][i]) = (gram[0], gram[1], gram[2]);
            block.area_px2[i] = self.area_scale;
            (block.form_x[i], block.form_y[i]) = (block.screen_x[i], block.screen_y[i]);
            (block.form_xx[i], block.form_xy[i], block.form_yy[i]) = (xx, xy, yy);
            block.splat_scale[i] = 1.0;
            block.sin2_cone[i] = 0.0;
            (block.middle_x[i], block.middle_y[i]) = (block.screen_x[i], block.screen_y[i]);
            (block.half_width[i], block.half_height[i]) = (half[0], half[1]);
            (
                block.outline[0][i],
                block.outline[1][i],
                block.outline[2][i],
            ) = (xx / scale, xy / scale, yy / scale);
        }
    }

    /// Appendix A's small-angle form: axes through the projected centre. Starts from the exact outline's ellipse.
    #[inline(always)]
    fn fill_affine_approx(&self, block: &mut Block) {
        fill_affine(block);
        for i in 0..BLOCK {
            let (xx, xy, yy) = (block.form_xx[i], block.form_xy[i], block.form_yy[i]);
            let (shift_x, shift_y) = (
                block.middle_x[i] - block.screen_x[i],
                block.middle_y[i] - block.screen_y[i],
            );
            let shift = (shift_x * shift_x + shift_y * shift_y).sqrt();
            // On the axis every direction is an axis of the ellipse's own: take x.
            let on_axis = if shift > 0.0 { 0.0 } else { 1.0 };
            let inverse = 1.0 / (shift + on_axis);
            let (tx, ty) = (shift_x * inverse + on_axis, shift_y * inverse);
            let (ux, uy) = (xx * tx + xy * ty, xy * tx + yy * ty);
            // The conjugate direction is perpendicular to the form applied to the first one.
            let (sx, sy) = (-uy, ux);
            let (vx, vy) = (xx * sx + xy * sy, xy * sx + yy * sy);
            let (along2, across2) = (tx * ux + ty * uy, sx * vx + sy * vy);
            let rest = 1.0 - shift * shift * along2;
            let reach = shift + 1.0 / along2.sqrt();
            let (along, across) = (1.0 / (along2 * reach), 1.0 / (across2 * rest).sqrt());
            let (ux, uy, vx, vy) = (ux * along, uy * along, vx * across, vy * across);
            let (xx, xy, yy) = (ux * ux + vx * vx, ux * uy + vx * vy, uy * uy + vy * vy);
            let inverse_det = 1.0 / (xx * yy - xy * xy);
            (block.form_x[i], block.form_y[i]) = (block.screen_x[i], block.screen_y[i]);
            (block.form_xx[i], block.form_xy[i], block.form_yy[i]) = (xx, xy, yy);
            (block.middle_x[i], block.middle_y[i]) = (block.screen_x[i], block.screen_y[i]);
            block.half_width[i] = (yy * inverse_det).sqrt();
            block.half_height[i] = (xx * inverse_det).sqrt();
        }
    }

    /// EWA: the kernel's screen covariance plus the pixel filter's, with the sample's energy spread over it.
    #[inline(always)]
    fn fill_ewa(&self, block: &mut Block) {
        let prefilter = (PIXEL_SIGMA_PX * PIXEL_SIGMA_PX) as f32;
        // The footprint table ends at the kernel's radius: its square over its variance is where the ellipse ends.
        let cutoff2 = self.radius2 / self.variance;
        for i in 0..BLOCK {
            let sxx = self.variance * block.gram[0][i] + prefilter;
            let sxy = self.variance * block.gram[1][i];
            let syy = self.variance * block.gram[2][i] + prefilter;
            let det = sxx * syy - sxy * sxy;
            let inverse = 1.0 / (det * cutoff2);
            (block.form_x[i], block.form_y[i]) = (block.screen_x[i], block.screen_y[i]);
            (block.form_xx[i], block.form_xy[i], block.form_yy[i]) =
                (syy * inverse, -sxy * inverse, sxx * inverse);
            (block.middle_x[i], block.middle_y[i]) = (block.screen_x[i], block.screen_y[i]);
            block.half_width[i] = (sxx * cutoff2).sqrt();
            block.half_height[i] = (syy * cutoff2).sqrt();
            // The line integral covers 1 / (r^2 sqrt(det form)) px^2; det form = 1 / (det cutoff2^2). The tile then
            // multiplies by the units along the pixel's ray, taken out here at the centre's ray.
            let g = [block.grid[0][i], block.grid[1][i], block.grid[2][i]];
            let grid_length = (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt();
            let unit_per_grid = if self.parallel {
                self.units_per_world / self.parallel_w2.sqrt()
            } else {
                block.depth[i] / grid_length * self.units_per_world
            };
            block.splat_scale[i] =
                block.area_px2[i] * self.radius2 / (det.sqrt() * cutoff2 * unit_per_grid);
        }
    }
}

/// The exact outline as an ellipse of value 1 around its midpoint.
#[inline(always)]
fn fill_affine(block: &mut Block) {
    (block.form_x, block.form_y) = (block.middle_x, block.middle_y);
    [block.form_xx, block.form_xy, block.form_yy] = block.outline;
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DMat3, DVec2};
    use resample_core::footprint::BallGeometry;
    use resample_core::view::largest_eigenvalue;
    use resample_core::{Camera, KernelShape, LookAt};

    use super::*;

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
                Projection::Perspective => {
                    Camera::perspective(&pose, 0.3 + self.next(), [640, 480])
                }
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
            let at = DVec3::new(numbers.next(), numbers.next(), numbers.next())
                .map(|x| (x * 16.0).floor());
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
            Projection::Perspective => {
                origin + ray.normalize() * ball.radius / ball.sin2_cone.sqrt()
            }
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
}
