"""Synthetic depth scans: boxes seen by a pinhole camera, with noise and missing pixels.

World axes are those of the first camera: x right, y down, z forward, metres.
"""

import numpy as np

from .files import DepthImages, Scan

WIDTH, HEIGHT, FOCAL = 640, 480, 525.0


def hall(frames: int, rng: np.random.Generator) -> list[Scan]:
    """A hall of 5 x 3 m whose far wall is 6 m away, with columns; the noise of a time-of-flight camera (5 mm)."""
    # Surfaces are inside cells of 5 and 2 cm rather than on their borders.
    interior = box((-2.51, -1.81, -1.01), (2.51, 1.23, 6.01))
    solids = [box((x - 0.11, -1.81, z - 0.11), (x + 0.11, 1.23, z + 0.11)) for x in (-1.7, 1.7) for z in (4.0, 5.4)]
    poses = [((0.1 * i, 0.0, 0.02 * i), 0.03 * i) for i in range(frames)]
    return [scan(interior, solids, *pose, lambda z: np.full_like(z, 0.005), rng) for pose in poses]


def room(frames: int, rng: np.random.Generator) -> list[Scan]:
    """A room with a table and a cupboard, seen by a turning camera; the noise of a Kinect (Nguyen 2012)."""
    poses = [((0.3 * np.sin(0.2 * i), 0.0, 0.01 * i), 0.5 * np.sin(0.21 * i)) for i in range(frames)]
    return [scan(ROOM, ROOM_SOLIDS, *pose, kinect_noise, rng) for pose in poses]


def room_depths(frames: int, rng: np.random.Generator) -> DepthImages:
    """Images of the same room, from a camera that turns further from image to image."""
    poses = [((0.1 * i, 0.0, 0.01 * i), 0.3 * i - 0.4) for i in range(frames)]
    views = [view(ROOM, ROOM_SOLIDS, *pose, kinect_noise, rng) for pose in poses]
    images = [np.where(seen, depth, 0.0).reshape(HEIGHT, WIDTH).astype(np.float32) for _, depth, seen in views]
    return DepthImages((FOCAL, FOCAL, 319.5, 239.5), np.stack(images))


def kinect_noise(z):
    return 0.0012 + 0.0019 * np.maximum(z - 0.4, 0) ** 2


def box(low, high) -> np.ndarray:
    return np.array([low, high])


ROOM = box((-1.6, -1.4, -1.5), (1.6, 1.2, 3.0))
ROOM_SOLIDS = [box((-0.5, 0.5, 1.4), (0.5, 0.56, 2.2)), box((0.9, -0.4, 2.4), (1.6, 1.2, 3.0))]


def scan(interior, solids, position, yaw, sigma, rng) -> Scan:
    """The scan of a camera at `position`, turned by `yaw` about the vertical."""
    directions, depth, seen = view(interior, solids, position, yaw, sigma, rng)
    origin = np.array(position)
    points = origin + directions[seen] * depth[seen, None]
    return Scan(origin.astype(np.float32), points.astype(np.float32))


def view(interior, solids, position, yaw, sigma, rng):
    """For each pixel of such a camera: its ray in the world, its depth, and whether it gives a reading."""
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays = np.stack([(u - 319.5) / FOCAL, (v - 239.5) / FOCAL, np.ones(u.shape)], axis=-1).reshape(-1, 3)
    cos, sin = np.cos(yaw), np.sin(yaw)
    rotation = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    directions, origin = rays @ rotation.T, np.array(position)

    # The rays have z = 1, so the parameter along a ray is the depth.
    _, depth = crossings(interior, origin, directions)
    for solid in solids:
        entry, leave = crossings(solid, origin, directions)
        depth = np.where((entry < leave) & (entry > 0), np.minimum(depth, entry), depth)
    depth += sigma(depth) * rng.standard_normal(len(depth))
    return directions, depth, rng.random(len(depth)) >= 0.05


def crossings(solid, origin, directions):
    """The depths at which rays enter and leave a box."""
    with np.errstate(divide="ignore"):
        times = (solid[:, None, :] - origin) / directions
    return times.min(axis=0).max(axis=1), times.max(axis=0).min(axis=1)
