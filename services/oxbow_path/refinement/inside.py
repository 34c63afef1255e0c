"""Whether segments lie in the free space: those whose ends are far enough from all shore do."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow_path.refinement.polyline import Polyline

__all__ = ["Inside"]


@dataclass(frozen=True)
class Inside:
    """The free space (prepared), and its border as places `pitch_m` apart."""

    free: BaseGeometry
    pitch_m: float

    @cached_property
    def _border(self) -> cKDTree:
        return cKDTree(shapely.get_coordinates(shapely.segmentize(self.free.boundary, self.pitch_m)))

    def clear_m(self, places: FloatArray, most_m: float) -> FloatArray:
        """How far places (n, 2) are from the border at least, up to about `most_m`; less than nothing outside."""
        bound_m = most_m + self.pitch_m / 2
        distance_m, _ = self._border.query(places, distance_upper_bound=bound_m)
        inside = shapely.contains_xy(self.free, places[:, 0], places[:, 1])
        return np.where(inside, np.minimum(distance_m, bound_m) - self.pitch_m / 2, -np.inf)

    def leaving(self, path: Polyline, asked: Indices, clear_m: FloatArray) -> Mask:
        """Which of the asked segments leave the free space; each node (n,) is at least so clear of its border.

        Circles of these radii about a segment's two ends lie inside, and cover it where they meet.
        """
        unsure = clear_m[asked] + clear_m[asked + 1] < path.lengths_m[asked]
        few = asked[unsure]
        leaving = np.zeros(len(asked), dtype=bool)
        lines = shapely.linestrings(path.nodes[np.stack([few, few + 1], axis=1)])
        leaving[unsure] = ~shapely.covers(self.free, lines)
        return leaving
