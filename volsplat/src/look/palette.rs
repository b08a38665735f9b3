//! The labels of one volume as small numbers: what bricks of a label map store, and the entries that they stand for.
//!
//! Number 0 stands for every label that is not drawn; the labels that are drawn have the numbers from 1 on, in ascending
//! order. So a label map takes the place of a scalar field, and its entries that of a transfer function's table.

use std::collections::BTreeSet;

use rayon::prelude::*;
use resample_core::OpacityMode;
use resample_volume::labels::{LabelTable, MAX_LABELS};
use resample_volume::volume::{Volume, scalar, with_voxels};

use crate::Error;
use crate::look::transfer::strength_of;

/// The labels of a volume that are drawn.
#[derive(Clone, Debug)]
pub(crate) struct Palette {
    labels: Vec<i64>,
    looks: Vec<resample_volume::labels::LabelLook>,
}

/// Largest label whose neighbours f64 can tell apart.
const MAX_LABEL: f64 = 9_007_199_254_740_992.0;

impl Palette {
    /// The labels that occur in the volume and are drawn. [`Error::Option`] where a voxel is no whole number, or where
    /// there are more than [`MAX_LABELS`].
    pub(crate) fn new(volume: &Volume, table: &LabelTable) -> Result<Self, Error> {
        let parts = volume.voxels.parts().into_par_iter().map(|part| {
            with_voxels!(&volume.voxels, slice => labels_of(slice[part].iter().map(|&v| scalar(v))))
        });
        let found = parts.reduce(
            || Ok(BTreeSet::new()),
            |a, b| {
                let (mut a, b) = (a?, b?);
                a.extend(b);
                check_count(&a).map(|()| a)
            },
        )?;
        let (labels, looks) = found
            .into_iter()
            .map(|label| (label, table.look(label)))
            .filter(|(_, look)| look.opacity > 0.0)
            .unzip();
        Ok(Self { labels, looks })
    }

    /// The number of a voxel's label.
    #[inline]
    pub(crate) fn number(&self, value: f64) -> f32 {
        self.labels
            .binary_search(&(value as i64))
            .map_or(0.0, |place| (place + 1) as f32)
    }

    /// Colour and strength by number.
    pub(crate) fn entries(&self, opacity: OpacityMode) -> Vec<[f32; 4]> {
        let entry = |look: &resample_volume::labels::LabelLook| {
            let [r, g, b] = look.rgb;
            [r, g, b, strength_of(look.opacity, opacity)]
        };
        std::iter::once([0.0; 4])
            .chain(self.looks.iter().map(entry))
            .collect()
    }
}

/// Neighbours in a label map are mostly alike, so that only changes are looked up.
fn labels_of(values: impl Iterator<Item = f64>) -> Result<BTreeSet<i64>, Error> {
    let mut found = BTreeSet::new();
    let mut last = f64::NAN;
    for value in values {
        if value == last {
            continue;
        }
        if value.fract() != 0.0 || value.abs() > MAX_LABEL {
            return Err(Error::Option(format!(
                "a voxel of the label map is {value}: labels are whole numbers; as scalars it is drawn by a transfer \
                 function"
            )));
        }
        found.insert(value as i64);
        last = value;
        if found.len() > MAX_LABELS {
            break;
        }
    }
    check_count(&found).map(|()| found)
}

fn check_count(found: &BTreeSet<i64>) -> Result<(), Error> {
    if found.len() <= MAX_LABELS {
        return Ok(());
    }
    Err(Error::Option(format!(
        "the label map has more than {MAX_LABELS} labels: is it one? As scalars it is drawn by a transfer function"
    )))
}
