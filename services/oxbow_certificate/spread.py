"""How distance to the path is spread over a region: evenness, beyond the one worst place."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPolygon

from oxbow.contracts import FloatArray
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

    The region is cut into triangles, laid end to end by area, and each of `count` equal shares of the whole takes
    one place: within a triangle they are a Fibonacci lattice. No place is rejected, however thin the region, and
    no grid falls into step with parallel transects.
    """
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(region))
    corners = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    areas = shapely.area(triangles)
    ends = np.cumsum(areas)
    at = (np.arange(count) + 0.5) / count * ends[-1]
    chosen = np.searchsorted(ends, at)
    a, b, c = corners[chosen].transpose(1, 0, 2)
    root = np.sqrt((ends[chosen] - at) / areas[chosen])[:, None]
    v = (np.arange(count) / _GOLDEN_RATIO % 1.0)[:, None]
    return np.asarray((1 - root) * a + root * ((1 - v) * b + v * c))
