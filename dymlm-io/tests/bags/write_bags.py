"""Writes the bags beside this file with two writers that are independent of dymlm.

    python3 -m venv venv && venv/bin/pip install rosbags mcap-ros2-support mcap numpy pillow
    venv/bin/python write_bags.py [FOLDER]

A wall 2 m away, 8x6 pixels; four frames, 0.1 s apart, from time 100. The robot moves 0.1 m per frame along x of
`odom`. The camera's optical frame is rotated against `base`: its z is base's x.
"""

import io
import struct
import sys
import tempfile
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2.writer import Writer as Ros2Writer
from PIL import Image as Picture
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

W, H, FRAMES = 8, 6, 4
store = get_typestore(Stores.ROS2_HUMBLE)
VISION = {
    "vision_msgs/msg/Point2D": "float64 x\nfloat64 y\n",
    "vision_msgs/msg/Pose2D": "vision_msgs/Point2D position\nfloat64 theta\n",
    "vision_msgs/msg/BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score\n",
    "vision_msgs/msg/ObjectHypothesisWithPose": "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n",
    "vision_msgs/msg/Detection2D": "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\nvision_msgs/BoundingBox2D bbox\nstring id\n",
    "vision_msgs/msg/Detection2DArray": "std_msgs/Header header\nvision_msgs/Detection2D[] detections\n",
}
for name, text in VISION.items():
    store.register(get_types_from_msg(text, name))
T = store.types


def stamp(time):
    ns = round(time * 1e9)
    return T["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)


def header(time, frame):
    return T["std_msgs/msg/Header"](stamp=stamp(time), frame_id=frame)


def image(time, frame, encoding, array, order="<"):
    data = np.ascontiguousarray(array)
    raw = np.frombuffer(data.astype(data.dtype.newbyteorder(order)).tobytes(), np.uint8)
    return T["sensor_msgs/msg/Image"](
        header=header(time, frame), height=H, width=W, encoding=encoding, is_bigendian=int(order == ">"),
        step=raw.size // H, data=raw,
    )


def packed(time, frame, kind, data):
    return T["sensor_msgs/msg/CompressedImage"](header=header(time, frame), format=kind, data=np.frombuffer(data, np.uint8))


def png(array):
    out = io.BytesIO()
    Picture.fromarray(array).save(out, "PNG")
    return out.getvalue()


def camera_info(time, frame, model="plumb_bob", d=(0.0,) * 5):
    roi = T["sensor_msgs/msg/RegionOfInterest"](x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    return T["sensor_msgs/msg/CameraInfo"](
        header=header(time, frame), height=H, width=W, distortion_model=model, d=np.array(d, float),
        k=np.array([8.0, 0, 3.5, 0, 8.0, 2.5, 0, 0, 1]), r=np.eye(3).ravel(),
        p=np.array([8.0, 0, 3.5, 0, 0, 8.0, 2.5, 0, 0, 0, 1, 0]), binning_x=0, binning_y=0, roi=roi,
    )


def vector(kind, x, y, z):
    return T[f"geometry_msgs/msg/{kind}"](x=x, y=y, z=z)


def quaternion(x, y, z, w):
    return T["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w)


def tf(*edges):
    make = lambda time, parent, child, t, q: T["geometry_msgs/msg/TransformStamped"](
        header=header(time, parent), child_frame_id=child,
        transform=T["geometry_msgs/msg/Transform"](translation=vector("Vector3", *t), rotation=quaternion(*q)),
    )
    return T["tf2_msgs/msg/TFMessage"](transforms=[make(*edge) for edge in edges])


def odometry(time, x):
    pose = T["geometry_msgs/msg/Pose"](position=vector("Point", x, 0.0, 0.0), orientation=quaternion(0.0, 0.0, 0.0, 1.0))
    twist = T["geometry_msgs/msg/Twist"](linear=vector("Vector3", 0.0, 0.0, 0.0), angular=vector("Vector3", 0.0, 0.0, 0.0))
    return T["nav_msgs/msg/Odometry"](
        header=header(time, "odom"), child_frame_id="base",
        pose=T["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
        twist=T["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36)),
    )


def detections(time, *found):
    def one(label, score, x, y, size_x, size_y):
        pose = T["geometry_msgs/msg/PoseWithCovariance"](
            pose=T["geometry_msgs/msg/Pose"](position=vector("Point", 0.0, 0.0, 0.0), orientation=quaternion(0.0, 0.0, 0.0, 1.0)),
            covariance=np.zeros(36),
        )
        guess = lambda label, score: T["vision_msgs/msg/ObjectHypothesisWithPose"](
            hypothesis=T["vision_msgs/msg/ObjectHypothesis"](class_id=label, score=score), pose=pose)
        center = T["vision_msgs/msg/Pose2D"](position=T["vision_msgs/msg/Point2D"](x=x, y=y), theta=0.0)
        return T["vision_msgs/msg/Detection2D"](
            header=header(time, "optical"), results=[guess("other", 0.1), guess(label, score)],
            bbox=T["vision_msgs/msg/BoundingBox2D"](center=center, size_x=size_x, size_y=size_y), id="",
        )
    return T["vision_msgs/msg/Detection2DArray"](header=header(time, "optical"), detections=[one(*f) for f in found])


OPTICAL = (-0.5, 0.5, -0.5, 0.5)
MOUNT = (0.0, "base", "optical", (0.0, 0.0, 1.0), OPTICAL)
DEPTH = np.full((H, W), 2000, np.uint16)
DEPTH[0, 0] = 0
COLOR = np.zeros((H, W, 3), np.uint8)
COLOR[...] = (200, 100, 50)
TIMES = [100 + 0.1 * i for i in range(FRAMES)]


def moving(time, x):
    return ("/tf", time, tf((time, "odom", "base", (x, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))))


def base_messages():
    """Images in 16UC1 and rgb8; tf has times between the images' times, so that it is interpolated."""
    yield "/tf_static", 100, tf(MOUNT)
    for i in range(-1, FRAMES):
        time = 100 + 0.1 * i + 0.05
        yield moving(time, 0.1 * i + 0.05)
    for time in TIMES:
        yield "/camera/color/camera_info", time, camera_info(time, "optical")
        yield "/camera/aligned_depth_to_color/camera_info", time, camera_info(time, "optical")
        yield "/camera/color/image_raw", time + 0.004, image(time + 0.004, "optical", "rgb8", COLOR)
        yield "/camera/aligned_depth_to_color/image_raw", time, image(time, "optical", "16UC1", DEPTH)
        yield "/detections", time + 0.06, detections(time + 0.004, ("person", 0.75, 4.0, 3.0, 2.0, 4.0))


def other_encodings(color, depth, transforms=None):
    for topic, time, message in base_messages():
        if topic == "/camera/color/image_raw":
            yield color(time)
        elif topic == "/camera/aligned_depth_to_color/image_raw":
            yield depth(time)
        else:
            yield topic, time, message


A, B = 150.0, -50.0
INVERSE = (A / (DEPTH.astype(float) / 1000).clip(0.01) + B).round().astype(np.uint16)
INVERSE[DEPTH == 0] = 0
BAGS = {
    "plain": list(base_messages()),
    "float": list(other_encodings(
        lambda t: ("/camera/color/image_raw", t, image(t, "optical", "bgra8", np.dstack([COLOR[..., ::-1], COLOR[..., :1]]))),
        lambda t: ("/camera/depth/image_raw", t, image(t, "optical", "32FC1", np.where(DEPTH == 0, np.nan, 2.0).astype(np.float32), ">")),
    )),
    "packed": list(other_encodings(
        lambda t: ("/camera/color/image_raw/compressed", t, packed(t, "optical", "rgb8; png compressed bgr8", png(COLOR))),
        lambda t: ("/camera/aligned_depth_to_color/image_raw/compressedDepth", t, packed(t, "optical", "16UC1; compressedDepth png", bytes(12) + png(DEPTH))),
    )),
    "inverse": list(other_encodings(
        lambda t: ("/camera/color/image_raw", t, image(t, "optical", "mono8", COLOR[..., 0])),
        lambda t: ("/camera/depth/image_raw/compressedDepth", t, packed(t, "optical", "32FC1; compressedDepth png", struct.pack("<iff", 0, A, B) + png(INVERSE))),
    )),
    # Nothing says where the robot is, only how the camera is mounted.
    "no_tf": [m for m in base_messages() if m[0] != "/tf"],
    # All transforms come after the images, and those of the first frame are missing.
    "late_tf": [m for m in base_messages() if not m[0].startswith("/tf")]
    + [m for m in base_messages() if m[0].startswith("/tf") and not 99 < m[1] < 100],
    # Every other colour image is missing.
    "apart": [
        m for i, m in enumerate(base_messages())
        if m[0] != "/camera/color/image_raw" or round((m[1] - 100) * 10) % 2 == 0
    ],
    "odometry": [m for m in base_messages() if m[0] != "/tf"]
    + [("/odom", t, odometry(t, t - 100)) for t in np.arange(99.95, 100.5, 0.1).tolist()],
    # A depth camera of its own, 0.25 m beside the colour camera.
    "two_cameras": [("/tf_static", 100, tf((0.0, "optical", "depth_optical", (0.25, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))))]
    + [
        m if "aligned" not in m[0] else
        ("/camera/depth/camera_info", m[1], camera_info(m[1], "depth_optical")) if "info" in m[0] else
        ("/camera/depth/image_rect_raw", m[1], image(m[1], "depth_optical", "16UC1", DEPTH))
        for m in base_messages()
    ],
    "rgba": list(other_encodings(
        lambda t: ("/camera/color/image_raw", t, image(t, "optical", "rgba8", np.dstack([COLOR, COLOR[..., :1]]))),
        lambda t: ("/camera/depth/image_raw", t, image(t, "optical", "mono16", DEPTH)),
    )),
    "bgr": list(other_encodings(
        lambda t: ("/camera/color/image_raw", t, image(t, "optical", "bgr8", COLOR[..., ::-1])),
        lambda t: ("/camera/depth/image_raw", t, image(t, "optical", "16UC1", DEPTH, ">")),
    )),
    # A detector that numbers its classes.
    "numbered": [
        m if m[0] != "/detections" else (m[0], m[1], detections(m[1] - 0.056, ("1", 0.75, 4.0, 3.0, 2.0, 4.0)))
        for m in base_messages()
    ],
    # Raw images of a lens with barrel distortion, of k1 alone.
    "plumb_bob": [
        m if not m[0].endswith("camera_info") else (m[0], m[1], camera_info(m[1], "optical", "plumb_bob", (-0.1, 0.0, 0.0, 0.0, 0.0)))
        for m in base_messages()
    ],
    "fisheye": [
        m if not m[0].endswith("camera_info") else (m[0], m[1], camera_info(m[1], "optical", "equidistant", (0.1, 0.0, 0.0, 0.0)))
        for m in base_messages()
    ],
}


def by_rosbags(path, messages):
    with tempfile.TemporaryDirectory() as parent:
        folder = Path(parent) / "bag"
        writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        # Compressed chunks: most of such a small bag is the text of schemas.
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        with writer:
            connections = {}
            for topic, time, message in messages:
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=store)
                writer.write(connections[topic], round(time * 1e9), store.serialize_cdr(message, message.__msgtype__))
        path.write_bytes(next(folder.glob("*.mcap")).read_bytes())


def as_fields(message):
    """A message as dictionaries, which mcap-ros2-support takes."""
    if isinstance(message, list):
        return [as_fields(one) for one in message]
    if isinstance(message, np.ndarray):
        return message.tobytes() if message.dtype == np.uint8 else message.tolist()
    if hasattr(message, "__dataclass_fields__"):
        return {name: as_fields(getattr(message, name)) for name in message.__dataclass_fields__ if name != "__msgtype__"}
    return message


def by_mcap_ros2(path, messages, compression):
    with path.open("wb") as out:
        writer = Ros2Writer(out, compression=compression, chunk_size=4096)
        schemas = {}
        for sequence, (topic, time, message) in enumerate(messages):
            kind = message.__msgtype__
            if kind not in schemas:
                text, _ = store.generate_msgdef(kind, ros_version=2)
                schemas[kind] = writer.register_msgdef(kind, text)
            ns = round(time * 1e9)
            writer.write_message(topic, schemas[kind], as_fields(message), ns, ns, sequence)
        writer.finish()


def without_chunks(path, source):
    """Copies a bag without chunks, so that no checksum protects its messages."""
    with source.open("rb") as bag, path.open("wb") as out:
        writer = McapWriter(out, use_chunking=False)
        writer.start()
        channels = {}
        for schema, channel, message in make_reader(bag).iter_messages():
            if channel.topic not in channels:
                kind = writer.register_schema(schema.name, schema.encoding, b"")
                channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, kind)
            writer.add_message(channels[channel.topic], message.log_time, message.data, message.publish_time)
        writer.finish()


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent)
    for name, messages in BAGS.items():
        by_rosbags(folder / f"{name}.mcap", messages)
    by_mcap_ros2(folder / "plain_zstd.mcap", BAGS["plain"], CompressionType.ZSTD)
    by_mcap_ros2(folder / "plain_lz4.mcap", BAGS["plain"], CompressionType.LZ4)
    by_mcap_ros2(folder / "plain_unpacked.mcap", BAGS["plain"], CompressionType.NONE)
    for name in ("plain", "packed", "inverse", "odometry"):
        without_chunks(folder / f"{name}_unchunked.mcap", folder / f"{name}.mcap")
