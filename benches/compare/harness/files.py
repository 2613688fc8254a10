"""The binary files that all contestants read and write: raw little-endian numbers.

- points: x, y, z as f32; rays: origin and direction, 6 f32;
- depth images: width and height as u32, fx, fy, cx, cy as f32, then all depths as f32, metres, 0 for no reading;
- matrices: whole numbers as f32, row by row, one matrix after the other;
- frames: for each frame the sensor's position as 3 f32, the number of points as u32, the points;
- labels: i32, -1 for noise; states: u8, 0 unknown, 1 free, 2 occupied; hits: centre as 3 f32, NaN for none;
- numbers: f64; a rectangle is its four corners, a box its centre, rotation by rows and full lengths, a plane the number of
  its image, normal, offset, centroid and number of pixels, a solved pose graph its number of iterations and then for
  each pose translation and quaternion x y z w;
- poses: translation and quaternion x y z w, 7 f64, world from camera;
- leaves: number of nodes and bytes of memory as u64, then for each leaf key 3 u16, depth u16, log-odds f32.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

# Depth of a leaf that is a single cell.
DEEPEST = 16
LEAF = np.dtype([("key", "<u2", 3), ("depth", "<u2"), ("log_odds", "<f4")])


@dataclass
class Scan:
    """A posed scan in the world: metres, float32."""

    origin: np.ndarray
    points: np.ndarray


@dataclass
class DepthImages:
    """Depth images of one camera, metres, float32, 0 where there is no reading."""

    camera: tuple[float, float, float, float]
    images: np.ndarray

    def points(self, index: int) -> np.ndarray:
        """The readings of an image in the camera's frame, float64."""
        fx, fy, cx, cy = self.camera
        v, u = np.nonzero(self.images[index])
        z = self.images[index][v, u].astype(np.float64)
        return np.stack([(u - cx) / fx * z, (v - cy) / fy * z, z], axis=1)


@dataclass
class Leaves:
    """An octree as its leaves, sorted by key and depth."""

    nodes: int
    bytes: int
    leaves: np.ndarray

    def occupied_cells(self) -> np.ndarray:
        """The cells in all occupied leaves, as numbers, in order."""
        occupied = self.leaves[self.leaves["log_odds"] > 0]
        cells = []
        for depth in np.unique(occupied["depth"]):
            keys = occupied["key"][occupied["depth"] == depth].astype(np.int64)
            side = np.arange(1 << (DEEPEST - int(depth)))
            offsets = np.stack(np.meshgrid(side, side, side), axis=-1).reshape(-1, 3)
            x, y, z = (keys[:, None] + offsets).reshape(-1, 3).T
            cells.append(x << 32 | y << 16 | z)
        return np.sort(np.concatenate(cells))


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


def write_depth_images(path: Path, depths: DepthImages) -> None:
    _, height, width = depths.images.shape
    with open(path, "wb") as file:
        file.write(np.array([width, height], dtype="<u4").tobytes())
        file.write(np.array(depths.camera, dtype="<f4").tobytes())
        file.write(np.ascontiguousarray(depths.images, dtype="<f4").tobytes())


def read_depth_images(path: Path) -> DepthImages:
    width, height = np.fromfile(path, dtype="<u4", count=2)
    camera = np.fromfile(path, dtype="<f4", count=4, offset=8).astype(np.float64)
    images = np.fromfile(path, dtype="<f4", offset=24).reshape(-1, height, width)
    return DepthImages(tuple(camera), images)


def write_matrices(path: Path, matrices: np.ndarray) -> None:
    np.ascontiguousarray(matrices, dtype="<f4").tofile(path)


def read_matrices(path: Path, size: int) -> np.ndarray:
    return np.fromfile(path, dtype="<f4").reshape(-1, size, size)


def read_labels(path: Path) -> np.ndarray:
    return np.fromfile(path, dtype="<i4")


def read_core(path: Path) -> np.ndarray:
    """Whether each point is a core point, from the file beside the labels."""
    return np.fromfile(path.with_suffix(".core"), dtype=np.uint8).astype(bool)


def read_states(path: Path) -> np.ndarray:
    return np.fromfile(path, dtype=np.uint8)


def voxel_means(points: np.ndarray, size: float) -> np.ndarray:
    """The mean of the points in each voxel of a lattice whose corner is the origin."""
    return gathered([points], size)[0]


def gathered(frames, size: float) -> tuple[np.ndarray, np.ndarray]:
    """The mean of each voxel's points over some frames, and the number of frames that hit it."""
    rows = []
    for points in frames:
        keys, place, counts = np.unique(voxel_keys(points, size), return_inverse=True, return_counts=True)
        sums = [np.bincount(place.ravel(), points[:, axis], len(keys)) for axis in range(3)]
        rows.append((keys, np.stack([*sums, counts, np.ones(len(keys))], axis=1)))
    keys, place = np.unique(np.concatenate([keys for keys, _ in rows]), return_inverse=True)
    totals = np.concatenate([sums for _, sums in rows])
    totals = np.stack([np.bincount(place.ravel(), column, len(keys)) for column in totals.T], axis=1)
    return totals[:, :3] / totals[:, 3:4], totals[:, 4].astype(int)


def voxel_keys(points: np.ndarray, size: float) -> np.ndarray:
    x, y, z = (np.floor(points / size).astype(np.int64) + (1 << 20)).T
    return x << 42 | y << 21 | z


def write_numbers(path: Path, numbers: np.ndarray) -> None:
    np.ascontiguousarray(numbers, dtype="<f8").tofile(path)


def read_numbers(path: Path) -> np.ndarray:
    return np.fromfile(path, dtype="<f8")


def read_leaves(path: Path) -> Leaves:
    nodes, held = map(int, np.fromfile(path, dtype="<u8", count=2))
    leaves = np.fromfile(path, dtype=LEAF, offset=16)
    key = leaves["key"]
    return Leaves(nodes, held, leaves[np.lexsort((leaves["depth"], key[:, 2], key[:, 1], key[:, 0]))])
