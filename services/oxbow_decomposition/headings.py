"""Which way the transects should run: a cheap forecast of a plan's length for each of several headings."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from oxbow.contracts import FloatArray, HeadingScore
from oxbow.sweep import to_sweep
from oxbow_decomposition.boundary import boundary_walks

__all__ = ["candidate_headings", "predicted_cost", "scored_headings"]

IntArray = npt.NDArray[np.int64]

EVEN_HEADINGS = 16
SHORE_HEADINGS = 3


def scored_headings(free: Polygon, spacing_m: float) -> tuple[HeadingScore, ...]:
    """The predicted cost of every candidate heading, in rising order of the heading.

    Parameters
    ----------
    free
        A valid polygon in planar metres.
    spacing_m
        Distance between neighbouring transects.
    """
    walks = boundary_walks(free)
    edges = np.concatenate([np.stack([walk, np.roll(walk, -1, axis=0)], axis=1) for walk in walks])
    return tuple(
        HeadingScore(heading_rad=heading, predicted_cost=predicted_cost(edges, heading, spacing_m, free.area))
        for heading in candidate_headings(free)
    )


def candidate_headings(free: Polygon) -> list[float]:
    """Headings in [0, pi) worth a forecast, in radians clockwise from north, rising.

    An even fan; the sides of the least rectangle around the polygon; and the directions along which the
    shore runs farthest.
    """
    fan = np.arange(EVEN_HEADINGS) * math.pi / EVEN_HEADINGS
    rectangle = np.diff(shapely.get_coordinates(free.minimum_rotated_rectangle), axis=0)[:2]
    steps = np.concatenate(
        [np.diff(shapely.get_coordinates(ring), axis=0) for ring in (free.exterior, *free.interiors)]
    )
    bins = 4 * EVEN_HEADINGS
    length, _ = np.histogram(_headings(steps), bins, (0.0, math.pi), weights=np.hypot(*steps.T))
    along = (np.argsort(-length, kind="stable")[:SHORE_HEADINGS] + 0.5) * math.pi / bins
    return sorted(set(np.concatenate([fan, _headings(rectangle), along]).tolist()))


def _headings(steps: FloatArray) -> FloatArray:
    return np.arctan2(steps[:, 0], steps[:, 1]) % math.pi


def predicted_cost(edges: FloatArray, heading_rad: float, spacing_m: float, area_m2: float) -> float:
    """Metres of path that a square metre of water is expected to take under one heading.

    Transects a spacing D apart are laid over the water, without a decomposition: each meets it in intervals.
    The forecast adds up

    - the transects themselves, about area / D;
    - half of every link between neighbours, at the end where the shore is shorter to follow: a link sweeps
      water too, but half of it is water that the transects it joins have swept. A shore that runs askew
      across the transects makes links long;
    - a spacing for each interval that does not continue in exactly one interval on either side:
      there a cell ends, and the path has to be led around.

    The number of intervals is what Huang 2001 minimises (the sum of altitudes over D); counting them on real
    transects leaves out inlets that no transect meets.

    Parameters
    ----------
    edges : ndarray, shape (n, 2, 2)
        The polygon's edges, in planar metres, in any order.
    heading_rad
        Direction of the transects, clockwise from north.
    spacing_m
        Distance between neighbouring transects.
    area_m2
        The polygon's area.
    """
    line, low, high = _intervals(to_sweep(edges, heading_rad), spacing_m)
    if len(line) == 0:
        return math.inf
    onward, next_one = _neighbours(line, low, high, 1)
    backward, _ = _neighbours(line, low, high, -1)
    here = np.flatnonzero(onward == 1)
    there = next_one[here]
    askew = np.minimum(np.abs(low[there] - low[here]), np.abs(high[there] - high[here]))
    links = 0.5 * np.hypot(spacing_m, askew).sum()
    ends = np.abs(onward - 1).sum() + np.abs(backward - 1).sum()
    return float(((high - low).sum() + links + spacing_m * ends) / area_m2)


def _intervals(edges: FloatArray, spacing_m: float) -> tuple[IntArray, FloatArray, FloatArray]:
    """Where transect lines cross the water: line numbers, and lower and upper ends, in order."""
    u, v = edges[..., 0] / spacing_m, edges[..., 1]
    first, last = np.sort(np.ceil(u).astype(np.int64), axis=1).T
    count = last - first
    edge = np.repeat(np.arange(len(edges)), count)
    line = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + first[edge]
    share = (line - u[edge, 0]) / (u[edge, 1] - u[edge, 0])
    crossing = v[edge, 0] + share * (v[edge, 1] - v[edge, 0])
    order = np.lexsort((crossing, line))
    line, crossing = line[order], crossing[order]
    return line[::2], crossing[::2], crossing[1::2]


def _neighbours(line: IntArray, low: FloatArray, high: FloatArray, step: int) -> tuple[IntArray, IntArray]:
    """How many intervals of the line `step` further on each interval overlaps, and the lowest of them."""
    height = 2.0 * (high.max() - low.min())
    base = line * height - low.min()
    first = np.searchsorted(base + high, base + step * height + low, side="right")
    last = np.searchsorted(base + low, base + step * height + high, side="left")
    return np.maximum(last - first, 0), first
