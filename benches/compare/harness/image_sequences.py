"""Image sequences with known boxes, and image pairs with known flow, for comparing trackers."""

from pathlib import Path

import numpy as np
from scipy import ndimage

# Shorter tracks say little about a tracker.
LEAST_FRAMES = 20
LEAST_HEIGHT = 48


def texture(shape, rng: np.random.Generator, scales=(2, 6, 20)) -> np.ndarray:
    """Smooth noise of several scales, 0..1, H x W x 3, which resembles cloth, walls and furniture from afar."""
    image = np.zeros((*shape, 3))
    for scale in scales:
        noise = rng.standard_normal((*shape, 3))
        noise[..., 1:] = 0.6 * noise[..., 1:] + 0.4 * noise[..., :1]
        smooth = ndimage.gaussian_filter(noise, (scale, scale, 0))
        image += smooth / smooth.std()
    return np.clip(0.5 + 0.12 * image, 0, 1)


def pedestrian(rng: np.random.Generator) -> np.ndarray:
    """A walker in eight phases of a step: phases x H x W x 4 (colour and opacity), with H x W = 256 x 96."""
    height, width, phases = 256, 96, 8
    v, u = np.mgrid[0:height, 0:width] / np.array([height, width])[:, None, None]
    cloth = texture((height, width), rng)
    shirt, trousers, skin = rng.uniform(0.1, 0.9, 3), rng.uniform(0.05, 0.6, 3), np.array([0.8, 0.6, 0.5])
    looks = []
    for phase in range(phases):
        swing = 0.16 * np.sin(2 * np.pi * phase / phases)
        leg = lambda side: np.abs(u - 0.5 - side * swing * (v - 0.5) * 2 - 0.1 * side) < 0.11
        head = ((u - 0.5) / 0.17) ** 2 + ((v - 0.08) / 0.07) ** 2 < 1
        torso = (np.abs(u - 0.5) < 0.3 - 0.08 * np.abs(v - 0.35)) & (v > 0.14) & (v < 0.55)
        arm = np.abs(u - 0.5 + 1.6 * swing * (v - 0.2)) < 0.09
        arm &= (v > 0.2) & (v < 0.6)
        legs = (leg(-1) | leg(1)) & (v >= 0.52)
        color = np.where((torso | arm)[..., None], shirt, np.where(head[..., None], skin, trousers))
        color = np.where((arm & torso)[..., None], 0.8 * shirt, color) * (0.6 + 0.8 * cloth)
        opacity = (head | torso | arm | legs).astype(float)
        looks.append(np.dstack([np.clip(color, 0, 1), opacity]))
    return np.array(looks)


def street(rng: np.random.Generator) -> np.ndarray:
    """House fronts with windows, and a pavement: 480 x 640 x 3."""
    image = 0.55 + 0.35 * (texture((480, 640), rng, (1, 5, 25)) - 0.5)
    for left in range(0, 640, 160):
        image[:300, left : left + 160] *= rng.uniform(0.5, 1.1, 3)
        for column in range(left + 15, left + 150, 45):
            for row in range(20, 280, 70):
                image[row : row + 45, column : column + 28] *= rng.uniform(0.3, 0.8)
    image[300:] = 0.5 * image[300:] + 0.25
    return np.clip(image, 0, 1)


def pedestrians(truth: Path, frames: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Walkers on the tracks of a MOT Challenge file; nearer ones occlude farther ones. Images N x 480 x 640 x 3, and
    targets: rows of track, frame, x_min, y_min, x_max, y_max."""
    rows = np.loadtxt(truth, delimiter=",")[:, :6]
    rows = rows[rows[:, 0] <= frames]
    looks = {int(track): pedestrian(rng) for track in np.unique(rows[:, 1])}
    ground = street(rng)
    images = []
    for frame in range(1, frames + 1):
        image = ground.copy()
        here = rows[rows[:, 0] == frame]
        for _, track, left, top, width, height in here[np.argsort(here[:, 3] + here[:, 5])]:
            look = looks[int(track)]
            paste(image, look[(frame // 3 + int(track)) % len(look)], left - 1, top - 1, width, height)
        image += rng.normal(0, 0.01, image.shape)
        images.append((np.clip(image, 0, 1) * 255).astype(np.uint8))
    return np.array(images), whole_tracks(rows)


def paste(image: np.ndarray, look: np.ndarray, left: float, top: float, width: float, height: float) -> None:
    v = np.arange(max(int(np.ceil(top)), 0), min(int(top + height), image.shape[0]))
    u = np.arange(max(int(np.ceil(left)), 0), min(int(left + width), image.shape[1]))
    if len(v) == 0 or len(u) == 0:
        return
    rows = (v - top + 0.5) / height * look.shape[0] - 0.5
    columns = (u - left + 0.5) / width * look.shape[1] - 0.5
    grid = np.meshgrid(rows, columns, indexing="ij")
    scale = (look.shape[0] / height / 2.5, look.shape[1] / width / 2.5)
    smooth = [ndimage.gaussian_filter(look[..., c], scale) for c in range(4)]
    color = np.dstack([ndimage.map_coordinates(plane, grid, order=1, mode="nearest") for plane in smooth])
    part = image[v[0] : v[-1] + 1, u[0] : u[-1] + 1]
    opacity = color[..., 3:]
    part[:] = part * (1 - opacity) + color[..., :3] * opacity


def whole_tracks(rows: np.ndarray) -> np.ndarray:
    """Runs of frames without a gap, whose first box is completely inside the image and large enough."""
    targets, count = [], 0
    for track in np.unique(rows[:, 1]):
        track_rows = rows[rows[:, 1] == track]
        for run in np.split(track_rows, np.flatnonzero(np.diff(track_rows[:, 0]) != 1) + 1):
            frame, left, top, width, height = run[:, 0] - 1, run[:, 2] - 1, run[:, 3] - 1, run[:, 4], run[:, 5]
            inside = left[0] >= 0 and top[0] >= 0 and left[0] + width[0] <= 640 and top[0] + height[0] <= 480
            if len(run) < LEAST_FRAMES or height[0] < LEAST_HEIGHT or not inside:
                continue
            boxes = [left, top, left + width, top + height]
            targets.append(np.stack([np.full(len(run), count), frame, *boxes], axis=1))
            count += 1
    return np.concatenate(targets)


def flow_pairs(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of images related by known similarities, pairs x 2 x 480 x 640 (grey, 8 bits), and for each pair 200 points
    with their positions in both images: pairs x 200 x 4."""
    height, width = 480, 640
    v, u = np.mgrid[0:height, 0:width].astype(float)
    images, points = [], []
    for turn, zoom, shift in [
        (0.0, 1.0, (3.3, -2.6)),
        (0.02, 1.01, (-7.4, 5.2)),
        (0.05, 1.03, (4.1, 9.7)),
        (-0.08, 0.95, (12.6, -6.3)),
        (0.0, 1.0, (21.5, 14.2)),
        (0.1, 1.06, (-5.5, -11.8)),
    ]:
        scene = texture((height, width), rng, (1.2, 3, 8, 30))[..., 0]
        cos, sin = zoom * np.cos(turn), zoom * np.sin(turn)
        forward = np.array([[cos, -sin], [sin, cos]])
        center = np.array([width / 2, height / 2])
        back = np.linalg.inv(forward)
        du, dv = u - center[0] - shift[0], v - center[1] - shift[1]
        source = [back[1, 0] * du + back[1, 1] * dv + center[1], back[0, 0] * du + back[0, 1] * dv + center[0]]
        warped = ndimage.map_coordinates(scene, source, order=3, mode="reflect")
        pair = [np.clip(image + rng.normal(0, 0.008, image.shape), 0, 1) for image in (scene, warped)]
        images.append((np.array(pair) * 255).round().astype(np.uint8))
        start = rng.uniform([60, 60], [width - 60, height - 60], (200, 2))
        # All contestants get f32.
        start = start.astype(np.float32).astype(float)
        end = (start - center) @ forward.T + center + shift
        points.append(np.concatenate([start, end], axis=1))
    return np.array(images), np.array(points)
