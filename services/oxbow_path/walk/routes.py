"""Routes through the water along the middle of its triangulation.

Every edge of a constrained Delaunay triangulation that is not shore has a midpoint; midpoints of one triangle's
edges see each other. The graph over them is connected wherever the water is, however narrow, never touches the
shore, and runs along the middle of narrow arms.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import FloatArray, Place
from oxbow.errors import Internal

__all__ = ["Indices", "Routes", "taut"]

Indices = npt.NDArray[np.intp]

LEAST_STEP_M = 1e-9

FLAT = 1e-9
"""A triangle whose height is less than this share of its longest side is flat."""

IN_LINE_M = 1e-6
"""Sides nearer to each other than this run along each other."""

TAUT_POINTS = 200
"""Into how many steps a route is divided before it is pulled tight."""


class Routes:
    """Routes inside one polygon of water.

    Parameters
    ----------
    water
        Where routes may run.
    detail_m
        The shore is divided into edges no longer than this, so that midpoints stand about as close.
    """

    def __init__(self, water: Polygon, detail_m: float) -> None:
        self.water = water
        self.detail_m = detail_m

    @cached_property
    def _mesh(self) -> _Mesh:
        return _Mesh(self.water, self.detail_m)

    def goals_in(self, area: Polygon) -> Indices:
        """The places of the graph inside an area."""
        shapely.prepare(area)
        return np.flatnonzero(shapely.contains_xy(area, self._mesh.places))

    def to_area(self, start: FloatArray, area: Polygon, goals: Indices) -> LineString | None:
        """The shortest route from a point of the water into an area; None if none leads there.

        `goals` are the area's `goals_in`; an area too small to hold any is entered at a point of its own.
        """
        if len(goals) == 0:
            return LineString(self.between(start, shapely.get_coordinates(area.representative_point())[0]))
        way = self._way(start, goals)
        return None if way is None else LineString(np.vstack([start, way]))

    def between(self, start: FloatArray, goal: FloatArray) -> FloatArray:
        """The shortest route over midpoints between two points of the water, shape (n, 2), both included."""
        mesh = self._mesh
        if mesh.triangle_at(start) == mesh.triangle_at(goal):
            return np.vstack([start, goal])
        way = self._way(start, mesh.gates_at(goal))
        if way is None:
            raise Internal(f"no way inside the region from {start} to {goal}", "routes")
        return np.vstack([start, way, goal])

    def _way(self, start: Place | FloatArray, goals: Indices) -> FloatArray | None:
        """Midpoints from one of the edges at `start` to the nearest goal."""
        mesh = self._mesh
        sources = mesh.gates_at(start)
        if len(sources) == 0 or len(goals) == 0:
            return None
        distance, previous, _ = dijkstra(mesh.graph, indices=sources, return_predecessors=True, min_only=True)
        node = int(goals[np.argmin(distance[goals])])
        if not np.isfinite(distance[node]):
            return None
        nodes = [node]
        while previous[nodes[-1]] >= 0:
            nodes.append(int(previous[nodes[-1]]))
        return mesh.places[nodes[::-1]]


class _Mesh:
    """The triangulation, and the graph over the midpoints of the gates between its triangles."""

    def __init__(self, water: Polygon, detail_m: float) -> None:
        shore = shapely.segmentize(water, detail_m)
        triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shore))
        corners = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
        thick = ~_flat(corners)
        self.index = shapely.STRtree(triangles[thick])
        midpoints, owners, whole = _gates(corners, thick)
        self.places: FloatArray = np.vstack([midpoints, corners[thick].mean(axis=1)])
        by_owner = np.argsort(owners.ravel(), kind="stable")
        self.owner, self.gate = owners.ravel()[by_owner], by_owner // 2
        self.graph = self._graph(len(midpoints), whole)

    def _graph(self, gates: int, whole: int) -> csr_array[np.float64]:
        """Gates of one triangle see each other; where some are parts of a side, all see its centre instead."""
        crowded = np.isin(self.owner, self.owner[self.gate >= whole])
        pairs = [np.column_stack([self.gate, gates + self.owner])[crowded]]
        for k in (1, 2):
            same = (self.owner[:-k] == self.owner[k:]) & ~crowded[k:]
            pairs.append(np.column_stack([self.gate[:-k], self.gate[k:]])[same])
        a, b = np.vstack(pairs).T
        # A sparse sum drops zeros.
        weight = np.hypot(*(self.places[a] - self.places[b]).T) + LEAST_STEP_M
        n = len(self.places)
        one_way = csr_array((weight, (a, b)), shape=(n, n))
        return csr_array(one_way + one_way.T)

    def triangle_at(self, place: Place | FloatArray) -> int:
        """The triangle that holds a place, or is nearest to it."""
        return int(np.atleast_1d(self.index.query_nearest(Point(place), all_matches=False))[0])

    def gates_at(self, place: Place | FloatArray) -> Indices:
        """The gates of the triangle at a place."""
        triangle = self.triangle_at(place)
        first, last = np.searchsorted(self.owner, [triangle, triangle + 1])
        return np.asarray(self.gate[first:last])


def _flat(corners: FloatArray) -> npt.NDArray[np.bool_]:
    """Which triangles, shape (n, 3, 2), have no height: vertices in line make such."""
    spread = corners[:, 1:] - corners[:, :1]
    area = np.abs(spread[:, 0, 0] * spread[:, 1, 1] - spread[:, 0, 1] * spread[:, 1, 0])
    longest = np.hypot(*np.moveaxis(np.roll(corners, -1, axis=1) - corners, 2, 0)).max(axis=1)
    return np.asarray(area <= FLAT * longest**2)


def _gates(corners: FloatArray, thick: npt.NDArray[np.bool_]) -> tuple[FloatArray, Indices, int]:
    """Midpoints of what two thick triangles share, shape (n, 2), and the two triangles of each, among the thick.

    Most share whole sides: so many come first. Sides with a flat triangle between them share a stretch.
    """
    vertices, index = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    sides = np.sort(index.reshape(-1, 3)[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    order = np.lexsort(sides.T)
    first = np.flatnonzero((sides[order[1:]] == sides[order[:-1]]).all(axis=1))
    pairs = np.column_stack([order[first], order[first + 1]])
    both = thick[pairs // 3]
    whole = pairs[both.all(axis=1)]
    at_flat = pairs[both][~np.repeat(both.all(axis=1), both.sum(axis=1))]
    partly, middles = _stretches(vertices[sides[at_flat]])
    number = np.cumsum(thick) - 1
    owners = number[np.vstack([whole, at_flat[partly]]) // 3]
    return np.vstack([vertices[sides[whole[:, 0]]].mean(axis=1), middles]), owners, len(whole)


def _stretches(sides: FloatArray) -> tuple[Indices, FloatArray]:
    """Pairs of sides, shape (n, 2, 2), that run along each other, and the middles of the stretches they share."""
    lines = np.asarray(shapely.linestrings(sides))
    a, b = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=IN_LINE_M)
    a, b = a[a < b], b[a < b]
    origin, along = sides[a, 0], sides[a, 1] - sides[a, 0]
    length = np.hypot(*along.T)
    along = along / length[:, None]
    ends = np.einsum("nij,nj->ni", sides[b] - origin[:, None], along)
    start, end = np.maximum(ends.min(axis=1), 0.0), np.minimum(ends.max(axis=1), length)
    middle = origin + along * ((start + end) / 2)[:, None]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    off = np.abs(np.einsum("nij,nj->ni", sides[b] - origin[:, None], across)).max(axis=1)
    shared = (end - start > IN_LINE_M) & (off <= IN_LINE_M)
    return np.column_stack([a, b])[shared], middle[shared]


def taut(route: LineString, water: BaseGeometry) -> LineString:
    """A route pulled tight: from each vertex straight on to the farthest one that the water lets see.

    Backward and forward, over points spread along the route, so that bends shrink to the corners of the shore.
    """
    for _ in range(2):
        points = shapely.get_coordinates(shapely.segmentize(route, route.length / TAUT_POINTS))[::-1]
        kept = [0]
        while kept[-1] < len(points) - 1:
            ahead = points[kept[-1] + 1 :]
            sights = shapely.linestrings(np.stack([np.broadcast_to(points[kept[-1]], ahead.shape), ahead], axis=1))
            seen = np.flatnonzero(shapely.covers(water, sights))
            kept.append(kept[-1] + 1 + int(seen[-1] if len(seen) else 0))
        route = LineString(points[kept])
    return route
