//! Stacks of TIFF pictures: one file of many pages, or many files of one page.
//!
//! Takes paths in the order of the slices, gives the parts of a volume. First every page is looked at (`pages.rs`): all
//! must have the same size and type, and the file must be able to hold them; only then are they decoded. Spacing is
//! taken from the notes of ImageJ or OME in the first page (`description.rs`), else it is 1: the resolution alone is
//! meant for printers. Source: TIFF 6.0 and BigTIFF; the decoder is the crate `tiff`.
//! Limits: grey values of 8 to 64 bits, half precision included; of colours of 8 or 16 bits one component, interleaved; no palettes;
//! one channel, one time.

use std::path::{Path, PathBuf};

use glam::DVec3;
use resample_io::Gate;

use crate::Error;
use crate::input::decode::axes;
use crate::input::decode::component::chosen;
use crate::input::{Parts, decode, invalid};
use crate::volume::{Lattice, Voxels};

mod description;
mod pages;

use pages::{Kind, Pages};

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

/// Reads the slices of one file or of several; of colours, one component.
pub(crate) fn load(
    paths: &[PathBuf],
    component: Option<usize>,
    gate: &Gate,
) -> Result<Parts, Error> {
    let mut stack: Option<Stack> = None;
    let mut bytes = 0u64;
    for path in paths {
        let pages = Pages::look_at(path, paths.len())?;
        bytes = bytes.saturating_add(pages.bytes());
        let asked = gate
            .ask_unpacked(pages.bytes(), pages.held, "the pages")
            .and_then(|()| gate.ask(bytes, "the slices"));
        asked.map_err(|what| invalid(path, what))?;
        let component = chosen(component, pages.kind.components).map_err(|fault| fault.at(path))?;
        match &mut stack {
            None => stack = Some(Stack::begin(&pages, path, component)?),
            Some(stack) => stack.add(&pages, path)?,
        }
    }
    let stack = stack.ok_or_else(|| invalid(Path::new(""), "no slices"))?;
    Ok(Parts {
        lattice: Lattice {
            // Rows run from the top of a picture down.
            up_hint: Some(DVec3::NEG_Y),
            ..Lattice::unnamed(
                [stack.kind.width, stack.kind.height, stack.depth],
                axes::upright(stack.spacing, [0.0; 3]),
            )
        },
        voxels: stack.voxels,
    })
}

/// The slices read so far.
struct Stack {
    kind: Kind,
    /// The one that is read.
    component: usize,
    depth: usize,
    voxels: Voxels,
    spacing: [f64; 3],
}

impl Stack {
    fn begin(pages: &Pages, path: &Path, component: usize) -> Result<Self, Error> {
        let spacing = pages.spacing().map_err(|fault| fault.at(path))?;
        Ok(Self {
            kind: pages.kind,
            component,
            depth: pages.count,
            voxels: pages.decode(path, component)?,
            spacing,
        })
    }

    fn add(&mut self, pages: &Pages, path: &Path) -> Result<(), Error> {
        if pages.kind != self.kind {
            let what = format!(
                "a slice of {}, but the slices before it are {}",
                pages.kind, self.kind
            );
            return Err(invalid(path, what));
        }
        let slices = pages.decode(path, self.component)?;
        if !decode::same_type(&self.voxels, &slices) {
            return Err(invalid(
                path,
                "a slice of another number type than the slices before it",
            ));
        }
        decode::append(&mut self.voxels, slices);
        self.depth += pages.count;
        Ok(())
    }
}

#[cfg(test)]
mod tests;
