//! Volumes that are larger than memory: the voxels stay in their file, and what is known of them fits.
//!
//! Takes a file whose scalars lie in it plainly, reads it once from end to end, and keeps its place in the world, the
//! counts of its values, and the least and greatest scalar of every brick of cells. A transfer function then tells which
//! bricks can be seen without another look at the file. The file is read in blocks of bricks that fit the memory.
//! Limits: raw files, NRRD and MetaImage files with plain data, and Zarr, unpacked once into a temporary file; see
//! [`crate::Renderer::of_large`] for what draws them.

use std::path::Path;
use std::sync::Arc;

use crate::Error;
use crate::cells::CellBrick;
use crate::input::{self, LoadOptions, Stored, Unread, VoxelType, open_unread};
use crate::options::RenderOptions;
use crate::sheets;
use crate::transfer::Histogram;
use crate::volume::{Described, Lattice};

mod blocks;
mod survey;

pub(crate) use blocks::{Block, Rows, bricks_along};
use survey::Survey;

/// Is told how much of a long task is done, from 0 to 1, now and then.
pub type Watch<'a> = dyn FnMut(f64) + 'a;

/// A volume whose voxels stay in their file.
#[derive(Debug)]
pub struct LargeVolume {
    lattice: Lattice,
    stored: Arc<Stored>,
    survey: Survey,
    max_memory: u64,
}

impl LargeVolume {
    /// Reads a volume file once, holding at most about `max_memory` bytes.
    ///
    /// `None` for a file that has to be unpacked as a whole, which [`crate::load`] does. Errors are those of
    /// [`crate::load`]; [`Error::Option`] also where `max_memory` is too little for any brick-wise work, and where the
    /// temporary file of a Zarr array has no room.
    pub fn open(
        path: &Path,
        options: &LoadOptions,
        max_memory: u64,
        watch: &mut Watch,
    ) -> Result<Option<Self>, Error> {
        // Unpacking, where there is any, is the first half of the work.
        let mut begun = 0.0;
        let mut unpacking = |share: f64| {
            begun = 0.5;
            watch(begun * share);
        };
        let opened = open_unread(path, options, (max_memory, &mut unpacking))?;
        let Some(Unread { stored, lattice }) = opened else {
            return Ok(None);
        };
        let survey = Survey::new(&stored, max_memory, &mut |share| {
            watch(begun + (1.0 - begun) * share)
        })?;
        Ok(Some(Self {
            lattice,
            stored: Arc::new(stored),
            survey,
            max_memory,
        }))
    }

    /// Bytes that the voxels take in the file.
    pub fn bytes(&self) -> u64 {
        self.lattice.len() as u64 * self.stored.voxel_type().bytes() as u64
    }

    /// The memory that was allowed, bytes.
    pub fn max_memory(&self) -> u64 {
        self.max_memory
    }

    pub(crate) fn stored(&self) -> &Arc<Stored> {
        &self.stored
    }

    pub(crate) fn survey(&self) -> &Survey {
        &self.survey
    }
}

impl Described for LargeVolume {
    fn lattice(&self) -> Lattice {
        self.lattice.clone()
    }

    fn voxel_type(&self) -> VoxelType {
        match self.stored.voxel_type() {
            VoxelType::U64 | VoxelType::I64 => VoxelType::F64,
            held => held,
        }
    }

    fn value_range(&self) -> (f64, f64) {
        self.survey.range
    }

    fn histogram(&self) -> Histogram {
        self.survey.histogram.clone()
    }
}

/// The lattice and the voxel type of a file whose voxels can be read in parts, told without reading them; `None` for
/// other files.
pub fn peek(path: &Path, options: &LoadOptions) -> Result<Option<(Lattice, VoxelType)>, Error> {
    input::peek(path, options)
}

/// Most memory that image sheets take beside the voxels, bytes: the bricks of a volume that is visible everywhere.
pub fn most_brick_bytes(lattice: &Lattice, options: &RenderOptions) -> u64 {
    let bricks: usize = bricks_along(lattice.dims).iter().product();
    bricks as u64 * CellBrick::bytes(sheets::gradients(options))
}
