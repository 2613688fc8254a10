import math
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from . import metrics as metrics

__all__ = [
    "Boundary",
    "Camera",
    "ChangedThings",
    "Cloud",
    "CloudBlock",
    "Config",
    "ConfigError",
    "CorrectionReport",
    "Dataset",
    "Detection",
    "DistanceField",
    "Error",
    "FileError",
    "FloorGrid",
    "FloorUnder",
    "FoundObject",
    "Frame",
    "FrameReport",
    "GridUpdate",
    "Locked",
    "LoopClosure",
    "Map",
    "MapBuilder",
    "MapChanges",
    "MapObject",
    "MapReader",
    "MapSaver",
    "MapUpdate",
    "MergeRefused",
    "MergeReport",
    "Mover",
    "NewIds",
    "NoFloor",
    "NoHistory",
    "NotPending",
    "ObjectMove",
    "ObjectTracker",
    "ObjectUpdate",
    "OccupancyGrid",
    "Octree",
    "OutOfReach",
    "Plane",
    "Pose",
    "RefineReport",
    "RefinementStopped",
    "Sequence",
    "StaticPoints",
    "ThingChanges",
    "TimeReversed",
    "UnknownFrame",
    "UnknownObject",
    "WorldChanges",
    "builtin_sequence",
    "load",
    "metrics",
]

# A Pose, a 4x4 matrix, or seven numbers: tx ty tz qx qy qz qw.
_PoseLike: TypeAlias = Pose | ArrayLike
# The output of a detector for a frame: a list, empty when it found nothing; None when it did not run.
_Detections: TypeAlias = Iterable[Detection] | Literal["pending"] | None

class Error(ValueError):
    """A call was refused, such as one with a bad frame, config or folder; the text says why. Nothing has changed."""

class ConfigError(Error):
    """A setting has no such name, or is outside its range."""

class TimeReversed(Error):
    """A frame is older than the one before it."""

class OutOfReach(Error):
    """A camera or its readings lie too far out to be mapped."""

class NotPending(Error):
    """A frame awaits no detections: it has them, or was processed without them since they came too late."""

class UnknownFrame(Error):
    """No frame of this id or timestamp was inserted."""

class UnknownObject(Error):
    """No object of this id is in the map."""

class NoHistory(Error):
    """No key frames are kept, so that poses cannot be corrected: see the setting `history`."""

class NoFloor(Error):
    """No floor is known under a place."""

class MergeRefused(Error):
    """Maps that were made with different configs, or that hold different contents of one session."""

class FileError(Error):
    """A file or folder cannot be read or written, or is damaged."""

class Locked(FileError):
    """Somebody else writes the folder of a map."""

class RefinementStopped(Error):
    """A further round of refining poses has failed. The maps are as the rounds before it have made them; `done`, a RefineReport, says what these have done."""

    done: RefineReport

@final
class Pose:
    """A rigid motion, such as `world_from_camera`, which takes camera coordinates to the world.

    Made of a translation (3,) in metres and a quaternion (4,) `x, y, z, w`, or of one argument that every
    `world_from_camera` accepts too: a 4x4 matrix, or seven numbers `tx ty tz qx qy qz qw`.
    `numpy.asarray(pose)` is the 4x4 matrix. Camera coordinates: x to the right, y down, z forward.
    """

    def __new__(cls, translation: ArrayLike, quaternion: ArrayLike | None = None) -> Pose: ...

    @staticmethod
    def identity() -> Pose:
        """The identity."""

    @property
    def translation(self) -> NDArray[np.float64]:
        """Translation (3,), metres."""

    @property
    def quaternion(self) -> NDArray[np.float64]:
        """Unit quaternion (4,): x, y, z, w."""

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The 4x4 matrix, float64."""

    def inverse(self) -> Pose:
        """The inverse motion."""

    def __matmul__(self, value: _PoseLike, /) -> Pose: ...

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]: ...

    def __eq__(self, value: object, /) -> bool: ...

@final
class Camera:
    """A pinhole camera: size in pixels, focal lengths and principal point in pixels. Depth and colour have the
    same size and are registered to each other. Images of lenses with distortion must be rectified first.
    """

    def __new__(cls, width: int, height: int, fx: float, fy: float, cx: float, cy: float) -> Camera: ...

    @property
    def width(self) -> int:
        """Width, pixels."""

    @property
    def height(self) -> int:
        """Height, pixels."""

    @property
    def fx(self) -> float:
        """Focal length along x, pixels."""

    @property
    def fy(self) -> float:
        """Focal length along y, pixels."""

    @property
    def cx(self) -> float:
        """Principal point, column, pixels."""

    @property
    def cy(self) -> float:
        """Principal point, row, pixels."""

    def __eq__(self, value: object, /) -> bool: ...

@final
class Config:
    """Settings of the maps. Fields that are not given have their defaults, or those of `preset` ("default",
    "offline": every frame is mapped, "robot"). The fields are those of a config file:
    `Config(history="memory", cloud={"voxel_size": 0.02})`, `Config("robot", sensor={"preset":
    "realsense_d4xx"})`.

    `history`: "memory", or {"folder": path}, keeps the observations of key frames, which correcting, merging
    and refining need. A MapBuilder's exception names a field that is outside its range.
    """

    def __new__(cls, preset: str | None = None, **fields: Any) -> Config: ...

    @staticmethod
    def from_toml(text_or_path: str | os.PathLike[str]) -> Config:
        """Reads a config, given as the path of a file (any `os.PathLike`, or a string of one line that ends with
        ".toml") or as TOML text.
        """

    def to_toml(self) -> str:
        """All fields as the text of a config file."""

    def to_dict(self) -> dict[str, Any]:
        """All fields as nested dictionaries."""

    def __eq__(self, value: object, /) -> bool: ...

@final
class Detection:
    """A detection of a 2D detector: a label (COCO's names, such as "person"), a box `x_min, y_min, x_max, y_max`
    in pixels, a score, 0 to 1, and, if the detector gives one, an instance mask (height, width) of bools,
    `True` on the thing.
    """

    def __new__(cls, label: str, box: ArrayLike, score: float, mask: NDArray[np.bool_] | None = None) -> Detection: ...

    @property
    def label(self) -> str:
        """The detected class."""

    @property
    def box(self) -> list[float]:
        """Its box: x_min, y_min, x_max, y_max, pixels."""

    @property
    def score(self) -> float:
        """The detector's confidence, 0 to 1."""

    @property
    def mask(self) -> NDArray[np.bool_] | None:
        """The instance mask, (height, width) bool, True on the thing; None if the detector gave none."""

    def __eq__(self, value: object, /) -> bool: ...

@final
class Frame:
    """A frame with its detections and the camera's pose, which datasets and simulated sequences give and
    MapBuilder.insert_frame takes. `depth`, `color`, `world_from_camera`, `detections` and `depth_scale` as in
    MapBuilder.insert.
    """

    def __new__(cls, camera: Camera, timestamp: float, depth: NDArray[np.uint16] | NDArray[np.float32], color: NDArray[np.uint8] | None = None, world_from_camera: _PoseLike | None = None, detections: _Detections = None, depth_scale: float = 1000.0) -> Frame: ...

    @property
    def timestamp(self) -> float:
        """Time, seconds."""

    @property
    def camera(self) -> Camera:
        """The camera."""

    @property
    def depth(self) -> NDArray[np.float32]:
        """Depth along the optical axis, (height, width) float32, metres; 0 where there is no reading. A copy."""

    @property
    def color(self) -> NDArray[np.uint8] | None:
        """Colours, (height, width, 3) uint8: red, green, blue; None if the frame has none. A copy."""

    @property
    def detections(self) -> list[Detection] | Literal["pending"] | None:
        """The detections: a list of Detection, None when the detector did not run, "pending" while it still
        runs.
        """

    @property
    def world_from_camera(self) -> Pose:
        """The camera's pose; for a simulated frame, the exact one."""

    @property
    def estimated_world_from_camera(self) -> Pose | None:
        """For a simulated frame, the pose as a SLAM would estimate it; else None."""

    @property
    def mover_mask(self) -> NDArray[np.bool_] | None:
        """For a simulated frame, the exact mask of movers, (height, width) bool; else None."""

@final
class MapBuilder:
    """Builds four maps of the static world (cloud, octree, planes, objects) from frames, 2D detections and
    poses, while people walk through it. Frames come in the order of their time.

    While a call runs, other threads of Python run. Threads may share a builder: their calls run one after the
    other. A refused call raises an exception and changes nothing.
    """

    def __new__(cls, camera: Camera, config: Config | None = None) -> MapBuilder: ...

    @staticmethod
    def resume(map: Map, camera: Camera) -> MapBuilder:
        """Continues a map of an earlier session: its ids and its clock go on. Poses are in its world."""

    def insert(self, timestamp: float, depth: NDArray[np.uint16] | NDArray[np.float32], color: NDArray[np.uint8] | None = None, *, world_from_camera: _PoseLike, detections: _Detections = None, depth_scale: float = 1000.0) -> FrameReport:
        """Takes in one frame.

        timestamp: seconds. depth: (height, width), uint16 with `depth_scale` units a metre (1000:
        millimetres, 5000: TUM), or float32 metres; 0 and NaN are no readings. color: (height, width, 3)
        uint8, red, green, blue, registered to the depth image. world_from_camera: a Pose, a 4x4 matrix, or
        `tx ty tz qx qy qz qw`. detections: a list of Detection, empty when the detector found nothing; None
        when it did not run; "pending" while it still runs, then pass them to `detections_for` later.

        Arrays may be views with any strides. Each value is read once, into images that the builder reuses.
        """

    def insert_frame(self, frame: Frame) -> FrameReport:
        """Takes in a Frame of a dataset or a simulation, with its own pose and detections."""

    def insert_scan(self, timestamp: float, points: ArrayLike, world_from_sensor: _PoseLike) -> FrameReport:
        """Takes in a scan of a lidar: points (n, 3) in the sensor's frame, metres. It goes into cloud and
        octree.
        """

    def detections_for(self, frame: int, detections: Iterable[Detection]) -> FrameReport:
        """Passes on the detections of a frame that was inserted with "pending". With a history, also the
        detections of a key frame that was mapped without any.
        """

    def process_waiting(self) -> list[FrameReport]:
        """Processes all waiting frames; those still without detections count as frames on which the detector did
        not run.
        """

    def settle(self) -> None:
        """Removes at once from octree, planes and objects what the newest frames have found not to belong to the
        static world; otherwise this happens once a second.
        """

    def track_object(self, object: int, frame: Frame) -> ObjectTracker:
        """Chooses an object of the map to be followed while somebody carries it. In the given Frame, the object
        must still stand where the map has it. Returns an ObjectTracker.
        """

    def follow_object(self, tracker: ObjectTracker) -> ObjectMove | None:
        """Tells the maps what a tracker has found in its last frame; call this before that frame is inserted.
        While the object moves, its pixels are kept out of the maps. Once it has come to rest, all maps have
        it at its new place, its old place is empty, and an ObjectMove is returned; else None.
        """

    def release_object(self, object: int) -> None:
        """Ends the carrying of an object that is not followed any more, as where its carrier has left with it:
        the map has it where it stood, and removes it where frames look through that place.
        """

    def map(self) -> Map:
        """The maps in their current state: a Map that does not change while the builder goes on. It shares
        unchanged memory with the builder.
        """

    def reader(self) -> MapReader:
        """A reader of the maps for other threads, which never waits for the builder."""

    def finish(self) -> Map:
        """Processes the waiting frames, settles, and returns the maps; the builder then accepts no more frames."""

    def correct_poses(self, poses: Mapping[int, _PoseLike] | Mapping[float, _PoseLike]) -> CorrectionReport:
        """Gives frames new poses, as after a loop closure, and all four maps follow: they are, to the bit, the
        maps that the same observations at the new poses would have made. Needs a history. poses: new poses by
        frame id (int) or by timestamp (float, as inserted), not both in one call; other frames move with
        their neighbours. Ctrl-C cancels the call, and nothing has changed.
        """

    def remove(self, frame: int | float) -> CorrectionReport:
        """Removes a frame or a scan from all maps, as if it had never been inserted. Needs a history. frame: its
        id, or its timestamp.
        """

    def transform(self, new_from_old: _PoseLike) -> CorrectionReport:
        """Moves the whole world: each frame's new pose is `new_from_old` times its old one. Needs a history."""

    def refine_poses(self, closures: Iterable[LoopClosure] | None = None, **fields: Any) -> RefineReport:
        """Refines the poses by the planes and objects that the key frames have seen, and all maps follow. Needs
        a history. closures: a list of LoopClosure; the report names those that were rejected. Further
        keywords are the fields of Rust's `RefineConfig`, such as `rounds=3` or `translation_per_second=0.05`.
        """

    def trajectory(self) -> list[tuple[int, float, Pose]]:
        """The frames that were inserted: a list of (id, timestamp, Pose), with the poses at which they are
        mapped now. Empty without a history.
        """

    def begin_session(self) -> list[FrameReport]:
        """Begins another session in the same world: its clock may restart, and movers are tracked anew."""

    def forget_outside(self, center: ArrayLike, radius: float) -> None:
        """Removes from all maps everything farther than `radius` metres from a point (3,) in the world."""

    def memory(self) -> dict[str, int]:
        """Memory in bytes of each map, of the stored key frames ("history"), of earlier states ("snapshots") and
        of the maps that readers see ("published"). "unfiled_history" is the part of "history" that the file
        has refused, on a full disk.
        """

    def static_mask(self) -> NDArray[np.bool_]:
        """The static pixels of the last frame, (height, width) bool, for every `sensor.stride`-th pixel of every
        `sensor.stride`-th row.
        """

    @property
    def config(self) -> Config:
        """The settings."""

    @property
    def camera(self) -> Camera:
        """The camera of `insert`."""

@final
class MapReader:
    """Reads the maps of a builder on any thread. The builder publishes its maps every half second of the frames'
    clock and whenever they are changed on request. Builder and reader never wait for each other.
    """

    def latest(self) -> Map:
        """The maps that were published last."""

    def wait_newer(self, than: Map, timeout: float = math.inf) -> Map | None:
        """Waits for maps that are newer than these, at most `timeout` seconds, by default for ever; None when
        none came. Ctrl-C ends it.
        """

@final
class MapSaver:
    """Saves maps repeatedly into one folder; each time, only the changed parts of the state are written. Its
    first save replaces the contents of the folder. Until it is closed, or no longer referred to, nobody else
    can write the folder: `with dymlm.MapSaver(folder) as saver:`.
    """

    def __new__(cls, folder: str | os.PathLike[str]) -> MapSaver: ...

    @staticmethod
    def load(folder: str | os.PathLike[str], history: str | dict[str, Any] | None = None, memory: dict[str, Any] | None = None) -> tuple[MapSaver, Map]:
        """Loads the map of a folder to continue saving there. Returns a MapSaver, whose first save writes only
        the changes since, and the Map. `history` and `memory`: as for `dymlm.load`.
        """

    def save(self, map: Map) -> None:
        """Saves a map. After a crash the folder holds either the map saved before or this one, never half of it."""

    def close(self) -> None:
        """Lets others write the folder; this MapSaver saves no more."""

    def __enter__(self) -> MapSaver: ...

    def __exit__(self, *_exception: object) -> None: ...

    @property
    def folder(self) -> Path:
        """The map's folder."""

@final
class ObjectTracker:
    """Follows an object of the map while somebody carries it, in six degrees of freedom. Made by
    `MapBuilder.track_object`.
    """

    @property
    def object(self) -> int:
        """The object's id in the map."""

    def track(self, frame: Frame) -> ObjectUpdate:
        """Finds the object in the next Frame, which needs colours. Returns an ObjectUpdate."""

    def move_world(self, new_from_old: _PoseLike) -> None:
        """Converts what is known of the object after the world was moved, as by `MapBuilder.correct_poses`: its
        report has `new_from_old`. Poses of later frames are in the new world. Track a frame before the builder is
        told of the object again.
        """

@final
class ObjectUpdate:
    """Where a carried object is in a frame."""

    @property
    def state(self) -> str:
        """"at_rest", "tracking", "occluded", "lost" or "recovered"."""

    @property
    def world_from_object(self) -> Pose:
        """Its pose; when `inliers` is 0, the last known pose or a prediction."""

    @property
    def inliers(self) -> int:
        """Number of points that agree on the pose."""

    @property
    def confidence(self) -> float:
        """Confidence in the pose, 0 to 1."""

    @property
    def came_to_rest(self) -> bool:
        """Whether it came to rest in this frame, at a new place."""

@final
class ObjectMove:
    """The move of an object that was put down at another place; all maps followed."""

    @property
    def object(self) -> int:
        """The object's id."""

    @property
    def old_world_from_object(self) -> Pose:
        """The frame of its box at the old place."""

    @property
    def world_from_object(self) -> Pose:
        """The frame of its box at the new place."""

    @property
    def cloud_voxels(self) -> int:
        """Number of voxels of the cloud that moved with it."""

    @property
    def emptied_cells(self) -> int:
        """Number of cells of the octree that became free."""

    @property
    def occupied_cells(self) -> int:
        """Number of cells of the octree that became occupied."""

    @property
    def planes(self) -> list[int]:
        """Ids of planes that are faces of it."""

@final
class FrameReport:
    """The result of one frame: its movers, its masked pixels, and what it added to the maps."""

    @property
    def id(self) -> int:
        """The frame's id."""

    @property
    def timestamp(self) -> float:
        """Its time, seconds."""

    @property
    def outcome(self) -> str:
        """What became of it: "waiting" (for detections), "tracked" (no key frame), "mapped" (a key frame),
        "scanned" (a scan), or "mended" (mapped again when its detections came).
        """

    @property
    def movers(self) -> list[Mover]:
        """The movers in it, a list of Mover by ascending track id."""

    @property
    def masked_pixels(self) -> int:
        """Number of pixels that were masked as moving."""

    @property
    def stages(self) -> dict[str, float]:
        """Seconds that each step took, by name, and "total" for the whole insertion."""

    @property
    def released(self) -> list[FrameReport]:
        """Reports of other frames that had waited for detections and were processed in this call."""

    @property
    def update(self) -> MapUpdate | None:
        """What was added to the maps, a MapUpdate; None when the frame was neither "mapped" nor "scanned"."""

    @property
    def correction(self) -> CorrectionReport | None:
        """How the maps changed, a CorrectionReport; None when the frame was not "mended"."""

@final
class Mover:
    """Somebody or something in a frame that may move."""

    @property
    def track_id(self) -> int:
        """Id of its track, the same from frame to frame."""

    @property
    def label(self) -> str | None:
        """Its label; None for an unlabelled mover, which no detector reports."""

    @property
    def score(self) -> float:
        """The detector's confidence, 0 to 1; 1 for an unlabelled mover."""

    @property
    def box(self) -> list[float]:
        """The box that holds its pixels: x_min, y_min, x_max, y_max."""

    @property
    def detected_box(self) -> list[float]:
        """The detected or predicted box."""

    @property
    def depth(self) -> float | None:
        """Median depth, metres; None without readings."""

@final
class MapUpdate:
    """What a key frame or a scan has added to the maps. Planes and objects are given by their ids; a scan adds to
    cloud and octree, and updates or removes objects where it sees free space.
    """

    @property
    def readings(self) -> int:
        """Number of static readings in range."""

    @property
    def new_voxels(self) -> int:
        """Number of voxels of the cloud that were empty before."""

    @property
    def hit_cells(self) -> int:
        """Number of cells of the octree that were hit."""

    @property
    def missed_cells(self) -> int:
        """Number of cells of the octree that rays passed through."""

    @property
    def planes_created(self) -> list[int]:
        """Planes that are new."""

    @property
    def planes_updated(self) -> list[int]:
        """Planes that were seen again."""

    @property
    def objects_created(self) -> list[int]:
        """New candidates for objects, not confirmed until they are seen again."""

    @property
    def objects_updated(self) -> list[int]:
        """Objects that got new parameters."""

    @property
    def objects_confirmed(self) -> list[int]:
        """Objects that were confirmed: they are part of the map from now on."""

    @property
    def objects_removed(self) -> list[int]:
        """Objects that were removed, since they are not there."""

    @property
    def planes_merged(self) -> list[tuple[int, int]]:
        """Planes that were merged: a list of (merged id, remaining id)."""

    @property
    def objects_merged(self) -> list[tuple[int, int]]:
        """Objects that were merged: a list of (merged id, remaining id)."""

@final
class CorrectionReport:
    """What a correction of poses has done."""

    @property
    def key_frames(self) -> int:
        """Key frames and scans in the maps."""

    @property
    def moved_key_frames(self) -> int:
        """Key frames and scans whose pose has changed."""

    @property
    def largest_motion(self) -> float:
        """Upper bound of how far a reading has moved, metres."""

    @property
    def new_from_old(self) -> Pose:
        """How the newest frame, and so what goes on from it, has moved: a Pose, the identity when it stayed."""

    @property
    def planes(self) -> ThingChanges:
        """How the planes changed, a ThingChanges."""

    @property
    def objects(self) -> ThingChanges:
        """How the objects changed, a ThingChanges."""

@final
class ThingChanges:
    """How planes or objects changed, by their ids."""

    @property
    def moved(self) -> dict[int, float]:
        """Ids that have moved, each with the distance in metres."""

    @property
    def merged(self) -> dict[int, int]:
        """Ids that were merged away, each with the id that it was merged into and now leads to."""

    @property
    def split(self) -> list[tuple[int, int]]:
        """Ids that were split, each with the id of the part split off."""

    @property
    def vanished(self) -> list[int]:
        """Ids that do not exist any more."""

    @property
    def appeared(self) -> list[int]:
        """Ids that are new."""

@final
class LoopClosure:
    """A result of place recognition: the pose of frame `to_frame` relative to `from_frame`. It may be wrong.
    `from_from_to` takes points from the camera of `to_frame` to that of `from_frame`; the standard deviations
    are about and along each axis, in radians and metres.
    """

    def __new__(cls, from_frame: int, to_frame: int, from_from_to: _PoseLike, rotation_deviation: float, translation_deviation: float) -> LoopClosure: ...

@final
class RefineReport:
    """What refining the poses has done."""

    @property
    def planes(self) -> int:
        """Planes that more than one key frame has seen, in the last round."""

    @property
    def views(self) -> int:
        """Number of views of planes by key frames."""

    @property
    def views_left_out(self) -> int:
        """Number of these views that were rejected: they show another plane than the map assigned."""

    @property
    def met_again(self) -> int:
        """Pairs of planes of the map that turned out to be the same plane, seen again on a revisit, in the last
        round.
        """

    @property
    def parted(self) -> int:
        """Times that a plane of the map turned out to be two, since drift had put another in its place."""

    @property
    def costs(self) -> list[list[float]]:
        """Cost of each round, before and after: half the sum of squared errors in standard deviations."""

    @property
    def left_out(self) -> list[int]:
        """Indices of the loop closures that were rejected as wrong."""

    @property
    def unheld(self) -> list[tuple[int, str, list[float], float]]:
        """Motions that only odometry determines, as along a corridor: (frame id, "translation" or "rotation",
        axis (3) in the world, standard deviation in metres or radians), at up to 32 key frames. In these the
        poses are as good as those given.
        """

    @property
    def correction(self) -> CorrectionReport:
        """How the maps changed, one CorrectionReport for all rounds."""

@final
class Map:
    """Four maps of the static world in one world frame, in the state in which they were requested. Lengths in
    metres.
    """

    def cloud(self, selection: str = "static") -> Cloud:
        """The coloured points of the cloud, one per voxel: selection "static" (without people, ghosts and noise)
        or "all" (every point that was read).
        """

    @property
    def static_points(self) -> StaticPoints:
        """The static cloud, for queries."""

    @property
    def octree(self) -> Octree:
        """The occupancy octree."""

    @property
    def planes(self) -> list[Plane]:
        """The planes of the map, a list of Plane in the order in which they were added."""

    def plane(self, id: int) -> Plane:
        """The plane with an id; for an id that was merged away, the plane that it became. KeyError when there is
        none.
        """

    @property
    def objects(self) -> list[MapObject]:
        """The objects of the map, a list of MapObject in the order in which they were added."""

    def object(self, id: int) -> MapObject:
        """The object with an id; for an id that was merged away, the object that it became. KeyError when there
        is none.
        """

    def objects_on(self, plane: int) -> list[MapObject]:
        """The objects that stand on a plane, the oldest first."""

    def surfaces(self, up: ArrayLike) -> list[tuple[Plane, str, float]]:
        """Classifies the planes, given a vector (3,) that points up: a list of (Plane, kind, height in metres),
        where kind is "floor", "table", "wall", "ceiling" or "slanted".
        """

    def floor_under(self, point: ArrayLike, up: ArrayLike, max_distance: float, reach: float = 0.0) -> FloorUnder | None:
        """The first level surface under a point (3,), at most `max_distance` metres below it, opposite to `up`
        (3,). A surface with readings within `reach` metres of the point's vertical counts as extended to
        there. A FloorUnder, or None.
        """

    def floor_grid(self, at: ArrayLike, up: ArrayLike, region: ArrayLike | None = None, **fields: Any) -> FloorGrid:
        """The 2D grid of the floor under a position (3,), seen along `up` (3,): the plane under the position and
        all level or sloping planes that low steps connect to it. region: x and y of the lower and of the
        upper corner (4,) of the grid, in its own axes. Further keywords are the fields of Rust's
        `FloorGridConfig`, such as `max_height=1.2` or `max_step=0.1`.
        """

    def floor_grids(self, up: ArrayLike, region: ArrayLike | None = None, **fields: Any) -> list[FloorGrid]:
        """The 2D grids of all floors, the lowest first: storeys, and areas separated by steps that are too high.
        Arguments as for `floor_grid`.
        """

    @property
    def up(self) -> NDArray[np.float64] | None:
        """A unit vector (3,) that points up in the world, once it is known, else None."""

    def counts(self) -> dict[str, int]:
        """Sizes of the maps: "cloud_points", "cloud_voxels", "octree_nodes", "octree_leaves",
        "octree_occupied_leaves", "planes", "objects".
        """

    def memory(self) -> dict[str, int]:
        """Memory in bytes of each map, of the stored key frames ("history"), of earlier states ("snapshots") and
        of the maps that readers see ("published"). "unfiled_history" is the part of "history" that the file
        has refused, on a full disk.
        """

    @property
    def config(self) -> Config:
        """The settings that the map was made with."""

    @property
    def revision(self) -> int:
        """The number of this state of the maps, which grows whenever they change."""

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Saves the map in a folder: `cloud.ply`, `octree.bt`, `octree.ot`, `planes.json`, `planes.ply`,
        `objects.json`, and the whole state, which `load` reads. After a crash the folder holds either the old
        map or the new one.
        """

    def merge(self, other: Map, world_from_other: _PoseLike | None = None) -> MergeReport:
        """Adds the sessions of another map; `world_from_other` takes that map's world to this one's. The result
        is, to the bit, the map that one builder would have made of all key frames in the order in which they
        were recorded. Both maps need a history. Results taken from this map before (octree, planes, clouds)
        do not change.
        """

    def changes_since(self, earlier: Map) -> MapChanges:
        """The differences from an earlier state of the map, such as one from a MapReader: blocks of the cloud,
        cubes of the octree, planes and objects. A copy of the earlier state in which these are replaced
        equals this state.
        """

    def world_changes_since(self, earlier: Map) -> WorldChanges:
        """What has moved, appeared and vanished in the world since an earlier map of it. The evidence decides,
        so that only places seen both times are compared.
        """

    @property
    def sessions(self) -> list[tuple[int, int, float, float]]:
        """The sessions that the map was built in: a list of (first frame, number of frames, first time, last
        time). Empty without a history.
        """

@final
class Cloud:
    """Points with colours, in a fixed order. Each call of `Map.cloud` makes new arrays."""

    @property
    def positions(self) -> NDArray[np.float32]:
        """(n, 3) float32, metres, world."""

    @property
    def colors(self) -> NDArray[np.uint8] | None:
        """(n, 3) uint8: red, green, blue; None when no frame had colours."""

    def __len__(self) -> int: ...

@final
class StaticPoints:
    """Queries of the static cloud for many places at once: n places give n results. Lengths in metres, world."""

    def nearest(self, places: ArrayLike, radius: float = ...) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        """The static point nearest to each of the places (n, 3), within `radius`: positions (n, 3) float32 and
        distances (n,) float64; NaN and inf where there is none.
        """

    def in_box(self, low: ArrayLike, high: ArrayLike, world_from_box: _PoseLike | None = None) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """The points in a box from corner `low` (3,) to `high` (3,), in the frame `world_from_box` (by default
        the world): positions (n, 3) float32 and colours (n, 3) uint8, black for points without colour.
        """

    def cast_rays(self, origins: ArrayLike, directions: ArrayLike, max_range: float = ..., radius: float = 0.015) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        """The first static point along each ray, within `max_range` and at most `radius` beside the ray:
        positions (n, 3) float32 and distances along the rays (n,) float64; NaN and inf where there is none.
        origins (n, 3) or (3,) for all; directions (n, 3), of any length.
        """

    def normals(self, places: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Normals (n, 3) float64 of the surface around each of the places (n, 3), from the points within
        `radius`. They point to the side that frames looked through; NaN where there are too few points. Four
        voxels are a good radius.
        """

@final
class Octree:
    """The occupancy octree, with OctoMap's model. States in arrays of int8: 1 occupied, 0 free, -1 unknown
    (never observed). Lengths in metres, world.
    """

    @property
    def resolution(self) -> float:
        """Side of the smallest cell, metres."""

    @property
    def extent(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Lower and upper corner (3,) of the box around all leaves; None for an empty map."""

    def states(self, points: ArrayLike) -> NDArray[np.int8]:
        """States of the cells at points (n, 3): (n,) int8."""

    def log_odds(self, points: ArrayLike) -> NDArray[np.float32]:
        """Log-odds of occupancy of the cells at points (n, 3): (n,) float32, NaN for unknown cells."""

    def occupied(self, low: ArrayLike | None = None, high: ArrayLike | None = None) -> NDArray[np.float64]:
        """The occupied leaves, all or those that overlap a box: (n, 4) float64, centre x, y, z and side."""

    def leaves(self, low: ArrayLike | None = None, high: ArrayLike | None = None) -> tuple[NDArray[np.float64], NDArray[np.float32], NDArray[np.int8]]:
        """All leaves, or those that overlap a box, in OctoMap's order: cubes (n, 4) float64, centre and side;
        log-odds (n,) float32; states (n,) int8.
        """

    def cast_rays(self, origins: ArrayLike, directions: ArrayLike, max_range: float = ..., unknown: str = "stop") -> tuple[NDArray[np.float64], NDArray[np.float64], list[str | None]]:
        """Follows rays through free cells to the first occupied one. origins (n, 3) or (3,) for all, directions
        (n, 3) of any length; unknown: "stop" (a ray ends at a cell never observed) or "pass". Returns the
        distances (n,) float64 from the origin to where the ray enters the cell in which it ends, the centres
        of these cells (n, 3) float64, and the reasons why rays ended, a list of "occupied", "unknown",
        "max_range" or "border"; NaN and None for an origin outside the map.
        """

    def nearest_obstacles(self, points: ArrayLike, max_distance: float = ...) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The occupied leaf nearest to each of the points (n, 3), within `max_distance`: distances (n,) float64
        to its surface and cubes (n, 4), centre and side; inf and NaN where there is none.
        """

    def project(self, up: ArrayLike, min_height: float, max_height: float, region: ArrayLike | None = None) -> OccupancyGrid:
        """A 2D grid seen from above: the cells between two heights along `up` (3,) from the world's origin.
        region: x and y of the lower and of the upper corner (4,) of the grid, in its own axes; None:
        everything observed.
        """

    def distance_field(self, low: ArrayLike, high: ArrayLike, max_distance: float, unknown: str = "pass") -> DistanceField:
        """Distances to the nearest obstacle, up to `max_distance`, and their gradients everywhere in a box;
        unknown: "pass" (unknown cells are free) or "stop" (they are obstacles).
        """

@final
class OccupancyGrid:
    """A 2D map seen from above, in the plane of its own x and y axes; z is up."""

    @property
    def cells(self) -> NDArray[np.int8]:
        """(height, width) int8: 1 occupied, 0 free, -1 unknown; row 0 has the lowest y. A copy."""

    @property
    def resolution(self) -> float:
        """Side of a cell, metres."""

    @property
    def origin(self) -> NDArray[np.float64]:
        """The lower left corner of cell [0, 0] in the grid's axes (2,), metres."""

    @property
    def world_from_grid(self) -> Pose:
        """Pose of the grid's axes in the world."""

    def inflated(self, radius: float) -> OccupancyGrid:
        """The same grid inflated: cells whose centre is within `radius` metres of an occupied cell's centre are
        occupied too.
        """

    def update(self, earlier: Octree, octree: Octree) -> GridUpdate:
        """Updates the grid in place from the octree that it was made of (`earlier`) to a newer one. Every cell
        is as in a new projection, and the cost depends only on the changes. Returns a GridUpdate.
        """

    def save(self, folder: str | os.PathLike[str], name: str) -> None:
        """Writes `name.pgm` and `name.yaml` into a folder, as ROS' map_server reads them."""

@final
class GridUpdate:
    """What updating a grid has changed."""

    @property
    def projected(self) -> int:
        """Number of cells that were projected again."""

    @property
    def changed(self) -> int:
        """Number of cells that changed."""

    @property
    def bounds(self) -> tuple[int, int, int, int] | None:
        """First and last column, first and last row of a rectangle around the changed cells; None when there are
        none.
        """

    @property
    def has_grown(self) -> bool:
        """Whether the grid has grown, so that the indices of its cells have changed."""

@final
class FloorGrid:
    """The 2D map of one floor for a robot that drives on it: the obstacles between two heights above the floor,
    on ramps and landings too.
    """

    @property
    def grid(self) -> OccupancyGrid:
        """A copy of the current grid, an OccupancyGrid."""

    @property
    def planes(self) -> list[int]:
        """Ids of the planes that form the floor; the plane from which the search started comes first."""

    def floor_heights(self, places: ArrayLike) -> NDArray[np.float64]:
        """Height of the floor at points (n, 2) in the grid's axes: (n,) float64, metres along up from the
        world's origin, NaN outside the grid.
        """

    def update(self, earlier: Map, map: Map) -> GridUpdate:
        """Updates the grid in place from the maps that it was made of (`earlier`) to newer ones; every cell is
        as in a new grid over the same region. Returns a GridUpdate.
        """

@final
class DistanceField:
    """Distances to the nearest obstacle in a box of the world, with their gradients."""

    def at(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """At points (n, 3): distances (n,) float64, metres, at most `max_distance`, and their derivatives (n, 3)
        along x, y and z, away from the obstacle; NaN outside the box.
        """

    @property
    def max_distance(self) -> float:
        """The greatest distance that is reported, metres."""

@final
class Plane:
    """A finite plane of a map. World frame, metres: normal . x + offset = 0, and the normal points towards the
    cameras that saw it.
    """

    @property
    def id(self) -> int:
        """Its id, which never changes and is never used again."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """Unit normal (3,)."""

    @property
    def offset(self) -> float:
        """Offset, metres."""

    @property
    def centroid(self) -> NDArray[np.float64]:
        """Weighted mean of its inliers (3,), metres."""

    @property
    def area(self) -> float:
        """Area that was seen, square metres."""

    @property
    def mse(self) -> float:
        """Mean squared distance of its inliers, square metres."""

    @property
    def observations(self) -> int:
        """Number of key frames that saw it."""

    @property
    def first_seen(self) -> float:
        """Time of the first key frame that saw it, seconds."""

    @property
    def last_seen(self) -> float:
        """Time of the last key frame that saw it, seconds."""

    @property
    def boundary(self) -> list[Boundary]:
        """Its outlines with their holes, a list of Boundary, the largest first."""

    @property
    def inliers(self) -> NDArray[np.float32]:
        """Its inliers (n, 3) float32, one per voxel, metres."""

@final
class Boundary:
    """A connected piece of a plane. World frame, metres; rings are closed without repeating their first corner.
    Seen against the normal, outlines run counterclockwise and holes clockwise.
    """

    @property
    def outline(self) -> NDArray[np.float64]:
        """The outer ring (k, 3) float64."""

    @property
    def holes(self) -> list[NDArray[np.float64]]:
        """The rings of the holes, a list of (k, 3) float64."""

    @property
    def area(self) -> float:
        """Area of the outline minus its holes, square metres."""

@final
class MapObject:
    """An object of a map: a box or an ellipsoid with a label. World frame, metres."""

    @property
    def id(self) -> int:
        """Its id, which never changes and is never used again."""

    @property
    def label(self) -> str:
        """The label with the most evidence."""

    @property
    def score(self) -> float:
        """Share of the evidence that is for the label, 0 to 1."""

    @property
    def evidence(self) -> dict[str, float]:
        """The evidence for each label: label to the sum of its detections' scores."""

    @property
    def center(self) -> NDArray[np.float64]:
        """Centre of its box (3,)."""

    @property
    def size(self) -> NDArray[np.float64]:
        """Full lengths of its box along its axes (3,)."""

    @property
    def world_from_object(self) -> Pose:
        """The frame of its box: the origin is the centre, the axes are along the sides; the third axis is the
        normal of its support.
        """

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Rotation matrix (3, 3): its columns are the box's axes."""

    @property
    def corners(self) -> NDArray[np.float64]:
        """The corners of its box (8, 3); corner k is on the positive side of axis i if bit i of k is set."""

    @property
    def shape(self) -> str:
        """Its shape: "cuboid", or "ellipsoid" inscribed in the box."""

    @property
    def observations(self) -> int:
        """Number of its detections."""

    @property
    def first_seen(self) -> float:
        """Time of the first observation, seconds."""

    @property
    def last_seen(self) -> float:
        """Time of the last observation, seconds."""

    @property
    def support(self) -> int | None:
        """Id of the plane that it stands on; None when its support is not a plane of the map, or unknown."""

    @property
    def points(self) -> NDArray[np.float64]:
        """Its surface points (n, 3) float64, one per voxel."""

@final
class FloorUnder:
    """The surface that something at a point stands on or would fall onto."""

    @property
    def plane(self) -> int:
        """The plane's id."""

    @property
    def point(self) -> NDArray[np.float64]:
        """The point of the plane vertically below, (3,), metres, world."""

    @property
    def distance(self) -> float:
        """Distance to that point, metres."""

    @property
    def extended_by(self) -> float:
        """Distance from that point to the nearest reading of the plane, metres; 0 where the plane was read
        there.
        """

@final
class MapChanges:
    """What differs between two states of a map."""

    @property
    def from_revision(self) -> int:
        """Revision of the earlier state."""

    @property
    def to_revision(self) -> int:
        """Revision of the later state."""

    @property
    def cloud(self) -> list[CloudBlock]:
        """Blocks of the static cloud as they are now, a list of CloudBlock."""

    @property
    def octree(self) -> NDArray[np.float64]:
        """Boxes in which cells of the octree differ: (n, 6) float64, lower and upper corner, metres."""

    @property
    def planes(self) -> ChangedThings:
        """Planes."""

    @property
    def objects(self) -> ChangedThings:
        """Objects."""

@final
class CloudBlock:
    """All static points of a cube of 8^3 voxels."""

    @property
    def place(self) -> list[int]:
        """The cube's integer coordinates: its lowest corner is at these times 8 voxels."""

    @property
    def positions(self) -> NDArray[np.float32]:
        """(n, 3) float32, metres, world."""

    @property
    def colors(self) -> NDArray[np.uint8]:
        """Colours of the first m of these points, (m, 3) uint8; the others have none."""

@final
class ChangedThings:
    """Planes or objects that differ, by their ids."""

    @property
    def confirmed(self) -> list[int]:
        """Ids that are confirmed now and were not before."""

    @property
    def changed(self) -> list[int]:
        """Ids of things that were seen again or have moved."""

    @property
    def merged(self) -> dict[int, int]:
        """Ids that were merged away, each with the id that it was merged into."""

    @property
    def removed(self) -> list[int]:
        """Ids that do not exist or are not confirmed any more."""

@final
class WorldChanges:
    """What has changed in the world between two maps of it."""

    @property
    def moved(self) -> list[tuple[FoundObject, FoundObject]]:
        """Objects that have moved: a list of (FoundObject at the old place, FoundObject at the new place)."""

    @property
    def appeared(self) -> list[FoundObject]:
        """Objects in space that was empty before, a list of FoundObject."""

    @property
    def vanished(self) -> list[FoundObject]:
        """Objects whose space is empty now, a list of FoundObject."""

@final
class FoundObject:
    """An object as a map has it."""

    @property
    def id(self) -> int:
        """Its id in that map."""

    @property
    def label(self) -> str:
        """What it is."""

    @property
    def world_from_object(self) -> Pose:
        """The frame of its box."""

    @property
    def size(self) -> NDArray[np.float64]:
        """Full lengths of its box (3,), metres."""

    @property
    def first_seen(self) -> float:
        """When it was first seen, seconds on the map's clock."""

    @property
    def last_seen(self) -> float:
        """When it was last seen, seconds on the map's clock."""

@final
class MergeReport:
    """What merging two maps has done."""

    @property
    def sessions(self) -> list[tuple[int, int, int | None, int | None]]:
        """The sessions of both, in the order in which they are mapped: a list of (first frame, number of frames,
        first frame in this map before or None, first frame in the other or None).
        """

    @property
    def key_frames(self) -> int:
        """Key frames in the maps."""

    @property
    def mapped_again(self) -> int:
        """Number of these key frames that were mapped again."""

    @property
    def own(self) -> NewIds:
        """New ids of the things of the map that was merged into, NewIds."""

    @property
    def other(self) -> NewIds:
        """New ids of the things of the other map, NewIds."""

@final
class NewIds:
    """The ids of a map's planes and objects after merging. Things of the two maps that have the same new id are
    the same thing.
    """

    @property
    def planes(self) -> dict[int, int]:
        """Planes: old id to new."""

    @property
    def objects(self) -> dict[int, int]:
        """Objects: old id to new."""

@final
class Dataset:
    """A TUM RGB-D folder: images, `camera.json`, poses (`groundtruth.txt`, or the file `trajectory`) and
    detections (`detections.jsonl`, or the file or YOLO folder `detections`). `every`: only every n-th frame.
    `dataset[i]` loads a Frame; a loop over the dataset loads all frames, and skips with a warning those that
    cannot be loaded.
    """

    def __new__(cls, folder: str | os.PathLike[str], *, trajectory: str | os.PathLike[str] | None = None, detections: str | os.PathLike[str] | None = None, every: int = 1) -> Dataset: ...

    @property
    def camera(self) -> Camera:
        """The camera of the frames."""

    @property
    def timestamps(self) -> NDArray[np.float64]:
        """Times of the frames (n,) float64, seconds."""

    @property
    def warnings(self) -> list[str]:
        """Problems with its lists and detections, a list of texts."""

    def __len__(self) -> int: ...

    def __getitem__(self, key: int, /) -> Frame: ...

    def __iter__(self) -> Iterator[Frame]: ...

@final
class Sequence:
    """A rendered sequence with exact truth. `sequence[i]` renders a Frame, the same one each time."""

    @property
    def camera(self) -> Camera:
        """The camera."""

    @property
    def poses(self) -> list[Pose]:
        """The exact poses of all frames, a list of Pose."""

    def truth(self) -> metrics.SequenceTruth:
        """The truth about the world: static surfaces, movers, faces and objects, and which of them these frames
        have seen. Renders all frames.
        """

    def __len__(self) -> int: ...

    def __getitem__(self, key: int, /) -> Frame: ...

    def __iter__(self) -> Iterator[Frame]: ...

def builtin_sequence(name: str | None = None, *, frames: int | None = None, every: int = 1, people: int | None = None, seed: int | None = None, camera: Camera | None = None, carried: str | None = None) -> Sequence:
    """The built-in sequence: people walk through an office, seen by a Kinect-like camera. name: "walking_xyz",
    "walking_static", "walking_halfsphere", "walking_rpy", or the same with "sitting"; None: the sequence of
    the program build_map. `frames`: number at 10 a second, by default 150; `every`: only every n-th of these,
    with noise and detections of their own; `people`: 0 to 2; `camera`: another camera; `carried`: "book",
    "keyboard", "bottle", "cup" or "box": such a thing stands on the table, and a hand moves it between seconds
    1 and 7.
    """

def load(folder: str | os.PathLike[str], history: str | dict[str, Any] | None = None, memory: dict[str, Any] | None = None) -> Map:
    """Loads the map that was saved in a folder, to the bit. `history`: where its key frames are kept from now
    on, as in Config ("none", "memory" or {"folder": path}); None: where they were. With "none" a map is loaded
    that came without the folder of its history. `memory`: how much it may take from now on, as in Config
    ({"budget": bytes, "path": folder}, {} for no limit); None: as where it was saved.
    """
