//! The choices of `resample warp3d` by name.

use warp3d::input::DepthKind;

use super::Twins;
use crate::args::DepthKindArg;

/// `--depth-kind`
pub(crate) const DEPTH_KIND: Twins<DepthKindArg, DepthKind> = Twins(&[
    (DepthKindArg::Z, DepthKind::Z),
    (DepthKindArg::Ray, DepthKind::Ray),
    (DepthKindArg::Disparity, DepthKind::Disparity),
    (DepthKindArg::Inverse, DepthKind::Inverse),
    (DepthKindArg::Mpeg, DepthKind::Mpeg),
    (DepthKindArg::Opengl, DepthKind::OpenGl),
]);

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use super::*;

    #[test]
    fn every_choice_has_its_twin_and_its_name() {
        check(
            &DEPTH_KIND,
            &["z", "ray", "disparity", "inverse", "mpeg", "opengl"],
        );
    }
}
