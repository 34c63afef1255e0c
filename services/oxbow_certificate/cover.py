"""The MinMax criterion of a path, with certified bounds, and the least that any path could reach."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon

from oxbow.contracts import FloatArray, Place
from oxbow_certificate.distance import PathDistance
from oxbow_certificate.quadtree import Squares

__all__ = ["CoverRadius", "cover_radius", "least_radius"]

_HOPEFUL = 16
"""Squares of a level whose nearest place of the region is tried as a lower bound."""


@dataclass(frozen=True)
class CoverRadius:
    """Bounds of the largest distance from a place of a region to a path; `place` is one that attains `low_m`."""

    low_m: float
    high_m: float
    place: Place


class Farthest(NamedTuple):
    """A place and its distance to the path."""

    place: Place
    distance_m: float


def least_radius(area_m2: float, length_m: float, paths: int = 1) -> float:
    """Least cover radius that paths of a given length in all could reach over a given area, in metres.

    The places within r of a connected curve of length L fill no more than 2 r L + pi r^2 (Hotelling 1939), those
    of n curves of that length together no more than 2 r L + n pi r^2, and they must fill the area. This is the
    positive root, in the form that loses no digits where L^2 is far above the area.
    """
    return area_m2 / (length_m + math.sqrt(length_m**2 + paths * math.pi * area_m2))


def cover_radius(
    region: MultiPolygon, distance: PathDistance, *, gap: float = 0.01, most_squares: int = 2_000_000
) -> CoverRadius:
    """Bound the largest distance from a place of `region` to a path (Rendas and Li 2016, section 1.2.1, MinMax).

    Distance changes by no more than the way gone (it is 1-Lipschitz), so that over a square it is at most that of
    the centre plus half the diagonal. Squares whose bound is not above what some place of the region attains are
    dropped, the others quartered: the method of Shubert (1972) on a quadtree in place of an interval.

    Parameters
    ----------
    region
        Where distances are taken; of positive area.
    distance
        Distance to the path.
    gap
        The relative gap between the bounds at which the search ends.
    most_squares
        Squares that may be examined: before there are more, the search ends with the bounds it has, wider than
        `gap`.
    """
    shapely.prepare(region)
    place, low_m = _farthest(shapely.get_coordinates(region), distance)
    squares = Squares.around(region)
    examined = 0
    while True:
        centre_m = distance(squares.centres)
        examined += len(squares)
        hopeful = squares.centres[np.argsort(-centre_m, kind="stable")[:_HOPEFUL]]
        candidate, candidate_m = _farthest(_nearest_places(region, hopeful), distance)
        if candidate_m > low_m:
            place, low_m = candidate, candidate_m
        upper_m = centre_m + squares.circumradius_m
        alive = upper_m > low_m * (1 + gap)
        high_m = max(low_m * (1 + gap), float(upper_m.max()))
        squares = squares.where(alive).meeting(region)
        if not len(squares):
            return CoverRadius(low_m, low_m * (1 + gap), place)
        if examined + 4 * len(squares) > most_squares:
            return CoverRadius(low_m, high_m, place)
        squares = squares.quarters()


def _farthest(places: FloatArray, distance: PathDistance) -> Farthest:
    distances = distance(places)
    index = int(np.argmax(distances))
    return Farthest((float(places[index, 0]), float(places[index, 1])), float(distances[index]))


def _nearest_places(region: MultiPolygon, places: FloatArray) -> FloatArray:
    """The place of `region` nearest to each place: itself, where it is inside."""
    return shapely.get_coordinates(shapely.shortest_line(region, shapely.points(places)))[::2]
