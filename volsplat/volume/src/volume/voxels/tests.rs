//! Volumes: guarantees after `new`, and the words of refusals.

use glam::{DAffine3, DMat3, DVec3};

use crate::volume::*;

fn message(dims: [usize; 3], voxels: Voxels, map: DAffine3) -> String {
    Volume::new(dims, voxels, map)
        .expect_err("this volume must be refused")
        .to_string()
}

#[test]
fn values_spacing_and_size_are_those_given() {
    let map = DAffine3::from_mat3_translation(
        DMat3::from_cols(
            DVec3::new(0.0, 2.0, 0.0),
            DVec3::new(-3.0, 0.0, 0.0),
            DVec3::new(0.0, 0.0, 0.5),
        ),
        DVec3::new(10.0, 20.0, 30.0),
    );
    let volume = Volume::new([2, 1, 2], Voxels::I16(vec![-5, 7, 9, 300]), map).expect("valid");
    assert_eq!(volume.len(), 4);
    assert_eq!(volume.bytes(), 8);
    assert_eq!(volume.spacing(), [2.0, 3.0, 0.5]);
    assert_eq!(volume.smallest_spacing(), 0.5);
    assert_eq!(volume.value_range(), (-5.0, 300.0));
    assert_eq!(volume.value(3), 300.0, "voxel (1,0,1) is the last one");
    let corner = volume
        .world_from_index
        .transform_point3(DVec3::new(1.0, 0.0, 1.0));
    assert_eq!(
        corner,
        DVec3::new(10.0, 22.0, 30.5),
        "a voxel stands at origin + index * axis"
    );
}

#[test]
fn every_type_gives_its_values_exactly() {
    let all = [
        Voxels::U8(vec![255]),
        Voxels::I8(vec![-128]),
        Voxels::U16(vec![65535]),
        Voxels::I16(vec![-32768]),
        Voxels::U32(vec![u32::MAX]),
        Voxels::I32(vec![i32::MIN]),
        Voxels::F32(vec![0.1]),
        Voxels::F64(vec![0.1]),
    ];
    let expected = [
        255.0,
        -128.0,
        65535.0,
        -32768.0,
        4294967295.0,
        -2147483648.0,
        f64::from(0.1f32),
        0.1,
    ];
    for (voxels, value) in all.into_iter().zip(expected) {
        assert_eq!(voxels.value(0), value, "{voxels:?}");
    }
}

#[test]
fn wrong_counts_are_refused_with_both_numbers() {
    let text = message([2, 2, 2], Voxels::U8(vec![0; 7]), DAffine3::IDENTITY);
    assert!(
        text.contains("need 8 voxels") && text.contains("there are 7"),
        "{text}"
    );
    let text = message([2, 0, 2], Voxels::U8(vec![]), DAffine3::IDENTITY);
    assert!(
        text.contains("2x0x2") && text.contains("at least 1"),
        "{text}"
    );
    let text = message([usize::MAX, 2, 1], Voxels::U8(vec![0]), DAffine3::IDENTITY);
    assert!(
        text.contains("more voxels than"),
        "the product must not wrap: {text}"
    );
}

#[test]
fn axes_must_span_space_at_any_scale() {
    let one = || Voxels::U8(vec![0]);
    for scale in [1e-30, 1.0, 1e30] {
        let map = DAffine3::from_scale(DVec3::new(scale, scale * 1e-3, scale * 1e3));
        assert!(
            Volume::new([1, 1, 1], one(), map).is_ok(),
            "orthogonal axes of scale {scale} are valid"
        );
    }
    let flat = DAffine3::from_mat3(DMat3::from_cols(
        DVec3::X,
        DVec3::new(1.0, 1e-9, 0.0),
        DVec3::Z,
    ));
    assert!(message([1, 1, 1], one(), flat).contains("one plane"));
    let zero = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    assert!(message([1, 1, 1], one(), zero).contains("axis 1 of the volume has length 0"));
    let nan = DAffine3::from_translation(DVec3::new(0.0, f64::NAN, 0.0));
    assert!(message([1, 1, 1], one(), nan).contains("not finite"));
    for tiny_or_huge in [1e-170, 1e200] {
        let map = DAffine3::from_scale(DVec3::splat(tiny_or_huge));
        assert!(
            Volume::new([1, 1, 1], one(), map).is_err(),
            "lengths that f64 cannot square are refused"
        );
    }
}

#[test]
fn the_first_nan_or_infinity_is_named() {
    let mut values = vec![0.0f32; 4 * 3 * 8];
    values[(7 * 3) * 4 + 3] = f32::NAN;
    let text = message([4, 3, 8], Voxels::F32(values.clone()), DAffine3::IDENTITY);
    assert_eq!(text, "voxel (3,0,7) is NaN: give --nan-as VALUE");
    values[5] = f32::NEG_INFINITY;
    let text = message([4, 3, 8], Voxels::F32(values), DAffine3::IDENTITY);
    assert!(text.starts_with("voxel (1,1,0) is infinite"), "{text}");
}

#[test]
fn replacement_reaches_nan_and_infinity_only() {
    let mut voxels = Voxels::F64(vec![1.0, f64::NAN, f64::INFINITY, -2.0]);
    voxels
        .replace_non_finite(-1.0)
        .expect("a finite replacement");
    assert_eq!(voxels, Voxels::F64(vec![1.0, -1.0, -1.0, -2.0]));
    let mut single = Voxels::F32(vec![f32::NAN]);
    assert!(
        single.replace_non_finite(1e300).is_err(),
        "1e300 is not finite as f32"
    );
    assert!(
        Voxels::F64(vec![f64::NAN])
            .replace_non_finite(f64::NAN)
            .is_err()
    );
}
