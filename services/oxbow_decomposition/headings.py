"""Which way the transects should run: a cheap forecast of a plan's length for each of several headings."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely import Polygon

from oxbow.arrays import FloatArray
from oxbow.contracts import HeadingScore
from oxbow.geometry.sweep import to_sweep

__all__ = ["candidate_headings", "predicted_cost", "scored_headings"]

EVEN_HEADINGS = 16
SHORE_HEADINGS = 3

DETAIL = 0.25
"""Bends of the shore smaller than this, in spacings, do not count."""

ACROSS, ALONG = 0.25, 0.75
"""Metres of path per metre of shore, fitted to plans of lakes at eight headings each (R2 0.8 within a lake)."""


def scored_headings(free: Polygon, spacing_m: float) -> tuple[HeadingScore, ...]:
    """The predicted cost of every candidate heading, in rising order of the heading.

    Parameters
    ----------
    free
        A valid polygon in planar metres.
    spacing_m
        Distance between neighbouring transects.

    Returns
    -------
    tuple of HeadingScore
        Their costs in metres of path per square metre of water; the least is the best.
    """
    rings = shapely.get_rings(shapely.simplify(free, DETAIL * spacing_m))
    steps = np.concatenate([np.diff(shapely.get_coordinates(ring), axis=0) for ring in rings])
    return tuple(
        HeadingScore(heading_rad=heading, predicted_cost=predicted_cost(steps, heading, spacing_m, free.area))
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
    # Weighted by length: a ragged shore has most of its edges, but little of its length, in any one direction.
    length, _ = np.histogram(_headings(steps), bins, (0.0, math.pi), weights=np.hypot(*steps.T))
    along = (np.argsort(-length, kind="stable")[:SHORE_HEADINGS] + 0.5) * math.pi / bins
    return sorted(set(np.concatenate([fan, _headings(rectangle), along]).tolist()))


def _headings(steps: FloatArray) -> FloatArray:
    return np.arctan2(steps[:, 0], steps[:, 1]) % math.pi


def predicted_cost(steps: FloatArray, heading_rad: float, spacing_m: float, area_m2: float) -> float:
    """Metres of path that a square metre of water is expected to take under one heading.

    The transects themselves take 1 / D. The rest is owed to the shore, and it matters which way the shore runs.
    Where it runs across the transects, they end at it: turns, and the links from one to the next. Where it
    runs along them, the last transect stands at an odd distance from it, and what is left between the two has to
    be reached by branches that are travelled out and back, or is swept twice. So a shore costs `ACROSS` metres of
    path for each metre across the transects and `ALONG` for each metre along them.

    The number of turns, which Huang 2001 minimises, counts the first kind alone: on ragged lakes, where arms
    are a few spacings wide, it prefers the worse heading.

    Parameters
    ----------
    steps : ndarray, shape (n, 2)
        The shore's edges as vectors, in planar metres, without detail finer than a share of the spacing.
    heading_rad
        Direction of the transects, clockwise from north.
    spacing_m
        Distance between neighbouring transects.
    area_m2
        The water's area.

    Returns
    -------
    float
        In metres of path per square metre of water.
    """
    across_m, along_m = np.abs(to_sweep(steps, heading_rad)).sum(axis=0)
    return float(1 / spacing_m + (ACROSS * across_m + ALONG * along_m) / area_m2)
