//! Scores of maps against the truth.

use dymlm::core::{PointCloud, Pose};
use dymlm_metrics::{
    DynamicMapScore, DynamicMapScorer, EstimatedObject, EstimatedPlane, FaceState, Facing, ReferenceCloud,
    Spread, TrajectoryScore, score_cloud as cloud_score, score_objects as object_score,
    score_planes as plane_score, score_walls as wall_score,
};
use pyo3::prelude::*;

use crate::arrays::points;
use crate::detection::mask_of;
use crate::error::{OrRaise, refused};
use crate::exclusive::Exclusive;
use crate::frame::PyFrame;
use crate::objects::PyMapObject;
use crate::planes::PyPlane;
use crate::pose::PoseArgument;
use crate::truth::{PyTrueFace, PyTrueObject, TruthArgument};

/// How far a cloud is from the truth.
#[pyclass(frozen, get_all, name = "CloudScore", module = "dymlm.metrics")]
#[derive(Debug)]
pub(crate) struct PyCloudScore {
    /// Share of the points further than 6 cm from every static surface and within the volume swept by movers.
    residue: f64,
    /// Share of the points further than 6 cm from every static surface and outside that volume.
    stray: f64,
    /// Share of the visible surface points with a point of the cloud within 5 cm.
    completeness: f64,
    /// Completeness of the visible points near people; None when there are none.
    completeness_near_people: Option<f64>,
    /// Accuracy: median distance of the points to the nearest static surface, metres.
    median_distance: f64,
    /// Number of points scored.
    points: usize,
    /// Number of visible surface points that the cloud should have.
    visible_points: usize,
}

/// Scores points (n, 3) in the world, such as `map.cloud().positions`, against the truth: a SequenceTruth or
/// PointTruth. None when no point is finite.
#[pyfunction]
pub(crate) fn score_cloud(
    py: Python<'_>,
    positions: &Bound<'_, PyAny>,
    truth: TruthArgument<'_>,
) -> PyResult<Option<PyCloudScore>> {
    let (cloud, truth) = (PointCloud::new(points(positions, "positions")?), truth.truth());
    Ok(py.detach(|| cloud_score(&cloud, truth)).map(|score| PyCloudScore {
        residue: score.residue,
        stray: score.stray,
        completeness: score.completeness,
        completeness_near_people: score.completeness_near_people,
        median_distance: score.median_distance,
        points: score.points,
        visible_points: score.visible_points,
    }))
}

/// How thick the walls, floors and table tops of a cloud are, metres: (median, 95 % quantile) over tiles of
/// 50 cm; the thickness of a wall that was mapped twice is the distance between its copies. faces: a list of
/// TrueFace. None when no tile has points.
#[pyfunction]
pub(crate) fn score_walls(
    py: Python<'_>,
    positions: &Bound<'_, PyAny>,
    faces: Vec<Bound<'_, PyTrueFace>>,
    truth: TruthArgument<'_>,
) -> PyResult<Option<(f64, f64)>> {
    let (cloud, truth) = (PointCloud::new(points(positions, "positions")?), truth.truth());
    let faces: Vec<_> = faces.iter().map(|face| face.get().0.clone()).collect();
    let score = py.detach(|| wall_score(&cloud, &faces, truth));
    Ok(score.map(|score| (score.thickness.median, score.thickness.p95)))
}

/// The absolute trajectory error (Sturm 2012) of poses `world_from_camera`, frame by frame, after the rigid
/// motion that fits best: root mean squares of translation (metres) and rotation (radians). None without
/// poses.
#[pyfunction]
pub(crate) fn trajectory_error(
    estimated: Vec<PoseArgument>,
    truth: Vec<PoseArgument>,
) -> PyResult<Option<(f64, f64)>> {
    if estimated.len() != truth.len() {
        return Err(refused(format!("{} estimated poses for {} true ones", estimated.len(), truth.len())));
    }
    let [estimated, truth] =
        [estimated, truth].map(|poses| poses.into_iter().map(|pose| pose.0).collect::<Vec<Pose>>());
    Ok(TrajectoryScore::of(&estimated, &truth).map(|score| (score.translation, score.rotation)))
}

/// All readings of a recording without movers: a reference for maps of the same place with movers when there
/// is no exact truth. voxel_size in metres, 0.002 to 1.
#[pyclass(frozen, name = "ReferenceCloud", module = "dymlm.metrics")]
#[derive(Debug)]
pub(crate) struct PyReferenceCloud(Exclusive<ReferenceCloud>);

#[pymethods]
impl PyReferenceCloud {
    #[new]
    #[pyo3(signature = (voxel_size = 0.02))]
    fn new(voxel_size: f64) -> PyResult<Self> {
        Ok(Self(Exclusive::new(ReferenceCloud::new(voxel_size).or_raise()?)))
    }

    /// Adds every reading of a Frame within `min_depth` to `max_depth` metres, at its pose: those of the
    /// sensor, `map.config.to_dict()["sensor"]`, where the map is to hold all that the sensor reads.
    fn add_frame(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyFrame>,
        min_depth: f32,
        max_depth: f32,
    ) -> PyResult<()> {
        let frame = frame.get();
        let add = |cloud: &mut ReferenceCloud| {
            cloud.add_frame(&frame.frame, &frame.world_from_camera, min_depth, max_depth);
        };
        self.0.with(py, add)
    }

    /// Scores points (n, 3) of a map: (residue, completeness). Residue: share of the map's voxels further
    /// than 6 cm from every voxel of the reference. Completeness: share of those voxels of the reference, hit
    /// by at least three frames, that have a map voxel within 5 cm.
    fn score(&self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
        let points = points(positions, "positions")?;
        let score = self.0.with(py, |cloud| cloud.score(&points))?;
        Ok((score.residue, score.completeness))
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.0.with(py, |cloud| cloud.len())
    }
}

/// Scores which readings a cleaned map keeps (DynamicMap benchmark, Zhang 2023), among readings within
/// `min_depth` to `max_depth` metres: those of the sensor, `map.config.to_dict()["sensor"]`. Readings that the
/// map was never given count against it.
#[pyclass(frozen, name = "DynamicMapScorer", module = "dymlm.metrics")]
#[derive(Debug)]
pub(crate) struct PyDynamicMapScorer(Exclusive<DynamicMapScorer>);

#[pymethods]
impl PyDynamicMapScorer {
    #[new]
    fn new(min_depth: f32, max_depth: f32) -> Self {
        Self(Exclusive::new(DynamicMapScorer::new(min_depth..=max_depth)))
    }

    /// Adds the readings of a Frame at its pose; movers: (height, width) bool, True where a pixel shows a
    /// mover, by default the frame's `mover_mask`.
    #[pyo3(signature = (frame, movers = None))]
    fn add_frame(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyFrame>,
        movers: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let frame = frame.get();
        let given = movers.map(mask_of).transpose()?;
        let known = frame.truth.as_ref().map(|truth| &truth.mover_mask);
        let movers = given.as_ref().or(known).ok_or_else(|| refused("a frame without a mover mask"))?;
        self.0.with(py, |scorer| scorer.add_frame(&frame.frame, movers, &frame.world_from_camera))?.or_raise()
    }

    /// Scores points (n, 3) of a map.
    fn score(&self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> PyResult<PyDynamicMapScore> {
        let points = points(positions, "positions")?;
        self.0.with(py, |scorer| PyDynamicMapScore::of(&scorer.score(&points)))
    }
}

/// The score of a cleaned map: which readings it keeps.
#[pyclass(frozen, get_all, name = "DynamicMapScore", module = "dymlm.metrics")]
#[derive(Debug)]
pub(crate) struct PyDynamicMapScore {
    /// Share of the static readings that the map keeps; None when there are none.
    static_accuracy: Option<f64>,
    /// Share of the dynamic readings that the map has removed; None when there are none.
    dynamic_accuracy: Option<f64>,
    /// Geometric mean of the two.
    associated_accuracy: Option<f64>,
    /// Harmonic mean of the two.
    harmonic_accuracy: Option<f64>,
    /// Number of static readings.
    static_readings: u64,
    /// Number of dynamic readings.
    dynamic_readings: u64,
}

impl PyDynamicMapScore {
    fn of(score: &DynamicMapScore) -> Self {
        Self {
            static_accuracy: score.static_accuracy,
            dynamic_accuracy: score.dynamic_accuracy,
            associated_accuracy: score.associated_accuracy,
            harmonic_accuracy: score.harmonic_accuracy,
            static_readings: score.static_readings,
            dynamic_readings: score.dynamic_readings,
        }
    }
}

/// How planes compare with the true faces. Faces with at least 0.08 m2 in view must be found. A face that is
/// mapped several times, planes across several faces and normals that point the wrong way leave recall and
/// precision as they are: see `duplicates`, `wrongly_merged` and `sign_errors`.
#[pyclass(frozen, get_all, name = "PlaneScore", module = "dymlm.metrics")]
#[derive(Debug)]
pub(crate) struct PyPlaneScore {
    /// Share of the faces to be found that were found; None when there are none.
    recall: Option<f64>,
    /// Share of the planes that match a face; None without planes.
    precision: Option<f64>,
    /// Share of the visible area of the faces to be found that planes cover.
    area_recall: Option<f64>,
    /// Share of the planes' area that lies on faces.
    area_precision: Option<f64>,
    /// Mean intersection over union of boundaries of the faces that were found.
    mean_boundary_iou: Option<f64>,
    /// Angles between matched planes and their faces, degrees: (median, 95 % quantile).
    angle_degrees: Option<(f64, f64)>,
    /// Offsets of matched planes from their faces, metres: (median, 95 % quantile).
    offset: Option<(f64, f64)>,
    /// Visible area of the faces to be found, square metres.
    visible_area: f64,
    /// The matches: a list of (index of the plane, id of the face).
    matches: Vec<(usize, usize)>,
    /// Indices of the planes that match no face.
    unmatched: Vec<usize>,
    /// Ids of the faces to be found that were not found.
    missed: Vec<usize>,
    /// Planes on the same visible piece of a face as an earlier plane: a list of (index of the plane, index of the
    /// earlier one).
    duplicates: Vec<(usize, usize)>,
    /// Planes that cover more than 0.08 m2 of each of several faces: a list of (index of the plane, ids of the
    /// faces).
    wrongly_merged: Vec<(usize, Vec<usize>)>,
    /// Indices of the matched planes whose normal points into the thing.
    sign_errors: Vec<usize>,
}

/// Scores planes of a map, a list of Plane, against the true faces, a list of TrueFace.
#[pyfunction]
pub(crate) fn score_planes(
    py: Python<'_>,
    planes: Vec<Bound<'_, PyPlane>>,
    faces: Vec<Bound<'_, PyTrueFace>>,
) -> PyResult<PyPlaneScore> {
    let faces: Vec<_> = faces.iter().map(|face| face.get().0.clone()).collect();
    let planes: PyResult<Vec<_>> = planes.iter().map(|plane| plane.get().plane()).collect();
    let planes = planes?;
    let score = py.detach(|| {
        let estimated = planes.into_iter().map(|plane| EstimatedPlane {
            normal: plane.plane().normal(),
            d: plane.plane().d(),
            boundary: plane
                .boundary()
                .into_iter()
                .flat_map(|polygon| std::iter::once(polygon.outline).chain(polygon.holes))
                .collect(),
        });
        plane_score(&estimated.collect::<Vec<_>>(), &faces)
    });
    let missed = score.faces.iter().filter(|face| face.state == FaceState::Missed);
    let inwards = score.matches.iter().filter(|found| found.facing == Facing::Inwards);
    Ok(PyPlaneScore {
        recall: score.recall(),
        precision: score.precision(),
        area_recall: score.area_recall,
        area_precision: score.area_precision,
        mean_boundary_iou: score.mean_boundary_iou(),
        angle_degrees: score.angle_degrees.map(quantiles),
        offset: score.offset.map(quantiles),
        visible_area: score.visible_area,
        matches: score.matches.iter().map(|found| (found.plane, found.face)).collect(),
        missed: missed.map(|face| face.face).collect(),
        duplicates: score.duplicates.iter().map(|found| (found.plane, found.of)).collect(),
        sign_errors: inwards.map(|found| found.plane).collect(),
        unmatched: score.unmatched,
        wrongly_merged: score.wrongly_merged.into_iter().map(|merged| (merged.plane, merged.faces)).collect(),
    })
}

/// How objects compare with the true ones as boxes; matches have an intersection over union of 0.25 or more.
/// Objects that at least 8 frames saw must be found.
#[pyclass(frozen, get_all, name = "ObjectScore", module = "dymlm.metrics")]
#[derive(Debug)]
pub(crate) struct PyObjectScore {
    /// Share of the objects to be found that have a match; None when there are none.
    recall: Option<f64>,
    /// Share of the map's objects that have a match; None without objects.
    precision: Option<f64>,
    /// Share of the matches with the right label.
    label_accuracy: Option<f64>,
    /// Mean intersection over union of the matches.
    mean_iou: Option<f64>,
    /// Distances between the centres of the matches, metres: (median, 95 % quantile).
    center_error: Option<(f64, f64)>,
    /// Yaw errors of the matches that have one, degrees: (median, 95 % quantile).
    yaw_error_degrees: Option<(f64, f64)>,
    /// The matches: a list of (index of the map's object, id of the true one).
    matches: Vec<(usize, usize)>,
}

/// Scores objects of a map, a list of MapObject, against the true ones, a list of TrueObject.
#[pyfunction]
pub(crate) fn score_objects(
    py: Python<'_>,
    objects: Vec<Bound<'_, PyMapObject>>,
    truth: Vec<Bound<'_, PyTrueObject>>,
) -> PyResult<PyObjectScore> {
    let estimated = objects.iter().map(|object| {
        let object = object.get().object()?;
        let oriented_box = object.oriented_box();
        Ok(EstimatedObject {
            label: object.label().to_owned(),
            world_from_object: oriented_box.world_from_box(),
            dimensions: oriented_box.lengths(),
        })
    });
    let estimated: PyResult<Vec<_>> = estimated.collect();
    let truth: Vec<_> = truth.iter().map(|object| object.get().0.clone()).collect();
    let estimated = estimated?;
    let score = py.detach(|| object_score(&estimated, &truth));
    Ok(PyObjectScore {
        recall: score.recall(),
        precision: score.precision(),
        label_accuracy: score.label_accuracy(),
        mean_iou: score.mean_iou,
        center_error: score.center_error.map(quantiles),
        yaw_error_degrees: score.yaw_error_degrees.map(quantiles),
        matches: score.matches.iter().map(|found| (found.estimate, found.object)).collect(),
    })
}

fn quantiles(spread: Spread) -> (f64, f64) {
    (spread.median, spread.p95)
}
