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
    /// From which revision.
    from_revision: u64,
    /// To which.
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

/// The static points of a cube of 8^3 voxels, all of them.
#[pyclass(frozen, get_all, name = "CloudBlock", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyCloudBlock {
    /// Which cube: its lowest corner is this times 8 voxels.
    place: [i32; 3],
    /// (n, 3) float32, metres, world.
    positions: Py<PyArray2<f32>>,
    /// Colours of the first of these, as many as have one: (m, 3) uint8.
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
    /// Those that are confirmed now and were not.
    confirmed: Vec<u64>,
    /// Those of which more was seen, or that stand elsewhere.
    changed: Vec<u64>,
    /// Those that are one with another now: id to that other.
    merged: BTreeMap<u64, u64>,
    /// Those that are there no more, or not confirmed any more.
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

/// What has become of the world between two maps of it.
#[pyclass(frozen, get_all, name = "WorldChanges", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyWorldChanges {
    /// Objects that stand elsewhere: a list of (where it stood, where it stands), FoundObject both.
    moved: Vec<(Py<PyFoundObject>, Py<PyFoundObject>)>,
    /// Objects in what was empty space, a list of FoundObject.
    appeared: Vec<Py<PyFoundObject>>,
    /// Objects where there is empty space now, a list of FoundObject.
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
    /// When it was seen first, seconds on the map's clock.
    first_seen: f64,
    /// When it was seen last.
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
