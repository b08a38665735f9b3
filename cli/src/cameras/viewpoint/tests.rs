//! Words of cameras, and cameras that are moved.

use super::*;

#[test]
fn words_are_files_angles_or_shifts() {
    let file = |path: &str, entry: Option<&str>| Viewpoint::File {
        path: path.into(),
        entry: entry.map(str::to_owned),
    };
    assert_eq!(
        parse("cameras.json#targets/0"),
        Ok(file("cameras.json", Some("targets/0"))),
        "an entry"
    );
    assert_eq!(parse("calib.txt"), Ok(file("calib.txt", None)), "no entry");
    assert_eq!(
        parse("a.json#"),
        Ok(file("a.json#", None)),
        "nothing behind the sign"
    );
    assert_eq!(parse("fov:60"), Ok(Viewpoint::Fov(60.0)), "an angle");
    assert_eq!(
        parse("shift:0.1,0,-2"),
        Ok(Viewpoint::Shift(DVec3::new(0.1, 0.0, -2.0))),
        "a shift"
    );
    for bad in ["", "fov:0", "fov:x", "shift:1,2"] {
        assert!(parse(bad).is_err(), "{bad:?} is no camera");
    }
}

#[test]
fn a_shift_moves_the_eye_along_the_axes_of_the_camera() {
    let pose = LookAt {
        position: DVec3::new(1.0, 2.0, 3.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    let from = Camera::perspective(&pose, 1.0, [8, 6]).expect("a good camera");
    let known = Known {
        picture: [8, 6],
        size: None,
        lens: None,
    };
    let shifted =
        several(&Viewpoint::Shift(DVec3::new(0.0, 0.0, 0.5)), &from, &known).expect("good")[0];
    let moved = shifted.with_any_near().eye_in_world() - from.eye_in_world();
    assert!(
        (moved - 0.5 * from.forward_in_world()).length() < 1e-12,
        "half a unit forward, not {moved}"
    );
    assert!(
        only_one(&Viewpoint::Shift(DVec3::X), &known).is_err(),
        "there is nothing to shift from"
    );
}
