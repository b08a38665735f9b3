//! Densities of molecules and crystals: maps of microscopes (`mrc`), and grids of quantum chemistry (`cube`).

pub(crate) mod cube;
pub(crate) mod mrc;
