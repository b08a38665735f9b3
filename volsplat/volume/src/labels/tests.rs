//! Label tables: what is read, what is refused, and how the built-in colours differ.

use crate::labels::*;

const SNAP: &str = "################\n# ITK-SnAP Label Description File\n    0     0    0    0        0  0  0    \"Clear Label\"\n\
    1   255    0    0        1  1  1    \"Label 1\"\n    2     0  255    0      0.5  1  1    \"half\"\n   \
    7     0    0  255        1  0  1    \"not visible\"\n";

#[test]
fn the_three_kinds_of_file_say_the_same() {
    let snap = files::parse(SNAP).expect("a label file of ITK-SNAP");
    let csv = files::parse(
        "label,r,g,b,opacity,name\n0,0,0,0,0\n1, 255,0,0,1,red\n2,0,255,0,0.5\n7,0,0,255,0\n",
    );
    let json = files::parse(
        r##"{"0": {"colour": "#000000", "opacity": 0}, "1": "#ff0000", "2": {"color": "#00FF00", "opacity": 0.5},
        "7": {"colour": "#0000ff", "opacity": 0}}"##,
    );
    assert_eq!(Ok(&snap), csv.as_ref(), "CSV");
    assert_eq!(Ok(&snap), json.as_ref(), "JSON");
    assert_eq!(snap.look(1).rgb, [1.0, 0.0, 0.0], "red");
    assert!((snap.look(2).opacity - 0.5).abs() < 1e-15, "half opaque");
    assert_eq!(snap.look(7).opacity, 0.0, "not visible");
    assert_eq!(snap.look(3).opacity, 0.0, "not listed, so not drawn");
    for (table, label) in [snap, LabelTable::distinct()]
        .iter()
        .flat_map(|t| (0..9).map(move |label| (t, label)))
    {
        assert_eq!(
            table.shows(label),
            table.look(label).opacity > 0.0,
            "{table:?}, {label}"
        );
    }
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let bad = [
        ("", "no label"),
        ("1 255 0 0\n", "line 1"),
        ("1,255,0,0\n2,256,0,0\n", "line 2"),
        ("1,255,0,0\nx,1,0,0\n", "line 2"),
        ("1,255,0,0,1.5\n", "opacity 1.5"),
        (r#"{"1": "red"}"#, "\"1\""),
        (r#"{"a": "red"}"#, "\"a\""),
        (r##"{"1": "#123456""##, "no JSON"),
        ("1 1 1 nan 1 1\n", "line 1"),
        ("1e3 1 1 1 1 1\n", "line 1"),
    ];
    for (text, place) in bad {
        let error = files::parse(text).expect_err("not a table");
        assert!(error.contains(place), "{text:?}: {error}");
    }
}

#[test]
fn built_in_colours_differ_and_hide_the_background() {
    let table = LabelTable::distinct();
    assert_eq!(table.look(0).opacity, 0.0, "0 is the background");
    for a in 1..=40i64 {
        for b in 1..a {
            let [x, y] = [a, b].map(|label| table.look(label).rgb);
            assert!(x != y, "labels {a} and {b} look alike");
        }
    }
    for label in [-1, i64::MIN, i64::MAX] {
        let look = table.look(label);
        assert!(
            look.rgb.iter().all(|c| (0.0..=1.0).contains(c)) && look.opacity == 1.0,
            "label {label}"
        );
    }
}

#[test]
fn opacities_scale_with_the_extinction() {
    let table = LabelTable::new([(
        1,
        LabelLook {
            rgb: [1.0; 3],
            opacity: 0.19,
        },
    )])
    .expect("valid");
    let half = table.clone().with_opacity_scaled(0.5);
    assert!((half.look(1).opacity - 0.1).abs() < 1e-15, "1 - sqrt(0.81)");
    assert!(
        LabelTable::new([(
            1,
            LabelLook {
                rgb: [f32::NAN; 3],
                opacity: 0.0
            }
        )])
        .is_err(),
        "no colour"
    );
    let bad = LabelTable::new([(
        5,
        LabelLook {
            rgb: [0.0; 3],
            opacity: 1.1,
        },
    )]);
    assert!(
        bad.expect_err("no opacity").to_string().contains("label 5"),
        "the label is named"
    );
}
