"""The check of free space against the true shore, and how much safety the true water has room for."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Polygon, STRtree

from oxbow.geometry.rings import rings_of, runs_of
from oxbow.tolerances import DISTANCE_ROUNDING

__all__ = ["inscribed_radius_m", "is_safe", "rounded_down"]

SHORE_RUN = 32
"""Edges of the true shore that are looked at together."""


def is_safe(free: Polygon, water: Sequence[Polygon], safety_m: float) -> bool:
    """Whether `free` is inside the water, and nowhere nearer than `safety_m` to its contours.

    It relies on nothing that the simplification or the erosion found.

    Parameters
    ----------
    free
        What is claimed to be safe, in metres.
    water
        The true water, its parts with disjoint interiors.
    safety_m
        The distance to keep; at 0, `free` may not even touch the contours.

    Returns
    -------
    bool
        True also where it is nearer by no more than rounding.
    """
    # Three tests together: one point is in the water, no ring of the shore is inside the free space, and no edge
    # of either comes near the other. None is enough on its own.
    if not shapely.contains(np.array(water, dtype=object), free.representative_point()).any():
        return False
    shore = rings_of(water)
    if shapely.contains_xy(free, [ring[0] for ring in shore]).any():
        return False
    edges = STRtree(np.concatenate([runs_of(ring, 1) for ring in rings_of(free)]))
    runs = np.concatenate([runs_of(ring, SHORE_RUN) for ring in shore])
    near, _ = edges.query(runs, predicate="dwithin", distance=safety_m * (1 - DISTANCE_ROUNDING))
    return not len(near)


def inscribed_radius_m(water: Sequence[Polygon], precision_m: float) -> float:
    """The radius of the largest circle in the water.

    Parameters
    ----------
    water
        Parts of the water, at least one, in metres.
    precision_m
        How much too small the radius may be.

    Returns
    -------
    float
        In metres, never too large.
    """
    circles = shapely.maximum_inscribed_circle(np.array(water, dtype=object), precision_m)
    return float(shapely.length(circles).max())


def rounded_down(value: float, digits: int = 3) -> float:
    """A number rounded down to a few significant digits.

    Parameters
    ----------
    value
        Not negative.
    digits
        How many to keep.

    Returns
    -------
    float
        At most `value`; 0 for 0.
    """
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) + 1 - digits)
    # Through text: the product has digits of rounding that a message should not show.
    return float(f"{math.floor(value / unit) * unit:.{digits}g}")
