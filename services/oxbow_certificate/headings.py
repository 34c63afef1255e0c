"""The headings of paths: whether one direction is sampled more than others, and how often the vehicle turns."""

from __future__ import annotations

import math

import numpy as np
from shapely import LineString

from oxbow.arrays import FloatArray, Indices
from oxbow_certificate.axes import Paths, segment_ends

__all__ = ["count_turns", "directional_evenness"]

TURN_RAD = math.radians(45.0)
"""The least change of heading that counts as a turn."""


def directional_evenness(paths: Paths) -> float:
    """How evenly paths sample all directions: 0 for a single direction, 1 for all alike.

    Directions are headings regardless of their sense, on a half circle, weighted by length. They are compared with
    the uniform distribution by Watson's U^2 (Watson 1961): the variance of the difference of the two distribution
    functions, which does not depend on where the circle is cut. It is 1/12 for one direction, and the measure is
    1 - sqrt(12 U^2): 1 - 1/k for k directions sampled alike, at equal angles.
    """
    steps = _steps(paths)
    length = np.hypot(*steps.T)
    turned = np.arctan2(steps[:, 1], steps[:, 0]) / math.pi % 1.0
    order = np.argsort(turned)
    share = np.concatenate([[0.0], np.cumsum(length[order]) / length.sum()])
    cuts = np.concatenate([[0.0], turned[order], [1.0]])
    # Between two cuts the difference falls linearly, from `first` to `last`.
    first, last = share - cuts[:-1], share - cuts[1:]
    mean = np.sum(first**2 - last**2) / 2
    # Exact for the step function that a path of straight segments has: nothing is sampled.
    watson = np.sum(first**3 - last**3) / 3 - mean**2
    return 1.0 - math.sqrt(min(max(12 * watson, 0.0), 1.0))


def count_turns(path: LineString, reach_m: float) -> int:
    """The number of turns of a path: changes of heading by 45 degrees or more within `reach_m` along it.

    Changes add up, so that a round turn of many short segments is one turn, and a gentle curve is none, however
    many vertices it has. Turns to the same side that are no more than `reach_m` apart count as one.

    Parameters
    ----------
    path
        The path.
    reach_m
        The length of path within which changes add up.

    Returns
    -------
    int
        0 for a straight path, and for one of two points.
    """
    steps = _steps(path)
    # Unwrapped, so that changes add up across the cut at +-180 degrees.
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    corner_at = np.cumsum(np.hypot(*steps.T))[:-1]
    return sum(_count_left_turns(side * heading, corner_at, reach_m) for side in (1.0, -1.0))


def _count_left_turns(heading: FloatArray, corner_at: FloatArray, reach_m: float) -> int:
    """How many turns `heading` (n,) makes by growing; `corner_at` (n - 1,) is where along the path it changes."""
    corners = np.arange(len(corner_at))
    # The growth of the heading since its least value within reach behind, at each corner.
    gathered = heading[1:] - _range_minimum(heading, np.searchsorted(corner_at, corner_at - reach_m), corners)
    turning = corners[(gathered >= TURN_RAD) & (np.diff(heading) > 0)]
    # Corners of one turn follow one another within the reach: each gap longer than that begins another.
    return int(len(turning) and 1 + np.count_nonzero(np.diff(corner_at[turning]) > reach_m))


def _range_minimum(values: FloatArray, first: Indices, last: Indices) -> FloatArray:
    """Minimum of ``values[first : last + 1]`` for each pair, by runs of 2^k (Bender and Farach-Colton 2000)."""
    least = np.empty(len(first))
    level = np.frexp(last - first + 1)[1] - 1
    for k in range(int(level.max(initial=-1)) + 1):
        at = level == k
        least[at] = np.minimum(values[first[at]], values[last[at] - 2**k + 1])
        values = np.minimum(values[: -(2**k)], values[2**k :])
    return least


def _steps(paths: Paths) -> FloatArray:
    """The vectors from each waypoint to the next, without those of length 0; shape (n, 2)."""
    return np.diff(segment_ends(paths), axis=1)[:, 0]
