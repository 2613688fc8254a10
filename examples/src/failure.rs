use std::fmt;

use crate::AnyError;

/// An error that ends a program: `main` returns it, and Rust prints its `Debug`, which here is the error's
/// message instead of its fields.
pub struct Failure(AnyError);

impl fmt::Debug for Failure {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, out)
    }
}

impl<E: Into<AnyError>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self(error.into())
    }
}
