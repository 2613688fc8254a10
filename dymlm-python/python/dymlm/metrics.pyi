from collections.abc import Iterable
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import Frame, MapObject, Plane, Pose, _PoseLike

__all__ = [
    "CloudScore",
    "DynamicMapScore",
    "DynamicMapScorer",
    "ObjectScore",
    "PlaneScore",
    "PointTruth",
    "ReferenceCloud",
    "SequenceTruth",
    "TrueFace",
    "TrueObject",
    "score_cloud",
    "score_objects",
    "score_planes",
    "score_walls",
    "trajectory_error",
]

@final
class SequenceTruth:
    """The exact truth about a simulated sequence."""

    @property
    def faces(self) -> list[TrueFace]:
        """All flat faces of the static scene, a list of TrueFace."""

    @property
    def objects(self) -> list[TrueObject]:
        """All labelled static things, a list of TrueObject."""

@final
class PointTruth:
    """Truth from measured points: a scan of the static world (n, 3) whose neighbours are at most 2 cm apart, and
    readings of movers (m, 3): points within `margin` metres of these count as swept by movers.
    """

    def __new__(cls, surface: ArrayLike, movers: ArrayLike | None = None, margin: float = 0.1) -> PointTruth: ...

@final
class TrueFace:
    """A flat face of the true world that was seen as a whole: the plane normal . x + offset = 0, whose normal
    points to the side from which it can be seen, and an outline (k, 3) on it, rasterized in cells of `cell`
    metres.
    """

    def __new__(cls, id: int, normal: ArrayLike, offset: float, outline: ArrayLike, cell: float = 0.02) -> TrueFace: ...

    @property
    def id(self) -> int:
        """Identifies the face."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """Unit normal (3,)."""

    @property
    def offset(self) -> float:
        """Offset, metres."""

    @property
    def area(self) -> float:
        """Area, square metres."""

    @property
    def visible_area(self) -> float:
        """Area that was seen, square metres."""

@final
class TrueObject:
    """A labelled thing of the true world that was seen in `frames_visible` frames. The third axis of its box is
    the vertical; size: full lengths along the axes (3,), metres.
    """

    def __new__(cls, id: int, label: str, world_from_object: _PoseLike, size: ArrayLike, frames_visible: int = 8) -> TrueObject: ...

    @property
    def id(self) -> int:
        """Identifies the thing."""

    @property
    def label(self) -> str:
        """COCO label."""

    @property
    def world_from_object(self) -> Pose:
        """The frame of its box."""

    @property
    def size(self) -> NDArray[np.float64]:
        """Full lengths along its axes (3,), metres."""

    @property
    def frames_visible(self) -> int:
        """Number of frames that saw it."""

@final
class CloudScore:
    """How far a cloud is from the truth."""

    @property
    def residue(self) -> float:
        """Share of the points further than 6 cm from every static surface and within the volume swept by movers."""

    @property
    def stray(self) -> float:
        """Share of the points further than 6 cm from every static surface and outside that volume."""

    @property
    def completeness(self) -> float:
        """Share of the visible surface points with a point of the cloud within 5 cm."""

    @property
    def completeness_near_people(self) -> float | None:
        """Completeness of the visible points near people; None when there are none."""

    @property
    def median_distance(self) -> float:
        """Accuracy: median distance of the points to the nearest static surface, metres."""

    @property
    def points(self) -> int:
        """Number of points scored."""

    @property
    def visible_points(self) -> int:
        """Number of visible surface points that the cloud should have."""

@final
class ReferenceCloud:
    """All readings of a recording without movers: a reference for maps of the same place with movers when there
    is no exact truth. voxel_size in metres, 0.002 to 1.
    """

    def __new__(cls, voxel_size: float = 0.02) -> ReferenceCloud: ...

    def add_frame(self, frame: Frame, min_depth: float, max_depth: float) -> None:
        """Adds every reading of a Frame within `min_depth` to `max_depth` metres, at its pose: those of the
        sensor, `map.config.to_dict()["sensor"]`, where the map is to hold all that the sensor reads.
        """

    def score(self, positions: ArrayLike) -> tuple[float, float]:
        """Scores points (n, 3) of a map: (residue, completeness). Residue: share of the map's voxels further
        than 6 cm from every voxel of the reference. Completeness: share of those voxels of the reference, hit
        by at least three frames, that have a map voxel within 5 cm.
        """

    def __len__(self) -> int: ...

@final
class DynamicMapScorer:
    """Scores which readings a cleaned map keeps (DynamicMap benchmark, Zhang 2023), among readings within
    `min_depth` to `max_depth` metres: those of the sensor, `map.config.to_dict()["sensor"]`. Readings that the
    map was never given count against it.
    """

    def __new__(cls, min_depth: float, max_depth: float) -> DynamicMapScorer: ...

    def add_frame(self, frame: Frame, movers: NDArray[np.bool_] | None = None) -> None:
        """Adds the readings of a Frame at its pose; movers: (height, width) bool, True where a pixel shows a
        mover, by default the frame's `mover_mask`.
        """

    def score(self, positions: ArrayLike) -> DynamicMapScore:
        """Scores points (n, 3) of a map."""

@final
class DynamicMapScore:
    """The score of a cleaned map: which readings it keeps."""

    @property
    def static_accuracy(self) -> float | None:
        """Share of the static readings that the map keeps; None when there are none."""

    @property
    def dynamic_accuracy(self) -> float | None:
        """Share of the dynamic readings that the map has removed; None when there are none."""

    @property
    def associated_accuracy(self) -> float | None:
        """Geometric mean of the two."""

    @property
    def harmonic_accuracy(self) -> float | None:
        """Harmonic mean of the two."""

    @property
    def static_readings(self) -> int:
        """Number of static readings."""

    @property
    def dynamic_readings(self) -> int:
        """Number of dynamic readings."""

@final
class PlaneScore:
    """How planes compare with the true faces. Faces with at least 0.08 m2 in view must be found. A face that is
    mapped several times, planes across several faces and normals that point the wrong way leave recall and
    precision as they are: see `duplicates`, `wrongly_merged` and `sign_errors`.
    """

    @property
    def recall(self) -> float | None:
        """Share of the faces to be found that were found; None when there are none."""

    @property
    def precision(self) -> float | None:
        """Share of the planes that match a face; None without planes."""

    @property
    def area_recall(self) -> float | None:
        """Share of the visible area of the faces to be found that planes cover."""

    @property
    def area_precision(self) -> float | None:
        """Share of the planes' area that lies on faces."""

    @property
    def mean_boundary_iou(self) -> float | None:
        """Mean intersection over union of boundaries of the faces that were found."""

    @property
    def angle_degrees(self) -> tuple[float, float] | None:
        """Angles between matched planes and their faces, degrees: (median, 95 % quantile)."""

    @property
    def offset(self) -> tuple[float, float] | None:
        """Offsets of matched planes from their faces, metres: (median, 95 % quantile)."""

    @property
    def visible_area(self) -> float:
        """Visible area of the faces to be found, square metres."""

    @property
    def matches(self) -> list[tuple[int, int]]:
        """The matches: a list of (index of the plane, id of the face)."""

    @property
    def unmatched(self) -> list[int]:
        """Indices of the planes that match no face."""

    @property
    def missed(self) -> list[int]:
        """Ids of the faces to be found that were not found."""

    @property
    def duplicates(self) -> list[tuple[int, int]]:
        """Planes on the same visible piece of a face as an earlier plane: a list of (index of the plane, index of the
        earlier one).
        """

    @property
    def wrongly_merged(self) -> list[tuple[int, list[int]]]:
        """Planes that cover more than 0.08 m2 of each of several faces: a list of (index of the plane, ids of the
        faces).
        """

    @property
    def sign_errors(self) -> list[int]:
        """Indices of the matched planes whose normal points into the thing."""

@final
class ObjectScore:
    """How objects compare with the true ones as boxes; matches have an intersection over union of 0.25 or more.
    Objects that at least 8 frames saw must be found.
    """

    @property
    def recall(self) -> float | None:
        """Share of the objects to be found that have a match; None when there are none."""

    @property
    def precision(self) -> float | None:
        """Share of the map's objects that have a match; None without objects."""

    @property
    def label_accuracy(self) -> float | None:
        """Share of the matches with the right label."""

    @property
    def mean_iou(self) -> float | None:
        """Mean intersection over union of the matches."""

    @property
    def center_error(self) -> tuple[float, float] | None:
        """Distances between the centres of the matches, metres: (median, 95 % quantile)."""

    @property
    def yaw_error_degrees(self) -> tuple[float, float] | None:
        """Yaw errors of the matches that have one, degrees: (median, 95 % quantile)."""

    @property
    def matches(self) -> list[tuple[int, int]]:
        """The matches: a list of (index of the map's object, id of the true one)."""

def score_cloud(positions: ArrayLike, truth: SequenceTruth | PointTruth) -> CloudScore | None:
    """Scores points (n, 3) in the world, such as `map.cloud().positions`, against the truth: a SequenceTruth or
    PointTruth. None when no point is finite.
    """

def score_walls(positions: ArrayLike, faces: Iterable[TrueFace], truth: SequenceTruth | PointTruth) -> tuple[float, float] | None:
    """How thick the walls, floors and table tops of a cloud are, metres: (median, 95 % quantile) over tiles of
    50 cm; the thickness of a wall that was mapped twice is the distance between its copies. faces: a list of
    TrueFace. None when no tile has points.
    """

def trajectory_error(estimated: Iterable[_PoseLike], truth: Iterable[_PoseLike]) -> tuple[float, float] | None:
    """The absolute trajectory error (Sturm 2012) of poses `world_from_camera`, frame by frame, after the rigid
    motion that fits best: root mean squares of translation (metres) and rotation (radians). None without
    poses.
    """

def score_planes(planes: Iterable[Plane], faces: Iterable[TrueFace]) -> PlaneScore:
    """Scores planes of a map, a list of Plane, against the true faces, a list of TrueFace."""

def score_objects(objects: Iterable[MapObject], truth: Iterable[TrueObject]) -> ObjectScore:
    """Scores objects of a map, a list of MapObject, against the true ones, a list of TrueObject."""
