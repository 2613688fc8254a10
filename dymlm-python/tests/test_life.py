"""Corrections, sessions, files, merging, threads."""

import threading
import time

import dymlm
import numpy as np
import pytest
from conftest import inserted, same


def shifted(frames, seconds):
    return [
        dymlm.Frame(f.camera, f.timestamp + seconds, f.depth, f.color, f.world_from_camera, f.detections) for f in frames
    ]


def test_saved_maps_are_loaded_to_the_bit_and_go_on(frames, tmp_path):
    map = inserted(frames[:6], history="memory").map()
    map.save(tmp_path / "map")
    loaded = dymlm.load(tmp_path / "map")
    assert same(loaded, map) and loaded.config == map.config
    builders = [dymlm.MapBuilder.resume(m, frames[0].camera) for m in (map, loaded)]
    for frame in frames[6:]:
        reports = [builder.insert_frame(frame) for builder in builders]
        assert reports[0].id == reports[1].id
    assert same(*(builder.finish() for builder in builders))
    with pytest.raises(dymlm.Error, match="nowhere"):
        dymlm.load(tmp_path / "nowhere")


def test_corrected_maps_are_those_of_the_right_poses(frames):
    builder = inserted(frames, history="memory")
    right = builder.map()
    drift = dymlm.Pose([0.03, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
    report = builder.correct_poses({5: np.asarray(drift @ frames[5].world_from_camera)})
    assert report.key_frames == len(frames) and report.largest_motion >= 0.03
    assert not same(builder.map(), right)
    by_id = {place: frame.world_from_camera for place, frame in enumerate(frames) if place < 3}
    by_time = {np.float64(frame.timestamp): frame.world_from_camera for frame in frames[3:]}
    assert builder.correct_poses(by_time).moved_key_frames > 0
    builder.correct_poses(by_id)
    assert [pose for _, _, pose in builder.trajectory()] == [frame.world_from_camera for frame in frames]
    assert same(builder.map(), right)
    wrong = builder
    with pytest.raises(dymlm.Error, match="no frame was inserted at 99"):
        wrong.correct_poses({99.0: dymlm.Pose.identity()})
    with pytest.raises(dymlm.Error, match="one key"):
        wrong.correct_poses({0: dymlm.Pose.identity(), 0.5: dymlm.Pose.identity()})
    with pytest.raises(dymlm.Error, match="never inserted"):
        wrong.correct_poses({999: dymlm.Pose.identity()})
    with pytest.raises(dymlm.Error, match="history"):
        inserted(frames[:1]).correct_poses({0: dymlm.Pose.identity()})


def test_removed_moved_and_refined(frames):
    builder = inserted(frames, history="memory")
    before = builder.map().cloud("all").positions
    builder.transform([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    moved = builder.map().cloud("all").positions
    assert np.allclose(moved.mean(axis=0) - before.mean(axis=0), [1.0, 0.0, 0.0], atol=0.02)
    assert builder.remove(0).key_frames == len(frames) - 1
    assert builder.refine_poses(rounds=1).views > 0
    with pytest.raises(dymlm.Error, match="refine.rounds"):
        builder.refine_poses(rounds=99)
    with pytest.raises(dymlm.Error, match="speed"):
        builder.refine_poses(speed=1.0)


def test_merging_is_commutative(frames):
    later = shifted(frames[5:], 100.0)
    first, second = (inserted(part, history="memory").map() for part in (frames[:5], later))
    octree, points = first.octree, len(first.cloud("all"))
    leaves = len(octree.occupied())
    other_way = inserted(later, history="memory").map()
    other_way.merge(first)
    report = first.merge(second)
    assert len(report.sessions) == len(first.sessions) == 2 and report.key_frames == len(frames)
    assert same(first, other_way)
    assert len(first.cloud("all")) > points and len(octree.occupied()) == leaves < len(first.octree.occupied())
    with pytest.raises(dymlm.Error, match="configs"):
        first.merge(inserted(frames[:2], history="memory", cloud={"voxel_size": 0.02}).map())


def test_changes_since_rebuild_a_copy(frames):
    builder = inserted(frames[:6])
    earlier = builder.map()
    for frame in frames[6:]:
        builder.insert_frame(frame)
    changes = builder.map().changes_since(earlier)
    assert changes.from_revision == earlier.revision < changes.to_revision == builder.map().revision
    assert changes.cloud and changes.octree.shape[1] == 6
    assert builder.map().changes_since(builder.map()).cloud == []
    assert builder.map().world_changes_since(earlier).moved == []


def test_detections_may_come_late(frames):
    builder = dymlm.MapBuilder(frames[0].camera)
    frame = frames[0]
    args = dict(color=frame.color, world_from_camera=frame.world_from_camera)
    report = builder.insert(frame.timestamp, frame.depth, detections="pending", **args)
    assert report.outcome == "waiting"
    assert builder.detections_for(report.id, frame.detections).outcome == "mapped"
    report = builder.insert(frame.timestamp + 0.1, frame.depth, detections="pending", **args)
    assert [waited.id for waited in builder.process_waiting()] == [report.id]


def test_scans_are_mapped(frames):
    builder = dymlm.MapBuilder(frames[0].camera, dymlm.Config(octree={"max_range": 30.0}, sensor={"max_depth": 30.0}))
    for step in range(3):
        report = builder.insert_scan(0.1 * step, [[9.0, 0.0, 0.5]], dymlm.Pose.identity())
    assert report.outcome == "scanned"
    assert (report.update.hit_cells, report.update.readings) == (1, 1) and report.update.missed_cells > 100
    assert report.update.planes_created == report.update.objects_removed == []
    assert list(builder.map().octree.states([[9.0, 0.0, 0.5], [5.0, 0.0, 0.28]])) == [1, 0]


def test_a_finished_builder_takes_in_no_more(frames):
    builder = inserted(frames[:1])
    builder.finish()
    with pytest.raises(dymlm.Error, match="finished"):
        builder.insert_frame(frames[1])


def test_other_threads_run_while_a_frame_is_inserted(frames):
    """Three threads: one counts, one waits for new maps, one inserts."""
    builder = dymlm.MapBuilder(frames[0].camera, dymlm.Config("offline", publish_interval=0.0))
    reader, seen, ticks, stop = builder.reader(), [], [], threading.Event()

    def count():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.0005)

    def read():
        map = reader.latest()
        while (newer := reader.wait_newer(map, 0.5)) is not None:
            seen.append(len(newer.cloud()))
            map = newer

    threads = [threading.Thread(target=work) for work in (count, read)]
    for thread in threads:
        thread.start()
    within = 0
    for frame in frames:
        start = time.perf_counter()
        builder.insert_frame(frame)
        end = time.perf_counter()
        within += sum(start < tick < end for tick in ticks)
    stop.set()
    for thread in threads:
        thread.join()
    assert within > 3 * len(frames) and len(seen) > 1


def test_threads_may_share_a_builder(frames):
    builder = dymlm.MapBuilder(frames[0].camera)
    errors = []

    def insert(part):
        for frame in part:
            try:
                builder.insert_frame(frame)
            except dymlm.Error as error:
                errors.append(str(error))

    threads = [threading.Thread(target=insert, args=(frames[start::2],)) for start in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all("time" in error for error in errors) and len(builder.map().cloud("all")) > 1000
