//! Small volumes in files of arrays: HDF5, NetCDF, Amira's grids, cubes of quantum chemistry, GIPL.

use hdf5_writer::{
    AttributeBuilder, DatasetBuilder, FILTER_DEFLATE, FilterDescription, Hdf5Builder, WriteOptions,
};
use netcdf_writer::{NcAttrValue, NcFileBuilder, NcWriteFormat, NcWriteOptions};

use super::Seed;
use super::binary::zlib;

const SHAPE: [u64; 3] = [4, 3, 2];

fn bytes() -> Vec<u8> {
    (0..24).collect()
}

pub(super) fn files() -> Vec<Seed> {
    let packed = zlib(&bytes());
    let zipped = format!("(HxZip,{})", packed.len());
    vec![
        ("hdf5", hdf5()),
        ("imaris", imaris()),
        ("netcdf", netcdf(NcWriteFormat::Classic)),
        ("netcdf4", netcdf(NcWriteFormat::Nc4)),
        ("amira", amira("", &bytes())),
        ("amira.zip", amira(&zipped, &packed)),
        ("amira.runs", amira("(HxByteRLE,2)", &[24, 7])),
        ("cube", cube()),
        ("gipl", gipl()),
    ]
}

fn array(name: &str) -> DatasetBuilder {
    let array = DatasetBuilder::typed_data(name, SHAPE.to_vec(), &bytes()).expect("24 values");
    array.chunked(vec![2, 2, 2]).filter(FilterDescription {
        id: FILTER_DEFLATE,
        name: None,
        client_data: vec![1],
    })
}

fn encoded(builder: Hdf5Builder) -> Vec<u8> {
    let plan = builder.into_plan().expect("a good plan");
    plan.encode(WriteOptions::default()).expect("in memory")
}

fn hdf5() -> Vec<u8> {
    let sizes = AttributeBuilder::vector("element_size_um", &[2.0, 1.0, 0.5]).expect("numbers");
    encoded(Hdf5Builder::new().dataset(array("group/volume").attribute(sizes)))
}

fn imaris() -> Vec<u8> {
    let text = AttributeBuilder::fixed_string;
    let place = "DataSet/ResolutionLevel 0/TimePoint 0/Channel 0";
    let builder = Hdf5Builder::new()
        .dataset(array(&format!("{place}/Data")))
        .group_attribute(place, text("ImageSizeX", "2"))
        .group_attribute("DataSetInfo/Image", text("ExtMax0", "5"))
        .group_attribute("DataSetInfo/Image", text("Unit", "um"))
        .group_attribute("DataSetInfo/Channel 0", text("Color", "1 0 0"));
    encoded(builder)
}

fn netcdf(format: NcWriteFormat) -> Vec<u8> {
    let mut builder = NcFileBuilder::new();
    let axes = ["z", "y", "x"].iter().zip(SHAPE);
    let axes = axes.map(|(name, size)| builder.add_dimension(*name, size).expect("a new name"));
    let axes: Vec<_> = axes.collect();
    let places = builder.add_variable::<f64>("x", &axes[2..]);
    let places = places.expect("a new name");
    let field = builder.add_variable::<i16>("T", &axes).expect("a new name");
    builder.write_variable(places, &[1.0, 1.5]).expect("two");
    let fill = NcAttrValue::Shorts(vec![3]);
    let named = builder.add_variable_attribute(field, "missing_value", fill);
    named.expect("a new name");
    let values: Vec<i16> = bytes().into_iter().map(i16::from).collect();
    builder.write_variable(field, &values).expect("24 values");
    let written = builder.to_vec(NcWriteOptions { format });
    written.expect("in memory").1
}

fn amira(packing: &str, data: &[u8]) -> Vec<u8> {
    let head = format!(
        "# AmiraMesh BINARY-LITTLE-ENDIAN 2.1\n\ndefine Lattice 2 3 4\n\nParameters {{\n    BoundingBox 0 1 0 2 0 3,\n    \
         CoordType \"uniform\"\n}}\n\nLattice {{ byte Data }} @1{packing}\n\n# Data section follows\n@1\n"
    );
    [head.as_bytes(), data, b"\n"].concat()
}

fn cube() -> Vec<u8> {
    let values: Vec<String> = bytes().iter().map(|byte| format!("{byte}.5E-01")).collect();
    format!(
        "a\nb\n1 0.0 0.0 0.0\n4 1.0 0.0 0.0\n3 0.0 1.0 0.0\n2 0.0 0.0 1.0\n8 8.0 0.0 0.0 0.0\n{}\n",
        values.join(" ")
    )
    .into_bytes()
}

fn gipl() -> Vec<u8> {
    let mut file = vec![0; 256];
    let sizes = [2u16, 3, 4].map(u16::to_be_bytes).concat();
    file[..6].copy_from_slice(&sizes);
    file[8..10].copy_from_slice(&8u16.to_be_bytes());
    file[10..22].copy_from_slice(&[1.0f32; 3].map(f32::to_be_bytes).concat());
    file[252..].copy_from_slice(&0xefff_e9b0u32.to_be_bytes());
    [file, bytes()].concat()
}
