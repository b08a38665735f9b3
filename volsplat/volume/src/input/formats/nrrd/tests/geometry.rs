//! Axes, directions and world spaces.

use glam::{DMat3, DVec3};

use crate::Error;
use crate::input::formats::nrrd::tests::Folder;
use crate::volume::Volume;

fn volume(sizes: &str, fields: &str) -> Result<Volume, Error> {
    let dimension = sizes.split(' ').count();
    let count: usize = sizes
        .split(' ')
        .map(|size| size.parse::<usize>().expect("a number"))
        .product();
    let head = format!(
        "NRRD0005\ntype: uint8\ndimension: {dimension}\nsizes: {sizes}\nencoding: raw\n{fields}\n"
    );
    Folder::new().load(&[head.as_bytes(), &vec![0; count]])
}

#[test]
fn directions_and_origin_make_the_affine_map() {
    let fields = "space: left-posterior-superior\nspace directions: (0,2,0) ( -3, 0, 0.5 ) (0,0,4)\nspace origin: (1,2,3)\n";
    let volume = volume("2 3 4", fields).expect("valid");
    let columns = DMat3::from_cols(
        DVec3::new(0.0, 2.0, 0.0),
        DVec3::new(-3.0, 0.0, 0.5),
        DVec3::new(0.0, 0.0, 4.0),
    );
    assert_eq!(
        volume.world_from_index.matrix3, columns,
        "sheared directions are kept as they are"
    );
    assert_eq!(
        volume.world_from_index.translation,
        DVec3::new(1.0, 2.0, 3.0)
    );
    assert_eq!(volume.up_hint, Some(DVec3::Z));
    assert_eq!(volume.space.as_deref(), Some("left-posterior-superior"));
}

#[test]
fn spacings_stand_in_for_directions_and_nan_means_one() {
    let volume = volume("2 3 4", "spacings: 0.5 nan 2\n").expect("valid");
    assert_eq!(volume.spacing(), [0.5, 1.0, 2.0]);
    assert_eq!(volume.up_hint, None);
}

#[test]
fn anatomical_spaces_point_up_along_z() {
    for (space, up) in [
        ("RAS", Some(DVec3::Z)),
        ("left-anterior-superior", Some(DVec3::Z)),
        ("right-anterior-superior-time", Some(DVec3::Z)),
        ("scanner-xyz", None),
        ("3D-right-handed", None),
    ] {
        assert_eq!(
            volume("1 1 1", &format!("space: {space}\n"))
                .expect("valid")
                .up_hint,
            up,
            "{space}"
        );
    }
}

#[test]
fn pictures_and_lines_get_axes_of_size_one() {
    let flat = volume("4 3", "spacings: 2 0.5\n").expect("valid");
    assert_eq!((flat.dims, flat.spacing()), ([4, 3, 1], [2.0, 0.5, 0.5]));
    let turned = volume(
        "4 3",
        "space dimension: 3\nspace directions: (0,0,1) (0,1,0)\n",
    )
    .expect("valid");
    assert_eq!(
        turned.world_from_index.matrix3.z_axis,
        DVec3::new(-1.0, 0.0, 0.0)
    );
    let line = volume("4", "").expect("valid");
    assert_eq!((line.dims, line.spacing()), ([4, 1, 1], [1.0, 1.0, 1.0]));
}

#[test]
fn axes_of_size_one_are_dropped_and_longer_ones_refused() {
    let colour = volume(
        "1 4 3 2",
        "kinds: vector domain domain domain\nspace directions: none (1,0,0) (0,2,0) (0,0,3)\n",
    );
    let colour = colour.expect("one component is a scalar");
    assert_eq!(
        (colour.dims, colour.spacing()),
        ([4, 3, 2], [1.0, 2.0, 3.0])
    );
    assert_eq!(volume("4 3 2 1", "").expect("one time").dims, [4, 3, 2]);
    let cases = [
        (
            "3 4 2",
            "kinds: RGB-color domain domain\n",
            "a voxel has 3 components",
        ),
        (
            "4 3 2 5",
            "kinds: space space space time\n",
            "a voxel has 5 components",
        ),
        (
            "6 4 3 2",
            "space directions: none (1,0,0) (0,1,0) (0,0,1)\n",
            "a voxel has 6 components",
        ),
        (
            "3 4 2 5",
            "kinds: RGB-color space space time\n",
            "axis 3 of size 5 is time, and another axis",
        ),
        ("4 3 2 5", "", "4 axes are longer than 1"),
    ];
    for (sizes, fields, expected) in cases {
        let error = volume(sizes, fields).expect_err("not a scalar volume");
        assert!(matches!(error, Error::Unsupported { .. }), "{error}");
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn faulty_geometry_is_refused() {
    let cases = [
        (
            "space directions: (1,0,0) (0,1,0)\n",
            "'space directions' has 2 entries",
        ),
        (
            "space directions: (1,0,0) (0,1,0) (0,0,1\n",
            "expected vectors such as",
        ),
        (
            "space directions: (1,0,0) (0,1,0) (0,x,1)\n",
            "expected vectors such as",
        ),
        ("space directions: (1,0,0) (0,1,0) (0,1,0)\n", "one plane"),
        (
            "space directions: (1,0,0) (0,1,0) (0,0,nan)\n",
            "not finite",
        ),
        (
            "space directions: (1,0,0) (0,1,0) (0,0,1,2)\n",
            "vector of 4 components",
        ),
        (
            "space directions: (1,0,0) (0,1,0) (5)\n",
            "vector of 1 components",
        ),
        ("space origin: (1,0,0) (0,1,0)\n", "expected one vector"),
        ("spacings: 1 0 1\n", "axis 1 of the volume has length 0"),
        ("spacings: 1 two 1\n", "'spacings' holds 'two'"),
    ];
    for (fields, expected) in cases {
        let text = volume("1 1 1", fields).expect_err("faulty").to_string();
        assert!(text.contains(expected), "{fields}: {text}");
    }
}
