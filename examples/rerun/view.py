#!/usr/bin/env python3
"""Shows a recorded session in Rerun: the clouds and images, which Rerun reads from MCAP itself, and
the planes and labelled objects, which it does not read from MCAP yet.

    pip install rerun-sdk mcap mcap-ros2-support
    cargo run --release --example build_map -- --mcap session.mcap
    python examples/rerun/view.py session.mcap                          # opens the viewer
    python examples/rerun/view.py session.mcap --save session.rrd      # or writes a file that it opens
"""

import argparse

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

SCENES = ["/map/planes", "/map/objects"]
CLOUDS = "/map/cloud"


def vector(v):
    return [v.x, v.y, v.z]


def rgba(color):
    return [round(255 * channel) for channel in (color.r, color.g, color.b, color.a)]


def log_entity(path, entity):
    """Converts an entity of the scene to what Rerun draws."""
    rr.log(path, rr.CoordinateFrame(entity.frame_id))
    for faces in entity.triangles:
        if faces.indices:
            corners, triangles = [vector(p) for p in faces.points], np.array(faces.indices).reshape(-1, 3)
            rr.log(path + "/faces", rr.CoordinateFrame(entity.frame_id),
                   rr.Mesh3D(vertex_positions=corners, triangle_indices=triangles, albedo_factor=rgba(faces.color)))
    if entity.lines:
        strips = [[vector(p) for p in [*line.points, line.points[0]]] for line in entity.lines]
        rr.log(path + "/outline", rr.CoordinateFrame(entity.frame_id),
               rr.LineStrips3D(strips, colors=[rgba(line.color) for line in entity.lines], radii=rr.Radius.ui_points(1.0)))
    label = entity.texts[0].text if entity.texts else None
    for solids, kind in [(entity.cubes, rr.Boxes3D), (entity.spheres, rr.Ellipsoids3D)]:
        if solids:
            q = [[s.pose.orientation.x, s.pose.orientation.y, s.pose.orientation.z, s.pose.orientation.w] for s in solids]
            rr.log(path + "/shape", rr.CoordinateFrame(entity.frame_id), kind(
                half_sizes=[np.array(vector(s.size)) / 2 for s in solids], centers=[vector(s.pose.position) for s in solids],
                quaternions=q, colors=[rgba(s.color)[:3] for s in solids], labels=[label] * len(solids), show_labels=True))


def log_scenes(path):
    """Logs planes and objects over time; returns the final points of the cloud, and the camera's positions."""
    clouds, cameras = {}, []
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        topics = [channel.topic for channel in reader.get_summary().channels.values()]
        wanted = ["/tf", *SCENES] + [topic for topic in topics if topic.startswith(CLOUDS)]
        for _, channel, message, decoded in reader.iter_decoded_messages(wanted):
            if channel.topic == "/tf":
                cameras += [vector(one.transform.translation) for one in decoded.transforms]
                continue
            if channel.topic.startswith(CLOUDS):
                places = np.frombuffer(bytes(decoded.data), np.uint8).reshape(-1, decoded.point_step)[:, :12]
                clouds[channel.topic] = places.copy().view("<f4").reshape(-1, 3)
                continue
            rr.set_time("message_log_time", timestamp=np.datetime64(message.log_time, "ns"))
            for deletion in decoded.deletions:
                rr.log(f"/scene{channel.topic}/{deletion.id}", rr.Clear(recursive=True))
            for entity in decoded.entities:
                log_entity(f"/scene{channel.topic}/{entity.id}", entity)
    rr.reset_time()
    return np.concatenate([*clouds.values(), np.zeros((1, 3), np.float32)]), np.array(cameras or [[0.0, 0.0, 0.0]])


def layout(points, cameras, up):
    """The layout: the map from behind and above the camera, with the camera's images beside it."""
    low, high = np.percentile(points, 5, axis=0), np.percentile(points, 95, axis=0)
    center, up, size = (low + high) / 2, np.array(up) / np.linalg.norm(up), np.linalg.norm(high - low)
    back = cameras.mean(0) - center
    back -= (back @ up) * up
    eye = center + size * (0.5 * back / max(np.linalg.norm(back), 1e-6) + 0.5 * up)
    world = rrb.Spatial3DView(
        name="map", contents=["/map/**", "/scene/**", "/tf/**", "/camera/color/**", "- /map/outlines/**", "- /map/grid"],
        spatial_information=rrb.SpatialInformation(target_frame="map"), line_grid=False, background=[22, 24, 28],
        defaults=[rr.Points3D.from_fields(radii=rr.Radius.ui_points(1.4))],
        eye_controls=rrb.EyeControls3D(position=eye, look_target=center, eye_up=up))
    images = [rrb.Spatial2DView(name=name, origin=f"/camera/{name}/image_raw{rest}") for name, rest in [("color", "/compressed"), ("depth", "")]]
    return rrb.Blueprint(
        rrb.Horizontal(world, rrb.Vertical(*images), column_shares=[3, 1]),
        rrb.TimePanel(timeline="message_log_time", play_state="following", expanded=False), rrb.BlueprintPanel(expanded=False),
        rrb.SelectionPanel(expanded=False))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", help="FILE.mcap of build_map --mcap, or of dymlm's SessionRecorder")
    parser.add_argument("--save", metavar="FILE.rrd", help="write a file for the viewer instead of opening it")
    parser.add_argument("--up", nargs=3, type=float, default=[0, 0, 1], metavar=("X", "Y", "Z"), help="up in the map's world")
    arguments = parser.parse_args()
    rr.init("dymlm", spawn=not arguments.save)
    if arguments.save:
        rr.save(arguments.save)
    rr.log_file_from_path(arguments.session)
    rr.send_blueprint(layout(*log_scenes(arguments.session), arguments.up))


if __name__ == "__main__":
    main()
