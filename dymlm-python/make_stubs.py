"""Makes the stubs: types from the tables here, docstrings from the installed module.

`python make_stubs.py python/dymlm`
"""

import sys
import textwrap

import dymlm
import dymlm.metrics

F = "NDArray[np.float64]"
F32 = "NDArray[np.float32]"
U8 = "NDArray[np.uint8]"
I8 = "NDArray[np.int8]"
B = "NDArray[np.bool_]"
A = "ArrayLike"
PL = "_PoseLike"
D = "list[Detection]"
T = {
    "Pose": {
        "__init__": f"translation: {A}, quaternion: {A} | None = None",
        "identity": "@static -> Pose",
        "translation": F,
        "quaternion": F,
        "matrix": F,
        "inverse": "-> Pose",
        "__matmul__": f"value: {PL}, / -> Pose",
        "__array__": "dtype: DTypeLike | None = None, copy: bool | None = None -> NDArray[Any]",
        "__eq__": "value: object, / -> bool",
    },
    "Camera": {
        "__init__": "width: int, height: int, fx: float, fy: float, cx: float, cy: float",
        "width": "int",
        "height": "int",
        "fx": "float",
        "fy": "float",
        "cx": "float",
        "cy": "float",
        "__eq__": "value: object, / -> bool",
    },
    "Config": {
        "__init__": "preset: str | None = None, **fields: Any",
        "from_toml": "@static text_or_path: str | os.PathLike[str] -> Config",
        "to_toml": "-> str",
        "to_dict": "-> dict[str, Any]",
        "__eq__": "value: object, / -> bool",
    },
    "Detection": {
        "__init__": f"label: str, box: {A}, score: float, mask: {B} | None = None",
        "label": "str",
        "box": "list[float]",
        "score": "float",
        "mask": f"{B} | None",
        "__eq__": "value: object, / -> bool",
    },
    "Frame": {
        "__init__": f"camera: Camera, timestamp: float, depth: NDArray[np.uint16] | {F32}, color: {U8} | None = None, world_from_camera: {PL} | None = None, detections: _Detections = None, depth_scale: float = 1000.0",
        "timestamp": "float",
        "camera": "Camera",
        "depth": F32,
        "color": f"{U8} | None",
        "detections": 'list[Detection] | Literal["pending"] | None',
        "world_from_camera": "Pose",
        "estimated_world_from_camera": "Pose | None",
        "mover_mask": f"{B} | None",
    },
    "MapBuilder": {
        "__init__": "camera: Camera, config: Config | None = None",
        "resume": "@static map: Map, camera: Camera -> MapBuilder",
        "insert": f"timestamp: float, depth: NDArray[np.uint16] | {F32}, color: {U8} | None = None, *, world_from_camera: {PL}, detections: _Detections = None, depth_scale: float = 1000.0 -> FrameReport",
        "insert_frame": "frame: Frame -> FrameReport",
        "insert_scan": f"timestamp: float, points: {A}, world_from_sensor: {PL} -> FrameReport",
        "detections_for": "frame: int, detections: Iterable[Detection] -> FrameReport",
        "process_waiting": "-> list[FrameReport]",
        "settle": "-> None",
        "track_object": "object: int, frame: Frame -> ObjectTracker",
        "follow_object": "tracker: ObjectTracker -> ObjectMove | None",
        "release_object": "object: int -> None",
        "map": "-> Map",
        "reader": "-> MapReader",
        "finish": "-> Map",
        "correct_poses": f"poses: Mapping[int, {PL}] | Mapping[float, {PL}] -> CorrectionReport",
        "remove": "frame: int | float -> CorrectionReport",
        "transform": f"new_from_old: {PL} -> CorrectionReport",
        "refine_poses": "closures: Iterable[LoopClosure] | None = None, **fields: Any -> RefineReport",
        "trajectory": "-> list[tuple[int, float, Pose]]",
        "begin_session": "-> list[FrameReport]",
        "forget_outside": f"center: {A}, radius: float -> None",
        "memory": "-> dict[str, int]",
        "static_mask": f"-> {B}",
        "config": "Config",
        "camera": "Camera",
    },
    "MapReader": {"latest": "-> Map", "wait_newer": "than: Map, timeout: float = math.inf -> Map | None"},
    "MapSaver": {
        "__init__": "folder: str | os.PathLike[str]",
        "load": "@static folder: str | os.PathLike[str], history: str | dict[str, Any] | None = None, memory: dict[str, Any] | None = None -> tuple[MapSaver, Map]",
        "save": "map: Map -> None",
        "close": "-> None",
        "__enter__": "-> MapSaver",
        "__exit__": "*_exception: object -> None",
        "folder": "Path",
    },
    "ObjectTracker": {
        "object": "int",
        "track": "frame: Frame -> ObjectUpdate",
        "move_world": f"new_from_old: {PL} -> None",
    },
    "ObjectUpdate": {
        "state": "str",
        "world_from_object": "Pose",
        "inliers": "int",
        "confidence": "float",
        "came_to_rest": "bool",
    },
    "ObjectMove": {
        "object": "int",
        "old_world_from_object": "Pose",
        "world_from_object": "Pose",
        "cloud_voxels": "int",
        "emptied_cells": "int",
        "occupied_cells": "int",
        "planes": "list[int]",
    },
    "FrameReport": {
        "id": "int",
        "timestamp": "float",
        "outcome": "str",
        "movers": "list[Mover]",
        "masked_pixels": "int",
        "stages": "dict[str, float]",
        "released": "list[FrameReport]",
        "update": "MapUpdate | None",
        "correction": "CorrectionReport | None",
    },
    "Mover": {
        "track_id": "int",
        "label": "str | None",
        "score": "float",
        "box": "list[float]",
        "detected_box": "list[float]",
        "depth": "float | None",
    },
    "MapUpdate": {
        "readings": "int",
        "new_voxels": "int",
        "hit_cells": "int",
        "missed_cells": "int",
        **{
            k: "list[int]"
            for k in (
                "planes_created",
                "planes_updated",
                "objects_created",
                "objects_updated",
                "objects_confirmed",
                "objects_removed",
            )
        },
        "planes_merged": "list[tuple[int, int]]",
        "objects_merged": "list[tuple[int, int]]",
    },
    "CorrectionReport": {
        "key_frames": "int",
        "moved_key_frames": "int",
        "largest_motion": "float",
        "new_from_old": "Pose",
        "planes": "ThingChanges",
        "objects": "ThingChanges",
    },
    "ThingChanges": {
        "moved": "dict[int, float]",
        "merged": "dict[int, int]",
        "split": "list[tuple[int, int]]",
        "vanished": "list[int]",
        "appeared": "list[int]",
    },
    "LoopClosure": {
        "__init__": f"from_frame: int, to_frame: int, from_from_to: {PL}, rotation_deviation: float, translation_deviation: float"
    },
    "RefineReport": {
        "planes": "int",
        "views": "int",
        "views_left_out": "int",
        "met_again": "int",
        "parted": "int",
        "costs": "list[list[float]]",
        "left_out": "list[int]",
        "unheld": "list[tuple[int, str, list[float], float]]",
        "correction": "CorrectionReport",
    },
    "Map": {
        "cloud": 'selection: str = "static" -> Cloud',
        "static_points": "StaticPoints",
        "octree": "Octree",
        "planes": "list[Plane]",
        "plane": "id: int -> Plane",
        "objects": "list[MapObject]",
        "object": "id: int -> MapObject",
        "objects_on": "plane: int -> list[MapObject]",
        "surfaces": f"up: {A} -> list[tuple[Plane, str, float]]",
        "floor_under": f"point: {A}, up: {A}, max_distance: float, reach: float = 0.0 -> FloorUnder | None",
        "floor_grid": f"at: {A}, up: {A}, region: {A} | None = None, **fields: Any -> FloorGrid",
        "floor_grids": f"up: {A}, region: {A} | None = None, **fields: Any -> list[FloorGrid]",
        "up": f"{F} | None",
        "counts": "-> dict[str, int]",
        "memory": "-> dict[str, int]",
        "config": "Config",
        "revision": "int",
        "save": "folder: str | os.PathLike[str] -> None",
        "merge": f"other: Map, world_from_other: {PL} | None = None -> MergeReport",
        "changes_since": "earlier: Map -> MapChanges",
        "world_changes_since": "earlier: Map -> WorldChanges",
        "sessions": "list[tuple[int, int, float, float]]",
    },
    "Cloud": {"positions": F32, "colors": f"{U8} | None", "__len__": "-> int"},
    "StaticPoints": {
        "nearest": f"places: {A}, radius: float = ... -> tuple[{F32}, {F}]",
        "in_box": f"low: {A}, high: {A}, world_from_box: {PL} | None = None -> tuple[{F32}, {U8}]",
        "cast_rays": f"origins: {A}, directions: {A}, max_range: float = ..., radius: float = 0.015 -> tuple[{F32}, {F}]",
        "normals": f"places: {A}, radius: float -> {F}",
    },
    "Octree": {
        "resolution": "float",
        "extent": f"tuple[{F}, {F}] | None",
        "states": f"points: {A} -> {I8}",
        "log_odds": f"points: {A} -> {F32}",
        "occupied": f"low: {A} | None = None, high: {A} | None = None -> {F}",
        "leaves": f"low: {A} | None = None, high: {A} | None = None -> tuple[{F}, {F32}, {I8}]",
        "cast_rays": f'origins: {A}, directions: {A}, max_range: float = ..., unknown: str = "stop" -> tuple[{F}, {F}, list[str | None]]',
        "nearest_obstacles": f"points: {A}, max_distance: float = ... -> tuple[{F}, {F}]",
        "project": f"up: {A}, min_height: float, max_height: float, region: {A} | None = None -> OccupancyGrid",
        "distance_field": f'low: {A}, high: {A}, max_distance: float, unknown: str = "pass" -> DistanceField',
    },
    "OccupancyGrid": {
        "cells": I8,
        "resolution": "float",
        "origin": F,
        "world_from_grid": "Pose",
        "inflated": "radius: float -> OccupancyGrid",
        "update": "earlier: Octree, octree: Octree -> GridUpdate",
        "save": "folder: str | os.PathLike[str], name: str -> None",
    },
    "GridUpdate": {
        "projected": "int",
        "changed": "int",
        "bounds": "tuple[int, int, int, int] | None",
        "has_grown": "bool",
    },
    "FloorGrid": {
        "grid": "OccupancyGrid",
        "planes": "list[int]",
        "floor_heights": f"places: {A} -> {F}",
        "update": "earlier: Map, map: Map -> GridUpdate",
    },
    "DistanceField": {"at": f"points: {A} -> tuple[{F}, {F}]", "max_distance": "float"},
    "Plane": {
        "id": "int",
        "normal": F,
        "offset": "float",
        "centroid": F,
        "area": "float",
        "mse": "float",
        "observations": "int",
        "first_seen": "float",
        "last_seen": "float",
        "boundary": "list[Boundary]",
        "inliers": F32,
    },
    "Boundary": {"outline": F, "holes": f"list[{F}]", "area": "float"},
    "MapObject": {
        "id": "int",
        "label": "str",
        "score": "float",
        "evidence": "dict[str, float]",
        "center": F,
        "size": F,
        "world_from_object": "Pose",
        "rotation": F,
        "corners": F,
        "shape": "str",
        "observations": "int",
        "first_seen": "float",
        "last_seen": "float",
        "support": "int | None",
        "points": F,
    },
    "FloorUnder": {"plane": "int", "point": F, "distance": "float", "extended_by": "float"},
    "MapChanges": {
        "from_revision": "int",
        "to_revision": "int",
        "cloud": "list[CloudBlock]",
        "octree": F,
        "planes": "ChangedThings",
        "objects": "ChangedThings",
    },
    "CloudBlock": {"place": "list[int]", "positions": F32, "colors": U8},
    "ChangedThings": {
        "confirmed": "list[int]",
        "changed": "list[int]",
        "merged": "dict[int, int]",
        "removed": "list[int]",
    },
    "WorldChanges": {
        "moved": "list[tuple[FoundObject, FoundObject]]",
        "appeared": "list[FoundObject]",
        "vanished": "list[FoundObject]",
    },
    "FoundObject": {
        "id": "int",
        "label": "str",
        "world_from_object": "Pose",
        "size": F,
        "first_seen": "float",
        "last_seen": "float",
    },
    "MergeReport": {
        "sessions": "list[tuple[int, int, int | None, int | None]]",
        "key_frames": "int",
        "mapped_again": "int",
        "own": "NewIds",
        "other": "NewIds",
    },
    "NewIds": {"planes": "dict[int, int]", "objects": "dict[int, int]"},
    "Dataset": {
        "__init__": "folder: str | os.PathLike[str], *, trajectory: str | os.PathLike[str] | None = None, detections: str | os.PathLike[str] | None = None, every: int = 1",
        "camera": "Camera",
        "timestamps": F,
        "warnings": "list[str]",
        "__len__": "-> int",
        "__getitem__": "key: int, / -> Frame",
        "__iter__": "-> Iterator[Frame]",
    },
    "Sequence": {
        "camera": "Camera",
        "poses": "list[Pose]",
        "truth": "-> metrics.SequenceTruth",
        "__len__": "-> int",
        "__getitem__": "key: int, / -> Frame",
        "__iter__": "-> Iterator[Frame]",
    },
}
TF = {
    "builtin_sequence": "name: str | None = None, *, frames: int | None = None, every: int = 1, people: int | None = None, seed: int | None = None, camera: Camera | None = None, carried: str | None = None -> Sequence",
    "load": "folder: str | os.PathLike[str], history: str | dict[str, Any] | None = None, memory: dict[str, Any] | None = None -> Map",
}
O = "float | None"
Q = "tuple[float, float] | None"
M = {
    "SequenceTruth": {"faces": "list[TrueFace]", "objects": "list[TrueObject]"},
    "PointTruth": {"__init__": f"surface: {A}, movers: {A} | None = None, margin: float = 0.1"},
    "TrueFace": {
        "__init__": f"id: int, normal: {A}, offset: float, outline: {A}, cell: float = 0.02",
        "id": "int",
        "normal": F,
        "offset": "float",
        "area": "float",
        "visible_area": "float",
    },
    "TrueObject": {
        "__init__": f"id: int, label: str, world_from_object: {PL}, size: {A}, frames_visible: int = 8",
        "id": "int",
        "label": "str",
        "world_from_object": "Pose",
        "size": F,
        "frames_visible": "int",
    },
    "CloudScore": {
        "residue": "float",
        "stray": "float",
        "completeness": "float",
        "completeness_near_people": O,
        "median_distance": "float",
        "points": "int",
        "visible_points": "int",
    },
    "ReferenceCloud": {
        "__init__": "voxel_size: float = 0.02",
        "add_frame": "frame: Frame, min_depth: float, max_depth: float -> None",
        "score": f"positions: {A} -> tuple[float, float]",
        "__len__": "-> int",
    },
    "DynamicMapScorer": {
        "__init__": "min_depth: float, max_depth: float",
        "add_frame": f"frame: Frame, movers: {B} | None = None -> None",
        "score": f"positions: {A} -> DynamicMapScore",
    },
    "DynamicMapScore": {
        "static_accuracy": O,
        "dynamic_accuracy": O,
        "associated_accuracy": O,
        "harmonic_accuracy": O,
        "static_readings": "int",
        "dynamic_readings": "int",
    },
    "PlaneScore": {
        "recall": O,
        "precision": O,
        "area_recall": O,
        "area_precision": O,
        "mean_boundary_iou": O,
        "angle_degrees": Q,
        "offset": Q,
        "visible_area": "float",
        "matches": "list[tuple[int, int]]",
        "unmatched": "list[int]",
        "missed": "list[int]",
        "duplicates": "list[tuple[int, int]]",
        "wrongly_merged": "list[tuple[int, list[int]]]",
        "sign_errors": "list[int]",
    },
    "ObjectScore": {
        "recall": O,
        "precision": O,
        "label_accuracy": O,
        "mean_iou": O,
        "center_error": Q,
        "yaw_error_degrees": Q,
        "matches": "list[tuple[int, int]]",
    },
}
MF = {
    "score_cloud": f"positions: {A}, truth: SequenceTruth | PointTruth -> CloudScore | None",
    "score_walls": f"positions: {A}, faces: Iterable[TrueFace], truth: SequenceTruth | PointTruth -> tuple[float, float] | None",
    "trajectory_error": f"estimated: Iterable[{PL}], truth: Iterable[{PL}] -> tuple[float, float] | None",
    "score_planes": "planes: Iterable[Plane], faces: Iterable[TrueFace] -> PlaneScore",
    "score_objects": "objects: Iterable[MapObject], truth: Iterable[TrueObject] -> ObjectScore",
}


def doc(text, indent):
    lines = textwrap.dedent((text or "").split("--\n\n", 1)[-1]).strip().split("\n")
    if len(lines) == 1:
        return f'{indent}"""{lines[0]}"""\n'
    return f'{indent}"""' + ("\n" + indent).join(lines).replace(indent + "\n", "\n") + f'\n{indent}"""\n'


def make(mod, classes, functions, head):
    out = head
    for name, members in classes.items():
        o = getattr(mod, name)
        out += f"\n@final\nclass {name}:\n" + doc(o.__doc__, "    ")
        for m, t in members.items():
            d = doc(getattr(o, m).__doc__, "        ") if not m.startswith("__") else "        ...\n"
            if m == "__init__":
                out += f"\n    def __new__(cls, {t}) -> {name}: ...\n"
                continue
            st = t.startswith("@static")
            t = t.removeprefix("@static").strip()
            if "->" in t:
                args, ret = t.rsplit("->", 1)
                args = args.strip()
                ret = ret.strip()
                a = ", ".join(x for x in ([] if st else ["self"]) + ([args] if args else []))
                out += ("\n    @staticmethod" if st else "") + f"\n    def {m}({a}) -> {ret}:\n{d}"
            else:
                out += f"\n    @property\n    def {m}(self) -> {t}:\n{d}"
    for name, t in functions.items():
        args, ret = t.rsplit("->", 1)
        out += f"\ndef {name}({args.strip()}) -> {ret.strip()}:\n" + doc(getattr(mod, name).__doc__, "    ")
    return out.replace(":\n        ...\n", ": ...\n")


head = '''import math
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from . import metrics as metrics

__all__ = %s

# A Pose, a 4x4 matrix, or seven numbers: tx ty tz qx qy qz qw.
_PoseLike: TypeAlias = Pose | ArrayLike
# The output of a detector for a frame: a list, empty when it found nothing; None when it did not run.
_Detections: TypeAlias = Iterable[Detection] | Literal["pending"] | None

'''
# Exceptions, each with what it derives from.
X = {
    "Error": "ValueError",
    "ConfigError": "Error",
    "TimeReversed": "Error",
    "OutOfReach": "Error",
    "NotPending": "Error",
    "UnknownFrame": "Error",
    "UnknownObject": "Error",
    "NoHistory": "Error",
    "NoFloor": "Error",
    "MergeRefused": "Error",
    "FileError": "Error",
    "Locked": "FileError",
    "RefinementStopped": "Error",
}
head = head.rstrip("\n") + "\n"
for name, base in X.items():
    fields = "\n    done: RefineReport\n" if name == "RefinementStopped" else ""
    head += f"\nclass {name}({base}):\n{doc(getattr(dymlm, name).__doc__, '    ')}{fields}"
names = lambda mod, extra: "[\n" + "".join(f'    "{n}",\n' for n in sorted(extra)) + "]"
open(sys.argv[1] + "/__init__.pyi", "w").write(
    make(dymlm, T, TF, head % names(dymlm, list(T) + list(TF) + list(X) + ["metrics"]))
)
mhead = """from collections.abc import Iterable
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import Frame, MapObject, Plane, Pose, _PoseLike

__all__ = %s
"""
open(sys.argv[1] + "/metrics.pyi", "w").write(
    make(dymlm.metrics, M, MF, mhead % names(dymlm.metrics, list(M) + list(MF)))
)
