"""The MinMax criterion of a path, with certified bounds, and the least that any path could reach."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon

from oxbow.arrays import FloatArray, Place
from oxbow.tolerances import ROUNDING_M
from oxbow_certificate.distance import PathDistance
from oxbow_certificate.quadtree import Squares

__all__ = ["CoverRadius", "cover_radius", "least_radius"]

_MOST_FIRST = 2_000
"""From so many squares on, the search begins."""

_FINE = 4.0
"""Bounds of the distance suffice for squares whose circumradius is more than this fraction of it: 1 / 4."""

_HOPEFUL = 16
"""How many squares of a level are tried for a lower bound, by the place of the region nearest to each centre."""


@dataclass(frozen=True)
class CoverRadius:
    """Bounds of the largest distance from a place of a region to a path; `place` has the distance `low_m`."""

    low_m: float
    high_m: float
    place: Place


class Farthest(NamedTuple):
    """A place, and its distance to the path."""

    place: Place
    distance_m: float


class FarthestCentres(NamedTuple):
    """Places, the farthest first, shape (n, 2), and the distance of the farthest to the path."""

    places: FloatArray
    distance_m: float


def least_radius(area_m2: float, length_m: float, paths: int = 1) -> float:
    """The least cover radius that paths of a given total length could reach over a given area, in metres.

    The places within r of a connected curve of length L fill no more than 2 r L + pi r^2 (Hotelling 1939), those
    of n curves of that length together no more than 2 r L + n pi r^2, and they must fill the area. This is the
    positive root, in the form that loses no digits where L^2 is far above the area.

    Parameters
    ----------
    area_m2
        The area to be covered, > 0.
    length_m
        The length of all paths together.
    paths
        The number of paths.

    Returns
    -------
    float
        In metres: a bound, which no path quite reaches, since its swaths overlap at every bend.
    """
    return area_m2 / (length_m + math.sqrt(length_m**2 + paths * math.pi * area_m2))


def cover_radius(
    region: MultiPolygon, distance: PathDistance, *, gap: float = 0.01, most_squares: int = 2_000_000
) -> CoverRadius:
    """Bound the largest distance from a place of `region` to a path (Rendas and Li 2016, section 1.2.1, MinMax).

    Distance is 1-Lipschitz, so that over a square it is at most that of the centre plus half the diagonal. Squares
    whose bound is not above the distance of some place of the region are dropped, and the others quartered: the
    method of Shubert (1972) on a quadtree instead of an interval. Most squares are dropped by an upper bound of
    that distance, before the distance itself is computed.

    Parameters
    ----------
    region
        Where distances are taken; of positive area.
    distance
        Distance to the path.
    gap
        The relative gap between the bounds at which the search ends, > 0.
    most_squares
        The most squares to examine: before there are more, the search ends with the bounds that it has, farther
        apart than `gap`.

    Returns
    -------
    CoverRadius
        Its bounds are within `gap` of one another, relative, unless the squares ran out; they hold in any case.
    """
    shapely.prepare(region)
    # The corners of the region give a first lower bound: the worst place is often a bay's end.
    corners = shapely.get_coordinates(region)
    place, low_m = _farthest(_farthest_centres(corners, distance.bounds(corners), distance).places, distance)
    squares = Squares.around(region)
    # Squares as large as that distance could hardly be dropped: begin with smaller ones.
    while squares.circumradius_m > low_m and len(squares) < _MOST_FIRST:
        squares = squares.meeting(region).quarters()
    examined = 0
    while True:
        examined += len(squares)
        bound_m = distance.bounds(squares.centres)
        hopeful, hopeful_m = _farthest_centres(squares.centres, bound_m, distance)
        candidate, candidate_m = _farthest(_nearest_places(region, hopeful), distance)
        if candidate_m > low_m:
            place, low_m = candidate, candidate_m
        # The bound of all squares together; valid wherever the loop stops.
        high_m = max(low_m * (1 + gap), hopeful_m + squares.circumradius_m)
        # The two distances of a place may be computed in different axes: rounding must not drop a square that the
        # exact one would keep.
        may_be_alive = bound_m + squares.circumradius_m > low_m * (1 + gap) - ROUNDING_M
        squares = squares.where(may_be_alive).meeting(region)
        # Bounds are mostly the distance itself. Were nothing else looked at, though, where they are not would be
        # searched for ever.
        if squares.circumradius_m * _FINE < low_m:
            alive = distance(squares.centres) + squares.circumradius_m > low_m * (1 + gap)
            squares = squares.where(alive)
        if not len(squares):
            return CoverRadius(low_m, low_m * (1 + gap), place)
        if examined + 4 * len(squares) > most_squares:
            return CoverRadius(low_m, high_m, place)
        squares = squares.quarters()


def _farthest_centres(centres: FloatArray, bound_m: FloatArray, distance: PathDistance) -> FarthestCentres:
    """The centres farthest from the path, and the distance of the farthest, by way of upper bounds of all."""
    # A few exact distances give a threshold; a centre whose bound is below it cannot be among the farthest.
    order = np.argsort(-bound_m, kind="stable")
    likely = order[: 4 * _HOPEFUL]
    likely_m = distance(centres[likely])
    least_m = np.sort(likely_m)[-_HOPEFUL:][0]
    others = order[4 * _HOPEFUL : np.searchsorted(-bound_m[order], ROUNDING_M - least_m, side="right")]
    found = np.concatenate([likely, others])
    found_m = np.concatenate([likely_m, distance(centres[others])]) if len(others) else likely_m
    farthest = np.lexsort([found, -found_m])[:_HOPEFUL]
    return FarthestCentres(centres[found[farthest]], float(found_m[farthest[0]]))


def _farthest(places: FloatArray, distance: PathDistance) -> Farthest:
    distances = distance(places)
    index = int(np.argmax(distances))
    return Farthest((float(places[index, 0]), float(places[index, 1])), float(distances[index]))


def _nearest_places(region: MultiPolygon, places: FloatArray) -> FloatArray:
    """The place of `region` (prepared) nearest to each place: itself, where it is inside."""
    beside = ~shapely.contains_xy(region, places)
    nearest = places.copy()
    nearest[beside] = shapely.get_coordinates(shapely.shortest_line(region, shapely.points(places[beside])))[::2]
    return nearest
