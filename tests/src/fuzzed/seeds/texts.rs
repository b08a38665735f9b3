//! Cameras, transfer functions and tables of labels.

use super::Seed;
use super::binary::{doubles, words};

pub(super) const CAMERA_WORDS: [&str; 30] = [
    "cam0=[",
    "cam1=[",
    "doffs=",
    "baseline=",
    "width=",
    "height=",
    "class_name",
    "PinholeCameraTrajectory",
    "parameters",
    "extrinsic",
    "intrinsic",
    "intrinsic_matrix",
    "transform_matrix",
    "frames",
    "file_path",
    "camera_angle_x",
    "fl_x",
    "k1",
    "k2",
    "p1",
    "w",
    "h",
    "SIMPLE_RADIAL",
    "OPENCV_FISHEYE",
    "PINHOLE",
    "cameras",
    "Resolution",
    "Focal",
    "Position",
    "Rotation",
];

pub(super) const TABLE_WORDS: [&str; 18] = [
    "volumeProperties",
    "components",
    "shade",
    "lighting",
    "scalarOpacity",
    "points",
    "rgbTransferFunction",
    "midpoint",
    "Points",
    "RGBPoints",
    "ColorSpace",
    "Lab",
    "Diverging",
    "HSV",
    "Step",
    "Name",
    "NanColor",
    "UseLogScale",
];

pub(super) fn cameras() -> Vec<Seed> {
    let calib = "cam0=[520 0 300; 0 520 210; 0 0 1]\ncam1=[520 0 310; 0 520 210; 0 0 1]\ndoffs=10\nbaseline=160\nwidth=600\nheight=420\n";
    let transforms = r#"{"camera_angle_x":0.7,"w":64,"h":48,"k1":0.01,"frames":[{"file_path":"a","transform_matrix":[[1,0,0,0],[0,1,0,0],[0,0,1,2],[0,0,0,1]]}]}"#;
    let open3d = r#"{"class_name":"PinholeCameraParameters","extrinsic":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,2,1],"intrinsic":{"width":64,"height":48,"intrinsic_matrix":[50,0,0,0,50,0,32,24,1]}}"#;
    let mpeg = r#"{"Version":"3.0","Content_name":"x","cameras":[{"Name":"v0","Position":[0,0,0],"Rotation":[0,0,0],"Depthmap":1,"Depth_range":[0.5,20],"Resolution":[64,48],"Projection":"Perspective","Focal":[50,50],"Principle_point":[32,24],"BitDepthColor":8,"BitDepthDepth":16,"ColorSpace":"YUV420","DepthColorSpace":"YUV420"}]}"#;
    let binary = [
        &words(&[1, 0])[..],
        &words(&[1, 2]),
        &words(&[64, 0, 48, 0]),
        &doubles(&[50.0, 32.0, 24.0, 0.01]),
    ]
    .concat();
    let text = |text: &str| text.as_bytes().to_vec();
    vec![
        ("calib", text(calib)),
        ("transforms", text(transforms)),
        ("open3d", text(open3d)),
        ("mpeg", text(mpeg)),
        ("log", text("0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 2\n0 0 0 1\n")),
        (
            "tum",
            text("# time tx ty tz qx qy qz qw\n1.5 0 0 1 0 0 0 1\n1.6 0 0 2 0 0 0 1\n"),
        ),
        ("matrix", text("1 0 0 0\n0 1 0 0\n0 0 1 2\n0 0 0 1\n")),
        (
            "colmap.txt.cut",
            text("# Camera list\n1 SIMPLE_RADIAL 64 48 50 32 24 0.01\n"),
        ),
        ("colmap.bin.cut", binary),
        ("lens", text("50 0 32\n0 50 24\n0 0 1\n")),
    ]
}

/// A volume property of Slicer.
const VP: &str = "1\n1\n0.9\n0.1\n0.2\n10\n6 0 0 3 0.25 7 1\n4 0 1 255 0.5\n8 0 0 0 0 7 1 0.5 0\n";

/// The same as JSON.
const VP_JSON: &str = r#"{"volumeProperties":[{"components":[{"shade":true,"lighting":{"specular":0.2},"scalarOpacityUnitDistance":2.5,"scalarOpacity":{"points":[{"x":0,"y":0},{"x":7,"y":1,"midpoint":0.3,"sharpness":0.5}]},"gradientOpacity":{"points":[{"x":0,"y":1},{"x":255,"y":0.5}]},"rgbTransferFunction":{"points":[{"x":0,"color":[0,0,0]},{"x":7,"color":[1,0.5,0]}]},"isoSurfaceValues":[3]}]}]}"#;

pub(super) fn tables() -> Vec<Seed> {
    let map = r#"[{"ColorSpace":"Diverging","Name":"x","NanColor":[1,1,0],"Points":[0,0,0.5,0,7,1,0.5,0],"RGBPoints":[0,0.2,0.3,0.7,3.5,0.8,0.8,0.8,7,0.7,0,0.1]}]"#;
    let step =
        r#"{"ColorSpace":"Lab","RGBPoints":[0,1,0,0,1,0,1,0],"Points":[0,0,0.5,0.2,1,1,0.9,0]}"#;
    let labels = r##"{"1":"#ff0000","2":"#00ff00","3":{"colour":"#0000ff","opacity":0.5}}"##;
    let snap = "################\n    0     0    0    0        0  0  0    \"Clear Label\"\n    1   255    0    0        1  1  1    \"Label 1\"\n";
    [
        ("map", map),
        ("step", step),
        ("opacity", r#"{"Points":[0,0,0.5,0,7,1,0.5,0]}"#),
        ("vp", VP),
        ("vp-json", VP_JSON),
        ("labels", labels),
        ("table", snap),
        ("csv", "1,255,0,0\n2,0,255,0,0.5\n"),
    ]
    .map(|(name, text)| (name, text.as_bytes().to_vec()))
    .to_vec()
}
