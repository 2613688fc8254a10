//! What differs between two maps.

use std::collections::BTreeMap;

use dymlm::cloud::CloudBlock;
use dymlm::core::Numbered;
use dymlm::{ChangedThings, FoundObject, MapChanges, MovedObject, WorldChanges};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::arrays::{rows_to_array, to_vector};
use crate::pose::PyPose;

/// What differs between two states of a map.
#[pyclass(frozen, get_all, name = "MapChanges", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyMapChanges {
    /// Revision of the earlier state.
    from_revision: u64,
    /// Revision of the later state.
    to_revision: u64,
    /// Blocks of the static cloud as they are now, a list of CloudBlock.
    cloud: Vec<Py<PyCloudBlock>>,
    /// Boxes in which cells of the octree differ: (n, 6) float64, lower and upper corner, metres.
    octree: Py<PyArray2<f64>>,
    /// Planes.
    planes: PyChangedThings,
    /// Objects.
    objects: PyChangedThings,
}

impl PyMapChanges {
    pub(crate) fn of(py: Python<'_>, changes: MapChanges) -> PyResult<Self> {
        let block = |block| Py::new(py, PyCloudBlock::of(py, block)?);
        let cloud: PyResult<_> = changes.cloud.into_iter().map(block).collect();
        let corners = changes.octree.iter().map(|cube| {
            let ([a, b, c], [x, y, z]) = (cube.min, cube.max);
            [a, b, c, x, y, z]
        });
        Ok(Self {
            from_revision: changes.from.get(),
            to_revision: changes.to.get(),
            cloud: cloud?,
            octree: rows_to_array(py, corners.collect())?.unbind(),
            planes: PyChangedThings::of(&changes.planes),
            objects: PyChangedThings::of(&changes.objects),
        })
    }
}

/// All static points of a cube of 8^3 voxels.
#[pyclass(frozen, get_all, name = "CloudBlock", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyCloudBlock {
    /// The cube's integer coordinates: its lowest corner is at these times 8 voxels.
    place: [i32; 3],
    /// (n, 3) float32, metres, world.
    positions: Py<PyArray2<f32>>,
    /// Colours of the first m of these points, (m, 3) uint8; the others have none.
    colors: Py<PyArray2<u8>>,
}

impl PyCloudBlock {
    fn of(py: Python<'_>, block: CloudBlock) -> PyResult<Self> {
        Ok(Self {
            place: block.place,
            positions: rows_to_array(py, block.points)?.unbind(),
            colors: rows_to_array(py, block.colors)?.unbind(),
        })
    }
}

/// Planes or objects that differ, by their ids.
#[pyclass(frozen, get_all, name = "ChangedThings", module = "dymlm")]
#[derive(Debug, Clone)]
pub(crate) struct PyChangedThings {
    /// Ids that are confirmed now and were not before.
    confirmed: Vec<u64>,
    /// Ids of things that were seen again or have moved.
    changed: Vec<u64>,
    /// Ids that were merged away, each with the id that it was merged into.
    merged: BTreeMap<u64, u64>,
    /// Ids that do not exist or are not confirmed any more.
    removed: Vec<u64>,
}

impl PyChangedThings {
    fn of<Id: Numbered>(changes: &ChangedThings<Id>) -> Self {
        let numbers = |ids: &[Id]| ids.iter().map(|id| id.number()).collect();
        Self {
            confirmed: numbers(&changes.confirmed),
            changed: numbers(&changes.changed),
            merged: changes.merged.iter().map(|(id, into)| (id.number(), into.number())).collect(),
            removed: numbers(&changes.removed),
        }
    }
}

/// What has changed in the world between two maps of it.
#[pyclass(frozen, get_all, name = "WorldChanges", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyWorldChanges {
    /// Objects that have moved: a list of (FoundObject at the old place, FoundObject at the new place).
    moved: Vec<(Py<PyFoundObject>, Py<PyFoundObject>)>,
    /// Objects in space that was empty before, a list of FoundObject.
    appeared: Vec<Py<PyFoundObject>>,
    /// Objects whose space is empty now, a list of FoundObject.
    vanished: Vec<Py<PyFoundObject>>,
}

impl PyWorldChanges {
    pub(crate) fn of(py: Python<'_>, changes: &WorldChanges) -> PyResult<Self> {
        let all = |objects: &[FoundObject]| -> PyResult<Vec<_>> {
            objects.iter().map(|object| PyFoundObject::of(py, object)).collect()
        };
        let moved =
            |one: &MovedObject| Ok((PyFoundObject::of(py, &one.from)?, PyFoundObject::of(py, &one.to)?));
        let moved: PyResult<_> = changes.moved.iter().map(moved).collect();
        Ok(Self { moved: moved?, appeared: all(&changes.appeared)?, vanished: all(&changes.vanished)? })
    }
}

/// An object as a map has it.
#[pyclass(frozen, get_all, name = "FoundObject", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyFoundObject {
    /// Its id in that map.
    id: u64,
    /// What it is.
    label: String,
    /// The frame of its box.
    world_from_object: PyPose,
    /// Full lengths of its box (3,), metres.
    size: Py<PyArray1<f64>>,
    /// When it was first seen, seconds on the map's clock.
    first_seen: f64,
    /// When it was last seen, seconds on the map's clock.
    last_seen: f64,
}

impl PyFoundObject {
    fn of(py: Python<'_>, object: &FoundObject) -> PyResult<Py<Self>> {
        let [first_seen, last_seen] = object.seen;
        let found = Self {
            id: object.id.get(),
            label: object.label.clone(),
            world_from_object: PyPose(object.oriented_box.world_from_box()),
            size: to_vector(py, object.oriented_box.lengths()).unbind(),
            first_seen,
            last_seen,
        };
        Py::new(py, found)
    }
}
