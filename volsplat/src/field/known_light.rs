//! The light at the vertices of a field's bricks that is known, and what makes it unknown again.

use crate::look::options::{LightGrid, RenderOptions};
use crate::shadow::coarse::CoarseField;
use crate::shadow::tables::Reaching;

/// The light at the vertices of the bricks, as far as it is known.
#[derive(Clone, Debug, Default)]
pub(super) struct FieldLight {
    /// On the grid that was asked for.
    pub(super) whole: Reaching,
    grid: LightGrid,
    /// On a coarse one, while pictures move and the other is not known.
    pub(super) moving: Reaching,
    /// Matter on the grid that light was found on last, where that is not the volume's own.
    pub(super) coarse: Option<CoarseField>,
}

impl FieldLight {
    /// No light yet; `grid` is that which the options ask for.
    pub(super) fn none(grid: LightGrid) -> Self {
        Self {
            grid: match grid {
                LightGrid::AtHand => LightGrid::Auto,
                asked => asked,
            },
            ..Self::default()
        }
    }

    /// Forgets the light, and the matter that it was found in.
    pub(super) fn forget(&mut self) {
        self.forget_reaching();
        self.coarse = None;
    }

    /// Forgets the light, and not the matter.
    pub(super) fn forget_reaching(&mut self) {
        self.whole = Reaching::default();
        self.moving = Reaching::default();
    }

    /// Takes options that may ask for other light.
    pub(super) fn update(&mut self, before: &RenderOptions, options: &RenderOptions) {
        let both = [&mut self.whole, &mut self.moving];
        let changes_sun = before.shadow != options.shadow || before.light != options.light;
        let of_sky = |options: &RenderOptions| {
            let RenderOptions {
                occlusion, shading, ..
            } = options;
            (*occlusion, *shading, options.shadow.is_some())
        };
        let changes_sky = of_sky(before) != of_sky(options);
        for light in both {
            light.sun = light.sun.take().filter(|_| !changes_sun);
            light.sky = light.sky.take().filter(|_| !changes_sky);
        }
        let asked = options.light_grid;
        if asked != LightGrid::AtHand && asked != self.grid {
            self.forget();
            self.grid = asked;
        }
    }

    /// The light that is drawn.
    pub(super) fn drawn(&self, options: &RenderOptions) -> &Reaching {
        let lacks_some = (options.shadow.is_some() && self.whole.sun.is_none())
            || (options.occlusion.is_some() && self.whole.sky.is_none());
        match options.light_grid {
            LightGrid::AtHand if lacks_some => &self.moving,
            _ => &self.whole,
        }
    }
}
