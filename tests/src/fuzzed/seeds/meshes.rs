//! Meshes of a triangle or two.

use serde_json::{Value, json};

use super::Seed;
use super::binary::{floats, shorts, words};

pub(super) const WORDS: [&str; 48] = [
    "accessors",
    "bufferView",
    "bufferViews",
    "byteOffset",
    "byteStride",
    "byteLength",
    "componentType",
    "count",
    "sparse",
    "indices",
    "attributes",
    "POSITION",
    "NORMAL",
    "TEXCOORD_0",
    "COLOR_0",
    "TANGENT",
    "JOINTS_0",
    "WEIGHTS_0",
    "mode",
    "targets",
    "weights",
    "skins",
    "inverseBindMatrices",
    "animations",
    "samplers",
    "nodes",
    "children",
    "matrix",
    "rotation",
    "scale",
    "translation",
    "materials",
    "pbrMetallicRoughness",
    "baseColorTexture",
    "alphaMode",
    "extensionsRequired",
    "KHR_texture_transform",
    "EXT_mesh_gpu_instancing",
    "KHR_materials_unlit",
    "data:application/octet-stream;base64,",
    "mtllib m.mtl",
    "usemtl a",
    "newmtl a",
    "map_Kd m.png",
    "element vertex ",
    "property list uchar int vertex_indices",
    "format binary_little_endian 1.0",
    "solid",
];

const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

pub(super) fn files() -> Vec<Seed> {
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nusemtl a\nf 1/1/1 2/2/1 3/3/1\n\
               f -1//1 -2//1 -3//1\nf 1 2 4 3\nnewmtl a\nKd 1 0.5 0.2\nmap_Kd m.png\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 255\n1 0 0 9\n0 1 0 7\n3 0 1 2\n";
    let lists = ply.replace("list uchar int", "list uchar ushort").replace(
        "element face 1",
        "element face 1\nproperty list uchar short more",
    );
    let lists = lists.replace("3 0 1 2\n", "2 -5 6 3 0 1 2\n");
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar uint vertex_indices\nend_header\n";
    let binary = [head.as_bytes(), &floats(&CORNERS), &[3], &words(&[0, 1, 2])].concat();
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
    let stl = [
        &[0; 80][..],
        &words(&[1]),
        &floats(&[0.0, 0.0, 1.0]),
        &floats(&CORNERS),
        &[0; 2],
    ]
    .concat();
    vec![
        ("obj", obj.as_bytes().to_vec()),
        ("ply", ply.as_bytes().to_vec()),
        ("ply.lists", lists.into_bytes()),
        ("ply.binary", binary),
        ("stl.text", text.as_bytes().to_vec()),
        ("stl", stl),
        ("glb", glb()),
        ("gltf.animated", animated()),
        ("gltf.sparse", sparse()),
    ]
}

fn document(buffer: &str, bytes: usize) -> Value {
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "translation": [1.0, 2.0, 3.0] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorFactor": [1.0, 0.5, 0.2, 0.7] }, "alphaMode": "BLEND", "doubleSided": true }],
        "buffers": [{ "byteLength": bytes, "uri": buffer }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 36, "byteLength": 6 },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR" },
        ],
    })
}

fn data() -> Vec<u8> {
    [floats(&CORNERS), shorts(&[0, 1, 2, 0])].concat()
}

/// The buffer of `data` with zeros behind it, up to 64 bytes, in the notation of a data URI.
const DATA_URI: &str = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA==";

fn glb() -> Vec<u8> {
    let mut document = document("", 44);
    if let Some(buffer) = document["buffers"][0].as_object_mut() {
        buffer.remove("uri");
    }
    let mut text = document.to_string().into_bytes();
    while !text.len().is_multiple_of(4) {
        text.push(b' ');
    }
    let data = data();
    let length = 12 + 8 + text.len() + 8 + data.len();
    [
        b"glTF".to_vec(),
        words(&[2, length as u32, text.len() as u32]),
        b"JSON".to_vec(),
        text,
        words(&[data.len() as u32]),
        b"BIN\0".to_vec(),
        data,
    ]
    .concat()
}

fn animated() -> Vec<u8> {
    let mut file = document(DATA_URI, 64);
    file["nodes"] = json!([{ "mesh": 0, "children": [1], "skin": 0 }, { "scale": [1, 1, 2] }]);
    file["skins"] = json!([{ "joints": [1] }]);
    file["meshes"][0]["weights"] = json!([0.5]);
    file["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 0 }]);
    file["animations"] = json!([{
        "channels": [
            { "sampler": 0, "target": { "node": 1, "path": "translation" } },
            { "sampler": 1, "target": { "node": 1, "path": "rotation" } },
            { "sampler": 2, "target": { "node": 0, "path": "weights" } },
        ],
        "samplers": [
            { "input": 2, "output": 3, "interpolation": "LINEAR" },
            { "input": 2, "output": 4, "interpolation": "STEP" },
            { "input": 2, "output": 2, "interpolation": "LINEAR" },
        ],
    }]);
    let number = |kind: &str, count: u32| json!({ "bufferView": 0, "componentType": 5126, "count": count, "type": kind });
    if let Some(list) = file["accessors"].as_array_mut() {
        list.extend([number("SCALAR", 1), number("VEC3", 1), number("VEC4", 1)]);
    }
    file["cameras"] =
        json!([{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }]);
    file.to_string().into_bytes()
}

fn sparse() -> Vec<u8> {
    let mut file = document(DATA_URI, 64);
    file["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": { "bufferView": 1, "componentType": 5123 },
        "values": { "bufferView": 0 },
    });
    file["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing", "KHR_texture_transform"]);
    file["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 0 } } });
    file["images"] = json!([{ "uri": "m.png" }]);
    file["textures"] = json!([{ "source": 0 }]);
    file["materials"][0]["emissiveTexture"] =
        json!({ "index": 0, "extensions": { "KHR_texture_transform": { "scale": [2, 2] } } });
    file.to_string().into_bytes()
}
