//! Stacks of TIFF pictures: one file of many pages, or files of one page.
//!
//! Takes paths in the order of the slices, returns the parts of a volume. A first pass reads the directories only. It holds all pages to
//! the first one and compares the bytes that they promise with what a file of this length can unpack to, so that the second pass, which
//! decodes, allocates no more than that.
//!
//! Spacing is taken from the description of the first page, else it is 1: the resolution alone is meant for printers.
//! ImageJ writes lines such as `slices=27` and `spacing=2.5`; with a `unit`, the resolution of the page is in pixels per
//! that unit. OME writes XML, whose element Pixels has the physical size of a voxel. Both say which page is which slice of which channel
//! at which time (`notes.rs`); `pages.rs` reads directories and pages, `zstandard.rs` those that are packed so. Source: TIFF 6.0 and BigTIFF; the decoder is the crate `tiff`.
//! Limits: grey values of 8 to 64 bits, half precision included; of colours of 8 or 16 bits one component, interleaved; no palettes;
//! channels and times of one file, or of those that an OME description names; of other files, slices alone.

mod kind;
mod notes;
mod pages;
mod zstandard;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::Error;
use crate::input::axes;
use crate::input::axes::ImageAxes;
use crate::input::decode::component::chosen;
use crate::input::file::Fault;
use crate::input::formats::tiff_stack::kind::Kind;
use crate::input::formats::tiff_stack::notes::{Notes, Own, Place};
use crate::input::formats::tiff_stack::pages::Pages;
use crate::input::options::LoadOptions;
use crate::input::{Parts, decode, invalid};
use crate::volume::{Lattice, Voxels};
use resample_io::Gate;

pub(crate) use resample_io::tiff::begins;

/// How many slices a TIFF file holds; `None` where it holds no slices of a volume, such as colours of a palette.
pub fn pages_of(path: &Path) -> Option<usize> {
    Pages::look_at(path, 1).ok().map(|pages| pages.count)
}

/// How many colours a pixel has; `None` where it is grey.
pub(crate) fn colours(paths: &[PathBuf]) -> Result<Option<usize>, Error> {
    let Some(first) = paths.first() else {
        return Ok(None);
    };
    let components = Pages::look_at(first, paths.len())?.kind.components;
    Ok((components > 1).then_some(components))
}

/// The channels and the points in time.
pub(crate) fn axes(paths: &[PathBuf], gate: &Gate) -> Result<ImageAxes, Error> {
    let Some(first) = paths.first() else {
        return Ok(ImageAxes::default());
    };
    Ok(described(first, paths.len(), gate)?.1.axes)
}

/// Reads the slices of one file or of several; the chosen channels or, of colours, components.
pub(crate) fn load(
    paths: &[PathBuf],
    options: &LoadOptions,
    components: &[usize],
) -> Result<Parts, Error> {
    let gate = &options.gate;
    let mut stack: Option<Stack> = None;
    let mut bytes = 0u64;
    for path in paths {
        let (pages, notes) = described(path, paths.len(), gate)?;
        let mut part =
            Part::of(&pages, &notes, components, options.time).map_err(|fault| fault.at(path))?;
        part.open_further(path, &notes.files, gate)?;
        if notes.axes.times > 1 && options.time.is_none() {
            gate.remark(axes::first_of(notes.axes.times, path));
        }
        bytes = bytes.saturating_add(part.bytes());
        let asked = gate
            .ask_unpacked(part.bytes(), part.held(), "the pages")
            .and_then(|()| gate.ask(bytes, "the slices"));
        asked.map_err(|what| invalid(path, what))?;
        match &mut stack {
            None => stack = Some(Stack::begin(&part, path)?),
            Some(stack) => stack.add(&part, path)?,
        }
    }
    let stack = stack.ok_or_else(|| invalid(Path::new(""), "no slices"))?;
    Ok(Parts {
        lattice: Lattice {
            // Rows run from the top of a picture down.
            up_hint: Some(DVec3::NEG_Y),
            unit: stack.unit,
            ..Lattice::unnamed(
                [stack.kind.width, stack.kind.height, stack.depth],
                decode::upright(stack.spacing, [0.0; 3]),
            )
        },
        voxels: stack.voxels,
    })
}

/// The directories of one of `files`, and the description of its pages. Of several files each is a slice, whatever its description.
fn described(path: &Path, files: usize, gate: &Gate) -> Result<(Pages, Notes), Error> {
    let mut pages = Pages::look_at(path, files)?;
    let mut own = Own { path, uuid: None };
    if let (1, Some(master)) = (files, notes::master(&pages.first)) {
        let folder = path.parent().unwrap_or(Path::new(""));
        let file = gate.named_file(&master.file, folder, folder);
        pages.first.text = pages::description(&file.map_err(|what| invalid(path, what))?)?;
        own.uuid = master.own_uuid;
    }
    let notes = Notes::of(&pages.first, &own, (pages.count, pages.kind.components));
    let notes = match (files, notes) {
        (1, notes) => notes.map_err(|fault| fault.at(path))?,
        (_, Ok(notes)) => notes.sliced(pages.count),
        (_, Err(_)) => Notes::plain([1.0; 3], pages.count),
    };
    Ok((pages, notes))
}

/// The pages and components that are read of a file.
struct Part<'a> {
    pages: &'a Pages,
    spacing: [f64; 3],
    unit: Option<String>,
    /// The pages of each channel that is read.
    slices: Vec<&'a [Place]>,
    /// Further files that hold some of them, by their numbers.
    further: BTreeMap<usize, (PathBuf, Pages)>,
    /// The components of a pixel that are read.
    components: Vec<usize>,
}

impl<'a> Part<'a> {
    fn of(
        pages: &'a Pages,
        notes: &'a Notes,
        choice: &[usize],
        time: Option<usize>,
    ) -> Result<Self, Fault> {
        let (channels, times) = (notes.axes.channels.len(), notes.axes.times);
        let colours = pages.kind.components;
        if channels > 1 && colours > 1 {
            return Err(Fault::Unsupported(format!(
                "{channels} channels of colours: save one of them as a stack of its own"
            )));
        }
        let time = time.unwrap_or(0);
        if time >= times {
            return Err(Fault::Option(format!(
                "time={time}: the file holds {times} point(s) in time, counted from 0"
            )));
        }
        let (channels, components) = match channels {
            1 => (vec![0], chosen(choice, colours)?),
            _ => (chosen_channels(choice, &notes.axes)?, vec![0]),
        };
        Ok(Self {
            pages,
            spacing: notes.spacing,
            unit: notes.unit.clone(),
            slices: channels
                .iter()
                .map(|&channel| notes.slices(channel, time))
                .collect(),
            further: BTreeMap::new(),
            components,
        })
    }

    /// Reads the directories of further files that hold pages of the part.
    fn open_further(&mut self, path: &Path, names: &[String], gate: &Gate) -> Result<(), Error> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let places = self.slices.iter().flat_map(|slices| slices.iter());
        for file in places.map(|place| place.file).filter(|&file| file > 0) {
            if self.further.contains_key(&file) {
                continue;
            }
            let named = gate.named_file(&names[file - 1], folder, folder);
            let named = named.map_err(|what| invalid(path, what))?;
            let pages = Pages::look_at(&named, 1)?;
            let (kind, first) = (pages.kind, self.pages.kind);
            if kind != first {
                let what = format!(
                    "pages of {kind}, but those of {} are {first}",
                    path.display()
                );
                return Err(invalid(&named, what));
            }
            self.further.insert(file, (named, pages));
        }
        Ok(())
    }

    /// Length of the files, bytes.
    fn held(&self) -> u64 {
        let further = self.further.values().map(|(_, pages)| pages.held);
        further.fold(self.pages.held, u64::saturating_add)
    }

    /// Bytes of all that is read, unpacked.
    fn bytes(&self) -> u64 {
        let pages: usize = self.slices.iter().map(|slices| slices.len()).sum();
        self.pages.kind.bytes().saturating_mul(pages as u64)
    }

    /// The voxels of each channel or component.
    fn decode(&self, path: &Path) -> Result<Vec<Voxels>, Error> {
        let run = |run: &[Place]| {
            let pages: Vec<usize> = run.iter().map(|place| place.page).collect();
            match self.further.get(&run[0].file) {
                None => self.pages.decode(path, &pages, &self.components),
                Some((path, further)) => further.decode(path, &pages, &self.components),
            }
        };
        let decoded = self
            .slices
            .iter()
            .map(|slices| decode::joined(slices.chunk_by(|a, b| a.file == b.file).map(run)));
        Ok(decoded
            .collect::<Result<Vec<_>, Error>>()?
            .into_iter()
            .flatten()
            .collect())
    }
}

fn chosen_channels(choice: &[usize], axes: &ImageAxes) -> Result<Vec<usize>, Fault> {
    let count = axes.channels.len();
    if let Some(index) = choice.iter().find(|&&index| index >= count) {
        return Err(Fault::Option(format!(
            "component={index}: the image has {count} channel(s), counted from 0"
        )));
    }
    if choice.is_empty() {
        return Err(Fault::Unsupported(format!(
            "the image has {count} channels ({}): choose one with component=N, from 0 to {}",
            axes.numbered_names(),
            count - 1
        )));
    }
    Ok(choice.to_vec())
}

/// The slices read so far.
struct Stack {
    kind: Kind,
    depth: usize,
    voxels: Vec<Voxels>,
    spacing: [f64; 3],
    unit: Option<String>,
}

impl Stack {
    fn begin(part: &Part, path: &Path) -> Result<Self, Error> {
        Ok(Self {
            kind: part.pages.kind,
            depth: part.slices[0].len(),
            voxels: part.decode(path)?,
            spacing: part.spacing,
            unit: part.unit.clone(),
        })
    }

    fn add(&mut self, part: &Part, path: &Path) -> Result<(), Error> {
        let kind = part.pages.kind;
        if kind != self.kind {
            let what = format!(
                "a slice of {kind}, but the slices before it are {}",
                self.kind
            );
            return Err(invalid(path, what));
        }
        let slices = part.decode(path)?;
        for (voxels, slices) in self.voxels.iter_mut().zip(slices) {
            if !decode::same_type(voxels, &slices) {
                return Err(invalid(
                    path,
                    "a slice of another number type than the slices before it",
                ));
            }
            decode::append(voxels, slices);
        }
        self.depth += part.slices[0].len();
        Ok(())
    }
}

#[cfg(test)]
mod tests;
