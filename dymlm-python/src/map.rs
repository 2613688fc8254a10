//! The four maps.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use dymlm::core::{ObjectId, PlaneId};
use dymlm::planes::{SurfaceConfig, SurfaceKind};
use dymlm::{MapMemory, MultiLevelMap, Selection};
use numpy::PyArray1;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyInt};

use crate::arrays::{Array1, to_vector, vector};
use crate::changes::{PyMapChanges, PyWorldChanges};
use crate::cloud::PyCloud;
use crate::config::{PyConfig, load_options};
use crate::error::{OrRaise, refused};
use crate::floor_grid::{PyFloorGrid, floor_grid_config};
use crate::merge::PyMergeReport;
use crate::objects::PyMapObject;
use crate::octree::PyOctree;
use crate::planes::PyPlane;
use crate::pose::PoseArgument;
use crate::static_points::PyStaticPoints;

/// Four maps of the static world in one world frame, in the state in which they were requested. Lengths in
/// metres.
#[pyclass(frozen, name = "Map", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyMap {
    map: RwLock<Arc<MultiLevelMap>>,
    /// Held while another map is merged into this one.
    merging: Mutex<()>,
}

#[pymethods]
impl PyMap {
    /// The coloured points of the cloud, one per voxel: selection "static" (without people, ghosts and noise)
    /// or "all" (every point that was read).
    #[pyo3(signature = (selection = "static"))]
    fn cloud(&self, py: Python<'_>, selection: &str) -> PyResult<PyCloud> {
        let selection = match selection {
            "static" => Selection::Static,
            "all" => Selection::All,
            other => return Err(refused(format!("selection {other:?}: \"static\" or \"all\" is needed"))),
        };
        let map = self.maps();
        PyCloud::of(py, py.detach(|| map.cloud().point_cloud(selection)))
    }

    /// The static cloud, for queries.
    #[getter]
    fn static_points(&self) -> PyStaticPoints {
        PyStaticPoints(self.maps())
    }

    /// The occupancy octree.
    #[getter]
    fn octree(&self) -> PyOctree {
        PyOctree(self.maps())
    }

    /// The planes of the map, a list of Plane in the order in which they were added.
    #[getter]
    fn planes(&self) -> Vec<PyPlane> {
        let map = self.maps();
        map.planes().iter().map(|plane| PyPlane::of(&map, plane.id())).collect()
    }

    /// The plane with an id; for an id that was merged away, the plane that it became. KeyError when there is
    /// none.
    fn plane(&self, id: Bound<'_, PyInt>) -> PyResult<PyPlane> {
        let (map, id) = (self.maps(), key_of(&id)?);
        let current = map.planes().current_id(PlaneId::new(id));
        current.map(|id| PyPlane::of(&map, id)).ok_or_else(|| PyKeyError::new_err(id))
    }

    /// The objects of the map, a list of MapObject in the order in which they were added.
    #[getter]
    fn objects(&self) -> Vec<PyMapObject> {
        let map = self.maps();
        map.objects().objects().map(|object| PyMapObject::of(&map, object.id())).collect()
    }

    /// The object with an id; for an id that was merged away, the object that it became. KeyError when there
    /// is none.
    fn object(&self, id: Bound<'_, PyInt>) -> PyResult<PyMapObject> {
        let (map, id) = (self.maps(), key_of(&id)?);
        let current = map.objects().object(ObjectId::new(id)).map(dymlm::objects::MapObject::id);
        current.map(|id| PyMapObject::of(&map, id)).ok_or_else(|| PyKeyError::new_err(id))
    }

    /// The objects that stand on a plane, the oldest first.
    fn objects_on(&self, plane: u64) -> Vec<PyMapObject> {
        let map = self.maps();
        map.objects_on(PlaneId::new(plane)).map(|object| PyMapObject::of(&map, object.id())).collect()
    }

    /// Classifies the planes, given a vector (3,) that points up: a list of (Plane, kind, height in metres),
    /// where kind is "floor", "table", "wall", "ceiling" or "slanted".
    fn surfaces(&self, py: Python<'_>, up: &Bound<'_, PyAny>) -> PyResult<Vec<(PyPlane, &'static str, f64)>> {
        let (map, up) = (self.maps(), vector(up, "up")?);
        let kind = |kind| match kind {
            SurfaceKind::Floor => "floor",
            SurfaceKind::Table => "table",
            SurfaceKind::Wall => "wall",
            SurfaceKind::Ceiling => "ceiling",
            _ => "slanted",
        };
        let surfaces = py.detach(|| map.planes().surfaces(up, &SurfaceConfig::default()));
        Ok(surfaces
            .iter()
            .map(|one| (PyPlane::of(&map, one.plane.id()), kind(one.kind), one.height))
            .collect())
    }

    /// The first level surface under a point (3,), at most `max_distance` metres below it, opposite to `up`
    /// (3,). A surface with readings within `reach` metres of the point's vertical counts as extended to
    /// there. A FloorUnder, or None.
    #[pyo3(signature = (point, up, max_distance, reach = 0.0))]
    fn floor_under(
        &self,
        py: Python<'_>,
        point: &Bound<'_, PyAny>,
        up: &Bound<'_, PyAny>,
        max_distance: f64,
        reach: f64,
    ) -> PyResult<Option<PyFloorUnder>> {
        let (point, up) = (vector(point, "point")?, vector(up, "up")?);
        let floor = self.maps().floor_under(point, up, max_distance, reach);
        Ok(floor.map(|floor| PyFloorUnder {
            plane: floor.plane.get(),
            point: to_vector(py, floor.point).unbind(),
            distance: floor.distance,
            extended_by: floor.extended_by,
        }))
    }

    /// The 2D grid of the floor under a position (3,), seen along `up` (3,): the plane under the position and
    /// all level or sloping planes that low steps connect to it. region: x and y of the lower and of the
    /// upper corner (4,) of the grid, in its own axes. Further keywords are the fields of Rust's
    /// `FloorGridConfig`, such as `max_height=1.2` or `max_step=0.1`.
    #[pyo3(signature = (at, up, region = None, **fields))]
    fn floor_grid(
        &self,
        py: Python<'_>,
        at: &Bound<'_, PyAny>,
        up: &Bound<'_, PyAny>,
        region: Option<&Bound<'_, PyAny>>,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<PyFloorGrid> {
        let (map, at, up) = (self.maps(), vector(at, "at")?, vector(up, "up")?);
        let config = floor_grid_config(region, fields)?;
        py.detach(|| map.floor_grid(at, up, &config)).or_raise().map(PyFloorGrid::of)
    }

    /// The 2D grids of all floors, the lowest first: storeys, and areas separated by steps that are too high.
    /// Arguments as for `floor_grid`.
    #[pyo3(signature = (up, region = None, **fields))]
    fn floor_grids(
        &self,
        py: Python<'_>,
        up: &Bound<'_, PyAny>,
        region: Option<&Bound<'_, PyAny>>,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Vec<PyFloorGrid>> {
        let (map, up) = (self.maps(), vector(up, "up")?);
        let config = floor_grid_config(region, fields)?;
        let floors = py.detach(|| map.floor_grids(up, &config)).or_raise()?;
        Ok(floors.into_iter().map(PyFloorGrid::of).collect())
    }

    /// A unit vector (3,) that points up in the world, once it is known, else None.
    #[getter]
    fn up<'py>(&self, py: Python<'py>) -> Option<Array1<'py, f64>> {
        Some(to_vector(py, self.maps().up()?))
    }

    /// Sizes of the maps: "cloud_points", "cloud_voxels", "octree_nodes", "octree_leaves",
    /// "octree_occupied_leaves", "planes", "objects".
    fn counts(&self, py: Python<'_>) -> BTreeMap<&'static str, usize> {
        let map = self.maps();
        let counts = py.detach(|| map.counts());
        BTreeMap::from([
            ("cloud_points", counts.cloud_points),
            ("cloud_voxels", counts.cloud_voxels),
            ("octree_nodes", counts.octree_nodes),
            ("octree_leaves", counts.octree_leaves),
            ("octree_occupied_leaves", counts.octree_occupied_leaves),
            ("planes", counts.planes),
            ("objects", counts.objects),
        ])
    }

    /// Memory in bytes of each map, of the stored key frames ("history"), of earlier states ("snapshots") and
    /// of the maps that readers see ("published"). "unfiled_history" is the part of "history" that the file
    /// has refused, on a full disk.
    fn memory(&self, py: Python<'_>) -> BTreeMap<&'static str, usize> {
        let map = self.maps();
        memory_of(py.detach(|| map.memory()))
    }

    /// The settings that the map was made with.
    #[getter]
    fn config(&self) -> PyConfig {
        PyConfig(self.maps().config().clone())
    }

    /// The number of this state of the maps, which grows whenever they change.
    #[getter]
    fn revision(&self) -> u64 {
        self.maps().revision().get()
    }

    /// Saves the map in a folder: `cloud.ply`, `octree.bt`, `octree.ot`, `planes.json`, `planes.ply`,
    /// `objects.json`, and the whole state, which `load` reads. After a crash the folder holds either the old
    /// map or the new one.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let map = self.maps();
        py.detach(|| map.save(folder)).or_raise()
    }

    /// Adds the sessions of another map; `world_from_other` takes that map's world to this one's. The result
    /// is, to the bit, the map that one builder would have made of all key frames in the order in which they
    /// were recorded. Both maps need a history. Results taken from this map before (octree, planes, clouds)
    /// do not change.
    #[pyo3(signature = (other, world_from_other = None))]
    fn merge(
        &self,
        py: Python<'_>,
        other: &Bound<'_, Self>,
        world_from_other: Option<PoseArgument>,
    ) -> PyResult<PyMergeReport> {
        let other = other.get();
        let world_from_other = world_from_other.map(|pose| pose.0).unwrap_or_default();
        let merge = || {
            let _alone = self.merging.lock().unwrap_or_else(PoisonError::into_inner);
            let mut map = (*self.maps()).clone();
            let report = map.merge(&other.maps(), &world_from_other)?;
            let mut current = self.map.write().unwrap_or_else(PoisonError::into_inner);
            let before = std::mem::replace(&mut *current, Arc::new(map));
            // Whoever asks for the maps need not wait until the old ones are freed.
            drop(current);
            drop(before);
            Ok::<_, dymlm::Error>(report)
        };
        Ok(PyMergeReport::of(&py.detach(merge).or_raise()?))
    }

    /// The differences from an earlier state of the map, such as one from a MapReader: blocks of the cloud,
    /// cubes of the octree, planes and objects. A copy of the earlier state in which these are replaced
    /// equals this state.
    fn changes_since(&self, py: Python<'_>, earlier: &Bound<'_, Self>) -> PyResult<PyMapChanges> {
        let (map, earlier) = (self.maps(), earlier.get().maps());
        PyMapChanges::of(py, py.detach(|| map.changes_since(&earlier)))
    }

    /// What has moved, appeared and vanished in the world since an earlier map of it. The evidence decides,
    /// so that only places seen both times are compared.
    fn world_changes_since(&self, py: Python<'_>, earlier: &Bound<'_, Self>) -> PyResult<PyWorldChanges> {
        let (map, earlier) = (self.maps(), earlier.get().maps());
        PyWorldChanges::of(py, &py.detach(|| map.world_changes_since(&earlier)))
    }

    /// The sessions that the map was built in: a list of (first frame, number of frames, first time, last
    /// time). Empty without a history.
    #[getter]
    fn sessions(&self) -> Vec<(u64, usize, f64, f64)> {
        let session = |one: dymlm::MapSession| (one.first.get(), one.frames, one.times[0], one.times[1]);
        self.maps().sessions().into_iter().map(session).collect()
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let map = self.maps();
        // Counting points judges what has changed.
        let points = py.detach(|| map.cloud().len());
        format!(
            "<dymlm.Map, revision {}: {} points, {} planes, {} objects>",
            map.revision().get(),
            points,
            map.planes().len(),
            map.objects().len()
        )
    }
}

impl PyMap {
    pub(crate) fn of(map: MultiLevelMap) -> Self {
        Self::shared(Arc::new(map))
    }

    pub(crate) fn shared(map: Arc<MultiLevelMap>) -> Self {
        Self { map: RwLock::new(map), merging: Mutex::default() }
    }

    /// The current maps. The lock is held only while the reference is counted.
    pub(crate) fn maps(&self) -> Arc<MultiLevelMap> {
        Arc::clone(&self.map.read().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Loads the map that was saved in a folder, to the bit. `history`: where its key frames are kept from now
/// on, as in Config ("none", "memory" or {"folder": path}); None: where they were. With "none" a map is loaded
/// that came without the folder of its history. `memory`: how much it may take from now on, as in Config
/// ({"budget": bytes, "path": folder}, {} for no limit); None: as where it was saved.
#[pyfunction]
#[pyo3(signature = (folder, history = None, memory = None))]
pub(crate) fn load(
    py: Python<'_>,
    folder: PathBuf,
    history: Option<&Bound<'_, PyAny>>,
    memory: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyMap> {
    let options = load_options(history, memory)?;
    py.detach(|| MultiLevelMap::load_with(folder, &options)).or_raise().map(PyMap::of)
}

/// An id; a number that can be none raises what an id without a thing raises.
fn key_of(id: &Bound<'_, PyInt>) -> PyResult<u64> {
    id.extract().map_err(|_| PyKeyError::new_err(id.clone().unbind()))
}

pub(crate) fn memory_of(memory: MapMemory) -> BTreeMap<&'static str, usize> {
    BTreeMap::from([
        ("cloud", memory.cloud),
        ("octree", memory.octree),
        ("planes", memory.planes),
        ("objects", memory.objects),
        ("history", memory.history),
        ("unfiled_history", memory.unfiled_history),
        ("snapshots", memory.snapshots),
        ("published", memory.published),
    ])
}

/// The surface that something at a point stands on or would fall onto.
#[pyclass(frozen, get_all, name = "FloorUnder", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyFloorUnder {
    /// The plane's id.
    plane: u64,
    /// The point of the plane vertically below, (3,), metres, world.
    point: Py<PyArray1<f64>>,
    /// Distance to that point, metres.
    distance: f64,
    /// Distance from that point to the nearest reading of the plane, metres; 0 where the plane was read
    /// there.
    extended_by: f64,
}
