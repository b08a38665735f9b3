//! What must hold of any numbers: inputs are drawn log-uniformly over thirty orders of size and more.

mod found;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;
use resample_core::{Camera, Image, LookAt, SelectMode};
use resample_tests::choices::{classified_orders, with_field, with_samples};
use resample_tests::meshes::textured::{photo, quad_scene};
use resample_tests::volumes::scenes::{
    coloured, grey, orthographic, single_voxel, worst_difference,
};
use texmap::scene::Wrap;
use volsplat::{
    Blend, DepthPlane, RenderOptions, Renderer, Shading, TransferFunction, Volume, Voxels,
};
use warp3d::{Fill, Reference, WarpOptions, Warper};

/// The file of the seeds of failures, which the next run tries first. Turn a failure into a test with a name in `found`, then remove the file.
const SEEDS: &str = "tests/all/numbers/seeds.txt";

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(SEEDS))),
        ..ProptestConfig::default()
    }
}

/// A number whose logarithm is uniform.
fn log_uniform(decades: std::ops::Range<f64>) -> impl Strategy<Value = f64> {
    decades.prop_map(|exponent| 10f64.powf(exponent))
}

/// A view of a small volume: everything in units of the spacing but the spacing itself.
#[derive(Clone, Debug)]
struct View {
    spacing: f64,
    stretch: [f64; 2],
    /// From the middle of the volume, and where to.
    direction: DVec3,
    distance: f64,
    fov_deg: f64,
    parallel: bool,
    opacity: f64,
    unit: f64,
    scalars: f64,
    choice: usize,
}

fn views() -> impl Strategy<Value = View> {
    let place = (
        log_uniform(-15.0..15.0),
        [log_uniform(-2.0..2.0), log_uniform(-2.0..2.0)],
    );
    let eye = (
        (-1.0..1.0, -1.0..1.0, -1.0..1.0),
        log_uniform(-3.0..12.0),
        log_uniform(-4.0..2.2),
        any::<bool>(),
    );
    let look = (
        log_uniform(-15.0..0.0),
        log_uniform(-40.0..20.0),
        log_uniform(-35.0..35.0),
        0..choices().len(),
    );
    (place, eye, look).prop_map(|((spacing, stretch), eye, look)| {
        let ((x, y, z), distance, fov_deg, parallel) = eye;
        let (opacity, unit, scalars, choice) = look;
        View {
            spacing,
            stretch,
            direction: DVec3::new(x, y, z).normalize_or(DVec3::Z),
            distance,
            fov_deg,
            parallel,
            opacity,
            unit,
            scalars,
            choice,
        }
    })
}

fn choices() -> Vec<RenderOptions> {
    let field = RenderOptions::default();
    let mut all = vec![
        RenderOptions {
            shading: Shading::Phong,
            ..field.clone()
        },
        with_field(field.clone(), |field| field.blend = Blend::Average),
        RenderOptions {
            min_transmittance: 0.0,
            ..field
        },
        RenderOptions::every_sample(),
        RenderOptions::kernel_sheets(),
    ];
    for order in classified_orders() {
        for select in [SelectMode::Splats, SelectMode::Points] {
            all.push(with_samples(RenderOptions::paper(), |samples| {
                (samples.order, samples.select) = (order, select);
            }));
        }
    }
    all.push(with_samples(RenderOptions::axis_sheets(), |samples| {
        samples.select = SelectMode::Ewa;
    }));
    all
}

impl View {
    const DIMS: [usize; 3] = [4, 3, 5];

    fn placed(&self) -> DAffine3 {
        let [y, z] = self.stretch;
        DAffine3::from_scale(self.spacing * DVec3::new(1.0, y, z))
    }

    fn volume(&self, placed: DAffine3) -> Volume {
        let values = (0..60).map(|i| self.scalars * (f64::from(i * 37 % 61) / 61.0));
        Volume::new(Self::DIMS, Voxels::F64(values.collect()), placed).expect("a volume")
    }

    fn transfer(&self, opacity: f64) -> TransferFunction {
        let spread = coloured(opacity);
        let mut knots = spread.opacity_knots().to_vec();
        knots.iter_mut().for_each(|knot| knot.value *= self.scalars);
        let mut colours = spread.colour_knots().to_vec();
        colours
            .iter_mut()
            .for_each(|knot| knot.value *= self.scalars);
        TransferFunction::new(colours, knots).expect("a function")
    }

    fn camera(&self) -> Camera {
        let middle = self.placed().transform_point3(DVec3::new(1.5, 1.0, 2.0));
        let pose = LookAt {
            position: middle + self.spacing * self.distance * self.direction,
            target: middle,
            up: DVec3::new(0.12, 1.0, 0.34),
        };
        let size = [20, 14];
        let camera = if self.parallel {
            Camera::orthographic(&pose, self.spacing * self.fov_deg, size)
        } else {
            Camera::perspective(&pose, self.fov_deg.to_radians(), size)
        };
        camera.expect("a camera")
    }

    fn options(&self) -> RenderOptions {
        RenderOptions {
            opacity_unit: Some(self.spacing * self.unit),
            depth: DepthPlane::Expected,
            ..choices().swap_remove(self.choice)
        }
    }

    fn draw(&self) -> Image {
        self.draw_with(&self.transfer(self.opacity), self.placed(), &self.camera())
    }

    fn draw_with(&self, transfer: &TransferFunction, placed: DAffine3, camera: &Camera) -> Image {
        let volume = self.volume(placed);
        let mut renderer =
            Renderer::new(&volume, transfer, &self.options()).expect("valid options");
        renderer.render(camera).expect("a valid camera").image
    }

    /// The same view of ordinary numbers, from outside: where two ways may differ by rounding alone.
    fn ordinary(mut self) -> Self {
        self.stretch = self.stretch.map(|s| s.sqrt().sqrt());
        self.distance = 7.0 + self.distance.ln().abs();
        self.fov_deg = if self.parallel { 8.0 } else { 45.0 };
        (self.unit, self.opacity) = (1.0, 0.05 + self.opacity * 0.9);
        self.choice = 2;
        self
    }
}

/// The worst difference between pictures of a volume and of the same one with an axis stored backwards.
///
/// A sample that lies on a face of the volume, to the last bit of its position, is inside in one of them and outside in the other: one view of
/// some 15,000 has such a ray. So pictures that differ are drawn again, from a little beside.
fn stored_backwards(view: &View, axis: usize) -> f64 {
    let view = view.clone().ordinary();
    let volume = view.volume(view.placed());
    let [x, y, _] = View::DIMS;
    let mut flip = DVec3::ONE;
    flip[axis] = -1.0;
    let mut first = DVec3::ZERO;
    first[axis] = (View::DIMS[axis] - 1) as f64;
    let from_stored = DAffine3::from_mat3_translation(DMat3::from_diagonal(flip), first);
    let value = |i: usize| {
        let at = DVec3::new((i % x) as f64, (i / x % y) as f64, (i / (x * y)) as f64);
        let [i, j, k] = from_stored
            .transform_point3(at)
            .to_array()
            .map(|c| c as usize);
        volume.value(i + x * (j + y * k))
    };
    let stored = Volume::new(
        View::DIMS,
        Voxels::F64((0..60).map(value).collect()),
        view.placed() * from_stored,
    )
    .expect("a volume");
    let transfer = view.transfer(view.opacity);
    let apart = |view: &View| {
        let [a, b] = [&volume, &stored].map(|volume| {
            let mut renderer =
                Renderer::new(volume, &transfer, &view.options()).expect("valid options");
            renderer
                .render(&view.camera())
                .expect("a valid camera")
                .image
        });
        worst_difference(&a, &b)
    };
    let beside = View {
        direction: (view.direction + DVec3::new(1e-3, 2e-3, -1e-3)).normalize(),
        ..view.clone()
    };
    match apart(&view) {
        once if once > 2e-4 => apart(&beside),
        once => once,
    }
}

#[test]
fn a_sample_on_a_face_is_no_other_volume() {
    // The ray through (11, 9) has a sample on a face.
    let view = View {
        spacing: 1.0,
        stretch: [0.095_173_266_130_331_23, 1.0],
        direction: DVec3::new(
            -0.410_217_407_679_600_2,
            -0.901_038_138_790_881_3,
            0.140_896_951_283_173_87,
        ),
        distance: 0.067_644_981_618_399_19,
        fov_deg: 1.0,
        parallel: true,
        opacity: 1.0,
        unit: 1.0,
        scalars: 1.0,
        choice: 0,
    };
    let apart = stored_backwards(&view, 0);
    assert!(apart <= 2e-4, "they differ by {apart}");
}

fn sound(image: &Image) -> Result<(), TestCaseError> {
    for pixel in &image.rgba {
        let is_good = pixel.iter().all(|c| c.is_finite()) && (0.0..=1.0).contains(&pixel[3]);
        prop_assert!(is_good, "a pixel is {pixel:?}");
    }
    for depth in image.depth.iter().flatten() {
        prop_assert!(!depth.is_nan(), "a depth is no number");
    }
    Ok(())
}

proptest! {
    #![proptest_config(cases(250))]

    #[test]
    fn no_volume_gives_what_is_no_colour(view in views()) {
        sound(&view.draw())?;
    }

    #[test]
    fn volumes_in_units_of_powers_of_two_are_the_same_bytes(view in views(), k in -45..45) {
        let unit = 2f64.powi(k);
        let scaled = View { spacing: view.spacing * unit, ..view.clone() };
        let (one, other) = (view.draw(), scaled.draw());
        prop_assert_eq!(one.rgba, other.rgba);
        let depths = one.depth.iter().flatten().zip(other.depth.iter().flatten());
        for (a, b) in depths {
            prop_assert_eq!((f64::from(*a) * unit) as f32, *b);
        }
    }

    #[test]
    fn more_opacity_lets_less_light_through(view in views(), more in 0.0..1.0) {
        let view = view.ordinary();
        let opacity = view.opacity + more * (1.0 - view.opacity);
        let [less, more] = [view.opacity, opacity].map(|opacity| {
            view.draw_with(&view.transfer(opacity), view.placed(), &view.camera())
        });
        for (less, more) in less.rgba.iter().zip(&more.rgba) {
            prop_assert!(less[3] <= more[3] + 1e-6, "{} above {}", less[3], more[3]);
        }
    }

    #[test]
    fn a_volume_and_its_camera_move_together(view in views(), turn in -3.0..3.0, far in -1e3..1e3) {
        let view = view.ordinary();
        let about = DVec3::new(0.48, 0.6, 0.64);
        let moved = DAffine3::from_rotation_translation(
            DQuat::from_axis_angle(about, turn),
            view.spacing * far * about,
        );
        let mut camera = view.camera();
        camera.camera_from_world *= moved.inverse();
        let transfer = view.transfer(view.opacity);
        let one = view.draw();
        let other = view.draw_with(&transfer, moved * view.placed(), &camera);
        let apart = worst_difference(&one, &other);
        prop_assert!(apart <= 2e-4, "they differ by {apart}");
    }

    #[test]
    fn an_axis_stored_backwards_is_the_same_picture(view in views(), axis in 0usize..3) {
        let apart = stored_backwards(&view, axis);
        prop_assert!(apart <= 2e-4, "they differ by {apart}");
    }

    #[test]
    fn a_point_brings_all_that_it_is_worth(
        opacity in log_uniform(-6.0..-0.5),
        px in log_uniform(-6.0..0.0),
        at in (-3.0..3.0, -3.0..3.0),
    ) {
        // A voxel `px` pixels wide, somewhere in the picture.
        let size = [16, 16];
        let camera = orthographic(
            DVec3::new(at.0 / px, at.1 / px, -5.0),
            DVec3::new(at.0 / px, at.1 / px, 0.0),
            16.0 / px,
            size,
        );
        let options = with_samples(RenderOptions::paper(), |samples| {
            samples.select = SelectMode::Points;
        });
        let options = RenderOptions { min_transmittance: 0.0, ..options };
        let volume = single_voxel(DVec3::ZERO);
        let mut renderer = Renderer::new(&volume, &grey(opacity), &options).expect("valid options");
        let image = renderer.render(&camera).expect("a valid camera").image;
        // Red is the opacity, with all its digits.
        let depth: f64 = image.rgba.iter().map(|p| -(-f64::from(p[0])).ln_1p()).sum();
        let truth = -(-opacity).ln_1p() * px * px;
        prop_assert!((depth / truth - 1.0).abs() < 1e-4, "{depth:e} instead of {truth:e}");
    }

    #[test]
    fn no_depth_image_gives_what_is_no_colour(
        depths in prop::collection::vec(log_uniform(-37.0..38.0), 48),
        aside in log_uniform(-30.0..30.0),
        method in 0usize..4,
        fill in 0usize..3,
    ) {
        let camera = |aside: f64| {
            resample_tests::warps::scenes::camera([8, 6], 8.0, DVec3::X * aside, 0.1 * aside.min(1.0))
        };
        let reference = Reference {
            camera: camera(0.0),
            colour: (0..48).map(|i| [i as f32 / 48.0; 3]).collect(),
            depth: depths.iter().map(|&depth| depth as f32).collect(),
        };
        let options = WarpOptions {
            fill: [Fill::None, Fill::Background, Fill::Natural][fill],
            ..WarpOptions::with_method(warp3d::Method::ALL[method])
        };
        let mut warper = Warper::new(vec![reference], &options).expect("valid options");
        let image = warper.render(&camera(aside)).expect("a valid camera").image;
        sound(&image)?;
        let nearest = image.depth.iter().flatten().fold(f32::INFINITY, |a, &b| a.min(b));
        prop_assert!(nearest > 0.0, "a depth is {nearest:e}");
    }

    #[test]
    fn no_mesh_gives_what_is_no_colour(
        corners in prop::collection::vec((-1.0..1.0, -1.0..1.0, -1.0..1.0), 4),
        sizes in prop::collection::vec(log_uniform(-15.0..15.0), 4),
        repeats in log_uniform(-15.0..9.0),
        distance in log_uniform(-15.0..15.0),
        fov in log_uniform(-4.0..2.2),
        method in 0usize..6,
    ) {
        let corner = |i: usize| {
            let (x, y, z) = corners[i];
            [x, y, z].map(|c: f64| (c * sizes[i]) as f32)
        };
        let r = repeats as f32;
        let uvs = [[0.0, r], [r, r], [r, 0.0], [0.0, 0.0]];
        let scene = quad_scene([0, 1, 2, 3].map(corner), uvs, photo(32), Wrap::Repeat);
        let pose = LookAt {
            position: distance * DVec3::new(0.3, 0.5, 0.8),
            target: DVec3::ZERO,
            up: DVec3::new(0.12, 1.0, 0.34),
        };
        let camera = Camera::perspective(&pose, fov.to_radians(), [20, 14]).expect("a camera");
        let options = texmap::RenderOptions {
            method: texmap::Method::ALL[method],
            planes: texmap::PlaneKind::ALL.to_vec(),
            ..texmap::RenderOptions::default()
        };
        let mut renderer = texmap::Renderer::new(&scene, &options).expect("valid options");
        let image = renderer.render(&camera).expect("a valid camera").image;
        sound(&image)?;
        for plane in &image.planes {
            prop_assert!(plane.values.iter().all(|v| !v.is_nan()), "{} is no number", plane.name);
        }
    }
}

/// A texel's ellipse that rounding made a hyperbola: its weights grew without bound, and their mean was no number.
#[test]
fn a_texture_repeated_two_million_times_gives_colours_as_points() {
    let corners = [
        [0.000_247_374_64, -6.880_875e-5, 0.000_132_841_65],
        [-52.3199, 26.393_248, 44.784_203],
        [-0.013_507_836_5, 0.280_951_1, -0.349_647_07],
        [-291_734.78, -698_038.44, 341_458.28],
    ];
    let r = 2.046_741_5e6;
    let uvs = [[0.0, r], [r, r], [r, 0.0], [0.0, 0.0]];
    let scene = quad_scene(corners, uvs, photo(32), Wrap::Repeat);
    let pose = LookAt {
        position: 6.206_794_915_609_216e-13 * DVec3::new(0.3, 0.5, 0.8),
        target: DVec3::ZERO,
        up: DVec3::new(0.12, 1.0, 0.34),
    };
    let fov_rad = 19.924_244_769_613_953_f64.to_radians();
    let camera = Camera::perspective(&pose, fov_rad, [20, 14]).expect("a camera");
    let options = texmap::RenderOptions {
        method: texmap::Method::Point,
        ..texmap::RenderOptions::default()
    };
    let mut renderer = texmap::Renderer::new(&scene, &options).expect("valid options");
    let image = renderer.render(&camera).expect("a valid camera").image;
    assert!(sound(&image).is_ok());
}

proptest! {
    #![proptest_config(cases(10))]

    #[test]
    fn no_mesh_in_its_own_shadow_gives_what_is_no_colour(
        corners in prop::collection::vec((-1.0..1.0, -1.0..1.0, -1.0..1.0), 4),
        sizes in prop::collection::vec(log_uniform(-15.0..15.0), 4),
        distance in log_uniform(-15.0..15.0),
        on_ground in any::<bool>(),
    ) {
        let corner = |i: usize| {
            let (x, y, z) = corners[i];
            [x, y, z].map(|c: f64| (c * sizes[i]) as f32)
        };
        let uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
        let mut scene = quad_scene([0, 1, 2, 3].map(corner), uvs, photo(32), Wrap::Repeat);
        scene.materials[0].lighting = texmap::scene::Lighting::Lit;
        let pose = LookAt {
            position: distance * DVec3::new(0.3, 0.5, 0.8),
            target: DVec3::ZERO,
            up: DVec3::new(0.12, 1.0, 0.34),
        };
        let camera = Camera::perspective(&pose, 0.7, [20, 14]).expect("a camera");
        let options = texmap::RenderOptions {
            shadows: if on_ground { texmap::Shadows::Ground } else { texmap::Shadows::Mesh },
            ..texmap::RenderOptions::default()
        };
        let mut renderer = texmap::Renderer::new(&scene, &options).expect("valid options");
        sound(&renderer.render(&camera).expect("a valid camera").image)?;
    }
}

proptest! {
    #![proptest_config(cases(24))]

    #[test]
    fn any_number_of_threads_gives_the_same_bytes(view in views(), threads in 2usize..5) {
        let [one, many] = [1, threads].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(|| view.draw())
        });
        prop_assert_eq!(one.rgba, many.rgba);
    }
}
