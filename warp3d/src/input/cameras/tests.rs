//! One camera, written in every format by its own rules, must come back as the same camera.
//!
//! The pose is worked out here per format from the eye and three directions, not with the code under test.

use glam::{DMat3, DQuat, DVec2, DVec3};
use resample_core::Camera;
use resample_core::camera::PixelCentre;
use tempfile::TempDir;

use crate::input::cameras::*;

/// The eye and where right, down and forward point: a camera that is turned in all three ways.
struct Pose {
    eye: DVec3,
    right: DVec3,
    down: DVec3,
    forward: DVec3,
}

const LENS: [f64; 4] = [520.0, 530.0, 300.25, 210.75];

fn pose() -> Pose {
    let turn =
        DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(-0.7) * DMat3::from_rotation_y(0.4);
    Pose {
        eye: DVec3::new(1.5, -2.0, 0.75),
        right: turn.x_axis,
        down: turn.y_axis,
        forward: turn.z_axis,
    }
}

/// Where a world point must be seen, px, with pixel centres at one half.
fn seen(point: DVec3) -> DVec2 {
    let Pose {
        eye,
        right,
        down,
        forward,
    } = pose();
    let offset = point - eye;
    let z = offset.dot(forward);
    DVec2::new(
        LENS[0] * offset.dot(right) / z + LENS[2],
        LENS[1] * offset.dot(down) / z + LENS[3],
    )
}

fn read_as(name: &str, text: &str, hints: &Hints) -> CameraSet {
    let folder = tempfile::tempdir().expect("a temporary folder");
    read(&write(&folder, name, text), hints)
        .expect("a good file")
        .expect("a known format")
}

fn write(folder: &TempDir, name: &str, text: &str) -> std::path::PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("a file in a temporary folder");
    path
}

#[track_caller]
fn assert_sees_right(camera: &Camera) {
    assert_eq!([camera.width, camera.height], [600, 420], "size");
    let Pose {
        eye,
        right,
        down,
        forward,
    } = pose();
    for (x, y) in [(0.0, 0.0), (0.4, 0.1), (-0.3, 0.2), (0.1, -0.4)] {
        let point = eye + 3.0 * forward + x * right + y * down;
        let found = camera.screen_from_camera(camera.camera_from_world.transform_point3(point));
        let expected = seen(point);
        assert!(
            (found - expected).length() < 1e-4,
            "{point} is seen at {found} instead of {expected}"
        );
    }
}

fn hints(centre: PixelCentre) -> Hints {
    let shift = if centre == PixelCentre::Integer {
        0.5
    } else {
        0.0
    };
    let [fx, fy, cx, cy] = LENS;
    let lens = Lens {
        fx,
        fy,
        cx: cx - shift,
        cy: cy - shift,
        pixel_centre: centre,
    };
    Hints {
        size: Some([600, 420]),
        lens: Some(lens),
    }
}

/// Quaternion x, y, z, w of the rotation whose columns are right, down and forward.
fn world_from_camera() -> DQuat {
    let Pose {
        right,
        down,
        forward,
        ..
    } = pose();
    DQuat::from_mat3(&DMat3::from_cols(right, down, forward))
}

#[test]
fn an_open3d_log_is_camera_to_world() {
    let Pose {
        eye: e,
        right: r,
        down: d,
        forward: f,
    } = pose();
    let rows = [
        [r.x, d.x, f.x, e.x],
        [r.y, d.y, f.y, e.y],
        [r.z, d.z, f.z, e.z],
        [0.0, 0.0, 0.0, 1.0],
    ];
    let rows = rows
        .map(|row| row.map(|x| format!("{x:.8}")).join(" "))
        .join("\n");
    let text = format!("4 4 5\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n7 7 8\n{rows}\n");
    let set = read_as("trajectory.log", &text, &hints(PixelCentre::Integer));
    assert_sees_right(&set.entry("7").expect("by number").camera);
    assert_sees_right(&set.entry("1").expect("by index").camera);
    assert_eq!(set.names(), "4, 7", "names");
}

#[test]
fn a_tum_line_is_position_and_quaternion_camera_to_world() {
    let (e, q) = (pose().eye, world_from_camera());
    let text = format!(
        "# timestamp tx ty tz qx qy qz qw\n1305.5 {} {} {} {} {} {} {}\n",
        e.x, e.y, e.z, q.x, q.y, q.z, q.w
    );
    let set = read_as("groundtruth.txt", &text, &hints(PixelCentre::Half));
    assert_sees_right(&set.entry("1305.5").expect("by time").camera);
}

#[test]
fn colmap_is_world_to_camera_with_its_lens_beside_it() {
    let q = world_from_camera().conjugate();
    let t = q * -pose().eye;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [fx, fy, cx, cy] = LENS;
    write(
        &folder,
        "cameras.txt",
        &format!("# lenses\n3 PINHOLE 600 420 {fx} {fy} {cx} {cy}\n"),
    );
    let image = |id: u32, name: &str| {
        format!(
            "{id} {} {} {} {} {} {} {} 3 {name}\n",
            q.w, q.x, q.y, q.z, t.x, t.y, t.z
        )
    };
    let text = format!(
        "# images\n{}\n{}1.5 2.5 -1\n",
        image(1, "a/first one.png"),
        image(2, "b.png")
    );
    let path = write(&folder, "images.txt", &text);
    let set = read(&path, &Hints::default())
        .expect("a good model")
        .expect("a known format");
    assert_eq!(
        set.names(),
        "a/first one.png, b.png",
        "empty lines of points count"
    );
    assert_sees_right(&set.entry("b.png").expect("by name").camera);
    assert_sees_right(
        &set.entry("first one.png")
            .expect("by the file's own name")
            .camera,
    );
}

#[test]
fn transforms_have_opengl_axes() {
    let Pose {
        eye: e,
        right: r,
        down,
        forward,
    } = pose();
    let (u, b) = (-down, -forward);
    let rows = [
        [r.x, u.x, b.x, e.x],
        [r.y, u.y, b.y, e.y],
        [r.z, u.z, b.z, e.z],
        [0.0, 0.0, 0.0, 1.0],
    ];
    let [fx, fy, cx, cy] = LENS;
    let text = serde_json::json!({
        "fl_x": fx, "fl_y": fy, "cx": cx, "cy": cy, "w": 600, "h": 420, "k1": 0.0,
        "frames": [{ "file_path": "./train/r_0.png", "transform_matrix": rows }]
    });
    let set = read_as("transforms.json", &text.to_string(), &Hints::default());
    assert_sees_right(&set.entry("r_0.png").expect("by file name").camera);
}

#[test]
fn transforms_may_give_the_angle_of_view() {
    let identity = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
    let text = serde_json::json!({
        "camera_angle_x": std::f64::consts::FRAC_PI_2, "frames": [{ "transform_matrix": identity }]
    });
    let size = Hints {
        size: Some([200, 100]),
        lens: None,
    };
    let camera = read_as("transforms.json", &text.to_string(), &size).entries[0].camera;
    assert!(
        (camera.fx - 100.0).abs() < 1e-9 && camera.fx == camera.fy,
        "a right angle sees its width"
    );
    assert_eq!([camera.cx, camera.cy], [100.0, 50.0], "the centre");
    assert!(
        (camera.forward_in_world() - DVec3::NEG_Z).length() < 1e-12,
        "OpenGL looks along -z"
    );
}

#[test]
fn mpeg_has_omaf_axes_and_turns_by_yaw_pitch_roll() {
    // Yaw 90 degrees looks along +y; pitch 90 looks along -z; roll 90 about x turns left (y) to up (z).
    let camera = |rotation: [f64; 3]| {
        let text = serde_json::json!({ "Version": "2.0", "cameras": [{
            "Name": "v0", "Projection": "Perspective", "Position": [1.0, 2.0, 3.0], "Rotation": rotation,
            "Resolution": [600, 420], "Focal": [500.0, 500.0], "Principle_point": [300.0, 210.0]
        }]});
        read_as("a.json", &text.to_string(), &Hints::default())
            .entry("v0")
            .expect("by name")
            .camera
    };
    let axes = |rotation: [f64; 3]| {
        let m = camera(rotation).camera_from_world.matrix3;
        [m.row(0), m.row(1), m.row(2)]
    };
    let near = |found: [DVec3; 3], expected: [DVec3; 3]| {
        let worst = found
            .iter()
            .zip(expected)
            .map(|(a, b)| (*a - b).length())
            .fold(0.0, f64::max);
        assert!(
            worst < 1e-12,
            "right, down, forward are {found:?} instead of {expected:?}"
        );
    };
    near(axes([0.0; 3]), [DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X]);
    near(axes([90.0, 0.0, 0.0]), [DVec3::X, DVec3::NEG_Z, DVec3::Y]);
    near(
        axes([0.0, 90.0, 0.0]),
        [DVec3::NEG_Y, DVec3::NEG_X, DVec3::NEG_Z],
    );
    near(axes([0.0, 0.0, 90.0]), [DVec3::NEG_Z, DVec3::Y, DVec3::X]);
    // Yaw is applied last: pitched down and turned left, up is still above the left side.
    near(
        axes([90.0, 90.0, 0.0]),
        [DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z],
    );
    assert!(
        (camera([10.0, 20.0, 30.0]).eye_in_world() - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12,
        "eye"
    );
}

#[test]
fn nested_cameras_are_named_by_their_keys_and_have_whole_pixel_centres() {
    let Pose {
        eye,
        right: r,
        down: d,
        forward: f,
    } = pose();
    let rotation = [r.x, r.y, r.z, d.x, d.y, d.z, f.x, f.y, f.z];
    let t = [-eye.dot(r), -eye.dot(d), -eye.dot(f)];
    let [fx, fy, cx, cy] = LENS;
    let camera = serde_json::json!({
        "W": 600, "H": 420, "fx": fx, "fy": fy, "cx": cx - 0.5, "cy": cy - 0.5, "R": rotation, "t": t
    });
    let text = serde_json::json!({ "name": "scene", "ref": camera, "targets": [camera] });
    let set = read_as("cameras.json", &text.to_string(), &Hints::default());
    assert_sees_right(&set.entry("ref").expect("by key").camera);
    assert_sees_right(&set.entry("targets/0").expect("by path").camera);
    let said = set.entry("targets/1").expect_err("absent");
    assert!(said.contains("targets/0"), "what there is: {said}");
}

#[test]
fn a_calibration_has_two_eyes_and_what_is_between() {
    let text = "cam0=[ 700 0 350.5 ; 0 700 240 ; 0 0 1 ] \ncam1=[ 700 0 380.5 ; 0 700 240 ; 0 0 1 ]\n doffs= 30\n \
                baseline= 180\nwidth= 707\n height= 481\nndisp= 65";
    let set = read_as("calib.txt", text, &Hints::default());
    assert_eq!(
        set.pair,
        Some(Pair {
            baseline: 180.0,
            doffs: 30.0
        }),
        "pair"
    );
    // A point of disparity d is at z = f B / (d + doffs), and d px further left in the right picture.
    let (z, x) = (700.0 * 180.0 / (45.0 + 30.0), 100.0);
    let point = DVec3::new((x - 350.5) * z / 700.0, 0.0, z);
    let seen = |name: &str| {
        let camera = set.entry(name).expect("an eye").camera;
        camera
            .screen_from_camera(camera.camera_from_world.transform_point3(point))
            .x
            - 0.5
    };
    for (name, expected) in [("0", x), ("1", x - 45.0), ("0.5", x - 22.5)] {
        assert!(
            (seen(name) - expected).abs() < 1e-9,
            "eye {name} sees it at {}",
            seen(name)
        );
    }
}

#[test]
fn what_is_missing_or_wrong_is_said() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let said = |name: &str, text: &str, hints: &Hints| {
        let path = write(&folder, name, text);
        let said = read(&path, hints).expect_err("must be refused").to_string();
        assert!(
            said.starts_with(&path.display().to_string()),
            "the file is named: {said}"
        );
        said
    };
    let log = "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    let lens = hints(PixelCentre::Half);
    assert!(
        said("a", log, &Hints::default()).contains("intrinsics"),
        "poses need a lens"
    );
    assert!(
        said("b", &log.replace("0 1 0 0", "0 2 0 0"), &lens).contains("rotation"),
        "a scale is no pose"
    );
    assert!(
        said("c", &log.replace("\n0 0 0 1", ""), &lens).contains("line 1"),
        "a row is missing"
    );
    assert!(
        said("d", "{ \"frames\": [ ", &lens).contains("JSON"),
        "cut off"
    );
    assert!(said("e", "", &lens).contains("empty"), "empty");
    assert!(
        said("f", "hello\n", &lens).contains("expected"),
        "no cameras at all"
    );
    assert!(
        said("g", "0 0 0 0 0 0 0 0\n", &lens).contains("quaternion"),
        "no rotation"
    );
    let own = write(
        &folder,
        "own.json",
        "{\"position\": [0,0,1], \"target\": [0,0,0], \"up\": [0,1,0]}",
    );
    assert_eq!(
        read(&own, &lens).expect("JSON"),
        None,
        "the workspace's own JSON is read elsewhere"
    );
}

/// The pose as rows of a 4 x 4 matrix, camera-to-world.
fn matrix() -> [[f64; 4]; 4] {
    let Pose {
        eye: e,
        right: r,
        down: d,
        forward: f,
    } = pose();
    [
        [r.x, d.x, f.x, e.x],
        [r.y, d.y, f.y, e.y],
        [r.z, d.z, f.z, e.z],
        [0.0, 0.0, 0.0, 1.0],
    ]
}

fn in_lines(rows: &[[f64; 4]]) -> String {
    let lines: Vec<String> = rows.iter().map(|row| in_line(row)).collect();
    lines.join("\n")
}

fn in_line(numbers: &[f64]) -> String {
    let words: Vec<String> = numbers.iter().map(|x| format!("{x:.9e}")).collect();
    words.join(" ")
}

/// World to camera, as COLMAP has it: a quaternion, w first, and a translation.
fn colmap_pose() -> [f64; 7] {
    let q = world_from_camera().conjugate();
    let t = q * -pose().eye;
    [q.w, q.x, q.y, q.z, t.x, t.y, t.z]
}

/// A binary model of two pictures with a lens of COLMAP's OPENCV model.
fn binary_model(coefficients: [f64; 4]) -> [Vec<u8>; 2] {
    let numbers =
        |values: &[f64]| -> Vec<u8> { values.iter().flat_map(|x| x.to_le_bytes()).collect() };
    let mut cameras = 1u64.to_le_bytes().to_vec();
    cameras.extend([3i32, 4].iter().flat_map(|x| x.to_le_bytes()));
    cameras.extend([600u64, 420].iter().flat_map(|x| x.to_le_bytes()));
    cameras.extend(numbers(&[LENS, coefficients].concat()));
    let mut images = 2u64.to_le_bytes().to_vec();
    for (number, name, points) in [(8i32, "a/first.png\0", 2u64), (9, "b.png\0", 0)] {
        images.extend(number.to_le_bytes());
        images.extend(numbers(&colmap_pose()));
        images.extend(3i32.to_le_bytes());
        images.extend(name.as_bytes());
        images.extend(points.to_le_bytes());
        images.extend(vec![7; 24 * points as usize]);
    }
    [cameras, images]
}

fn folder_with([cameras, images]: &[Vec<u8>; 2]) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, bytes) in [("cameras.bin", cameras), ("images.bin", images)] {
        std::fs::write(folder.path().join(name), bytes).expect("a file in a temporary folder");
    }
    folder
}

#[test]
fn a_binary_model_is_read_by_its_folder_or_its_images() {
    let folder = folder_with(&binary_model([0.0; 4]));
    for path in [folder.path().to_owned(), folder.path().join("images.bin")] {
        let set = read(&path, &Hints::default())
            .expect("a good model")
            .expect("a known format");
        assert_eq!(set.names(), "a/first.png, b.png", "points are passed over");
        let entry = set.entry("first.png").expect("by the file's own name");
        assert_eq!(entry.distortion, None, "coefficients of 0");
        assert_sees_right(&entry.camera);
        assert_sees_right(&set.entry("b.png").expect("by name").camera);
    }
}

#[test]
fn a_binary_model_that_is_cut_off_or_forged_is_refused() {
    let model = binary_model([0.0; 4]);
    let [cameras, images] = &model;
    for end in (0..images.len()).step_by(7) {
        let folder = folder_with(&[cameras.clone(), images[..end].to_vec()]);
        let read = read(&folder.path().join("images.bin"), &Hints::default());
        assert!(read.is_err(), "cut off behind {end} bytes");
    }
    let mut forged = images.clone();
    forged[..8].copy_from_slice(&(1u64 << 60).to_le_bytes());
    let folder = folder_with(&[cameras.clone(), forged]);
    let said = read(folder.path(), &Hints::default())
        .expect_err("more images than bytes")
        .to_string();
    assert!(
        said.contains("images.bin") && said.contains("bytes are left"),
        "{said}"
    );
    let mut field_of_view = cameras.clone();
    field_of_view[12..16].copy_from_slice(&7i32.to_le_bytes());
    let folder = folder_with(&[field_of_view, images.clone()]);
    let said = read(folder.path(), &Hints::default())
        .expect_err("the model FOV")
        .to_string();
    assert!(
        said.contains("cameras.bin") && said.contains("undistort"),
        "{said}"
    );
}

#[test]
fn the_same_distortion_is_read_from_every_format() {
    let k = [-0.1, 0.02, 0.003, -0.004];
    let folder = folder_with(&binary_model(k));
    let set = read(folder.path(), &Hints::default());
    let binary = set.expect("a good model").expect("a known format");
    let expected = Distortion::new([k[0], k[1], 0.0, 0.0, 0.0, 0.0], [k[2], k[3]]);
    assert_eq!(binary.entries[0].distortion, expected, "binary");

    let folder = tempfile::tempdir().expect("a temporary folder");
    let lens = in_line(&[&LENS[..], &k].concat());
    write(
        &folder,
        "cameras.txt",
        &format!("3 OPENCV 600 420 {lens}\n"),
    );
    let image = format!("1 {} 3 a.png\n\n", in_line(&colmap_pose()));
    let path = write(&folder, "images.txt", &image);
    let text = read(&path, &Hints::default()).expect("a good model");
    assert_eq!(
        text.expect("a known format").entries[0].distortion,
        expected,
        "text"
    );

    let json = serde_json::json!({
        "camera_model": "OPENCV", "fl_x": 500, "w": 600, "h": 420,
        "k1": k[0], "k2": k[1], "p1": k[2], "p2": k[3],
        "frames": [{ "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] }]
    });
    let nerf = read_as("transforms.json", &json.to_string(), &Hints::default());
    assert_eq!(nerf.entries[0].distortion, expected, "transforms.json");
}

#[test]
fn fish_eyes_are_read_from_a_model_and_from_nerfs_file() {
    let k = [-0.1, 0.02, 0.003, -0.004];
    let pose = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
    let json = serde_json::json!({
        "camera_model": "OPENCV_FISHEYE", "fl_x": 500, "w": 600, "h": 420,
        "k1": k[0], "k2": k[1], "k3": k[2], "k4": k[3],
        "frames": [{ "transform_matrix": pose }]
    });
    let nerf = read_as("transforms.json", &json.to_string(), &Hints::default());
    let expected = Some(Distortion::fish_eye(k));
    assert_eq!(nerf.entries[0].distortion, expected, "transforms.json");

    let of_model = |name: &str, parameters: &[f64]| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let lens = in_line(parameters);
        write(
            &folder,
            "cameras.txt",
            &format!("3 {name} 600 420 {lens}\n"),
        );
        let image = format!("1 {} 3 a.png\n\n", in_line(&colmap_pose()));
        let path = write(&folder, "images.txt", &image);
        let set = read(&path, &Hints::default()).expect("a good model");
        set.expect("a known format").entries[0].distortion
    };
    let four = [&LENS[..], &k].concat();
    assert_eq!(of_model("OPENCV_FISHEYE", &four), expected);
    let two = Some(Distortion::fish_eye([k[0], k[1], 0.0, 0.0]));
    assert_eq!(
        of_model("RADIAL_FISHEYE", &[500.0, 300.0, 210.0, k[0], k[1]]),
        two
    );
}

#[test]
fn bare_matrices_are_camera_to_world() {
    let rows = matrix();
    let one = rows.concat();
    let lens = hints(PixelCentre::Half);
    for (name, text) in [
        ("7-Scenes", in_lines(&rows)),
        (
            "KITTI",
            format!("{}\n{}\n", in_line(&one[..12]), in_line(&one[..12])),
        ),
        ("sixteen", in_line(&one)),
    ] {
        let set = read_as("pose.txt", &text, &lens);
        let last = set.entries.last().expect("a camera");
        assert_sees_right(&last.camera);
        assert_eq!(last.name, (set.entries.len() - 1).to_string(), "{name}");
    }
}

#[test]
fn open3d_writes_matrices_column_by_column() {
    let [fx, fy, cx, cy] = LENS;
    let world_to_camera = glam::DMat4::from_cols_array_2d(&matrix())
        .transpose()
        .inverse();
    let camera = serde_json::json!({
        "class_name": "PinholeCameraParameters", "extrinsic": world_to_camera.to_cols_array(),
        "intrinsic": {
            "width": 600, "height": 420,
            "intrinsic_matrix": [fx, 0.0, 0.0, 0.0, fy, 0.0, cx - 0.5, cy - 0.5, 1.0]
        }
    });
    let one = read_as("camera.json", &camera.to_string(), &Hints::default());
    assert_sees_right(&one.entries[0].camera);
    let list = serde_json::json!({ "class_name": "PinholeCameraTrajectory", "parameters": [camera, camera] });
    let several = read_as("path.json", &list.to_string(), &Hints::default());
    assert_sees_right(&several.entry("1").expect("by number").camera);

    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = write(&folder, "lens.json", &camera["intrinsic"].to_string());
    let (lens, size) = read_lens(&path).expect("a lens");
    assert_eq!((lens.fx, lens.cy, size), (fx, cy - 0.5, Some([600, 420])));
    let said = read(&path, &Hints::default())
        .expect_err("no pose")
        .to_string();
    assert!(said.contains("lens alone"), "{said}");
    let path = write(&folder, "lens.txt", "500 0 319.5\n0 510 239.5\n0 0 1\n");
    let (lens, size) = read_lens(&path).expect("a lens");
    assert_eq!(
        (lens.fx, lens.fy, lens.cx, size),
        (500.0, 510.0, 319.5, None)
    );
    let path = write(&folder, "pose.txt", &in_lines(&matrix()));
    assert!(read_lens(&path).is_err(), "a pose is no lens");
}

#[test]
fn a_pose_is_found_by_a_time_that_is_a_little_off() {
    let line = |time: &str, x: f64| format!("{time} {x} 0 0 0 0 0 1\n");
    let text = format!("{}{}", line("1305.500", 1.0), line("1305.533", 2.0));
    let set = read_as("groundtruth.txt", &text, &hints(PixelCentre::Half));
    let x = |time: &str| set.entry(time).map(|entry| entry.camera.eye_in_world().x);
    assert_eq!(x("1305.519"), Ok(2.0), "14 ms before the second");
    assert_eq!(x("1305.49"), Ok(1.0), "10 ms before the first");
    assert!(x("1305.56").is_err(), "27 ms behind the second");
}
