//! Choices by name: the enums of the command line, paired with those of the libraries.
//!
//! Each table is used in both directions: from the word that was typed to the library's value, and from a value
//! (a default, or what a stats file reports) back to its word. So a name and a default are written down once.

pub(crate) mod warp;

use clap::ValueEnum;
use resample_core::{FootprintMode, KernelShape, OpacityMode, Projection, SelectMode};
use volsplat::transfer::ColourEncoding;
use volsplat::{Cells, Classify, ColourBy, Interpolate, Order, Shading, SheetKernel, SheetSums};

use crate::args::{
    CellsArg, ClassifyArg, ColourByArg, FootprintArg, InterpolateArg, KernelArg, OpacityArg,
    OrderArg, ProjectionArg, SelectArg, ShadeArg, SheetSumsArg, SpaceArg, VolumeLayerArg,
};

/// Pairs of a command line's value and a library's value; each of either occurs once.
pub(crate) struct Twins<A: 'static, L: 'static>(&'static [(A, L)]);

/// `--order`
pub(crate) const ORDER: Twins<OrderArg, Order> = Twins(&[
    (OrderArg::ImageSheets, Order::ImageSheets),
    (OrderArg::EverySample, Order::EverySample),
    (OrderArg::AxisSheets, Order::AxisSheets),
]);

/// `--sheet-sums`
pub(crate) const SHEET_SUMS: Twins<SheetSumsArg, SheetSums> = Twins(&[
    (SheetSumsArg::Gather, SheetSums::Gather),
    (SheetSumsArg::Scatter, SheetSums::Scatter),
]);

/// `--shade`
pub(crate) const SHADE: Twins<ShadeArg, Shading> = Twins(&[
    (ShadeArg::None, Shading::None),
    (ShadeArg::Lambert, Shading::Lambert),
    (ShadeArg::Phong, Shading::Phong),
]);

/// `--opacity`
pub(crate) const OPACITY: Twins<OpacityArg, OpacityMode> = Twins(&[
    (OpacityArg::Extinction, OpacityMode::Extinction),
    (OpacityArg::Linear, OpacityMode::Linear),
]);

/// `--footprint`
pub(crate) const FOOTPRINT: Twins<FootprintArg, FootprintMode> = Twins(&[
    (FootprintArg::AffineApprox, FootprintMode::AffineApprox),
    (FootprintArg::Affine, FootprintMode::Affine),
    (FootprintArg::Table, FootprintMode::Table),
    (FootprintArg::Exact, FootprintMode::Exact),
]);

/// `--classify`
pub(crate) const CLASSIFY: Twins<ClassifyArg, Classify> = Twins(&[
    (ClassifyArg::Pre, Classify::Pre),
    (ClassifyArg::Post, Classify::Post),
]);

/// `--cells`
pub(crate) const CELLS: Twins<CellsArg, Cells> = Twins(&[
    (CellsArg::Auto, Cells::Auto),
    (CellsArg::Off, Cells::Off),
    (CellsArg::Mean, Cells::Mean),
    (CellsArg::Split, Cells::Split),
]);

/// `--interpolate`
pub(crate) const INTERPOLATE: Twins<InterpolateArg, Interpolate> = Twins(&[
    (InterpolateArg::Off, Interpolate::Off),
    (InterpolateArg::On, Interpolate::On),
]);

/// `--kernel`
pub(crate) const KERNEL: Twins<KernelArg, SheetKernel> = Twins(&[
    (KernelArg::Trilinear, SheetKernel::Trilinear),
    (
        KernelArg::Gaussian,
        SheetKernel::Radial(KernelShape::Gaussian),
    ),
    (
        KernelArg::Polynomial,
        SheetKernel::Radial(KernelShape::Polynomial),
    ),
    (
        KernelArg::BSpline,
        SheetKernel::Radial(KernelShape::BSpline),
    ),
]);

/// `--select`
pub(crate) const SELECT: Twins<SelectArg, SelectMode> = Twins(&[
    (SelectArg::Hybrid, SelectMode::Hybrid),
    (SelectArg::Points, SelectMode::Points),
    (SelectArg::Splats, SelectMode::Splats),
    (SelectArg::Ewa, SelectMode::Ewa),
]);

/// `--colour-by`
pub(crate) const COLOUR_BY: Twins<ColourByArg, ColourBy> = Twins(&[
    (ColourByArg::Transfer, ColourBy::Transfer),
    (ColourByArg::Select, ColourBy::Select),
]);

/// `--transfer-space`
pub(crate) const SPACE: Twins<SpaceArg, ColourEncoding> = Twins(&[
    (SpaceArg::Linear, ColourEncoding::Linear),
    (SpaceArg::Srgb, ColourEncoding::Srgb),
]);

/// `--projection`
pub(crate) const PROJECTION: Twins<ProjectionArg, Projection> = Twins(&[
    (ProjectionArg::Perspective, Projection::Perspective),
    (ProjectionArg::Orthographic, Projection::Orthographic),
]);

/// `--layers` of volsplat
pub(crate) const VOLUME_LAYER: Twins<VolumeLayerArg, volsplat::Layer> = Twins(&[
    (VolumeLayerArg::FirstHit, volsplat::Layer::FirstHit),
    (VolumeLayerArg::Normal, volsplat::Layer::Normal),
    (VolumeLayerArg::Samples, volsplat::Layer::Samples),
    (VolumeLayerArg::Selection, volsplat::Layer::Selection),
]);

/// The word for a value that a library itself gives the command line.
pub(crate) fn name(value: impl ValueEnum) -> String {
    let value = value.to_possible_value();
    value
        .expect("no value is hidden from the command line")
        .get_name()
        .to_owned()
}

impl<A: Copy + PartialEq + ValueEnum, L: Copy + PartialEq> Twins<A, L> {
    /// The library's value for what was typed.
    pub(crate) fn library(&self, arg: A) -> L {
        let pair = self.0.iter().find(|pair| pair.0 == arg);
        pair.expect("a table holds every value of its enum, which a test checks")
            .1
    }

    /// The command line's value for a library's.
    pub(crate) fn arg(&self, value: L) -> A {
        let pair = self.0.iter().find(|pair| pair.1 == value);
        pair.expect("a table holds every value of its enum, which a test checks")
            .0
    }

    /// The word for a library's value.
    pub(crate) fn name(&self, value: L) -> String {
        let value = self.arg(value).to_possible_value();
        value
            .expect("no value is hidden from the command line")
            .get_name()
            .to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn check<A: Copy + PartialEq + ValueEnum, L: Copy + PartialEq>(
        twins: &Twins<A, L>,
        names: &[&str],
    ) {
        assert_eq!(
            twins.0.len(),
            A::value_variants().len(),
            "a value is missing in the table of {names:?}"
        );
        for (arg, name) in A::value_variants().iter().zip(names) {
            let value = twins.library(*arg);
            assert!(twins.arg(value) == *arg, "{name} must come back as itself");
            assert_eq!(&twins.name(value), name, "the word of the command line");
        }
    }

    #[test]
    fn every_choice_has_its_twin_and_its_name() {
        check(&ORDER, &["image-sheets", "every-sample", "axis-sheets"]);
        check(&SHADE, &["none", "lambert", "phong"]);
        check(&SHEET_SUMS, &["gather", "scatter"]);
        check(&OPACITY, &["extinction", "linear"]);
        check(&FOOTPRINT, &["affine-approx", "affine", "table", "exact"]);
        check(&CLASSIFY, &["pre", "post"]);
        check(&INTERPOLATE, &["off", "on"]);
        check(&CELLS, &["auto", "off", "mean", "split"]);
        check(
            &KERNEL,
            &["trilinear", "gaussian", "polynomial", "b-spline"],
        );
        check(&SELECT, &["hybrid", "points", "splats", "ewa"]);
        check(&COLOUR_BY, &["transfer", "select"]);
        check(&SPACE, &["linear", "srgb"]);
        check(&PROJECTION, &["perspective", "orthographic"]);
        check(
            &VOLUME_LAYER,
            &["first-hit", "normal", "samples", "selection"],
        );
    }
}
