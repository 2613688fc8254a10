"""Checks a session with independent readers of MCAP and of ROS 2 messages, from PyPI.

    build_map --out MAP --mcap SESSION.mcap
    pip install pytest numpy mcap mcap-ros2-support
    DYMLM_SESSION=SESSION.mcap DYMLM_RUST_MAP=MAP python -m pytest test_session.py

MAP is the map folder of the same run: the session's messages must add up to its content.
"""

import io
import json
import os
import struct
import zlib
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory

SESSION = os.environ.get("DYMLM_SESSION")
MAP = os.environ.get("DYMLM_RUST_MAP")
pytestmark = pytest.mark.skipif(not SESSION or not MAP, reason="DYMLM_SESSION and DYMLM_RUST_MAP name no files")


@pytest.fixture(scope="module")
def messages():
    """All messages, decoded, by topic."""
    found = defaultdict(list)
    with open(SESSION, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            found[channel.topic].append((message.log_time, schema.name, decoded))
    return found


def last(messages, topic):
    return messages[topic][-1][2]


def ply(path):
    """Points and colours of a PLY file as dymlm writes it."""
    data = Path(path).read_bytes()
    head, body = data.split(b"end_header\n", 1)
    count = int(head.split(b"element vertex ")[1].split()[0])
    kind = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])
    points = np.frombuffer(body, kind, count)
    return points["xyz"], points["rgb"]


def points_of(cloud):
    """The points of a PointCloud2 by its own fields."""
    names = {field.name: field.offset for field in cloud.fields}
    assert cloud.width * cloud.height * cloud.point_step == len(cloud.data)
    kind = np.dtype({"names": list(names), "offsets": list(names.values()), "itemsize": cloud.point_step,
                     "formats": ["<f4" if field.datatype == 7 else "<u4" for field in cloud.fields]})
    return np.frombuffer(bytes(cloud.data), kind)


def in_order(points, colors):
    table = np.concatenate([np.stack([points[:, axis] for axis in range(3)], 1).view("<u4"), colors.astype("<u4")], 1)
    return table[np.lexsort(table.T)]


def test_the_summary_says_what_is_in_the_file(messages):
    with open(SESSION, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary, header = reader.get_summary(), reader.get_header()
    assert header.profile == "ros2" and header.library.startswith("dymlm-io")
    counts = {summary.channels[id].topic: count for id, count in summary.statistics.channel_message_counts.items()}
    assert counts == {topic: len(found) for topic, found in messages.items()}
    assert summary.statistics.message_count == sum(counts.values())
    assert summary.statistics.chunk_count == len(summary.chunk_indexes)
    times = [time for found in messages.values() for time, _, _ in found]
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (min(times), max(times))
    assert {index.compression for index in summary.chunk_indexes} <= {"lz4", ""}
    assert all(channel.message_encoding == "cdr" for channel in summary.channels.values())
    # The checksum of all data, which readers do not check.
    data = Path(SESSION).read_bytes()
    footer = struct.unpack("<QQI", data[-28:-8])
    end = footer[0] - 13
    assert data[end] == 0x0F and struct.unpack("<I", data[end + 9:end + 13])[0] == zlib.crc32(data[:end])


def test_a_reader_without_the_summary_finds_the_same(messages):
    with open(SESSION, "rb") as file:
        records = Counter(type(record).__name__ for record in StreamReader(file, validate_crcs=True).records)
    assert records["Message"] == sum(len(found) for found in messages.values())


def test_frames_have_images_cameras_and_transforms(messages):
    times = [time for time, _, _ in messages["/tf"]]
    assert len(times) > 10 and times == sorted(times)
    for topic, kind in [("/camera/color/image_raw/compressed", "sensor_msgs/msg/CompressedImage"),
                        ("/camera/color/camera_info", "sensor_msgs/msg/CameraInfo"),
                        ("/camera/depth/image_raw", "sensor_msgs/msg/Image"),
                        ("/detections", "vision_msgs/msg/Detection2DArray")]:
        assert [time for time, _, _ in messages[topic]] == times, topic
        assert {name for _, name, _ in messages[topic]} == {kind}
        assert {message.header.frame_id for _, _, message in messages[topic]} == {"camera"}
    for time, _, message in messages["/tf"]:
        [transform] = message.transforms
        assert (transform.header.frame_id, transform.child_frame_id) == ("map", "camera")
        stamp, q = transform.header.stamp, transform.transform.rotation
        assert stamp.sec * 10**9 + stamp.nanosec == time
        assert abs(q.x**2 + q.y**2 + q.z**2 + q.w**2 - 1) < 1e-9
    depth, info = last(messages, "/camera/depth/image_raw"), last(messages, "/camera/color/camera_info")
    assert (depth.width, depth.height) == (info.width, info.height) and depth.encoding == "16UC1"
    millimetres = np.frombuffer(bytes(depth.data), "<u2").reshape(depth.height, depth.width)
    assert 500 < np.median(millimetres[millimetres > 0]) < 10000
    assert info.k[0] > 0 and list(info.k[6:]) == [0, 0, 1] and list(info.p[:3]) == list(info.k[:3])
    color = bytes(last(messages, "/camera/color/image_raw/compressed").data)
    assert color.startswith(b"\xff\xd8") and color.endswith(b"\xff\xd9")
    found = [one for _, _, message in messages["/detections"] for one in message.detections]
    assert {"person"} <= {one.results[0].hypothesis.class_id for one in found}
    assert all(one.bbox.size_x > 0 and 0 < one.results[0].hypothesis.score <= 1 for one in found)


def test_the_last_clouds_are_the_cloud(messages):
    tiles = [topic for topic in messages if topic.startswith("/map/cloud/")]
    assert 1 <= len(tiles) <= 128
    clouds = [points_of(last(messages, topic)) for topic in tiles if last(messages, topic).width]
    points = np.concatenate(clouds)
    xyz = np.stack([points[axis] for axis in "xyz"], 1)
    # `rgb` is a float whose bits are the colour.
    rgb = points["rgb"].view("<u4")
    rgb = np.stack([rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255], 1)
    colors = points["colors"]
    assert np.array_equal(np.stack([colors >> 24, colors >> 16 & 255, colors >> 8 & 255], 1), rgb)
    assert (colors & 255 == 255).all()
    assert np.array_equal(in_order(xyz, rgb), in_order(*ply(f"{MAP}/cloud.ply")))
    # The cloud was written several times while it grew.
    assert len({time for topic in tiles for time, _, _ in messages[topic]}) > 2


def scene(messages, topic):
    """What a viewer draws after all updates."""
    drawn = {}
    for _, name, update in messages[topic]:
        assert name == "foxglove_msgs/msg/SceneUpdate"
        for deletion in update.deletions:
            assert deletion.type == 0
            drawn.pop(deletion.id, None)
        drawn.update({entity.id: entity for entity in update.entities})
    return drawn


def test_the_scene_has_the_planes(messages):
    planes = {str(plane["id"]): plane for plane in json.loads(Path(f"{MAP}/planes.json").read_text())["planes"]}
    drawn = scene(messages, "/map/planes")
    assert drawn.keys() == planes.keys() and len(planes) > 2
    for id, entity in drawn.items():
        [faces] = entity.triangles
        corners = np.array([[p.x, p.y, p.z] for p in faces.points])
        normal, rings = np.array(planes[id]["normal"]), planes[id]["boundary"]
        triangles = corners[np.array(faces.indices).reshape(-1, 3)]
        crosses = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) @ normal
        area = 0.0
        for ring in map(np.array, rings):
            around = ring - ring[0]
            area += 0.5 * np.cross(around[:-1], around[1:]).sum(0) @ normal
        # Simplified rings may cross each other's corners.
        assert abs(0.5 * crosses.sum() - area) < 0.02 * area + 1e-3, id
        assert np.abs(corners @ normal + planes[id]["d"]).max() < 1e-6
        assert len(entity.lines) == len(rings) and 0 < faces.color.a < 1 and entity.frame_id == "map"


def test_the_scene_has_the_objects_with_labels(messages):
    objects = {str(one["id"]): one for one in json.loads(Path(f"{MAP}/objects.json").read_text())["objects"]}
    drawn = scene(messages, "/map/objects")
    assert drawn.keys() == objects.keys() and objects
    for id, entity in drawn.items():
        known = objects[id]
        [solid] = entity.spheres if known["shape"] == "ellipsoid" else entity.cubes
        assert [solid.size.x, solid.size.y, solid.size.z] == known["dimensions"]
        place = solid.pose.position
        assert [place.x, place.y, place.z] == known["translation"]
        [text] = entity.texts
        assert text.text == known["label"] and text.billboard
        # The label is above the object: up is opposite to the rows of the images.
        assert text.pose.position.z > place.z + 0.04


def test_outlines_lie_on_planes_and_objects(messages):
    tiles = [topic for topic in messages if topic.startswith("/map/outlines/")]
    assert 1 <= len(tiles) <= 128
    outlines = np.concatenate([points_of(last(messages, topic)) for topic in tiles if last(messages, topic).width])
    assert len(outlines) > 1000 and len(set(outlines["colors"].tolist())) > 3


def test_the_grid_is_of_the_rooms_size(messages):
    grid = last(messages, "/map/grid")
    cells = np.array(grid.data, np.int8).reshape(grid.info.height, grid.info.width)
    assert set(np.unique(cells)) == {-1, 0, 100}
    assert 2 < grid.info.width * grid.info.resolution < 50
    assert (cells == 0).sum() > 100 and (cells == 100).sum() > 50


def test_half_a_file_can_be_read(tmp_path):
    data = Path(SESSION).read_bytes()
    part = io.BytesIO(data[: len(data) // 2])
    count = 0
    with pytest.raises(Exception):
        for record in StreamReader(part, validate_crcs=True).records:
            count += type(record).__name__ == "Message"
    assert count > 20
