//! A frame's settings for projection and compositing: from the options, the camera and a layer.

use resample_core::composite::{DepthRule, IndexRule, TileSettings};
use resample_core::maps::MapSource;
use resample_core::tile::TileGrid;
use resample_core::{Camera, FootprintMode, GridView, SelectMode};

use super::every_sample::EverySample;
use crate::bricks::cull::ViewVolume;
use crate::grid::units::in_unit;
use crate::light::{GradientRamp, ShadeSettings};
use crate::look::options::{DepthPlane, SampleOrder};
use crate::paper::axis_sheets::SliceOrder;
use crate::paper::batches::Outlines;
use crate::paper::geometry::Lens;
use crate::paper::project::{ProjectSetup, SortKeys};
use crate::paper::samples::layer::Layer;
use crate::paper::samples::sample_light::SampleLight;

impl EverySample {
    /// Returns the extent of footprints beside their kernels' outlines.
    pub(crate) fn outlines(&self) -> Outlines {
        match (self.choices.select, self.choices.footprint) {
            (SelectMode::Ewa, _) | (_, FootprintMode::AffineApprox) => Outlines::Wider,
            _ => Outlines::Kernels,
        }
    }

    /// The maps of a layer; `camera` counts in [`Self::length`].
    pub(crate) fn maps(&self, layer: &Layer, camera: &Camera) -> MapSource {
        MapSource {
            view: GridView::new(
                camera,
                &in_unit(&layer.samples.world_from_index, self.length),
            ),
            radius: self.kernel.radius(),
            unit_in_world: self.opacity_unit,
            mode: self.evaluated_footprint(),
        }
    }

    /// The footprint that the tiles evaluate: EWA is affine by construction.
    pub(crate) fn evaluated_footprint(&self) -> FootprintMode {
        if self.choices.select == SelectMode::Ewa {
            FootprintMode::Affine
        } else {
            self.choices.footprint
        }
    }

    /// How a layer is projected, given its view and that of the first layer.
    pub(crate) fn project_setup(
        &self,
        layer: &Layer,
        maps: &MapSource,
        camera: &Camera,
        first: &GridView,
    ) -> ProjectSetup {
        let threshold = self.choices.point_threshold_px;
        ProjectSetup {
            lens: Lens::new(
                &maps.view,
                layer.halvings,
                &self.kernel,
                &self.choices,
                self.opacity_unit,
            ),
            view_volume: ViewVolume::new(camera, &maps.view, self.kernel.radius()),
            grid: TileGrid::new(camera.width as usize, camera.height as usize),
            select: self.choices.select,
            threshold2_px2: threshold * threshold,
            light: SampleLight::new(
                ShadeSettings::new(&self.options, camera),
                self.options
                    .gradient_opacity
                    .map(|ramp| GradientRamp::new(ramp, self.length)),
                camera,
                &maps.view,
                self.options.simd.resolve(),
            ),
            painting: self.painting,
            level: self.options.simd.resolve(),
            keys: match self.choices.order {
                SampleOrder::AxisSheets => {
                    SortKeys::Slice(SliceOrder::new(first, self.dims).halved(layer.halvings))
                }
                SampleOrder::EverySample | SampleOrder::ImageSheets(_) => SortKeys::Depth,
            },
            layer: layer.halvings as u8,
        }
    }

    pub(crate) fn tile_settings(&self, maps: &MapSource) -> TileSettings {
        let smallest = self.smallest_spacing;
        TileSettings {
            level: self.options.simd.resolve(),
            profile: self.profile,
            filter: self.filter.clone(),
            opacity: self.options.opacity,
            index: match maps.mode {
                FootprintMode::Table => IndexRule::ConeCorrected,
                _ => IndexRule::Direct,
            },
            depth: match self.options.depth {
                DepthPlane::None => DepthRule::Skip,
                DepthPlane::Expected => DepthRule::Expected,
            },
            sheet_thickness: (self.choices.sheet_voxels * smallest) as f32,
            min_transmittance: self.options.min_transmittance,
        }
    }
}
