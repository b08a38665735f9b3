//! Errors of the libraries as Python's exceptions: their sentences stay as they are.

use std::io::ErrorKind;

use pyo3::PyErr;
use pyo3::exceptions::{
    PyFileNotFoundError, PyKeyboardInterrupt, PyOSError, PyPermissionError, PyRuntimeError,
    PyValueError,
};
use resample_cli::output::WriteFailure;
use resample_cli::process::interrupt::Interrupted;
use resample_cli::process::report;

/// The exception of an error: `OSError` and its kinds where the system refused, else `ValueError`.
pub(crate) fn raised(error: &anyhow::Error) -> PyErr {
    let text = report::one_line(error);
    if error.is::<Interrupted>() {
        return PyKeyboardInterrupt::new_err(text);
    }
    let system = error
        .chain()
        .find_map(|cause| cause.downcast_ref::<std::io::Error>());
    match system.map(std::io::Error::kind) {
        Some(ErrorKind::NotFound) => PyFileNotFoundError::new_err(text),
        Some(ErrorKind::PermissionDenied) => PyPermissionError::new_err(text),
        Some(_) => PyOSError::new_err(text),
        None if error.is::<WriteFailure>() => PyOSError::new_err(text),
        None => PyValueError::new_err(text),
    }
}

/// The exception of a thread that broke off: a fault of this package.
pub(crate) fn broken() -> PyErr {
    PyRuntimeError::new_err("drawing broke off: please report how this came about")
}
