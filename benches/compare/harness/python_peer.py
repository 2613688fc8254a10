"""A Python library as a program that answers requests, as `compare_ours` does: python -m harness.python_peer MODULE"""

import sys
import time
from pathlib import Path

import numpy as np

from .files import read_points, write_points

# What a library's functions take: made once an input, outside the clock.
CLOUDS: dict[str, object] = {}


def cloud(path: str, convert) -> object:
    if path not in CLOUDS:
        CLOUDS[path] = convert(read_points(Path(path)))
    return CLOUDS[path]


def write_labels(path: str, labels: np.ndarray) -> None:
    np.asarray(labels, dtype="<i4").tofile(path)


def write_core(path: str, core: np.ndarray) -> None:
    np.asarray(core, dtype=np.uint8).tofile(Path(path).with_suffix(".core"))


def dbscan_package():
    from dbscan import DBSCAN

    def cluster(request):
        points = cloud(request["input"], lambda points: points.astype(np.float64))
        eps, min_points = float(request["eps"]), int(request["min_points"])

        def save(path, found):
            write_labels(path, found[0])
            write_core(path, found[1])

        return lambda: DBSCAN(points, eps=eps, min_samples=min_points), save

    return {"dbscan": cluster}


def scikit_learn():
    from sklearn.cluster import DBSCAN

    def cluster(request):
        points = cloud(request["input"], lambda points: points.astype(np.float64))
        engine = DBSCAN(eps=float(request["eps"]), min_samples=int(request["min_points"]), n_jobs=1)

        def save(path, found):
            core = np.zeros(len(points))
            core[found.core_sample_indices_] = 1
            write_labels(path, found.labels_)
            write_core(path, core)

        return lambda: engine.fit(points), save

    return {"dbscan": cluster}


def open3d():
    import open3d as o3d

    def point_cloud(request):
        return cloud(
            request["input"],
            lambda points: o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.astype(np.float64))),
        )

    def cluster(request):
        points, eps, min_points = point_cloud(request), float(request["eps"]), int(request["min_points"])
        return lambda: points.cluster_dbscan(eps=eps, min_points=min_points), write_labels

    def voxel_grid(request):
        points, size = point_cloud(request), float(request["voxel_size"])
        return lambda: points.voxel_down_sample(size), lambda path, found: write_points(path, np.asarray(found.points))

    return {"dbscan": cluster, "voxel_grid": voxel_grid}


PEERS = {"dbscan": dbscan_package, "sklearn": scikit_learn, "open3d": open3d}


def answer(operations, line: str) -> str:
    operation, *words = line.split()
    request = dict(word.split("=", 1) for word in words)
    if operation not in operations:
        return f"error no operation {operation}"
    work, save = operations[operation](request)
    wall, cpu = time.perf_counter(), time.process_time()
    found = work()
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    if "result" in request:
        save(request["result"], found)
    return f"ok {wall:.9f} {cpu:.9f}"


def main() -> None:
    operations = PEERS[sys.argv[1]]()
    for line in sys.stdin:
        try:
            reply = answer(operations, line)
        except Exception as error:  # whatever the library throws is the script's to report
            reply = "error " + " ".join(str(error).split())
        print(reply, flush=True)


if __name__ == "__main__":
    main()
