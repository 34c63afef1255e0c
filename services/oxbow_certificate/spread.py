"""How distance to the path is spread over a region: evenness, beyond the one worst place."""

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
    """Places spread evenly over a region (n, 2), and the distance of each to a path (n,), in metres."""

    places: FloatArray
    distance_m: FloatArray

    @property
    def mean_m(self) -> float:
        """Mean distance."""
        return float(self.distance_m.mean())

    @property
    def p95_m(self) -> float:
        """The distance that 95 % of the area is within."""
        return float(np.quantile(self.distance_m, 0.95))

    @property
    def p99_m(self) -> float:
        """The distance that 99 % of the area is within."""
        return float(np.quantile(self.distance_m, 0.99))


def distance_spread(region: MultiPolygon, distance: PathDistance, *, count: int = 32_000) -> DistanceSpread:
    """Distance to a path at `count` places of `region`."""
    places = even_places(region, count)
    return DistanceSpread(places, distance(places))


def even_places(region: MultiPolygon, count: int) -> FloatArray:
    """Places (count, 2) spread over `region` evenly by area: the same for the same arguments.

    A Fibonacci lattice of the unit square: each of `count` equal shares of the area takes one place, and no grid
    falls into step with parallel transects.
    """
    number = np.arange(count)
    return spread(np.column_stack([(number + 0.5) / count, number / _GOLDEN_RATIO % 1.0]), region)
