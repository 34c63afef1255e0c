"""A triangulation that is changed step by step: points put in, sides flipped, always tiling the same area.

A triangulation here is two arrays: points, shape (n, 2), and triangles, shape (m, 3), of indices into the points,
counterclockwise. Side k of a triangle is the one opposite its corner k, and has the number ``3 * triangle + k``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from oxbow.contracts import FloatArray

__all__ = ["Indices", "Triangulation", "cross", "twins_of"]

Indices = npt.NDArray[np.intp]

SIDES = np.array([[1, 2], [2, 0], [0, 1]])
"""The corners at the two ends of each side."""

FLIP_TOLERANCE = 1e-10
"""Sides whose opposite angles sum to less than pi and this are left: flipping them would gain nothing."""

MAX_FLIPS = 200
"""Rounds of flips: rounding could let a few sides flip to and fro for ever."""

ROUNDING = 2.0**-48
"""Triangles smaller than this share of the squared extent are flat, but for rounding."""


def twins_of(triangles: Indices) -> Indices:
    """The number of the same side as its other triangle sees it, shape (3 m,); -1 on the border."""
    sides = np.sort(triangles[:, SIDES].reshape(-1, 2), axis=1)
    key = sides[:, 0] * (sides.max(initial=0) + 1) + sides[:, 1]
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    one, other = order[first], order[first + 1]
    twins = np.full(len(key), -1, dtype=np.intp)
    twins[one], twins[other] = other, one
    return twins


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """The cross product of planar vectors, shape (n, 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


@dataclass(frozen=True)
class Triangulation:
    """Triangles that tile an area; every change gives a new one that tiles the same area."""

    points: FloatArray
    triangles: Indices

    @classmethod
    def of(cls, area: Polygon) -> Triangulation:
        """The constrained Delaunay triangulation of a polygon's own vertices (Chew 1989, through GEOS)."""
        parts = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
        corners = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]
        points, index = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
        triangles = index.reshape(-1, 3)
        negative = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) < 0
        triangles[negative] = triangles[negative, ::-1]
        return cls(points, triangles).flipped()

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
        """Twice the area of every triangle, in m2; negative where it is turned over."""
        return cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])

    @cached_property
    def side_lengths(self) -> FloatArray:
        """Length of every side, shape (m, 3)."""
        ends = self.corners[:, SIDES]
        return np.asarray(np.hypot(*np.moveaxis(ends[:, :, 1] - ends[:, :, 0], 2, 0)))

    @cached_property
    def least_sines(self) -> FloatArray:
        """The sine of every triangle's least angle, opposite its shortest side; below 0 if turned over."""
        middle, longest = np.sort(self.side_lengths, axis=1)[:, 1:].T
        return np.asarray(self.doubled_areas / (middle * longest))

    @cached_property
    def border_points(self) -> npt.NDArray[np.bool_]:
        """Which points lie on the border of the area, shape (n,)."""
        on_border = np.zeros(len(self.points), dtype=bool)
        on_border[self.triangles[:, SIDES].reshape(-1, 2)[self.twins < 0]] = True
        return on_border

    def flipped(self) -> Triangulation:
        """The constrained Delaunay triangulation of the same points, by Lawson's flips (1977).

        All sides that no other flip touches are flipped at once, round after round.
        """
        triangles, twins = self.triangles, self.twins
        for _ in range(MAX_FLIPS):
            side = _flippable(self.points, triangles, twins)
            if len(side) == 0:
                break
            triangles = _flip(triangles, side, twins[side])
            twins = twins_of(triangles)
        return Triangulation(self.points, triangles)

    def located(self, places: FloatArray) -> Indices:
        """The number of a triangle that holds each place, shape (n,); -1 outside the area."""
        tree = shapely.STRtree(np.asarray(shapely.polygons(self.corners)))
        place, triangle = tree.query(shapely.points(places), predicate="intersects")
        holder = np.full(len(places), -1, dtype=np.intp)
        holder[place[::-1]] = triangle[::-1]
        return holder

    def with_points(self, places: FloatArray) -> Triangulation:
        """The constrained Delaunay triangulation with more points, all strictly inside the area.

        In each round every triangle takes the point nearest to its middle, and is divided in three.
        """
        mesh = self
        while len(places):
            holder = mesh.located(places)
            places, holder = places[holder >= 0], holder[holder >= 0]
            if len(places) == 0:
                break
            from_middle = np.hypot(*(places - mesh.corners[holder].mean(axis=1)).T)
            order = np.lexsort([from_middle, holder])
            chosen = order[np.unique(holder[order], return_index=True)[1]]
            mesh = mesh._divided(holder[chosen], places[chosen]).flipped()
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
        """The constrained Delaunay triangulation with some border sides halved, one of a triangle at most."""
        triangle, k = np.divmod(sides, 3)
        apex, start, end = (self.triangles[triangle, (k + shift) % 3] for shift in range(3))
        new = len(self.points) + np.arange(len(sides))
        points = np.vstack([self.points, (self.points[start] + self.points[end]) / 2])
        triangles = self.triangles.copy()
        triangles[triangle] = np.column_stack([apex, start, new])
        return Triangulation(points, np.vstack([triangles, np.column_stack([apex, new, end])])).flipped()

    def without_flat_ears(self) -> Triangulation:
        """The triangulation without what vertices in line make: triangles of no area on the border."""
        extent_m = float(np.ptp(self.points, axis=0).max())
        flat = self.doubled_areas <= ROUNDING * extent_m**2
        ears = flat & ((self.twins.reshape(-1, 3) < 0).sum(axis=1) >= 2)
        return self if not ears.any() else Triangulation(self.points, self.triangles[~ears]).without_flat_ears()


def _flippable(points: FloatArray, triangles: Indices, twins: Indices) -> Indices:
    """Numbers of sides that break the Delaunay criterion and can be flipped, no two of one triangle."""
    side = np.flatnonzero(twins > np.arange(len(twins)))
    p, q, r, s = (points[index] for index in _quadrilateral(triangles, side, twins[side]))
    excess = _angle(q - p, r - p) + _angle(r - s, q - s) - np.pi
    least_new = np.minimum(cross(q - p, s - p), cross(s - p, r - p))
    wrong = (excess > FLIP_TOLERANCE) & (least_new > -ROUNDING * np.ptp(points, axis=0).max() ** 2)
    side = side[wrong]
    # Worst first; of the sides of one triangle, the worst alone.
    order = np.argsort(-excess[wrong], kind="stable")
    side = side[order]
    rank = np.full(len(triangles), len(side), dtype=np.intp)
    numbers = np.arange(len(side))
    one, other = side // 3, twins[side] // 3
    np.minimum.at(rank, one, numbers)
    np.minimum.at(rank, other, numbers)
    return np.asarray(side[(rank[one] == numbers) & (rank[other] == numbers)])


def _angle(a: FloatArray, b: FloatArray) -> FloatArray:
    """The angle between planar vectors, 0 to pi, shape (n,)."""
    return np.asarray(np.arctan2(np.abs(cross(a, b)), (a * b).sum(axis=1)))


def _quadrilateral(triangles: Indices, side: Indices, twin: Indices) -> tuple[Indices, Indices, Indices, Indices]:
    """The corners round some sides: the apex p, the side from q to r, the other triangle's apex s."""
    triangle, k = np.divmod(side, 3)
    p, q, r = (triangles[triangle, (k + shift) % 3] for shift in range(3))
    return p, q, r, triangles[twin // 3, twin % 3]


def _flip(triangles: Indices, side: Indices, twin: Indices) -> Indices:
    p, q, r, s = _quadrilateral(triangles, side, twin)
    triangles = triangles.copy()
    triangles[side // 3] = np.column_stack([p, q, s])
    triangles[twin // 3] = np.column_stack([p, s, r])
    return triangles
