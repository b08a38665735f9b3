//! Gaussian's cube files, `.cube`, `.cub`: a density or an orbital of a molecule on a grid, in text.
//!
//! Two lines of comment; the number of atoms and the origin; for each axis the number of voxels and the step, three numbers; a line for each
//! atom; then the values, the last axis fastest. A negative number of atoms announces a line with the numbers of several orbitals, which
//! change fastest of all. Lengths are in bohr, or in angstroms where an axis has a negative number of voxels. The world is in angstroms.
//! Source: the cubegen utility in Gaussian's manual.

use std::io::{BufRead, BufReader};
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};

use crate::Error;
use crate::input::decode::{self, Layout, component};
use crate::input::file::{Fault, Lines, Parts, excerpt};
use crate::input::{LoadOptions, open_sized};
use crate::volume::{Endian, Lattice, VoxelType, Voxels, voxel_count};

/// Angstroms in a bohr (CODATA 2018).
const ANGSTROMS: f64 = 0.529_177_210_903;

/// Largest number of atoms that is accepted; the file has a line for each. A guess: no calculation comes near.
const MOST_ATOMS: i64 = 1 << 24;

/// The facts above the values.
struct Header {
    /// Along the axes of the file, the slowest first.
    sizes: [usize; 3],
    steps: [DVec3; 3],
    origin: DVec3,
    orbitals: usize,
}

/// Returns true if a file that begins with `head` looks like one: behind two lines of anything stand an integer and three numbers, and then
/// three lines like that.
pub(crate) fn begins(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines().skip(2);
    let is_text = !head.contains(&0);
    let four = |line: &str| {
        let mut words = line.split_whitespace();
        words.next().is_some_and(|word| word.parse::<i64>().is_ok())
            && (0..3).all(|_| {
                words
                    .next()
                    .is_some_and(|word| word.contains('.') && word.parse::<f64>().is_ok())
            })
    };
    is_text && (0..4).all(|_| lines.next().is_some_and(four))
}

/// Reads the wanted orbitals, or the only one.
pub(crate) fn load(
    path: &Path,
    options: &LoadOptions,
    components: &[usize],
) -> Result<Parts, Error> {
    let (file, held) = open_sized(path)?;
    read(&mut BufReader::new(file), held, (options, components)).map_err(|fault| fault.at(path))
}

fn read(
    file: &mut dyn BufRead,
    held: u64,
    (options, components): (&LoadOptions, &[usize]),
) -> Result<Parts, Fault> {
    let header = header(file)?;
    let count = voxel_count(header.sizes)?;
    let all = count
        .checked_mul(header.orbitals)
        .ok_or_else(|| "more values than can be counted".to_owned())?;
    // A value has a digit and a space at least.
    if (all as u64).saturating_mul(2) > held {
        return Err(Fault::Invalid(format!(
            "its header promises {all} values, more than its {held} bytes can hold"
        )));
    }
    options.gate.ask(all as u64 * 4, "the values")?;
    let chosen = component::chosen(components, header.orbitals)?;
    let layout = Layout {
        voxel_type: VoxelType::F32,
        endian: Endian::Little,
        count: all,
    };
    let Voxels::F32(values) = decode::text(file, &layout)? else {
        return Err(Fault::Invalid("its values are no real numbers".to_owned()));
    };
    let of = |&number: &usize| {
        let values = values.iter().skip(number).step_by(header.orbitals);
        Voxels::F32(values.copied().collect())
    };
    let [z, y, x] = header.steps;
    let [depth, height, width] = header.sizes;
    Ok(Parts {
        lattice: Lattice {
            unit: Some("Å".to_owned()),
            ..Lattice::unnamed(
                [width, height, depth],
                DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), header.origin),
            )
        },
        voxels: chosen.iter().map(of).collect(),
    })
}

fn header(file: &mut dyn BufRead) -> Result<Header, Fault> {
    let mut lines = Lines::new(file);
    let mut next = |what: &str| {
        let line = lines.next()?;
        line.ok_or_else(|| Fault::Invalid(format!("it ends before {what}")))
    };
    next("its comments")?;
    next("its comments")?;
    let (atoms, origin) = four(&next("the number of atoms")?)?;
    let mut sizes = [0; 3];
    let mut steps = [DVec3::ZERO; 3];
    let mut unit = ANGSTROMS;
    for axis in 0..3 {
        let (size, step) = four(&next("its axes")?)?;
        if size < 0 {
            unit = 1.0;
        }
        sizes[axis] = usize::try_from(size.unsigned_abs()).unwrap_or(usize::MAX);
        steps[axis] = step;
    }
    if atoms.abs() > MOST_ATOMS {
        return Err(Fault::Invalid(format!("it announces {atoms} atoms")));
    }
    for _ in 0..atoms.abs() {
        next("the last of its atoms")?;
    }
    let mut orbitals = 1;
    if atoms < 0 {
        let line = next("the numbers of its orbitals")?;
        let mut words = line.split_whitespace().map(str::parse::<usize>);
        orbitals = match words.next() {
            Some(Ok(count)) if count > 0 => count,
            _ => return Err(wrong(&line)),
        };
        // The numbers of many orbitals go on in lines of their own.
        let mut named = words.count();
        while named < orbitals {
            named += next("the numbers of its orbitals")?
                .split_whitespace()
                .count()
                .max(1);
        }
    }
    Ok(Header {
        sizes,
        steps: steps.map(|step| unit * step),
        origin: unit * origin,
        orbitals,
    })
}

/// A whole number and three real ones.
fn four(line: &str) -> Result<(i64, DVec3), Fault> {
    let mut words = line.split_whitespace();
    let whole = words.next().and_then(|word| word.parse().ok());
    let mut number = || words.next().and_then(|word| word.parse::<f64>().ok());
    let numbers = (whole, number(), number(), number());
    let (Some(whole), Some(x), Some(y), Some(z)) = numbers else {
        return Err(wrong(line));
    };
    Ok((whole, DVec3::new(x, y, z)))
}

fn wrong(line: &str) -> Fault {
    Fault::Invalid(format!(
        "expected a whole number and three others, found '{}'",
        excerpt(line)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::test_files::{Folder, check_components, survive_damage};
    use crate::input::{Format, format_of, load};

    fn file(atoms: &str, sign: &str, orbitals: &str, values: usize) -> Vec<u8> {
        let values: Vec<String> = (0..values).map(|i| format!("{i}.5E-01")).collect();
        let atom = "8 8.0 0.0 0.0 0.1\n";
        format!(
            "water\ndensity\n {atoms} 1.0 2.0 3.0\n {sign}2 0.5 0.0 0.0\n {sign}3 0.0 1.0 0.0\n {sign}4 0.0 0.0 2.0\n{atom}{atom}{orbitals}{}\n",
            values.join(" ")
        )
        .into_bytes()
    }

    #[test]
    fn the_last_axis_is_fastest_and_lengths_are_angstroms() {
        let folder = Folder::new();
        for (sign, unit) in [("", ANGSTROMS), ("-", 1.0)] {
            let path = folder.write("a.cube", &[&file("2", sign, "", 24)]);
            assert_eq!(format_of(&path).expect("readable"), Some(Format::Cube));
            let volume = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(
                (volume.dims, volume.value(5)),
                ([4, 3, 2], f64::from(0.55f32))
            );
            let map = volume.world_from_index;
            let expected = unit * DVec3::new(1.0 + 0.5, 2.0 + 1.0, 3.0 + 2.0);
            assert!(map.transform_point3(DVec3::ONE).distance(expected) < 1e-12);
            // x of the voxels is z of the molecule.
            assert_eq!(map.matrix3.x_axis.z, 2.0 * unit);
        }
    }

    #[test]
    fn orbitals_are_components() {
        let folder = Folder::new();
        let path = folder.write("a.cube", &[&file("-2", "", "2 5 6\n", 48)]);
        check_components(&path, &LoadOptions::default(), 2);
        let second = LoadOptions {
            component: Some(1),
            ..LoadOptions::default()
        };
        assert_eq!(
            load(&path, &second).expect("two").value(1),
            f64::from(0.35f32)
        );
        let complaint = load(&path, &LoadOptions::default()).expect_err("two");
        assert!(
            complaint.to_string().contains("2 components"),
            "{complaint}"
        );
        survive_damage(&file("2", "", "", 24), &LoadOptions::default(), 200);
    }
}
