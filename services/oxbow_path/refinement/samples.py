"""Places of the free space that pull the path towards them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import Polygon, STRtree

from oxbow.arrays import FloatArray
from oxbow.contracts import WeightedArea
from oxbow.geometry.lattice import triangular_lattice

__all__ = ["Samples", "weights_at"]

TILT_RAD = 0.5
"""The lattice is turned by this angle, so that no row falls into step with legs along an axis."""

SHORE_PITCH = 0.8
"""Distance of shore places, in pitches of the lattice."""


@dataclass(frozen=True)
class Samples:
    """Places (n, 2) and the weight of each (n,), of mean 1: the distance to the path counts `weight` times.

    The places are a hexagonal lattice over the free space, and places along its shore about as close. A lattice
    leaves no hole; a low-discrepancy sequence carried from a square into triangles or cells is sheared in slender
    ones, and the path then evades the holes between its rows.
    """

    points: FloatArray
    weights: FloatArray

    @classmethod
    def over(cls, free: Polygon, pitch_m: float, areas: Sequence[WeightedArea] = ()) -> Samples:
        """Cover `free` by places about `pitch_m` apart.

        Parameters
        ----------
        free
            The free space.
        pitch_m
            Distance of neighbouring places of the lattice.
        areas
            Where sampling is to be denser, or less dense.

        Returns
        -------
        Samples
            At least those on the shore.
        """
        # A lattice leaves a strip along the shore without places, in which the farthest water often lies.
        shore = shapely.get_coordinates(shapely.segmentize(free.boundary, SHORE_PITCH * pitch_m))
        points = np.vstack([_lattice(free, pitch_m), shore])
        return cls(points, weights_at(points, areas))

    @cached_property
    def area_weights(self) -> FloatArray:
        """The weight of each place where places are weighed, not distances."""
        return np.asarray(self.weights**2)

    def __len__(self) -> int:
        return len(self.points)


def _lattice(free: Polygon, pitch_m: float) -> FloatArray:
    """The points of a hexagonal lattice inside a polygon."""
    x0, y0, x1, y1 = free.bounds
    middle, radius_m = np.array([x0 + x1, y0 + y1]) / 2, math.hypot(x1 - x0, y1 - y0) / 2
    cos, sin = math.cos(TILT_RAD), math.sin(TILT_RAD)
    turn = np.array([[cos, sin], [-sin, cos]])
    upright = shapely.transform(free, lambda xy: (xy - middle) @ turn.T)
    places = triangular_lattice(upright, (-radius_m, -radius_m), pitch_m)
    return np.asarray(places @ turn + middle)


def weights_at(points: FloatArray, areas: Sequence[WeightedArea]) -> FloatArray:
    """The weight of each place: that of the area that holds it, 1 outside all; scaled to a mean of 1.

    Parameters
    ----------
    points
        Shape (n, 2), in metres.
    areas
        In the same frame; they do not overlap.

    Returns
    -------
    ndarray, shape (n,)
        All 1 where the areas leave no weight at all.
    """
    weights = np.ones(len(points))
    if areas:
        # Areas do not overlap, so that no place has two weights.
        place, area = STRtree([entry.area for entry in areas]).query(shapely.points(points), predicate="within")
        weights[place] = np.array([entry.weight for entry in areas])[area]
    mean = weights.mean()
    return np.asarray(weights / mean) if mean > 0.0 else np.ones(len(points))
