"""The four maps and their queries."""

import json
import os
from pathlib import Path

import dymlm
import numpy as np
import pytest
from conftest import inserted, same


@pytest.fixture(scope="module")
def map(frames):
    return inserted(frames).finish()


def test_ten_lines_give_four_maps(map):
    cloud = map.cloud()
    assert cloud.positions.shape == (len(cloud), 3) and cloud.positions.dtype == np.float32
    assert cloud.colors.shape == (len(cloud), 3) and cloud.colors.dtype == np.uint8
    assert len(cloud) == map.counts()["cloud_points"] > 10_000 and len(map.cloud("all")) > len(cloud)
    assert len(map.planes) == map.counts()["planes"] >= 5
    assert {"tv", "chair"} <= {thing.label for thing in map.objects}
    assert map.octree.occupied().shape == (map.counts()["octree_occupied_leaves"], 4)


def test_the_maps_are_those_of_rust(tmp_path):
    """The maps are those of the example build_map, on all frames or every N-th: DYMLM_RUST_MAP names its folder."""
    if "DYMLM_RUST_MAP" not in os.environ:
        pytest.skip("DYMLM_RUST_MAP names no folder of build_map")
    rust = Path(os.environ["DYMLM_RUST_MAP"])
    frames = json.loads((rust / "report.json").read_text())["frames"]
    sequence = dymlm.builtin_sequence(every=len(dymlm.builtin_sequence()) // frames)
    builder = dymlm.MapBuilder(sequence.camera)
    for index in range(len(sequence)):
        builder.insert_frame(sequence[index])
    map = builder.finish()
    map.save(tmp_path / "map")
    for name in ["cloud.ply", "octree.bt", "octree.ot", "planes.json", "planes.ply", "objects.json"]:
        assert (tmp_path / "map" / name).read_bytes() == (rust / name).read_bytes(), name
    header, points = (rust / "cloud.ply").read_bytes().split(b"end_header\n", 1)
    points = np.frombuffer(points, [("position", "<f4", 3), ("color", "u1", 3)])
    assert np.array_equal(points["position"], map.cloud().positions)
    assert np.array_equal(points["color"], map.cloud().colors)


def test_arrays_and_frames_make_the_same_maps(frames, map):
    builder = dymlm.MapBuilder(frames[0].camera)
    for frame in frames:
        pose = frame.world_from_camera
        builder.insert(frame.timestamp, frame.depth, frame.color, world_from_camera=pose, detections=frame.detections)
    assert same(builder.finish(), map)


def test_strided_arrays_are_read_where_they_are(frames, map):
    builder = dymlm.MapBuilder(frames[0].camera)
    for frame in frames:
        height, width = frame.depth.shape
        padded = np.full((height, 2 * width + 7), np.nan, np.float32)
        depth = padded[:, 3 : 3 + width]
        depth[:] = frame.depth
        bgr = np.ascontiguousarray(frame.color[:, :, ::-1])
        builder.insert(
            frame.timestamp,
            depth,
            bgr[:, :, ::-1],
            world_from_camera=frame.world_from_camera,
            detections=frame.detections,
        )
    assert same(builder.finish(), map)
    transposed = np.asfortranarray(frames[0].depth)
    assert np.array_equal(dymlm.Frame(frames[0].camera, 0.0, transposed).depth, frames[0].depth)
    packed = np.zeros(frames[0].depth.shape, [("flag", "u1"), ("depth", "<f4")])
    packed["depth"] = frames[0].depth
    assert not packed["depth"].flags.aligned
    assert np.array_equal(dymlm.Frame(frames[0].camera, 0.0, packed["depth"]).depth, frames[0].depth)


def test_millimetres_are_metres(frames):
    stored = np.array([[1500, 0, 65535]], np.uint16)
    camera = dymlm.Camera(3, 1, 5.0, 5.0, 1.0, 0.0)
    assert np.allclose(dymlm.Frame(camera, 0.0, stored).depth, [[1.5, 0.0, 65.535]])
    assert np.allclose(dymlm.Frame(camera, 0.0, stored, depth_scale=5000.0).depth, [[0.3, 0.0, 13.107]])


def test_planes_are_planes(map):
    largest = max(map.planes, key=lambda plane: plane.area)
    distances = largest.inliers @ largest.normal + largest.offset
    assert np.abs(distances).max() < 1e-3 and np.isclose(np.linalg.norm(largest.normal), 1.0)
    outlines = sum(boundary.area for boundary in largest.boundary)
    assert np.isclose(outlines, largest.area, rtol=0.1)
    assert np.allclose(largest.boundary[0].outline @ largest.normal, -largest.offset, atol=1e-6)
    assert map.plane(largest.id).id == largest.id
    with pytest.raises(KeyError):
        map.plane(10**6)
    assert {kind for _, kind, _ in map.surfaces([0.0, 0.0, 1.0])} >= {"floor", "wall"} or map.surfaces([0, 0, 1])


def test_objects_are_boxes(map):
    for thing in map.objects:
        frame = np.asarray(thing.world_from_object)
        assert np.allclose(frame[:3, :3], thing.rotation) and np.allclose(frame[:3, 3], thing.center)
        within = (thing.corners - thing.center) @ thing.rotation
        assert np.allclose(np.abs(within), thing.size / 2.0)
        assert thing.shape in ("cuboid", "ellipsoid") and thing.points.shape[1] == 3
        assert map.object(thing.id).label == thing.label


def test_the_octree_answers(map):
    octree = map.octree
    occupied = octree.occupied()
    assert np.all(octree.states(occupied[:, :3]) == 1) and np.all(octree.log_odds(occupied[:, :3]) >= 0.0)
    assert octree.states([1e3, 0.0, 0.0]) == [-1] and np.isnan(octree.log_odds([[np.nan, 0.0, 0.0]]))[0]
    eye = np.array([[0.0, 0.0, 0.0]])
    directions = occupied[::500, :3] - eye
    distances, centers, ends = octree.cast_rays([0.0, 0.0, 0.0], directions, unknown="pass")
    assert set(ends) == {"occupied"} and np.all(octree.states(centers) == 1)
    assert np.all(distances <= np.linalg.norm(directions, axis=1) + 1e-9)
    near, places = octree.nearest_obstacles(occupied[:5, :3])
    assert np.all(near == 0.0) and np.allclose(places[:, :3], occupied[:5, :3])
    low, high = octree.extent
    grid = octree.project([0.0, 0.0, 1.0], -np.inf, np.inf)
    assert set(np.unique(grid.cells)) <= {-1, 0, 1} and (grid.cells == 1).any()
    middle = occupied[0, :3]
    field = octree.distance_field(middle - 0.5, middle + 0.5, 0.4)
    at, gradients = field.at([middle, high + 10.0])
    assert at[0] < 0.1 and np.isnan(at[1]) and gradients.shape == (2, 3)


def test_the_static_cloud_answers(map):
    positions = map.cloud().positions
    points = map.static_points
    nearest, distances = points.nearest(positions[::1000])
    assert np.array_equal(nearest, positions[::1000]) and np.all(distances == 0.0)
    nearest, distances = points.nearest([[1e3, 0.0, 0.0]], radius=1.0)
    assert np.isnan(nearest).all() and np.isinf(distances).all()
    low, high = positions[0] - 0.2, positions[0] + 0.2
    inside, colors = points.in_box(low, high)
    brute = positions[np.all((positions >= low) & (positions <= high), axis=1)]
    assert abs(len(inside) - len(brute)) <= 2 and colors.shape == inside.shape
    hits, along = points.cast_rays([0.0, 0.0, 0.0], positions[::1000])
    assert np.isfinite(along).all() and np.isfinite(hits).all()
    normals = points.normals(positions[::1000], 0.04)
    assert np.allclose(np.linalg.norm(normals[np.isfinite(normals[:, 0])], axis=1), 1.0)


def test_metrics_judge_the_maps(frames, map):
    camera = frames[0].camera
    truth = dymlm.builtin_sequence(frames=60, every=5, camera=camera).truth()
    score = dymlm.metrics.score_cloud(map.cloud().positions, truth)
    assert score.median_distance < 0.015 and score.residue < 0.05 and score.completeness > 0.9
    surface = map.cloud().positions
    own = dymlm.metrics.score_cloud(surface, dymlm.metrics.PointTruth(surface))
    assert own.median_distance == 0.0 and own.completeness == 1.0
    planes = dymlm.metrics.score_planes(map.planes, truth.faces)
    assert planes.recall > 0.3 and planes.visible_area > 1.0
    matched = {plane for plane, _ in planes.matches}
    assert matched.isdisjoint(planes.unmatched) and len(matched) + len(planes.unmatched) == len(map.planes)
    assert dymlm.metrics.score_objects(map.objects, truth.objects).precision > 0.3
    poses = [frame.world_from_camera for frame in frames]
    moved = [dymlm.Pose([1.0, 2.0, 3.0], [0.0, 0.0, 0.6, 0.8]) @ pose for pose in poses]
    assert np.allclose(dymlm.metrics.trajectory_error(moved, poses), 0.0, atol=1e-6)
    sensor = map.config.to_dict()["sensor"]
    scorer = dymlm.metrics.DynamicMapScorer(sensor["min_depth"], sensor["max_depth"])
    reference = dymlm.metrics.ReferenceCloud(0.02)
    for frame in frames:
        scorer.add_frame(frame)
        reference.add_frame(frame, 0.5, 20.0)
    assert scorer.score(map.cloud().positions).associated_accuracy > 0.8
    residue, completeness = reference.score(map.cloud().positions)
    assert residue < 0.05 and completeness > 0.5


def test_what_recall_and_precision_hide_of_planes_is_told(map):
    plane = max(map.planes, key=lambda plane: plane.area)

    def face(id, normal, offset, inside):
        return dymlm.metrics.TrueFace(id, normal, offset, plane.boundary[0].outline[inside])

    every = slice(None)
    own = face(7, plane.normal, plane.offset, every)
    twice = dymlm.metrics.score_planes([plane, plane], [own])
    assert (twice.recall, twice.precision) == (1.0, 1.0)
    assert twice.duplicates == [(1, 0)] and twice.sign_errors == [] and twice.missed == []
    other_way = dymlm.metrics.score_planes([plane], [face(7, -plane.normal, -plane.offset, every)])
    assert other_way.precision == 1.0 and other_way.sign_errors == [0]
    none = dymlm.metrics.score_planes([], [own])
    assert none.missed == [7] and none.visible_area > 0.08
    # Two true faces of one plane.
    outline = plane.boundary[0].outline
    low, high = outline.min(axis=0), outline.max(axis=0)
    axis = int(np.argmax(high - low))
    middle = np.median(outline[:, axis])
    halves = []
    for id, nearer in ((1, np.minimum), (2, np.maximum)):
        half = outline.copy()
        half[:, axis] = nearer(half[:, axis], middle)
        halves.append(dymlm.metrics.TrueFace(id, plane.normal, plane.offset, half))
    assert dymlm.metrics.score_planes([plane], halves).wrongly_merged == [(0, [1, 2])]


def test_the_depths_that_are_scored_are_the_callers():
    with pytest.raises(TypeError):
        dymlm.metrics.DynamicMapScorer()
    with pytest.raises(TypeError):
        dymlm.metrics.ReferenceCloud().add_frame(None)
