"""Discrepancy of the positions that paths sample: their distance from uniformity over a region."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely import LineString, MultiPolygon

from oxbow.arrays import FloatArray
from oxbow_certificate.axes import Paths, coordinates_along, long_side

__all__ = ["Discrepancy", "centred_discrepancy", "discrepancy", "unit_square"]

_MOST_POSITIONS = 4_000
_CHUNK = 512
_GOLDEN_RATIO = (1 + math.sqrt(5)) / 2


class _Edges(NamedTuple):
    """Edges by their west and east ends, shape (n, 2); `sign` is 1 above the region's inside, -1 below it."""

    west: FloatArray
    east: FloatArray
    sign: FloatArray


@dataclass(frozen=True)
class Discrepancy:
    """Centred L2 discrepancy, and its ratio to that expected of as many random positions."""

    value: float
    ratio: float


def discrepancy(region: MultiPolygon, paths: Paths, spacing_m: float, tolerance_m: float) -> Discrepancy | None:
    """Discrepancy of the positions of paths in a region (Rendas and Li 2016, section 1.2.1, entropy/discrepancy).

    There is one position on each `spacing_m` of a path, or on longer pieces if there would be more than 4 000.
    They are mapped to the unit square by `unit_square`, in axes along the long side of the region's least
    rectangle, and their centred discrepancy (Hickernell 1998) is taken there. That is the same for mirrored and
    swapped axes, so it does not change when region and path are turned together.

    Parameters
    ----------
    region
        Where positions should be uniform.
    paths
        What is sampled.
    spacing_m
        The length of path per position.
    tolerance_m
        Positions farther from the region than this are left out; nearer ones count as on its border.

    Returns
    -------
    Discrepancy or None
        None if no position is in the region.
    """
    piece_m = max(spacing_m, paths.length / _MOST_POSITIONS)
    positions = np.concatenate([_positions(path, piece_m) for path in shapely.get_parts(paths)])
    shapely.prepare(region)
    positions = positions[shapely.dwithin(region, shapely.points(positions), tolerance_m)]
    along = long_side(region)
    upright = shapely.transform(region, lambda xy: coordinates_along(xy, along))
    square = unit_square(upright, coordinates_along(positions, along))
    if not len(square):
        return None
    squared = centred_discrepancy(square)
    # The mean of the kernel prod(1 + |x - 1/2|) less that over independent pairs: (5/4)^2 - (13/12)^2.
    expected = 7 / 18 / len(square)
    return Discrepancy(math.sqrt(squared), math.sqrt(squared / expected))


def centred_discrepancy(square: FloatArray) -> float:
    """The squared centred L2 discrepancy of places in the unit square (Hickernell 1998).

    That of `scipy.stats.qmc.discrepancy`, in less time. For two coordinates on one side of the middle, the factor
    1 + (|x - 1/2| + |y - 1/2| - |x - y|) / 2 of the double sum is 1 + min(|x - 1/2|, |y - 1/2|), and otherwise it
    is 1. The product over both axes is thus a sum of four terms: of these, only that of both minima is a sum over
    pairs, and only over those within a quadrant.

    Parameters
    ----------
    square
        Places, shape (n, 2), n > 0, each coordinate in [0, 1].

    Returns
    -------
    float
        At least 0, but for rounding.
    """
    count = len(square)
    off = np.abs(square - 0.5)
    side = (square > 0.5) @ np.array([1, 2])
    pairs = float(count**2)
    for axis in (0, 1):
        for here in (side & (1 << axis) == 0, side & (1 << axis) != 0):
            pairs += _sum_of_minima(off[here, axis])
    for quadrant in range(4):
        pairs += _sum_of_products_of_minima(off[side == quadrant])
    single = float(np.sum(np.prod(1.0 + off / 2 - off**2 / 2, axis=1)))
    return (13 / 12) ** 2 - 2 * single / count + pairs / count**2


def _sum_of_minima(values: FloatArray) -> float:
    """The sum of min(a, b) over all ordered pairs of values, those of a value with itself included."""
    # The k-th largest is the lesser one of 2 k + 1 pairs.
    return float(np.sort(values)[::-1] @ (2 * np.arange(len(values)) + 1))


def _sum_of_products_of_minima(values: FloatArray) -> float:
    """The sum of min(a0, b0) min(a1, b1) over all ordered pairs of rows of `values` (n, 2)."""
    # From the largest first column on, the later row of a pair has the lesser one.
    first, second = values[np.argsort(-values[:, 0])].T
    total = float(first @ second)
    for start in range(0, len(values), _CHUNK):
        rows = slice(start, start + _CHUNK)
        lesser = np.minimum(second[rows, None], second[: start + _CHUNK])
        total += 2.0 * float(first[rows] @ np.tril(lesser, start - 1).sum(axis=1))
    return total


def unit_square(region: MultiPolygon, places: FloatArray) -> FloatArray:
    """Map places of a region to the unit square so that equal areas become equal areas (Rosenblatt 1952).

    The first coordinate is the fraction of the region's area west of a place. The second is the fraction south of
    it of the upright line through it, as far as that runs in the region. What is uniform on the region becomes
    uniform on the square, whatever the region's shape, and on an upright rectangle the map is a scaling. Places
    beside the region count as on its border.

    Parameters
    ----------
    region
        Of positive area.
    places
        Shape (n, 2), in metres.

    Returns
    -------
    ndarray, shape (m, 2)
        In the order of their first coordinate; without places at a gap between parts, so that m may be less than
        n.
    """
    west, east, sign = _edges(region)
    # Edges are met from their west end to just before their east end, so that no place at a vertex meets two. The
    # easternmost places are moved in accordingly.
    inner = np.clip(places[:, 0], west[:, 0].min(), np.nextafter(east[:, 0].max(), -np.inf))
    # Sorted by x, the places that an edge passes over or under are a run, found by two binary searches.
    order = np.argsort(inner, kind="stable")
    x, y = inner[order], places[order, 1]
    # Edge e meets the upright lines of places first[e] <= place < last[e].
    first, last = np.searchsorted(x, west[:, 0]), np.searchsorted(x, east[:, 0])
    edge = np.repeat(np.arange(len(first)), last - first)
    place = np.arange(len(edge)) - np.repeat(np.cumsum(last - first) - last, last - first)
    ahead = x[place] - west[edge, 0]
    slope = (east[:, 1] - west[:, 1]) / (east[:, 0] - west[:, 0])
    height = west[edge, 1] + slope[edge] * ahead

    def total(of_meetings: FloatArray) -> FloatArray:
        return np.bincount(place, sign[edge] * of_meetings, minlength=len(x)).astype(np.float64)

    chord, south = total(height), total(np.minimum(height, y[place]))
    # The area west of a place: the trapezoids under all edges that end west of it, and the parts of those that it
    # meets.
    under = sign * (east[:, 0] - west[:, 0]) * (east[:, 1] + west[:, 1]) / 2
    passed = np.concatenate([[0.0], np.cumsum(under[np.argsort(east[:, 0])])])
    area_west = passed[np.searchsorted(np.sort(east[:, 0]), x, side="right")]
    area_west += total(ahead * (west[edge, 1] + height) / 2)
    met = chord > 0
    square = np.column_stack([area_west[met] / region.area, south[met] / chord[met]])
    return np.clip(square, 0.0, 1.0)


def _edges(region: MultiPolygon) -> _Edges:
    """The edges of `region` that are not upright; upright ones have no part in areas or chords."""
    rings = shapely.get_rings(shapely.get_parts(shapely.orient_polygons(region)))
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    start, end = xy[:-1], xy[1:]
    kept = (ring[:-1] == ring[1:]) & (start[:, 0] != end[:, 0])
    start, end = start[kept], end[kept]
    eastward = (start[:, 0] < end[:, 0])[:, None]
    # The region lies to the left of its edges: above one that runs east.
    return _Edges(
        np.where(eastward, start, end), np.where(eastward, end, start), np.where(eastward[:, 0], -1.0, 1.0)
    )


def _positions(path: LineString, piece_m: float) -> FloatArray:
    """One position on each of equal pieces of `path`, at offsets that do not fall into step with legs; (n, 2)."""
    count = math.ceil(path.length / piece_m)
    xy = shapely.get_coordinates(path)
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    wanted = (np.arange(count) + np.arange(count) / _GOLDEN_RATIO % 1.0) / count * at[-1]
    return np.column_stack([np.interp(wanted, at, xy[:, axis]) for axis in (0, 1)])
