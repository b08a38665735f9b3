//! NumPy's `.npz`: a ZIP archive of arrays, each a member whose name ends in `.npy`, stored or deflated.
//!
//! Takes a path and the name of an array, gives the parts of a volume. Without a name the largest array is read.

use std::path::Path;

use resample_io::Gate;

use crate::Error;
use crate::input::decode::zip::{Archive, MAGIC};
use crate::input::file::{Fault, unsupported};
use crate::input::formats::numpy::npy;
use crate::input::options::LoadOptions;
use crate::input::{Parts, open_sized};

const ENDING: &str = ".npy";

/// Bytes of a member's header before its name, and the place of the name's length.
const NAME_AT: usize = 30;
const NAME_LENGTH_AT: usize = 26;

/// Returns true if a file that begins with `head` is an archive whose first member is an array.
pub(crate) fn begins(head: &[u8]) -> bool {
    let name = || {
        let length = head.get(NAME_LENGTH_AT..NAME_LENGTH_AT + 2)?;
        let length = usize::from(u16::from_le_bytes(length.try_into().ok()?));
        head.get(NAME_AT..NAME_AT + length)
    };
    head.starts_with(MAGIC) && name().is_some_and(|name| name.ends_with(ENDING.as_bytes()))
}

/// The names of the arrays, and of the largest.
pub(crate) fn array_names(path: &Path) -> Result<(Vec<String>, Option<String>), Error> {
    let names = || {
        let arrays = arrays(&opened(path)?);
        let largest = largest(&arrays);
        Ok((arrays.into_iter().map(|(name, _)| name).collect(), largest))
    };
    names().map_err(|fault: Fault| fault.at(path))
}

pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<Parts, Error> {
    read(path, options.array.as_deref(), &options.gate).map_err(|fault| fault.at(path))
}

fn opened(path: &Path) -> Result<Archive, Fault> {
    let (file, held) = open_sized(path).map_err(|error| Fault::Invalid(error.to_string()))?;
    Archive::open(file, held)
}

/// Names without their ending, and sizes.
fn arrays(archive: &Archive) -> Vec<(String, u64)> {
    let members = archive.members();
    members
        .filter_map(|(name, bytes)| Some((name.strip_suffix(ENDING)?.to_owned(), bytes)))
        .collect()
}

fn largest(arrays: &[(String, u64)]) -> Option<String> {
    let most = arrays.iter().map(|(_, bytes)| *bytes).max();
    let found = arrays.iter().find(|(_, bytes)| Some(*bytes) == most);
    found.map(|(name, _)| name.clone())
}

fn read(path: &Path, wanted: Option<&str>, gate: &Gate) -> Result<Parts, Fault> {
    let mut archive = opened(path)?;
    let arrays = arrays(&archive);
    let names: Vec<&str> = arrays.iter().map(|(name, _)| name.as_str()).collect();
    let name = match wanted {
        Some(name) if names.contains(&name) => name.to_owned(),
        Some(name) => {
            return Err(Fault::Option(format!(
                "array={name}: it holds {}",
                names.join(", ")
            )));
        }
        None => largest(&arrays).ok_or_else(|| unsupported("it holds no array"))?,
    };
    if wanted.is_none() && arrays.len() > 1 {
        gate.remark(format!(
            "of {} arrays, {name} is read, the largest: #array=NAME names another",
            arrays.len()
        ));
    }
    let bytes = archive.read(&format!("{name}{ENDING}"), gate)?;
    npy::read(&mut bytes.as_slice(), bytes.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::test_files::{Folder, survive_damage, zip_archive};
    use crate::input::{Format, arrays_of, format_of, load};
    use crate::volume::Voxels;

    /// One array of bytes as a member of an archive, stored.
    fn array(values: &[u8]) -> Vec<u8> {
        let text = format!(
            "{{'descr': '|u1', 'fortran_order': False, 'shape': (1, 2, {}), }}\n",
            values.len() / 2
        );
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes.extend(values);
        bytes
    }

    #[test]
    fn the_largest_array_is_read_or_the_one_that_is_named() {
        let bytes = zip_archive(&[
            ("few.npy", array(&[1, 2])),
            ("many.npy", array(&[3, 4, 5, 6])),
            ("note.txt", b"text".to_vec()),
        ]);
        let folder = Folder::new();
        let path = folder.write("a.npz", &[&bytes]);
        assert_eq!(format_of(&path).expect("readable"), Some(Format::Npz));
        let (names, default) = arrays_of(&path).expect("readable");
        assert_eq!(
            (names, default.as_deref()),
            (vec!["few".into(), "many".into()], Some("many"))
        );
        let options = LoadOptions::default();
        let many = load(&path, &options).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(
            (many.dims, many.voxels),
            ([2, 2, 1], Voxels::U8(vec![3, 4, 5, 6]))
        );
        assert!(options.gate.remarks()[0].contains("many"), "a remark");
        let named = |name: &str| LoadOptions {
            array: Some(name.to_owned()),
            ..LoadOptions::default()
        };
        let few = load(&path, &named("few")).expect("it is there");
        assert_eq!(few.voxels, Voxels::U8(vec![1, 2]));
        let complaint = load(&path, &named("none"))
            .expect_err("no such")
            .to_string();
        assert!(complaint.contains("few, many"), "{complaint}");
        survive_damage(&bytes, &LoadOptions::default(), 300);
    }
}
