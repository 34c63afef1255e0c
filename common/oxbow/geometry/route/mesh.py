"""Triangulated water: which triangles are neighbours, which one holds a place, how far the shore is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import LineString, MultiPolygon, Point, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Geometries, Indices, Mask
from oxbow.errors import Infeasible, InvalidRequest
from oxbow.geometry.triangles import angles_rad, following, triangulated, twins_of
from oxbow.tolerances import ROUNDING_M

__all__ = ["Touches", "WaterMesh"]

TOUCH_M = 1e-9
"""A place this close to a triangle touches it."""


@dataclass(frozen=True)
class Touches:
    """Which triangles places touch: pairs of a place and a triangle, two arrays of one length."""

    place: Indices
    triangle: Indices

    def __add__(self, other: Touches) -> Touches:
        return Touches(np.concatenate([self.place, other.place]), np.concatenate([self.triangle, other.triangle]))

    def among(self, places: Indices) -> Touches:
        """The triangles that some distinct places touch; the places are numbered anew, in the order given."""
        rank = np.full(max(self.place.max(initial=0), places.max(initial=0)) + 1, -1)
        rank[places] = np.arange(len(places))
        chosen = rank[self.place] >= 0
        return Touches(rank[self.place[chosen]], self.triangle[chosen])

    def sides(self) -> tuple[Indices, Indices]:
        """Pairs of a place and a side of a triangle that it touches."""
        return np.repeat(self.place, 3), (3 * self.triangle[:, None] + np.arange(3)).ravel()

    def companions(self) -> tuple[Indices, Indices]:
        """Ordered pairs of places that touch the same triangle; a pair may occur repeatedly."""
        # Sorted by triangle, companions are a few rows apart: at most as many as the fullest triangle has places.
        order = np.argsort(self.triangle, kind="stable")
        place, triangle = self.place[order], self.triangle[order]
        first, second = [place[:0]], [place[:0]]
        for apart in range(1, int(np.bincount(triangle, minlength=1).max())):
            same = triangle[apart:] == triangle[:-apart]
            first += [place[apart:][same], place[:-apart][same]]
            second += [place[:-apart][same], place[apart:][same]]
        return np.concatenate(first), np.concatenate(second)


@dataclass(frozen=True)
class WaterMesh:
    """A constrained Delaunay triangulation of water, as sides of triangles.

    Side s = 3 t + j of triangle t (`oxbow.geometry.triangles`) is called corner s where its tail is meant.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        The vertices, in metres.
    triangles : ndarray of int, shape (m, 3)
        The vertices of each triangle, counterclockwise.
    twins : ndarray of int, shape (3 m,)
        Each side's twin, -1 where it is shore.
    """

    points: FloatArray
    triangles: Indices
    twins: Indices

    @classmethod
    def of(
        cls, water: Polygon | MultiPolygon, outlines: Sequence[BaseGeometry] = (), *, detail_m: float = math.inf
    ) -> WaterMesh:
        """Triangulate water; no triangle straddles the shore or one of the outlines.

        Parameters
        ----------
        water
            Valid, in planar metres; parts may lie apart.
        outlines
            Lines that sides of triangles run along, such as those of danger zones.
        detail_m
            Sides along the shore and the outlines are no longer than this; by default, as long as the given
            edges.

        Returns
        -------
        WaterMesh
            Its vertices are those of the water and the outlines, and what `detail_m` adds between them.

        Raises
        ------
        InvalidRequest
            The water is empty or not a valid polygon.
        """
        if water.is_empty or not shapely.is_valid(water):
            raise InvalidRequest("is empty or not a valid polygon", where="water")
        # Parted only where there are outlines: noding moves vertices by rounding, and takes time.
        faces = _parted(water, outlines) if outlines else water
        points, triangles = triangulated(faces if math.isinf(detail_m) else shapely.segmentize(faces, detail_m))
        return cls(points, triangles, twins_of(triangles))

    @cached_property
    def tails(self) -> FloatArray:
        """Where each side begins, shape (3 m, 2)."""
        return np.asarray(self.points[self.triangles.ravel()])

    @cached_property
    def heads(self) -> FloatArray:
        """Where each side ends, shape (3 m, 2)."""
        return np.asarray(self.points[np.roll(self.triangles, -1, axis=1).ravel()])

    @cached_property
    def corners(self) -> FloatArray:
        """Coordinates of the corners, shape (m, 3, 2)."""
        return np.asarray(self.points[self.triangles])

    @cached_property
    def polygons(self) -> Geometries:
        """The triangles as polygons."""
        return np.asarray(shapely.polygons(self.corners))

    @cached_property
    def _index(self) -> STRtree:
        return STRtree(self.polygons)

    @cached_property
    def shore(self) -> Indices:
        """The sides that are shore."""
        return np.flatnonzero(self.twins < 0)

    @cached_property
    def _shore_index(self) -> STRtree:
        ends = np.stack([self.tails[self.shore], self.heads[self.shore]], axis=1)
        return STRtree(np.asarray(shapely.linestrings(ends)))

    def shores_near(self, areas: Geometries) -> Geometries:
        """The shore's sides that come within rounding of areas, as lines."""
        near = self._shore_index.query(areas, predicate="dwithin", distance=ROUNDING_M)[1]
        return np.asarray(self._shore_index.geometries[np.unique(near)])

    @cached_property
    def sectors(self) -> Indices:
        """The number of each corner's place in the water, shape (3 m,).

        A vertex at which shores touch is several places: one for each part of the water around it.
        """
        # The side after a twin begins where the side itself does: both corners are one place, with water between.
        sides, count = np.flatnonzero(self.twins >= 0), len(self.twins)
        same = coo_array((np.ones(len(sides)), (sides, following(self.twins[sides]))), shape=(count, count))
        return np.asarray(connected_components(same, directed=False)[1], dtype=np.intp)

    @cached_property
    def sector_places(self) -> FloatArray:
        """Where each sector is, shape (k, 2)."""
        places = np.empty((self.sectors.max() + 1, 2))
        places[self.sectors] = self.tails
        return places

    @cached_property
    def angles(self) -> FloatArray:
        """The water's angle at each sector, in radians."""
        return np.asarray(np.bincount(self.sectors, angles_rad(self.corners).ravel()), dtype=np.float64)

    def clearance_m(self, line: LineString) -> float:
        """The least distance from a line to the shore."""
        _, distance_m = self._shore_index.query_nearest(line, return_distance=True, all_matches=False)
        return float(distance_m[0])

    def is_clear(self, starts: FloatArray, ends: FloatArray) -> Mask:
        """Whether straight lines between places meet no shore.

        Parameters
        ----------
        starts, ends : ndarray, shape (n, 2)
            In metres. A line that ends on the shore meets it.

        Returns
        -------
        ndarray of bool, shape (n,)
            True where the line meets no shore.
        """
        lines = np.asarray(shapely.linestrings(np.stack([starts, ends], axis=1)))
        clear = np.ones(len(lines), dtype=np.bool_)
        clear[self._shore_index.query(lines, predicate="intersects")[0]] = False
        return clear

    def located(self, places: FloatArray) -> Indices:
        """A triangle that holds each place, shape (n,), or else the nearest one."""
        return np.asarray(self._index.query_nearest(shapely.points(places), all_matches=False)[1])

    def holding(self, places: FloatArray) -> Touches:
        """The triangles that touch each of some places, shape (n, 2); none for a place outside."""
        points = np.asarray(shapely.points(places))
        return Touches(*self._index.query(points, predicate="dwithin", distance=TOUCH_M))

    def touches(self, places: FloatArray, names: Sequence[str]) -> Touches:
        """The triangles that each of some places touches.

        Parameters
        ----------
        places : ndarray, shape (n, 2)
            In metres.
        names
            What errors call them.

        Returns
        -------
        Touches
            At least one triangle for each place; several for a place on a side or a corner.

        Raises
        ------
        InvalidRequest
            A place is not finite.
        Infeasible
            A place lies outside the water.
        """
        for number in np.flatnonzero(~np.isfinite(places).all(axis=1)).tolist():
            raise InvalidRequest(f"is {_text(places[number])}; expected finite metres", where=names[number])
        touches = self.holding(places)
        for number in sorted(set(range(len(places))) - set(touches.place.tolist())):
            nearest, distance_m = self._index.query_nearest(Point(places[number]), return_distance=True)
            # A place on a slanted shore may be rounded to land: it touches the nearest triangles.
            if distance_m[0] > ROUNDING_M:
                raise Infeasible(
                    f"at {_text(places[number])} lies outside the water, {distance_m[0]:.3g} m from it;"
                    " expected a place in the water, not ashore or on an island",
                    where=names[number],
                )
            touches += Touches(np.full(len(nearest), number), nearest)
        return touches


def _parted(water: Polygon | MultiPolygon, outlines: Sequence[BaseGeometry]) -> Geometries:
    """The parts into which lines cut a region; neighbours share the vertices of their common border."""
    lines = shapely.get_parts(shapely.node(shapely.geometrycollections([water.boundary, *outlines])))
    faces = shapely.get_parts(shapely.polygonize(lines))
    shapely.prepare(water)
    return np.asarray(faces[shapely.contains(water, shapely.point_on_surface(faces))])


def _text(place: FloatArray) -> str:
    return f"({place[0]:.6g}, {place[1]:.6g})"
