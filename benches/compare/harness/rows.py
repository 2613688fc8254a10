"""The table of comparisons. A new comparison needs an entry here, and its functions in the programs."""

from collections.abc import Callable
from dataclasses import dataclass, field

from . import agreement
from .inputs import MATRICES, PLANE_FRAMES, Inputs


@dataclass
class Entrant:
    """A contestant of a row: its name there, the library whose program runs it, and its own parameters."""

    name: str
    library: str
    parameters: dict = field(default_factory=dict)


@dataclass
class Aim:
    """The factor by which ours should be faster than `against`, or than the best peer if `against` is None."""

    factor: float
    against: str | None = None


@dataclass
class Row:
    """One comparison. Times are divided by `count` and shown per `unit`."""

    name: str
    operation: str
    parameters: dict
    entrants: list[Entrant]
    check: Callable[[dict, agreement.Outputs], dict[str, agreement.Agreement]]
    aim: Aim | None = None
    unit: str = "run"
    count: int = 1


# Ours with working memory and output reused from the run before, as in a loop over frames, and without.
OURS_KEPT = Entrant("dymlm", "dymlm", {"buffers": "kept"})
OURS_FRESH = Entrant("dymlm, fresh buffers", "dymlm", {"buffers": "fresh"})
OURS = Entrant("dymlm", "dymlm")


# Other occupancy maps that are filled by one ray a cell, with the same probabilities.
RAY_A_CELL = [Entrant("Bonxai", "Bonxai"), Entrant("UFOMap, discretized", "UFOMap")]


def rows(inputs: Inputs, quick: bool) -> list[Row]:
    return [
        *dbscan_rows(inputs, quick),
        *voxel_grid_rows(inputs, quick),
        *shape_rows(inputs, quick),
        *isolation_forest_rows(inputs, quick),
        *plane_rows(inputs),
        *assignment_rows(inputs),
        *pose_graph_rows(inputs),
        *octree_rows(inputs, quick),
        *static_cloud_rows(inputs, quick),
        *tracking_rows(inputs),
    ]


def tracking_rows(inputs: Inputs) -> list[Row]:
    flow = Row(
        name="optical flow, 200 points",
        operation="optical_flow",
        parameters={"images": inputs.path("flow.images"), "points": inputs.path("flow.points")},
        entrants=[OURS, Entrant("OpenCV", "OpenCV")],
        check=agreement.optical_flow,
        unit="pair (6)",
        count=6,
    )
    sequences = [("carried things", "carried"), ("pedestrians", "pedestrians")]
    return [flow, *(kcf_row(inputs, name, file) for name, file in sequences if inputs.path(f"{file}.targets").exists())]


def kcf_row(inputs: Inputs, name: str, file: str) -> Row:
    targets = inputs.path(f"{file}.targets")
    boxes = targets.stat().st_size // 24
    return Row(
        name=f"KCF, {name}",
        operation="kcf",
        parameters={"images": inputs.path(f"{file}.images"), "targets": targets},
        entrants=[OURS, Entrant("OpenCV", "OpenCV")],
        check=agreement.tracked_boxes,
        aim=Aim(1),
        unit=f"box ({boxes})",
        count=boxes,
    )


def dbscan_rows(inputs: Inputs, quick: bool) -> list[Row]:
    blobs = [(f"{size} blobs", f"blobs_{size}", 4) for size in ["10k", "100k", "1M"]]
    clouds = [*blobs, ("frame", "frame", 2)]
    peers = [Entrant(name, name) for name in ["dbscan", "scikit-learn", "Open3D"]]
    return [
        Row(
            name=f"DBSCAN, {cloud}",
            operation="dbscan",
            parameters={"input": inputs.path(f"{file}.points"), "eps": 0.05, "min_points": 10},
            entrants=[OURS_KEPT, OURS_FRESH, *peers],
            check=agreement.dbscan,
            aim=Aim(factor),
        )
        for cloud, file, factor in clouds[: 2 if quick else 4]
    ]


def voxel_grid_rows(inputs: Inputs, quick: bool) -> list[Row]:
    clouds = [("frame", "frame"), ("1M blobs", "blobs_1M")]
    return [
        Row(
            name=f"voxel grid 1 cm, {cloud}",
            operation="voxel_grid",
            parameters={"input": inputs.path(f"{file}.points"), "voxel_size": 0.01},
            entrants=[
                OURS_KEPT,
                OURS_FRESH,
                Entrant("PCL", "PCL", {"buffers": "kept"}),
                *(Entrant(name, name) for name in ["Open3D", "small_gicp"]),
            ],
            check=agreement.voxel_grid,
            aim=Aim(3),
        )
        for cloud, file in clouds[: 1 if quick else 2]
    ]


def shape_rows(inputs: Inputs, quick: bool) -> list[Row]:
    clouds = [(f"{size} {kind} points", f"{file}_{size}") for size in (["10k"] if quick else ["10k", "100k"])
              for kind, file in [("box-like", "thing"), ("round", "round")]]  # fmt: skip
    largest = "10k" if quick else "100k"
    footprints = [(f"{largest} {kind} points", f"{kind}_{largest}") for kind in ["gaussian", "ring", "outline"]]
    rectangles = [
        Row(
            name=f"minimum-area rectangle, {cloud}",
            operation="minimum_area_rectangle",
            parameters={"input": inputs.path(f"{file}.points")},
            entrants=[OURS_KEPT, OURS_FRESH, Entrant("CGAL", "CGAL"), Entrant("OpenCV", "OpenCV")],
            check=agreement.minimum_area_rectangle,
            aim=Aim(5) if "100k" in cloud else None,
        )
        for cloud, file in [*clouds, *footprints]
    ]
    minimal = [Entrant(entrant.name, "dymlm", entrant.parameters | {"fit": "minimum_volume"})
               for entrant in [OURS_KEPT, OURS_FRESH]]  # fmt: skip
    about_an_axis = Entrant(
        "dymlm, about the third principal axis", "dymlm", OURS_KEPT.parameters | {"fit": "minimum_rectangle"}
    )
    boxes = [
        Row(
            name=f"oriented box, {cloud}",
            operation="oriented_box",
            parameters={"input": inputs.path(f"{file}.points")},
            entrants=[
                *minimal,
                about_an_axis,
                Entrant("Open3D, minimal", "Open3D", {"fit": "minimal"}),
                Entrant("Open3D, principal axes", "Open3D", {"fit": "principal_axes"}),
            ],
            check=agreement.oriented_box,
            aim=Aim(8, "Open3D, minimal"),
        )
        for cloud, file in clouds
    ]
    return [*rectangles, *boxes]


def isolation_forest_rows(inputs: Inputs, quick: bool) -> list[Row]:
    size = "10k" if quick else "100k"
    return [
        Row(
            name=f"isolation forest, {what} 100 trees, {size} points",
            operation=operation,
            parameters={"input": inputs.path(f"thing_{size}.points"), "trees": 100, "sample_size": 256},
            entrants=[OURS_KEPT, OURS_FRESH, *(Entrant(name, name) for name in ["scikit-learn", "isotree"])],
            check=agreement.isolation_forest,
            aim=aim,
        )
        for what, operation, aim in [
            ("scores of", "isolation_forest_scores", Aim(5)),
            ("growing", "isolation_forest_fit", None),
        ]
    ]


def plane_rows(inputs: Inputs) -> list[Row]:
    return [
        Row(
            name="planes of a depth image",
            operation="planes",
            # Used for all; our own default is 500, which finds smaller planes than the peers' settings are for.
            parameters={"input": inputs.path("images.depths"), "min_support": 1000},
            entrants=[
                Entrant("dymlm", "dymlm"),
                Entrant("PCL, multi-plane", "PCL"),
                Entrant("Open3D, planar patches", "Open3D"),
                *(Entrant(name, name) for name in ["CAPE", "PEAC"]),
            ],
            check=agreement.planes,
            unit=f"image ({PLANE_FRAMES})",
            count=PLANE_FRAMES,
        )
    ]


def static_cloud_rows(inputs: Inputs, quick: bool) -> list[Row]:
    if not inputs.path("people.poses").exists():
        return []
    frames = inputs.path("people.poses").stat().st_size // 56
    frames = min(frames, 20) if quick else frames
    # Cell size, growth of hits, growth of the unknown; the library's defaults come first.
    settings = [(0.1, 0.2, 2), (0.05, 0.1, 1), (0.1, 0.1, 0), (0.05, 0.05, 0)]
    peers = [
        Entrant(f"DUFOMap, {cell}, {hits}, {unknown}", "DUFOMap",
                {"cell": cell, "hits_grow": hits, "unknown_grows": unknown})
        for cell, hits, unknown in settings
    ]  # fmt: skip
    return [
        Row(
            name="cloud without movers, no detections",
            operation="static_cloud",
            parameters={"images": inputs.path("people.depths"), "poses": inputs.path("people.poses"), "limit": frames},
            entrants=[OURS, *peers],
            check=agreement.static_cloud,
            unit=f"frame ({frames})",
            count=frames,
        )
    ]


def assignment_rows(inputs: Inputs) -> list[Row]:
    return [
        Row(
            name=f"assignment, {size}x{size}",
            operation="assignment",
            parameters={"input": inputs.path(f"weights_{size}.matrices"), "size": size},
            entrants=[OURS, Entrant("scipy", "scipy")],
            check=agreement.assignment,
            unit=f"matrix ({count})",
            count=count,
        )
        for size, count in MATRICES
    ]


def pose_graph_rows(inputs: Inputs) -> list[Row]:
    methods = {"LM": "levenberg_marquardt", "GN": "gauss_newton"}
    # Method, and relative decrease of the cost at which it stops.
    settings = {
        "GTSAM": [("LM", "default"), ("LM", "1e-9"), ("GN", "default")],
        "factrs": [("LM", "default"), ("GN", "default")],
        "tiny-solver": [("LM", "default"), ("LM", "1e-9"), ("GN", "default")],
    }
    peers = [
        Entrant(
            f"{library}, {method}" + ("" if tolerance == "default" else f" to {tolerance}"),
            library,
            {"method": methods[method], "tolerance": tolerance},
        )
        for library, entries in settings.items()
        for method, tolerance in entries
    ]
    return [
        Row(
            name=f"pose graph, {name}",
            operation="pose_graph",
            parameters={"graph": path},
            entrants=[OURS, *peers],
            check=agreement.pose_graph,
            aim=Aim(1),
        )
        for name, path in inputs.pose_graphs.items()
    ]


def octree_rows(inputs: Inputs, quick: bool) -> list[Row]:
    room, hall = ("30 frames", "frames", 5.0, 6), ("hall", "hall", "inf", 12)
    # Scene, cell size, rays, number of frames, number of frames with --quick (0: left out).
    insertions = [
        (room, 0.05, "per_cell", 30, 10), (room, 0.02, "per_cell", 30, 2),
        (hall, 0.05, "per_cell", 6, 2), (hall, 0.02, "per_cell", 1, 0),
        (room, 0.05, "per_point", 5, 2), (room, 0.02, "per_point", 2, 0), (hall, 0.05, "per_point", 1, 0),
    ]  # fmt: skip
    insertion_rows = [
        insertion_row(inputs, scene, size, rays, quick_frames if quick else frames)
        for scene, size, rays, frames, quick_frames in insertions
        if frames and (quick_frames or not quick)
    ]
    return insertion_rows + query_rows(inputs)


def insertion_row(inputs: Inputs, scene: tuple, size: float, rays: str, frames: int) -> Row:
    name, file, max_range, factor = scene
    plain = rays == "per_point"
    octomap = Entrant("OctoMap" if plain else "OctoMap, discretized", "OctoMap")
    return Row(
        name=f"octree insertion {size * 100:.0f} cm, {name}" + (", a ray a point" if plain else ""),
        operation="octree_insert",
        parameters={
            "frames": inputs.path(f"{file}.frames"), "limit": frames, "resolution": size,
            "max_range": max_range, "rays": rays,
        },
        entrants=[OURS, octomap, *([] if plain else [*RAY_A_CELL, *projective(inputs, file)])],
        check=agreement.octree_leaves,
        aim=None if plain else Aim(factor, "OctoMap, discretized"),
        unit=f"frame ({frames})",
        count=frames,
    )  # fmt: skip


def projective(inputs: Inputs, file: str) -> list[Entrant]:
    """Maps that project their cells into depth images, where the frames are known as such."""
    images, poses = inputs.path(f"{file}.depths"), inputs.path(f"{file}.poses")
    if not images.exists():
        return []
    return [Entrant("wavemap, projective", "wavemap", {"images": images, "poses": poses})]


def query_rows(inputs: Inputs) -> list[Row]:
    map_of = {"frames": inputs.path("frames.frames"), "resolution": 0.05, "max_range": 5.0, "rays": "per_cell"}
    by_map, by_accessor = {"reader": "map"}, {"reader": "accessor"}
    octomap = Entrant("OctoMap", "OctoMap")
    queries = [
        Row(
            name=f"octree query, {points}",
            operation="octree_query",
            parameters=map_of | {"points": inputs.path(f"{file}.points")},
            entrants=[*entrants, octomap, Entrant("Bonxai", "Bonxai")],
            check=agreement.octree_states,
            aim=Aim(2, "OctoMap"),
            unit="query",
            count=inputs.path(f"{file}.points").stat().st_size // 12,
        )
        for points, file, entrants in [
            ("scattered points", "scattered", [Entrant("dymlm", "dymlm", by_map)]),
            (
                "scan-ordered points",
                "surfaces",
                [Entrant("dymlm", "dymlm", by_accessor), Entrant("dymlm, plain", "dymlm", by_map)],
            ),
        ]
    ]
    casts = Row(
        name="octree ray cast",
        operation="octree_cast",
        parameters=map_of | {"rays_file": inputs.path("rays.rays"), "cast_range": 10.0},
        entrants=[OURS, octomap],
        check=agreement.octree_hits,
        aim=Aim(2),
        unit="ray",
        count=100_000,
    )
    return [*queries, casts]
