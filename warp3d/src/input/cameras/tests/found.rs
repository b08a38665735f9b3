//! Camera files as capture tools leave them: binary models, bare matrices, Open3D's JSON, other clocks, curved lenses.

use super::*;

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
