//! Refused options: numbers out of range, and choices that contradict one another.

use resample_core::SelectMode;

use crate::Error;
use crate::look::options::{
    Blend, Cells, Classify, FieldOptions, Interpolate, Isosurface, KernelSheets, Light, Order,
    RenderOptions, SampleOptions, Shading, Subpixels,
};

impl RenderOptions {
    /// Checks every number against its range, and the choices against one another.
    pub fn validate(&self) -> Result<(), Error> {
        match &self.order {
            Order::Field(field) => field.validate()?,
            Order::Samples(samples) => samples.validate()?,
        }
        if let Subpixels::Fixed(n) = self.subpixels {
            in_range(
                "the number of sub-pixels",
                f64::from(n),
                [1, 2, 4, 8, 16].contains(&n),
                "1, 2, 4, 8 or 16",
            )?;
        }
        self.validate_gradient()?;
        self.clip.validate()?;
        share("the least transmittance", self.min_transmittance)?;
        above_0(
            "the opacity unit",
            self.opacity_unit.unwrap_or(1.0),
            "a length",
        )
    }

    fn validate_gradient(&self) -> Result<(), Error> {
        let blend = self.blend();
        let is_statistic = matches!(blend, Blend::Maximum | Blend::Minimum | Blend::Average);
        if self.shading != Shading::None && is_statistic {
            return wrong("maximum, minimum and mean projections cannot be shaded");
        }
        if let Light::Towards(direction) = self.light
            && direction.try_normalize().is_none()
        {
            return wrong(format!(
                "the light comes from {direction}, expected a direction"
            ));
        }
        match self.gradient_opacity {
            Some([low, high]) if !(low >= 0.0 && low < high && high.is_finite()) => wrong(format!(
                "the ramp over the gradient is {low} to {high}, expected finite numbers from 0 on, rising"
            )),
            Some(_) if blend != Blend::Emission => {
                wrong("opacity by the gradient goes with emission only: leave out the other blend")
            }
            _ => Ok(()),
        }
    }
}

impl FieldOptions {
    fn validate(&self) -> Result<(), Error> {
        slab(self.slab_voxels)?;
        match self.blend {
            Blend::Isosurface(surface) => surface.validate(),
            _ => Ok(()),
        }
    }
}

impl Isosurface {
    fn validate(&self) -> Result<(), Error> {
        if !self.value.is_finite() {
            return wrong(format!(
                "the surface is at {}, expected a finite number",
                self.value
            ));
        }
        if !(self.opacity > 0.0 && self.opacity <= 1.0) {
            return wrong(format!(
                "the opacity of the surface is {}, expected above 0, at most 1",
                self.opacity
            ));
        }
        match self.colour {
            Some(rgb) if !rgb.iter().all(|c| c.is_finite() && *c >= 0.0) => wrong(format!(
                "the colour of the surface is {rgb:?}, expected finite numbers from 0 on"
            )),
            _ => Ok(()),
        }
    }
}

impl SampleOptions {
    fn validate(&self) -> Result<(), Error> {
        let threshold = f64::from(self.point_threshold_px);
        above_0("the point threshold", threshold, "pixels")?;
        above_0("the sheet thickness", self.sheet_voxels, "voxels")?;
        if let Cells::Split { error } = self.cells {
            share("the error of cells", error)?;
        }
        match self.sheets() {
            Some(sheets) => self.validate_sheets(sheets),
            None => Ok(()),
        }
    }

    fn validate_sheets(&self, sheets: &KernelSheets) -> Result<(), Error> {
        slab(sheets.slab_voxels)?;
        match (sheets.classify, self.cells, sheets.interpolate) {
            _ if self.select == SelectMode::Ewa => wrong(
                "EWA belongs to every-sample and axis sheets: image sheets take hybrid, splats or points",
            ),
            (Classify::Pre, _, Interpolate::On) => wrong(
                "kernels interpolate scalars: classify after the sum, or leave out interpolation",
            ),
            (Classify::Post, Cells::Mean | Cells::Split { .. }, _) => wrong(
                "cells are classified before they are drawn: pre-classify image sheets, or take every-sample or axis sheets",
            ),
            (Classify::Pre, Cells::Split { .. }, _) => wrong(
                "image sheets have one size of samples: take means of whole cells, or every-sample",
            ),
            _ => Ok(()),
        }
    }
}

fn wrong(what: impl Into<String>) -> Result<(), Error> {
    Err(Error::Option(what.into()))
}

fn in_range(name: &str, value: f64, is_good: bool, expected: &str) -> Result<(), Error> {
    if is_good {
        Ok(())
    } else {
        wrong(format!("{name} is {value}, expected {expected}"))
    }
}

fn above_0(name: &str, value: f64, unit: &str) -> Result<(), Error> {
    let is_good = value > 0.0 && value.is_finite();
    in_range(name, value, is_good, &format!("{unit} above 0"))
}

/// The field is smooth within a voxel: thinner slabs show nothing new, and take time in proportion to their number.
const THINNEST_SLAB: f64 = 1.0 / 1024.0;

fn slab(voxels: f64) -> Result<(), Error> {
    let is_good = voxels >= THINNEST_SLAB && voxels.is_finite();
    let expected =
        "1/1024 voxel or more: thinner ones show nothing new and take time in proportion";
    in_range("the slab thickness", voxels, is_good, expected)
}

fn share(name: &str, value: f32) -> Result<(), Error> {
    let value = f64::from(value);
    let is_good = (0.0..1.0).contains(&value);
    in_range(name, value, is_good, "0 or more, and less than 1")
}
