//! Python bindings of `dymlm`: arrays of numpy in, four maps out.
//!
//! A thin layer that computes nothing. A class or function has the name of its counterpart in Rust; here, the
//! prefix `Py` distinguishes the two. `dymlm-python/README.md` is the users' guide.
//!
//! While Rust works, other threads of Python run: everything that takes longer than a conversion is called
//! through `Python::detach`. No lock is ever waited for with the GIL held (`exclusive.rs`).

#![allow(clippy::doc_markdown, reason = "classes' and methods' docs are docstrings of Python")]
#![allow(clippy::needless_pass_by_value, reason = "arguments of Python are extracted, and owned")]

mod arrays;
mod builder;
mod camera;
mod changes;
mod cloud;
mod config;
mod correction;
mod dataset;
mod detection;
mod distance_field;
mod error;
mod exclusive;
mod floor_grid;
mod frame;
mod map;
mod map_saver;
mod merge;
mod metrics;
mod object_tracker;
mod objects;
mod occupancy_grid;
mod octree;
mod planes;
mod pose;
mod reader;
mod report;
mod sequence;
mod static_points;
mod truth;

/// The extension module. Python code imports `dymlm`, which re-exports its names.
#[pyo3::pymodule(name = "_dymlm")]
mod extension {
    #[pymodule_export]
    use crate::{
        builder::PyMapBuilder,
        camera::PyCamera,
        changes::{PyChangedThings, PyCloudBlock, PyFoundObject, PyMapChanges, PyWorldChanges},
        cloud::PyCloud,
        config::PyConfig,
        correction::{PyCorrectionReport, PyLoopClosure, PyRefineReport, PyThingChanges},
        dataset::{PyDataset, PyDatasetFrames},
        detection::PyDetection,
        distance_field::PyDistanceField,
        error::{
            ConfigError, Error, FileError, Locked, MergeRefused, NoFloor, NoHistory, NotPending, OutOfReach,
            RefinementStopped, TimeReversed, UnknownFrame, UnknownObject,
        },
        floor_grid::PyFloorGrid,
        frame::PyFrame,
        map::{PyFloorUnder, PyMap, load},
        map_saver::PyMapSaver,
        merge::{PyMergeReport, PyNewIds},
        metrics::{
            PyCloudScore, PyDynamicMapScore, PyDynamicMapScorer, PyObjectScore, PyPlaneScore,
            PyReferenceCloud, score_cloud, score_objects, score_planes, score_walls, trajectory_error,
        },
        object_tracker::{PyObjectMove, PyObjectTracker, PyObjectUpdate},
        objects::PyMapObject,
        occupancy_grid::{PyGridUpdate, PyOccupancyGrid},
        octree::PyOctree,
        planes::{PyBoundary, PyPlane},
        pose::PyPose,
        reader::PyMapReader,
        report::{PyFrameReport, PyMapUpdate, PyMover},
        sequence::{PySequence, PySequenceFrames, builtin_sequence},
        static_points::PyStaticPoints,
        truth::{PyPointTruth, PySequenceTruth, PyTrueFace, PyTrueObject},
    };
}
