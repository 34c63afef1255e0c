"""How distance to the path is spread over a region: evenness, beyond the one worst place."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPolygon

from oxbow.contracts import FloatArray
from oxbow_certificate.distance import PathDistance
from oxbow_certificate.quadtree import Squares

__all__ = ["DistanceSpread", "distance_spread", "stratified_places"]


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


def distance_spread(region: MultiPolygon, distance: PathDistance, *, count: int = 32_000) -> DistanceSpread:
    """Distance to a path over `region`, at `count` places or so."""
    places = stratified_places(region, count)
    return DistanceSpread(places, distance(places))


def stratified_places(region: MultiPolygon, count: int, *, seed: int = 0) -> FloatArray:
    """Places (n, 2) spread over `region` by area, n near `count`: the same for the same arguments.

    One place at random in each of equal squares (stratified sampling, McKay et al. 1979): a regular grid
    would fall into step with parallel transects.
    """
    shapely.prepare(region)
    squares = Squares.tiling(region, math.sqrt(region.area / count))
    jitter = np.random.default_rng(seed).uniform(-squares.half_m, squares.half_m, size=squares.centres.shape)
    places = squares.centres + jitter
    return np.asarray(places[shapely.contains_xy(region, places)])
