//! An image in several files, `.pvti`: an index that names a file for each piece, which lies where its own extent says.
//!
//! Takes the pieces that were read and gives the whole. Pieces may share a layer of values, as ParaView writes them; the later one stays.

use std::io::Read;
use std::path::{Path, PathBuf};

use glam::DVec3;
use resample_core::narrow;
use resample_io::Gate;

use crate::Error;
use crate::input::file::{Fault, Parts, cannot_read, invalid, open};
use crate::input::formats::vti::head;
use crate::volume::{Lattice, Voxels, map_voxels, voxel_count};

/// Largest index file that is read, bytes. It has a line for each piece. A guess: a simulation on a million cores stays below.
const MOST_BYTES: u64 = 1 << 24;

/// Bytes in which the type of the file stands.
const HEAD_BYTES: usize = 1024;

/// Largest distance between the places that two pieces give a voxel, voxels. A guess: places are rounded to a few digits.
const MOST_BESIDE: f64 = 1e-3;

/// The files of the pieces; `None` if the file is no index.
pub(crate) fn files(path: &Path, gate: &Gate) -> Result<Option<Vec<PathBuf>>, Error> {
    let mut text = Vec::new();
    let mut file = open(path)?;
    let mut read = |bytes: u64| (&mut file).take(bytes).read_to_end(&mut text);
    read(HEAD_BYTES as u64).map_err(|source| cannot_read(path, source))?;
    let is_index = |head: &[u8]| head.windows(11).any(|part| part == b"<PImageData");
    if !is_index(&text) {
        return Ok(None);
    }
    let mut rest = Vec::new();
    let read = (&mut file).take(MOST_BYTES).read_to_end(&mut rest);
    read.map_err(|source| cannot_read(path, source))?;
    text.extend(rest);
    let names = head::pieces(&String::from_utf8_lossy(&text)).map_err(|fault| fault.at(path))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let named = |name: &String| {
        let file = gate.named_file(name, folder, folder);
        file.map_err(|what| invalid(path, what))
    };
    names
        .iter()
        .map(named)
        .collect::<Result<_, Error>>()
        .map(Some)
}

/// The pieces in one.
pub(crate) fn joined(parts: Vec<Parts>, gate: &Gate) -> Result<Parts, Fault> {
    let first = parts.first().ok_or_else(|| "it has no pieces".to_owned())?;
    let map = first.lattice.world_from_index;
    let index_from_world = map.inverse();
    let mut places = Vec::new();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for part in &parts {
        let own = index_from_world * part.lattice.world_from_index;
        let place = own.translation.round();
        let is_turned = !own.matrix3.abs_diff_eq(glam::DMat3::IDENTITY, MOST_BESIDE);
        // Written so that NaN is refused, too.
        if is_turned || !((own.translation - place).length() < MOST_BESIDE) {
            return Err(Fault::Invalid(
                "its pieces do not lie on one grid".to_owned(),
            ));
        }
        low = low.min(place);
        high = high.max(place + DVec3::from_array(part.lattice.dims.map(|size| size as f64)));
        places.push(place);
    }
    let dims = (high - low)
        .to_array()
        .map(|size| narrow::count(narrow::whole(size)));
    let count = voxel_count(dims)?;
    // A value takes eight bytes at most, and the mark that a piece has covered it takes one.
    let bytes = (count as u64).saturating_mul(8 * first.voxels.len() as u64 + 1);
    gate.ask(bytes, "the image")?;
    let mut whole: Vec<Voxels> = (first.voxels.iter())
        .map(|voxels| map_voxels!(voxels, values => vec![values[0]; count]))
        .collect();
    let mut is_covered = vec![false; count];
    for (part, place) in parts.iter().zip(&places) {
        let at = (*place - low)
            .to_array()
            .map(|place| narrow::count(narrow::whole(place)));
        for (whole, voxels) in whole.iter_mut().zip(&part.voxels) {
            lay((whole, dims), (voxels, part.lattice.dims), at)?;
        }
        let all = vec![true; part.lattice.dims.iter().product()];
        copy((&mut is_covered, dims), (&all, part.lattice.dims), at);
    }
    let gaps = is_covered
        .into_iter()
        .filter(|is_covered| !is_covered)
        .count();
    if gaps > 0 {
        return Err(Fault::Invalid(format!(
            "{gaps} of {count} values of the image are in none of its pieces"
        )));
    }
    let mut world_from_index = map;
    world_from_index.translation = map.transform_point3(low);
    Ok(Parts {
        lattice: Lattice::unnamed(dims, world_from_index),
        voxels: whole,
    })
}

/// Copies a piece into the whole.
fn lay(
    (whole, dims): (&mut Voxels, [usize; 3]),
    (piece, size): (&Voxels, [usize; 3]),
    at: [usize; 3],
) -> Result<(), Fault> {
    macro_rules! copied {
        ($($kind:ident),*) => {
            match (whole, piece) {
                $((Voxels::$kind(whole), Voxels::$kind(piece)) => copy((whole, dims), (piece, size), at),)*
                _ => return Err(Fault::Invalid("its pieces have unlike types".to_owned())),
            }
        };
    }
    copied!(U8, I8, U16, I16, U32, I32, F32, F64);
    Ok(())
}

fn copy<T: Copy>(
    (whole, [width, height, _]): (&mut [T], [usize; 3]),
    (piece, [columns, rows, _]): (&[T], [usize; 3]),
    [x, y, z]: [usize; 3],
) {
    for (number, row) in piece.chunks_exact(columns).enumerate() {
        let begin = x + width * (y + number % rows + height * (z + number / rows));
        whole[begin..begin + columns].copy_from_slice(row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::test_files::{Folder, survive_damage};
    use crate::input::{Format, LoadOptions, arrays_of, format_of, load};

    /// A file of the values x + 10 y + 100 z at the points of an extent.
    fn piece(extent: [usize; 6]) -> String {
        let [x, y, z] = [0, 2, 4].map(|axis| extent[axis]..=extent[axis + 1]);
        let values: Vec<String> = z
            .flat_map(|z| y.clone().map(move |y| (y, z)))
            .flat_map(|(y, z)| x.clone().map(move |x| (x + 10 * y + 100 * z).to_string()))
            .collect();
        let extent = extent.map(|end| end.to_string()).join(" ");
        format!(
            "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"1 4 0 2 0 1\" Origin=\"5 6 7\" Spacing=\"2 1 1\">\
             <Piece Extent=\"{extent}\"><PointData Scalars=\"s\">\
             <DataArray type=\"Int16\" Name=\"s\" format=\"ascii\">{}</DataArray></PointData></Piece></ImageData></VTKFile>",
            values.join(" ")
        )
    }

    fn index(names: &[&str]) -> String {
        let pieces = names
            .iter()
            .map(|name| format!("<Piece Source=\"{name}\"/>"));
        let pieces: String = pieces.collect();
        format!("<VTKFile type=\"PImageData\"><PImageData>{pieces}</PImageData></VTKFile>")
    }

    #[test]
    fn pieces_that_share_a_layer_make_one_image() {
        let folder = Folder::new();
        for (name, extent) in [
            ("a.vti", [1, 2, 0, 2, 0, 1]),
            ("b.vti", [2, 4, 0, 1, 0, 1]),
            ("c.vti", [2, 4, 1, 2, 0, 1]),
        ] {
            folder.write(name, &[piece(extent).as_bytes()]);
        }
        let text = index(&["b.vti", "a.vti", "c.vti"]);
        let path = folder.write("whole.pvti", &[text.as_bytes()]);
        assert_eq!(format_of(&path).expect("readable"), Some(Format::Vti));
        assert_eq!(arrays_of(&path).expect("readable").1.as_deref(), Some("s"));
        let volume = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let expected = (0..2).flat_map(|z| (0..3).map(move |y| (y, z)));
        let expected = expected.flat_map(|(y, z)| (1..5).map(move |x| x + 10 * y + 100 * z));
        assert_eq!(
            (volume.dims, volume.voxels),
            ([4, 3, 2], Voxels::I16(expected.collect()))
        );
        let first = volume.world_from_index.translation;
        assert_eq!(
            first.to_array(),
            [7.0, 6.0, 7.0],
            "index 1 along x is its first"
        );
        let gap = folder.write("gap.pvti", &[index(&["a.vti", "c.vti"]).as_bytes()]);
        let complaint = load(&gap, &LoadOptions::default()).map(|volume| volume.dims);
        assert!(complaint.is_err_and(|error| error.to_string().contains("4 of 24 values")));
        for outside in ["../a.vti", "none.vti"] {
            let path = folder.write("bad.pvti", &[index(&[outside]).as_bytes()]);
            assert!(load(&path, &LoadOptions::default()).is_err(), "{outside}");
        }
        let lone = folder.path("b.vti");
        let lone = load(&lone, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(
            (lone.dims, lone.value(0)),
            ([3, 2, 2], 2.0),
            "a piece by itself"
        );
        survive_damage(text.as_bytes(), &LoadOptions::default(), 200);
    }
}
