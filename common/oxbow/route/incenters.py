"""Routes over the incenters of a channel's triangles, clear of the shore.

M. Innocenti, L. Pollini and A. Bracci (2006), section 2.4.2. The straight line between the incenters of adjacent
triangles crosses the side between them, because the angles there are halves of angles below 180 degrees; so the
polyline over incenters passes every gate between its ends. The report's reduction (steps a to d) takes points out
of it where the straight line still passes all gates in between.
"""

from __future__ import annotations

import numpy as np

from oxbow.contracts import FloatArray
from oxbow.route.channel import Channel
from oxbow.route.mesh import cross
from oxbow.route.triangulation import Indices

__all__ = ["incenter_line", "incenters"]

SKIPS = (3, 2)
"""How many points ahead the reduction tries to link to, in this order (steps a and c)."""

MARGIN = 0.01
"""A link passes gates this share of their width away from their ends.

The report asks for a crossing alone, which may graze the shore; a hundredth costs hardly any length.
"""


def incenter_line(channel: Channel) -> FloatArray:
    """The reduced polyline over the incenters of a channel, shape (n, 2); it crosses gates between their ends.

    The report visits all nodes once; here it is done again until no link is left, which halves the length and
    widens the clearance of most routes.
    """
    points = np.vstack([channel.start, incenters(channel.corners), channel.goal])
    # Start and goal lie in the triangles of the first and the last incenter.
    triangle = np.concatenate([[0], np.arange(len(channel.corners)), [len(channel.corners) - 1]])
    kept, before = list(range(len(points))), 0
    while len(kept) != before:
        before = len(kept)
        _reduce(kept, points, triangle, channel)
    return np.asarray(points[kept])


def _reduce(kept: list[int], points: FloatArray, triangle: Indices, channel: Channel) -> None:
    """One visit of all nodes: take points out between those that can be linked (steps b to d)."""
    at = 0
    while at < len(kept) - 2:
        for skip in SKIPS:
            if at + skip < len(kept) and _passes(kept[at], kept[at + skip], points, triangle, channel):
                del kept[at + 1 : at + skip]
                break
        at += 1


def _passes(here: int, there: int, points: FloatArray, triangle: Indices, channel: Channel) -> bool:
    """Whether the straight line from one point to another passes all gates in between, away from their ends."""
    gates = slice(triangle[here], triangle[there])
    left, right = channel.left[gates], channel.right[gates]
    margin = MARGIN * (right - left)
    along = points[there] - points[here]
    to_left, to_right = left + margin - points[here], right - margin - points[here]
    return bool((cross(along, to_left) > 0).all() and (cross(along, to_right) < 0).all())


def incenters(corners: FloatArray) -> FloatArray:
    """The centres of the circles inscribed in triangles, shape (n, 3, 2) to (n, 2)."""
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    weight = np.hypot(opposite[..., 0], opposite[..., 1])
    weight /= weight.sum(axis=1, keepdims=True)
    # Relative to a corner: far from the origin the sum would lose digits that a sliver needs.
    base = corners[:, :1]
    return np.asarray(base[:, 0] + ((corners - base) * weight[..., None]).sum(axis=1))
