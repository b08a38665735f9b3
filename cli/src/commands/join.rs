//! `resample join`: pictures of their tiles, with the bytes of one run.
//!
//! Takes the files that `--tile` wrote, in any order. Everything that they say of themselves must agree, and each tile must be
//! there once; only then are pixels read and pictures written.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use resample_core::Image;
use resample_io::rendered;

use crate::args::JoinArgs;
use crate::output;
use crate::output::{Depth, Format, FrameNames};
use crate::picture::tiles::PartMark;
use crate::picture::{MAX_PIXELS, tiles};
use crate::process::report;
use crate::process::report::Verbosity;
use crate::values::{Grid, TileWord};

/// The file of a tile, and the record inside it.
struct Found {
    path: PathBuf,
    mark: PartMark,
}

/// Checks, joins and writes.
pub(crate) fn run(args: &JoinArgs, verbosity: Verbosity) -> Result<()> {
    let found: Vec<Found> = args
        .parts
        .iter()
        .map(|path| found(path))
        .collect::<Result<_>>()?;
    let first = found.first().context("there is no part")?;
    found
        .iter()
        .try_for_each(|other| check_alike(first, other))?;
    let is_deep = first.mark.format == Format::Png(Depth::Sixteen);
    let bits = is_deep.then_some(16);
    let format = output::format_of(&args.output, bits)?;
    if format != first.mark.format {
        bail!(
            "{}: the parts are those of another format: give the picture the extension that it was drawn for",
            args.output.display()
        );
    }
    let names = match first.mark.number {
        Some(_) => FrameNames::numbered(&args.output)?,
        None => FrameNames::single(&args.output)?,
    };
    let mut pictures: BTreeMap<Option<usize>, Vec<Found>> = BTreeMap::new();
    for part in found {
        pictures.entry(part.mark.number).or_default().push(part);
    }
    let read: Vec<&Path> = args.parts.iter().map(PathBuf::as_path).collect();
    for (number, tiles) in &mut pictures {
        tiles.sort_by_key(|tile| [tile.mark.place[1], tile.mark.place[0]]);
        check_complete(tiles)?;
        let file = names.frame(number.unwrap_or(0));
        output::check_writable(&file)?;
        output::check_not_input(&file, &read)?;
    }
    let count = pictures.len();
    for (number, tiles) in pictures {
        let mark = &tiles[0].mark;
        let has_mark = number.is_some() && !matches!(format, Format::Jpeg(_));
        let fingerprint = has_mark.then_some(mark.fingerprint.as_str());
        let file = names.frame(number.unwrap_or(0));
        output::write_marked_picture(&file, format, &joined(&tiles)?, fingerprint)?;
    }
    if verbosity != Verbosity::Quiet {
        let parts = args.parts.len();
        report::say(&format!("wrote {count} pictures of {parts} tiles"));
    }
    Ok(())
}

/// Reads the record of a file.
fn found(path: &Path) -> Result<Found> {
    // A file that cannot be read has an error of its own, and a pipe may never begin.
    resample_io::files::open(path)?;
    let mark = output::exr_mark(path).and_then(|text| serde_json::from_str(&text).ok());
    let mark: PartMark =
        mark.ok_or_else(|| anyhow!("{}: expected a file that --tile wrote", path.display()))?;
    let pixels = u64::from(mark.whole[0]) * u64::from(mark.whole[1]);
    if pixels > MAX_PIXELS || mark.whole.contains(&0) || mark.grid.contains(&0) {
        bail!("{}: its picture has an impossible size", path.display());
    }
    Ok(Found {
        path: path.to_owned(),
        mark,
    })
}

/// Refuses two parts that are not of the same run.
fn check_alike(one: &Found, other: &Found) -> Result<()> {
    let names = format!("{} and {}", one.path.display(), other.path.display());
    let (one, other) = (&one.mark, &other.mark);
    if one.version != other.version {
        bail!(
            "{names}: drawn by the versions {} and {}: use the same on all machines",
            one.version,
            other.version
        );
    }
    if one.vector_level != other.vector_level {
        bail!(
            "{names}: drawn with unlike vector instructions, {} and {}, whose pictures differ in the last digits: give \
             --vector-level avx2 or baseline",
            one.vector_level,
            other.vector_level
        );
    }
    let is_same = one.grid == other.grid
        && one.format == other.format
        && one.number.is_some() == other.number.is_some();
    let is_same_picture = one.number != other.number
        || (&one.fingerprint, one.whole) == (&other.fingerprint, other.whole);
    if !(is_same && is_same_picture) {
        bail!(
            "{names}: drawn with other options, of another picture or from files that have changed"
        );
    }
    Ok(())
}

/// Refuses parts of which one is missing or given twice; they are in order, rows first.
fn check_complete(tiles: &[Found]) -> Result<()> {
    for pair in tiles.windows(2) {
        check_alike(&pair[0], &pair[1])?;
        if pair[0].mark.place == pair[1].mark.place {
            bail!(
                "{} and {}: the same tile twice",
                pair[0].path.display(),
                pair[1].path.display()
            );
        }
    }
    let [columns, rows] = tiles[0].mark.grid;
    let all = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
    let missing = all
        .zip(
            tiles
                .iter()
                .map(|tile| Some(tile.mark.place))
                .chain(std::iter::repeat(None)),
        )
        .find(|(place, found)| Some(*place) != *found);
    if let Some(([column, row], _)) = missing {
        let number = tiles[0].mark.number;
        let of = number.map_or_else(String::new, |number| format!(" of picture {number}"));
        bail!("the tile {column},{row}/{columns}x{rows}{of} is missing");
    }
    Ok(())
}

/// The picture of its tiles.
fn joined(tiles: &[Found]) -> Result<Image> {
    let mut whole: Option<Image> = None;
    for Found { path, mark } in tiles {
        let window = tiles::window(
            &TileWord {
                column: mark.place[0],
                row: mark.place[1],
                grid: Grid {
                    columns: mark.grid[0],
                    rows: mark.grid[1],
                },
            },
            mark.whole,
        )?;
        let tile = rendered::read_planes(path)?;
        if [tile.width, tile.height] != window.size() {
            bail!("{}: has not the size of its tile", path.display());
        }
        let [width, height] = mark.whole.map(|side| side as usize);
        let whole = whole.get_or_insert_with(|| tile.blank(width, height));
        if !whole.paste(&tile, window.first()) {
            bail!("{}: has other planes than the first tile", path.display());
        }
    }
    whole.context("there is no part")
}
