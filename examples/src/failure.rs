use std::fmt;

use crate::AnyError;

/// What ends a program: `main` returns it, and Rust prints its `Debug`, which is the error's message here instead
/// of its fields.
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
