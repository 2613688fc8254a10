"""Seeded inputs, which are written once into the build folder."""

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import image_sequences, scenes
from .files import (
    DepthImages, Scan, gathered, write_depth_images, write_frames, write_matrices, write_numbers, write_points,
)  # fmt: skip

SEED = 7
# Increased when inputs are made in another way, so that old files are not used.
RECIPE = 7
FRAMES = 30
# Open3D takes seconds to find planes in each.
PLANE_FRAMES = 4
# Of the recording with people, every n-th frame is mapped, with readings in this range, metres.
PEOPLE_EVERY, RANGE = 2, (0.3, 4.5)
# Side of the voxels in which clouds are compared, metres, and number of frames that must hit one that is
# asked for.
VOXEL, ASKED_FROM = 0.02, 3
# Size and number of the weight matrices.
MATRICES = [(10, 1000), (100, 20), (500, 1)]
POSE_GRAPHS = ["parking-garage", "sphere2500"]


@dataclass
class Inputs:
    """The folder of the inputs, and their descriptions."""

    folder: Path
    # One line for each input.
    description: dict[str, str]
    # The field's pose graphs, by name: g2o files, used unchanged.
    pose_graphs: dict[str, Path]

    def path(self, name: str) -> Path:
        return self.folder / name


def prepare(folder: Path, data: Path) -> Inputs:
    """Makes all inputs, unless the folder has them already."""
    kitchen = data / "kitchen"
    real = (kitchen / "groundtruth.txt").exists()
    folder = folder.with_name(f"{folder.name}_{RECIPE}_{'kitchen' if real else 'room'}")
    described = folder / "description.json"
    if not described.exists():
        folder.mkdir(parents=True, exist_ok=True)
        print(f"making inputs in {folder}", flush=True)
        described.write_text(json.dumps(make(folder, kitchen if real else None, data), indent=1))
    graphs = {name: data / "pose_graphs" / f"{name}.g2o" for name in POSE_GRAPHS}
    graphs = {name: path for name, path in graphs.items() if path.exists()}
    if not graphs:
        print("no pose_graphs/ in the data folder: no rows of them", flush=True)
    description = json.loads(described.read_text()) | {name: describe_graph(path) for name, path in graphs.items()}
    return Inputs(folder, description, graphs)


def describe_graph(path: Path) -> str:
    text = path.read_text()
    return f"{text.count('VERTEX_SE3:QUAT')} poses, {text.count('EDGE_SE3:QUAT')} relative poses"


def make(folder: Path, kitchen: Path | None, data: Path) -> dict[str, str]:
    rng = np.random.default_rng(SEED)
    description = {}
    for name, count in [("10k", 10_000), ("100k", 100_000), ("1M", 1_000_000)]:
        write_points(folder / f"blobs_{name}.points", blobs(count, rng))
        description[f"{name} blobs"] = f"{count} points in blobs of 20 cm, 1000 a blob and cubic metre, 5 % noise"

    if kitchen is None:
        print("no kitchen/ in the data folder: a synthetic room takes its place", flush=True)
        frames = scenes.room(FRAMES, rng)
        frame = max(frames, key=lambda scan: len(scan.points)).points
        where = "synthetic room"
    else:
        frames = kitchen_frames(kitchen, FRAMES)
        frame = fullest_frame(kitchen)
        write_kitchen_images(folder, kitchen, FRAMES)
        where = "kitchen recording"
    write_points(folder / "frame.points", frame)
    write_frames(folder / "frames.frames", frames)
    description["frame"] = f"the fullest depth frame of the {where}, unfiltered: {len(frame)} points, camera frame"
    description["30 frames"] = f"{FRAMES} posed frames of the {where}, {describe_frames(frames)}"

    halls = scenes.hall(6, rng)
    write_frames(folder / "hall.frames", halls)
    description["hall"] = f"6 posed frames of a synthetic hall of 5 x 3 m, far wall 6 m away, {describe_frames(halls)}"

    write_points(folder / "scattered.points", scattered_points(frames, 1_000_000, rng))
    description["scattered points"] = "1000000 points on the 30 frames' lines of sight, in random order"
    surfaces = np.concatenate([scan.points for scan in frames[::7]])
    write_points(folder / "surfaces.points", surfaces)
    description["scan-ordered points"] = f"{len(surfaces)} readings of 5 of the 30 frames, in the order of the pixels"
    write_points(folder / "rays.rays", rays(frames, 100_000, rng))
    description["rays"] = "100000 rays, from a sensor position towards a reading of any frame, both at random"
    for size, count in [("10k", 10_000), ("100k", 100_000)]:
        write_points(folder / f"thing_{size}.points", thing(count, rng))
        write_points(folder / f"round_{size}.points", round_thing(count, rng))
        description[f"{size} box-like"] = f"{count} points on a turned box of 60 x 40 x 30 cm, 2 mm noise, 1 % strays"
        description[f"{size} round"] = f"{count} points evenly within an ellipsoid of 60 x 50 x 30 cm, turned"
        for name, (points, what) in footprints(count).items():
            write_points(folder / f"{name}_{size}.points", points)
            description[f"{size} {name}"] = f"{count} points {what}, turned"
    if kitchen is None:
        depths = scenes.room_depths(PLANE_FRAMES, rng)
    else:
        depths = kitchen_depth_images(kitchen, PLANE_FRAMES)
    write_depth_images(folder / "images.depths", depths)
    description[f"{PLANE_FRAMES} depth images"] = f"{PLANE_FRAMES} depth images of the {where}, spread over it"
    for size, count in MATRICES:
        write_matrices(folder / f"weights_{size}.matrices", rng.integers(0, 1_000_000, (count, size, size)))
        description[f"{size}x{size}"] = f"{count} matrices of random whole numbers below a million"
    if kitchen is not None and (data / "kitchen_people" / "groundtruth.txt").exists():
        description["people"] = people_inputs(folder, kitchen, data / "kitchen_people")
    else:
        print("no kitchen_people/ in the data folder: no rows of clouds without movers", flush=True)
    description |= image_inputs(folder, data, rng)
    return description


def people_inputs(folder: Path, kitchen: Path, people: Path) -> str:
    """A recording with people, and its truth: the same recording without them."""
    names, camera = kitchen_listing(people)[::PEOPLE_EVERY], kitchen_camera(people)
    poses = np.loadtxt(people / "groundtruth.txt")[::PEOPLE_EVERY, 1:]
    images = np.stack([kitchen_image(people, name) for name in names]).astype(np.float32)
    write_depth_images(folder / "people.depths", DepthImages(tuple(camera[k] for k in ["fx", "fy", "cx", "cy"]), images))
    write_numbers(folder / "people.poses", poses)
    clean = np.loadtxt(kitchen / "groundtruth.txt")[:, 1:]
    means, hits = gathered((world_points(*frame) for frame in zip(
        (kitchen_depth(kitchen, name) for name in kitchen_listing(kitchen)), clean)), VOXEL)  # fmt: skip
    write_points(folder / "reference.points", means)
    write_points(folder / "asked.points", means[hits >= ASKED_FROM])
    return f"{len(names)} frames of the kitchen with people, without detections, against the kitchen without people"


def world_points(points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """The readings within `RANGE`, in the world."""
    points = points[(points[:, 2] >= RANGE[0]) & (points[:, 2] <= RANGE[1])]
    return points @ rotation_matrix(pose[3:]).T + pose[:3]


def rotation_matrix(quaternion: np.ndarray) -> np.ndarray:
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def image_inputs(folder: Path, data: Path, rng: np.random.Generator) -> dict[str, str]:
    description = {}
    images, points = image_sequences.flow_pairs(rng)
    images.tofile(folder / "flow.images")
    points.astype("<f4").tofile(folder / "flow.points")
    description["warped pairs"] = "6 pairs of 640x480 images under known similarities, 200 points each"
    root = Path(__file__).resolve().parents[3]
    render = ["cargo", "run", "--release", "-p", "dymlm-benches", "--bin", "carried_sequences", "--", str(folder)]
    subprocess.run(render, cwd=root, check=True)
    boxes = (folder / "carried.targets").stat().st_size // 24
    description["carried things"] = f"10 rendered sequences of a thing carried by hand, 15 frames a second, {boxes} boxes"
    truth = data / "mot" / "TUD-Stadtmitte" / "gt.txt"
    if truth.exists():
        images, targets = image_sequences.pedestrians(truth, 100, rng)
        images.tofile(folder / "pedestrians.images")
        targets.astype("<f4").tofile(folder / "pedestrians.targets")
        tracks = len(np.unique(targets[:, 0]))
        description["pedestrians"] = f"{tracks} walkers drawn on the tracks of TUD-Stadtmitte, 100 frames, {len(targets)} boxes"
    return description


def thing(count: int, rng: np.random.Generator) -> np.ndarray:
    """Points distributed like those of `dymlm_benches::thing`, rotated about all axes."""
    lengths, index = np.array([0.6, 0.4, 0.3]), np.arange(count)
    points = rng.uniform(-0.5, 0.5, (count, 3)) * lengths
    axis = index % 3
    points[index, axis] = np.where(index % 2 == 0, 0.5, -0.5) * lengths[axis] + rng.uniform(-0.002, 0.002, count)
    stray = index % 100 == 0
    points[stray] = 1.5 * rng.uniform(-0.5, 0.5, (stray.sum(), 3)) * lengths
    return turned(points)


def round_thing(count: int, rng: np.random.Generator) -> np.ndarray:
    directions = rng.standard_normal((count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    radii = np.cbrt(rng.uniform(0, 1, count))
    return turned(directions * radii[:, None] * [0.3, 0.25, 0.15])


def footprints(count: int) -> dict[str, tuple[np.ndarray, str]]:
    """Points in the plane with other distributions."""
    rng = np.random.default_rng(SEED)
    gaussian = rng.standard_normal((count, 2)) * [0.15, 0.05]
    angles, radii = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.29, 0.31, count)
    ring = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    along, side = rng.uniform(-0.5, 0.5, count), rng.choice([-0.5, 0.5], count)
    noise = rng.uniform(-0.002, 0.002, count)
    outline = np.where(
        (np.arange(count) % 2 == 0)[:, None],
        np.stack([0.6 * along, 0.4 * side + noise], axis=1),
        np.stack([0.6 * side + noise, 0.4 * along], axis=1),
    )
    kinds = {
        "gaussian": (gaussian, "of a normal distribution of 15 x 5 cm"),
        "ring": (ring, "on a ring 30 cm in radius and 2 cm wide"),
        "outline": (outline, "on the sides of a rectangle of 60 x 40 cm, 2 mm noise"),
    }
    return {name: (turned_in_plane(points), what) for name, (points, what) in kinds.items()}


def turned_in_plane(points: np.ndarray) -> np.ndarray:
    cos, sin = np.cos(0.4), np.sin(0.4)
    moved = points @ [[cos, sin], [-sin, cos]] + [1.0, 2.0]
    return np.pad(moved, ((0, 0), (0, 1))).astype(np.float32)


def turned(points: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return (Rotation.from_euler("xyz", [0.3, 0.2, 0.4]).apply(points) + [1.0, 2.0, 1.0]).astype(np.float32)


def blobs(count: int, rng: np.random.Generator) -> np.ndarray:
    """Points distributed like those of `dymlm_benches::blobs`."""
    blob_count = max(count // 1000, 1)
    side = np.cbrt(blob_count)
    centers = rng.uniform(0, side, (blob_count, 3))
    index = np.arange(count)
    points = centers[index % blob_count] + rng.uniform(-0.1, 0.1, (count, 3, 3)).sum(axis=1)
    noise = index % 20 == 0
    points[noise] = rng.uniform(0, side, (noise.sum(), 3))
    return points.astype(np.float32)


def kitchen_depth(kitchen: Path, name: str) -> np.ndarray:
    """The readings of a depth image in the camera's frame, metres, float64."""
    camera, z = kitchen_camera(kitchen), kitchen_image(kitchen, name)
    v, u = np.nonzero(z)
    z = z[v, u]
    return np.stack([(u - camera["cx"]) / camera["fx"] * z, (v - camera["cy"]) / camera["fy"] * z, z], axis=1)


def kitchen_camera(kitchen: Path) -> dict:
    return json.loads((kitchen / "camera.json").read_text())


def kitchen_image(kitchen: Path, name: str) -> np.ndarray:
    """A depth image, metres, float64, 0 where there is no reading."""
    import open3d

    return np.asarray(open3d.io.read_image(str(kitchen / name))) / kitchen_camera(kitchen)["depth_scale"]


def kitchen_depth_images(kitchen: Path, count: int) -> DepthImages:
    """Images spread evenly over the sequence."""
    names, camera = kitchen_listing(kitchen), kitchen_camera(kitchen)
    images = np.stack([kitchen_image(kitchen, names[i]) for i in spread(len(names), count)]).astype(np.float32)
    return DepthImages(tuple(camera[key] for key in ["fx", "fy", "cx", "cy"]), images)


def spread(length: int, count: int) -> np.ndarray:
    """Indices spread evenly over a sequence."""
    return np.arange(count) * length // count


def write_kitchen_images(folder: Path, kitchen: Path, count: int) -> None:
    """The frames of `kitchen_frames` as depth images and poses, for maps that take no points."""
    write_depth_images(folder / "frames.depths", kitchen_depth_images(kitchen, count))
    poses = np.loadtxt(kitchen / "groundtruth.txt")
    write_numbers(folder / "frames.poses", poses[spread(len(kitchen_listing(kitchen)), count), 1:])


def kitchen_listing(kitchen: Path) -> list[str]:
    lines = (kitchen / "associations.txt").read_text().splitlines()
    return [line.split()[3] for line in lines if line and not line.startswith("#")]


def fullest_frame(kitchen: Path) -> np.ndarray:
    return max((kitchen_depth(kitchen, name) for name in kitchen_listing(kitchen)), key=len).astype(np.float32)


def kitchen_frames(kitchen: Path, count: int) -> list[Scan]:
    """Frames spread evenly over the sequence, in the world."""
    names, poses = kitchen_listing(kitchen), np.loadtxt(kitchen / "groundtruth.txt")
    scans = []
    for i in spread(len(names), count):
        origin, rotation = poses[i, 1:4], rotation_matrix(poses[i, 4:])
        points = kitchen_depth(kitchen, names[i]) @ rotation.T + origin
        scans.append(Scan(origin.astype(np.float32), points.astype(np.float32)))
    return scans


def describe_frames(scans: list[Scan]) -> str:
    distances = np.concatenate([np.linalg.norm(scan.points - scan.origin, axis=1) for scan in scans])
    low, middle, high = np.percentile(distances, [5, 50, 95])
    points = len(distances) // len(scans)
    return f"{points} points a frame, distances {low:.1f} / {middle:.1f} / {high:.1f} m (5 %, median, 95 %)"


def scattered_points(scans: list[Scan], count: int, rng: np.random.Generator) -> np.ndarray:
    chosen = [scans[i] for i in rng.integers(len(scans), size=count)]
    ends = np.array([scan.points[rng.integers(len(scan.points))] for scan in chosen])
    origins = np.array([scan.origin for scan in chosen])
    return origins + rng.random((count, 1)) * (ends - origins)


def rays(scans: list[Scan], count: int, rng: np.random.Generator) -> np.ndarray:
    origins = np.array([scans[i].origin for i in rng.integers(len(scans), size=count)])
    seen = [scans[i] for i in rng.integers(len(scans), size=count)]
    targets = np.array([scan.points[rng.integers(len(scan.points))] for scan in seen])
    return np.concatenate([origins, targets - origins], axis=1)
