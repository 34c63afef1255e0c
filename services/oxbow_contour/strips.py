"""One linear pass that stands strips for runs of a contour's points."""

from __future__ import annotations

import itertools
import math

import numpy as np

from oxbow.arrays import FloatArray, Indices
from oxbow.geometry.triangles import cross

__all__ = ["deviations", "strip_ends"]


# A point strays from its edge sideways by at most WIDTH of the tolerance, and beyond the edge's end by at most
# RETREAT of it; 0.8² + 0.6² = 1, so that it stays within the tolerance of the edge.
WIDTH, RETREAT = 0.8, 0.6


def strip_ends(ring: FloatArray, tolerance_m: float) -> Indices:
    """Choose the vertices of a closed ring that its simplification keeps.

    In the spirit of IfShades, "incremental fuzzy shape description" (Rendas and Li 2016, section 1.2.1.1,
    module 1), the points are scanned once, and each is either taken into the current strip or starts the next. A
    strip is the set of points within `tolerance_m` of an edge. While it grows, the directions in which its edge
    may leave its first vertex form a cone that each point narrows (Williams 1978; Zhao and Saalfeld 1997,
    "sleeve fitting").

    It departs from the report's "fuzzy lines", which are fitted to uncertain observations, with a membership that
    fades across the line and ends that need not be observed points: a strip has a crisp half width, which makes
    its bound provable, and its edge joins two points of the input, so that the contour is as near to its
    simplification as that is to the contour.

    Parameters
    ----------
    ring : array of shape (n, 2), n >= 4
        A closed ring (first vertex repeated at the end) with an area, in metres.
    tolerance_m
        Half width of the strips; 0 keeps every vertex.

    Returns
    -------
    array of int, shape (m,), 4 <= m <= n
        Rising indices into `ring`, from 0 to n - 1. The polygon that they span has an area.
    """
    if tolerance_m == 0 or len(ring) <= 4:
        return np.arange(len(ring))
    # Kept whatever the tolerance, since an island within one strip would otherwise collapse to a line.
    corners = _corners(ring)
    x, y = ring[:, 0].tolist(), ring[:, 1].tolist()
    ends = [0]
    for first, last in itertools.pairwise(corners):
        _scan(x, y, first, last, tolerance_m, ends)
        ends.append(last)
    return np.array(ends)


def deviations(points: FloatArray, first: Indices, last: Indices) -> FloatArray:
    """Largest distance from the points of each strip to its edge.

    Parameters
    ----------
    points : array of shape (n, 2)
        Vertices of a contour, in metres.
    first, last : arrays of int, shape (m,)
        The ends of each strip: strip i stands for points first[i] to last[i].

    Returns
    -------
    array of shape (m,)
        In metres.
    """
    counts = last - first
    strip = np.repeat(np.arange(len(first)), counts)
    offset = np.cumsum(counts) - counts
    start, along = points[first], points[last] - points[first]
    relative = points[first[strip] + np.arange(len(strip)) - offset[strip]] - start[strip]
    length_squared = (along**2).sum(axis=1)
    fraction = np.clip((relative * along[strip]).sum(axis=1) / length_squared[strip], 0, 1)
    distance = np.hypot(*(relative - fraction[:, None] * along[strip]).T)
    return np.maximum.reduceat(distance, offset) if len(offset) else distance


def _corners(ring: FloatArray) -> list[int]:
    """The ends of three arcs of a ring: a triangle with an area, which keeps a small ring from collapsing."""
    from_start = ring - ring[0]
    # The farthest from the start, and the farthest to the side of that line: in line only if the whole ring is.
    far = int(np.argmax((from_start**2).sum(axis=1)))
    along = from_start[far]
    aside = int(np.argmax(np.abs(cross(from_start, along))))
    return [0, *sorted((far, aside)), len(ring) - 1]


def _scan(x: list[float], y: list[float], first: int, last: int, tolerance: float, ends: list[int]) -> None:
    """Append to `ends` the inner ends of the strips of points `first` to `last`.

    Plain floats: a point costs about a microsecond, whatever the compression.
    """
    width_squared, retreat = (WIDTH * tolerance) ** 2, RETREAT * tolerance
    width = WIDTH * tolerance
    x0, y0 = x[first], y[first]
    is_open, reach = True, 0.0  # no point has narrowed the cone yet; the farthest point is so far away
    left_x = left_y = right_x = right_y = 0.0
    for i in range(first + 1, last + 1):
        dx, dy = x[i] - x0, y[i] - y0
        distance = math.sqrt(dx * dx + dy * dy)
        # The point starts a new strip if it falls back too far behind the farthest one, or lies outside the cone.
        if distance < reach - retreat or not (
            is_open or (right_x * dy >= right_y * dx and left_x * dy <= left_y * dx)
        ):
            ends.append(i - 1)
            x0, y0 = x[i - 1], y[i - 1]
            dx, dy = x[i] - x0, y[i] - y0
            distance = math.sqrt(dx * dx + dy * dy)
            is_open, reach = True, 0.0
        reach = max(reach, distance)
        # Nearer than the half width, a point is in the strip whatever the direction of the edge, and narrows
        # nothing.
        if distance > width:
            # The tangents from the first vertex to the circle about the point, as vectors; no angles, which would
            # need a cut.
            tangent = math.sqrt(distance * distance - width_squared)
            lx, ly = dx * tangent - dy * width, dy * tangent + dx * width
            rx, ry = dx * tangent + dy * width, dy * tangent - dx * width
            if is_open:
                is_open = False
                left_x, left_y, right_x, right_y = lx, ly, rx, ry
                continue
            if left_x * ly < left_y * lx:
                left_x, left_y = lx, ly
            if right_x * ry > right_y * rx:
                right_x, right_y = rx, ry
