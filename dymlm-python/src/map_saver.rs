//! Saves maps repeatedly.

use std::path::PathBuf;

use dymlm::files::MapSaver;
use pyo3::prelude::*;

use crate::error::OrRaise;
use crate::exclusive::Exclusive;
use crate::map::PyMap;

/// Saves maps repeatedly into one folder; each time, only the changed parts of the state are written. Its
/// first save replaces the contents of the folder. As long as it exists, nobody else can write the folder.
#[pyclass(frozen, name = "MapSaver", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyMapSaver {
    folder: PathBuf,
    saver: Exclusive<MapSaver>,
}

#[pymethods]
impl PyMapSaver {
    #[new]
    fn new(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        py.detach(|| MapSaver::create(folder)).or_raise().map(Self::of)
    }

    /// Loads the map of a folder to continue saving there. Returns a MapSaver, whose first save writes only
    /// the changes since, and the Map.
    #[staticmethod]
    fn load(py: Python<'_>, folder: PathBuf) -> PyResult<(Self, PyMap)> {
        let (saver, map) = py.detach(|| MapSaver::load(folder, None)).or_raise()?;
        Ok((Self::of(saver), PyMap::of(map)))
    }

    /// Saves a map. After a crash the folder holds either the map saved before or this one, never half of it.
    fn save(&self, py: Python<'_>, map: &Bound<'_, PyMap>) -> PyResult<()> {
        let map = map.get().maps();
        self.saver.with(py, |saver| saver.save(&map))?.or_raise()
    }

    /// The map's folder.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.folder.clone()
    }
}

impl PyMapSaver {
    fn of(saver: MapSaver) -> Self {
        Self { folder: saver.folder().to_path_buf(), saver: Exclusive::new(saver) }
    }
}
