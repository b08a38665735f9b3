//! The next step of a tile: a brick on the screen, with the frame's settings and the tile's view.

use super::iso_rays::AnchoredRays;
use super::settings::FieldSettings;
use super::uniform::Uniform;
use crate::bricks::cells::CellBrick;
use crate::sheets::view::TileView;

/// A brick as the tiles need it, from the view alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedBrick<'a> {
    pub(crate) brick: &'a CellBrick,
    /// Where it is crossed in one step: its colour.
    pub(crate) uniform: Option<Uniform>,
    /// Planes first..end that cut the box of its visible cells.
    pub(crate) planes: [u32; 2],
    /// Pixel columns first..end and rows first..end that the box covers.
    pub(crate) columns: [u16; 2],
    pub(crate) rows: [u16; 2],
    /// Camera x and y of the middle of the brick.
    pub(crate) middle: [f32; 2],
    /// Its camera z, relative to the anchor's.
    pub(crate) middle_z: f32,
    /// The half-spaces of the clip that cut the box, by their bits.
    pub(crate) cuts: u32,
}

/// A brick, with the frame's settings and the tile's view.
#[derive(Clone, Copy)]
pub(super) struct Job<'a> {
    pub(super) settings: &'a FieldSettings,
    pub(super) view: &'a TileView,
    pub(super) placed: &'a PlacedBrick<'a>,
    /// The tile's rays in the grid; only where a surface is drawn.
    pub(super) iso_rays: Option<&'a AnchoredRays>,
}
