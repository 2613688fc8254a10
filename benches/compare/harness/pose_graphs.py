"""The cost of a pose graph's poses, with one definition of the error for all libraries."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass
class Edges:
    """The relative poses of a g2o file."""

    # Indices of the pose from which each edge is measured, and of the pose that is measured.
    ends: np.ndarray
    # Translation and quaternion x y z w.
    measured: np.ndarray
    # Inverse covariances, translation first.
    information: np.ndarray


def read_edges(path: Path) -> Edges:
    lines = [line.split()[1:] for line in path.read_text().splitlines() if line.startswith("EDGE_SE3:QUAT")]
    numbers = np.array(lines, dtype=np.float64)
    rows, columns = np.triu_indices(6)
    information = np.zeros((len(numbers), 6, 6))
    information[:, rows, columns] = numbers[:, 9:]
    information[:, columns, rows] = numbers[:, 9:]
    return Edges(numbers[:, :2].astype(int), numbers[:, 2:9], information)


def pose_graph_cost(poses: np.ndarray, edges: Edges) -> float:
    """Half the sum of squares of log(measured^-1 * from^-1 * to), the logarithm of SE(3), weighted by information."""
    from scipy.spatial.transform import Rotation

    turns, places = Rotation.from_quat(poses[:, 3:]), poses[:, :3]
    start, end = edges.ends.T
    measured = Rotation.from_quat(edges.measured[:, 3:])
    # Rotation of the motion measured^-1 * from^-1 * to, then its translation.
    turn = measured.inv() * turns[start].inv() * turns[end]
    between = turns[start].inv().apply(places[end] - places[start])
    shift = measured.inv().apply(between - edges.measured[:, :3])

    rotation = turn.as_rotvec()
    angle = np.linalg.norm(rotation, axis=1)
    half = np.maximum(0.5 * angle, 1e-4)
    # At small angles, the quotient's limit, 1/12, is exact to within the square of the angle.
    factor = np.where(angle < 2e-4, 1 / 12, (1 - half / np.tan(half)) / (4 * half * half))
    turned = np.cross(rotation, shift)
    translation = shift - 0.5 * turned + factor[:, None] * np.cross(rotation, turned)
    errors = np.concatenate([translation, rotation], axis=1)
    return 0.5 * float(np.einsum("ni,nij,nj->", errors, edges.information, errors))
