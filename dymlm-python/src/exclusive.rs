//! A value for one thread at a time.

use std::sync::{Mutex, PoisonError};
use std::thread::{self, ThreadId};

use pyo3::prelude::*;

use crate::error::refused;

/// A value that Python's threads use one after the other. A thread that waits for it or works with it does
/// not hold the GIL.
#[derive(Debug)]
pub(crate) struct Exclusive<T> {
    value: Mutex<T>,
    /// The thread that works with the value.
    holder: Mutex<Option<ThreadId>>,
}

/// Notes that a thread works with a value no more, also when its work has panicked.
struct Released<'a, T>(&'a Exclusive<T>);

impl<T> Drop for Released<'_, T> {
    fn drop(&mut self) {
        self.0.set_holder(None);
    }
}

impl<T> Exclusive<T> {
    fn holder(&self) -> Option<ThreadId> {
        *self.holder.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set_holder(&self, thread: Option<ThreadId>) {
        *self.holder.lock().unwrap_or_else(PoisonError::into_inner) = thread;
    }
}

impl<T: Send> Exclusive<T> {
    pub(crate) fn new(value: T) -> Self {
        Self { value: Mutex::new(value), holder: Mutex::new(None) }
    }

    /// Runs `work` on the value, without the GIL.
    ///
    /// # Errors
    ///
    /// When this thread works with the value already (a signal handler), or a panic has left it half changed.
    pub(crate) fn with<R: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut T) -> R + Send) -> PyResult<R> {
        let this = thread::current().id();
        if self.holder() == Some(this) {
            return Err(refused("called during another call of the same thread (by a signal handler?)"));
        }
        py.detach(|| {
            let mut value = self.value.lock().map_err(|_| refused("an earlier call panicked: start anew"))?;
            self.set_holder(Some(this));
            let _released = Released(self);
            Ok(work(&mut value))
        })
    }
}
