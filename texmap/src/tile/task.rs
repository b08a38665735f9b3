//! The inputs that every stage of a tile reads, and the result of a tile.

use resample_core::Camera;
use resample_core::simd::Vectors;
use resample_mesh::scene::AlphaMode;

use crate::light::blocked::BlockedLight;
use crate::options::RenderOptions;
use crate::prepare::Prepared;
use crate::project::cull::{InView, ScreenTriangle, SeenTriangle};
use crate::project::surface::{Surface, TileView, UvPlanes};
use crate::screen::{BORDER_PX, Plane, SPAN_WIDTH, moved, narrow};
use crate::texture::ellipse::PixelOnTexture;
use crate::visibility::NearKey;
use crate::visibility::filter::PixelFilter;

/// Values shared by all tiles of a frame.
pub(crate) struct FrameView<'a> {
    pub(crate) scene: &'a Prepared,
    pub(crate) blocked: Option<&'a BlockedLight>,
    pub(crate) camera: &'a Camera,
    pub(crate) options: &'a RenderOptions,
    pub(crate) in_view: &'a InView,
    pub(crate) filter: &'a PixelFilter,
    pub(crate) near: NearKey,
    pub(crate) simd: Vectors,
}

/// The result of a tile and its cost.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileImage {
    /// Linear premultiplied colour, rows from the top; empty where the tile shows nothing.
    pub(crate) rgba: Vec<[f32; 4]>,
    /// The channels of the planes beside colour, one after another; empty where no plane is requested.
    pub(crate) planes: Vec<f32>,
    /// Triangles that some sub-pixel shows.
    pub(crate) drawn: Vec<u32>,
    pub(crate) points: u64,
    pub(crate) splats: u64,
    pub(crate) visibility_ms: f64,
    pub(crate) accumulate_ms: f64,
    pub(crate) resolve_ms: f64,
}

/// One tile of a frame and the triangles that touch it.
pub(crate) struct Tile<'a> {
    pub(crate) frame: &'a FrameView<'a>,
    pub(crate) view: TileView<'a>,
    pub(crate) list: &'a [u32],
}

impl Tile<'_> {
    pub(crate) fn triangle(&self, id: u32) -> ScreenTriangle {
        let FrameView {
            scene,
            camera,
            in_view,
            ..
        } = self.frame;
        in_view.triangle(scene, camera.projection, self.list[id as usize])
    }

    /// The triangle at a place of the list.
    pub(crate) fn seen(&self, id: u32) -> &SeenTriangle {
        &self.frame.in_view.triangles[self.list[id as usize] as usize]
    }

    /// The depth key over the tile.
    pub(crate) fn key_plane(&self, id: u32) -> Plane {
        narrow(moved(self.triangle(id).key, self.view.corner_px))
    }

    pub(crate) fn alpha_mode(&self, id: u32) -> AlphaMode {
        let mesh = &self.frame.scene.meshes[self.seen(id).mesh as usize];
        self.frame.scene.materials[mesh.material].alpha
    }

    /// The surface of a triangle; it is seen at `seen_px`.
    pub(crate) fn surface(&self, id: u32, seen_px: [f32; 2]) -> Box<Surface> {
        Box::new(Surface::new(&self.view, &self.triangle(id), seen_px))
    }

    /// A pixel on a texture of a surface.
    pub(crate) fn pixel_on(
        &self,
        surface: &Surface,
        (planes, pyramid): (&UvPlanes, usize),
        at: [f32; 2],
    ) -> PixelOnTexture<'_> {
        PixelOnTexture {
            pyramid: &self.frame.scene.pyramids[pyramid],
            at: surface.uv_at(planes, at),
            over_w_slope: surface.over_w_slope(at),
        }
    }
}

/// Position of a sub-pixel by its place in the tile.
#[inline(always)]
pub(crate) fn subpixel_px(filter: &PixelFilter, at: usize) -> [f32; 2] {
    filter.position_px(at % SPAN_WIDTH, at / SPAN_WIDTH)
}

/// Largest key that the near plane lets through.
pub(crate) fn near_key(camera: &Camera) -> NearKey {
    let key = match camera.projection {
        resample_core::Projection::Perspective => 1.0 / camera.near,
        resample_core::Projection::Orthographic => -camera.near,
    };
    NearKey(key as f32)
}

/// Position of the centre of pixel (x, y) of the tile, from the corner of its border.
pub(crate) fn centre_px([x, y]: [usize; 2]) -> [f32; 2] {
    [(x + BORDER_PX) as f32 + 0.5, (y + BORDER_PX) as f32 + 0.5]
}
