"""What tasks of other processes are given: values are pickled and copied, without losing a bit."""

import copy
import pickle

import dymlm
import numpy as np
import pytest
from conftest import inserted, same

WAYS = [lambda value: pickle.loads(pickle.dumps(value)), copy.copy, copy.deepcopy]


@pytest.mark.parametrize("again", WAYS)
def test_values_are_the_same_again(frames, again):
    turn = dymlm.Pose([0.1, -2.0, 3.0], [0.5, -0.1, 0.7, 0.5])
    poses = [dymlm.Pose.identity()]
    for _ in range(20):
        poses.append(turn @ poses[-1])
    assert again(poses) == poses
    camera = dymlm.Camera(64, 48, 50.1, -50.2, 31.3, 23.4)
    assert again(camera) == camera
    mask = np.arange(12).reshape(3, 4) % 3 == 0
    detections = [dymlm.Detection("cup", [0.1, 0.2, 3.3, 2.7], 0.3), dymlm.Detection("cup", [0, 0, 4, 3], 0.9, mask)]
    assert again(detections) == detections
    for config in [dymlm.Config(), dymlm.Config("robot", dynamics={"mover_labels": ["person", "cat"]}, history="memory")]:
        assert again(config) == config


def test_frames_make_the_same_maps_again(frames):
    def frame(given, **parts):
        parts = {"color": given.color, "detections": given.detections} | parts
        return dymlm.Frame(given.camera, given.timestamp, given.depth, world_from_camera=given.world_from_camera, **parts)

    own = [frame(given) for given in frames[:4]]
    assert same(inserted(pickle.loads(pickle.dumps(own))).finish(), inserted(own).finish())
    for detections in [None, "pending", []]:
        again = copy.copy(frame(frames[0], color=None, detections=detections))
        assert again.color is None and again.detections == detections
    with pytest.raises(TypeError, match="truth about a simulated frame"):
        pickle.dumps(frames[0])
