//! Compressed geometry and pictures in documents: streams that Google's Draco 1.5.7 and meshoptimizer 1.3.0 wrote of a grid made here.

use super::*;
use crate::input::files;

/// 3 x 3 vertices at (x, y, x y / 4), coordinates (x, y) / 2, colours (100 x, 100 y, 50, 255), and their 8 triangles: by edges,
/// and one after another.
const STREAMS: [&str; 2] = [
    "RFJBQ08CAgEBAAAACQgCCAEAA+/TGv8BEf8CiED/AohAA/8AAAAAAAEAAAEACQMAAAIBAwkCAAECAQICBAACAQEBAQAPAx0HJ1UV\
     OQ5ZFQWaz/lLgP///w8A/f/+//8DAPT/AAAABMD/AwAA4P8BAAAAgAAAAP8PAAAAAAQAAAAA/z8AAAAAAAAAAAAAAAAAAAAAAEAO\
     BQEBAA0DOQ4PHQcdBzkOHQcHPQ4FERO8zpb/////7/9AL1+AHgBg8zsCBwAAACUD9QWBAAAAAP8PAAAAAAAAAAAAAAAAgD8MAQEB\
     AQPJAY0zyQH/h8kB/4eRA1UFB6LFPHQ+/5YAAAAA/wAAAA==",
    "RFJBQ08CAgEAAAAICQEAAQMBBAMBAgQCBQQDBAYEBwYEBQcFCAcBAwAJAwAAAwkCAAECAgQAAgICAQABAQAPAx0HL+U4AwTghfj/\
     AQAAwP8HAAAAAeD/BwD+fwAAAPL/AQAASADw//+//x8AAAD9fwAAAAQAAAAA/z8AAAABAQANAx0HJ+U4AwTghfw/APg/AAjA//8/\
     APg/AAiA//8/APg/AAAAAAAA/w8AAAABAQEDyQGpKskB/4fJASuRA/9bOQ4JfjKdZWewoLCAAAAAAP8AAAAAAAAAAAAAAAAAAAAA\
     AABADgAAAAAAAAAAAACAPww=",
];

fn data(base64: &str) -> Vec<u8> {
    let bytes = files::data_uri(&format!("data:;base64,{base64}")).expect("a data URI");
    bytes.expect("base64")
}

/// A maker with the stream, and the grid's mesh.
fn grid(base64: &str) -> (Maker, Value) {
    let mut maker = Maker::default();
    let view = maker.view(&data(base64));
    for (kind, component, count) in [
        ("VEC3", FLOAT, 9),
        ("VEC2", FLOAT, 9),
        ("VEC4", 5121, 9),
        ("SCALAR", 5123, 24),
    ] {
        let normalized = component == 5121;
        maker.accessors.push(
            json!({ "componentType": component, "type": kind, "count": count, "normalized": normalized }),
        );
    }
    let meshes = json!([{ "primitives": [{
        "attributes": { "POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2 },
        "indices": 3,
        "extensions": { "KHR_draco_mesh_compression": {
            "bufferView": view,
            "attributes": { "POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2 },
        } },
    }] }]);
    (maker, meshes)
}

#[cfg(feature = "compressed")]
#[test]
fn meshes_that_draco_compressed_are_those_that_were_written() {
    for stream in STREAMS {
        let (maker, meshes) = grid(stream);
        let required = ["KHR_draco_mesh_compression"];
        let scene = maker.load(json!({ "meshes": meshes, "extensionsRequired": required }));
        let scene = scene.expect("a grid");
        let mesh = &scene.meshes[0];
        assert_eq!(
            (mesh.positions.len(), mesh.triangles.len()),
            (9, 8),
            "its size"
        );
        let mut area = 0.0;
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|corner| {
                let [x, y, _] = mesh.positions[corner as usize];
                glam::DVec2::new(f64::from(x), f64::from(y))
            });
            let twice = (b - a).perp_dot(c - a);
            assert!(
                (twice - 1.0).abs() < 1e-3,
                "half a cell, to the front: {twice}"
            );
            area += twice / 2.0;
        }
        assert!((area - 4.0).abs() < 1e-3, "the whole grid: {area}");
        let origin = scene.origin_in_world;
        let rows = mesh.positions.iter().zip(&mesh.uvs[0]).zip(&mesh.colours);
        for ((position, uv), colour) in rows {
            let position = DVec3::from_array(position.map(f64::from)) + origin;
            let (x, y) = (position.x.round(), position.y.round());
            let expected = DVec3::new(x, y, x * y / 4.0);
            // 14 bits of a range of 2, and 12 bits of a range of 1.
            assert!((position - expected).length() < 2.0 / 16384.0, "{position}");
            let error = (f64::from(uv[0]) - x / 2.0).abs() + (f64::from(uv[1]) - y / 2.0).abs();
            assert!(error < 2.0 / 4096.0, "coordinates {uv:?} at {position}");
            let codes = [100.0 * x, 100.0 * y, 50.0, 255.0];
            for (found, code) in colour.iter().zip(codes) {
                let error = (f64::from(*found) - code / 255.0).abs();
                assert!(error < 1e-6, "colour {colour:?} at {position}");
            }
        }
    }
}

#[cfg(feature = "compressed")]
#[test]
fn draco_streams_that_do_not_fit_are_refused() {
    let (mut maker, meshes) = grid(STREAMS[0]);
    let load = |maker: &Maker, meshes: &Value| {
        maker
            .load(json!({ "meshes": meshes }))
            .map(|_| ())
            .err()
            .unwrap_or_default()
    };
    let with = |pointer: &str, value: Value| {
        let mut meshes = meshes.clone();
        *meshes.pointer_mut(pointer).expect("a place") = value;
        meshes
    };
    let extension = "/0/primitives/0/extensions/KHR_draco_mesh_compression";
    for (changed, says) in [
        (
            with(&format!("{extension}/bufferView"), json!(7)),
            "buffer view does not exist",
        ),
        (
            with(&format!("{extension}/attributes/POSITION"), json!(9)),
            "does not have this attribute",
        ),
        (
            with(&format!("{extension}/attributes/POSITION"), json!(1)),
            "2 numbers a vertex",
        ),
        (
            with("/0/primitives/0/attributes/POSITION", json!(8)),
            "accessor 8 does not exist",
        ),
    ] {
        let error = load(&maker, &changed);
        assert!(
            error.contains(says) && error.contains("primitive 0"),
            "{error}"
        );
    }
    maker.accessors[2]["componentType"] = json!(FLOAT);
    assert!(
        load(&maker, &meshes).contains("COLOR_0: Uint8"),
        "another type"
    );
    let whole = data(STREAMS[0]);
    for length in (0..whole.len()).step_by(5) {
        let (mut maker, meshes) = grid(STREAMS[0]);
        maker.views[0]["byteLength"] = json!(length);
        assert!(
            load(&maker, &meshes).contains("Draco"),
            "cut to {length} bytes"
        );
    }
}

/// The corners 0 1 2, 2 1 3 and the index list 0 1 2 2 1 3, by meshoptimizer; positions of SQUARE come uncompressed.
fn with_meshopt(extension: &str, mode: &str, hex: &str) -> (Maker, Value) {
    let mut maker = Maker::default();
    let position = maker.floats("VEC3", 3, &SQUARE);
    let digits = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal");
    let stream: Vec<u8> = (0..hex.len()).step_by(2).map(digits).collect();
    let start = maker.bytes.len();
    maker.bytes.extend(&stream);
    let mut view = json!({ "buffer": 1, "byteLength": 12 });
    view["extensions"][extension] = json!({
        "buffer": 0, "byteOffset": start, "byteLength": stream.len(),
        "byteStride": 2, "mode": mode, "count": 6,
    });
    maker.views.push(view);
    maker.accessors.push(
        json!({ "bufferView": maker.views.len() - 1, "componentType": 5123, "type": "SCALAR", "count": 6 }),
    );
    let meshes =
        json!([{ "primitives": [{ "attributes": { "POSITION": position }, "indices": 1 }] }]);
    let mut document = maker.json(json!({ "meshes": meshes, "extensionsRequired": [extension] }));
    let mut fallback = json!({ "byteLength": 12 });
    fallback["extensions"][extension] = json!({ "fallback": true });
    document["buffers"]
        .as_array_mut()
        .expect("a list")
        .push(fallback);
    (maker, document)
}

const TRIANGLE_STREAM: &str = "e1f010007687566778a9866589689801690000";
const INDEX_STREAM: &str = "d100040400020800000000";

#[test]
fn views_that_meshopt_compressed_are_read_without_their_fallback() {
    for extension in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        for (mode, stream) in [("TRIANGLES", TRIANGLE_STREAM), ("INDICES", INDEX_STREAM)] {
            let (maker, document) = with_meshopt(extension, mode, stream);
            let scene = maker.load(document).expect("a square");
            let [first, second] = [0, 1].map(|at| scene.meshes[0].triangles[at]);
            assert_eq!(first, [0, 1, 2], "{extension}, {mode}");
            let mut corners = second;
            corners.sort_unstable();
            assert_eq!(corners, [1, 2, 3], "{extension}, {mode}: {second:?}");
        }
    }
}

#[test]
fn views_that_do_not_fit_their_stream_are_refused() {
    let refused = |change: &dyn Fn(&mut Value)| {
        let (maker, mut document) =
            with_meshopt("EXT_meshopt_compression", "TRIANGLES", TRIANGLE_STREAM);
        change(&mut document);
        maker.load(document).map(|_| ()).expect_err("no good view")
    };
    let place = "/bufferViews/1/extensions/EXT_meshopt_compression";
    let set = |key: &str, value: Value| {
        refused(&|document: &mut Value| {
            document.pointer_mut(place).expect("a view")[key] = value.clone();
        })
    };
    for (key, value, says) in [
        ("buffer", json!(9), "buffer 9 does not exist"),
        ("byteLength", json!(100_000), "takes 100000 bytes"),
        ("byteLength", json!(9), "cut"),
        ("byteStride", json!(4), "but the view has 12 bytes"),
        ("count", json!(1u64 << 62), "buffer view 1"),
        ("mode", json!("STRIPS"), "its mode"),
        ("filter", json!("SHARP"), "its filter"),
        ("filter", json!("OCTAHEDRAL"), "no filter"),
    ] {
        let error = set(key, value);
        assert!(
            error.contains(says) && error.contains("meshopt"),
            "{key}: {error}"
        );
    }
    let missing = refused(&|document| document["buffers"][1]["extensions"] = json!({}));
    assert!(missing.contains("buffer 1: has no data"), "{missing}");
}

#[cfg(feature = "compressed")]
#[test]
fn pictures_in_ktx2_are_taken() {
    // 12 x 8 pixels of UASTC.
    const PICTURE: &str = "q0tUWCAyMLsNChoKAAAAAAEAAAAMAAAACAAAAAAAAAAAAAAAAQAAAAEAAAAAAAAAaAAAACwAAACUAAAALAAAAAAAAAAAAAAAAAAAAAAAAADAAAAAAAAAAGAAAAAAAAAAYAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AwAAAAAAAAAA/////x8AAABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuNTAAAAQAAAB/fwAAKAGpMYCBEkURMlR2mLrc/igB6bDpgxJVEjJUdpi63P4okUhxdoESbRMyVHaYutz+KAHJMoB5EUURMlR2mLrc/igBCbLpexFVEjJUdpi63P4okWhydnkRbRMyVHaYutz+";
    let mut maker = Maker::default();
    let mut meshes = square(&mut maker);
    let uvs = maker.floats("VEC2", 2, &[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    meshes[0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    meshes[0]["primitives"][0]["material"] = json!(0);
    let view = maker.view(&data(PICTURE));
    let scene = maker.load(json!({
        "meshes": meshes,
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }],
        "images": [{ "bufferView": view, "mimeType": "image/ktx2" }],
        "extensionsRequired": ["KHR_texture_basisu"],
    }));
    let scene = scene.expect("a square with a picture");
    assert_eq!(
        (scene.textures[0].width, scene.textures[0].height),
        (12, 8),
        "its size"
    );
}
