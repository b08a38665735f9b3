//! The format of a scan, found by its content and never by its name.

use std::io::BufReader;
use std::path::Path;

use resample_io::files::{cannot_read, first_bytes, open_regular};
use resample_io::ply as table;

use super::file::CloudFormat;
use super::{e57, las_header, pcd, ply, text};
use resample_core::Error;

/// Bytes that tell a format: a few dozen lines of text.
const HEAD_BYTES: u64 = 4096;

/// The format of the scan at a path; `None` where it holds something else.
///
/// # Errors
/// [`Error::Input`] for a file that the system cannot read.
pub fn cloud_format_of(path: &Path) -> Result<Option<CloudFormat>, Error> {
    let head = first_bytes(path, HEAD_BYTES)?;
    Ok(match head.as_slice() {
        head if table::begins(head) => {
            let (file, _) = open_regular(path).map_err(|source| cannot_read(path, &source))?;
            let header = table::Header::read(&mut BufReader::new(file));
            header
                .is_ok_and(|header| ply::is_scan(&header))
                .then_some(CloudFormat::Ply)
        }
        head if head.starts_with(las_header::MAGIC) => {
            // The highest bit of the point format says that they are packed.
            let is_packed = head.get(104).is_some_and(|format| format & 0x80 != 0);
            Some(if is_packed {
                CloudFormat::Laz
            } else {
                CloudFormat::Las
            })
        }
        head if head.starts_with(e57::MAGIC) => Some(CloudFormat::E57),
        head if pcd::begins(head) => Some(CloudFormat::Pcd),
        head => text::format_of(head),
    })
}

#[cfg(test)]
mod tests {
    use super::super::test_files::Dir;
    use super::super::{CloudLoadOptions, load};
    use super::*;

    #[test]
    fn formats_are_found_by_content() {
        let dir = Dir::new();
        let found = |bytes: &[u8]| cloud_format_of(&dir.write("a", bytes)).expect("readable");
        let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
        let points = format!("{ply}end_header\n1 2 3\n");
        assert_eq!(found(points.as_bytes()), Some(CloudFormat::Ply));
        let mesh =
            format!("{ply}element face 1\nproperty list uchar int vertex_indices\nend_header\n");
        assert_eq!(found(mesh.as_bytes()), None, "a mesh");
        let gaussians = format!("{ply}property float scale_0\nend_header\n");
        assert_eq!(found(gaussians.as_bytes()), None, "Gaussians");
        assert_eq!(found(b"LASF"), Some(CloudFormat::Las));
        assert_eq!(found(b"ASTM-E57"), Some(CloudFormat::E57));
        assert_eq!(found(b"# .PCD v.7\nVERSION .7\n"), Some(CloudFormat::Pcd));
        assert_eq!(found(b"1 2 3\n4 5 6\n"), Some(CloudFormat::Xyz));
        assert_eq!(
            found(b"2\n1 2 3 9 1 2 3\n4 5 6 9 1 2 3\n"),
            Some(CloudFormat::Pts)
        );
        for other in [
            b"".as_slice(),
            b"a text",
            b"{\"json\": 1}",
            b"1 2\n3 4\n",
            &[0; 64],
        ] {
            assert_eq!(found(other), None, "{other:?}");
        }
        let why = load(&dir.write("a", b"a text"), &CloudLoadOptions::default());
        assert!(
            why.expect_err("no scan")
                .to_string()
                .contains("expected PLY")
        );
    }
}
