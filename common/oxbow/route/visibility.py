"""Shortest routes over the visibility graph.

M. Innocenti, L. Pollini and A. Bracci (2006), section 2.1: the vertices that see each other are joined, and
Dijkstra's algorithm searches the graph. Departures: only corners round which a shortest route can bend are
vertices of the graph (T. Lozano-Perez and M. A. Wesley 1979 take all), only edges that touch the shore at both
ends without leading into it are kept, and sight is decided over a triangulation (`oxbow.route.sights`), not by
testing every pair against every edge.
"""

from __future__ import annotations

import math
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
from oxbow.route.search import Arcs, cheapest_ways, distinct
from oxbow.route.sights import IN_LINE, Mask, sights
from oxbow.triangles import Indices, cross, following

__all__ = ["VisibilityRouter"]

STRAIGHT_RAD = math.pi - 1e-9
"""A corner of the water at least this wide is one that routes may touch."""


class VisibilityRouter:
    """Shortest routes, exact but for rounding.

    With danger zones, the cheapest of the routes that bend at corners of the shore and of the zones.

    Parameters
    ----------
    mesh
        The water; zones' outlines are among its sides.
    danger
        What danger there is.
    """

    def __init__(self, mesh: Mesh, danger: Danger = NO_DANGER) -> None:
        self.mesh = mesh
        self.danger = danger

    def route(self, start: npt.ArrayLike, goal: npt.ArrayLike) -> Route:
        """The shortest route; see `Router.route`."""
        ends = checked_ends(start, goal)
        places, arcs = self._network(ends, ["start", "goal"])
        departure, arrival = len(places) - 4, len(places) - 1
        ways = cheapest_ways(len(places), arcs, np.array([departure]))
        require_way(ways.costs[0, arrival], ends)
        return judged(places[ways.way(0, arrival)], self.mesh, self.danger, RouteMethod.VISIBILITY)

    def distances(self, points: npt.ArrayLike) -> FloatArray:
        """Costs of the shortest routes between all pairs; see `Router.distances`."""
        points = checked_places(points)
        places, arcs = self._network(points, place_names(len(points)))
        departures, arrivals = np.arange(len(places))[-2 * len(points) :].reshape(2, -1)
        costs = cheapest_ways(len(places), arcs, departures).costs[:, arrivals]
        return as_matrix(costs, points, self.danger)

    def _network(self, points: FloatArray, names: list[str]) -> tuple[FloatArray, Arcs]:
        """The visibility graph and some points: bends, then the points to depart from, then those to arrive at.

        A point where shores touch is in the water of both sides, but no way leads through it.
        """
        at = self.mesh.touches(points, names)
        seen = sights(self.mesh, points, at, points, at, self.bends.at_corner >= 0)
        bend = self.bends.at_corner[seen.corners]
        useful = self.bends.can_be_reached(points[seen.corner_eyes], bend)
        point, bend = distinct(seen.corner_eyes[useful], bend[useful])
        departure = len(self.bends.places)
        arrival = departure + len(points)
        places = np.vstack([self.bends.places, points, points])
        arcs = self._arcs
        for tails, heads in (
            (departure + point, bend),
            (bend, arrival + point),
            distinct(departure + seen.place_eyes, arrival + seen.places),
        ):
            arcs += Arcs.one_way(places, tails, heads, self.danger)
        return places, arcs

    @cached_property
    def bends(self) -> Bends:
        """Where routes can bend."""
        return Bends.of(self.mesh, any_turn=bool(self.danger.zones))

    @cached_property
    def _arcs(self) -> Arcs:
        """The visibility graph of the bends."""
        bends = self.bends
        nobody = np.empty(0, dtype=np.intp)
        at = Touches(bends.at_corner[bends.corners], bends.corners // 3)
        wanted = bends.at_corner >= 0
        seen = sights(self.mesh, bends.places, at, np.empty((0, 2)), Touches(nobody, nobody), wanted)
        a, b = seen.corner_eyes, bends.at_corner[seen.corners]
        useful = bends.can_be_reached(bends.places[a], b) & bends.can_be_reached(bends.places[b], a)
        return Arcs.both_ways(bends.places, np.column_stack([a, b])[useful], self.danger)


@dataclass(frozen=True)
class Bends:
    """Corners of the water round which shortest routes bend.

    Parameters
    ----------
    places : ndarray, shape (k, 2)
        In metres.
    corners : ndarray of int
        All corners of triangles at these places.
    at_corner : ndarray of int, shape (3 n,)
        Which bend lies at each corner of the mesh, or -1.
    before, after : ndarray, shape (k, 2)
        The shore's neighbouring vertices; nan where routes may take any turn.
    """

    places: FloatArray
    corners: Indices
    at_corner: Indices
    before: FloatArray
    after: FloatArray

    @classmethod
    def of(cls, mesh: Mesh, *, any_turn: bool) -> Bends:
        """The bends of a mesh; with `any_turn`, routes need not be taut at them."""
        wide = mesh.angles >= STRAIGHT_RAD
        rank = np.where(wide, np.cumsum(wide) - 1, -1)
        at_corner = rank[mesh.sectors]
        corners = np.flatnonzero(at_corner >= 0)
        places, before, after = np.full((3, np.count_nonzero(wide), 2), np.nan)
        places[at_corner[corners]] = mesh.tails[corners]
        if not any_turn:
            begins, ends = at_corner[mesh.shore], at_corner[following(mesh.shore)]
            after[begins[begins >= 0]] = mesh.heads[mesh.shore[begins >= 0]]
            before[ends[ends >= 0]] = mesh.tails[mesh.shore[ends >= 0]]
        return cls(places, corners, at_corner, before, after)

    def can_be_reached(self, starts: FloatArray, bends: Indices) -> Mask:
        """Whether straight lines from `starts`, shape (n, 2), touch the shore at bends without leading into it."""
        ahead = self.places[bends] - starts
        sides = [_side(ahead, shore[bends] - self.places[bends]) for shore in (self.before, self.after)]
        return np.asarray(sides[0] * sides[1] >= 0)


def _side(ahead: FloatArray, shore: FloatArray) -> FloatArray:
    """1 where a shore lies to the left of the way ahead, -1 to the right, 0 in line or where there is none."""
    sine = cross(ahead, shore)
    in_line = np.abs(sine) <= IN_LINE * np.hypot(*ahead.T) * np.hypot(*shore.T)
    return np.where(in_line | np.isnan(sine), 0.0, np.sign(sine))
