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

__all__ = ["incenter_line", "incenters"]

SKIPS = (3, 2)
"""How many points ahead the reduction tries to link to, in this order (steps a and c)."""


def incenter_line(channel: Channel) -> FloatArray:
    """The reduced polyline over the incenters of a channel, shape (n, 2); it crosses gates between their ends."""
    if not len(channel.left):
        return np.stack([channel.start, channel.goal])
    points = np.vstack([channel.start, incenters(channel.corners), channel.goal])
    # Start and goal lie in the triangles of the first and the last incenter.
    triangle = np.concatenate([[0], np.arange(len(channel.corners)), [len(channel.corners) - 1]])
    kept = list(range(len(points)))
    at = 0
    while at < len(kept) - 2:
        for skip in SKIPS:
            if at + skip < len(kept):
                here, there = kept[at], kept[at + skip]
                gates = slice(triangle[here], triangle[there])
                if _passes(points[here], points[there], channel.left[gates], channel.right[gates]):
                    del kept[at + 1 : at + skip]
                    break
        at += 1
    return np.asarray(points[kept])


def incenters(corners: FloatArray) -> FloatArray:
    """The centres of the circles inscribed in triangles, shape (n, 3, 2) to (n, 2)."""
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    weight = np.hypot(opposite[..., 0], opposite[..., 1])
    weight /= weight.sum(axis=1, keepdims=True)
    # Relative to a corner: far from the origin the sum would lose digits that a sliver needs.
    base = corners[:, :1]
    return np.asarray(base[:, 0] + ((corners - base) * weight[..., None]).sum(axis=1))


def _passes(here: FloatArray, there: FloatArray, left: FloatArray, right: FloatArray) -> bool:
    """Whether a straight line passes all gates strictly between their ends."""
    along = there - here
    return bool((cross(along, left - here) > 0).all() and (cross(along, right - here) < 0).all())
