//! Values in one word: the forms that are accepted, and those that are not.

use super::*;

#[test]
fn sizes_are_within_range() {
    assert_eq!(
        size("640x480"),
        Ok(Size {
            width: 640,
            height: 480
        }),
        "the usual spelling"
    );
    let square = Size {
        width: 640,
        height: 640,
    };
    assert_eq!(size("640"), Ok(square), "one side for both");
    for bad in ["", "640x", "0", "0x1", "1x99999", "-1x5", "1x2x3", "axb"] {
        assert!(size(bad).is_err(), "{bad:?} is no size");
    }
}

#[test]
fn vectors_are_three_finite_numbers() {
    assert_eq!(
        vector("1, -2,3e-1"),
        Ok([1.0, -2.0, 0.3]),
        "spaces and exponents are fine"
    );
    for bad in ["1,2", "1,2,3,4", "1,2,nan", "1,2,inf", "1,,2", ""] {
        assert!(vector(bad).is_err(), "{bad:?} is no vector");
    }
    assert!(dims("4,0,4").is_err(), "an empty grid has no voxels");
    assert_eq!(dims("4,5,6"), Ok([4, 5, 6]), "three sizes");
}

#[test]
fn boxes_and_planes_have_an_inside() {
    assert_eq!(
        corners("-1,0,0,1,2,3.5"),
        Ok([[-1.0, 0.0, 0.0], [1.0, 2.0, 3.5]]),
        "two corners"
    );
    for bad in [
        "0,0,0,1,1",
        "0,0,0,1,1,0",
        "0,0,0,1,1,nan",
        "1,0,0,0,1,1",
        "",
    ] {
        assert!(corners(bad).is_err(), "{bad:?} is no box");
    }
    assert_eq!(
        plane("0,-2,0,5").map(|plane| plane.offset),
        Ok(5.0),
        "a direction of any length"
    );
    for bad in ["0,0,0,1", "1,0,0", "1,0,0,inf", "1,0,0,0,0"] {
        assert!(plane(bad).is_err(), "{bad:?} is no plane");
    }
}

#[test]
fn colours_are_decoded_to_linear_light() {
    assert_eq!(colour("white"), Ok([1.0; 3]), "white");
    assert_eq!(colour("#000000"), Ok([0.0; 3]), "black");
    assert_eq!(
        colour("#ff8000"),
        colour("255,128,0"),
        "both spellings of orange"
    );
    assert_eq!(colour("red"), colour("#ff0000"), "red");
    for bad in ["#ff80", "#ff80zz", "256,0,0", "-1,0,0", "rot", "#éé"] {
        assert!(colour(bad).is_err(), "{bad:?} is no colour");
    }
}

#[test]
fn windows_have_a_level_and_a_width_above_0() {
    assert_eq!(
        window("-600, 1500"),
        Ok(Window {
            level: -600.0,
            width: 1500.0
        }),
        "a lung window"
    );
    let soft = Window {
        level: 40.0,
        width: 400.0,
    };
    assert_eq!(window("-160..240"), Ok(soft), "the same as 40,400");
    for bad in [
        "240..-160",
        "1..1",
        "1..",
        "..2",
        "1..2,3",
        "40",
        "40,0",
        "40,-400",
        "1,2,3",
        "40,inf",
        "",
    ] {
        assert!(window(bad).is_err(), "{bad:?} is no window");
    }
}

#[test]
fn orbits_have_an_optional_distance() {
    let expected = Orbit {
        azimuth_deg: -30.0,
        elevation_deg: 90.0,
        distance: 1.0,
    };
    assert_eq!(orbit("-30,90"), Ok(expected), "the pole is allowed");
    for bad in ["30", "0,91", "0,0,0", "0,0,-1", "0,0,1,2"] {
        assert!(orbit(bad).is_err(), "{bad:?} is no orbit");
    }
}

#[test]
fn cells_are_a_word_or_split_with_its_error() {
    for word in ["auto", "off", "mean", "split", "split:0.25", "split:0"] {
        assert_eq!(cells(word).map(cells_word), Ok(word.to_owned()), "as typed");
    }
    assert_eq!(cells("split:0.0625"), Ok(Cells::SPLIT), "the default error");
    for bad in [
        "",
        "split:",
        "split:1",
        "split:-1",
        "split:nan",
        "mean:0.1",
        "splits",
    ] {
        assert!(cells(bad).is_err(), "{bad:?} is no choice of cells");
    }
}
