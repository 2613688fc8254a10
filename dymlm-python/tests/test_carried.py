"""A thing that a hand carries to another place is tracked, and all maps follow."""

import dymlm
import numpy as np
import pytest

# Rendered frames a second; the thing leaves its place after one second and is put down after seven.
RATE = 10
BEFORE = 9
FRAMES = 88


def mapped(sequence):
    builder = dymlm.MapBuilder(sequence.camera, dymlm.Config("offline"))
    for index in range(BEFORE):
        builder.insert_frame(sequence[index])
    return builder


def things(builder, label):
    found = []
    for id in range(40):
        try:
            found.append(builder.map().object(id))
        except KeyError:
            continue
    return [thing for thing in found if thing.label == label]


def test_a_carried_box_comes_to_rest_elsewhere_in_all_maps():
    sequence = dymlm.builtin_sequence("walking_static", frames=FRAMES, people=0, carried="box")
    builder = mapped(sequence)
    (box,) = things(builder, "suitcase")
    tracker = builder.track_object(box.id, sequence[BEFORE - 1])
    assert tracker.object == box.id
    moves, states = [], set()
    for index in range(BEFORE, FRAMES):
        frame = sequence[index]
        update = tracker.track(frame)
        states.add(update.state)
        assert 0.0 <= update.confidence <= 1.0 and np.isfinite(update.world_from_object.matrix).all()
        moved = builder.follow_object(tracker)
        moves += [moved] if moved else []
        builder.insert_frame(frame)
    assert {"at_rest", "tracking"} <= states
    (moved,) = moves
    assert moved.object == box.id and moved.cloud_voxels > 0 and moved.emptied_cells > 0
    way = moved.world_from_object.translation - moved.old_world_from_object.translation
    assert 0.1 < np.linalg.norm(way) < 1.0
    now = builder.map().object(box.id)
    assert np.allclose(now.center - box.center, way, atol=0.05)


def test_what_cannot_be_followed_is_refused():
    sequence = dymlm.builtin_sequence("walking_static", frames=FRAMES, people=0, carried="box")
    builder = mapped(sequence)
    with pytest.raises(dymlm.Error, match="no object 999"):
        builder.track_object(999, sequence[BEFORE - 1])
    (box,) = things(builder, "suitcase")
    tracker = builder.track_object(box.id, sequence[BEFORE - 1])
    with pytest.raises(dymlm.Error, match="tracked no frame"):
        builder.follow_object(tracker)
    with pytest.raises(dymlm.Error, match="no object 999"):
        builder.release_object(999)
    builder.release_object(box.id)
    frame = sequence[BEFORE]
    colorless = dymlm.Frame(frame.camera, frame.timestamp, frame.depth, None, frame.world_from_camera)
    with pytest.raises(dymlm.Error, match="colo"):
        tracker.track(colorless)
    with pytest.raises(dymlm.Error, match="spoon"):
        dymlm.builtin_sequence(carried="spoon")
