"""Routes over a network of places: the network is built once; start and goal are inserted for each query.

Each method decides what the places are, and what line is drawn over the places found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from oxbow.arrays import FloatArray, Indices
from oxbow.errors import Infeasible, InvalidRequest
from oxbow.geometry.route.danger import Danger
from oxbow.geometry.route.mesh import Touches, WaterMesh
from oxbow.geometry.route.route import Route, RouteMethod, RouteTable, measured_route
from oxbow.geometry.route.search import Arcs, Ways, cheapest_ways, distinct

__all__ = ["Drawn", "Ends", "Links", "Network", "NetworkRouter", "Way"]


@dataclass(frozen=True)
class Ends:
    """Where ways begin and end, shape (n, 2), in metres, and the triangles that these places touch."""

    places: FloatArray
    at: Touches


@dataclass(frozen=True)
class Links:
    """How ends of ways are connected to a network; pairs may occur repeatedly.

    Parameters
    ----------
    end, out, into : ndarray of int, shape (k,)
        An end, a place of the network that ways lead to from there, and one that ways lead to it from.
    one, other : ndarray of int, shape (m,)
        Pairs of ends with a straight way from the one to the other.
    """

    end: Indices
    out: Indices
    into: Indices
    one: Indices
    other: Indices


class Network(Protocol):
    """Places in the water, joined."""

    @property
    def mesh(self) -> WaterMesh:
        """The water; zones' outlines are among its sides."""

    @property
    def danger(self) -> Danger:
        """The danger zones, as they count for one vehicle."""

    @property
    def places(self) -> FloatArray:
        """Shape (n, 2), in metres."""

    @property
    def arcs(self) -> Arcs:
        """How they are joined."""

    def links(self, ends: Ends) -> Links:
        """How ends of ways are connected to the network."""


@dataclass(frozen=True)
class Way:
    """A cheapest way: its two ends, and the numbers of the network's places in between."""

    ends: Ends
    nodes: Indices

    @property
    def start(self) -> FloatArray:
        """Shape (2,), in metres."""
        return np.asarray(self.ends.places[0])

    @property
    def goal(self) -> FloatArray:
        """Shape (2,), in metres."""
        return np.asarray(self.ends.places[1])


Drawn = Callable[[Way], FloatArray]
"""Draws a polyline, shape (n, 2), from the start of a way to its goal."""


class NetworkRouter:
    """Routes over a network.

    Parameters
    ----------
    network
        Places in the water, joined.
    method
        The name of this way to find routes.
    drawn
        Draws the route over a way; where absent, the way is the route.
    """

    def __init__(self, network: Network, method: RouteMethod, drawn: Drawn | None = None) -> None:
        self.network = network
        self.method = method
        self.drawn = drawn

    def route(self, start: npt.ArrayLike, goal: npt.ArrayLike) -> Route:
        """The route over the cheapest way; see `Router.route`.

        Parameters
        ----------
        start, goal : array_like, shape (2,)
            (x, y) in metres.

        Returns
        -------
        Route
            Cheapest over the network; where a line is drawn over it, the line is what is measured.

        Raises
        ------
        InvalidRequest
            One of them is not one place, or is not finite.
        Infeasible
            Start or goal lies outside the water (`where` says which), or no water leads from one to the other.
        """
        ends = _checked_ends(start, goal)
        found = self._found(ends, ["start", "goal"], starts=1)
        _require_way(found.costs[0, 1], ends)
        return measured_route(self._line(found, 0, 1), self.network.mesh, self.network.danger, self.method)

    def distances(self, points: npt.ArrayLike) -> FloatArray:
        """Costs of the routes between all pairs; see `Router.distances`."""
        return self.table(points).costs

    def table(self, points: npt.ArrayLike) -> RouteTable:
        """The routes between all pairs; see `Router.table`."""
        points = _checked_places(points)
        found = self._found(points, [f"points[{number}]" for number in range(len(points))], starts=len(points))
        one_way, lengths_m = self._figures(found)
        # Starting inside a danger zone costs as well.
        danger = self.network.danger
        one_way = one_way + danger.hazard_m * danger.hazards_at(points)[:, None]
        # Of two equal ones, that from the earlier point is the route both ways.
        is_back = (one_way > one_way.T) | (np.tri(len(points), k=-1, dtype=np.bool_) & (one_way >= one_way.T))
        costs, lengths_m = (np.where(is_back, there.T, there) for there in (one_way, lengths_m))
        np.fill_diagonal(costs, 0.0)
        np.fill_diagonal(lengths_m, 0.0)

        def polyline(start: int, goal: int) -> FloatArray:
            if start == goal:
                return points[[start, goal]]
            if not np.isfinite(costs[start, goal]):
                raise Infeasible(f"no route leads from points[{start}] to points[{goal}]", where=f"points[{goal}]")
            there = not is_back[start, goal]
            return self._line(found, start, goal) if there else self._line(found, goal, start)[::-1]

        return RouteTable(costs, lengths_m, polyline)

    def _figures(self, found: _Found) -> tuple[FloatArray, FloatArray]:
        """Costs and lengths of the routes from each point to the others; inf where none is known."""
        if self.drawn is not None:
            return self._line_figures(found)
        # Without danger, costs are lengths, and no way has to be retraced.
        return found.costs, found.lengths_m if self.network.danger.outlines else found.costs

    def _found(self, points: FloatArray, names: Sequence[str], *, starts: int) -> _Found:
        """Search the network with the points inserted, from the first `starts` of them to all."""
        network = self.network
        # Refused here if they are no places in the water; the error names them as the caller does.
        ends = Ends(points, network.mesh.touches(points, names))
        links = network.links(ends)
        departure = len(network.places)
        # Each point is inserted twice, to depart from and to arrive at: no way can lead through a third point.
        arrival = departure + len(points)
        places = np.vstack([network.places, points, points])
        arcs = network.arcs
        for tails, heads in (
            (departure + links.end, links.out),
            (links.into, arrival + links.end),
            (departure + links.one, arrival + links.other),
        ):
            arcs += Arcs.one_way(places, *distinct(tails, heads), network.danger)
        ways = cheapest_ways(arcs.graph(len(places)), departure + np.arange(starts))
        return _Found(ends, places, arrival, ways)

    def _line(self, found: _Found, start: int, goal: int) -> FloatArray:
        way = found.way(start, goal)
        if self.drawn is None:
            return np.vstack([way.start, self.network.places[way.nodes], way.goal])
        return self.drawn(way)

    def _line_figures(self, found: _Found) -> tuple[FloatArray, FloatArray]:
        """Costs and lengths of the routes drawn from each point to those after it; inf where there is none."""
        # The other half stays inf, so that `table` takes the same drawn line both ways.
        costs, lengths_m = np.full((2, *found.costs.shape), np.inf)
        first, last = np.nonzero(np.triu(np.isfinite(found.costs), 1))
        lines = [self._line(found, i, j) for i, j in zip(first.tolist(), last.tolist(), strict=True)]
        if lines:
            # All edges of all lines at once: zones are intersected once, not once a line.
            starts, ends = np.vstack([line[:-1] for line in lines]), np.vstack([line[1:] for line in lines])
            owner = np.repeat(np.arange(len(lines)), [len(line) - 1 for line in lines])
            costs[first, last] = np.bincount(owner, self.network.danger.costs(starts, ends))
            lengths_m[first, last] = np.bincount(owner, np.hypot(*(ends - starts).T))
        return costs, lengths_m


@dataclass(frozen=True)
class _Found:
    """The result of a search between ends: `arrival` is the number of the first place of arrival."""

    ends: Ends
    places: FloatArray
    arrival: int
    ways: Ways

    @property
    def costs(self) -> FloatArray:
        """Costs of the ways from the first ends to all."""
        return self.ways.costs[:, self.arrival :]

    @property
    def lengths_m(self) -> FloatArray:
        """Lengths of the ways from the first ends to all; inf where there is none."""
        here = np.tile(np.arange(self.arrival, len(self.places)), (len(self.costs), 1))
        source = np.arange(len(here))[:, None]
        # All ways are retraced together, one step per turn; those at their source stand still.
        lengths_m = np.zeros(here.shape)
        while ((before := self.ways.previous[source, here]) >= 0).any():
            before = np.where(before >= 0, before, here)
            lengths_m += np.hypot(*np.moveaxis(self.places[here] - self.places[before], -1, 0))
            here = before
        return np.where(np.isfinite(self.costs), lengths_m, np.inf)

    def way(self, start: int, goal: int) -> Way:
        """The way from one of the first ends to another."""
        two = np.array([start, goal])
        nodes = np.array(self.ways.way(start, self.arrival + goal)[1:-1], dtype=np.intp)
        return Way(Ends(self.ends.places[two], self.ends.at.among(two)), nodes)


def _checked_places(places: npt.ArrayLike) -> FloatArray:
    """Places as an array of shape (n, 2).

    Raises
    ------
    InvalidRequest
        They have another shape.
    """
    array = np.asarray(places, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 2:
        raise InvalidRequest(f"have shape {array.shape}; expected places of shape (n, 2)", where="points")
    return array


def _checked_ends(start: npt.ArrayLike, goal: npt.ArrayLike) -> FloatArray:
    """Start and goal as an array of shape (2, 2).

    Raises
    ------
    InvalidRequest
        One of them is not one place.
    """
    ends = [np.asarray(place, dtype=np.float64) for place in (start, goal)]
    for place, name in zip(ends, ("start", "goal"), strict=True):
        if place.shape != (2,):
            raise InvalidRequest(f"has shape {place.shape}; expected one place (x, y)", where=name)
    return np.stack(ends)


def _require_way(cost: float, ends: FloatArray) -> None:
    """Refuse a goal that no way leads to.

    Raises
    ------
    Infeasible
        The cost is infinite.
    """
    if not math.isfinite(cost):
        start, goal = (f"({x:.6g}, {y:.6g})" for x, y in ends)
        raise Infeasible(
            f"at {goal} is not in the same water as the start at {start}: no route leads there", "goal"
        )
