//! What properties of any numbers have found, each once.

use super::*;

/// A sample that adds 1e41 to the optical depth of the screen.
#[test]
fn opacity_over_a_length_far_below_a_voxel_is_a_wall() {
    for choice in 0..choices().len() {
        let view = View {
            spacing: 1.0,
            stretch: [1.0; 2],
            direction: DVec3::Z,
            distance: 18_576_667_527_745.938,
            fov_deg: 1.0,
            parallel: false,
            opacity: 1.0,
            unit: 7.6e-29,
            scalars: 1.0,
            choice,
        };
        sound(&view.draw()).expect("colours");
        let near = View {
            distance: 9.0,
            fov_deg: 10.0,
            ..view
        };
        let (image, view_options) = (near.draw(), near.options());
        sound(&image).expect("colours");
        // A mean over the ray is classified once, over one unit; magnified points have holes.
        let options = view_options.samples();
        let has_holes =
            choice == 1 || options.is_some_and(|samples| samples.select == SelectMode::Points);
        assert!(
            has_holes || image.pixel(10, 7)[3] > 0.99,
            "choice {choice} lets light through"
        );
    }
}

/// Surfaces of 1e-31 to 1 seen edge-on are met 1e30 samples outside the picture.
#[test]
fn places_far_outside_a_picture_have_a_colour() {
    let camera =
        |aside: f64| resample_tests::warps::scenes::camera([8, 6], 8.0, DVec3::X * aside, 0.0);
    for first in 0..45 {
        let mut depth = vec![1.0; 48];
        depth[first..first + 3].copy_from_slice(&[1.4e-18, 2.75e-28, 6.6e-31]);
        let reference = Reference {
            camera: camera(0.0),
            colour: vec![[0.5; 3]; 48],
            depth,
        };
        let mut warper =
            Warper::new(vec![reference], &WarpOptions::default()).expect("valid options");
        let image = warper
            .render(&camera(1.4e-8))
            .expect("a valid camera")
            .image;
        sound(&image).expect("colours");
    }
}

/// Depths of 1e-28 to 1e27 side by side: the disc of the first covers 1e55 pixels.
#[test]
fn a_disc_that_is_stretched_beyond_all_numbers_weighs_nothing() {
    let camera =
        |aside: f64| resample_tests::warps::scenes::camera([8, 6], 8.0, DVec3::X * aside, 0.0);
    let mut depth = vec![1.0; 48];
    depth[36..40].copy_from_slice(&[1.4e-28, 0.135, 1.127e19, 2.94e27]);
    let reference = Reference {
        camera: camera(0.0),
        colour: vec![[0.5; 3]; 48],
        depth,
    };
    for method in warp3d::Method::ALL {
        let options = WarpOptions::with_method(method);
        let mut warper = Warper::new(vec![reference.clone()], &options).expect("valid options");
        let image = warper
            .render(&camera(7.6e10))
            .expect("a valid camera")
            .image;
        sound(&image).expect("colours");
    }
}

/// Gradients of 4e-37 per world unit, of which f32 holds few digits.
#[test]
fn light_on_gradients_below_normal_numbers_is_the_same() {
    for choice in 0..choices().len() {
        let near = View {
            spacing: 14_551_329_148.538_727,
            stretch: [1.0; 2],
            direction: DVec3::Z,
            distance: 1.0,
            fov_deg: 1.0,
            parallel: false,
            opacity: 1.0,
            unit: 1.0,
            scalars: 4.079_591_736_550_679_6e-16,
            choice,
        };
        let far = View {
            spacing: near.spacing * 2f64.powi(44),
            ..near.clone()
        };
        let apart = worst_difference(&near.draw(), &far.draw());
        assert!(apart == 0.0, "choice {choice}: they differ by {apart}");
    }
}
