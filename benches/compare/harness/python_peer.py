"""A Python library as a program that answers requests, like `compare_ours`: python -m harness.python_peer MODULE"""

import sys
import time
from pathlib import Path

import numpy as np

from .files import (
    read_depth_images, read_matrices, read_numbers, read_points, voxel_means, write_numbers, write_points,
)  # fmt: skip
from .inputs import VOXEL, world_points

# Inputs in the form that a library's functions take: made once per input, outside the measured time.
CLOUDS: dict[str, object] = {}
# Depth images as clouds without normals, and weight matrices, by their paths.
IMAGES: dict[str, list] = {}
MATRICES: dict[str, np.ndarray] = {}
# Grown forests, by their input and settings.
FORESTS: dict[tuple, object] = {}
# Pose graphs with their initial poses, by their paths.
GRAPHS: dict[str, tuple] = {}


def cloud(path: str, convert) -> object:
    if path not in CLOUDS:
        CLOUDS[path] = convert(read_points(Path(path)))
    return CLOUDS[path]


def forest(request: dict, grow) -> object:
    """The forest for a request of scores, grown at the first such request."""
    key = (request["input"], request["trees"], request["sample_size"])
    if key not in FORESTS:
        FORESTS[key] = grow()
    return FORESTS[key]


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
    from sklearn.ensemble import IsolationForest

    def cluster(request):
        points = cloud(request["input"], lambda points: points.astype(np.float64))
        engine = DBSCAN(eps=float(request["eps"]), min_samples=int(request["min_points"]), n_jobs=1)

        def save(path, found):
            core = np.zeros(len(points))
            core[found.core_sample_indices_] = 1
            write_labels(path, found.labels_)
            write_core(path, core)

        return lambda: engine.fit(points), save

    def grower(request):
        points = cloud(request["input"], lambda points: points.copy())
        trees, rows = int(request["trees"]), int(request["sample_size"])
        engine = IsolationForest(n_estimators=trees, max_samples=rows, n_jobs=1, random_state=0)
        return points, lambda: engine.fit(points)

    def isolation_forest_fit(request):
        points, grow = grower(request)
        return grow, lambda path, grown: write_numbers(path, -grown.score_samples(points))

    def isolation_forest_scores(request):
        points, grow = grower(request)
        grown = forest(request, grow)
        return lambda: -grown.score_samples(points), write_numbers

    return {
        "dbscan": cluster,
        "isolation_forest_fit": isolation_forest_fit,
        "isolation_forest_scores": isolation_forest_scores,
    }


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

    def oriented_box(request):
        points = point_cloud(request)
        fits = {
            "minimal": points.get_minimal_oriented_bounding_box,
            "principal_axes": points.get_oriented_bounding_box,
        }

        def save(path, box):
            write_numbers(path, np.concatenate([box.center, np.asarray(box.R).ravel(), box.extent]))

        return fits[request["fit"]], save

    def planes(request):
        path = request["input"]
        if path not in IMAGES:
            depths = read_depth_images(Path(path))
            readings = [depths.points(index) for index in range(len(depths.images))]
            IMAGES[path] = [o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)) for points in readings]
        clouds, least = IMAGES[path], int(request["min_support"])

        def find(points):
            # 30 neighbours, as is the default of the patches.
            points.normals = o3d.utility.Vector3dVector()
            points.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(30))
            return points.detect_planar_patches(min_num_points=least)

        def save(path, found):
            rows = [plane_row(i, box, clouds[i]) for i, boxes in enumerate(found) for box in boxes]
            write_numbers(path, np.array(rows))

        return lambda: [find(points) for points in clouds], save

    def plane_row(image, box, points):
        normal, center = np.asarray(box.R)[:, 2], np.asarray(box.center)
        normal = -normal if normal @ center > 0 else normal
        inside = len(box.get_point_indices_within_bounding_box(points.points))
        return [image, *normal, -normal @ center, *center, inside]

    return {"dbscan": cluster, "voxel_grid": voxel_grid, "oriented_box": oriented_box, "planes": planes}


def scipy():
    from scipy.optimize import linear_sum_assignment

    def assignment(request):
        path = request["input"]
        if path not in MATRICES:
            # It computes in double precision.
            MATRICES[path] = read_matrices(Path(path), int(request["size"])).astype(np.float64)
        matrices = MATRICES[path]

        def sums():
            pairs = (linear_sum_assignment(matrix, maximize=True) for matrix in matrices)
            return [matrix[rows, columns].sum() for matrix, (rows, columns) in zip(matrices, pairs)]

        return sums, lambda path, found: write_numbers(path, np.array(found))

    return {"assignment": assignment}


def opencv():
    import cv2

    cv2.setNumThreads(1)

    def minimum_area_rectangle(request):
        points = cloud(request["input"], lambda points: np.ascontiguousarray(points[:, :2]))

        def save(path, rectangle):
            # cv2.boxPoints rounds to single precision.
            center, (width, height), degrees = rectangle
            angle = np.radians(degrees)
            along, across = [np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]
            halves = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, height / 2]
            write_numbers(path, center + halves @ np.array([along, across]))

        return lambda: cv2.minAreaRect(points), save

    return {"minimum_area_rectangle": minimum_area_rectangle, **image_operations(cv2)}


def isotree():
    from isotree import IsolationForest

    def grower(request):
        points = cloud(request["input"], lambda points: points.astype(np.float64))
        trees, rows = int(request["trees"]), int(request["sample_size"])
        # Of its many variants, the published one: cuts along one column, at a random value.
        engine = IsolationForest(
            ntrees=trees, sample_size=rows, ndim=1, ntry=1, missing_action="fail", nthreads=1, random_seed=0
        )
        return points, lambda: engine.fit(points)

    def isolation_forest_fit(request):
        points, grow = grower(request)
        return grow, lambda path, grown: write_numbers(path, grown.predict(points))

    def isolation_forest_scores(request):
        points, grow = grower(request)
        grown = forest(request, grow)
        return lambda: grown.predict(points), write_numbers

    return {"isolation_forest_fit": isolation_forest_fit, "isolation_forest_scores": isolation_forest_scores}


def image_operations(cv2) -> dict:
    """OpenCV's operations on image sequences."""

    def images(path: str, channels: int) -> np.ndarray:
        if path not in CLOUDS:
            shape = (-1, 480, 640, 3) if channels == 3 else (-1, 2, 480, 640)
            # OpenCV's order of channels.
            CLOUDS[path] = np.ascontiguousarray(np.fromfile(path, np.uint8).reshape(shape)[..., ::-1 if channels == 3 else 1])
        return CLOUDS[path]

    def kcf(request):
        sequence = images(request["images"], 3)
        targets = np.fromfile(request["targets"], "<f4").reshape(-1, 6)

        def follow():
            boxes, last, tracker, box = [], None, None, None
            for track, frame, *sides in targets:
                image = sequence[int(frame)]
                if track != last:
                    tracker, last = cv2.TrackerKCF_create(), track
                    left, top, right, bottom = (int(round(float(side))) for side in sides)
                    box = (left, top, right - left, bottom - top)
                    tracker.init(image, box)
                else:
                    found, moved = tracker.update(image)
                    # When it gives up, the target is assumed to be where it was.
                    box = moved if found else box
                boxes.append([box[0], box[1], box[0] + box[2], box[1] + box[3]])
            return boxes

        return follow, lambda path, boxes: np.array(boxes, dtype="<f4").tofile(path)

    def optical_flow(request):
        pairs = images(request["images"], 1)
        points = np.fromfile(request["points"], "<f4").reshape(len(pairs), -1, 4)
        starts = np.ascontiguousarray(points[:, :, None, :2])

        def follow():
            track = cv2.calcOpticalFlowPyrLK
            return [
                track(pair[0], pair[1], start, None, winSize=(21, 21), maxLevel=3)[0]
                for pair, start in zip(pairs, starts)
            ]

        return follow, lambda path, ends: np.array(ends, dtype="<f4").tofile(path)

    return {"kcf": kcf, "optical_flow": optical_flow}


def dufomap_package():
    from dufomap import dufomap

    def static_cloud(request):
        if not CLOUDS:
            images, poses = read_depth_images(Path(request["images"])), read_numbers(Path(request["poses"]))
            poses = poses.reshape(-1, 7)
            readings = [world_points(images.points(i), pose).astype(np.float32) for i, pose in enumerate(poses)]
            # The library wants w first.
            CLOUDS["scans"] = list(zip(readings, poses[:, [0, 1, 2, 6, 3, 4, 5]].tolist()))
        scans = CLOUDS["scans"][: int(request["limit"])]
        settings = [float(request["cell"]), float(request["hits_grow"]), int(request["unknown_grows"])]

        def clean():
            engine = dufomap(*settings, num_threads=1)
            for points, pose in scans:
                engine.run(points, pose, cloud_transform=False)
            engine.oncePropagateCluster(if_propagate=True, if_cluster=False)
            kept = [points[engine.segment(points, pose, cloud_transform=False) == 0] for points, pose in scans]
            return np.concatenate(kept)

        return clean, lambda path, points: write_points(path, voxel_means(points.astype(np.float64), VOXEL))

    return {"static_cloud": static_cloud}


def gtsam_package():
    import gtsam

    def pose_graph(request):
        path = request["graph"]
        if path not in GRAPHS:
            graph, initial = gtsam.readG2o(path, True)
            # Nothing else fixes the first pose.
            graph.add(gtsam.PriorFactorPose3(0, initial.atPose3(0), gtsam.noiseModel.Isotropic.Sigma(6, 1e-4)))
            GRAPHS[path] = graph, initial
        graph, initial = GRAPHS[path]
        solvers = {
            "gauss_newton": (gtsam.GaussNewtonParams, gtsam.GaussNewtonOptimizer),
            "levenberg_marquardt": (gtsam.LevenbergMarquardtParams, gtsam.LevenbergMarquardtOptimizer),
        }
        make_settings, make_solver = solvers[request["method"]]
        settings = make_settings()
        if request["tolerance"] != "default":
            settings.setRelativeErrorTol(float(request["tolerance"]))
            settings.setAbsoluteErrorTol(0)

        def solve():
            solver = make_solver(graph, initial, settings)
            return solver.optimize(), solver.iterations()

        def save(path, found):
            values, iterations = found
            poses = [values.atPose3(key) for key in range(values.size())]
            rows = [[*pose.translation(), *pose.rotation().toQuaternion().coeffs()] for pose in poses]
            write_numbers(path, np.concatenate([[iterations], np.ravel(rows)]))

        return solve, save

    return {"pose_graph": pose_graph}


PEERS = {
    "dbscan": dbscan_package, "sklearn": scikit_learn, "open3d": open3d, "cv2": opencv, "isotree": isotree,
    "scipy": scipy, "dufomap": dufomap_package, "gtsam": gtsam_package,
}  # fmt: skip


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
