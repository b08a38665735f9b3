//! The choices of `resample warp3d` by name.

use warp3d::input::DepthKind;
use warp3d::{Blend, Fill, Method, MixedPixels, Visibility};

use super::Twins;
use crate::args::{BlendArg, DepthKindArg, FillArg, MethodArg, MixedArg, VisibilityArg};

/// `--method`
pub(crate) const METHOD: Twins<MethodArg, Method> = Twins(&[
    (MethodArg::Nearest, Method::Nearest),
    (MethodArg::Hybrid, Method::Hybrid),
    (MethodArg::Mesh, Method::Mesh),
    (MethodArg::Points, Method::Points),
    (MethodArg::Splats, Method::Splats),
    (MethodArg::Ewa, Method::Ewa),
]);

/// `--visibility`
pub(crate) const VISIBILITY: Twins<VisibilityArg, Visibility> = Twins(&[
    (VisibilityArg::Zbuffer, Visibility::ZBuffer),
    (VisibilityArg::OcclusionOrder, Visibility::OcclusionOrder),
]);

/// `--fill`
pub(crate) const FILL: Twins<FillArg, Fill> = Twins(&[
    (FillArg::None, Fill::None),
    (FillArg::Background, Fill::Background),
    (FillArg::Natural, Fill::Natural),
]);

/// `--mixed`
pub(crate) const MIXED: Twins<MixedArg, MixedPixels> = Twins(&[
    (MixedArg::Keep, MixedPixels::Keep),
    (MixedArg::Unmix, MixedPixels::Unmix),
]);

/// `--blend`
pub(crate) const BLEND: Twins<BlendArg, Blend> = Twins(&[
    (BlendArg::Weighted, Blend::Weighted),
    (BlendArg::Best, Blend::Best),
]);

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
            &METHOD,
            &["nearest", "hybrid", "mesh", "points", "splats", "ewa"],
        );
        check(&VISIBILITY, &["zbuffer", "occlusion-order"]);
        check(&FILL, &["none", "background", "natural"]);
        check(&MIXED, &["keep", "unmix"]);
        check(&BLEND, &["weighted", "best"]);
        check(
            &DEPTH_KIND,
            &["z", "ray", "disparity", "inverse", "mpeg", "opengl"],
        );
    }
}
