"""The shortest line through a channel of triangles: the funnel algorithm.

D. T. Lee and F. P. Preparata (1984), *Euclidean shortest paths in the presence of rectilinear barriers*, as
M. Kallmann (2005) uses it; M. Innocenti, L. Pollini and A. Bracci (2006), section 2.4.1, step d.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from oxbow.arrays import FloatArray, Place
from oxbow.geometry.route.channel import Channel

__all__ = ["funnel_line"]


def funnel_line(channel: Channel) -> FloatArray:
    """The shortest polyline inside a channel, shape (n, 2).

    Two chains run from an apex to the ends of the last gate, bent inwards. The next gate's end shortens its own
    chain; where it crosses the other chain, the apex moves along that chain.
    """
    start: Place = tuple(channel.start.tolist())
    goal: Place = tuple(channel.goal.tolist())
    line = [start]
    left, right = deque([start]), deque([start])
    for new_left, new_right in zip(channel.left.tolist(), channel.right.tolist(), strict=True):
        _extend(right, left, tuple(new_right), 1.0, line)
        _extend(left, right, tuple(new_left), -1.0, line)
    _extend(right, left, goal, 1.0, line)
    return np.array([*line, *list(right)[1:]])


def _extend(chain: deque[Place], other: deque[Place], end: Place, side: float, line: list[Place]) -> None:
    """Lengthen one chain to a new end; `side` is 1 for the right chain and -1 for the left one."""
    # At 0 too: a point in line drops out, and so does an end that two successive gates share.
    while len(chain) > 1 and side * _turn(chain[-2], chain[-1], end) >= 0:
        chain.pop()
    if len(chain) == 1:
        while len(other) > 1 and side * _turn(other[0], other[1], end) > 0:
            other.popleft()
            line.append(other[0])
        chain[0] = other[0]
    chain.append(end)


def _turn(a: Place, b: Place, c: Place) -> float:
    """Positive where the way from a over b to c turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
