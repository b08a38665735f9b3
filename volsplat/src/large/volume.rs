//! A volume that is larger than memory: the voxels stay in their file, and a summary of them fits.
//!
//! Takes a source of voxels, reads it once from end to end, and keeps its place in the world, the counts of its values,
//! and the least and greatest scalar of every brick of cells. A transfer function then decides which bricks can be seen
//! without another look at the source. It is read in blocks of bricks that fit the memory.

use std::sync::Arc;

use resample_volume::Watch;
use resample_volume::source::VoxelSource;
use resample_volume::volume::{Described, Lattice, VoxelType};

use super::blocks::bricks_along;
use super::survey::Survey;
use crate::Error;
use crate::bricks::cells::CellBrick;
use crate::bricks::plan::gradients;
use crate::bricks::rescale::Narrowing;
use crate::look::options::RenderOptions;
use crate::look::transfer::Histogram;

/// A volume whose voxels stay in their file.
#[derive(Debug)]
pub struct LargeVolume {
    lattice: Lattice,
    source: Arc<dyn VoxelSource>,
    survey: Survey,
    max_memory: u64,
}

impl LargeVolume {
    /// Reads a source once, holding at most about `max_memory` bytes.
    ///
    /// [`Error::Option`] where `max_memory` is too little for any brick-wise work, or the lattice is degenerate.
    pub fn new(
        lattice: Lattice,
        source: Arc<dyn VoxelSource>,
        max_memory: u64,
        watch: &mut Watch,
    ) -> Result<Self, Error> {
        lattice.check()?;
        let survey = Survey::new(source.as_ref(), max_memory, watch)?;
        Ok(Self {
            lattice,
            source,
            survey,
            max_memory,
        })
    }

    /// Reads a volume file once, holding at most about `max_memory` bytes.
    ///
    /// `None` for a file that has to be unpacked as a whole, which [`crate::load`] does. Errors are those of
    /// [`crate::load`]; [`Error::Option`] also where `max_memory` is too little for any brick-wise work, and where the
    /// temporary file of a Zarr array has no room.
    #[cfg(feature = "input")]
    pub fn open(
        path: &std::path::Path,
        options: &crate::LoadOptions,
        max_memory: u64,
        watch: &mut Watch,
    ) -> Result<Option<Self>, Error> {
        // Unpacking, where there is any, is the first half of the work.
        let mut begun = 0.0;
        let mut unpacking = |share: f64| {
            begun = 0.5;
            watch(begun * share);
        };
        let opened =
            resample_volume::input::open_unread(path, options, max_memory, &mut unpacking)?;
        let Some(unread) = opened else {
            return Ok(None);
        };
        let mut reading = |share| watch(begun + (1.0 - begun) * share);
        Self::new(unread.lattice, unread.source, max_memory, &mut reading).map(Some)
    }

    /// Bytes that the voxels take in the file.
    pub fn bytes(&self) -> u64 {
        self.lattice.len() as u64 * self.source.voxel_type().bytes() as u64
    }

    /// The memory that was allowed, bytes.
    pub fn max_memory(&self) -> u64 {
        self.max_memory
    }

    pub(crate) fn source(&self) -> &Arc<dyn VoxelSource> {
        &self.source
    }

    /// The rescaling of its scalars.
    pub(crate) fn narrowing(&self) -> Narrowing {
        self.survey.narrowing
    }

    /// Least and greatest scalar, as they are drawn.
    pub(crate) fn drawn_range(&self) -> (f64, f64) {
        self.survey.narrowing.range(self.survey.range)
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
        match self.source.voxel_type() {
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

/// Most memory that image sheets take beside the voxels, bytes: the bricks of a volume that is visible everywhere.
pub fn most_brick_bytes(lattice: &Lattice, voxel_type: VoxelType, options: &RenderOptions) -> u64 {
    // A forged size may be beyond all counting; no memory is as large.
    let along = bricks_along(lattice.dims).into_iter();
    let bricks = along.fold(1u64, |count, bricks| count.saturating_mul(bricks as u64));
    bricks.saturating_mul(CellBrick::bytes(voxel_type, gradients(options)))
}
