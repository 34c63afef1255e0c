"""Routes through a channel of triangles.

M. Innocenti, L. Pollini and A. Bracci (2006), section 2.4.1, step c, after M. Kallmann (2005), *Path planning in
triangulations*: the cheapest chain of adjacent triangles between start and goal, as ways over the middles of the
sides between triangles count. What route is drawn through the chain is the matter of each method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from oxbow.contracts import FloatArray
from oxbow.route.danger import NO_DANGER, Danger
from oxbow.route.mesh import Mesh, Touches
from oxbow.route.route import (
    Route,
    RouteMethod,
    as_matrix,
    checked_ends,
    checked_places,
    judged,
    place_names,
    require_way,
)
from oxbow.route.search import Arcs, Ways, cheapest_ways, distinct
from oxbow.triangles import Indices

__all__ = ["Channel", "ChannelRouter", "Drawn"]


@dataclass(frozen=True)
class Channel:
    """A chain of adjacent triangles from one place to another.

    Parameters
    ----------
    start, goal : ndarray, shape (2,)
        In the first and in the last triangle, in metres.
    left, right : ndarray, shape (k, 2)
        The ends of the gates between triangles, as seen by who passes them.
    corners : ndarray, shape (k + 1, 3, 2)
        The triangles; one where start and goal lie in one.
    """

    start: FloatArray
    goal: FloatArray
    left: FloatArray
    right: FloatArray
    corners: FloatArray


Drawn = Callable[[Channel], FloatArray]
"""Draws a polyline, shape (n, 2), from start to goal inside a channel."""


class ChannelRouter:
    """Routes through channels of triangles.

    Parameters
    ----------
    mesh
        The water; zones' outlines are among its sides.
    danger
        What danger there is.
    drawn
        Draws the route through a channel.
    method
        The name of this way to draw.
    """

    def __init__(self, mesh: Mesh, danger: Danger = NO_DANGER, *, drawn: Drawn, method: RouteMethod) -> None:
        self.mesh = mesh
        self.danger = danger
        self.drawn = drawn
        self.method = method

    def route(self, start: npt.ArrayLike, goal: npt.ArrayLike) -> Route:
        """The route through the cheapest channel; see `Router.route`."""
        ends = checked_ends(start, goal)
        network = self._network(ends, ["start", "goal"])
        require_way(network.ways.costs[0, network.arrival + 1], ends)
        return judged(self.drawn(self._channel(network, 0, 1)), self.mesh, self.danger, self.method)

    def distances(self, points: npt.ArrayLike) -> FloatArray:
        """Costs of the routes from each place to those after it; see `Router.distances`."""
        points = checked_places(points)
        network = self._network(points, place_names(len(points)))
        costs = np.full((len(points), len(points)), np.inf)
        first, last = np.triu_indices(len(points), 1)
        reached = np.isfinite(network.ways.costs[first, network.arrival + last])
        pairs = np.column_stack([first, last])[reached]
        lines = [self.drawn(self._channel(network, i, j)) for i, j in pairs.tolist()]
        costs[first[reached], last[reached]] = _line_costs(lines, self.danger)
        return as_matrix(costs, points, self.danger)

    @cached_property
    def gates(self) -> Indices:
        """The sides between two triangles; each is passed outwards, out of the triangle whose side it is."""
        return np.flatnonzero(self.mesh.twins >= 0)

    @cached_property
    def _middles(self) -> FloatArray:
        """The middles of all sides."""
        return np.asarray((self.mesh.tails + self.mesh.heads) / 2)

    @cached_property
    def _arcs(self) -> Arcs:
        """From each gate to the other gates of the triangle beyond it."""
        twins = self.mesh.twins
        beyond = 3 * (twins[self.gates] // 3)[:, None] + np.arange(3)
        onward = (twins[beyond] >= 0) & (beyond != twins[self.gates][:, None])
        tails = np.broadcast_to(self.gates[:, None], beyond.shape)[onward]
        return Arcs.one_way(self._middles, tails, beyond[onward], self.danger)

    def _network(self, points: FloatArray, names: list[str]) -> _Network:
        """The gates between some points: sides keep their numbers, departures and arrivals follow."""
        at = self.mesh.touches(points, names)
        departure = len(self._middles)
        arrival = departure + len(points)
        places = np.vstack([self._middles, points, points])
        side = (3 * at.triangle[:, None] + np.arange(3)).ravel()
        point = np.repeat(at.place, 3)
        inner = self.mesh.twins[side] >= 0
        out, into, point = side[inner], self.mesh.twins[side[inner]], point[inner]
        first, second = at.companions()
        arcs = self._arcs
        for tails, heads in (
            (departure + point, out),
            (into, arrival + point),
            (departure + first, arrival + second),
        ):
            arcs += Arcs.one_way(places, *distinct(tails, heads), self.danger)
        ways = cheapest_ways(len(places), arcs, np.arange(departure, arrival))
        return _Network(points, at, departure, arrival, ways)

    def _channel(self, network: _Network, start: int, goal: int) -> Channel:
        gates = np.array(network.ways.way(start, network.arrival + goal)[1:-1], dtype=np.intp)
        if len(gates):
            triangles = np.concatenate([gates[:1] // 3, self.mesh.twins[gates] // 3])
        else:
            at = network.at
            shared = np.intersect1d(at.triangle[at.place == start], at.triangle[at.place == goal])
            triangles = shared[:1]
        return Channel(
            start=network.points[start],
            goal=network.points[goal],
            left=self.mesh.heads[gates],
            right=self.mesh.tails[gates],
            corners=self.mesh.corners[triangles],
        )


@dataclass(frozen=True)
class _Network:
    """What a search between points found: departures and arrivals are numbered from `departure` and `arrival`."""

    points: FloatArray
    at: Touches
    departure: int
    arrival: int
    ways: Ways


def _line_costs(lines: list[FloatArray], danger: Danger) -> FloatArray:
    """The costs of polylines."""
    if not lines:
        return np.empty(0)
    starts, ends = np.vstack([line[:-1] for line in lines]), np.vstack([line[1:] for line in lines])
    owner = np.repeat(np.arange(len(lines)), [len(line) - 1 for line in lines])
    return np.asarray(np.bincount(owner, danger.costs(starts, ends)), dtype=np.float64)
