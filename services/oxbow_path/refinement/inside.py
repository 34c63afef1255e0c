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
        """How far places are from the border at least.

        Parameters
        ----------
        places
            Shape (n, 2), in metres.
        most_m
            Distances greater than about this are not told apart.

        Returns
        -------
        ndarray, shape (n,)
            Lower bounds in metres, negative near the border; minus infinity outside the free space.
        """
        # The nearest point of the border may lie midway between two of its places.
        bound_m = most_m + self.pitch_m / 2
        distance_m, _ = self._border.query(places, distance_upper_bound=bound_m)
        inside = shapely.contains_xy(self.free, places[:, 0], places[:, 1])
        return np.where(inside, np.minimum(distance_m, bound_m) - self.pitch_m / 2, -np.inf)

    def leaving(self, path: Polyline, asked: Indices, clear_m: FloatArray) -> Mask:
        """Which of the asked segments leave the free space.

        Circles about a segment's two ends, as wide as these are clear of the border, lie inside, and cover the
        segment where they meet. Only where they do not is the exact predicate asked.

        Parameters
        ----------
        path
            With n nodes.
        asked
            The numbers of m segments.
        clear_m
            How far each node is from the border at least, shape (n,): of `clear_m`.

        Returns
        -------
        ndarray of bool, shape (m,)
        """
        unsure = clear_m[asked] + clear_m[asked + 1] < path.lengths_m[asked]
        few = asked[unsure]
        leaving = np.zeros(len(asked), dtype=bool)
        lines = shapely.linestrings(path.nodes[np.stack([few, few + 1], axis=1)])
        leaving[unsure] = ~shapely.covers(self.free, lines)
        return leaving
