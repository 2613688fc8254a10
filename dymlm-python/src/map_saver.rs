//! Saves maps repeatedly.

use std::path::PathBuf;

use dymlm::files::MapSaver;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::config::load_options;
use crate::error::{OrRaise, refused};
use crate::exclusive::Exclusive;
use crate::map::PyMap;

/// Saves maps repeatedly into one folder; each time, only the changed parts of the state are written. Its
/// first save replaces the contents of the folder. Until it is closed, or no longer referred to, nobody else
/// can write the folder: `with dymlm.MapSaver(folder) as saver:`.
#[pyclass(frozen, name = "MapSaver", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyMapSaver {
    folder: PathBuf,
    /// None once it is closed.
    saver: Exclusive<Option<MapSaver>>,
}

#[pymethods]
impl PyMapSaver {
    #[new]
    fn new(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        py.detach(|| MapSaver::create(folder)).or_raise().map(Self::of)
    }

    /// Loads the map of a folder to continue saving there. Returns a MapSaver, whose first save writes only
    /// the changes since, and the Map. `history` and `memory`: as for `dymlm.load`.
    #[staticmethod]
    #[pyo3(signature = (folder, history = None, memory = None))]
    fn load(
        py: Python<'_>,
        folder: PathBuf,
        history: Option<&Bound<'_, PyAny>>,
        memory: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(Self, PyMap)> {
        let options = load_options(history, memory)?;
        let (saver, map) = py.detach(|| MapSaver::load(folder, &options)).or_raise()?;
        Ok((Self::of(saver), PyMap::of(map)))
    }

    /// Saves a map. After a crash the folder holds either the map saved before or this one, never half of it.
    fn save(&self, py: Python<'_>, map: &Bound<'_, PyMap>) -> PyResult<()> {
        let map = map.get().maps();
        let save = |saver: &mut Option<MapSaver>| saver.as_mut().map(|saver| saver.save(&map));
        self.saver.with(py, save)?.ok_or_else(|| refused("the MapSaver is closed"))?.or_raise()
    }

    /// Lets others write the folder; this MapSaver saves no more.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.saver.with(py, |saver| drop(saver.take()))
    }

    fn __enter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py)
    }

    /// The map's folder.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.folder.clone()
    }
}

impl PyMapSaver {
    fn of(saver: MapSaver) -> Self {
        Self { folder: saver.folder().to_path_buf(), saver: Exclusive::new(Some(saver)) }
    }
}
