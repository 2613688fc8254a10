//! Turns errors of Rust into exceptions of Python with the same text.

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

create_exception!(
    dymlm,
    Error,
    PyValueError,
    "A call was refused, such as one with a bad frame, config or folder; the text says why. Nothing has changed."
);

/// Raises the error of a result.
pub(crate) trait OrRaise<T> {
    /// The value, or an exception with the error's text.
    fn or_raise(self) -> PyResult<T>;
}

impl<T, E: std::error::Error> OrRaise<T> for Result<T, E> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(|error| refused(error.to_string()))
    }
}

/// An exception with this text.
pub(crate) fn refused(words: impl Into<String>) -> PyErr {
    Error::new_err(words.into())
}
