//! ParaView's JSON: what is read, and what is refused with key and place.

use glam::DAffine3;
use resample_core::image::linear_from_srgb;
use resample_volume::volume::{Volume, Voxels};

use super::{ColourSpace, MOST_PIECES};
use crate::Error;
use crate::look::transfer::files::parse;
use crate::look::transfer::{
    ColourEncoding, ColourMap, FileLook, Histogram, OpacityKnot, TransferFunction,
};

const COLOURS: &str = r#""RGBPoints": [0, 0, 0, 0,  10, 1, 0.5, 0]"#;

fn function(json: &str, encoding: ColourEncoding) -> TransferFunction {
    let knots = parse(json.as_bytes(), encoding).expect("valid JSON map");
    let opacities = knots.opacities.unwrap_or(vec![OpacityKnot {
        value: 0.0,
        opacity: 1.0,
    }]);
    TransferFunction::new(knots.colours.expect("colours"), opacities).expect("valid knots")
}

fn refusal(json: &str) -> String {
    parse(json.as_bytes(), ColourEncoding::Linear).expect_err("this map must be refused")
}

#[test]
fn points_and_colours_are_read_from_object_or_list() {
    let map = format!(
        r#"{{"Name": "x", "NanColor": [1, 0, 0], "ColorSpace": "RGB", {COLOURS}, "Points": [0, 0, 0.5, 0, 10, 0.8, 0.5, 0]}}"#
    );
    for json in [map.clone(), format!("[{map}]")] {
        let function = function(&json, ColourEncoding::Linear);
        assert_eq!(function.sample(5.0), ([0.5, 0.25, 0.0], 0.4));
        assert_eq!(
            (
                function.colour_knots().len(),
                function.opacity_knots().len()
            ),
            (2, 2),
            "no needless knots"
        );
    }
}

#[test]
fn srgb_is_interpolated_as_written_and_then_decoded() {
    let function = function(&format!("{{{COLOURS}}}"), ColourEncoding::Srgb);
    for value in [0.0, 0.15, 2.5, 5.0, 7.34, 10.0] {
        let expected = linear_from_srgb(value / 10.0);
        let got = function.colour(f64::from(value))[0];
        assert!(
            (got - expected).abs() < 2e-4,
            "at {value}: {got} against {expected}"
        );
    }
}

#[test]
fn step_keeps_the_own_colour_at_a_knot_and_the_upper_one_above() {
    let json = r#"{"ColorSpace": "Step", "RGBPoints": [0, 1, 0, 0, 10, 0, 1, 0, 20, 0, 0, 1]}"#;
    let function = function(json, ColourEncoding::Linear);
    let expected = [
        (-1.0, [1.0, 0.0, 0.0]),
        (0.0, [1.0, 0.0, 0.0]),
        (1e-9, [0.0, 1.0, 0.0]),
        (10.0, [0.0, 1.0, 0.0]),
        (11.0, [0.0, 0.0, 1.0]),
        (99.0, [0.0, 0.0, 1.0]),
    ];
    for (value, rgb) in expected {
        assert_eq!(function.colour(value), rgb, "at {value}");
    }
}

#[test]
fn bent_colour_spaces_follow_their_path() {
    let (red, blue) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    for (name, space) in [
        ("HSV", ColourSpace::Hsv),
        ("Wrapped", ColourSpace::HsvWrapped),
        ("Lab", ColourSpace::Lab),
        ("CIELAB", ColourSpace::Lab),
        ("diverging", ColourSpace::Diverging),
    ] {
        let json = format!(r#"{{"ColorSpace": "{name}", "RGBPoints": [0, 1, 0, 0, 1, 0, 0, 1]}}"#);
        let function = function(&json, ColourEncoding::Linear);
        for step in 0..=1000 {
            let share = f64::from(step) / 1000.0;
            let expected = space.between(red, blue, share);
            let got = function.colour(share);
            for channel in 0..3 {
                let error = (f64::from(got[channel]) - expected[channel]).abs();
                // The worst place is where a channel leaves 0: the sRGB curve has slope 12.92 there, and a piece
                // across that kink misses it by at most a quarter of slope times width (light rising by 1 in all).
                assert!(
                    error < 12.92 / 4.0 / MOST_PIECES as f64,
                    "{name} at {share}: {got:?} against {expected:?}"
                );
            }
        }
    }
}

#[test]
fn midpoint_and_sharpness_shape_the_opacity() {
    let json = format!(r#"{{{COLOURS}, "Points": [0, 0, 0.25, 0, 8, 1, 0.5, 1, 16, 0, 0.5, 0]}}"#);
    let function = function(&json, ColourEncoding::Linear);
    assert_eq!(function.opacity(2.0), 0.5, "half way at the midpoint");
    assert_eq!(
        (function.opacity(11.999), function.opacity(12.0)),
        (1.0, 0.0),
        "a sharp segment is a step"
    );
}

#[test]
fn equal_scalars_are_a_step_that_holds_from_there() {
    let json = format!(r#"{{{COLOURS}, "Points": [0, 0, 0.5, 0, 71, 0, 0.5, 0, 71, 1, 0.5, 0]}}"#);
    let function = function(&json, ColourEncoding::Linear);
    assert_eq!(
        (function.opacity(70.999), function.opacity(71.0)),
        (0.0, 1.0)
    );
}

#[test]
fn faults_name_key_and_place() {
    let cases = [
        ("[1, 2", "no valid JSON"),
        ("[]", "expected an object with RGBPoints"),
        ("[3]", "expected an object with RGBPoints"),
        (r#"[{"Name": "a"}, {"Name": "b"}]"#, "2 colour maps (a, b)"),
        ("{}", "RGBPoints is missing: expected"),
        (r#"{"Points": [0, 0, 0.5]}"#, "Points has 3 numbers"),
        (
            r#"{"IndexedColors": [0, 0, 0]}"#,
            "IndexedColors are for categories",
        ),
        (r#"{"RGBPoints": 3}"#, "RGBPoints: expected a list"),
        (r#"{"RGBPoints": []}"#, "RGBPoints has 0 numbers"),
        (
            r#"{"RGBPoints": [0, 0, 0, 0, 1]}"#,
            "RGBPoints has 5 numbers: expected a multiple of four",
        ),
        (r#"{"RGBPoints": [0, 0, null, 0]}"#, "RGBPoints[2] is null"),
        (
            r#"{"RGBPoints": [0, 0, "NaN", 0]}"#,
            "RGBPoints[2] is \"NaN\"",
        ),
        (r#"{"RGBPoints": [0, 0, NaN, 0]}"#, "no valid JSON"),
        (
            r#"{"RGBPoints": [0, 0, 255, 0]}"#,
            "RGBPoints[2] (g) is 255: expected 0 to 1",
        ),
        (
            r#"{"RGBPoints": [0, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0]}"#,
            "RGBPoints[8] is 1 after 2",
        ),
        (
            r#"{"RGBPoints": [0, 0, 0, 0], "Points": [0, 0, 0.5, 0, 1, 1.5, 0.5, 0]}"#,
            "Points[5] (opacity) is 1.5",
        ),
        (
            r#"{"RGBPoints": [0, 0, 0, 0], "Points": [0, 0, 0.5, -1]}"#,
            "Points[3] (sharpness) is -1",
        ),
        (
            r#"{"RGBPoints": [0, 0, 0, 0], "Points": [0, 0, 0.5]}"#,
            "Points has 3 numbers",
        ),
        (
            r#"{"RGBPoints": [0, 0, 0, 0], "ColorSpace": "Lab/CIEDE2000"}"#,
            "ColorSpace 'Lab/CIEDE2000': expected RGB",
        ),
        (
            r#"{"RGBPoints": [0, 0, 0, 0], "ColorSpace": 3}"#,
            "ColorSpace: expected a name",
        ),
        (
            r#"{"RGBPoints": [1, 0, 0, 0], "UseLogScale": 1}"#,
            "UseLogScale",
        ),
    ];
    for (json, expected) in cases {
        let text = refusal(json);
        assert!(text.contains(expected), "{json}: {text}");
    }
}

#[test]
fn files_are_named_in_errors_and_absent_points_become_automatic() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("map.json");
    let values = [vec![0u8; 90], vec![200; 10]].concat();
    let volume = Volume::new([100, 1, 1], Voxels::U8(values), DAffine3::IDENTITY).expect("valid");
    let load = || FileLook::load(&path, ColourEncoding::Linear, &volume);
    assert!(matches!(load(), Err(Error::Read { .. })), "an absent file");
    std::fs::write(&path, "{}").expect("write");
    assert!(
        load()
            .expect_err("no colours")
            .to_string()
            .contains("map.json: RGBPoints is missing")
    );
    std::fs::write(&path, format!("{{{COLOURS}}}")).expect("write");
    let function = load().expect("valid").function;
    assert_eq!(function.opacity(0.0), 0.0, "the background vanishes");
    assert!(function.opacity(200.0) > 0.0, "the object stays");
}

#[test]
fn rescaling_moves_the_file_to_the_volume_but_not_the_automatic_opacity() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("map.json");
    let values = [vec![50u8; 90], vec![200; 10]].concat();
    let volume = Volume::new([100, 1, 1], Voxels::U8(values), DAffine3::IDENTITY).expect("valid");
    let colours = r#""RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1]"#;
    let load = || FileLook::load_rescaled(&path, ColourEncoding::Linear, &volume);
    std::fs::write(
        &path,
        format!(r#"{{{colours}, "Points": [0, 0, 0.5, 0, 0.5, 1, 0.5, 0]}}"#),
    )
    .expect("write");
    let function = load().expect("valid").function;
    assert_eq!(
        function.value_range(),
        (50.0, 200.0),
        "both kinds of knots span the volume"
    );
    assert_eq!(
        (function.opacity(87.5), function.opacity(125.0)),
        (0.5, 1.0),
        "opacity keeps its shape"
    );
    std::fs::write(&path, format!("{{{colours}}}")).expect("write");
    let function = load().expect("valid").function;
    let automatic =
        TransferFunction::automatic(&Histogram::of_volume(&volume), ColourMap::default());
    assert_eq!(
        function.opacity_knots(),
        automatic.opacity_knots(),
        "automatic opacity stays"
    );
    assert_eq!(
        (function.colour(50.0), function.colour(200.0)),
        ([0.0; 3], [1.0; 3]),
        "colours are moved"
    );
}

#[test]
fn a_file_of_opacity_alone_gets_the_default_colours() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("opacity.json");
    let values = [vec![50u8; 90], vec![200; 10]].concat();
    let volume = Volume::new([100, 1, 1], Voxels::U8(values), DAffine3::IDENTITY).expect("valid");
    std::fs::write(&path, r#"[{"Points": [100, 0, 0.5, 0, 180, 0.5, 0.5, 0]}]"#).expect("write");
    let look = FileLook::load(&path, ColourEncoding::Linear, &volume).expect("valid");
    let function = look.function;
    assert_eq!((function.opacity(140.0), look.shading), (0.25, None));
    let map = TransferFunction::new(
        ColourMap::default().knots(50.0, 200.0),
        function.opacities.clone(),
    );
    let map = map.expect("valid");
    assert_eq!(
        function.colour(125.0),
        map.colour(125.0),
        "over the volume's values"
    );
    let moved = FileLook::load_rescaled(&path, ColourEncoding::Linear, &volume).expect("valid");
    assert_eq!(
        moved.function.opacity(125.0),
        0.25,
        "from the first knot to the last"
    );
}
