//! NIfTI: small files of both versions, byte orders and forms, of one volume and of several, written here and read back.

use crate::Error;
use crate::input::test_files::{Folder, check_components, gzip, survive_damage};
use crate::input::{Format, LoadOptions, format_of, load};
use crate::volume::{Volume, Voxels};

/// Code, expected voxels, and their bytes in either order.
fn samples() -> Vec<(i16, Voxels, Vec<u8>, Vec<u8>)> {
    macro_rules! sample {
        ($code:expr, $kind:ident, $held:ty, $values:expr, $stored:ty) => {{
            let values: [$stored; 4] = $values;
            let little = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            let big = values.iter().flat_map(|v| v.to_be_bytes()).collect();
            (
                $code,
                Voxels::$kind(values.iter().map(|&v| v as $held).collect()),
                little,
                big,
            )
        }};
    }
    vec![
        sample!(2, U8, u8, [0, 1, 200, 255], u8),
        sample!(256, I8, i8, [0, 1, -128, 127], i8),
        sample!(512, U16, u16, [0, 1, 258, 65535], u16),
        sample!(4, I16, i16, [0, -2, 258, -32768], i16),
        sample!(768, U32, u32, [0, 1, 0x0102_0304, u32::MAX], u32),
        sample!(8, I32, i32, [0, -1, 0x0102_0304, i32::MIN], i32),
        sample!(1280, F64, f64, [0, 1, 1 << 53, u64::MAX], u64),
        sample!(1024, F64, f64, [0, -1, 1 << 53, i64::MIN], i64),
        sample!(16, F32, f32, [0.0, -1.5, 1e-42, 3e38], f32),
        sample!(64, F64, f64, [0.0, -1.5, 1e-310, 3e300], f64),
    ]
}

#[test]
fn every_type_order_version_and_packing_reads_back() {
    let folder = Folder::new();
    for (datatype, expected, little, big) in samples() {
        for (version, is_big) in [(1, false), (1, true), (2, false), (2, true)] {
            let fields = Fields {
                is_big,
                ..Fields::new(version, datatype)
            };
            let file = [
                fields.bytes(),
                if is_big { big.clone() } else { little.clone() },
            ]
            .concat();
            for file in [gzip(&file), file] {
                let volume = folder
                    .load(&[&file])
                    .unwrap_or_else(|error| panic!("{datatype}: {error}"));
                assert_eq!(
                    (volume.dims, &volume.voxels),
                    ([2, 1, 2], &expected),
                    "{datatype}, version {version}"
                );
            }
        }
    }
}

#[test]
fn pairs_are_found_from_either_file() {
    for version in [1, 2] {
        let folder = Folder::new();
        let fields = Fields {
            is_pair: true,
            vox_offset: 3.0,
            ..Fields::new(version, 2)
        };
        let header = folder.write("brain.hdr", &[&fields.bytes()]);
        let absent = load(&header, &LoadOptions::default())
            .expect_err("no image")
            .to_string();
        assert!(absent.contains("brain.img"), "{absent}");
        folder.write("brain.img.gz", &[&gzip(&[9, 9, 9, 1, 2, 3, 4])]);
        let volume = load(&header, &LoadOptions::default()).expect("packed image");
        assert_eq!(volume.voxels, Voxels::U8(vec![1, 2, 3, 4]));
        let image = folder.write("brain.img", &[&[9, 9, 9, 5, 6, 7, 8]]);
        let volume = load(&image, &LoadOptions::default()).expect("from the image");
        assert_eq!(volume.voxels, Voxels::U8(vec![5, 6, 7, 8]));
    }
}

#[test]
fn offset_and_extensions_are_passed_over() {
    let fields = Fields {
        vox_offset: 368.0,
        ..Fields::new(1, 2)
    };
    let volume = fields.load(&[[7; 16].as_slice(), &[1, 2, 3, 4]].concat());
    assert_eq!(volume.voxels, Voxels::U8(vec![1, 2, 3, 4]));
    let zero = Fields {
        vox_offset: 0.0,
        ..Fields::new(1, 2)
    };
    assert_eq!(
        zero.load(&[1, 2, 3, 4]).voxels,
        Voxels::U8(vec![1, 2, 3, 4]),
        "0 means behind the header"
    );
    let inside = Fields {
        vox_offset: 100.0,
        ..Fields::new(1, 2)
    };
    assert!(inside.refusal(&[1, 2, 3, 4]).contains("inside the header"));
    let beyond = Fields {
        vox_offset: 1e6,
        ..Fields::new(1, 2)
    };
    assert!(beyond.refusal(&[1, 2, 3, 4]).contains("behind the end"));
}

#[test]
fn slope_and_intercept_apply_unless_the_slope_is_0() {
    let of = |slope, inter| {
        Fields {
            slope,
            inter,
            ..Fields::new(1, 2)
        }
        .load(&[0, 1, 2, 3])
        .voxels
    };
    assert_eq!(of(0.5, 1.0), Voxels::F32(vec![1.0, 1.5, 2.0, 2.5]));
    assert_eq!(of(0.0, 7.0), Voxels::U8(vec![0, 1, 2, 3]), "0 means none");
    assert_eq!(
        of(f64::NAN, 7.0),
        Voxels::U8(vec![0, 1, 2, 3]),
        "NaN means none"
    );
    assert_eq!(
        of(1.0, -1024.0),
        Voxels::I16(vec![-1024, -1023, -1022, -1021])
    );
}

#[test]
fn the_window_of_the_file_is_kept_where_it_has_one() {
    for version in [1, 2] {
        let of = |window| {
            let fields = Fields {
                window,
                ..Fields::new(version, 2)
            };
            fields.load(&[0, 1, 2, 3]).window
        };
        assert_eq!(of([0.5, 2.0]), Some([0.5, 2.0]));
        assert_eq!(of([0.0, 0.0]), None);
        assert_eq!(of([2.0, 0.5]), None);
        assert_eq!(of([f64::NEG_INFINITY, 0.5]), None);
    }
}

#[test]
fn the_matrix_wins_over_the_turn_and_the_turn_over_the_spacing() {
    let srow = [
        0.0, -2.0, 0.0, 10.0, 1.5, 0.0, 0.0, 20.0, 0.0, 0.0, 3.0, 30.0,
    ];
    // A quarter turn around z: x goes to y.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let quaternion = [0.0, 0.0, half, 1.0, 2.0, 3.0];
    for version in [1, 2] {
        let of = |codes, first| {
            let mut fields = Fields {
                codes,
                quaternion,
                srow,
                ..Fields::new(version, 2)
            };
            fields.pixdim[0] = first;
            fields.load(&[0; 4])
        };
        let close = |got: glam::DVec3, wanted: [f64; 3]| {
            assert!(
                (got - glam::DVec3::from_array(wanted)).length() < 1e-6,
                "{got}, expected {wanted:?}"
            );
        };
        let volume = of([1, 1], 1.0);
        close(volume.world_from_index.matrix3.x_axis, [0.0, 1.5, 0.0]);
        close(volume.world_from_index.matrix3.y_axis, [-2.0, 0.0, 0.0]);
        close(volume.world_from_index.translation, [10.0, 20.0, 30.0]);
        let turned = of([1, 0], 1.0).world_from_index;
        close(turned.matrix3.x_axis, [0.0, 2.0, 0.0]);
        close(turned.matrix3.y_axis, [-3.0, 0.0, 0.0]);
        close(turned.matrix3.z_axis, [0.0, 0.0, 4.0]);
        close(turned.translation, [1.0, 2.0, 3.0]);
        close(
            of([1, 0], -1.0).world_from_index.matrix3.z_axis,
            [0.0, 0.0, -4.0],
        );
        let plain = of([0, 0], 1.0);
        assert_eq!(
            (plain.spacing(), plain.world_from_index.translation),
            ([2.0, 3.0, 4.0], glam::DVec3::ZERO)
        );
        assert_eq!(plain.up_hint, Some(glam::DVec3::Z), "the head is up");
    }
}

#[test]
fn what_is_no_scalar_is_refused_by_name() {
    for (datatype, named) in [
        (1, "bits"),
        (32, "complex"),
        (1792, "complex"),
        (1536, "128 bits"),
    ] {
        let fields = Fields::new(1, datatype);
        let error = Folder::new()
            .load(&[&fields.bytes(), &[0; 64]])
            .expect_err("no scalar");
        assert!(
            matches!(error, Error::Unsupported { .. }) && error.to_string().contains(named),
            "{error}"
        );
    }
    assert!(Fields::new(1, 77).refusal(&[0; 64]).contains("datatype 77"));
}

#[test]
fn wrong_lengths_and_forged_sizes_are_refused_before_memory_is_taken() {
    let folder = Folder::new();
    let fields = Fields::new(1, 4);
    assert!(
        fields
            .refusal(&[0; 7])
            .contains("which are 8 bytes, but 7 are there")
    );
    assert!(
        fields
            .refusal(&[0; 9])
            .contains("which are 8 bytes, but 9 are there")
    );
    let huge = Fields {
        dim: [3, 30_000, 30_000, 30_000, 0, 0, 0, 0],
        ..fields
    }
    .bytes();
    assert!(
        folder
            .refusal(&[&huge, &[0; 9]])
            .contains("54000000000000 bytes")
    );
    assert!(folder.refusal(&[&gzip(&huge)]).contains("at most"));
    let overflow = Fields {
        dim: [3, i64::MAX, i64::MAX, 2, 0, 0, 0, 0],
        ..Fields::new(2, 2)
    };
    assert!(overflow.refusal(&[0; 4]).contains("more voxels than"));
    let text = Fields {
        dim: [3, 2, -1, 2, 0, 0, 0, 0],
        ..fields
    }
    .refusal(&[0; 4]);
    assert!(text.contains("dim[2] is -1"), "{text}");
    assert!(
        Fields {
            dim: [9, 2, 1, 2, 0, 0, 0, 0],
            ..fields
        }
        .refusal(&[0; 4])
        .contains("dim[0]")
    );
    let cut = gzip(&[fields.bytes(), vec![0; 8]].concat());
    assert!(
        !folder.refusal(&[&cut[..cut.len() - 9]]).is_empty(),
        "a cut stream must be refused"
    );
}

#[test]
fn the_format_is_told_by_content_also_when_packed() {
    let folder = Folder::new();
    let file = [Fields::new(2, 2).bytes(), vec![0; 4]].concat();
    for file in [gzip(&file), file] {
        assert_eq!(
            format_of(&folder.write("x", &[&file])).expect("readable"),
            Some(Format::Nifti)
        );
    }
    let text = folder.refusal(&[&gzip(b"something else")]);
    assert!(text.contains("gzip"), "{text}");
    let mut analyze = Fields::new(1, 2).bytes();
    analyze[344..348].fill(0);
    assert!(folder.refusal(&[&analyze, &[0; 4]]).contains("ANALYZE"));
    let mut options = LoadOptions {
        raw: None,
        ..LoadOptions::default()
    };
    options.level = Some(0);
    let path = folder.write("y", &[&Fields::new(1, 2).bytes(), &[0; 4]]);
    let text = load(&path, &options).expect_err("superfluous").to_string();
    assert!(
        text.contains("level does not apply to NIfTI") && text.contains("NIfTI"),
        "{text}"
    );
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    let fields = Fields {
        codes: [1, 0],
        slope: 2.0,
        ..Fields::new(1, 4)
    };
    let file = [fields.bytes(), (0..8).collect()].concat();
    survive_damage(&file, &LoadOptions::default(), 1000);
    survive_damage(&gzip(&file), &LoadOptions::default(), 1000);
    let file = [
        Fields {
            codes: [0, 1],
            ..Fields::new(2, 4)
        }
        .bytes(),
        (0..8).collect(),
    ]
    .concat();
    survive_damage(&file, &LoadOptions::default(), 1000);
}

/// The fields of a header that a test changes; the image has 2x1x2 voxels unless it says otherwise.
#[derive(Clone, Copy)]
pub(crate) struct Fields {
    pub(crate) version: u8,
    pub(crate) is_big: bool,
    pub(crate) dim: [i64; 8],
    pub(crate) datatype: i16,
    pub(crate) pixdim: [f64; 8],
    pub(crate) vox_offset: f64,
    pub(crate) slope: f64,
    inter: f64,
    /// cal_min and cal_max.
    window: [f64; 2],
    codes: [i16; 2],
    pub(crate) quaternion: [f64; 6],
    pub(crate) srow: [f64; 12],
    is_pair: bool,
}

impl Fields {
    pub(crate) fn new(version: u8, datatype: i16) -> Self {
        Self {
            version,
            is_big: false,
            dim: [3, 2, 1, 2, 0, 0, 0, 0],
            datatype,
            pixdim: [1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0],
            vox_offset: if version == 1 { 352.0 } else { 544.0 },
            slope: 0.0,
            inter: 0.0,
            window: [0.0; 2],
            codes: [0, 0],
            quaternion: [0.0; 6],
            srow: [0.0; 12],
            is_pair: false,
        }
    }

    /// The header and the four bytes that say that no extension follows.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let length: usize = if self.version == 1 { 348 } else { 540 };
        let mut head = Head {
            bytes: vec![0; length + 4],
            is_big: self.is_big,
        };
        head.put(0, &(length as u32).to_be_bytes());
        let (kind, version) = (if self.is_pair { b'i' } else { b'+' }, b'0' + self.version);
        let mark = [b'n', kind, version, 0];
        if self.version == 1 {
            head.bytes[344..348].copy_from_slice(&mark);
            head.bytes[38] = b'r';
            (0..8).for_each(|axis| head.put(40 + 2 * axis, &(self.dim[axis] as i16).to_be_bytes()));
            head.put(70, &self.datatype.to_be_bytes());
            head.floats(76, &self.pixdim);
            head.floats(108, &[self.vox_offset, self.slope, self.inter]);
            head.floats(124, &[self.window[1], self.window[0]]);
            head.put(252, &self.codes[0].to_be_bytes());
            head.put(254, &self.codes[1].to_be_bytes());
            head.floats(256, &self.quaternion);
            head.floats(280, &self.srow);
        } else {
            head.bytes[4..8].copy_from_slice(&mark);
            head.bytes[8..12].copy_from_slice(b"\r\n\x1a\n");
            head.put(12, &self.datatype.to_be_bytes());
            (0..8).for_each(|axis| head.put(16 + 8 * axis, &self.dim[axis].to_be_bytes()));
            head.doubles(104, &self.pixdim);
            head.put(168, &(self.vox_offset as i64).to_be_bytes());
            head.doubles(
                176,
                &[self.slope, self.inter, self.window[1], self.window[0]],
            );
            head.put(344, &i32::from(self.codes[0]).to_be_bytes());
            head.put(348, &i32::from(self.codes[1]).to_be_bytes());
            head.doubles(352, &self.quaternion);
            head.doubles(400, &self.srow);
        }
        head.bytes
    }

    pub(crate) fn load(&self, data: &[u8]) -> Volume {
        Folder::new()
            .load(&[&self.bytes(), data])
            .unwrap_or_else(|error| panic!("{error}"))
    }

    pub(crate) fn refusal(&self, data: &[u8]) -> String {
        Folder::new().refusal(&[&self.bytes(), data])
    }
}

struct Head {
    bytes: Vec<u8>,
    is_big: bool,
}

impl Head {
    /// Writes a number given most significant byte first.
    fn put(&mut self, at: usize, number: &[u8]) {
        let mut number = number.to_vec();
        if !self.is_big {
            number.reverse();
        }
        self.bytes[at..at + number.len()].copy_from_slice(&number);
    }

    fn floats(&mut self, at: usize, values: &[f64]) {
        values
            .iter()
            .enumerate()
            .for_each(|(i, &v)| self.put(at + 4 * i, &(v as f32).to_be_bytes()));
    }

    fn doubles(&mut self, at: usize, values: &[f64]) {
        values
            .iter()
            .enumerate()
            .for_each(|(i, &v)| self.put(at + 8 * i, &v.to_be_bytes()));
    }
}

#[test]
fn a_time_is_chosen_or_the_first_is_read_with_a_remark() {
    let folder = Folder::new();
    // Twelve bytes: three times of 2x1x2 voxels.
    let series = Fields {
        dim: [4, 2, 1, 2, 3, 0, 0, 0],
        ..Fields::new(1, 2)
    };
    let file = [series.bytes(), (0..12).collect()].concat();
    for (name, file) in [("a", file.clone()), ("b", gzip(&file))] {
        let path = folder.write(name, &[&file]);
        let at = |time| LoadOptions {
            time,
            ..LoadOptions::default()
        };
        for (time, first) in [(None, 0), (Some(0), 0), (Some(1), 4), (Some(2), 8)] {
            let options = at(time);
            let volume = load(&path, &options).expect("a good file");
            let expected: Vec<u8> = (first..first + 4).collect();
            assert_eq!(volume.voxels, Voxels::U8(expected), "time {time:?}");
            let remarks = options.gate.remarks();
            assert_eq!(remarks.len(), usize::from(time.is_none()), "{remarks:?}");
            assert!(remarks.iter().all(|remark| remark.contains("#time=N")));
        }
        let text = load(&path, &at(Some(3))).expect_err("beyond").to_string();
        assert!(text.contains("time=3: the file holds 3"), "{text}");
    }
    let cut = series.refusal(&[0; 11]);
    assert!(
        cut.contains("in 3 volumes, which are 12 bytes, but 11 are there"),
        "{cut}"
    );
    let huge = Fields {
        dim: [5, 2, 1, 2, i64::MAX, i64::MAX, 0, 0],
        ..Fields::new(2, 2)
    };
    assert!(!huge.refusal(&[0; 4]).is_empty());
    let six = Fields {
        dim: [6, 1, 1, 1, 1, 1, 4, 0],
        ..Fields::new(1, 2)
    };
    assert!(six.refusal(&[0; 4]).contains("dim[6] is 4"));
    let one = Fields {
        dim: [4, 2, 1, 2, 1, 0, 0, 0],
        ..Fields::new(1, 2)
    };
    assert_eq!(one.load(&[1, 2, 3, 4]).dims, [2, 1, 2]);
    let flat = Fields {
        dim: [2, 2, 2, 0, 0, 0, 0, 0],
        ..Fields::new(1, 2)
    };
    assert_eq!(flat.load(&[1, 2, 3, 4]).dims, [2, 2, 1]);
}

#[test]
fn colours_and_vectors_have_components() {
    let folder = Folder::new();
    let component = |component| LoadOptions {
        component: Some(component),
        ..LoadOptions::default()
    };
    for (datatype, colours) in [(128, 3), (2304, 4)] {
        let file = [Fields::new(1, datatype).bytes(), (0..4 * colours).collect()].concat();
        let path = folder.write("colours", &[&file]);
        for chosen in 0..colours {
            let volume = load(&path, &component(usize::from(chosen))).expect("a good file");
            let expected: Vec<u8> = (0..4).map(|voxel| voxel * colours + chosen).collect();
            assert_eq!(volume.voxels, Voxels::U8(expected), "colour {chosen}");
        }
        check_components(&path, &LoadOptions::default(), usize::from(colours));
        let text = load(&path, &LoadOptions::default())
            .expect_err("several")
            .to_string();
        assert!(text.contains("component=N"), "{text}");
    }
    let vectors = Fields {
        dim: [5, 2, 1, 2, 1, 3, 0, 0],
        ..Fields::new(1, 2)
    };
    let path = folder.write(
        "vectors",
        &[&vectors.bytes(), &(0..12).collect::<Vec<u8>>()],
    );
    check_components(&path, &LoadOptions::default(), 3);
    let volume = load(&path, &component(2)).expect("a good file");
    assert_eq!(
        volume.voxels,
        Voxels::U8(vec![8, 9, 10, 11]),
        "one behind the other"
    );
}

#[test]
fn a_quaternion_of_four_parts_turns_as_it_should() {
    // About an axis between all three, where every term of the matrix counts, and by half a turn, whose real part is 0.
    for (axis, angle) in [
        (glam::DVec3::new(0.3, -0.5, 0.8), 1.1),
        (glam::DVec3::new(-0.7, 0.2, 0.4), 2.9),
        (glam::DVec3::new(0.6, 0.0, 0.8), std::f64::consts::PI),
    ] {
        let turn = glam::DQuat::from_axis_angle(axis.normalize(), angle);
        let found = super::rotation([turn.x, turn.y, turn.z]);
        assert!(
            found.abs_diff_eq(glam::DMat3::from_quat(turn), 1e-7),
            "{axis} by {angle}: {found}"
        );
    }
    // A stored part that rounding has made longer than 1 is a half turn.
    let long = super::rotation([0.0, 0.0, 1.0 + 1e-7]);
    let half = glam::DMat3::from_diagonal(glam::DVec3::new(-1.0, -1.0, 1.0));
    assert!(long.abs_diff_eq(half, 1e-12), "{long}");
}
