//! Zarr arrays larger than memory: the picture is that of the array in memory, to the bit, and the work stays in bounds.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use glam::DVec3;
use resample_core::{Camera, Image};
use resample_tests::volumes::scenes::{perspective, transfer};
use tempfile::TempDir;
use volsplat::{LargeVolume, LoadOptions, RenderOptions, Renderer, TransferFunction, load};

/// Voxels along x, y, z: 5.5 MB of u16, and no side is a whole number of chunks or bricks.
const DIMS: [usize; 3] = [182, 141, 107];

/// A third of the volume.
const BUDGET: u64 = 2_000_000;

fn value([x, y, z]: [usize; 3]) -> u16 {
    let at = |i: usize, axis: usize| i as f64 / DIMS[axis] as f64 - 0.5;
    let (x, y, z) = (at(x, 0), at(y, 1), at(z, 2));
    let radius = (x * x + 1.3 * y * y + 0.8 * z * z).sqrt();
    (2000.0 * (1.0 + (40.0 * radius + 3.0 * (9.0 * x).sin()).cos()) * (1.0 - radius).max(0.0))
        as u16
}

fn look() -> TransferFunction {
    let colours = [
        (0.0, [0.1, 0.2, 1.0]),
        (1500.0, [0.2, 0.9, 0.3]),
        (4000.0, [1.0, 0.3, 0.1]),
    ];
    transfer(&colours, &[(100.0, 0.0), (4000.0, 0.5)])
}

/// An array of version 2 in a folder: axes z, y, x and then, where there are several, channels.
struct Array {
    chunk: [usize; 3],
    channels: usize,
    big_endian: bool,
    fill: u16,
}

impl Array {
    /// Writes the array without the chunk at the origin.
    fn write(&self, folder: &Path) {
        let [cz, cy, cx] = self.chunk;
        let [nx, ny, nz] = DIMS;
        let channel = if self.channels > 1 {
            format!(", {}", self.channels)
        } else {
            String::new()
        };
        let meta = format!(
            r#"{{"zarr_format": 2, "shape": [{nz},{ny},{nx}{channel}], "chunks": [{cz},{cy},{cx}{channel}],
                "dtype": "{}u2", "order": "C", "filters": null, "fill_value": {}, "dimension_separator": ".",
                "compressor": {{"id": "zlib", "level": 1}}}}"#,
            if self.big_endian { '>' } else { '<' },
            self.fill
        );
        fs::create_dir_all(folder).expect("a folder");
        fs::write(folder.join(".zarray"), meta).expect("written");
        for (k, j, i) in (0..nz.div_ceil(cz)).flat_map(|k| {
            (0..ny.div_ceil(cy)).flat_map(move |j| (0..nx.div_ceil(cx)).map(move |i| (k, j, i)))
        }) {
            if (k, j, i) == (0, 0, 0) {
                continue;
            }
            let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
            for place in 0..cz * cy * cx {
                let at = [
                    i * cx + place % cx,
                    j * cy + place / cx % cy,
                    k * cz + place / (cx * cy),
                ];
                for channel in 0..self.channels {
                    // What lies beyond the array is never looked at.
                    let v = value(at).wrapping_add(17 * channel as u16);
                    let bytes = if self.big_endian {
                        v.to_be_bytes()
                    } else {
                        v.to_le_bytes()
                    };
                    packed.write_all(&bytes).expect("in memory");
                }
            }
            let end = if self.channels > 1 { ".0" } else { "" };
            let name = format!("{k}.{j}.{i}{end}");
            fs::write(folder.join(name), packed.finish().expect("in memory")).expect("written");
        }
    }
}

fn plain() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("large.zarr");
    Array {
        chunk: [40, 50, 64],
        channels: 1,
        big_endian: false,
        fill: 0,
    }
    .write(&path);
    (folder, path)
}

fn cameras() -> [Camera; 2] {
    let middle = DVec3::new(91.0, 70.0, 53.0);
    [
        perspective(
            middle + DVec3::new(190.0, 250.0, -260.0),
            middle,
            35.0,
            [60, 44],
        ),
        perspective(
            middle + DVec3::new(60.0, 50.0, -80.0),
            middle,
            60.0,
            [44, 40],
        ),
    ]
}

fn bits(image: &Image) -> Vec<u32> {
    image
        .rgba
        .iter()
        .flatten()
        .map(|value| value.to_bits())
        .collect()
}

/// Renders in memory and in parts.
fn compare(path: &Path, options: &LoadOptions) {
    let volume = load(path, options).expect("a valid array");
    let mut memory =
        Renderer::new(&volume, &look(), &RenderOptions::default()).expect("valid options");
    let large = LargeVolume::open(path, options, BUDGET, &mut |_| {})
        .expect("a valid array")
        .expect("in parts");
    let mut stored = Renderer::from_file(&large, &look(), &RenderOptions::default(), &mut |_| {})
        .expect("valid options");
    assert_eq!(
        memory.non_transparent(),
        stored.non_transparent(),
        "visible voxels"
    );
    for (number, camera) in cameras().iter().enumerate() {
        let expected = memory.render(camera).expect("a valid camera").image;
        let got = stored.render(camera).expect("a valid camera");
        assert!(
            expected.rgba.iter().any(|p| p[3] > 0.1),
            "view {number}: the picture is empty"
        );
        assert!(
            bits(&expected) == bits(&got.image),
            "view {number}: the picture differs from the one in memory"
        );
        let held = got.stats.resident_bytes;
        assert!(
            held > 0 && held <= BUDGET,
            "view {number}: {held} bytes were held of {BUDGET}"
        );
    }
}

#[test]
fn the_picture_is_that_of_the_array_in_memory() {
    let (_folder, path) = plain();
    let options = LoadOptions {
        spacing: Some([1.0, 1.2, 0.9]),
        ..LoadOptions::default()
    };
    compare(&path, &options);
}

#[test]
fn the_whole_work_tells_how_far_it_is() {
    let (_folder, path) = plain();
    let mut shares = Vec::new();
    LargeVolume::open(&path, &LoadOptions::default(), BUDGET, &mut |share| {
        shares.push(share)
    })
    .expect("valid");
    assert!(shares.is_sorted(), "{shares:?}");
    let unpacking = shares.iter().filter(|share| **share <= 0.5).count();
    assert!(unpacking > 1, "unpacking is told step by step: {shares:?}");
    assert_eq!(shares.last(), Some(&1.0), "{shares:?}");
}

/// Channels stand last, high bytes first, and what was never written is not 0.
#[test]
fn one_channel_of_an_image_is_unpacked_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let array = Array {
        chunk: [20, 32, 50],
        channels: 2,
        big_endian: true,
        fill: 700,
    };
    array.write(&folder.path().join("0"));
    fs::write(folder.path().join(".zgroup"), r#"{"zarr_format": 2}"#).expect("written");
    let axes = ["z", "y", "x"]
        .map(|name| format!(r#"{{"name": "{name}", "type": "space"}}"#))
        .join(",");
    let image = format!(
        r#"{{"multiscales": [{{"version": "0.4", "axes": [{axes}, {{"name": "c", "type": "channel"}}], "datasets": [{{"path": "0",
            "coordinateTransformations": [{{"type": "scale", "scale": [1, 1, 1, 1]}}]}}]}}]}}"#
    );
    fs::write(folder.path().join(".zattrs"), image).expect("written");
    compare(
        folder.path(),
        &LoadOptions {
            component: Some(1),
            ..LoadOptions::default()
        },
    );
}

#[test]
fn chunks_that_do_not_fit_are_refused_with_their_size() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("coarse.zarr");
    Array {
        chunk: [107, 100, 182],
        channels: 1,
        big_endian: false,
        fill: 0,
    }
    .write(&path);
    let opened = LargeVolume::open(&path, &LoadOptions::default(), BUDGET, &mut |_| {});
    let complaint = opened
        .expect_err("a chunk is larger than the budget")
        .to_string();
    assert!(complaint.contains("3894800 bytes each"), "{complaint}");
}

#[test]
fn a_broken_chunk_is_named() {
    let (_folder, path) = plain();
    let chunk = path.join("1.1.1");
    let whole = fs::read(&chunk).expect("a chunk");
    let noise = vec![0xA5; whole.len()];
    for (what, bytes) in [
        ("cut", &whole[..whole.len() / 2]),
        ("empty", &[]),
        ("noise", &noise),
    ] {
        fs::write(&chunk, bytes).expect("written");
        let opened = LargeVolume::open(&path, &LoadOptions::default(), BUDGET, &mut |_| {});
        let complaint = opened.expect_err("a broken chunk").to_string();
        assert!(complaint.contains("1.1.1"), "{what}: {complaint}");
    }
}

#[test]
fn a_chunk_file_larger_than_the_memory_is_refused_unread() {
    let (_folder, path) = plain();
    let file = fs::OpenOptions::new()
        .write(true)
        .open(path.join("1.1.1"))
        .expect("a chunk");
    file.set_len(1 << 40).expect("a file with a hole");
    let opened = LargeVolume::open(&path, &LoadOptions::default(), BUDGET, &mut |_| {});
    let complaint = opened
        .expect_err("a chunk is larger than the budget")
        .to_string();
    assert!(
        complaint.contains("1099511627776 bytes each"),
        "{complaint}"
    );
}

/// Names the array to the test that runs itself once more with less room.
const NO_ROOM: &str = "LARGE_ZARR_WITHOUT_ROOM";

/// Runs itself again where files may not grow beyond 1 MB (2 MB in some shells), of 5.5 MB that are needed.
#[test]
#[cfg(unix)]
fn no_room_for_the_temporary_file_is_told() {
    if let Some(path) = std::env::var_os(NO_ROOM) {
        let opened = LargeVolume::open(
            Path::new(&path),
            &LoadOptions::default(),
            BUDGET,
            &mut |_| {},
        );
        println!("complaint: {}", opened.expect_err("no room"));
        return;
    }
    let (folder, path) = plain();
    let empty = folder.path().join("temporary");
    fs::create_dir(&empty).expect("a folder");
    let limited = r#"trap "" XFSZ; ulimit -f 2000; exec "$0" --exact large_zarr::no_room_for_the_temporary_file_is_told --nocapture"#;
    let run = |temporary: &Path| {
        let mut shell = std::process::Command::new("sh");
        shell
            .args(["-c", limited])
            .arg(std::env::current_exe().expect("this program"));
        let output = shell
            .env(NO_ROOM, &path)
            .env("TMPDIR", temporary)
            .output()
            .expect("a shell");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            output.status.success(),
            "{text}{}",
            String::from_utf8_lossy(&output.stderr)
        );
        text
    };
    for temporary in [&empty, &folder.path().join("absent")] {
        let text = run(temporary);
        let advice = "cannot be unpacked into 5491668 bytes of a temporary file";
        assert!(text.contains(advice) && text.contains("TMPDIR"), "{text}");
    }
    assert!(
        fs::read_dir(&empty).expect("a folder").next().is_none(),
        "a file was left"
    );
}
