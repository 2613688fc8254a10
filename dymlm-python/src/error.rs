//! Errors of Rust become exceptions of Python, in the same words.

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

create_exception!(
    dymlm,
    Error,
    PyValueError,
    "Why something was refused: a frame, a config, a folder. What was refused has changed nothing."
);

/// Raises the error of a result.
pub(crate) trait OrRaise<T> {
    /// The value, or an exception with the error's words.
    fn or_raise(self) -> PyResult<T>;
}

impl<T, E: std::error::Error> OrRaise<T> for Result<T, E> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(|error| refused(error.to_string()))
    }
}

/// An exception with these words.
pub(crate) fn refused(words: impl Into<String>) -> PyErr {
    Error::new_err(words.into())
}
