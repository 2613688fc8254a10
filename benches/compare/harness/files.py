"""The binary files that all contestants read and write: raw little-endian numbers.

- points: x, y, z as f32; rays: origin and direction, 6 f32;
- frames: for each frame the sensor's position as 3 f32, the number of points as u32, the points;
- labels: i32, -1 for noise; states: u8, 0 unknown, 1 free, 2 occupied; hits: centre as 3 f32, NaN for none;
- numbers: f64; a rectangle is its four corners, a box its centre, rotation by rows and full lengths;
- leaves: number of nodes as u64, then for each leaf key 3 u16, depth u16, log-odds f32.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

LEAF = np.dtype([("key", "<u2", 3), ("depth", "<u2"), ("log_odds", "<f4")])


@dataclass
class Scan:
    """A posed scan: world, metres, float32."""

    origin: np.ndarray
    points: np.ndarray


@dataclass
class Leaves:
    """An octree as its leaves, sorted by key and depth."""

    nodes: int
    leaves: np.ndarray


def write_points(path: Path, points: np.ndarray) -> None:
    np.ascontiguousarray(points, dtype="<f4").tofile(path)


def read_points(path: Path) -> np.ndarray:
    return np.fromfile(path, dtype="<f4").reshape(-1, 3)


def write_frames(path: Path, scans: list[Scan]) -> None:
    with open(path, "wb") as file:
        for scan in scans:
            file.write(np.asarray(scan.origin, dtype="<f4").tobytes())
            file.write(np.uint32(len(scan.points)).tobytes())
            file.write(np.ascontiguousarray(scan.points, dtype="<f4").tobytes())


def read_labels(path: Path) -> np.ndarray:
    return np.fromfile(path, dtype="<i4")


def read_core(path: Path) -> np.ndarray:
    """Which points are core points, from beside the labels."""
    return np.fromfile(path.with_suffix(".core"), dtype=np.uint8).astype(bool)


def read_states(path: Path) -> np.ndarray:
    return np.fromfile(path, dtype=np.uint8)


def write_numbers(path: Path, numbers: np.ndarray) -> None:
    np.ascontiguousarray(numbers, dtype="<f8").tofile(path)


def read_numbers(path: Path) -> np.ndarray:
    return np.fromfile(path, dtype="<f8")


def read_leaves(path: Path) -> Leaves:
    nodes = int(np.fromfile(path, dtype="<u8", count=1)[0])
    leaves = np.fromfile(path, dtype=LEAF, offset=8)
    key = leaves["key"]
    return Leaves(nodes, leaves[np.lexsort((leaves["depth"], key[:, 2], key[:, 1], key[:, 0]))])
