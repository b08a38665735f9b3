//! A film that Python feeds: one picture and its depth after another, under options that are given once.

use std::ffi::OsString;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::ThreadPool;
use resample_cli::args::Drawing;
use resample_cli::args::words::content::Application;
use resample_cli::open::FedFilm;

use crate::picture::{Handed, handed};
use crate::session::{Drawn, Session};
use crate::work::{Done, pool, work};
use crate::{depth, fault, words};

/// A film that is drawn while it is fed.
#[pyclass(frozen)]
pub(crate) struct Film {
    fed: Arc<Mutex<FedFilm>>,
    pool: Option<Arc<ThreadPool>>,
}

#[pymethods]
impl Film {
    #[new]
    fn new(options: &Bound<'_, PyDict>, threads: Option<usize>) -> PyResult<Self> {
        let named = words::named(Application::Depth, options)?;
        let inputs = vec![OsString::from("colour"), OsString::from("depth")];
        let session = Session::new(Application::Depth, inputs, None);
        let made = session
            .drawing(&named)
            .and_then(|(drawing, _)| match drawing {
                Drawing::Warp3d(args) => FedFilm::new(*args),
                _ => anyhow::bail!("a film is drawn by warp3d"),
            });
        let fed = made.map_err(|error| fault::raised(&error))?;
        Ok(Self {
            fed: Arc::new(Mutex::new(fed)),
            pool: pool(threads)?,
        })
    }

    /// Draws the next picture.
    fn next<'py>(
        &self,
        py: Python<'py>,
        picture: depth::Arrays<'py>,
    ) -> PyResult<(Handed<'py>, Vec<String>)> {
        let picture = depth::picture(&picture)?;
        let fed = self.fed.clone();
        let Done { value, lines } = work(py, self.pool.clone(), None, move |_| {
            let drawn = fed
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .next(picture)?;
            Ok(Drawn {
                image: drawn.image,
                stats: drawn.account.keys,
            })
        })?;
        Ok((handed(py, value)?, lines))
    }
}
