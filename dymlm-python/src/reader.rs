//! Reads the maps while they are built.

use std::time::Duration;

use dymlm::MapReader;
use pyo3::prelude::*;

use crate::error::OrRaise;
use crate::map::PyMap;

/// Longest wait before signals are looked at.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(100);

/// Reads the maps of a builder on any thread. The builder publishes its maps every half second of the frames'
/// clock and whenever they are changed on request. Builder and reader never wait for each other.
#[pyclass(frozen, name = "MapReader", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyMapReader(pub(crate) MapReader);

#[pymethods]
impl PyMapReader {
    /// The maps that were published last.
    fn latest(&self) -> PyMap {
        PyMap::shared(self.0.latest())
    }

    /// Waits for maps that are newer than these, at most `timeout` seconds, by default for ever; None when
    /// none came. Ctrl-C ends it.
    #[pyo3(signature = (than, timeout = f64::INFINITY))]
    fn wait_newer(&self, py: Python<'_>, than: &Bound<'_, PyMap>, timeout: f64) -> PyResult<Option<PyMap>> {
        let than = than.get().maps().revision();
        let mut timeout = match timeout {
            f64::INFINITY => Duration::MAX,
            timeout => Duration::try_from_secs_f64(timeout).or_raise()?,
        };
        loop {
            let part = timeout.min(SIGNAL_INTERVAL);
            let newer = py.detach(|| self.0.wait_newer(than, part));
            timeout -= part;
            if newer.is_some() || timeout.is_zero() {
                return Ok(newer.map(PyMap::shared));
            }
            py.check_signals()?;
        }
    }
}
