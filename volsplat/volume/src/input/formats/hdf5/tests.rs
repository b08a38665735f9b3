//! Files of the crates `hdf5-writer` and `netcdf-writer`, against the numbers that were put into them.

use glam::DVec3;
use hdf5_writer::{
    AttributeBuilder, DatasetBuilder, FILTER_DEFLATE, FilterDescription, H5WriteElement,
    Hdf5Builder, WriteOptions,
};
use netcdf_writer::{NcAttrValue, NcFileBuilder, NcWriteFormat, NcWriteOptions};

use crate::input::test_files::{Folder, check_components, survive_damage};
use crate::input::{Format, LoadOptions, arrays_of, axes_of, format_of, load};
use crate::volume::{Volume, Voxels};

/// 4 voxels along x, 3 along y, 2 along z.
const SHAPE: [u64; 3] = [2, 3, 4];

fn values() -> Vec<u16> {
    (0..24).map(|i| i * 7).collect()
}

fn array<T: H5WriteElement>(path: &str, shape: &[u64], values: &[T]) -> DatasetBuilder {
    DatasetBuilder::typed_data(path, shape.to_vec(), values).expect("as many values as elements")
}

fn file(datasets: Vec<DatasetBuilder>, groups: Vec<(&str, AttributeBuilder)>) -> Vec<u8> {
    let builder = Hdf5Builder::new();
    let builder = datasets.into_iter().fold(builder, Hdf5Builder::dataset);
    let builder = groups.into_iter().fold(builder, |builder, (path, value)| {
        builder.group_attribute(path, value)
    });
    let plan = builder.into_plan().expect("a good plan");
    plan.encode(WriteOptions::default()).expect("in memory")
}

fn loaded(bytes: &[u8], options: &LoadOptions) -> Volume {
    let path = Folder::new();
    let path = path.write("test.h5", &[bytes]);
    load(&path, options).unwrap_or_else(|error| panic!("{error}"))
}

/// Deflate, as `gzip` of h5py.
fn packed(array: DatasetBuilder, chunk: &[u64]) -> DatasetBuilder {
    array.chunked(chunk.to_vec()).filter(FilterDescription {
        id: FILTER_DEFLATE,
        name: None,
        client_data: vec![4],
    })
}

#[test]
fn the_last_axis_is_x_in_every_type() {
    macro_rules! check {
        ($kind:ident, $stored:ty, $held:ty) => {{
            let stored: Vec<$stored> = (0..24).map(|i| i as $stored).collect();
            for array in [
                array("a", &SHAPE, &stored),
                packed(array("inner/a", &SHAPE, &stored), &[1, 2, 3]),
            ] {
                let volume = loaded(&file(vec![array], vec![]), &LoadOptions::default());
                assert_eq!(volume.dims, [4, 3, 2]);
                let expected = (0..24).map(|i| i as $held).collect();
                assert_eq!(volume.voxels, Voxels::$kind(expected), stringify!($stored));
            }
        }};
    }
    check!(U8, u8, u8);
    check!(I8, i8, i8);
    check!(U16, u16, u16);
    check!(I16, i16, i16);
    check!(U32, u32, u32);
    check!(I32, i32, i32);
    check!(F64, u64, f64);
    check!(F64, i64, f64);
    check!(F32, f32, f32);
    check!(F64, f64, f64);
}

#[test]
fn the_largest_array_is_the_default_and_names_choose_others() {
    let small: Vec<u8> = vec![9; 8];
    let bytes = file(
        vec![
            array("few", &[2, 2, 2], &small),
            array("deep/er/many", &SHAPE, &values()),
            array("line", &[100], &[0u8; 100]),
        ],
        vec![],
    );
    let folder = Folder::new();
    let path = folder.write("test.h5", &[&bytes]);
    assert_eq!(format_of(&path).expect("readable"), Some(Format::Hdf5));
    let names = ["few", "deep/er/many"].map(str::to_owned).to_vec();
    let default = Some("deep/er/many".to_owned());
    assert_eq!(arrays_of(&path).expect("readable"), (names, default));
    let named = |name: &str| LoadOptions {
        array: Some(name.to_owned()),
        ..LoadOptions::default()
    };
    let many = load(&path, &LoadOptions::default()).expect("the largest");
    assert_eq!(many.voxels, Voxels::U16(values()));
    for name in ["deep/er/many", "/deep/er/many", "many"] {
        assert_eq!(load(&path, &named(name)).expect(name).voxels, many.voxels);
    }
    let few = load(&path, &named("few")).expect("the other");
    assert_eq!(few.voxels, Voxels::U8(small));
    let complaint = load(&path, &named("line")).expect_err("one axis");
    let complaint = complaint.to_string();
    assert!(complaint.contains("few, deep/er/many"), "{complaint}");
}

#[test]
fn axes_of_time_and_of_components_are_chosen() {
    let frames: Vec<u16> = (0..240).collect();
    let bytes = file(vec![array("film", &[2, 5, 6, 4], &frames)], vec![]);
    let folder = Folder::new();
    let path = folder.write("test.h5", &[&bytes]);
    let axes = axes_of(&path, &LoadOptions::default()).expect("readable");
    assert_eq!((axes.times, axes.channels.len()), (2, 1));
    let second = LoadOptions {
        time: Some(1),
        ..LoadOptions::default()
    };
    let second = load(&path, &second).expect("there are two");
    assert_eq!(second.voxels, Voxels::U16(frames[120..].to_vec()));
    // Three numbers behind three longer axes are a colour or a vector.
    let bytes = file(vec![array("field", &[5, 6, 8, 3], &[1u8; 720])], vec![]);
    let path = folder.write("vectors.h5", &[&bytes]);
    check_components(&path, &LoadOptions::default(), 3);
    let complaint = load(&path, &LoadOptions::default()).expect_err("three numbers a voxel");
    assert!(complaint.to_string().contains("component=N"), "{complaint}");
    let bytes = file(vec![array("many", &[2, 2, 5, 6, 8], &[1u8; 960])], vec![]);
    let complaint = folder.refusal(&[&bytes]);
    assert!(complaint.contains("three axes"), "{complaint}");
}

#[test]
fn sizes_of_elements_and_of_unsigned_and_scaled_numbers_are_those_of_the_file() {
    let sizes = AttributeBuilder::vector("element_size_um", &[2.0, 0.5, 0.25]);
    let array = array("a", &SHAPE, &values()).attribute(sizes.expect("three numbers"));
    let volume = loaded(&file(vec![array], vec![]), &LoadOptions::default());
    let spacing = volume.world_from_index.matrix3.to_cols_array();
    assert_eq!([spacing[0], spacing[4], spacing[8]], [0.25, 0.5, 2.0]);
    assert_eq!(volume.unit.as_deref(), Some("µm"));
}

#[test]
fn images_of_vtk_and_itk_lie_where_their_groups_say() {
    let numbers =
        |name: &str, values: &[f64]| AttributeBuilder::vector(name, values).expect("some");
    let facts = |name: &str| {
        file(
            vec![array(&format!("VTKHDF/{name}/a"), &SHAPE, &values())],
            vec![
                ("VTKHDF", numbers("Spacing", &[2.0, 3.0, 4.0])),
                ("VTKHDF", numbers("Origin", &[10.0, 20.0, 30.0])),
                (
                    "VTKHDF",
                    numbers("WholeExtent", &[1.0, 5.0, 0.0, 3.0, 0.0, 2.0]),
                ),
                (
                    "VTKHDF",
                    numbers("Direction", &[0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
                ),
            ],
        )
    };
    // x of the voxels runs along y, and y against x.
    for (name, first) in [
        ("PointData", DVec3::new(10.0, 22.0, 30.0)),
        ("CellData", DVec3::new(8.5, 23.0, 32.0)),
    ] {
        let volume = loaded(&facts(name), &LoadOptions::default());
        let map = volume.world_from_index;
        assert_eq!(map.translation, first, "{name}");
        assert_eq!(
            map.transform_vector3(DVec3::ONE),
            DVec3::new(-3.0, 2.0, 4.0)
        );
    }
    let place = "ITKImage/0";
    let itk = file(
        vec![
            array(&format!("{place}/VoxelData"), &SHAPE, &values()),
            array(&format!("{place}/Spacing"), &[3], &[2.0, 3.0, 4.0]),
            array(&format!("{place}/Origin"), &[3], &[10.0, 20.0, 30.0]),
            array(
                &format!("{place}/Directions"),
                &[3, 3],
                &[0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            ),
        ],
        vec![],
    );
    let volume = loaded(&itk, &LoadOptions::default());
    let map = volume.world_from_index;
    assert_eq!(
        map.transform_point3(DVec3::ONE),
        DVec3::new(7.0, 22.0, 34.0)
    );
    assert_eq!(volume.space.as_deref(), Some("left-posterior-superior"));
}

/// A grid of climate: longitudes, latitudes from the north, depths that grow downwards, and a field with a value that is missing.
fn climate(format: NcWriteFormat) -> Vec<u8> {
    let mut builder = NcFileBuilder::new();
    let mut axis = |name: &str, size: u64| builder.add_dimension(name, size).expect("a new name");
    let [time, depth, lat, lon] = [
        axis("time", 2),
        axis("depth", 3),
        axis("lat", 4),
        axis("lon", 5),
    ];
    let mut coordinate = |name: &str, axis, places: &[f64], facts: &[(&str, &str)]| {
        let array = builder
            .add_variable::<f64>(name, &[axis])
            .expect("a new name");
        for (name, text) in facts {
            let text = NcAttrValue::Chars((*text).to_owned());
            builder
                .add_variable_attribute(array, *name, text)
                .expect("a new name");
        }
        builder.write_variable(array, places).expect("as many");
    };
    coordinate(
        "time",
        time,
        &[0.0, 6.0],
        &[("units", "hours since 2000-01-01")],
    );
    let down = [("units", "m"), ("positive", "down")];
    coordinate("depth", depth, &[0.0, 10.0, 30.0], &down);
    coordinate(
        "lat",
        lat,
        &[60.0, 59.5, 59.0, 58.5],
        &[("units", "degrees")],
    );
    coordinate(
        "lon",
        lon,
        &[10.0, 10.5, 11.0, 11.5, 12.0],
        &[("units", "degrees")],
    );
    let field = builder
        .add_variable::<i16>("salt", &[time, depth, lat, lon])
        .expect("a new name");
    for (name, value) in [
        ("scale_factor", NcAttrValue::Doubles(vec![0.5])),
        ("add_offset", NcAttrValue::Doubles(vec![30.0])),
        ("missing_value", NcAttrValue::Shorts(vec![-999])),
    ] {
        builder
            .add_variable_attribute(field, name, value)
            .expect("a new name");
    }
    let stored: Vec<i16> = (0..120).map(|i| if i == 61 { -999 } else { i }).collect();
    builder.write_variable(field, &stored).expect("as many");
    let written = builder.to_vec(NcWriteOptions { format });
    written.expect("in memory").1
}

#[test]
fn coordinates_offsets_and_missing_values_follow_the_conventions_of_climate() {
    for (format, expected) in [
        (NcWriteFormat::Classic, Format::NetCdf),
        (NcWriteFormat::Offset64, Format::NetCdf),
        (NcWriteFormat::Cdf5, Format::NetCdf),
        (NcWriteFormat::Nc4, Format::Hdf5),
    ] {
        let folder = Folder::new();
        let path = folder.write("test.nc", &[&climate(format)]);
        assert_eq!(format_of(&path).expect("readable"), Some(expected));
        let axes = axes_of(&path, &LoadOptions::default()).expect("readable");
        assert_eq!(axes.times, 2, "{format:?}");
        let options = LoadOptions {
            time: Some(1),
            ..LoadOptions::default()
        };
        let volume = load(&path, &options).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(volume.dims, [5, 4, 3]);
        // 60 is the first of the second time, and the missing element has the least of the others.
        let real = (0..60).map(|i| if i == 1 { 0 } else { i });
        let real = real.map(|i| 30.0 + 0.5 * (60 + i) as f32);
        assert_eq!(volume.voxels, Voxels::F32(real.collect()), "{format:?}");
        let map = volume.world_from_index;
        assert_eq!(map.matrix3.x_axis, DVec3::new(0.5, 0.0, 0.0));
        assert_eq!(map.matrix3.y_axis, DVec3::new(0.0, -0.5, 0.0));
        // Metres beside degrees: as long as the others, and downwards.
        assert_eq!(map.matrix3.z_axis, DVec3::new(0.0, 0.0, -0.5));
        assert_eq!(map.translation, DVec3::new(10.0, 60.0, 0.0));
        assert_eq!(
            (volume.up_hint, volume.unit.as_deref()),
            (Some(DVec3::Z), None)
        );
        let remarks = options.gate.remarks().join("\n");
        for part in [
            "uneven steps, 0.67 to 1.33",
            "unit m, the others degrees",
            "1 of 60",
        ] {
            assert!(remarks.contains(part), "{remarks}");
        }
    }
}

fn text(name: &str, value: &str) -> AttributeBuilder {
    // Letter by letter, as Imaris stores it.
    let letters: Vec<String> = value.chars().map(String::from).collect();
    AttributeBuilder::fixed_string_vector(name, &letters).expect("letters")
}

/// Two channels at two times in two levels, each padded by a slice.
fn imaris() -> Vec<u8> {
    let mut datasets = Vec::new();
    let mut groups = Vec::new();
    let mut places = Vec::new();
    for level in 0..2u16 {
        for time in 0..2u16 {
            for channel in 0..2u16 {
                let place =
                    format!("DataSet/ResolutionLevel {level}/TimePoint {time}/Channel {channel}");
                let first = 1000 * level + 100 * time + 50 * channel;
                let shape = [3, 3 - u64::from(level), 4];
                let count = shape.iter().product::<u64>() as u16;
                let padded: Vec<u16> = (0..count).map(|i| first + i).collect();
                datasets.push(packed(
                    array(&format!("{place}/Data"), &shape, &padded),
                    &[3, 2, 2],
                ));
                places.push((
                    place,
                    ["2".to_owned(), shape[1].to_string(), "4".to_owned()],
                ));
            }
        }
    }
    for (place, sizes) in &places {
        for (axis, size) in ["Z", "Y", "X"].iter().zip(sizes) {
            groups.push((place.as_str(), text(&format!("ImageSize{axis}"), size)));
        }
    }
    for (name, value) in [
        ("ExtMin0", "10"),
        ("ExtMax0", "12"),
        ("ExtMin1", "0"),
        ("ExtMax1", "3"),
        ("ExtMin2", "-4"),
        ("ExtMax2", "4"),
        ("Unit", "um"),
    ] {
        groups.push(("DataSetInfo/Image", text(name, value)));
    }
    groups.push(("DataSetInfo/Channel 0", text("Name", "DAPI")));
    groups.push(("DataSetInfo/Channel 0", text("Color", "0.0 0.5 1.0")));
    groups.push(("DataSetInfo/Channel 0", text("ColorRange", "10 200")));
    groups.push(("DataSetInfo/Channel 1", text("Name", "GFP")));
    file(datasets, groups)
}

#[test]
fn imaris_has_levels_times_and_channels() {
    let bytes = imaris();
    let folder = Folder::new();
    let path = folder.write("test.ims", &[&bytes]);
    let axes = axes_of(&path, &LoadOptions::default()).expect("readable");
    assert_eq!(
        (axes.times, axes.numbered_names()),
        (2, "0 DAPI, 1 GFP".to_owned())
    );
    assert_eq!(axes.channels[0].rgb, Some([0, 128, 255]));
    assert_eq!(axes.channels[0].window, Some([10.0, 200.0]));
    assert!(arrays_of(&path).expect("readable").0.is_empty());
    check_components(&path, &LoadOptions::default(), 2);
    let chosen = |level, time, component| LoadOptions {
        level: Some(level),
        time: Some(time),
        component: Some(component),
        ..LoadOptions::default()
    };
    let volume = load(&path, &chosen(0, 1, 1)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(volume.dims, [4, 3, 2]);
    assert_eq!(volume.voxels, Voxels::U16((150..174).collect()));
    assert_eq!(volume.unit.as_deref(), Some("µm"));
    let map = volume.world_from_index;
    assert_eq!(
        map.transform_point3(DVec3::ZERO),
        DVec3::new(10.25, 0.5, -2.0)
    );
    assert_eq!(
        map.transform_point3(DVec3::ONE),
        DVec3::new(10.75, 1.5, 2.0)
    );
    let coarse = load(&path, &chosen(1, 0, 0)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(coarse.voxels, Voxels::U16((1000..1016).collect()));
    for (options, part) in [
        (chosen(2, 0, 0), "level=2: the image has 2"),
        (chosen(0, 2, 0), "time=2: the image has 2"),
        (chosen(0, 0, 2), "component=2: the image has 2"),
        (LoadOptions::default(), "0 DAPI, 1 GFP"),
    ] {
        let complaint = load(&path, &options).expect_err(part).to_string();
        assert!(complaint.contains(part), "{complaint}");
    }
}

#[test]
fn minc_scales_each_slice_and_lies_in_the_world() {
    let string = AttributeBuilder::fixed_string;
    let number = |name, value: f64| AttributeBuilder::scalar(name, value).expect("a number");
    let numbers = |name, values: &[f64]| AttributeBuilder::vector(name, values).expect("numbers");
    let image = array("minc-2.0/image/0/image", &SHAPE, &values())
        .attribute(string("dimorder", "zspace,xspace,yspace"))
        .attribute(numbers("valid_range", &[0.0, 100.0]));
    let axis = |name: &str, start: f64, step: f64, direction: &[f64]| {
        array(&format!("minc-2.0/dimensions/{name}"), &[1], &[0.0f64])
            .attribute(number("start", start))
            .attribute(number("step", step))
            .attribute(numbers("direction_cosines", direction))
    };
    let ends =
        |name: &str, values: &[f64]| array(&format!("minc-2.0/image/0/{name}"), &[2], values);
    let bytes = file(
        vec![
            image,
            axis("xspace", 5.0, -2.0, &[1.0, 0.0, 0.0]),
            axis("yspace", 7.0, 3.0, &[0.0, 0.6, 0.8]),
            axis("zspace", 1.0, 4.0, &[0.0, -0.8, 0.6]),
            ends("image-min", &[0.0, 1.0]),
            ends("image-max", &[10.0, 2.0]),
        ],
        vec![],
    );
    let volume = loaded(&bytes, &LoadOptions::default());
    assert_eq!(volume.dims, [4, 3, 2]);
    let real = |i: usize, stored: u16| match i {
        0..12 => f64::from(stored) / 10.0,
        _ => 1.0 + f64::from(stored) / 100.0,
    };
    for (i, stored) in values().into_iter().enumerate() {
        assert!(
            (volume.voxels.value(i) - real(i, stored)).abs() < 1e-6,
            "{i}"
        );
    }
    // y is the last axis of the file, and therefore the first of the voxels.
    let map = volume.world_from_index;
    let expected = [
        DVec3::new(0.0, 1.8, 2.4),
        DVec3::new(-2.0, 0.0, 0.0),
        DVec3::new(0.0, -3.2, 2.4),
    ];
    for (axis, expected) in expected.into_iter().enumerate() {
        assert!(map.matrix3.col(axis).distance(expected) < 1e-12);
    }
    let first = DVec3::new(5.0, 7.0 * 0.6 - 0.8, 7.0 * 0.8 + 0.6);
    assert!(map.translation.distance(first) < 1e-12);
    assert_eq!(volume.space.as_deref(), Some("right-anterior-superior"));
}

#[test]
fn damage_is_survived() {
    let options = LoadOptions {
        component: Some(1),
        ..LoadOptions::default()
    };
    survive_damage(&imaris(), &options, 300);
    for format in [NcWriteFormat::Classic, NcWriteFormat::Nc4] {
        survive_damage(&climate(format), &LoadOptions::default(), 300);
    }
}
