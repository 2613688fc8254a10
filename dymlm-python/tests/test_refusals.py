"""A refused call raises an exception with Rust's text, and changes nothing."""

import dymlm
import numpy as np
import pytest
from conftest import inserted, same

NAN_POSE = np.eye(4)
NAN_POSE[1, 1] = np.nan
SHEARED = np.eye(4)
SHEARED[0, 1] = 0.5
PROJECTIVE = np.eye(4)
PROJECTIVE[3, 0] = 1.0


@pytest.mark.parametrize(
    ("changed", "kind", "words"),
    [
        ({"depth": np.zeros((240, 319), np.float32)}, dymlm.Error, "depth of shape"),
        ({"depth": np.zeros((240, 320, 1), np.float32)}, dymlm.Error, "depth of shape"),
        ({"depth": np.zeros((240, 320))}, TypeError, "uint16 .* or float32"),
        ({"depth": np.zeros((240, 320), ">u2")}, TypeError, "uint16 .* or float32"),
        ({"depth": [[1.0]]}, TypeError, "uint16 .* or float32"),
        ({"depth": np.zeros((240, 320), np.uint16), "depth_scale": 0.0}, dymlm.Error, "depth scale"),
        ({"color": np.zeros((240, 320), np.uint8)}, dymlm.Error, "colour of shape"),
        ({"color": np.zeros((240, 320, 4), np.uint8)}, dymlm.Error, "colour of shape"),
        ({"color": np.zeros((240, 320, 3))}, TypeError, "uint8"),
        ({"world_from_camera": NAN_POSE}, dymlm.Error, "rotation"),
        ({"world_from_camera": [np.nan] * 7}, dymlm.Error, "pose|finite"),
        ({"world_from_camera": np.eye(3)}, dymlm.Error, "seven numbers"),
        ({"world_from_camera": SHEARED}, dymlm.Error, "rotation"),
        ({"world_from_camera": PROJECTIVE}, dymlm.Error, "last row"),
        ({"world_from_camera": [1e30, 0, 0, 0, 0, 0, 1]}, dymlm.Error, "reach|far|outside|beyond"),
        ({"world_from_camera": "here"}, TypeError, "real numbers"),
        ({"timestamp": float("nan")}, dymlm.Error, "timestamp"),
        ({"timestamp": -1.0}, dymlm.Error, "time"),
        ({"detections": "none"}, dymlm.Error, "pending"),
        ({"detections": [("person", 0.5)]}, TypeError, "Detection"),
    ],
)
def test_a_refused_frame_changes_nothing(frames, changed, kind, words):
    builder, untouched = inserted(frames[:2]), inserted(frames[:2])
    frame = frames[2]
    arguments = dict(
        timestamp=frame.timestamp,
        depth=frame.depth,
        color=frame.color,
        world_from_camera=frame.world_from_camera,
        detections=frame.detections,
    )
    with pytest.raises(kind, match=words):
        builder.insert(**(arguments | changed))
    for whole in (builder, untouched):
        whole.insert(**arguments)
    assert same(builder.map(), untouched.map())


def test_masks_and_boxes(frames):
    mask = np.zeros((240, 320), bool)
    mask[10:20, 30:40] = True
    detection = dymlm.Detection("person", [30, 10, 40, 20], 0.5, mask)
    assert np.array_equal(detection.mask, mask) and detection.box == [30.0, 10.0, 40.0, 20.0]
    assert detection == dymlm.Detection("person", np.array([30, 10, 40, 20]), 0.5, mask[::1])
    # Regression: numpy's bools may be any bytes, and those of a mask of 0 and 255 reached its neighbours.
    for true in (2, 255):
        viewed = (true * mask.astype(np.uint8)).view(bool)
        assert dymlm.Detection("person", [30, 10, 40, 20], 0.5, viewed) == detection
        assert dymlm.Detection("person", [30, 10, 40, 20], 0.5, viewed[::-1][::-1]) == detection
    with pytest.raises(TypeError, match="bool"):
        dymlm.Detection("person", [0, 0, 1, 1], 0.5, mask.astype(np.uint8))
    with pytest.raises(dymlm.Error, match="shape"):
        dymlm.Detection("person", [0, 0, 1], 0.5)
    with pytest.raises(dymlm.Error, match="box"):
        dymlm.Detection("person", [1, 0, 0, 1], 0.5)
    with pytest.raises(dymlm.Error, match="score"):
        dymlm.Detection("person", [0, 0, 1, 1], 1.5)
    builder = dymlm.MapBuilder(frames[0].camera)
    small = dymlm.Detection("person", [0, 0, 9, 9], 0.5, np.ones((9, 9), bool))
    with pytest.raises(dymlm.Error, match="mask"):
        builder.insert(0.0, frames[0].depth, world_from_camera=np.eye(4), detections=[small])


def test_configs(frames, tmp_path):
    config = dymlm.Config("robot", history="memory", cloud={"voxel_size": 0.03}, sensor={"max_depth": 3})
    assert config.to_dict()["cloud"]["voxel_size"] == 0.03
    assert dymlm.Config.from_toml(config.to_toml()) == config
    (tmp_path / "config.toml").write_text(config.to_toml())
    assert dymlm.Config.from_toml(tmp_path / "config.toml") == config
    assert dymlm.Config.from_toml(str(tmp_path / "config.toml")) == config
    assert dymlm.Config() == dymlm.Config("default") != config
    with pytest.raises(dymlm.Error, match="voxel_sise"):
        dymlm.Config(cloud={"voxel_sise": 0.03})
    with pytest.raises(dymlm.Error, match="preset"):
        dymlm.Config("robots")
    with pytest.raises(dymlm.Error, match="cloud.voxel_size = -1 is outside its range 0.001..=1"):
        dymlm.MapBuilder(frames[0].camera, dymlm.Config(cloud={"voxel_size": -1.0}))
    with pytest.raises(dymlm.FileError, match=r"missing\.toml"):
        dymlm.Config.from_toml(tmp_path / "missing.toml")
    fuse = dymlm.Config(cloud={"fuse_surfaces": np.bool_(False)})
    assert fuse == dymlm.Config(cloud={"fuse_surfaces": False}) != dymlm.Config()
    # Regression: this ended the process.
    endless = {}
    endless["cloud"] = endless
    with pytest.raises(dymlm.ConfigError, match="levels"):
        dymlm.Config(**endless)


def test_numbers_that_are_no_ids(frames):
    builder = inserted(frames[:1], history="memory")
    for id in (-1, 2**64, 2**63):
        for ask in (builder.map().plane, builder.map().object):
            with pytest.raises(KeyError):
                ask(id)
        with pytest.raises(dymlm.UnknownFrame):
            builder.remove(id)
        with pytest.raises(dymlm.UnknownFrame):
            builder.correct_poses({id: np.eye(4)})


def test_questions_in_wrong_shapes(frames):
    map = inserted(frames[:1]).map()
    for ask in (map.octree.states, map.octree.log_odds, map.static_points.nearest, map.octree.nearest_obstacles):
        assert len(ask(np.zeros((0, 3)))[0:1]) <= 1
        with pytest.raises(dymlm.Error, match="shape"):
            ask(np.zeros((2, 4)))
        with pytest.raises(TypeError, match="real numbers"):
            ask(["a", "b", "c"])
    with pytest.raises(dymlm.Error, match="3 origins for 2 directions"):
        map.octree.cast_rays(np.zeros((3, 3)), np.ones((2, 3)))
    with pytest.raises(dymlm.Error, match="stop"):
        map.octree.cast_rays([0, 0, 0], [[1, 0, 0]], unknown="free")
    with pytest.raises(dymlm.Error, match="selection"):
        map.cloud("some")


def test_poses():
    pose = dymlm.Pose([1.0, 2.0, 3.0], [0.0, 0.0, 0.6, 0.8])
    assert dymlm.Pose(np.r_[pose.translation, pose.quaternion]) == pose
    assert np.allclose((pose @ pose.inverse()).matrix, np.eye(4))
    assert np.allclose((pose @ np.asarray(pose)).matrix, np.asarray(pose) @ np.asarray(pose))
    assert np.asarray(pose, dtype=np.float32).dtype == np.float32


def test_places_in_sequences(frames):
    sequence = dymlm.builtin_sequence(frames=3)
    assert sequence[-1].timestamp == sequence[2].timestamp and len(list(sequence)) == 3
    with pytest.raises(IndexError):
        sequence[3]
    with pytest.raises(dymlm.Error, match="walking_xyz"):
        dymlm.builtin_sequence("running")


def test_what_programs_tell_apart_has_a_class_of_its_own(frames, tmp_path):
    frame = frames[0]
    builder = inserted(frames[:2])
    far = dymlm.Frame(frame.camera, 7.0, frame.depth, world_from_camera=[1e9, 0, 0, 0, 0, 0, 1])
    map = builder.map()
    saver = dymlm.MapSaver(tmp_path / "map")
    saver.save(map)
    refusals = [
        (dymlm.ConfigError, lambda: dymlm.MapBuilder(frame.camera, dymlm.Config(cloud={"voxel_size": -1.0}))),
        (dymlm.ConfigError, lambda: dymlm.Config(cloud={"voxel_sice": 0.01})),
        (dymlm.TimeReversed, lambda: builder.insert_frame(frame)),
        (dymlm.OutOfReach, lambda: builder.insert_frame(far)),
        (dymlm.NotPending, lambda: builder.detections_for(0, [])),
        (dymlm.UnknownFrame, lambda: inserted(frames[:1], history="memory").remove(77)),
        (dymlm.UnknownFrame, lambda: inserted(frames[:1], history="memory").remove(77.0)),
        (dymlm.UnknownObject, lambda: builder.track_object(999, frame)),
        (dymlm.NoHistory, lambda: builder.remove(0)),
        (dymlm.NoHistory, lambda: builder.remove(77.0)),
        (dymlm.NoFloor, lambda: map.floor_grid([0.0, 0.0, 50.0], [0.0, 0.0, 1.0])),
        (dymlm.FileError, lambda: dymlm.load(tmp_path / "nowhere")),
        (dymlm.Locked, lambda: dymlm.MapSaver(tmp_path / "map")),
        (dymlm.MergeRefused, lambda: merged_with_another_config(frames)),
    ]
    for refusal, call in refusals:
        with pytest.raises(dymlm.Error) as caught:
            call()
        assert caught.type is refusal, (refusal, caught.type, caught.value)
    assert issubclass(dymlm.Locked, dymlm.FileError) and issubclass(dymlm.RefinementStopped, dymlm.Error)
    assert saver.folder


def merged_with_another_config(frames):
    maps = [inserted(frames[:1], history="memory", cloud={"voxel_size": size}).map() for size in (0.01, 0.02)]
    maps[0].merge(maps[1])
