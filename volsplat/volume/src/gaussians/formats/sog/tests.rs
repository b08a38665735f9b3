//! Scenes of both versions, written here pixel by pixel and read back from folders and archives.

use std::io::Cursor;

use image::{ExtendedColorType, ImageEncoder};
use serde_json::{Value, json};

use super::super::sink::C0;
use super::super::test_files::{Dir, check_damage, known, same_within};
use super::*;
use crate::input::test_files::zip_archive;

/// A lossless picture of 2x2 pixels, or of other sizes.
fn webp(pixels: &[[u8; 4]], width: u32) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut bytes);
    let height = pixels.len() as u32 / width;
    let written = encoder.write_image(&pixels.concat(), width, height, ExtendedColorType::Rgba8);
    written.expect("a picture in memory");
    bytes.into_inner()
}

fn code(value: f32, least: f32, most: f32, largest: f32) -> u32 {
    ((value - least) / (most - least) * largest).round() as u32
}

fn quat(rotation: Quat) -> [u8; 4] {
    let [x, y, z, w] = rotation.to_array();
    let four = [w, x, y, z];
    let order = |a: &usize, b: &usize| four[*a].abs().total_cmp(&four[*b].abs());
    let largest = (0..4).max_by(order).expect("four");
    let others = (0..4).filter(|place| *place != largest);
    let codes = others.map(|place| {
        let value = four[place] * four[largest].signum();
        code(value, -0.5f32.sqrt(), 0.5f32.sqrt(), 255.0) as u8
    });
    let mut pixel: Vec<u8> = codes.collect();
    pixel.push(252 + largest as u8);
    pixel.try_into().expect("four")
}

/// Range of the transformed positions, of the logarithms of scales, of the constants, of log odds and of the other coefficients.
const PLACES: [f32; 2] = [-1.5, 1.5];
const LOGS: [f32; 2] = [-5.0, 0.0];
const CONSTANTS: [f32; 2] = [-2.0, 2.0];
const ODDS: [f32; 2] = [-4.0, 4.0];
const REST: [f32; 2] = [-0.25, 0.25];

fn byte(value: f32, [least, most]: [f32; 2]) -> u8 {
    code(value, least, most, 255.0) as u8
}

/// The files of a scene; the coefficients of Gaussian i are entry 64 i of the palette.
fn scene(version: u32, degree: usize) -> Vec<(String, Vec<u8>)> {
    let all = known(degree);
    let mut pixels = vec![vec![[0; 4]; 4]; 6];
    let per_entry = sink::coefficients_of(degree) / 3;
    let mut entries = vec![[0; 4]; 64 * per_entry * all.len()];
    for (index, (stored, rest)) in all.iter().enumerate() {
        for (axis, value) in stored.centre.as_vec3().to_array().into_iter().enumerate() {
            let place = value.signum() * value.abs().ln_1p();
            let code = code(place, PLACES[0], PLACES[1], 65_535.0) as u16;
            pixels[0][index][axis] = code.to_le_bytes()[0];
            pixels[1][index][axis] = code.to_le_bytes()[1];
            pixels[2][index][axis] = byte(stored.scales[axis].ln(), LOGS);
            pixels[4][index][axis] = byte((stored.colour[axis] - 0.5) / C0, CONSTANTS);
        }
        pixels[3][index] = quat(stored.rotation);
        let odds = (stored.opacity / (1.0 - stored.opacity)).ln();
        pixels[4][index][3] = match version {
            1 => byte(odds, ODDS),
            _ => byte(stored.opacity, [0.0, 1.0]),
        };
        pixels[5][index][0] = 64 * index as u8;
        for (number, rgb) in rest.chunks_exact(3).enumerate() {
            let [r, g, b] = [rgb[0], rgb[1], rgb[2]].map(|value| byte(value, REST));
            entries[64 * per_entry * index + number] = [r, g, b, 255];
        }
    }
    let names = ["means_l", "means_u", "scales", "quats", "sh0", "shN_labels"];
    let mut files: Vec<_> = (names.iter().zip(&pixels))
        .map(|(name, pixels)| (format!("{name}.webp"), webp(pixels, 2)))
        .collect();
    if degree > 0 {
        let palette = webp(&entries, 64 * per_entry as u32);
        files.push(("shN_centroids.webp".to_owned(), palette));
    }
    let json = meta(version, degree).to_string();
    files.push((META.to_owned(), json.into_bytes()));
    files
}

fn meta(version: u32, degree: usize) -> Value {
    let codebook = |[least, most]: [f32; 2]| {
        let number = |byte: u16| least + (most - least) * f32::from(byte) / 255.0;
        let mut codebook: Vec<_> = (0..256).map(|byte| Some(number(byte))).collect();
        codebook[0] = None;
        codebook
    };
    let each = |end: f32| [end; 3];
    let means = json!({"mins": each(PLACES[0]), "maxs": each(PLACES[1]), "shape": [3, 3],
        "files": ["means_l.webp", "means_u.webp"]});
    let quats = json!({"files": ["quats.webp"]});
    let rest = json!(["shN_centroids.webp", "shN_labels.webp"]);
    let mut meta = match version {
        1 => json!({
            "means": means, "quats": quats,
            "scales": {"mins": each(LOGS[0]), "maxs": each(LOGS[1]), "files": ["scales.webp"]},
            "sh0": {"mins": [CONSTANTS[0], CONSTANTS[0], CONSTANTS[0], ODDS[0]],
                "maxs": [CONSTANTS[1], CONSTANTS[1], CONSTANTS[1], ODDS[1]], "files": ["sh0.webp"]},
            "shN": {"mins": REST[0], "maxs": REST[1], "quantization": 8, "files": rest},
        }),
        _ => json!({
            "version": version, "count": 3, "antialias": true, "means": means, "quats": quats,
            "scales": {"codebook": codebook(LOGS), "files": ["scales.webp"]},
            "sh0": {"codebook": codebook(CONSTANTS), "files": ["sh0.webp"]},
            "shN": {"count": 129, "bands": degree, "codebook": codebook(REST), "files": rest},
        }),
    };
    if degree == 0 {
        meta.as_object_mut().expect("an object").remove("shN");
    }
    meta
}

const WITHIN: [f32; 5] = [2e-4, 0.01, 0.011, 0.01, 0.002];

#[test]
fn folders_and_archives_of_both_versions_read_back() {
    for (version, degree) in [(1, 0), (1, 2), (2, 0), (2, 1), (2, 2), (2, 3)] {
        let dir = Dir::new();
        let files = scene(version, degree);
        for (name, bytes) in &files {
            dir.write(name, bytes);
        }
        let gate = Gate::default();
        let bundle = dir.write("bundle", &zip_archive(&files));
        assert!(begins(dir.path()) && is_bundle(&bundle));
        for path in [dir.path(), &dir.path().join(META), &bundle] {
            let mut notes = Vec::new();
            let read = load(path, &gate, &mut notes).expect("a good scene");
            assert_eq!(notes.len(), usize::from(version == 2), "{notes:?}");
            same_within(&read, &known(degree), WITHIN);
        }
        assert!(gate.files().len() >= 5, "the pictures are noted");
    }
}

/// The message with which a scene is refused, whose description and pictures are changed.
fn refusal(change: impl Fn(&mut Value, &mut Vec<(String, Vec<u8>)>)) -> String {
    let dir = Dir::new();
    let mut meta = meta(2, 1);
    let mut files = scene(2, 1);
    change(&mut meta, &mut files);
    files
        .iter()
        .for_each(|(name, bytes)| drop(dir.write(name, bytes)));
    dir.write(META, meta.to_string().as_bytes());
    let why = load(dir.path(), &Gate::default(), &mut Vec::new()).expect_err("refused");
    why.to_string()
}

#[test]
fn forged_descriptions_are_refused() {
    let replaced = |key: &'static str, value: Value| {
        refusal(move |meta, _| *meta.pointer_mut(key).expect("a key") = value.clone())
    };
    assert!(replaced("/count", json!(1u64 << 62)).contains("4 pixels for"));
    assert!(replaced("/count", json!(0)).contains("no Gaussian"));
    assert!(replaced("/version", json!(7)).contains("version 7"));
    assert!(replaced("/means/files", json!(["../a"])).contains("outside"));
    assert!(replaced("/means/files", json!(["means_l.webp"])).contains("no file 2"));
    assert!(replaced("/means/mins", json!([])).contains("range"));
    assert!(replaced("/scales/codebook", json!([])).contains("codebook"));
    assert!(replaced("/shN/bands", json!(2)).contains("192 pixels wide"));
    assert!(replaced("/sh0", json!(3)).contains("no description"));
    let why = refusal(|_, files| files[3].1 = webp(&[[0, 0, 0, 251]; 4], 2));
    assert!(why.contains("alpha 251"), "{why}");
    let why = refusal(|_, files| files[5].1 = webp(&[[255; 4]; 4], 2));
    assert!(why.contains("entry 65535"), "{why}");
    let why = refusal(|_, files| files[0].1 = b"nothing".to_vec());
    assert!(why.contains("'means_l.webp'"), "{why}");
}

#[test]
fn damaged_archives_are_refused() {
    let dir = Dir::new();
    let good = zip_archive(&scene(2, 1));
    let refused = |bytes: &[u8]| {
        let path = dir.write("a", bytes);
        let why = load(&path, &Gate::default(), &mut Vec::new()).expect_err("refused");
        why.to_string()
    };
    assert!(refused(&good[..good.len() - 30]).contains("cut off"));
    let files = scene(2, 1);
    let without: Vec<_> = files[1..].to_vec();
    assert!(refused(&zip_archive(&without)).contains("'means_l.webp'"));
    assert!(refused(&zip_archive(&files[..2])).contains("no meta.json"));
    check_damage(&good, load);
}
