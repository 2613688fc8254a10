"""Maps of the static world from RGB-D frames, 2D detections and camera poses, while people walk through the scene.

A MapBuilder takes frames as arrays of numpy and builds four maps: a coloured cloud, an occupancy octree, finite planes and
objects. The library is written in Rust; while it works, other threads of Python run.

    import dymlm

    frames = dymlm.builtin_sequence(every=5)        # or dymlm.Dataset("folder"), a TUM RGB-D folder
    builder = dymlm.MapBuilder(frames.camera)
    for frame in frames:
        builder.insert_frame(frame)
    map = builder.finish()
    print(len(map.cloud()), len(map.octree.occupied()), len(map.planes), [thing.label for thing in map.objects])

Lengths are metres, times seconds, angles radians. Camera coordinates: x to the right, y down, z forward.
"""

from ._dymlm import (
    Boundary,
    Camera,
    ChangedThings,
    Cloud,
    CloudBlock,
    Config,
    ConfigError,
    CorrectionReport,
    Dataset,
    Detection,
    DistanceField,
    Error,
    FileError,
    FloorGrid,
    FloorUnder,
    FoundObject,
    Frame,
    FrameReport,
    GridUpdate,
    Locked,
    LoopClosure,
    Map,
    MapBuilder,
    MapChanges,
    MapObject,
    MapReader,
    MapSaver,
    MapUpdate,
    MergeRefused,
    MergeReport,
    Mover,
    NewIds,
    NoFloor,
    NoHistory,
    NotPending,
    ObjectMove,
    ObjectTracker,
    ObjectUpdate,
    OccupancyGrid,
    Octree,
    OutOfReach,
    Plane,
    Pose,
    RefineReport,
    RefinementStopped,
    Sequence,
    StaticPoints,
    ThingChanges,
    TimeReversed,
    UnknownFrame,
    UnknownObject,
    WorldChanges,
    builtin_sequence,
    load,
)
from . import metrics

__all__ = [name for name in dir() if not name.startswith("_")]
