//! One thread at a time.

use std::sync::{Mutex, PoisonError};
use std::thread::{self, ThreadId};

use pyo3::prelude::*;

use crate::error::refused;

/// A value that threads of Python use one after the other. Who waits for it, and who works with it, leaves Python to the
/// others.
#[derive(Debug)]
pub(crate) struct Exclusive<T> {
    value: Mutex<T>,
    /// Who works with it.
    holder: Mutex<Option<ThreadId>>,
}

impl<T: Send> Exclusive<T> {
    pub(crate) fn new(value: T) -> Self {
        Self { value: Mutex::new(value), holder: Mutex::new(None) }
    }

    /// Works with the value, without the GIL.
    ///
    /// # Errors
    ///
    /// When this thread works with it already (a signal handler), or a panic has left it half changed.
    pub(crate) fn with<R: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut T) -> R + Send) -> PyResult<R> {
        let this = thread::current().id();
        if self.holder() == Some(this) {
            return Err(refused("called while it is at work for the same thread"));
        }
        py.detach(|| {
            let mut value = self.value.lock().map_err(|_| refused("an earlier call has failed within"))?;
            self.set_holder(Some(this));
            let result = work(&mut value);
            self.set_holder(None);
            Ok(result)
        })
    }

    fn holder(&self) -> Option<ThreadId> {
        *self.holder.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set_holder(&self, thread: Option<ThreadId>) {
        *self.holder.lock().unwrap_or_else(PoisonError::into_inner) = thread;
    }
}
