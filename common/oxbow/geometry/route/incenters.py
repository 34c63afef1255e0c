"""Routes over the incenters of a channel's triangles, clear of the shore.

M. Innocenti, L. Pollini and A. Bracci (2006), section 2.4.2. The straight line between the incenters of adjacent
triangles crosses the side between them, because the angles there are halves of angles below 180 degrees; so the
polyline over incenters passes every gate between its ends. The report's reduction (steps a to d) removes points
from it where the straight line still passes all gates in between.

Departures: the report removes points greedily, one or two at a time, and is left with whatever incenters that
spares, which may lie on the far side of wide water. This module finds the shortest polyline that removing points
can lead to. And a line has to pass gates a little away from their ends, where the report lets it graze them.
"""

from __future__ import annotations

import numpy as np

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.geometry.route.channel import Channel
from oxbow.geometry.triangles import cross, side_lengths

__all__ = ["incenter_line", "incenters"]

MARGIN = 0.02
"""A line passes gates this share of their width away from their ends."""

GATES_AHEAD = 32
"""Straight lines through channels hardly ever pass more gates: all gates are examined only for those that do."""


def incenter_line(channel: Channel) -> FloatArray:
    """The shortest polyline over incenters of a channel, shape (n, 2); it crosses gates between their ends."""
    points = np.vstack([channel.start, incenters(channel.corners), channel.goal])
    last = len(points) - 1
    # Start and goal lie in the triangles of the first and the last incenter.
    triangle = np.concatenate([[0], np.arange(len(channel.corners)), [len(channel.corners) - 1]])
    length_m = np.concatenate([[0.0], np.full(last, np.inf)])
    previous = np.zeros(len(points), dtype=np.intp)
    for here in range(last):
        ahead = _in_line(here, points, triangle, channel)
        through_m = length_m[here] + np.hypot(*(points[ahead] - points[here]).T)
        shorter = through_m < length_m[ahead]
        length_m[ahead[shorter]] = through_m[shorter]
        previous[ahead[shorter]] = here
    way = [last]
    while way[-1]:
        way.append(int(previous[way[-1]]))
    return np.asarray(points[way[::-1]])


def _in_line(here: int, points: FloatArray, triangle: Indices, channel: Channel) -> Indices:
    """The points ahead that a straight line reaches through all gates in between; the next one always counts."""
    first, last = triangle[here], len(channel.left)
    for gates in (GATES_AHEAD, last):
        window = slice(first, min(first + gates, last))
        ahead = np.arange(here + 1, np.searchsorted(triangle, window.stop, side="right"))
        left, right = channel.left[window] - points[here], channel.right[window] - points[here]
        passes, is_closed = _passing(points[ahead] - points[here], triangle[ahead] - first, left, right)
        if is_closed or window.stop == last:
            break
    passes[0] = True
    return np.asarray(ahead[passes])


def _passing(towards: FloatArray, gates: Indices, left: FloatArray, right: FloatArray) -> tuple[Mask, bool]:
    """Which directions, shape (n, 2), pass the first `gates` gates, and whether nothing can pass them all."""
    if not len(left):
        return np.ones(len(towards), dtype=np.bool_), False
    axis = (left[0] + right[0]) / 2
    margin = MARGIN * (right - left)
    # Angles to the middle of the first gate: a straight line is within half a turn of the ends of all its gates.
    open_to = np.minimum.accumulate(_direction_rad(left + margin, axis))
    open_from = np.maximum.accumulate(_direction_rad(right - margin, axis))
    direction = _direction_rad(towards, axis)
    # A point in the same triangle passes no gate: the limits at its index -1 are overruled below.
    passes = (direction < open_to[gates - 1]) & (direction > open_from[gates - 1])
    return np.asarray(passes | (gates == 0)), bool(open_to[-1] <= open_from[-1])


def _direction_rad(vectors: FloatArray, axis: FloatArray) -> FloatArray:
    """The angles of vectors, shape (n, 2), to an axis; positive to its left."""
    return np.asarray(np.arctan2(cross(axis, vectors), vectors @ axis))


def incenters(corners: FloatArray) -> FloatArray:
    """The centres of the circles inscribed in triangles, shape (n, 3, 2) to (n, 2)."""
    opposite = np.roll(side_lengths(corners), -1, axis=1)
    weight = opposite / opposite.sum(axis=1, keepdims=True)
    # Relative to a corner: far from the origin the sum would lose digits that a sliver needs.
    base = corners[:, :1]
    return np.asarray(base[:, 0] + ((corners - base) * weight[..., None]).sum(axis=1))
