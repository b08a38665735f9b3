//! The lattices of samples that are drawn together: voxels, or whole cells and their parts.
//!
//! A layer is a lattice with its samples and with the clip in its own indices. One kernel serves all of them: each uses it
//! at its own spacing, so that samples of half the side have a kernel of half the radius.

use glam::DVec3;
use resample_volume::volume::Volume;

use crate::Error;
use crate::bricks::cells::WithGradients;
use crate::bricks::plan::gradients;
use crate::grid::bounds::Bounds;
use crate::look::clip::{Clip, GridClip, bounds_in_world};
use crate::look::options::{Cells, RenderOptions, SampleOptions, SampleOrder};
use crate::look::scene::{Channel, Look, Scene};
use crate::paper::samples::cell_samples::{Parts, cell_samples};
use crate::paper::samples::sample::Samples;

/// The samples of one lattice.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    pub(crate) samples: Samples,
    pub(crate) clip: GridClip,
    /// How often the first layer's spacing is halved.
    pub(crate) halvings: u32,
}

/// The cells that the options select in a scene: [`Cells::Auto`] decided. Cells of a single slice have no volume.
pub(crate) fn cells_of(scene: &Scene, samples: &SampleOptions) -> Cells {
    match samples.cells {
        _ if scene.grid().dims.contains(&1) => Cells::Off,
        Cells::Auto if samples.order == SampleOrder::EverySample => Cells::SPLIT,
        Cells::Auto => Cells::Off,
        chosen => chosen,
    }
}

/// The layers of a scene, coarse to fine, with the clip of the options. [`Error::Option`] where samples are to be lit that
/// have no gradient, or a label map has too many labels.
pub(crate) fn layers(
    scene: &Scene,
    options: &RenderOptions,
    samples: &SampleOptions,
) -> Result<Vec<Layer>, Error> {
    let mut lattices = match cells_of(scene, samples) {
        Cells::Split { error } => cell_samples(scene, options, Parts::Split { error })?,
        Cells::Mean => cell_samples(scene, options, Parts::Whole)?,
        Cells::Off | Cells::Auto => vec![Samples::of_scene(scene, options.opacity)],
    };
    if gradients(options) == WithGradients::Yes {
        let volume = lit_volume(scene)?;
        lattices
            .iter_mut()
            .for_each(|samples| samples.set_gradients_of(volume));
    }
    let layer = |(halvings, samples): (_, Samples)| {
        let clip = samples.clip(&options.clip);
        Layer {
            samples,
            clip,
            halvings,
        }
    };
    Ok((0..).zip(lattices).map(layer).collect())
}

/// The scalars whose gradient lights the samples.
fn lit_volume<'a>(scene: &Scene<'a>) -> Result<&'a Volume, Error> {
    match scene.channels.as_slice() {
        &[Channel { volume, look: Look::Transfer(_) }] => Ok(volume),
        _ => Err(Error::Option(
            "samples are lit by the gradient of one channel of scalars: draw several channels and labels as a field, or leave \
             out the shading and the opacity by the gradient"
                .into(),
        )),
    }
}

/// The box, in the world, of the samples that are drawn.
pub(crate) fn layers_in_world(layers: &[Layer]) -> Option<[DVec3; 2]> {
    let boxes = layers.iter().filter_map(|layer| {
        bounds_in_world(layer.bounds(), &layer.clip, &layer.samples.world_from_index)
    });
    boxes.reduce(|[low, high], [l, h]| [low.min(l), high.max(h)])
}

impl Layer {
    /// Changes the kept part of the volume.
    pub(crate) fn update_clip(&mut self, clip: &Clip) {
        self.clip = self.samples.clip(clip);
    }

    /// The places of the layer's bricks.
    pub(crate) fn bounds(&self) -> impl Iterator<Item = Bounds> + '_ {
        self.samples.bricks.iter().map(|brick| brick.bounds)
    }
}
