"""A triangulation that is changed step by step: points are added and sides flipped; it always tiles one area."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import Polygon

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.geometry.flips import legalised
from oxbow.geometry.triangles import (
    apexes,
    doubled_areas,
    following,
    side_lengths,
    triangulated,
    twins_of,
)

__all__ = ["Triangulation"]


@dataclass(frozen=True)
class Triangulation:
    """Triangles that tile an area; every change gives a new triangulation of the same area.

    Parameters
    ----------
    points
        The vertices, in planar metres, shape (n, 2).
    triangles
        Vertices of every triangle, counterclockwise, shape (m, 3).
    """

    points: FloatArray
    triangles: Indices

    @classmethod
    def of(cls, area: Polygon) -> Triangulation:
        """The constrained Delaunay triangulation of a polygon's own vertices."""
        return cls(*triangulated(area)).legalised()

    @cached_property
    def twins(self) -> Indices:
        """See `twins_of`."""
        return twins_of(self.triangles)

    @cached_property
    def corners(self) -> FloatArray:
        """Coordinates of the corners, shape (m, 3, 2)."""
        return self.points[self.triangles]

    @cached_property
    def doubled_areas(self) -> FloatArray:
        """Twice the area of every triangle, in m2, shape (m,); negative if it is turned over."""
        return doubled_areas(self.corners)

    @cached_property
    def side_lengths(self) -> FloatArray:
        """Length of every side, shape (m, 3)."""
        return side_lengths(self.corners)

    @cached_property
    def least_sines(self) -> FloatArray:
        """The sine of every triangle's least angle, shape (m,); negative if it is turned over."""
        # The least angle lies opposite the shortest side.
        middle, longest = np.sort(self.side_lengths, axis=1)[:, 1:].T
        return np.asarray(self.doubled_areas / (middle * longest))

    @cached_property
    def border_points(self) -> Mask:
        """Which points lie on the border of the area, shape (n,)."""
        on_border = np.zeros(len(self.points), dtype=bool)
        on_border[self.triangles.ravel()[self.twins < 0]] = True
        return on_border

    def legalised(self) -> Triangulation:
        """The constrained Delaunay triangulation of the same points, by flips (`oxbow.geometry.flips`)."""
        return Triangulation(self.points, legalised(self.points, self.triangles, self.twins)[0])

    def located(self, places: FloatArray) -> Indices:
        """The number of a triangle that holds each place, shape (n,); -1 outside the area."""
        tree = shapely.STRtree(np.asarray(shapely.polygons(self.corners)))
        place, triangle = tree.query(shapely.points(places), predicate="intersects")
        holder = np.full(len(places), -1, dtype=np.intp)
        # Backwards, so that on a shared edge the first triangle found is the one that stays.
        holder[place[::-1]] = triangle[::-1]
        return holder

    def with_points(self, places: FloatArray) -> Triangulation:
        """The constrained Delaunay triangulation with more points, all strictly inside the area.

        In each round every triangle takes the point nearest to its centroid and is divided in three.
        """
        mesh = self
        while len(places):
            holder = mesh.located(places)
            # By rounding, a place beside the border may come to lie outside.
            places, holder = places[holder >= 0], holder[holder >= 0]
            if len(places) == 0:
                break
            from_middle = np.hypot(*(places - mesh.corners[holder].mean(axis=1)).T)
            order = np.lexsort([from_middle, holder])
            chosen = order[np.unique(holder[order], return_index=True)[1]]
            mesh = mesh._divided(holder[chosen], places[chosen]).legalised()
            places = np.delete(places, chosen, axis=0)
        return mesh

    def _divided(self, which: Indices, places: FloatArray) -> Triangulation:
        """Each of some triangles divided in three, at a place inside it."""
        new = len(self.points) + np.arange(len(places))
        a, b, c = self.triangles[which].T
        triangles = self.triangles.copy()
        triangles[which] = np.column_stack([a, b, new])
        more = np.vstack([np.column_stack([b, c, new]), np.column_stack([c, a, new])])
        return Triangulation(np.vstack([self.points, places]), np.vstack([triangles, more]))

    def with_border_points(self, sides: Indices) -> Triangulation:
        """The constrained Delaunay triangulation with some border sides halved, at most one per triangle."""
        tails, heads = self.triangles.ravel()[sides], self.triangles.ravel()[following(sides)]
        apex = apexes(self.triangles, sides)
        new = len(self.points) + np.arange(len(sides))
        points = np.vstack([self.points, (self.points[tails] + self.points[heads]) / 2])
        triangles = self.triangles.copy()
        triangles[sides // 3] = np.column_stack([tails, new, apex])
        return Triangulation(points, np.vstack([triangles, np.column_stack([new, heads, apex])])).legalised()
