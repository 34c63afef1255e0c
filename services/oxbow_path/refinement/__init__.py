"""Refinement: waypoints moved against the worst gaps, within the length; shared by all path methods."""

from oxbow_path.refinement.guard import Guard
from oxbow_path.refinement.polyline import Polyline
from oxbow_path.refinement.refine import NODE_WORK, RefinementStep, Stop, refined_path
from oxbow_path.refinement.samples import Samples, weights_at
from oxbow_path.refinement.smoothing import smoothed_path

__all__ = [
    "NODE_WORK",
    "Guard",
    "Polyline",
    "RefinementStep",
    "Samples",
    "Stop",
    "refined_path",
    "smoothed_path",
    "weights_at",
]
