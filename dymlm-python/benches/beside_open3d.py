"""A frame in Open3D and in dymlm, side by side: the same frames of the built-in sequence, one core.

`pip install open3d` and `pip install ./dymlm-python`, then `python benches/beside_open3d.py`. The two do not do the same:
Open3D fuses every reading into a truncated signed distance field, people included; dymlm tracks and masks movers, then
makes a cloud, an octree with free space, planes and objects. Times are processor time, so that a busy machine counts for
both alike; the median over the frames.
"""

import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

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
    sequence = dymlm.builtin_sequence(every=3)
    frames = [sequence[index] for index in range(len(sequence))]
    camera = sequence.camera
    arrays = [(np.nan_to_num(frame.depth), frame.color) for frame in frames]
    cameras_from_world = [np.linalg.inv(frame.world_from_camera.matrix) for frame in frames]
    rows = []

    intrinsic = o3d.camera.PinholeCameraIntrinsic(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    volume = o3d.pipelines.integration.ScalableTSDFVolume(
        voxel_length=VOXEL, sdf_trunc=4 * VOXEL, color_type=o3d.pipelines.integration.TSDFVolumeColorType.RGB8
    )

    def rgbd(depth, color):
        return o3d.geometry.RGBDImage.create_from_color_and_depth(
            o3d.geometry.Image(np.ascontiguousarray(color)),
            o3d.geometry.Image(np.ascontiguousarray(depth, dtype=np.float32)),
            depth_scale=1.0,
            depth_trunc=5.0,
            convert_rgb_to_intensity=False,
        )

    integrate = median_ms(
        [lambda a=a, p=p: volume.integrate(rgbd(*a), intrinsic, p) for a, p in zip(arrays, cameras_from_world)]
    )
    rows.append(("integrate a frame", "Open3D ScalableTSDFVolume, 1 cm", integrate, "TSDF and colour; people stay in"))
    builder = dymlm.MapBuilder(camera)
    reports = []
    insert = median_ms([lambda f=f: reports.append(builder.insert_frame(f)) for f in frames])
    stage = {name: 1e3 * np.median([r.stages.get(name, 0.0) for r in reports]) for name in reports[-1].stages}
    rows.append(("insert a frame", "dymlm MapBuilder.insert", insert, "movers masked; cloud, octree, planes, objects"))
    for name, value in stage.items():
        if name != "total":
            rows.append((f"  of it {name}", "dymlm, by its own clock", value, ""))

    map = builder.map()
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(map.cloud().positions.astype(np.float64)))
    rows.append(("points out", "Open3D extract_point_cloud", median_ms([volume.extract_point_cloud] * 3), ""))
    rows.append(("points out", "dymlm map.cloud()", median_ms([lambda: builder.map().cloud()] * 3), "judged: static alone"))

    places = np.random.default_rng(0).uniform(-2.0, 2.0, (2000, 3))
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
    planes = 1e3 * np.median([sum(v for k, v in r.stages.items() if "plane" in k) for r in reports])
    rows.append(("planes", "dymlm, a frame", planes, "found and fused in each frame, with ids"))

    print(f"{len(frames)} frames {camera.width}x{camera.height}, Open3D {o3d.__version__}; milliseconds of processor time")
    for what, who, value, remark in rows:
        print(f"{what:22} {who:36} {value:9.2f}   {remark}")


if __name__ == "__main__":
    main()
