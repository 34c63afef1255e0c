"""How distance to the path is distributed over a region, beyond its single worst place."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from shapely import MultiPolygon

from oxbow.arrays import FloatArray
from oxbow.geometry.triangles import spread
from oxbow_certificate.distance import PathDistance

__all__ = ["DistanceSpread", "distance_spread", "even_places"]

_GOLDEN_RATIO = (1 + math.sqrt(5)) / 2


@dataclass(frozen=True)
class DistanceSpread:
    """Places spread evenly over a region, shape (n, 2), and their distances to a path, in metres, shape (n,)."""

    places: FloatArray
    distance_m: FloatArray

    @property
    def mean_m(self) -> float:
        """Mean distance."""
        return float(self.distance_m.mean())

    @property
    def p95_m(self) -> float:
        """The distance within which 95 % of the area lies."""
        return float(np.quantile(self.distance_m, 0.95))

    @property
    def p99_m(self) -> float:
        """The distance within which 99 % of the area lies."""
        return float(np.quantile(self.distance_m, 0.99))


def distance_spread(region: MultiPolygon, distance: PathDistance, *, count: int = 32_000) -> DistanceSpread:
    """Distance to a path at places spread evenly over a region.

    Parameters
    ----------
    region
        Of positive area.
    distance
        Distance to the path.
    count
        The number of places.

    Returns
    -------
    DistanceSpread
        Of `count` places.
    """
    places = even_places(region, count)
    return DistanceSpread(places, distance(places))


def even_places(region: MultiPolygon, count: int) -> FloatArray:
    """Places spread over `region` evenly by area, shape (count, 2); the same for the same arguments.

    They are a Fibonacci lattice of the unit square, mapped to the region: each of `count` equal parts of the area
    gets one place, and there is no grid to fall into step with parallel transects.

    Parameters
    ----------
    region
        Of positive area.
    count
        The number of places.

    Returns
    -------
    ndarray, shape (count, 2)
        In metres, in the order in which the region's triangles are laid end to end.
    """
    number = np.arange(count)
    return spread(np.column_stack([(number + 0.5) / count, number / _GOLDEN_RATIO % 1.0]), region)
