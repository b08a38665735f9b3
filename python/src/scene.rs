//! A scene of Python: arrays or files, drawn under options that are given by name.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use clap::ValueEnum;
use numpy::{PyArray3, PyUntypedArray};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::ThreadPool;
use resample_cli::args::Drawing;
use resample_cli::args::words::content::Application;
use resample_cli::open;
use resample_cli::process::interrupt;
use resample_cli::values::input_file::{Held, HeldPictures, HeldVolumes};
use resample_cli::values::mesh_word::MeshWord;
use resample_cli::view;
use resample_core::camera::bands::Window;
use resample_core::simd::SimdLevel;
use texmap::Loaded;

use crate::picture::{self, Handed, handed};
use crate::session::{Drawn, Session};
use crate::work::{Done, Reins, pool, work};
use crate::{depth, fault, gaussians, mesh, points, volume, words};

/// A scene that is drawn.
#[pyclass(frozen)]
pub(crate) struct Scene {
    application: Application,
    /// As it was given; what is drawn is a copy of it.
    given: Session,
    session: Mutex<Arc<Mutex<Session>>>,
    pool: Option<Arc<ThreadPool>>,
}

/// A page that is served until it is closed.
#[pyclass(frozen)]
pub(crate) struct Viewer(view::Viewer);

#[pymethods]
impl Viewer {
    /// The address of the page, with its token.
    #[getter]
    fn address(&self) -> &str {
        self.0.address()
    }

    /// Ends the drawing.
    fn close(&self) {
        self.0.close();
    }
}

/// A volume that is looked at together with another, and its look.
type Beside<'py> = (Bound<'py, PyUntypedArray>, String);

/// A mesh that stands in a volume, and its look.
type Standing<'py> = (mesh::Arrays<'py>, String);

/// Meshes of arrays that stand in a volume.
fn standing(meshes: &[Standing<'_>]) -> PyResult<Vec<MeshWord>> {
    let word = |(arrays, look): &Standing<'_>| {
        let loaded = Loaded {
            scene: mesh::scene(arrays)?,
            notes: Vec::new(),
        };
        let word = MeshWord::of_memory(loaded.into(), look);
        word.map_err(|error| PyValueError::new_err(format!("meshes: {error}")))
    };
    meshes.iter().map(word).collect()
}

#[pymethods]
impl Scene {
    /// The scene of files, under the command that draws them; in a volume stand these meshes, too.
    #[staticmethod]
    #[pyo3(signature = (command, names, threads, meshes = Vec::new()))]
    fn files(
        command: &str,
        names: Vec<OsString>,
        threads: Option<usize>,
        meshes: Vec<Standing<'_>>,
    ) -> PyResult<Self> {
        let application = words::application(command)?;
        let meshes = standing(&meshes)?;
        let held = (!meshes.is_empty()).then_some(Held::Meshes(meshes));
        Self::new(application, names, held, threads)
    }

    /// A volume of an array for each channel; `options` are those that change how they are taken over.
    #[staticmethod]
    fn volume(
        channels: Vec<Bound<'_, PyUntypedArray>>,
        place: &Bound<'_, PyAny>,
        options: &Bound<'_, PyDict>,
        beside: (
            Option<Bound<'_, PyUntypedArray>>,
            Vec<Beside<'_>>,
            Vec<Standing<'_>>,
        ),
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let (mask, also, meshes) = beside;
        let named = words::named(Application::Volume, options)?;
        let inputs = |name: &str| vec![OsString::from(name)];
        let made = |array: &Bound<'_, PyUntypedArray>, name: &str| {
            let session = Session::new(Application::Volume, inputs(name), None);
            let (lattice, voxels) = volume::parts(array, place.extract()?)?;
            let made = array.py().detach(|| match session.drawing(&named)?.0 {
                Drawing::Volsplat(args) => open::volume(&args, lattice, voxels),
                _ => anyhow::bail!("another command"),
            });
            made.map(Arc::new).map_err(|error| fault::raised(&error))
        };
        let mut channels = channels
            .iter()
            .map(|array| made(array, "array"))
            .collect::<PyResult<Vec<_>>>()?
            .into_iter();
        let volume = channels
            .next()
            .ok_or_else(|| PyValueError::new_err("data: expected at least one channel"))?;
        let held = HeldVolumes {
            volume,
            channels: channels.collect(),
            mask: mask.map(|mask| made(&mask, "mask")).transpose()?,
            also: also
                .iter()
                .map(|(array, look)| Ok((made(array, "also")?, look.clone())))
                .collect::<PyResult<_>>()?,
            meshes: standing(&meshes)?,
        };
        let held = Some(Held::Volumes(held.into()));
        Self::new(Application::Volume, inputs("array"), held, threads)
    }

    /// A mesh of arrays; `options` are those that are read with it, such as `environment`.
    #[staticmethod]
    fn mesh(
        arrays: mesh::Arrays<'_>,
        options: &Bound<'_, PyDict>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let named = words::named(Application::Mesh, options)?;
        let inputs = vec![OsString::from("mesh")];
        let session = Session::new(Application::Mesh, inputs.clone(), None);
        let scene = mesh::scene(&arrays)?;
        let made = options.py().detach(|| match session.drawing(&named)?.0 {
            Drawing::Texmap(args) => open::mesh(&args, scene),
            _ => anyhow::bail!("another command"),
        });
        let loaded = made.map_err(|error| fault::raised(&error))?;
        let held = Some(Held::Mesh(loaded.into()));
        Self::new(Application::Mesh, inputs, held, threads)
    }

    /// 3-D Gaussians of arrays.
    #[staticmethod]
    fn gaussians(arrays: gaussians::Arrays<'_>, threads: Option<usize>) -> PyResult<Self> {
        let held = Some(Held::Gaussians(gaussians::gaussians(&arrays)?.into()));
        let inputs = vec![OsString::from("means")];
        Self::new(Application::Gaussians, inputs, held, threads)
    }

    /// Pictures with depth of arrays, each of them colour and depth.
    #[staticmethod]
    fn depth(pictures: Vec<depth::Arrays<'_>>, threads: Option<usize>) -> PyResult<Self> {
        let held: Vec<_> = pictures
            .iter()
            .map(depth::picture)
            .collect::<PyResult<_>>()?;
        let inputs = vec![OsString::from("colour"), OsString::from("depth")];
        let held = Some(Held::Pictures(HeldPictures(held).into()));
        Self::new(Application::Depth, inputs, held, threads)
    }

    /// A scan of arrays.
    #[staticmethod]
    fn points(arrays: points::Arrays<'_>, threads: Option<usize>) -> PyResult<Self> {
        let held = Some(Held::Points(points::scan(&arrays)?.into()));
        let inputs = vec![OsString::from("positions")];
        Self::new(Application::Points, inputs, held, threads)
    }

    /// Has the scene stand as the options say: the number of pictures that they ask for, and what there is to say.
    fn prepare(&self, options: &Bound<'_, PyDict>) -> PyResult<(usize, Vec<String>)> {
        let named = words::named(self.application, options)?;
        let Done { value, lines } = self.work(options.py(), None, move |session, _| {
            session.prepare(&named)
        })?;
        Ok((value, lines))
    }

    /// Draws one of the pictures that were prepared.
    #[pyo3(signature = (number, progress=None))]
    fn draw<'py>(
        &self,
        py: Python<'py>,
        number: usize,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Handed<'py>, Vec<String>)> {
        let Done { value, lines } = self.work(py, progress, move |session, reins| {
            session.draw(number, reins)
        })?;
        let drawn = value.ok_or_else(|| PyIndexError::new_err("nobody waits for the picture"))?;
        Ok((handed(py, drawn)?, lines))
    }

    /// Draws a window of one of the pictures that were prepared, without what lies behind it: columns and rows, each from the first
    /// to the one behind the last.
    fn draw_window<'py>(
        &self,
        py: Python<'py>,
        number: usize,
        columns: [u32; 2],
        rows: [u32; 2],
    ) -> PyResult<Handed<'py>> {
        let window = Window {
            columns: columns[0]..columns[1],
            rows: rows[0]..rows[1],
        };
        let done = self.work(py, None, move |session, _| {
            session.draw_window(number, &window)
        })?;
        handed(py, done.value)
    }

    /// Width and height of each picture that was prepared, and whether it can be drawn in parts.
    fn sizes(&self, py: Python<'_>) -> PyResult<(Vec<[u32; 2]>, bool)> {
        Ok(self.work(py, None, |session, _| Ok(session.sizes()))?.value)
    }

    /// The least and the greatest value of a colour bar, and its display colours; None where the scene has no single scale.
    #[expect(clippy::type_complexity, reason = "a pair for Python")]
    fn colours(&self, py: Python<'_>) -> PyResult<Option<([f64; 2], Vec<[f32; 3]>)>> {
        Ok(self
            .work(py, None, |session, _| Ok(session.colours()))?
            .value)
    }

    /// The cameras that were prepared, a list as camera files have it, in JSON.
    fn cameras(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self
            .work(py, None, |session, _| Ok(session.cameras()))?
            .value)
    }

    /// Lays what the prepared options say behind a whole picture.
    fn finished<'py>(
        &self,
        rgba: &Bound<'py, PyArray3<f32>>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let image = picture::image(rgba)?;
        let py = rgba.py();
        let done = self.work(py, None, move |session, _| {
            Ok(Drawn {
                image: session.finished(image),
                stats: serde_json::Value::Null,
            })
        })?;
        Ok(handed(py, done.value)?.0)
    }

    /// Serves the page of `resample view`; `words` are its own options.
    fn view(&self, options: &Bound<'_, PyDict>, words: Vec<OsString>) -> PyResult<Viewer> {
        let named = words::named(self.application, options)?;
        let (application, held) = (self.application, self.given.held.clone());
        let mut all = self.given.inputs.clone();
        all.extend(named.into_iter().flat_map(|(_, words)| words));
        all.extend(words);
        let done = work(options.py(), self.pool.clone(), None, move |_| {
            view::Viewer::start(application, &all, held)
        })?;
        Ok(Viewer(done.value))
    }

    /// Draws and writes all pictures as the command line does, and gives what there is to say.
    fn write(&self, path: PathBuf, options: &Bound<'_, PyDict>) -> PyResult<Vec<String>> {
        let named = words::named(self.application, options)?;
        interrupt::forget();
        let done = self.work(options.py(), None, move |session, _| {
            session.write(&path, &named)
        });
        let done = done.inspect_err(|_| interrupt::ask())?;
        Ok(done.lines)
    }
}

impl Scene {
    fn new(
        application: Application,
        inputs: Vec<OsString>,
        held: Option<Held>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let given = Session::new(application, inputs, held);
        Ok(Self {
            application,
            session: Mutex::new(Arc::new(Mutex::new(given.again()))),
            given,
            pool: pool(threads)?,
        })
    }

    /// Does something with the session. Where nobody waits for it any more, the next one gets a session of its own.
    fn work<T: Send + 'static>(
        &self,
        py: Python<'_>,
        progress: Option<&Bound<'_, PyAny>>,
        job: impl FnOnce(&mut Session, &Reins) -> anyhow::Result<T> + Send + 'static,
    ) -> PyResult<Done<T>> {
        let current = || self.session.lock().unwrap_or_else(PoisonError::into_inner);
        let session = current().clone();
        let own = session.clone();
        let done = work(py, self.pool.clone(), progress, move |reins| {
            job(&mut locked(&own), reins)
        });
        if done.is_err() && matches!(session.try_lock(), Err(TryLockError::WouldBlock)) {
            *current() = Arc::new(Mutex::new(self.given.again()));
        }
        done
    }
}

/// The vector instructions that a `vector_level` means on this processor.
#[pyfunction]
pub(crate) fn vector_level(word: &str) -> PyResult<&'static str> {
    let level = SimdLevel::from_str(word, false);
    let level = level.map_err(|_| PyValueError::new_err(format!("no vector level '{word}'")))?;
    Ok(level.resolve().name())
}

/// Refuses options that a command would refuse before it reads its files.
#[pyfunction]
pub(crate) fn check(
    command: &str,
    inputs: Vec<OsString>,
    options: &Bound<'_, PyDict>,
) -> PyResult<()> {
    let application = words::application(command)?;
    let named = words::named(application, options)?;
    let session = Session::new(application, inputs, None);
    let parsed = session.drawing(&named);
    parsed.map(|_| ()).map_err(|error| fault::raised(&error))
}

/// The session; what a broken drawing left is forgotten.
fn locked(session: &Mutex<Session>) -> MutexGuard<'_, Session> {
    let is_broken = session.is_poisoned();
    let mut guard = session.lock().unwrap_or_else(PoisonError::into_inner);
    if is_broken {
        guard.forget();
        session.clear_poison();
    }
    guard
}
