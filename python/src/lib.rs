//! The compiled part of the Python package `forward_resample`.
//!
//! Takes contiguous arrays and the options of a command by name, gives pictures as arrays. Options are turned into the
//! words of the command line and parsed by its own types, so that there is no list of them here. What duck typing,
//! colour maps and notebooks need is written in Python, in `lib/`.
//!
//! `words` makes words of keyword arguments; `volume`, `gaussians`, `mesh`, `depth` and `points` make scenes of arrays; `scene` draws them, `film` one after another;
//! `work` waits for threads that draw while Python goes on; `picture` hands pictures over; `fault` turns errors into
//! exceptions.

mod depth;
mod fault;
mod film;
mod gaussians;
mod mesh;
mod picture;
mod points;
mod scene;
mod session;
mod volume;
mod words;
mod work;

use pyo3::prelude::*;

/// The compiled part of `forward_resample`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::film::Film;
    #[pymodule_export]
    use super::picture::{png, save, srgb8, write_film};
    #[pymodule_export]
    use super::scene::{Scene, Viewer, check, vector_level};
    #[pymodule_export]
    use super::words::{kinds, options};

    /// The version of the program whose pictures these are.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name that Python expects")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
