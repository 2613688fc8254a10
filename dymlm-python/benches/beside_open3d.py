"""A frame in Open3D and in dymlm, side by side: the same frames of the built-in sequence.

`pip install open3d` and `pip install ./dymlm-python`, then `python benches/beside_open3d.py`. The two do
different work: Open3D fuses every reading into a truncated signed distance field, people included; dymlm
tracks and masks movers, then makes a cloud, an octree with free space, planes and objects. Times are
processor time of all cores, so that a busy machine counts for both alike; the median over the frames.
"""

import time

import dymlm
import numpy as np
import open3d as o3d

VOXEL = 0.01


def median_ms(calls):
    times = []
    for call in calls:
        start = time.process_time()
        call()
        times.append(1e3 * (time.process_time() - start))
    return float(np.median(times))


def main():
    sequence = dymlm.builtin_sequence(every=5)
    frames = [sequence[index] for index in range(len(sequence))]
    camera = sequence.camera
    arrays = [(np.nan_to_num(frame.depth), frame.color) for frame in frames]
    cameras_from_world = [np.linalg.inv(frame.world_from_camera.matrix) for frame in frames]
    rows = []

    core = o3d.core
    intrinsic = core.Tensor([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]], core.float64)
    # The legacy ScalableTSDFVolume of Open3D 0.20 stays empty with these images; this is its successor.
    kinds = (core.float32, core.float32, core.float32)
    volume = o3d.t.geometry.VoxelBlockGrid(("tsdf", "weight", "color"), kinds, ((1), (1), (3)), VOXEL, 16, 100_000)

    def integrate_frame(depth, color, camera_from_world):
        depth = o3d.t.geometry.Image(core.Tensor(np.ascontiguousarray(depth, dtype=np.float32)))
        color = o3d.t.geometry.Image(core.Tensor(np.ascontiguousarray(color)).to(core.float32) / 255.0)
        pose = core.Tensor(camera_from_world)
        blocks = volume.compute_unique_block_coordinates(depth, intrinsic, pose, 1.0, 5.0, 4.0)
        volume.integrate(blocks, depth, color, intrinsic, intrinsic, pose, 1.0, 5.0, 4.0)

    integrate = median_ms([lambda a=a, p=p: integrate_frame(*a, p) for a, p in zip(arrays, cameras_from_world)])
    rows.append(("integrate a frame", "Open3D VoxelBlockGrid, 1 cm", integrate, "TSDF and colour; people stay in"))
    builder = dymlm.MapBuilder(camera)
    reports = []
    insert = median_ms([lambda f=f: reports.append(builder.insert_frame(f)) for f in frames])
    rows.append(("insert a frame", "dymlm MapBuilder.insert_frame", insert, "movers masked; cloud, octree, planes, objects"))

    map = builder.map()
    first = median_ms([map.cloud])
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(map.cloud().positions.astype(np.float64)))
    extracted = []
    extract = lambda: extracted.append(volume.extract_point_cloud(weight_threshold=1.0))  # noqa: E731
    taken = median_ms([extract])
    rows.append(("points out", "Open3D extract_point_cloud", taken, f"{len(extracted[0].point.positions)} points"))
    again = median_ms([map.cloud] * 3)
    rows.append(("points out", "dymlm map.cloud()", first, f"{len(map.cloud())} points, judged: static alone"))
    rows.append(("points out again", "dymlm map.cloud()", again, ""))

    random = np.random.default_rng(0)
    near = map.cloud().positions.astype(np.float64)[random.integers(0, len(map.cloud()), 2000)]
    places = near + random.normal(0.0, 0.05, near.shape)
    tree = o3d.geometry.KDTreeFlann(cloud)
    each = [lambda: [tree.search_knn_vector_3d(place, 1) for place in places]] * 3
    rows.append(("2000 nearest points", "Open3D KDTreeFlann, a call each", median_ms(each), "built before"))
    points = map.static_points
    points.nearest(places[:1])
    rows.append(("2000 nearest points", "dymlm static_points.nearest", median_ms([lambda: points.nearest(places)] * 3), ""))

    segment = median_ms([lambda: cloud.segment_plane(0.02, 3, 500)] * 3)
    rows.append(("planes", "Open3D segment_plane", segment, "one plane of a whole cloud"))
    patches = o3d.geometry.PointCloud(cloud)
    patches.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(0.05, 30))
    rows.append(("planes", "Open3D detect_planar_patches", median_ms([patches.detect_planar_patches]), "normals not counted"))
    share = np.median([sum(v for k, v in r.stages.items() if "plane" in k) / r.stages["total"] for r in reports])
    rows.append(("planes", "dymlm, a frame", share * insert, "found and fused in each frame, with ids"))

    print(f"{len(frames)} frames {camera.width}x{camera.height}, Open3D {o3d.__version__}; milliseconds of processor time")
    for what, who, value, remark in rows:
        print(f"{what:22} {who:36} {value:9.2f}   {remark}")


if __name__ == "__main__":
    main()
