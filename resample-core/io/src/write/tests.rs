//! Written files, read back; and what is refused before anything is written.

use std::error::Error as _;
use std::fs;
use std::fs::File;
use std::io;
use std::io::{BufReader, Write};
use std::path::Path;

use ::exr::prelude::{ReadChannels, ReadLayers};
use resample_core::{Image, Plane};

use super::files::write_whole;
use super::png::Depth;
use super::*;

/// 2 x 2 pixels: opaque, half transparent, empty, and out of range.
fn picture() -> Image {
    let mut image = Image::transparent(2, 2);
    image.rgba = vec![
        [1.0, 0.5, 0.0, 1.0],
        [0.25, 0.1, 0.0, 0.5],
        [0.0; 4],
        [2.0, f32::NAN, 0.5, 1.0],
    ];
    image
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn read_png(path: &Path) -> Vec<u8> {
    let decoder = ::png::Decoder::new(BufReader::new(File::open(path).expect("written")));
    let mut reader = decoder.read_info().expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut bytes).expect("whole");
    bytes.truncate(info.buffer_size());
    bytes
}

#[test]
fn png_holds_srgb_with_straight_alpha() {
    let folder = folder();
    let path = folder.path().join("a.png");
    let bytes = write_picture(&path, Format::Png(Depth::Eight), &picture()).expect("written");
    assert_eq!(
        bytes,
        fs::metadata(&path).expect("there").len(),
        "reported size"
    );
    // 0.5 linear is 187.5 in sRGB (0.7354 * 255), 0.2 is 123.6 (0.4845 * 255).
    let expected = [
        255, 188, 0, 255, 188, 124, 0, 128, 0, 0, 0, 0, 255, 0, 188, 255,
    ];
    assert_eq!(read_png(&path), expected, "pixels");
}

#[test]
fn png_of_sixteen_bits_is_finer_than_eight() {
    let folder = folder();
    let path = folder.path().join("a.png");
    write_picture(&path, Format::Png(Depth::Sixteen), &picture()).expect("written");
    let bytes = read_png(&path);
    let green = f64::from(u16::from_be_bytes([bytes[2], bytes[3]])) / 65535.0;
    let exact = 1.055 * 0.5f64.powf(1.0 / 2.4) - 0.055;
    assert!(
        (green - exact).abs() < 1.0 / 65535.0,
        "0.5 in sRGB is {exact}, not {green}"
    );
}

/// More pixels than are packed by run lengths.
#[test]
fn a_large_exr_keeps_its_values() {
    let folder = folder();
    let path = folder.path().join("large.exr");
    let mut image = Image::transparent(2049, 2048);
    for (i, pixel) in image.rgba.iter_mut().enumerate() {
        *pixel = [i as f32, 0.5, (i / 2049) as f32, 1.0];
    }
    write_picture(&path, Format::Exr, &image).expect("written");
    let read = ::exr::prelude::read_first_rgba_layer_from_file(
        &path,
        |size, _| vec![[0.0f32; 4]; size.area()],
        |pixels, at, (r, g, b, a): (f32, f32, f32, f32)| {
            pixels[at.x() + 2049 * at.y()] = [r, g, b, a]
        },
    )
    .expect("an EXR");
    assert!(read.layer_data.channel_data.pixels == image.rgba);
}

#[test]
fn exr_keeps_every_channel_bit_for_bit() {
    let folder = folder();
    let path = folder.path().join("a.exr");
    let mut image = picture();
    image.depth = Some(vec![1.0, 2.5, f32::INFINITY, 1e-30]);
    image.planes.push(Plane {
        name: "weight".into(),
        values: vec![4.0, 3.0, 2.0, 1.0],
    });
    write_picture(&path, Format::Exr, &image).expect("written");
    let read = ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels();
    let read = read
        .first_valid_layer()
        .all_attributes()
        .from_file(&path)
        .expect("an EXR");
    let named = |name: &str| -> Vec<u32> {
        let channels = &read.layer_data.channel_data.list;
        let channel = channels
            .iter()
            .find(|channel| channel.name.to_string() == name)
            .expect("a channel");
        channel
            .sample_data
            .values_as_f32()
            .map(f32::to_bits)
            .collect()
    };
    let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(
        read.layer_data.channel_data.list.len(),
        6,
        "R G B A Z weight"
    );
    for (i, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        let values: Vec<f32> = image.rgba.iter().map(|pixel| pixel[i]).collect();
        assert_eq!(named(name), bits(&values), "channel {name}");
    }
    assert_eq!(
        named("Z"),
        bits(image.depth.as_deref().expect("set above")),
        "depth"
    );
    assert_eq!(
        named("weight"),
        bits(&image.planes[0].values),
        "extra plane"
    );
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let folder = folder();
    let path = folder.path().join("a.txt");
    write_text(&path, "old").expect("written");
    let failed = write_whole(&path, |file| {
        file.write_all(b"half")?;
        Err(io::Error::other("the disk is full"))
    });
    let failure = failed.expect_err("it failed");
    let cause = failure.source().expect("a cause");
    let message = format!("{failure}: {cause}");
    assert!(
        message.contains("a.txt") && message.contains("disk is full"),
        "{message}"
    );
    assert_eq!(
        fs::read_to_string(&path).expect("there"),
        "old",
        "the old file stays"
    );
    assert_eq!(
        fs::read_dir(folder.path()).expect("there").count(),
        1,
        "no temporary file is left"
    );
}

#[cfg(unix)]
#[test]
fn a_written_file_is_no_more_private_than_any_new_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let (ours, usual) = (folder.path().join("ours"), folder.path().join("usual"));
    write_text(&ours, "x").expect("written");
    fs::write(&usual, "x").expect("written");
    let mode = |path: &Path| fs::metadata(path).expect("there").permissions().mode();
    assert_eq!(mode(&ours), mode(&usual), "permissions");
}

#[test]
fn formats_follow_from_the_extension() {
    let format = |name: &str, bits| format_of(Path::new(name), bits);
    assert_eq!(
        format("a.PNG", None).expect("known"),
        Format::Png(Depth::Eight),
        "case does not matter"
    );
    assert_eq!(
        format("a.png", Some(16)).expect("known"),
        Format::Png(Depth::Sixteen),
        "16 bits"
    );
    assert_eq!(format("a.exr", None).expect("known"), Format::Exr, "EXR");
    for name in ["a.jpg", "a.JPEG"] {
        let jpeg = Format::Jpeg(Views::One);
        assert_eq!(format(name, None).expect("known"), jpeg, "{name}");
    }
    let piped = format("-", None).expect("known");
    assert_eq!(piped, Format::Png(Depth::Eight), "the standard output");
    for (name, bits) in [
        ("a.exr", Some(16)),
        ("a.jpg", Some(16)),
        ("a.bmp", None),
        ("a", None),
        ("", None),
    ] {
        let message = format!("{:#}", format(name, bits).expect_err("refused"));
        assert!(message.starts_with(name), "{name:?}: {message}");
    }
}

#[test]
fn places_that_cannot_be_written_to_are_found_before_the_work() {
    let folder = folder();
    assert!(
        check_writable(&folder.path().join("a.png")).is_ok(),
        "a new file in a folder"
    );
    assert!(
        check_writable(folder.path()).is_err(),
        "a folder is no file"
    );
    #[cfg(unix)]
    assert!(
        check_writable(Path::new("/dev/null")).is_err(),
        "a device must not be replaced"
    );
    assert!(
        check_writable(&folder.path().join("no/a.png")).is_err(),
        "the folder is missing"
    );
    assert_eq!(
        fs::read_dir(folder.path()).expect("there").count(),
        0,
        "checking leaves nothing"
    );
    let input = folder.path().join("in.json");
    fs::write(&input, "{}").expect("written");
    assert!(
        check_not_input(&input, &[&input]).is_err(),
        "an input must not be replaced"
    );
    assert!(
        check_not_input(&folder.path().join("other"), &[&input]).is_ok(),
        "another name is fine"
    );
}
