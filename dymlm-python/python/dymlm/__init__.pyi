import os
from collections.abc import Iterable, Iterator
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
    "CorrectionReport",
    "Dataset",
    "Detection",
    "DistanceField",
    "Error",
    "FloorGrid",
    "FloorUnder",
    "FoundObject",
    "Frame",
    "FrameReport",
    "GridUpdate",
    "LoopClosure",
    "Map",
    "MapBuilder",
    "MapChanges",
    "MapObject",
    "MapReader",
    "MapSaver",
    "MapUpdate",
    "MergeReport",
    "Mover",
    "NewIds",
    "ObjectMove",
    "ObjectTracker",
    "ObjectUpdate",
    "OccupancyGrid",
    "Octree",
    "Plane",
    "Pose",
    "RefineReport",
    "Sequence",
    "StaticPoints",
    "ThingChanges",
    "WorldChanges",
    "builtin_sequence",
    "load",
    "metrics",
]

# A Pose, a 4x4 matrix, or seven numbers: tx ty tz qx qy qz qw.
_PoseLike: TypeAlias = Pose | ArrayLike
# What a detector says of a frame: things, an empty list when it found nothing, None when it did not run.
_Detections: TypeAlias = Iterable[Detection] | Literal["pending"] | None

class Error(ValueError):
    """Why something was refused: a frame, a config, a folder. What was refused has changed nothing."""

@final
class Pose:
    """A rigid motion, such as `world_from_camera`, which takes camera coordinates to the world.

    Made of a translation (3,) in metres and a quaternion (4,) `x, y, z, w`, or of what every `world_from_camera` may be
    given as: a 4x4 matrix, or seven numbers `tx ty tz qx qy qz qw`. `numpy.asarray(pose)` is the 4x4 matrix. Camera
    coordinates: x to the right, y down, z forward.
    """

    def __new__(cls, translation: ArrayLike, quaternion: ArrayLike | None = None) -> Pose: ...

    @staticmethod
    def identity() -> Pose:
        """The motion that moves nothing."""

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
        """The motion back."""

    def __matmul__(self, value: _PoseLike, /) -> Pose: ...

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]: ...

    def __eq__(self, value: object, /) -> bool: ...

@final
class Camera:
    """A pinhole camera: size in pixels, focal lengths and principal point in pixels. Depth and colour are of one size and
    seen from one place. Lenses that distort: rectify the images first.
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
    """Settings of the maps: what is not given stays at its default, or at that of `preset` ("default", "offline": every
    frame is mapped, "robot"). Fields are those of a config file:
    `Config(history="memory", cloud={"voxel_size": 0.02})`, `Config("robot", sensor={"preset": "realsense_d4xx"})`.

    `history`: "memory", or {"folder": path}, keeps what key frames have shown, which corrections, merging and refining
    of poses need. A MapBuilder says which field is outside its range.
    """

    def __new__(cls, preset: str | None = None, **fields: Any) -> Config: ...

    @staticmethod
    def from_toml(text_or_path: str | os.PathLike[str]) -> Config:
        """Reads a config file, given by its path (any `os.PathLike`, or a text of one line that ends with ".toml"), or its
        text.
        """

    def to_toml(self) -> str:
        """All fields, as a config file has them."""

    def to_dict(self) -> dict[str, Any]:
        """All fields, in dictionaries."""

    def __eq__(self, value: object, /) -> bool: ...

@final
class Detection:
    """A thing that a 2D detector has found: its label (COCO's names, such as "person"), its box `x_min, y_min, x_max,
    y_max` in pixels, its score, 0 to 1, and an instance mask (height, width) of bools, `True` where the thing is, if the
    detector makes one.
    """

    def __new__(cls, label: str, box: ArrayLike, score: float, mask: NDArray[np.bool_] | None = None) -> Detection: ...

    @property
    def label(self) -> str:
        """What it was taken for."""

    @property
    def box(self) -> list[float]:
        """Its box: x_min, y_min, x_max, y_max, pixels."""

    @property
    def score(self) -> float:
        """The detector's confidence, 0 to 1."""

    @property
    def mask(self) -> NDArray[np.bool_] | None:
        """Where it is in the image, (height, width) bool; None without."""

    def __eq__(self, value: object, /) -> bool: ...

@final
class Frame:
    """A frame with what a detector says of it and where it was taken from: what MapBuilder.insert_frame takes, and what
    datasets and simulated sequences give. `depth`, `color`, `world_from_camera`, `detections` and `depth_scale` as in
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
        """Colours, (height, width, 3) uint8: red, green, blue; None without. A copy."""

    @property
    def detections(self) -> list[Detection] | str | None:
        """What was detected: a list of Detection, None when the detector did not run, "pending" when it runs still."""

    @property
    def world_from_camera(self) -> Pose:
        """Where it was taken from: the exact pose, of a simulated frame."""

    @property
    def estimated_world_from_camera(self) -> Pose | None:
        """The pose as a SLAM estimates it, of a simulated frame; else None."""

    @property
    def mover_mask(self) -> NDArray[np.bool_] | None:
        """Where movers are, exactly, (height, width) bool, of a simulated frame; else None."""

@final
class MapBuilder:
    """Builds four maps of the static world (cloud, octree, planes, objects) from frames, 2D detections and poses, while
    people walk through it. Frames come in the order of their time.

    While it works, other threads of Python run. It may be shared by threads: their calls come one after the other.
    What is refused raises an exception, and changes nothing.
    """

    def __new__(cls, camera: Camera, config: Config | None = None) -> MapBuilder: ...

    @staticmethod
    def resume(map: Map, camera: Camera) -> MapBuilder:
        """Goes on with a map of an earlier session: its ids go on, and so does its clock. Poses are in its world."""

    def insert(self, timestamp: float, depth: NDArray[np.uint16] | NDArray[np.float32], color: NDArray[np.uint8] | None = None, *, world_from_camera: _PoseLike, detections: _Detections = None, depth_scale: float = 1000.0) -> FrameReport:
        """Takes in one frame.

        timestamp: seconds. depth: (height, width), uint16 with `depth_scale` units a metre (1000: millimetres, 5000: TUM),
        or float32 metres; 0 and NaN are no readings. color: (height, width, 3) uint8, red, green, blue, seen from the same
        place. world_from_camera: a Pose, a 4x4 matrix, or `tx ty tz qx qy qz qw`. detections: a list of Detection, empty
        when the detector found nothing; None when it did not run; "pending" when it runs still, then `detections_for`
        brings them.

        Arrays may be views with any strides. Each value is read once, into images that the builder keeps.
        """

    def insert_frame(self, frame: Frame) -> FrameReport:
        """Takes in a Frame of a dataset or a simulation, with its own pose and detections."""

    def insert_scan(self, timestamp: float, points: ArrayLike, world_from_sensor: _PoseLike) -> FrameReport:
        """Takes in a scan of a lidar: points (n, 3) in the sensor's frame, metres. It goes into cloud and octree."""

    def detections_for(self, frame: int, detections: Iterable[Detection]) -> FrameReport:
        """Brings the detections of a frame that was inserted with "pending". With a history also those of a key frame that
        was mapped without.
        """

    def process_waiting(self) -> list[FrameReport]:
        """Processes all frames that wait, those without detections as frames on which the detector did not run."""

    def settle(self) -> None:
        """Takes out of octree, planes and objects at once what the newest frames have found to be no part of the static
        world; it happens by itself once a second.
        """

    def track_object(self, object: int, frame: Frame) -> ObjectTracker:
        """Chooses an object of the map to be followed while somebody carries it, from a Frame on in which it stands where the
        map has it: an ObjectTracker.
        """

    def follow_object(self, tracker: ObjectTracker) -> ObjectMove | None:
        """Tells the maps what a tracker has found in its last frame; before that frame is inserted. While the object moves its
        pixels are kept out of the maps. Once it has come to rest, it stands at its new place in all of them, and its old
        place is empty: an ObjectMove, else None.
        """

    def map(self) -> Map:
        """The maps as they stand: a Map that stays as it is while the builder goes on. It shares what does not change."""

    def reader(self) -> MapReader:
        """A reader of the maps for other threads, which never waits for the builder."""

    def finish(self) -> Map:
        """Processes the frames that wait, settles, and gives the maps away: the builder takes in no more."""

    def correct_poses(self, poses: dict[int, _PoseLike] | dict[float, _PoseLike]) -> CorrectionReport:
        """Moves frames to where a loop closure has found them, and all four maps follow: they are those that the same
        observations at the new poses would have made, to the bit. Needs a history. poses: new poses by frame id (int) or
        timestamp (float, as it was inserted), all in one way; frames that are not named move with their neighbours. Ctrl-C cancels it, and
        nothing has changed.
        """

    def remove(self, frame: int | float) -> CorrectionReport:
        """Takes a frame or a scan out of all maps, as if it had never been inserted. Needs a history. frame: its id, or its
        timestamp.
        """

    def transform(self, new_from_old: _PoseLike) -> CorrectionReport:
        """Moves the whole world: each frame's pose is `new_from_old` times what it was. Needs a history."""

    def refine_poses(self, closures: Iterable[LoopClosure] | None = None, **fields: Any) -> RefineReport:
        """Finds better poses by the planes that the key frames have seen, and all maps follow. Needs a history. closures:
        a list of LoopClosure; wrong ones are named in the report. Further fields are those of Rust's `RefineConfig`, such
        as `rounds=3` or `translation_per_second=0.05`.
        """

    def trajectory(self) -> list[tuple[int, float, Pose]]:
        """The frames that were inserted: a list of (id, timestamp, Pose) as they are mapped now. Empty without a history."""

    def begin_session(self) -> list[FrameReport]:
        """Begins a further session in the same world: its clock may begin anew, and movers are tracked anew."""

    def forget_outside(self, center: ArrayLike, radius: float) -> None:
        """Forgets what lies farther than `radius` metres from a place (3,), world, in all maps."""

    def memory(self) -> dict[str, int]:
        """Bytes that each map takes, what is kept of key frames ("history"), and of earlier states ("snapshots")."""

    def static_mask(self) -> NDArray[np.bool_]:
        """Which pixels of the last frame were static, (height, width) bool; of each `sensor.stride`-th pixel."""

    @property
    def config(self) -> Config:
        """The settings."""

    @property
    def camera(self) -> Camera:
        """The camera of `insert`."""

@final
class MapReader:
    """Reads the maps of a builder on any thread: maps as they were published last, every half second of the frames' clock
    and whenever they are changed on request. Neither waits for the other.
    """

    def latest(self) -> Map:
        """The maps that were published last."""

    def wait_newer(self, than: Map, timeout: float) -> Map | None:
        """Waits for maps that are newer than these, at most `timeout` seconds; None when none came."""

@final
class MapSaver:
    """Saves maps into one folder again and again: of the state only what has changed since the last time. Its first save
    replaces what the folder holds. As long as it lives nobody else writes the folder.
    """

    def __new__(cls, folder: str | os.PathLike[str]) -> MapSaver: ...

    @staticmethod
    def load(folder: str | os.PathLike[str]) -> tuple[MapSaver, Map]:
        """Loads the map of a folder, and goes on saving there: a MapSaver, whose first save writes what has changed since, and
        the Map.
        """

    def save(self, map: Map) -> None:
        """Saves a map. A crash leaves the one that was saved before or this one, never half of it."""

    @property
    def folder(self) -> Path:
        """The map's folder."""

@final
class ObjectTracker:
    """Follows an object of the map while somebody carries it, in six degrees of freedom. Made by `MapBuilder.track_object`."""

    @property
    def object(self) -> int:
        """The object's id in the map."""

    def track(self, frame: Frame) -> ObjectUpdate:
        """Finds the object in the next Frame, which needs colours. An ObjectUpdate."""

@final
class ObjectUpdate:
    """Where a carried object is in a frame."""

    @property
    def state(self) -> str:
        """"at_rest", "tracking", "occluded", "lost" or "recovered"."""

    @property
    def world_from_object(self) -> Pose:
        """Its pose; where `inliers` is 0, the last one or a guess."""

    @property
    def inliers(self) -> int:
        """Number of points that agree on the pose."""

    @property
    def confidence(self) -> float:
        """0 to 1."""

    @property
    def came_to_rest(self) -> bool:
        """Whether it came to rest in this frame, at a new place."""

@final
class ObjectMove:
    """An object was put down at another place, and all maps followed."""

    @property
    def object(self) -> int:
        """The object's id."""

    @property
    def old_world_from_object(self) -> Pose:
        """Its box where it stood."""

    @property
    def world_from_object(self) -> Pose:
        """Its box where it stands now."""

    @property
    def cloud_voxels(self) -> int:
        """Number of voxels of the cloud that went with it."""

    @property
    def emptied_cells(self) -> int:
        """Number of cells of the octree that are free now."""

    @property
    def occupied_cells(self) -> int:
        """Number of cells of the octree that it has come to."""

    @property
    def planes(self) -> list[int]:
        """Ids of planes that are faces of it."""

@final
class FrameReport:
    """What one frame has done: who moved in it, what was masked, what came into the maps."""

    @property
    def id(self) -> int:
        """The frame's id, by which it is named from now on."""

    @property
    def timestamp(self) -> float:
        """Its time, seconds."""

    @property
    def outcome(self) -> str:
        """What became of it: "waiting" (for detections), "tracked" (no key frame), "mapped" (a key frame), "scanned" (a
        scan), or "mended" (mapped again when its detections came).
        """

    @property
    def movers(self) -> list[Mover]:
        """Who and what may move in it: a list of Mover, by ascending track id."""

    @property
    def masked_pixels(self) -> int:
        """Pixels that were masked as moving."""

    @property
    def stages(self) -> dict[str, float]:
        """Seconds that each step took, by name, and "total"."""

    @property
    def released(self) -> list[FrameReport]:
        """Reports of the other frames that the call has processed: they had waited for detections."""

    @property
    def update(self) -> MapUpdate | None:
        """What came into the maps, a MapUpdate; None when it was not "mapped"."""

    @property
    def correction(self) -> CorrectionReport | None:
        """What the mending has done, a CorrectionReport; None when it was not "mended"."""

@final
class Mover:
    """Somebody or something in a frame that may move."""

    @property
    def track_id(self) -> int:
        """Its track: the same from frame to frame."""

    @property
    def label(self) -> str | None:
        """What it is; None for what no detector reports."""

    @property
    def score(self) -> float:
        """The detector's confidence, 0 to 1; 1 without a label."""

    @property
    def box(self) -> list[float]:
        """The box that holds its pixels: x_min, y_min, x_max, y_max."""

    @property
    def detected_box(self) -> list[float]:
        """The box as it was detected, or predicted."""

    @property
    def depth(self) -> float | None:
        """Median depth, metres; None when nothing of it was read."""

@final
class MapUpdate:
    """What a key frame has brought into the maps. Planes and objects by their ids."""

    @property
    def readings(self) -> int:
        """Static readings in range."""

    @property
    def new_voxels(self) -> int:
        """Voxels of the cloud that were empty before."""

    @property
    def hit_cells(self) -> int:
        """Cells of the octree that were hit."""

    @property
    def missed_cells(self) -> int:
        """Cells that rays passed."""

    @property
    def planes_created(self) -> list[int]:
        """Planes that are new."""

    @property
    def planes_updated(self) -> list[int]:
        """Planes that were seen again."""

    @property
    def objects_created(self) -> list[int]:
        """Objects that are new; tentative until they are seen again."""

    @property
    def objects_updated(self) -> list[int]:
        """Objects that got new parameters."""

    @property
    def objects_confirmed(self) -> list[int]:
        """Objects that are part of the map from now on."""

    @property
    def objects_removed(self) -> list[int]:
        """Objects that are not there."""

    @property
    def planes_merged(self) -> list[tuple[int, int]]:
        """Planes that proved to be one: which has gone into which."""

    @property
    def objects_merged(self) -> list[tuple[int, int]]:
        """Objects that proved to be one: which has gone into which."""

@final
class CorrectionReport:
    """What a correction of poses has done."""

    @property
    def key_frames(self) -> int:
        """Key frames in the maps."""

    @property
    def moved_key_frames(self) -> int:
        """Key frames whose pose has changed."""

    @property
    def largest_motion(self) -> float:
        """The farthest that a reading can have moved, metres."""

    @property
    def planes(self) -> ThingChanges:
        """What has become of the planes, ThingChanges."""

    @property
    def objects(self) -> ThingChanges:
        """What has become of the objects, ThingChanges."""

@final
class ThingChanges:
    """What has become of planes or objects, by their ids."""

    @property
    def moved(self) -> dict[int, float]:
        """Those that stand elsewhere now: id to metres."""

    @property
    def merged(self) -> dict[int, int]:
        """Those that are one with another now: id to that other; the id leads there."""

    @property
    def split(self) -> list[tuple[int, int]]:
        """Those of which a part has become another, and that other."""

    @property
    def vanished(self) -> list[int]:
        """Those that are there no more."""

    @property
    def appeared(self) -> list[int]:
        """Those that were not there before."""

@final
class LoopClosure:
    """What a place recognition has found: how the frame `to_frame` was seen from `from_frame`. It may be wrong.
    `from_from_to` takes points of the one's camera to that of the other; standard deviations about and along each axis
    in radians and metres.
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
        """Views of planes."""

    @property
    def views_left_out(self) -> int:
        """Of these, those that were left out: they are of another plane than the map has them."""

    @property
    def met_again(self) -> int:
        """Pairs of planes of the map that turned out to be one, which was met again, in the last round."""

    @property
    def costs(self) -> list[list[float]]:
        """Half the sum of squared errors, in standard deviations, of each round: before and after."""

    @property
    def left_out(self) -> list[int]:
        """Loop closures that were left out as wrong, by their places in the list."""

    @property
    def correction(self) -> CorrectionReport:
        """What has become of the maps, a CorrectionReport of the last round."""

@final
class Map:
    """Four maps of the static world in one world frame, as they stood when they were asked for. Lengths in metres."""

    def cloud(self, selection: str = "static") -> Cloud:
        """The coloured points of the static world, a voxel each: selection "static" (people, their traces and noise left out)
        or "all" that was read.
        """

    @property
    def static_points(self) -> StaticPoints:
        """The static cloud, to be asked about places."""

    @property
    def octree(self) -> Octree:
        """The occupancy octree."""

    @property
    def planes(self) -> list[Plane]:
        """The planes of the map, a list of Plane in the order in which they came into it."""

    def plane(self, id: int) -> Plane:
        """The plane of an id; of an id that was merged away, what it became. KeyError when it is not there."""

    @property
    def objects(self) -> list[MapObject]:
        """The objects of the map, a list of MapObject in the order in which they came into it."""

    def object(self, id: int) -> MapObject:
        """The object of an id; of an id that was merged away, what it became. KeyError when it is not there."""

    def objects_on(self, plane: int) -> list[MapObject]:
        """The objects that stand on a plane, the oldest first."""

    def surfaces(self, up: ArrayLike) -> list[tuple[Plane, str, float]]:
        """What the planes are, given a vector (3,) that points up: a list of (Plane, kind, height in metres), kind "floor",
        "table", "wall", "ceiling" or "slanted".
        """

    def floor_under(self, point: ArrayLike, up: ArrayLike, max_distance: float, reach: float = 0.0) -> FloorUnder | None:
        """The first level surface under a point (3,), at most `max_distance` metres against `up` (3,); one that was read
        within `reach` metres of there is extended. A FloorUnder, or None.
        """

    def floor_grid(self, at: ArrayLike, up: ArrayLike, region: ArrayLike | None = None, **fields: Any) -> FloorGrid:
        """The 2D grid of the floor under a position (3,), seen along `up` (3,): the plane under it and all planes that it goes
        on to, level or sloping, by low steps. region: x and y of the lower and of the upper corner (4,) of what it shows, in
        the grid's axes. Further fields are those of Rust's `FloorGridConfig`, such as `max_height=1.2` or `max_step=0.1`.
        """

    def floor_grids(self, up: ArrayLike, region: ArrayLike | None = None, **fields: Any) -> list[FloorGrid]:
        """The 2D grids of all floors, the lowest first: storeys, and what is parted by steps that are too high. As
        `floor_grid`.
        """

    @property
    def up(self) -> NDArray[np.float64] | None:
        """A unit vector (3,) that points up in the world, once it is known, else None."""

    def counts(self) -> dict[str, int]:
        """How many there are of what: "cloud_points", "cloud_voxels", "octree_nodes", "octree_leaves",
        "octree_occupied_leaves", "planes", "objects".
        """

    def memory(self) -> dict[str, int]:
        """Bytes that each map takes, and what is kept of key frames ("history")."""

    @property
    def config(self) -> Config:
        """The settings that it was made with."""

    @property
    def revision(self) -> int:
        """Which state of the maps it is: it grows whenever they change."""

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Saves the map in a folder: `cloud.ply`, `octree.bt`, `octree.ot`, `planes.json`, `planes.ply`, `objects.json`, and
        the whole state, which `load` reads. A crash leaves the older map or the new one.
        """

    def merge(self, other: Map, world_from_other: _PoseLike | None = None) -> MergeReport:
        """Takes in the sessions of another map, whose world `world_from_other` brings to this one's: the maps are those that
        one builder would have made of all key frames, to the bit, in the order of the times at which they were recorded.
        Needs a history in both. What was asked of this map before (its octree, planes, clouds) stays as it was.
        """

    def changes_since(self, earlier: Map) -> MapChanges:
        """What differs from an earlier state of the map, such as a MapReader gave before: blocks of the cloud, cubes of the
        octree, planes and objects. Who replaces these in a copy has this state.
        """

    def world_changes_since(self, earlier: Map) -> WorldChanges:
        """What has moved, appeared and vanished in the world since an earlier map of it: the evidence decides, so that only
        what was seen both times is compared.
        """

    @property
    def sessions(self) -> list[tuple[int, int, float, float]]:
        """The sessions that the map was built in: a list of (first frame, number of frames, first time, last time). Empty
        without a history.
        """

@final
class Cloud:
    """Points with colours, in a fixed order. The arrays are the map's own: they are moved here, not copied, and each
    `Map.cloud` makes new ones.
    """

    @property
    def positions(self) -> NDArray[np.float32]:
        """(n, 3) float32, metres, world."""

    @property
    def colors(self) -> NDArray[np.uint8] | None:
        """(n, 3) uint8: red, green, blue; None when no frame had colours."""

    def __len__(self) -> int: ...

@final
class StaticPoints:
    """The static cloud, to be asked about many places at once: n places give n answers. Lengths in metres, world."""

    def nearest(self, places: ArrayLike, radius: float = ...) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        """The static point nearest to each of the places (n, 3), within `radius`: positions (n, 3) float32, NaN where there is
        none, and distances (n,) float64, inf there.
        """

    def in_box(self, low: ArrayLike, high: ArrayLike, world_from_box: _PoseLike | None = None) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """The points in a box from corner `low` (3,) to `high` (3,), in the frame `world_from_box` (by default the world):
        positions (n, 3) float32 and colours (n, 3) uint8, black where there is none.
        """

    def cast_rays(self, origins: ArrayLike, directions: ArrayLike, max_range: float = ..., radius: float = 0.015) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        """The first static point within `max_range` along each ray that is no farther than `radius` beside it: positions
        (n, 3) float32, NaN where nothing is met, and distances along the rays (n,) float64, inf there. origins (n, 3) or
        (3,) for all; directions (n, 3), of any length.
        """

    def normals(self, places: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Normals (n, 3) float64 of the surface around each of the places (n, 3), by the points within `radius`, towards the
        side that frames looked through; NaN where there are too few. Four voxels are a good radius.
        """

@final
class Octree:
    """The occupancy octree, with OctoMap's model. States in arrays of int8: 1 occupied, 0 free, -1 unknown (never observed).
    Lengths in metres, world.
    """

    @property
    def resolution(self) -> float:
        """Side of the smallest cell, metres."""

    @property
    def extent(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Lower and upper corner (3,) of the box around all leaves; None of an empty map."""

    def states(self, points: ArrayLike) -> NDArray[np.int8]:
        """What is known of the cells at points (n, 3): (n,) int8."""

    def log_odds(self, points: ArrayLike) -> NDArray[np.float32]:
        """Log-odds of being occupied of the cells at points (n, 3): (n,) float32, NaN where nothing is known."""

    def occupied(self, low: ArrayLike | None = None, high: ArrayLike | None = None) -> NDArray[np.float64]:
        """The occupied leaves, all or those that share a cell with a box: (n, 4) float64, centre x, y, z and side."""

    def leaves(self, low: ArrayLike | None = None, high: ArrayLike | None = None) -> tuple[NDArray[np.float64], NDArray[np.float32], NDArray[np.int8]]:
        """All leaves, or those that share a cell with a box, in OctoMap's order: places (n, 4) float64, centre and side;
        log-odds (n,) float32; states (n,) int8.
        """

    def cast_rays(self, origins: ArrayLike, directions: ArrayLike, max_range: float = ..., unknown: str = "stop") -> tuple[NDArray[np.float64], NDArray[np.float64], list[str | None]]:
        """Follows rays through free cells to the first occupied one. origins (n, 3) or (3,) for all, directions (n, 3) of any
        length; unknown: "stop" (a ray ends at a cell never observed) or "pass". Distances (n,) float64 from the origin to
        where the ray enters the cell that it ends at, centres of these cells (n, 3) float64, and why it ended, a list of
        "occupied", "unknown", "max_range" or "border"; NaN and None for an origin outside the map.
        """

    def nearest_obstacles(self, points: ArrayLike, max_distance: float = ...) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The occupied leaf nearest to each of the points (n, 3), within `max_distance`: distances (n,) float64 to its face,
        inf where there is none, and places (n, 4), centre and side, NaN there.
        """

    def project(self, up: ArrayLike, min_height: float, max_height: float, region: ArrayLike | None = None) -> OccupancyGrid:
        """A 2D grid seen from above: what lies between two heights along `up` (3,) from the world's origin. region: x and y of
        the lower and of the upper corner (4,) of what it shows, in its own axes; None: all that was observed.
        """

    def distance_field(self, low: ArrayLike, high: ArrayLike, max_distance: float, unknown: str = "pass") -> DistanceField:
        """Distances to the nearest obstacle, up to `max_distance`, and their gradients at all places of a box; unknown cells
        "pass" (are free) or "stop" (are obstacles).
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
        """Where the grid's axes are in the world."""

    def inflated(self, radius: float) -> OccupancyGrid:
        """The same grid with an occupied margin: cells whose centre is no farther than `radius` metres from that of an
        occupied one.
        """

    def update(self, earlier: Octree, octree: Octree) -> GridUpdate:
        """Brings the grid up to date in place, from the octree that it was made of (`earlier`) to a newer one: to the cell
        what projecting it anew gives, at the cost of what has changed. A GridUpdate.
        """

    def save(self, folder: str | os.PathLike[str], name: str) -> None:
        """Writes `name.pgm` and `name.yaml` into a folder, as ROS' map_server reads them."""

@final
class GridUpdate:
    """What bringing a grid up to date has done."""

    @property
    def projected(self) -> int:
        """Number of cells that were projected again."""

    @property
    def changed(self) -> int:
        """Number of cells that are other than before."""

    @property
    def bounds(self) -> tuple[int, int, int, int] | None:
        """First and last column, first and last row of a rectangle around these; None when none is."""

    @property
    def has_grown(self) -> bool:
        """Whether the grid has grown, so that indices are other ones than before."""

@final
class FloorGrid:
    """The 2D map of one floor for a robot that drives on it: what is in the way between two heights above the floor, on ramps
    and landings too.
    """

    @property
    def grid(self) -> OccupancyGrid:
        """The grid as it stands, a copy: an OccupancyGrid."""

    @property
    def planes(self) -> list[int]:
        """Ids of the planes that make the floor, the one with which it began first."""

    def floor_heights(self, places: ArrayLike) -> NDArray[np.float64]:
        """Height of the floor at places (n, 2) in the grid's axes: (n,) float64, metres along up from the world's origin, NaN
        outside of the grid.
        """

    def update(self, earlier: Map, map: Map) -> GridUpdate:
        """Brings the grid up to date in place, from the state of the maps that it was made of (`earlier`) to a newer one: to
        the cell what making it anew over the same region gives. A GridUpdate.
        """

@final
class DistanceField:
    """Distances to the nearest obstacle in a box of the world, with their gradients."""

    def at(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """At points (n, 3): distances (n,) float64, metres, at most `max_distance`, and their derivatives (n, 3) along x, y
        and z, away from the obstacle; NaN outside the box.
        """

    @property
    def max_distance(self) -> float:
        """The greatest distance that is told, metres."""

@final
class Plane:
    """A finite plane of a map. World frame, metres: normal . x + offset = 0, and the normal points to the cameras that saw it."""

    @property
    def id(self) -> int:
        """Its id: it never changes and never comes again."""

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
        """Area of what was seen of it, square metres."""

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
        """Its inliers (n, 3) float32, one a voxel, metres."""

@final
class Boundary:
    """A connected piece of a plane. World frame, metres; rings are closed without repeating their first corner. Seen from the
    side that the normal points to, outlines run counterclockwise and holes clockwise.
    """

    @property
    def outline(self) -> NDArray[np.float64]:
        """The outer ring (k, 3) float64."""

    @property
    def holes(self) -> list[NDArray[np.float64]]:
        """The rings of the holes, a list of (k, 3) float64."""

    @property
    def area(self) -> float:
        """Area of the outline less that of its holes, square metres."""

@final
class MapObject:
    """An object of a map: a box or an ellipsoid with a label. World frame, metres."""

    @property
    def id(self) -> int:
        """Its id: it never changes and never comes again."""

    @property
    def label(self) -> str:
        """What it was mostly taken for."""

    @property
    def score(self) -> float:
        """Share of the evidence that is for the label, 0 to 1."""

    @property
    def evidence(self) -> dict[str, float]:
        """All that it was taken for: label to the sum of the detections' scores."""

    @property
    def center(self) -> NDArray[np.float64]:
        """Centre of its box (3,)."""

    @property
    def size(self) -> NDArray[np.float64]:
        """Full lengths of its box along its axes (3,)."""

    @property
    def world_from_object(self) -> Pose:
        """The frame of its box: the origin is the centre, the axes run along the sides; the third is the normal of what it
        stands on.
        """

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Rotation matrix (3, 3): its columns are the box's axes."""

    @property
    def corners(self) -> NDArray[np.float64]:
        """The corners of its box (8, 3); corner k lies on the positive side of axis i where bit i of k is set."""

    @property
    def shape(self) -> str:
        """What stands for it: "cuboid", or "ellipsoid" in the box."""

    @property
    def observations(self) -> int:
        """Number of detections that are of it."""

    @property
    def first_seen(self) -> float:
        """Time of the first observation, seconds."""

    @property
    def last_seen(self) -> float:
        """Time of the last observation, seconds."""

    @property
    def support(self) -> int | None:
        """Id of the plane that it stands on; None when that is no plane of the map, or not known."""

    @property
    def points(self) -> NDArray[np.float64]:
        """Its surface points (n, 3) float64, one a voxel."""

@final
class FloorUnder:
    """What something at a point stands on, or would fall onto."""

    @property
    def plane(self) -> int:
        """The plane's id."""

    @property
    def point(self) -> NDArray[np.float64]:
        """Where it is straight under the point, (3,), metres, world."""

    @property
    def distance(self) -> float:
        """Distance to there, metres."""

    @property
    def extended_by(self) -> float:
        """How far from there the plane was read, metres: 0 where it was read there itself."""

@final
class MapChanges:
    """What differs between two states of a map."""

    @property
    def from_revision(self) -> int:
        """From which revision."""

    @property
    def to_revision(self) -> int:
        """To which."""

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
    """The static points of a cube of 8^3 voxels, all of them."""

    @property
    def place(self) -> list[int]:
        """Which cube: its lowest corner is this times 8 voxels."""

    @property
    def positions(self) -> NDArray[np.float32]:
        """(n, 3) float32, metres, world."""

    @property
    def colors(self) -> NDArray[np.uint8]:
        """Colours of the first of these, as many as have one: (m, 3) uint8."""

@final
class ChangedThings:
    """Planes or objects that differ, by their ids."""

    @property
    def confirmed(self) -> list[int]:
        """Those that are confirmed now and were not."""

    @property
    def changed(self) -> list[int]:
        """Those of which more was seen, or that stand elsewhere."""

    @property
    def merged(self) -> dict[int, int]:
        """Those that are one with another now: id to that other."""

    @property
    def removed(self) -> list[int]:
        """Those that are there no more, or not confirmed any more."""

@final
class WorldChanges:
    """What has become of the world between two maps of it."""

    @property
    def moved(self) -> list[tuple[FoundObject, FoundObject]]:
        """Objects that stand elsewhere: a list of (where it stood, where it stands), FoundObject both."""

    @property
    def appeared(self) -> list[FoundObject]:
        """Objects in what was empty space, a list of FoundObject."""

    @property
    def vanished(self) -> list[FoundObject]:
        """Objects where there is empty space now, a list of FoundObject."""

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
        """When it was seen first, seconds on the map's clock."""

    @property
    def last_seen(self) -> float:
        """When it was seen last."""

@final
class MergeReport:
    """What merging two maps has done."""

    @property
    def sessions(self) -> list[tuple[int, int, int | None, int | None]]:
        """The sessions of both, in the order in which they are mapped: a list of (first frame, number of frames, first frame
        in this map before or None, first frame in the other or None).
        """

    @property
    def key_frames(self) -> int:
        """Key frames in the maps."""

    @property
    def mapped_again(self) -> int:
        """Those of them that were mapped again."""

    @property
    def own(self) -> NewIds:
        """What the things of the map that was merged into are called now, NewIds."""

    @property
    def other(self) -> NewIds:
        """What the other's are, NewIds."""

@final
class NewIds:
    """What the planes and objects of a map are called after it was merged: things of both with one id are one."""

    @property
    def planes(self) -> dict[int, int]:
        """Planes: old id to new."""

    @property
    def objects(self) -> dict[int, int]:
        """Objects: old id to new."""

@final
class Dataset:
    """A TUM RGB-D folder: images, `camera.json`, poses (`groundtruth.txt`, or the file `trajectory`) and detections
    (`detections.jsonl`, or the file or YOLO folder `detections`). `every`: take every n-th frame. `dataset[i]` loads a
    Frame; a loop over the dataset loads one after the other, and warns of those that cannot be loaded and leaves them out.
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
        """What is wrong with its lists and detections: a text each."""

    def __len__(self) -> int: ...

    def __getitem__(self, key: int, /) -> Frame: ...

    def __iter__(self) -> Iterator[Frame]: ...

@final
class Sequence:
    """A rendered sequence with exact truth. `sequence[i]` renders a Frame, the same each time."""

    @property
    def camera(self) -> Camera:
        """The camera."""

    @property
    def poses(self) -> list[Pose]:
        """The exact poses of all frames, a list of Pose."""

    def truth(self) -> metrics.SequenceTruth:
        """The truth about the world: what static surface, movers, faces and objects there are, and what of them these frames
        have seen. Renders all frames.
        """

    def __len__(self) -> int: ...

    def __getitem__(self, key: int, /) -> Frame: ...

def builtin_sequence(name: str | None = None, *, frames: int | None = None, every: int = 1, people: int | None = None, seed: int | None = None, camera: Camera | None = None, carried: str | None = None) -> Sequence:
    """The built-in sequence: people walk through an office, seen by a Kinect-like camera. name: "walking_xyz",
    "walking_static", "walking_halfsphere", "walking_rpy", or the same with "sitting"; None for that of build_map. `frames`
    at 10 a second, by default 150; `every`: every n-th of the same walk; `people` 0 to 2; `camera`: another one; `carried`:
    a "book", "keyboard", "bottle", "cup" or "box" on the table, which a hand puts elsewhere between the seconds 1 and 7.
    """

def load(folder: str | os.PathLike[str]) -> Map:
    """The map that was saved in a folder, to the bit."""
