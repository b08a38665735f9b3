//! From a scene and options to what the field keeps: bricks of cells, the surface, the statistic.

use super::iso_rays::IsoSettings;
use super::ray_values::Statistic;
use crate::Error;
use crate::bricks::cells::CellField;
use crate::bricks::plan::plan;
use crate::look::options::{Blend, RenderOptions};
use crate::look::scene::{Look, Scene};
use crate::slabs::channel::ChannelSettings;

/// The bricks of a scene that are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kept {
    /// Those that may show something.
    Shown,
    /// All of them, where all channels are scalars: another look may show more.
    Whole,
}

/// The bricks of a scene.
pub(crate) fn cells(
    scene: &Scene,
    options: &RenderOptions,
    channels: &[ChannelSettings],
    kept: Kept,
) -> Result<CellField, Error> {
    let plan = plan(scene, options)?.tabulated(channels);
    let count = scene.count_visible();
    Ok(match kept {
        Kept::Whole if scene.transfers().is_some() => CellField::whole(&plan, count),
        Kept::Whole | Kept::Shown => CellField::new(&plan, count),
    })
}

/// The statistic that the options ask for.
pub(crate) fn statistic(options: &RenderOptions) -> Option<Statistic> {
    match options.blend() {
        Blend::Maximum => Some(Statistic::Greatest),
        Blend::Minimum => Some(Statistic::Least),
        Blend::Average => Some(Statistic::Mean),
        Blend::Emission | Blend::Isosurface(_) => None,
    }
}

/// The surface that the options ask for, without what depends on the camera.
pub(crate) fn iso(look: Look, options: &RenderOptions) -> Option<IsoSettings> {
    let Blend::Isosurface(iso) = options.blend() else {
        return None;
    };
    let own_colour = match look {
        Look::Transfer(transfer) => transfer.sample(iso.value).0,
        Look::Labels(_) | Look::Tint(_) => [1.0; 3],
    };
    let rgb = iso.colour.unwrap_or(own_colour);
    Some(IsoSettings {
        value: iso.value as f32,
        rgb,
        opacity: iso.opacity,
        step: 0.0,
    })
}
