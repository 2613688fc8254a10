"""The cost of calling through Python: the built-in sequence, inserted from arrays and as frames.

The time of each call is compared with Rust's own time of the same insertion (`report.stages["total"]`, from
tracking on): the difference is the binding, with its checks of the frame. Also: the rate of small calls, and
which arrays are copied.
"""

import time

import dymlm
import numpy as np

ROUNDS = 3


def insertions(frames, insert):
    calls = rust = 0.0
    for _ in range(ROUNDS):
        builder = dymlm.MapBuilder(frames[0].camera)
        for frame in frames:
            start = time.perf_counter()
            report = insert(builder, frame)
            calls += time.perf_counter() - start
            rust += report.stages["total"]
    number = ROUNDS * len(frames)
    print(f"  {1e3 * calls / number:.2f} ms a call, {1e3 * rust / number:.2f} ms of it in Rust's steps: +{calls / rust - 1:.2%}")


def a_second(what, call, number=20_000):
    start = time.perf_counter()
    for _ in range(number):
        call()
    print(f"  {what}: {number / (time.perf_counter() - start):,.0f} a second")


def main():
    sequence = dymlm.builtin_sequence(every=3)
    frames = [sequence[index] for index in range(len(sequence))]
    arrays = {
        frame.timestamp: (frame.depth, frame.color, frame.detections, np.asarray(frame.world_from_camera))
        for frame in frames
    }
    stored = {time: np.round(depth * 1000.0).astype(np.uint16) for time, (depth, *_) in arrays.items()}

    def from_arrays(builder, frame):
        depth, color, found, pose = arrays[frame.timestamp]
        return builder.insert(frame.timestamp, depth, color, world_from_camera=pose, detections=found)

    def from_millimetres(builder, frame):
        _, color, found, pose = arrays[frame.timestamp]
        depth = stored[frame.timestamp]
        return builder.insert(frame.timestamp, depth, color, world_from_camera=pose, detections=found)

    print("insert_frame"), insertions(frames, lambda builder, frame: builder.insert_frame(frame))
    print("insert, float32 and colour"), insertions(frames, from_arrays)
    print("insert, uint16 and colour"), insertions(frames, from_millimetres)

    builder = dymlm.MapBuilder(sequence.camera)
    for frame in frames:
        builder.insert_frame(frame)
    map = builder.map()
    points = np.random.default_rng(0).uniform(-2.0, 2.0, (1_000_000, 3))
    print("calls")
    a_second("builder.map()", builder.map, 2_000)
    a_second("map.octree.states of one point", lambda: map.octree.states([0.0, 0.0, 1.0]))
    start = time.perf_counter()
    map.octree.states(points)
    print(f"  map.octree.states of a million points: {1e3 * (time.perf_counter() - start):.0f} ms")
    cloud = map.cloud()
    start = time.perf_counter()
    cloud = map.cloud()
    print(f"  map.cloud(), {len(cloud)} points: {1e3 * (time.perf_counter() - start):.1f} ms")
    owner = cloud.positions.base
    print(f"  its positions are a view of {type(owner).__name__}, which owns nothing: {not owner.flags.owndata}")


if __name__ == "__main__":
    main()
