//! Real pairs as they are given: Middlebury's two generations, Beachball, livingroom, and the synthetic scenes.

use glam::{DAffine3, DVec3};
use resample_core::Camera;
use resample_core::camera::PixelCentre;
use resample_tests::data::data_file;
use resample_tests::warps::pairs::straight;
use warp3d::input::cameras::{self, Hints, Lens};
use warp3d::input::{DepthKind, DepthMeaning};

use super::{
    assert_only_right_is_near, camera, named_picture, picture, reference, unmoved_psnr, warped_psnr,
};

#[test]
fn piano_by_its_calibration_and_disparity() {
    let test = "piano_by_its_calibration_and_disparity";
    let Some(calib) = data_file(test, "rgbd/middlebury-2014/Piano/calib.txt") else {
        return;
    };
    let folder = calib.parent().expect("a folder");
    let file = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let set = cameras::read(&calib, &Hints::default())
        .expect("good")
        .expect("known");
    let pair = set.pair.expect("a pair");
    let [left, right] = ["0", "1"].map(|name| set.entry(name).expect("an eye").camera);
    let meaning = DepthMeaning {
        baseline: Some(pair.baseline),
        doffs: pair.doffs,
        ..DepthMeaning::of(DepthKind::Disparity)
    };
    let truth = picture(&folder.join("im1.png"));
    let view = reference(&file("im0.png"), &file("disp0GT.pfm"), left, &meaning);
    let unmoved = unmoved_psnr(&view, &truth);
    let (good, seen) = warped_psnr(&view, &right, &truth);
    assert!(seen > 0.5, "most of the second view is seen, not {seen}");
    // Without doffs every depth is too large, and the principal points' shift is not made good.
    let view = reference(
        &file("im0.png"),
        &file("disp0GT.pfm"),
        left,
        &DepthMeaning {
            doffs: 0.0,
            ..meaning
        },
    );
    let (wrong, _) = warped_psnr(&view, &right, &truth);
    assert_only_right_is_near("Piano", unmoved, good, wrong);
}

#[test]
fn cones_by_grey_codes_of_disparity() {
    let test = "cones_by_grey_codes_of_disparity";
    let Some(left) = data_file(test, "rgbd/middlebury-2003/Cones/imL.png") else {
        return;
    };
    let folder = left.parent().expect("a folder");
    let file = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let truth = picture(&folder.join("imR.png"));
    let size = [truth.width as u32, truth.height as u32];
    let camera = |x: f64| straight(size, 900.0, DVec3::new(x, 0.0, 0.0));
    let quarter = DepthMeaning {
        scale: Some(0.25),
        baseline: Some(0.1),
        ..DepthMeaning::of(DepthKind::Disparity)
    };
    let view = reference(&file("imL.png"), &file("disp2.png"), camera(0.0), &quarter);
    let (good, _) = warped_psnr(&view, &camera(0.1), &truth);
    // The right eye on the wrong side.
    let (wrong, _) = warped_psnr(&view, &camera(-0.1), &truth);
    assert_only_right_is_near("Cones", unmoved_psnr(&view, &truth), good, wrong);
}

#[test]
fn beachball_by_its_layers_on_the_display_window() {
    let test = "beachball_by_its_layers_on_the_display_window";
    let Some(path) = data_file(test, "rgbd/openexr/Beachball/singlepart.0001.exr") else {
        return;
    };
    let path = path.to_string_lossy();
    let truth = named_picture(&format!("{path}#left"));
    assert_eq!(
        (truth.width, truth.height),
        (2048, 1556),
        "the display window"
    );
    let camera = |x: f64| straight([2048, 1556], 2000.0, DVec3::new(x, 0.0, 0.0));
    let view = reference(
        &path,
        &format!("{path}#Z"),
        camera(0.0),
        &DepthMeaning::of(DepthKind::Z),
    );
    // f * B = 333.32 px units; the left eye stands at negative x.
    let baseline = 333.32 / 2000.0;
    let (good, seen) = warped_psnr(&view, &camera(-baseline), &truth);
    let (wrong, _) = warped_psnr(&view, &camera(baseline), &truth);
    assert!(
        seen > 0.05 && seen < 0.3,
        "the ball alone is seen, not {seen}"
    );
    assert_only_right_is_near("Beachball", unmoved_psnr(&view, &truth), good, wrong);
}

#[test]
fn livingroom_by_its_trajectory_and_millimetres() {
    let test = "livingroom_by_its_trajectory_and_millimetres";
    let Some(log) = data_file(test, "rgbd/livingroom1/test_scene/trajectory.log") else {
        return;
    };
    let folder = log
        .parent()
        .and_then(|folder| folder.parent())
        .expect("a folder");
    let lens = Lens {
        fx: 525.0,
        fy: 525.0,
        cx: 319.5,
        cy: 239.5,
        pixel_centre: PixelCentre::Integer,
    };
    let hints = Hints {
        size: Some([640, 480]),
        lens: Some(lens),
    };
    let millimetres = DepthMeaning {
        scale: Some(1e-3),
        ..DepthMeaning::of(DepthKind::Z)
    };
    let file = |kind: &str, name: &str| folder.join(kind).join(name).to_string_lossy().into_owned();
    for target in ["20", "60"] {
        let [from, to] = ["0", target].map(|entry| camera(&log, entry, &hints));
        let truth = named_picture(&file("image", &format!("{target:0>5}.jpg")));
        let view = reference(
            &file("image", "00000.jpg"),
            &file("depth", "00000.png"),
            from,
            &millimetres,
        );
        let unmoved = unmoved_psnr(&view, &truth);
        let (good, _) = warped_psnr(&view, &to, &truth);
        let turned = Camera {
            camera_from_world: to.camera_from_world.inverse(),
            ..to
        };
        let (wrong, _) = warped_psnr(&view, &turned, &truth);
        assert_only_right_is_near(&format!("livingroom 0 to {target}"), unmoved, good, wrong);
        // Distances along rays taken for camera z, and the other way around, are a wrong shape.
        let as_ray = DepthMeaning {
            kind: DepthKind::Ray,
            ..millimetres
        };
        let view = reference(
            &file("image", "00000.jpg"),
            &file("depth", "00000.png"),
            from,
            &as_ray,
        );
        let (bent, _) = warped_psnr(&view, &to, &truth);
        assert!(
            bent < good - 1.0,
            "z taken for ray lengths gives {bent:.2} dB, z {good:.2}"
        );
    }
}

#[test]
fn synthetic_scenes_have_whole_pixel_centres() {
    let test = "synthetic_scenes_have_whole_pixel_centres";
    for scene in ["stereo", "sphere", "minify4", "magnify4"] {
        let Some(file) = data_file(test, &format!("warp-truth/{scene}/cameras.json")) else {
            return;
        };
        let folder = file.parent().expect("a folder");
        let [from, to] = ["ref", "targets/0"].map(|entry| camera(&file, entry, &Hints::default()));
        let colour = folder.join("ref.exr").to_string_lossy().into_owned();
        let truth = picture(&folder.join("target.exr"));
        let view = reference(
            &colour,
            &format!("{colour}#Z"),
            from,
            &DepthMeaning::of(DepthKind::Z),
        );
        let (good, _) = warped_psnr(&view, &to, &truth);
        // The other pixel centre moves a picture only where the scale changes, by half a pixel times that change.
        let half = |camera: Camera| Camera {
            cx: camera.cx - 0.5,
            cy: camera.cy - 0.5,
            ..camera
        };
        let shifted = warp3d::Reference {
            camera: half(from),
            ..view.clone()
        };
        let (wrong, _) = warped_psnr(&shifted, &half(to), &truth);
        println!("{scene}: {good:.2} dB, with the other pixel centre {wrong:.2}");
        assert!(
            good > 17.0,
            "{scene}: {good:.2} dB is no warp to the right place"
        );
        if scene == "magnify4" {
            assert!(
                wrong < good - 1.0,
                "{scene}: the pixel centre must matter, {wrong:.2} against {good:.2}"
            );
        }
        let turned = Camera {
            camera_from_world: DAffine3::from_translation(DVec3::X) * to.camera_from_world,
            ..to
        };
        let (elsewhere, _) = warped_psnr(&view, &turned, &truth);
        assert!(
            elsewhere < good - 3.0,
            "{scene}: a wrong pose gives {elsewhere:.2} dB, the right one {good:.2}"
        );
    }
}
