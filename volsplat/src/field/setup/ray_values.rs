//! Values of a tile's rays so far, for projections.

use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;

use crate::slabs::channel::ChannelSettings;

/// The scalar of a ray that is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Statistic {
    Greatest,
    Least,
    Mean,
}

/// Values of a tile's rays so far, of one channel.
#[derive(Clone, Debug)]
pub(crate) struct RayValues {
    /// The greatest or least scalar, or the sum of all.
    pub(crate) values: TilePlane,
    /// Camera z of that sample, or the sum of all.
    pub(crate) depths: TilePlane,
    /// Samples.
    pub(crate) counts: TilePlane,
}

impl RayValues {
    pub(crate) fn new(statistic: Statistic) -> Self {
        let zero = [[0.0; TILE_PX]; TILE_PX];
        let start = match statistic {
            Statistic::Greatest => f32::NEG_INFINITY,
            Statistic::Least => f32::INFINITY,
            Statistic::Mean => 0.0,
        };
        Self {
            values: [[start; TILE_PX]; TILE_PX],
            depths: zero,
            counts: zero,
        }
    }
}

/// The values of all channels before any sample; none where no statistic is shown.
pub(crate) fn at_start(
    statistic: Option<Statistic>,
    channels: &[ChannelSettings],
) -> Vec<RayValues> {
    statistic.map_or(Vec::new(), |statistic| {
        channels.iter().map(|_| RayValues::new(statistic)).collect()
    })
}
