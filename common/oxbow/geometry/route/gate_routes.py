"""Routes through the water along the middle of its triangulation.

The network is that of the gates between triangles (`oxbow.geometry.route.channel`): it is connected wherever the
water is, however narrow, never touches the shore, and runs along the middle of narrow arms. The routes of a
`Router` lead to a place; these lead to whatever place of an area is nearest, and keep to the middles of gates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np
import shapely
from scipy.sparse import csr_array
from shapely import LineString, MultiPolygon, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices
from oxbow.errors import Internal
from oxbow.geometry.route.channel import Gates
from oxbow.geometry.route.mesh import WaterMesh
from oxbow.geometry.route.search import Arcs, WaysTo, cheapest_ways, cheapest_ways_to

__all__ = ["Inward", "Routes", "taut"]

TAUT_POINTS = 200
"""How many steps a route is divided into before it is pulled tight."""


class Routes:
    """Routes inside one water.

    Parameters
    ----------
    water
        Where routes may run.
    detail_m
        The shore is divided into edges no longer than this, so that gates are about as close together.
    """

    def __init__(self, water: Polygon | MultiPolygon, detail_m: float = math.inf) -> None:
        self.water = water
        self.detail_m = detail_m

    @cached_property
    def mesh(self) -> WaterMesh:
        """The water in triangles, its shore in edges no longer than the detail."""
        return WaterMesh.of(self.water, detail_m=self.detail_m)

    @cached_property
    def _gates(self) -> Gates:
        return Gates(self.mesh)

    @cached_property
    def _graph(self) -> csr_array[np.float64]:
        return self._gates.arcs.graph(len(self._gates.places))

    def goals_in(self, area: BaseGeometry) -> Indices:
        """The gates whose middles lie inside an area."""
        shapely.prepare(area)
        inside = shapely.contains_xy(area, self._gates.places)
        return np.flatnonzero(inside & (self._gates.mesh.twins >= 0))

    @cached_property
    def _middles(self) -> STRtree:
        return STRtree(np.asarray(shapely.points(self._gates.places)))

    def goals_near(self, line: LineString, distance_m: float) -> Indices:
        """The gates whose middles lie near a line.

        Parameters
        ----------
        line
            In metres.
        distance_m
            The greatest distance of a middle from the line.

        Returns
        -------
        ndarray of int
            Numbers of sides, ascending; shores are not among them.
        """
        near = np.sort(self._middles.query(line, predicate="dwithin", distance=distance_m))
        return np.asarray(near[self._gates.mesh.twins[near] >= 0])

    def into(self, area: BaseGeometry, goals: Indices) -> Inward:
        """The shortest routes into an area from anywhere in the water: one search serves all starts.

        Parameters
        ----------
        area
            Where to, in the water.
        goals
            The area's `goals_in`; where there are none, all routes lead to a point of the area instead.

        Returns
        -------
        Inward
            Its routes lead to the nearest of the goals, or to the area's own point where there are none.
        """
        places = self._gates.places
        if len(goals):
            return Inward(places, cheapest_ways_to(self._graph, goals), self._gates_from)
        end = shapely.get_coordinates(area.representative_point())
        around, goal = self._triangle_at(end), len(places)
        # The area's point becomes a place of the network, so that the step to it counts in the search.
        last = self._gates.mesh.twins[self._gates_out_of(around)]
        steps = Arcs(last, np.full(len(last), goal), np.hypot(*(places[last] - end).T))
        ways = cheapest_ways_to((self._gates.arcs + steps).graph(goal + 1), np.array([goal]))

        def from_place(start: FloatArray) -> Indices:
            return np.array([goal]) if self._triangle_at(start) == around else self._gates_from(start)

        return Inward(np.vstack([places, end]), ways, from_place)

    def to_area(self, start: FloatArray, area: BaseGeometry, goals: Indices) -> LineString | None:
        """The shortest route from a point of the water into an area; None if none leads there.

        Parameters
        ----------
        start : ndarray, shape (2,)
            In the water, in metres.
        area
            Where to, in the water.
        goals
            The area's `goals_in`. Without any, as in an area that is too small, the route ends at a point of the
            area.

        Returns
        -------
        LineString or None
            From the start to a goal inside the area; None where no water leads there.

        Raises
        ------
        Internal
            The area has no goals, and no route leads to its point.
        """
        if len(goals) == 0:
            return LineString(self.between(start, shapely.get_coordinates(area.representative_point())[0]))
        way = self._way(start, goals)
        return None if way is None else LineString(np.vstack([start, way]))

    def between(self, start: FloatArray, goal: FloatArray) -> FloatArray:
        """The shortest route over the middles of gates between two points of the water.

        Parameters
        ----------
        start, goal : ndarray, shape (2,)
            In the water, in metres.

        Returns
        -------
        ndarray, shape (n, 2)
            From start to goal, both included.

        Raises
        ------
        Internal
            No water leads from the one to the other.
        """
        triangle = self._triangle_at(goal)
        if self._triangle_at(start) == triangle:
            return np.vstack([start, goal])
        way = self._way(start, self._gates.mesh.twins[self._gates_out_of(triangle)], goal)
        if way is None:
            raise Internal(f"no way inside the region from {start} to {goal}", "routes")
        return np.vstack([start, way, goal])

    def _triangle_at(self, place: FloatArray) -> int:
        return int(self._gates.mesh.located(np.atleast_2d(place))[0])

    def _gates_from(self, place: FloatArray) -> Indices:
        return self._gates_out_of(self._triangle_at(place))

    def _gates_out_of(self, triangle: int) -> Indices:
        sides = 3 * triangle + np.arange(3)
        return np.asarray(sides[self._gates.mesh.twins[sides] >= 0])

    def _way(self, start: FloatArray, goals: Indices, onward: FloatArray | None = None) -> FloatArray | None:
        """Middles of gates on the shortest way from a place to one of some gates, and from there onward."""
        places, first = self._gates.places, self._gates_from(start)
        if len(first) == 0 or len(goals) == 0:
            return None
        ways = cheapest_ways(self._graph, first)
        # Three parts: straight to a gate, over gates, and straight on: the least sum decides, not the nearest
        # gate.
        length_m = np.hypot(*(places[first] - start).T)[:, None] + ways.costs[:, goals]
        if onward is not None:
            length_m += np.hypot(*(places[goals] - onward).T)
        rank, last = np.unravel_index(np.argmin(length_m), length_m.shape)
        if not np.isfinite(length_m[rank, last]):
            return None
        return np.asarray(places[ways.way(int(rank), int(goals[last]))])


class Inward:
    """Routes from many places into one area; each ends where it meets an earlier one.

    Parameters
    ----------
    places
        The places of the network, shape (n, 2), in metres.
    ways
        From each of them to the area.
    first
        From a place anywhere in the water, the numbers of the network's places that a straight step leads to.
    """

    def __init__(self, places: FloatArray, ways: WaysTo, first: Callable[[FloatArray], Indices]) -> None:
        self._places = places
        self._ways = ways
        self._first = first
        self._passed = np.zeros(len(places), dtype=bool)

    def route(self, start: FloatArray, unused_m: float = math.inf) -> LineString | None:
        """The route from a place; None if none leads there.

        Parameters
        ----------
        start
            A place of the water.
        unused_m
            How much of its beginning no later route may end on, in metres; by default, no route ends on it at all.

        Returns
        -------
        LineString or None
            To the area, or to where it meets an earlier route; None where no water leads there.
        """
        first = self._first(start)
        length_m = np.hypot(*(self._places[first] - start).T) + self._ways.costs[first]
        if not np.isfinite(length_m).any():
            return None
        # The way ends at the first place that an earlier route has passed.
        way = np.array(self._ways.way(int(first[np.argmin(length_m)])))
        met = np.flatnonzero(self._passed[way])
        points = np.vstack([start, self._places[way[: met[0] + 1] if len(met) else way]])
        along_m = np.cumsum(np.hypot(*np.diff(points, axis=0).T))
        # Near its start a route may still be abandoned: later ones must not count on those places.
        self._passed[way[: len(along_m)][along_m > unused_m]] = True
        return LineString(points)


def taut(route: LineString, water: BaseGeometry) -> LineString:
    """A route pulled tight: from each vertex straight on to the farthest one in sight across the water.

    Backward, then forward, over points spread along the route, so that bends shrink to the corners of the shore.
    Unlike a shortest route through that water, it may begin outside, and stays as it is where the water ends.

    Parameters
    ----------
    route
        In metres, of positive length.
    water
        What straight lines between vertices have to stay in.

    Returns
    -------
    LineString
        From the same start to the same end, and never longer.
    """
    for _ in range(2):
        points = shapely.get_coordinates(shapely.segmentize(route, route.length / TAUT_POINTS))[::-1]
        kept = [0]
        while kept[-1] < len(points) - 1:
            ahead = points[kept[-1] + 1 :]
            sights = shapely.linestrings(np.stack([np.broadcast_to(points[kept[-1]], ahead.shape), ahead], axis=1))
            seen = np.flatnonzero(shapely.covers(water, sights))
            # At least one step on, even out of sight: the route stays as it is where the water ends.
            kept.append(kept[-1] + 1 + int(seen[-1] if len(seen) else 0))
        route = LineString(points[kept])
    return route
