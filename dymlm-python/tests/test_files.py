"""Recordings in folders, maps that are saved repeatedly, and maps of a recording compared with Rust's."""

import json
import os
import shutil
import struct
import zlib
from pathlib import Path

import dymlm
import numpy as np
import pytest
from conftest import inserted, same


def write_png(path, image):
    """Writes a PNG of 16 bits grey or 8 bits colour by hand, so that none of our code is used."""
    height, width = image.shape[:2]
    bits, kind = (16, 0) if image.dtype == np.uint16 else (8, 2)
    rows = image.astype(">u2" if bits == 16 else np.uint8).reshape(height, -1)
    lines = b"".join(b"\0" + row.tobytes() for row in rows)

    def chunk(name, body):
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    header = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    parts = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + parts)


@pytest.fixture(scope="module")
def recording(frames, tmp_path_factory):
    """Writes the frames as a folder in the TUM RGB-D format."""
    folder = tmp_path_factory.mktemp("recording")
    lists = {name: ["# timestamp ..."] for name in ("rgb.txt", "depth.txt", "groundtruth.txt")}
    for name in ("rgb", "depth"):
        (folder / name).mkdir()
    found = []
    for number, frame in enumerate(frames):
        time, image = f"{frame.timestamp:.6f}", f"{number:06d}.png"
        write_png(folder / "rgb" / image, frame.color)
        depth = np.nan_to_num(frame.depth * 5000.0).round().astype(np.uint16)
        write_png(folder / "depth" / image, depth)
        pose = frame.world_from_camera
        numbers = " ".join(repr(float(c)) for c in (*pose.translation, *pose.quaternion))
        for name, what in [("rgb.txt", f"rgb/{image}"), ("depth.txt", f"depth/{image}"), ("groundtruth.txt", numbers)]:
            lists[name].append(f"{time} {what}")
        things = [dict(label=one.label, score=one.score, bbox=list(one.box)) for one in frame.detections]
        found.append(json.dumps(dict(timestamp=float(time), detections=things)))
    for name, lines in lists.items():
        (folder / name).write_text("\n".join(lines) + "\n")
    (folder / "detections.jsonl").write_text("\n".join(found) + "\n")
    camera = frames[0].camera
    names = ("width", "height", "fx", "fy", "cx", "cy")
    (folder / "camera.json").write_text(json.dumps({n: getattr(camera, n) for n in names} | {"depth_scale": 5000.0}))
    return folder


def test_folders_are_read(recording, frames):
    dataset = dymlm.Dataset(recording)
    assert dataset.camera == frames[0].camera and len(dataset) == len(frames)
    # Two poses a second are few for a recording, so the dataset warns.
    assert all(words.startswith("no poses between") for words in dataset.warnings)
    assert np.allclose(dataset.timestamps, [frame.timestamp for frame in frames], atol=1e-6)
    for read, frame in zip(dataset, frames, strict=True):
        depth = np.nan_to_num(frame.depth)
        assert np.array_equal(read.depth > 0.0, depth > 0.0) and np.abs(read.depth - depth).max() < 2e-4
        assert np.array_equal(read.color, frame.color)
        assert np.allclose(read.world_from_camera.matrix, frame.world_from_camera.matrix, atol=1e-9)
        assert [one.label for one in read.detections] == [one.label for one in frame.detections]
    assert dataset[-1].timestamp == dataset[len(frames) - 1].timestamp
    with pytest.raises(IndexError):
        dataset[len(frames)]
    every = dymlm.Dataset(recording, every=5)
    assert len(every) == -(-len(frames) // 5)
    builder = dymlm.MapBuilder(dataset.camera)
    for frame in dataset:
        builder.insert_frame(frame)
    map = builder.finish()
    assert len(map.cloud()) > 10_000 and len(map.planes) >= 5 and "tv" in {thing.label for thing in map.objects}


def test_other_trajectories_and_detections(recording, frames, tmp_path):
    lines = (recording / "groundtruth.txt").read_text().splitlines()
    other = tmp_path / "other.txt"
    other.write_text("\n".join(line.replace(line.split()[1], "7.5", 1) if line[0] != "#" else line for line in lines))
    (tmp_path / "none.jsonl").write_text(json.dumps(dict(timestamp=frames[0].timestamp, detections=[])) + "\n")
    dataset = dymlm.Dataset(recording, trajectory=other, detections=tmp_path / "none.jsonl")
    first = dataset[0]
    assert first.world_from_camera.translation[0] == 7.5 and first.detections == []
    assert dataset[1].detections is None


def test_damaged_frames_are_left_out_and_said(recording, frames, tmp_path):
    import shutil

    damaged = tmp_path / "damaged"
    shutil.copytree(recording, damaged)
    (damaged / "depth" / "000001.png").write_bytes(b"no image")
    dataset = dymlm.Dataset(damaged)
    with pytest.warns(UserWarning, match=r"frame 1 skipped: .*000001\.png"):
        assert len(list(dataset)) == len(frames) - 1
    with pytest.raises(dymlm.Error, match="000001.png"):
        dataset[1]
    with pytest.raises(dymlm.Error, match="nowhere"):
        dymlm.Dataset(tmp_path / "nowhere")
    (damaged / "camera.json").write_text("{}")
    with pytest.raises(dymlm.Error, match="camera.json"):
        dymlm.Dataset(damaged)


def test_what_is_saved_again_is_what_has_changed(frames, tmp_path):
    folder = tmp_path / "map"
    builder = inserted(frames[:6], history="memory")
    saver = dymlm.MapSaver(folder)
    saver.save(builder.map())
    assert saver.folder == folder
    with pytest.raises(dymlm.Error, match="map"):
        dymlm.MapSaver(folder)
    for frame in frames[6:]:
        builder.insert_frame(frame)
        saver.save(builder.map())
        assert same(dymlm.load(folder), builder.map())
    del saver
    resumed, map = dymlm.MapSaver.load(folder)
    assert same(map, builder.map())
    further = dymlm.MapBuilder.resume(map, frames[0].camera)
    further.insert_frame(frames[0])
    resumed.save(further.map())
    assert len(dymlm.load(folder).sessions) == 2
    with pytest.raises(dymlm.Error, match="nowhere"):
        dymlm.MapSaver.load(tmp_path / "nowhere")


def test_a_map_without_the_folder_of_its_history_can_be_looked_at(frames, tmp_path):
    history = tmp_path / "history"
    history.mkdir()
    map = inserted(frames[:2], history={"folder": str(history)}).finish()
    map.save(tmp_path / "map")
    shutil.rmtree(history)
    with pytest.raises(dymlm.FileError, match="history"):
        dymlm.load(tmp_path / "map")
    assert same(dymlm.load(tmp_path / "map", history="none"), map)
    saver, loaded = dymlm.MapSaver.load(tmp_path / "map", history="none")
    assert same(loaded, map)
    with pytest.raises(dymlm.ConfigError, match="history"):
        dymlm.load(tmp_path / "map", history="disk")


def test_a_map_goes_on_where_the_folder_of_its_budget_is_not(frames, tmp_path):
    robot = tmp_path / "robot"
    robot.mkdir()
    inserted(frames[:2], memory={"budget": 0, "path": str(robot)}).finish().save(tmp_path / "map")
    shutil.rmtree(robot)
    with pytest.raises(dymlm.Error, match="robot"):
        dymlm.MapBuilder.resume(dymlm.load(tmp_path / "map"), frames[0].camera)
    map = dymlm.load(tmp_path / "map", memory={})
    assert dymlm.MapBuilder.resume(map, frames[0].camera).config.to_dict().get("memory", {}) == {}
    with pytest.raises(dymlm.ConfigError, match="memory"):
        dymlm.load(tmp_path / "map", memory={"budget": "much"})


def test_a_saver_that_is_closed_lets_others_write(frames, tmp_path):
    map = inserted(frames[:1]).map()
    with dymlm.MapSaver(tmp_path / "map") as saver:
        saver.save(map)
        with pytest.raises(dymlm.Locked):
            dymlm.MapSaver(tmp_path / "map")
    with pytest.raises(dymlm.Error, match="closed"):
        saver.save(map)
    saver.close()
    dymlm.MapSaver(tmp_path / "map").save(map)


def test_the_kitchen_is_mapped_as_by_rust(tmp_path):
    """DYMLM_RUST_KITCHEN names the folder of the map that build_map made of the kitchen with people, every 4th frame."""
    data = Path(os.environ.get("DYMLM_DATA", Path(__file__).parents[3] / "shared" / "data")) / "kitchen_people"
    if "DYMLM_RUST_KITCHEN" not in os.environ or not data.exists():
        pytest.skip("DYMLM_RUST_KITCHEN names no folder of build_map, or there is no kitchen")
    dataset = dymlm.Dataset(data, every=4)
    builder = dymlm.MapBuilder(dataset.camera)
    for frame in dataset:
        builder.insert_frame(frame)
    builder.finish().save(tmp_path / "map")
    rust = Path(os.environ["DYMLM_RUST_KITCHEN"])
    for name in ["cloud.ply", "octree.bt", "octree.ot", "planes.json", "planes.ply", "objects.json"]:
        assert (tmp_path / "map" / name).read_bytes() == (rust / name).read_bytes(), name
