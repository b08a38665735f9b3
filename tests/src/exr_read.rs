//! Reads the truth pictures of the real data: linear premultiplied RGBA in OpenEXR.
//!
//! Takes the path of an EXR file, gives an [`Image`] whose rows run from the top. The first layer with channels R, G
//! and B is taken; a missing A becomes 1. Values pass unchanged, so a picture that is not finite stays so.
//!
//! Limits: only colour and alpha; the data window is the picture, wherever it lies in the display window. The size is
//! bounded before anything is allocated, but the reader is meant for files that this project trusts.

use exr::prelude::{MetaData, read_first_rgba_layer_from_file};
use resample_core::Image;
use std::path::Path;

/// Most pixels in a truth picture: 8192 x 8192, or 1 GiB as an [`Image`]. A guess, far above the 512 x 512 in use.
const MAX_PIXELS: usize = 1 << 26;

/// The RGBA picture in an EXR file, linear and premultiplied as it stands there.
///
/// # Errors
/// One sentence that names the file, if it cannot be read, has no layer with R, G and B, or is larger than 2^26 pixels.
pub fn read_rgba(path: impl AsRef<Path>) -> Result<Image, String> {
    let path = path.as_ref();
    let in_file = |error: exr::error::Error| {
        format!(
            "{}: cannot read as EXR with R, G, B: {error}",
            path.display()
        )
    };
    check_size(
        path,
        &MetaData::read_from_file(path, false).map_err(in_file)?,
    )?;
    let read = read_first_rgba_layer_from_file(
        path,
        |size, _| Image::transparent(size.width(), size.height()),
        |image, at, (red, green, blue, alpha): (f32, f32, f32, f32)| {
            let index = at.y() * image.width + at.x();
            image.rgba[index] = [red, green, blue, alpha];
        },
    );
    Ok(read.map_err(in_file)?.layer_data.channel_data.pixels)
}

fn check_size(path: &Path, meta: &MetaData) -> Result<(), String> {
    for header in &meta.headers {
        let [width, height] = [header.layer_size.width(), header.layer_size.height()];
        if width
            .checked_mul(height)
            .is_none_or(|pixels| pixels > MAX_PIXELS)
        {
            let path = path.display();
            return Err(format!(
                "{path}: {width} x {height} pixels, more than the {MAX_PIXELS} that a truth may have"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_unchanged_and_from_the_top() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("small.exr");
        let value = |x: usize, y: usize| (x as f32, y as f32 + 0.25, -1.5, 1.0 / 3.0);
        exr::prelude::write_rgba_file(&path, 3, 2, value).expect("write");
        let image = read_rgba(&path).expect("read");
        assert_eq!((image.width, image.height), (3, 2), "size");
        assert_eq!(
            image.pixel(2, 1),
            [2.0, 1.25, -1.5, 1.0 / 3.0],
            "last pixel of the bottom row"
        );
        assert_eq!(
            image.pixel(1, 0),
            [1.0, 0.25, -1.5, 1.0 / 3.0],
            "middle pixel of the top row"
        );
    }

    #[test]
    fn an_error_names_the_file() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("text.exr");
        std::fs::write(&path, "not a picture").expect("write");
        for path in [path, folder.path().join("absent.exr")] {
            let error = read_rgba(&path).expect_err("must be refused");
            assert!(
                error.starts_with(&path.display().to_string()),
                "the message does not name the file: {error}"
            );
        }
    }
}
