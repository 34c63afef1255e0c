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

    def midpoints_in(self, area: Polygon) -> Indices:
        """The midpoints inside an area: goals of a route to it."""
        shapely.prepare(area)
        return np.flatnonzero(shapely.contains_xy(area, self._mesh.midpoints))

    def route(self, start: Place | FloatArray, goals: Indices) -> LineString | None:
        """The shortest route over midpoints from a point of the water to a goal; None if none leads there."""
        way = self._way(start, goals)
        return None if way is None else LineString(np.vstack([start, way]))

    def between(self, start: FloatArray, goal: FloatArray) -> FloatArray:
        """The shortest route over midpoints between two points of the water, shape (n, 2), both included."""
        mesh = self._mesh
        if mesh.triangle_at(start) == mesh.triangle_at(goal):
            return np.vstack([start, goal])
        way = self._way(start, mesh.edges_at(goal))
        if way is None:
            raise Internal(f"no way inside the region from {start} to {goal}", "routes")
        return np.vstack([start, way, goal])

    def _way(self, start: Place | FloatArray, goals: Indices) -> FloatArray | None:
        """Midpoints from one of the edges at `start` to the nearest goal."""
        mesh = self._mesh
        sources = mesh.edges_at(start)
        if len(sources) == 0 or len(goals) == 0:
            return None
        distance, previous, _ = dijkstra(mesh.graph, indices=sources, return_predecessors=True, min_only=True)
        node = int(goals[np.argmin(distance[goals])])
        if not np.isfinite(distance[node]):
            return None
        nodes = [node]
        while previous[nodes[-1]] >= 0:
            nodes.append(int(previous[nodes[-1]]))
        return mesh.midpoints[nodes[::-1]]


class _Mesh:
    """The triangulation's inner edges: their midpoints, and the graph over them."""

    def __init__(self, water: Polygon, detail_m: float) -> None:
        shore = shapely.segmentize(water, detail_m)
        self.triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shore))
        corners = shapely.get_coordinates(self.triangles).reshape(-1, 4, 2)[:, :3]
        vertices, index = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
        index = index.reshape(-1, 3)
        sides = np.sort(index[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
        edges, side_edge, count = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True, return_counts=True)
        inner = count == 2
        number = np.cumsum(inner) - 1
        self.side_edge = np.where(inner[side_edge], number[side_edge], -1).reshape(-1, 3)
        self.midpoints: FloatArray = vertices[edges[inner]].mean(axis=1)
        self.graph = self._graph()
        self.index = shapely.STRtree(self.triangles)

    def _graph(self) -> csr_array[np.float64]:
        pairs = self.side_edge[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        a, b = pairs[(pairs >= 0).all(axis=1)].T
        # A sparse sum drops zeros, and two edges of a flat triangle may share their midpoint.
        weight = np.hypot(*(self.midpoints[a] - self.midpoints[b]).T) + LEAST_STEP_M
        n = len(self.midpoints)
        one_way = csr_array((weight, (a, b)), shape=(n, n))
        return csr_array(one_way + one_way.T)

    def triangle_at(self, place: Place | FloatArray) -> int:
        """The triangle that holds a place, or is nearest to it."""
        return int(np.atleast_1d(self.index.query_nearest(Point(place), all_matches=False))[0])

    def edges_at(self, place: Place | FloatArray) -> Indices:
        """The inner edges of the triangle at a place."""
        sides = self.side_edge[self.triangle_at(place)]
        return np.asarray(sides[sides >= 0])


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
