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
        .find_map(|cause| cause.downcast_ref::<std::io::Error>())
        .map(std::io::Error::kind);
    match system.or_else(|| kind_in(&text)) {
        Some(ErrorKind::NotFound) => PyFileNotFoundError::new_err(text),
        Some(ErrorKind::PermissionDenied) => PyPermissionError::new_err(text),
        Some(_) => PyOSError::new_err(text),
        None if error.is::<WriteFailure>() => PyOSError::new_err(text),
        None => PyValueError::new_err(text),
    }
}

/// The kind of a system's error of which the libraries kept the sentence: it ends with the system's number.
fn kind_in(text: &str) -> Option<ErrorKind> {
    let (_, rest) = text.rsplit_once("(os error ")?;
    let number = rest.split(')').next()?.parse().ok()?;
    Some(std::io::Error::from_raw_os_error(number).kind())
}

/// The exception of a thread that broke off: a fault of this package.
pub(crate) fn broken() -> PyErr {
    PyRuntimeError::new_err("drawing broke off: please report how this came about")
}
