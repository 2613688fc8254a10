"""Size and times of Open3D's saved map of a recording, to be held beside those of `--bin saving`.

Integrates all frames into a VoxelBlockGrid (distance, weight and three colours in 32 bits each, as in Open3D's own example) with
voxels as large as ours, saves it, loads it, and extracts its points.

    OMP_NUM_THREADS=1 .venv/bin/python open3d_saved_map.py ../shared/data/kitchen
"""

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import open3d as o3d
from scipy.spatial.transform import Rotation

VOXEL_SIZE = 0.01
BLOCK_SIDE = 8
MAX_DEPTH = 5.0


def rows(file: Path) -> list[list[str]]:
    return [line.split() for line in file.read_text().splitlines() if line and not line.startswith("#")]


def integrate(folder: Path) -> o3d.t.geometry.VoxelBlockGrid:
    camera = json.loads((folder / "camera.json").read_text())
    matrix = [[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1]]
    intrinsic, scale = o3d.core.Tensor(np.array(matrix)), camera["depth_scale"]
    floats = o3d.core.float32
    grid = o3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight", "color"), (floats,) * 3, ((1), (1), (3)), VOXEL_SIZE, BLOCK_SIDE, 40000
    )
    poses = np.array(rows(folder / "groundtruth.txt"), dtype=float)
    for time_of_color, color_name, _, depth_name in rows(folder / "associations.txt"):
        _, *place, qx, qy, qz, qw = poses[np.abs(poses[:, 0] - float(time_of_color)).argmin()]
        world_from_camera = np.eye(4)
        world_from_camera[:3, :3] = Rotation.from_quat([qx, qy, qz, qw]).as_matrix()
        world_from_camera[:3, 3] = place
        extrinsic = o3d.core.Tensor(np.linalg.inv(world_from_camera))
        depth, color = (o3d.t.io.read_image(str(folder / name)) for name in (depth_name, color_name))
        blocks = grid.compute_unique_block_coordinates(depth, intrinsic, extrinsic, scale, MAX_DEPTH)
        grid.integrate(blocks, depth, color, intrinsic, intrinsic, extrinsic, scale, MAX_DEPTH)
    return grid


def timed(work):
    start = time.perf_counter()
    result = work()
    return result, 1e3 * (time.perf_counter() - start)


def main() -> None:
    grid, milliseconds = timed(lambda: integrate(Path(sys.argv[1])))
    print(f"Open3D {o3d.__version__}: integrated in {milliseconds:.0f} ms, images read")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "map.npz"
        _, save = timed(lambda: grid.save(str(file)))
        held = int((grid.attribute("weight").numpy()[grid.hashmap().active_buf_indices().numpy()] > 0).sum())
        size = file.stat().st_size
        print(f"saved in {save:.0f} ms; {size / 1e6:.1f} MB, {size / held:.1f} bytes for each of {held} voxels")
        loaded, load = timed(lambda: o3d.t.geometry.VoxelBlockGrid.load(str(file)))
    cloud, first = timed(lambda: loaded.extract_point_cloud(3.0))
    print(f"load {load:.0f} ms, first points {first:.0f} ms: {len(cloud.point.positions)} points")


if __name__ == "__main__":
    main()
