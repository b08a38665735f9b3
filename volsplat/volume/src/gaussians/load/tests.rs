//! Which files count as Gaussians, and what is said of the others.

use super::*;

/// One Gaussian in text.
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
    property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nproperty float opacity\nproperty float scale_0\n\
    property float scale_1\nproperty float scale_2\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\n\
    property float rot_3\nend_header\n1 2 3 0 0 0 0 -2 -2 -2 1 0 0 0\n";

const META: &str = r#"{ "version": 2, "count": 1, "means": { "files": ["a", "b"] }, "scales": { "files": ["c"] },
    "quats": { "files": ["d"] }, "sh0": { "files": ["e"] } }"#;

fn splat() -> Vec<u8> {
    let floats = [1f32, 2.0, 3.0, 0.1, 0.1, 0.1];
    let mut bytes: Vec<u8> = floats
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    bytes.extend([255, 128, 0, 255, 255, 128, 128, 128]);
    bytes
}

#[test]
fn formats_follow_from_the_content() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let format_of = |name: &str, bytes: &[u8]| {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        gaussian_format_of(&path).expect("readable")
    };
    assert_eq!(
        format_of("a.txt", PLY.as_bytes()),
        Some(GaussianFormat::Ply)
    );
    assert_eq!(format_of("b.ply", &splat()), Some(GaussianFormat::Splat));
    assert_eq!(
        format_of("c.bin", META.as_bytes()),
        Some(GaussianFormat::Sog)
    );
    let gltf = br#"{ "extensionsUsed": ["KHR_gaussian_splatting"] }"#;
    assert_eq!(format_of("d.json", gltf), Some(GaussianFormat::Gltf));
    assert_eq!(format_of("e", b"NGSP\x04\0\0\0"), Some(GaussianFormat::Spz));
    let points = PLY.replace("scale_0", "size");
    let others: [&[u8]; 7] = [
        b"",
        points.as_bytes(),
        b"ply\n",
        b"{}",
        b"glTF",
        b"PK\x03\x04",
        &splat()[..31],
    ];
    for (number, bytes) in others.into_iter().enumerate() {
        assert_eq!(format_of("other.splat", bytes), None, "file {number}");
    }
}

#[test]
fn a_folder_with_a_description_is_a_scene() {
    let dir = tempfile::tempdir().expect("temporary folder");
    assert!(!is_gaussians(dir.path()), "an empty folder");
    let why = load(dir.path(), &GaussianLoadOptions::default()).expect_err("nothing there");
    assert!(why.to_string().contains("no Gaussians"), "{why}");
    std::fs::write(dir.path().join("meta.json"), META).expect("written");
    assert!(is_gaussians(dir.path()));
    let why = load(dir.path(), &GaussianLoadOptions::default()).expect_err("no pictures");
    assert!(matches!(why, Error::Invalid { .. }), "{why}");
}

#[test]
fn files_are_read_or_refused_by_name() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = dir.path().join("scene");
    let options = GaussianLoadOptions::default();
    assert!(matches!(load(&path, &options), Err(Error::Read { .. })));
    for bytes in [PLY.as_bytes().to_vec(), splat()] {
        std::fs::write(&path, bytes).expect("written");
        let (all, notes) = load(&path, &options).expect("a good file");
        assert_eq!((all.len(), notes.len()), (1, 0));
        assert_eq!(all.centres()[0], glam::Vec3::new(1.0, 2.0, 3.0));
    }
    for (bytes, reason) in [
        (&b""[..], "it is empty: expected PLY"),
        (b"x", "no Gaussians"),
    ] {
        std::fs::write(&path, bytes).expect("written");
        let why = load(&path, &options).expect_err("refused").to_string();
        assert!(why.contains("scene: ") && why.contains(reason), "{why}");
    }
}
