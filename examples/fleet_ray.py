"""Maps recordings in parallel with Ray and merges their maps: the same bits as one process in sequence.

    pip install ray ./dymlm-python
    python examples/fleet_ray.py robot_1/monday robot_2/monday --workers 2 --out fleet
    python examples/fleet_ray.py --sim 4 --workers 2 --out fleet --kill-one
    python examples/fleet_ray.py --sim 4 --in-sequence --out alone

A recording is a TUM RGB-D folder; all recordings are in one world. `--sim N` takes N recordings of the
simulator instead, in one office with different camera paths. One task maps each recording and saves its map
as a folder; further tasks merge each map into that of all recordings before it, as soon as both are there,
up to one map in OUT/map, which replaces an earlier map there. A merge maps key frames again in the order of their times, so that the result is
what one builder would have made of both maps, and a lost and repeated task changes no bit. The folders
must be on a file system that all machines share; `ray.init(address=...)` joins a cluster (`--address`). The
last line is a report in JSON, with a checksum of the files of the map.
"""

import argparse
import hashlib
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

import dymlm

# Sequences of the simulator: people and camera paths in one office.
WAYS = [f"{people}_{way}" for people in ("walking", "sitting") for way in ("xyz", "halfsphere", "rpy", "static")]
# Time from the start of one recording to the next, seconds: maps merge fastest in the order of their times.
BETWEEN_STARTS = 1000.0
# Standard files of a map folder; its other files hold the state for continuing the map.
FILES = ["cloud.ply", "octree.bt", "octree.ot", "planes.json", "planes.ply", "objects.json"]
# Retries of a task whose worker died.
RETRIES = 5


class Simulated:
    """A recording of the simulator with its own start time."""

    def __init__(self, number, frames):
        self.camera = dymlm.Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
        self.start = BETWEEN_STARTS * number
        self.sequence = dymlm.builtin_sequence(
            WAYS[number % len(WAYS)], frames=3 * frames, every=3, seed=number, camera=self.camera
        )

    def __len__(self):
        return len(self.sequence)

    def __iter__(self):
        for index in range(len(self.sequence)):
            frame = self.sequence[index]
            yield dymlm.Frame(
                frame.camera,
                self.start + frame.timestamp,
                frame.depth,
                frame.color,
                frame.world_from_camera,
                frame.detections,
            )


def opened(source):
    """The frames of a recording, given as a folder, or as the number and length of a simulated one."""
    return Simulated(*source) if isinstance(source, tuple) else dymlm.Dataset(source)


def map_recording(source, folder, watch=lambda share: None):
    """Maps a recording and saves the map; `watch` is called with the share that is done. Returns the cost."""
    start = clocks()
    frames = opened(source)
    builder = dymlm.MapBuilder(frames.camera, dymlm.Config(history="memory"))
    skipped = 0
    for number, frame in enumerate(frames):
        watch(number / len(frames))
        try:
            builder.insert_frame(frame)
        except dymlm.Error as error:
            # As when a frame cannot be read: one frame is not worth all that the others have seen.
            print(f"warning: {source}: frame {number} skipped: {error}", file=sys.stderr)
            skipped += 1
    if skipped == len(frames):
        raise RuntimeError(f"{source}: no frame could be mapped")
    builder.finish().save(folder)
    return spent(start) | {"frames": len(frames) - skipped, "skipped": skipped}


def join(first, second, folder):
    """Merges two saved maps and saves the result. Returns the cost."""
    start = clocks()
    map = dymlm.load(first)
    report = map.merge(dymlm.load(second))
    map.save(folder)
    return spent(start) | {"mapped_again": report.mapped_again}


def clocks():
    return time.perf_counter(), time.process_time()


def spent(start):
    """The cost since `start`: seconds, processor seconds (stable on a busy machine), and the peak memory so far."""
    seconds, busy = (now - then for now, then in zip(clocks(), start, strict=True))
    return {"seconds": seconds, "busy": busy, "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0}


def is_map(folder):
    """Whether a folder holds a map, of this or any other version: its manifest says so."""
    try:
        return json.loads((folder / "manifest.json").read_bytes()).get("format") == "dymlm map"
    except (OSError, ValueError, AttributeError):
        return False


def refusal(folder, recordings):
    """Why the result must not take the place of what is in `folder`; None if it may."""
    if os.path.lexists(folder) and not is_map(folder):
        return f"{folder}: not a map, so it is not replaced"
    for recording in recordings:
        if Path(recording).is_relative_to(folder.resolve()):
            return f"{recording}: a recording in the folder of the result, which is replaced"
    return None


def put_in_place(whole, folder, aside):
    """Moves the result to its place. When that fails, an earlier map is put back, and both stay."""
    replaces = is_map(folder)
    if replaces:
        folder.rename(aside)
    try:
        whole.rename(folder)
    except OSError as error:
        if replaces:
            aside.rename(folder)
        sys.exit(f"error: {error}; the new map is in {whole}")


def checksum(folder):
    sum = hashlib.sha256()
    for name in FILES:
        sum.update((Path(folder) / name).read_bytes())
    return sum.hexdigest()


def in_sequence(sources, work):
    """Maps and merges everything in this process, one after the other."""
    folders = [str(work / f"recording_{number}") for number in range(len(sources))]
    mapped = [map_recording(*pair) for pair in zip(sources, folders, strict=True)]
    start, joins = time.perf_counter(), []
    whole = folders[0]
    for number, folder in enumerate(folders[1:]):
        joined = str(work / f"joined_{number}")
        joins.append(join(whole, folder, joined))
        whole = joined
    return whole, mapped, joins, time.perf_counter() - start


class Victim:
    """A file in which the task to be killed writes its process id, once; its second try finds it and goes on."""

    def __init__(self, work):
        self.file = work / "victim"

    def wait_for_death(self):
        """In the task: in the middle of its recording, it writes its process id and waits to be killed."""
        if not self.file.exists():
            write_whole(self.file, str(os.getpid()))
            time.sleep(120.0)
            raise RuntimeError("nobody has killed this worker")

    def kill(self):
        """In the driver: waits for the process id and kills that process."""
        while not self.file.exists():
            time.sleep(0.01)
        worker = int(self.file.read_text())
        os.kill(worker, signal.SIGKILL)
        print(f"worker {worker} was killed in the middle of a recording", file=sys.stderr)


def write_whole(file, text):
    part = file.with_suffix(".part")
    part.write_text(text)
    part.rename(file)


def by_ray(sources, work, workers, address, kill_one):
    """Ray's tasks: the recordings side by side; each map is merged as soon as all those before it are.

    In this order a merge maps only the newer recording again, and merges run beside the mapping of later recordings. A
    balanced tree of merges would map each recording again at every second level or so (for 40 recordings 106 times in
    all, instead of 39), and its last merge alone maps half of them while all other workers wait.
    """
    import ray

    # Tasks pass maps on as folders: the object store holds only their names.
    local = dict(num_cpus=workers, include_dashboard=False, object_store_memory=100 * 1024 * 1024)
    ray.init(address=address, log_to_driver=False, **({} if address else local))
    try:

        @ray.remote(num_cpus=1, max_retries=RETRIES)
        def map_task(source, folder, victim):
            def watch(share):
                if victim and share >= 0.5:
                    victim.wait_for_death()

            return folder, map_recording(source, folder, watch)

        @ray.remote(num_cpus=1, max_retries=RETRIES)
        def join_task(first, second, folder):
            return folder, join(first[0], second[0], folder)

        # The workers are started before the clock.
        slots = int(ray.cluster_resources()["CPU"])
        ray.get([ray.remote(num_cpus=1)(lambda: time.sleep(0.2)).remote() for _ in range(slots)])
        start = time.perf_counter()
        victim = Victim(work) if kill_one else None
        maps, joins, running, ended = [], [], set(), set()
        # The map of all recordings before `number`.
        whole, number, mapping = None, 0, 0.0
        while number < len(sources) or running:
            if number < len(maps) and {maps[number], whole or maps[number]} <= ended:
                if whole is None:
                    whole = maps[0]
                else:
                    whole = join_task.remote(whole, maps[number], str(work / f"joined_{number}"))
                    joins.append(whole)
                    running.add(whole)
                number += 1
            # No more tasks than workers: a merge that is due does not queue behind recordings that can wait.
            elif len(maps) < len(sources) and len(running) < slots:
                folder = str(work / f"recording_{len(maps)}")
                maps.append(map_task.remote(sources[len(maps)], folder, None if maps else victim))
                running.add(maps[-1])
            else:
                if victim:
                    victim.kill()
                    victim = None
                ready, _ = ray.wait(list(running))
                running.difference_update(ready)
                ended.update(ready)
                if running.isdisjoint(maps) and len(maps) == len(sources) and not mapping:
                    mapping = time.perf_counter() - start
        mapped, joined = ([report for _, report in ray.get(tasks)] for tasks in (maps, joins))
        return ray.get(whole)[0], mapped, joined, time.perf_counter() - start - mapping
    finally:
        ray.shutdown()


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("recordings", nargs="*", type=Path, help="TUM RGB-D folders, in the order of their times")
    parser.add_argument("--sim", type=int, metavar="N", help="this many recordings of the simulator instead")
    parser.add_argument("--frames", type=int, default=30, help="number of frames in each recording of the simulator")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--address", help="address of a running Ray cluster")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results; the map is in OUT/map")
    parser.add_argument("--kill-one", action="store_true", help="kill -9 a worker in the middle of a recording")
    parser.add_argument("--in-sequence", action="store_true", help="one process, without Ray")
    given = parser.parse_args()
    if bool(given.sim) == bool(given.recordings):
        parser.error("either recordings or --sim N")
    if given.sim is not None and given.sim < 1 or given.frames < 1 or given.workers < 1:
        parser.error("--sim, --frames and --workers are 1 or more")
    if given.kill_one and (given.in_sequence or given.address):
        parser.error("--kill-one kills a worker of this machine's own Ray")
    return given


def main():
    given = arguments()
    recordings = [str(folder.resolve()) for folder in given.recordings]
    sources = recordings or [(number, given.frames) for number in range(given.sim)]
    folder = given.out / "map"
    # What would be lost is noticed before hours of mapping.
    if reason := refusal(folder, recordings):
        sys.exit(f"error: {reason}")
    given.out.mkdir(parents=True, exist_ok=True)
    # A folder of its own beside the result, so that the map is moved there and not copied.
    work = Path(tempfile.mkdtemp(prefix="work-", dir=given.out.resolve()))
    start = time.perf_counter()
    try:
        if given.in_sequence:
            whole, mapped, joins, joining = in_sequence(sources, work)
        else:
            whole, mapped, joins, joining = by_ray(sources, work, given.workers, given.address, given.kill_one)
    except BaseException:
        shutil.rmtree(work, ignore_errors=True)
        raise
    put_in_place(Path(whole), folder, work / "replaced")
    shutil.rmtree(work, ignore_errors=True)
    total = time.perf_counter() - start
    report = {
        "recordings": len(sources),
        "workers": 0 if given.in_sequence else given.workers,
        "frames": sum(one["frames"] for one in mapped),
        "frames_skipped": sum(one["skipped"] for one in mapped),
        "seconds": round(total, 2),
        "seconds_of_maps": [round(one["seconds"], 2) for one in mapped],
        "seconds_of_joins": [round(one["seconds"], 2) for one in joins],
        "processor_seconds_of_maps": [round(one["busy"], 2) for one in mapped],
        "processor_seconds_of_joins": [round(one["busy"], 2) for one in joins],
        "peak_mb_of_joins": [round(one["peak_mb"]) for one in joins],
        "seconds_after_the_maps": round(joining, 2),
        "frames_mapped_again": sum(one["mapped_again"] for one in joins),
        "peak_mb": round(max(one["peak_mb"] for one in mapped + joins), 1),
        "map": str(folder),
        "points": len(dymlm.load(folder).cloud()),
        "checksum": checksum(folder),
    }
    print(json.dumps(report))


if __name__ == "__main__":
    main()
