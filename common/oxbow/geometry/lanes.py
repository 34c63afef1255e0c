"""Lanes: the ways out and home, one on either side of a middle line, as ships keep to one side of a fairway."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString

from oxbow.arrays import FloatArray
from oxbow.contracts import MiddleLine
from oxbow.tolerances import HAIR_M

__all__ = ["OPENING", "lane", "legs_length_m"]

OPENING = 0.05
"""To each side, the ways out and home open by this share of the way to the free space: in a corner of the free
space, where they part is outside of it."""
SPARE = 1.001
"""Legs are at most this many times as long as was computed: where they bend, they are drawn in steps."""


def lane(middle: MiddleLine, apart_m: float) -> FloatArray:
    """The lane to the right of a middle line, without the gate.

    Over land it is moved by a hair, from there to the free space by ever more, and then by a distance: were it
    by the distance at once, the leg from a place on an open shore would run along that shore.

    Parameters
    ----------
    middle
        The middle line, from a place to a gate.
    apart_m
        How far to its right the lane runs; to its left where negative.

    Returns
    -------
    ndarray of float, shape (n, 2)
        From the place itself to beside the gate.
    """
    points = shapely.get_coordinates(middle.line)
    first = 1 if middle.is_ashore else 0
    narrow = _ever_more_beside(points[first : middle.entry + 1], apart_m)
    afloat = np.vstack([narrow, _beside(points[max(first, middle.entry) : -1], apart_m)[1:]])
    if not middle.is_ashore:
        return np.vstack([points[:1], afloat])
    place, berth = points[:2]
    along = (berth - place) / np.hypot(*(berth - place))
    hair = np.copysign(HAIR_M, apart_m) * np.array([along[1], -along[0]])
    return np.vstack([place, berth + hair, afloat])


def legs_length_m(out: MiddleLine | None, home: MiddleLine | None, apart_m: float) -> float:
    """How long the legs to a share and home may become, with the steps from and to the gate.

    On either side, as far from their middle lines as they may be: nearer to these, their length is between.
    A path between two legs is cut by the width of both, which is what the steps are longer by.

    Parameters
    ----------
    out, home
        The middle lines, from a place to a gate; None for a leg that is not needed.
    apart_m
        How far legs may run beside their middle lines.

    Returns
    -------
    float
        In metres; 0 without legs. A leg alone follows its middle line.
    """
    if out is None or home is None:
        return sum((leg.line.length for leg in (out, home) if leg is not None), 0.0)
    beside_m = (
        _lane_length_m(out, side * apart_m) + _lane_length_m(home, -side * apart_m) for side in (1.0, -1.0)
    )
    return SPARE * max(out.line.length + home.line.length, *beside_m)


def _lane_length_m(middle: MiddleLine, apart_m: float) -> float:
    """The length of the lane to the right of a middle line, and straight on to the gate."""
    gate = shapely.get_coordinates(middle.line)[-1:]
    return LineString(np.vstack([lane(middle, apart_m), gate])).length


def _ever_more_beside(leg: FloatArray, apart_m: float) -> FloatArray:
    """A leg without its first point, moved to its right by a share of the way so far, at most by a distance."""
    steps = np.diff(leg, axis=0)
    if len(steps) == 0:
        return leg[:0]
    along_m = np.cumsum(np.hypot(*steps.T))
    tangents = np.vstack([leg[2:] - leg[:-2], steps[-1:]])
    # A place on the rim of the free space is its own entry: a step without a length has no side, and stays.
    norms = np.hypot(*tangents.T)[:, None]
    right = np.column_stack([tangents[:, 1], -tangents[:, 0]]) / np.where(norms > 0.0, norms, 1.0)
    aside_m = np.copysign(np.minimum(abs(apart_m), OPENING * along_m), apart_m)
    return np.asarray(leg[1:] + aside_m[:, None] * right)


def _beside(leg: FloatArray, apart_m: float) -> FloatArray:
    """A leg moved to its right; nothing, where it is a place only."""
    if len(leg) < 2:
        return leg[:0]
    # GEOS offsets to the left where the distance is positive.
    return np.asarray(shapely.get_coordinates(shapely.offset_curve(LineString(leg), -apart_m, quad_segs=2)))
