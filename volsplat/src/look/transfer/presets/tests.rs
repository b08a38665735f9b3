//! Presets: their names, the data that they fit, and the looks that they bring.

use glam::DAffine3;
use resample_volume::volume::{Volume, Voxels};

use crate::look::transfer::presets::table::PRESETS;
use crate::look::transfer::presets::*;

fn volume(voxels: Voxels) -> Volume {
    Volume::new([voxels.len(), 1, 1], voxels, DAffine3::IDENTITY).expect("valid")
}

#[test]
fn every_preset_is_a_valid_function_and_found_by_its_name() {
    let histogram = Histogram::of_volume(&volume(Voxels::I16((-1000..2000).collect())));
    for preset in Preset::all() {
        let found: Preset = preset.name().to_uppercase().parse().expect("a listed name");
        assert_eq!(found.name(), preset.name());
        let function = preset.transfer(&histogram);
        let knots = (
            function.colour_knots().to_vec(),
            function.opacity_knots().to_vec(),
        );
        TransferFunction::new(knots.0.clone(), knots.1)
            .unwrap_or_else(|error| panic!("{found:?}: {error}"));
        let brightest = knots.0.iter().flat_map(|knot| knot.rgb).fold(0.0, f32::max);
        assert!(
            brightest <= 0.9,
            "{}: a channel of {brightest} leaves no room for a highlight",
            preset.name()
        );
        if preset.name() != "extremes" {
            assert_eq!(
                function.opacity(-1000.0),
                0.0,
                "{}: what is darkest is not seen",
                preset.name()
            );
        }
        let is_projection = preset.blend() != Blend::Emission;
        assert!(
            !is_projection || preset.shading() == Shading::None,
            "{}: a projection has no light",
            preset.name()
        );
    }
}

#[test]
fn an_unknown_name_lists_all_with_a_line_each() {
    let text = "list".parse::<Preset>().expect_err("no such preset");
    assert_eq!(text.lines().count(), 1 + PRESETS.len(), "{text}");
    for preset in Preset::all() {
        assert!(
            text.contains(preset.name()) && text.contains(preset.about()),
            "{} in {text}",
            preset.name()
        );
    }
}

#[test]
fn tissues_are_where_hounsfield_units_put_them() {
    let histogram = Histogram::of_volume(&volume(Voxels::I16(vec![0, 1])));
    let opacity = |name: &str, value: f64| {
        name.parse::<Preset>()
            .expect("a listed name")
            .transfer(&histogram)
            .opacity(value)
    };
    assert_eq!(opacity("ct-bone", 60.0), 0.0, "muscle is no bone");
    assert!(opacity("ct-bone", 1500.0) > 0.9, "dense bone is dense");
    assert_eq!(opacity("ct-vessels", 60.0), 0.0, "muscle is no vessel");
    assert!(opacity("ct-vessels", 300.0) > 0.5, "contrast agent is seen");
    assert!(
        opacity("ct-soft-tissue", 50.0) > 5.0 * opacity("ct-soft-tissue", -100.0),
        "fat is a veil"
    );
    assert_eq!(opacity("ct-skin", -1000.0), 0.0, "air is clear");
    assert!(
        opacity("ct-lung", -700.0) > opacity("ct-lung", 0.0),
        "the lung is denser than the body's veil"
    );
}

#[test]
fn shares_span_the_values_without_the_brightest_few() {
    let mut values: Vec<u16> = (0..10_000).map(|v| 100 + v / 10).collect();
    values[5] = 60_000;
    let preset: Preset = "mr-head".parse().expect("a listed name");
    let function = preset.transfer(&Histogram::of_volume(&volume(Voxels::U16(values))));
    let (low, high) = function.value_range();
    // Of 10000 values, 20 may lie above: the outlier and the ten at 1099 do, and the ten at 1098 are too many.
    assert_eq!(high, 1098.0, "the outlier does not stretch the range");
    assert!(
        (low - (100.0 + 0.1 * 998.0)).abs() < 1e-9,
        "the first knot lies at a tenth of it: {low}"
    );
}

#[test]
fn values_that_are_not_hounsfield_units_are_told() {
    let bone: Preset = "ct-bone".parse().expect("a listed name");
    let told = |voxels: Voxels| bone.mismatch(&volume(voxels));
    assert_eq!(told(Voxels::I16(vec![-1024, 3071])), None, "CT");
    assert_eq!(told(Voxels::F32(vec![-2048.0, 4096.0])), None, "the ends");
    assert!(told(Voxels::U8(vec![0, 255])).is_some_and(|text| text.contains("8 bits")));
    assert!(told(Voxels::I16(vec![-1024, 9000])).is_some_and(|text| text.contains("9000")));
    assert!(told(Voxels::I16(vec![-3000, 10])).is_some_and(|text| text.contains("-3000")));
    assert!(told(Voxels::U16(vec![0, 4000])).is_some_and(|text| text.contains("-1000")));
    let mr: Preset = "mr-head".parse().expect("a listed name");
    assert_eq!(
        mr.mismatch(&volume(Voxels::U8(vec![0, 255]))),
        None,
        "MR has no unit"
    );
}

#[test]
fn a_signal_begins_where_the_background_ends() {
    // Nine tenths are background around 100, and one tenth an object from 1000 to 2000.
    let background = (0..9000).map(|i| 95 + i % 11);
    let object = (0..1000).map(|i| 1000 + i);
    let values: Vec<u16> = background.chain(object).collect();
    let histogram = Histogram::of_volume(&volume(Voxels::U16(values)));
    let solid: Preset = "solid".parse().expect("a listed name");
    let function = solid.transfer(&histogram);
    assert_eq!(function.opacity(105.0), 0.0, "background");
    assert!(
        function.opacity(1000.0) > 0.5,
        "{:?}",
        function.opacity_knots()
    );
}
