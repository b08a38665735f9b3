//! One real pair (livingroom1, frames 0 and 20) with its poses in every camera format.
//!
//! The poses come from the data's own log, read here by hand; each writer follows the rules of its format. A writer
//! that breaks one rule must give a warp to the wrong place.

use std::path::Path;

use glam::{DMat3, DMat4, DQuat, DVec3};
use resample_core::camera::PixelCentre;
use resample_tests::data::data_file;
use serde_json::json;
use tempfile::TempDir;
use warp3d::input::cameras::{Hints, Lens};
use warp3d::input::{DepthKind, DepthMeaning};

use super::{
    assert_only_right_is_near, camera, named_picture, reference, unmoved_psnr, warped_psnr,
};

/// The poses, camera to world, of frames 0 and 20.
type Poses = [DMat4; 2];

/// Writes the poses into a folder and gives the file; `broken` breaks one rule of the format.
type Writer = fn(&Path, &Poses, Rule) -> std::path::PathBuf;

#[derive(Clone, Copy, PartialEq)]
enum Rule {
    Kept,
    Broken,
}

const FOCAL_PX: f64 = 525.0;

/// The middle of 640 x 480 pixels with centres at one half; the data says 319.5, 239.5 with centres at whole numbers.
const CENTRE_PX: [f64; 2] = [320.0, 240.0];

#[test]
fn every_format_warps_a_real_pair_to_the_right_place() {
    let test = "every_format_warps_a_real_pair_to_the_right_place";
    let Some(log) = data_file(test, "rgbd/livingroom1/test_scene/trajectory.log") else {
        return;
    };
    let poses = [pose(&log, 0), pose(&log, 20)];
    let data = log
        .parent()
        .and_then(|folder| folder.parent())
        .expect("a folder");
    let file = |kind: &str, name: &str| data.join(kind).join(name).to_string_lossy().into_owned();
    let truth = named_picture(&file("image", "00020.jpg"));
    let millimetres = DepthMeaning {
        scale: Some(1e-3),
        ..DepthMeaning::of(DepthKind::Z)
    };
    let lens = Lens {
        fx: FOCAL_PX,
        fy: FOCAL_PX,
        cx: CENTRE_PX[0],
        cy: CENTRE_PX[1],
        pixel_centre: PixelCentre::Half,
    };
    let hints = Hints {
        size: Some([640, 480]),
        lens: Some(lens),
    };
    let formats: [(&str, Writer); 5] = [
        ("TUM", tum),
        ("COLMAP", colmap),
        ("transforms.json", transforms),
        ("MPEG", mpeg),
        ("nested", nested),
    ];
    for (name, write) in formats {
        let view = |rule: Rule| {
            let folder = TempDir::new().expect("a temporary folder");
            let path = write(folder.path(), &poses, rule);
            let [from, to] = ["0", "20"].map(|entry| camera(&path, entry, &hints));
            let view = reference(
                &file("image", "00000.jpg"),
                &file("depth", "00000.png"),
                from,
                &millimetres,
            );
            let (near, _) = warped_psnr(&view, &to, &truth);
            (near, unmoved_psnr(&view, &truth))
        };
        let ((right, unmoved), (wrong, _)) = (view(Rule::Kept), view(Rule::Broken));
        assert_only_right_is_near(name, unmoved, right, wrong);
    }
}

/// The pose of one frame: five lines a frame, the first of them the frame's number.
fn pose(log: &Path, frame: usize) -> DMat4 {
    let text = std::fs::read_to_string(log).expect("readable");
    let lines: Vec<&str> = text.lines().collect();
    let start = lines
        .iter()
        .step_by(5)
        .position(|line| line.starts_with(&format!("{frame} ")))
        .expect("the frame")
        * 5;
    let numbers: Vec<f64> = lines[start + 1..start + 5]
        .iter()
        .flat_map(|l| l.split_whitespace())
        .map(|w| w.parse().expect("a number"))
        .collect();
    DMat4::from_cols_slice(&numbers).transpose()
}

fn turn(pose: &DMat4) -> DQuat {
    DQuat::from_mat3(&DMat3::from_mat4(*pose)).normalize()
}

fn written(folder: &Path, name: &str, text: &str) -> std::path::PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a file in a temporary folder");
    path
}

/// Camera to world, x y z w. Broken: world to camera.
fn tum(folder: &Path, poses: &Poses, rule: Rule) -> std::path::PathBuf {
    let line = |(name, pose): (&str, &DMat4)| {
        let pose = if rule == Rule::Kept {
            *pose
        } else {
            pose.inverse()
        };
        let (t, q) = (pose.w_axis, turn(&pose));
        format!(
            "{name} {} {} {} {} {} {} {}\n",
            t.x, t.y, t.z, q.x, q.y, q.z, q.w
        )
    };
    written(
        folder,
        "poses.txt",
        &["0", "20"]
            .into_iter()
            .zip(poses)
            .map(line)
            .collect::<String>(),
    )
}

/// World to camera, w x y z. Broken: camera to world.
fn colmap(folder: &Path, poses: &Poses, rule: Rule) -> std::path::PathBuf {
    let [cx, cy] = CENTRE_PX;
    written(
        folder,
        "cameras.txt",
        &format!("1 SIMPLE_PINHOLE 640 480 {FOCAL_PX} {cx} {cy}\n"),
    );
    let line = |(name, pose): (&str, &DMat4)| {
        let pose = if rule == Rule::Kept {
            pose.inverse()
        } else {
            *pose
        };
        let (t, q) = (pose.w_axis, turn(&pose));
        format!(
            "1 {} {} {} {} {} {} {} 1 {name}\n\n",
            q.w, q.x, q.y, q.z, t.x, t.y, t.z
        )
    };
    written(
        folder,
        "images.txt",
        &["0", "20"]
            .into_iter()
            .zip(poses)
            .map(line)
            .collect::<String>(),
    )
}

/// Camera to world with y up and z backward. Broken: y down and z forward.
fn transforms(folder: &Path, poses: &Poses, rule: Rule) -> std::path::PathBuf {
    let flip = if rule == Rule::Kept { -1.0 } else { 1.0 };
    let frame = |(name, pose): (&str, &DMat4)| {
        let axes = DMat4::from_cols(
            pose.x_axis,
            flip * pose.y_axis,
            flip * pose.z_axis,
            pose.w_axis,
        );
        let rows: Vec<[f64; 4]> = (0..4).map(|i| axes.row(i).to_array()).collect();
        json!({ "file_path": format!("images/{name}"), "transform_matrix": rows })
    };
    let frames: Vec<_> = ["0", "20"].into_iter().zip(poses).map(frame).collect();
    let [cx, cy] = CENTRE_PX;
    let text =
        json!({ "fl_x": FOCAL_PX, "cx": cx, "cy": cy, "w": 640, "h": 480, "frames": frames });
    written(folder, "transforms.json", &text.to_string())
}

/// OMAF axes, x forward, y left, z up, for the camera and for the world; yaw, pitch and roll in degrees. Broken: pitch
/// turned the other way.
fn mpeg(folder: &Path, poses: &Poses, rule: Rule) -> std::path::PathBuf {
    // OMAF's x is our z, its y our -x, its z our -y.
    let omaf_from_ours = DMat3::from_cols(DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X);
    let camera = |(name, pose): (&str, &DMat4)| {
        let m = omaf_from_ours * DMat3::from_mat4(*pose) * omaf_from_ours.transpose();
        // Of Rz(yaw) Ry(pitch) Rx(roll): first column (cos y cos p, sin y cos p, -sin p), last row (.., cos p sin r, cos p cos r).
        let yaw = m.x_axis.y.atan2(m.x_axis.x).to_degrees();
        let pitch = (-m.x_axis.z).asin().to_degrees() * if rule == Rule::Kept { 1.0 } else { -1.0 };
        let roll = m.y_axis.z.atan2(m.z_axis.z).to_degrees();
        let position = omaf_from_ours * pose.w_axis.truncate();
        json!({
            "Name": name, "Projection": "Perspective", "Position": position.to_array(),
            "Rotation": [yaw, pitch, roll], "Resolution": [640, 480], "Focal": [FOCAL_PX, FOCAL_PX],
            "Principle_point": CENTRE_PX
        })
    };
    let cameras: Vec<_> = ["0", "20"].into_iter().zip(poses).map(camera).collect();
    written(
        folder,
        "cameras.json",
        &json!({ "Version": "2.0", "cameras": cameras }).to_string(),
    )
}

/// World to camera, rows of R, whole pixel centres. Broken: columns of R.
fn nested(folder: &Path, poses: &Poses, rule: Rule) -> std::path::PathBuf {
    let [cx, cy] = CENTRE_PX.map(|c| c - 0.5);
    let camera = |pose: &DMat4| {
        let inverse = pose.inverse();
        let m = DMat3::from_mat4(inverse);
        let by_rows = if rule == Rule::Kept { m.transpose() } else { m };
        json!({
            "W": 640, "H": 480, "fx": FOCAL_PX, "fy": FOCAL_PX, "cx": cx, "cy": cy,
            "R": by_rows.to_cols_array(), "t": inverse.w_axis.truncate().to_array()
        })
    };
    let text = json!({ "0": camera(&poses[0]), "20": camera(&poses[1]) });
    written(folder, "views.json", &text.to_string())
}
