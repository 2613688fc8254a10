"""Scores of maps against the truth: clouds, walls, trajectories, planes and objects."""

from ._dymlm import (
    CloudScore,
    DynamicMapScore,
    DynamicMapScorer,
    ObjectScore,
    PlaneScore,
    PointTruth,
    ReferenceCloud,
    SequenceTruth,
    TrueFace,
    TrueObject,
    score_cloud,
    score_objects,
    score_planes,
    score_walls,
    trajectory_error,
)

__all__ = [name for name in dir() if not name.startswith("_")]
