//! The next step of a tile: a brick on the screen, with the frame's settings and the tile's view.

use super::iso_rays::AnchoredRays;
use super::settings::FieldSettings;
use crate::bricks::cells::CellBrick;
use crate::field::setup::constant_brick::Uniform;
use crate::slabs::view::TileView;

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
pub(crate) struct TileContext<'a> {
    pub(crate) settings: &'a FieldSettings,
    pub(crate) view: &'a TileView,
    pub(crate) placed: &'a PlacedBrick<'a>,
    /// The tile's rays in the grid; only where bricks are walked along them.
    pub(crate) rays: Option<&'a AnchoredRays>,
}
