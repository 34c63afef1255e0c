"""Shortest routes over the visibility graph.

M. Innocenti, L. Pollini and A. Bracci (2006), section 2.1: the vertices that see each other are joined, and
Dijkstra's algorithm searches the graph. Departures: only corners round which a shortest route can bend are
vertices of the graph (T. Lozano-Perez and M. A. Wesley 1979 take all), only edges that touch the shore at both
ends without leading into it are kept, and sight is decided over a triangulation (`oxbow.geometry.route.sights`),
not by testing every pair against every edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.geometry.route.danger import NO_DANGER, Danger
from oxbow.geometry.route.mesh import Touches, WaterMesh
from oxbow.geometry.route.network import Ends, Links
from oxbow.geometry.route.search import Arcs, distinct
from oxbow.geometry.route.sights import IN_LINE, sights
from oxbow.geometry.triangles import cross, following

__all__ = ["VisibilityGraph"]

STRAIGHT_RAD = math.pi - 1e-9
"""Routes may touch corners of the water that are at least this wide."""


EYES = 2**14
"""How many bends are processed at once: along straight channels each sees so many others that all at once would
take too much memory."""


@dataclass(frozen=True)
class VisibilityGraph:
    """The network of shortest routes, exact except for rounding.

    With danger zones, ways are the cheapest of those that bend at corners of the shore and of the zones.

    Parameters
    ----------
    mesh
        The water; zones' outlines are among its sides.
    danger
        The danger zones, as they count for one vehicle.
    """

    mesh: WaterMesh
    danger: Danger = NO_DANGER

    @cached_property
    def bends(self) -> Bends:
        """The corners where routes can bend."""
        return Bends.of(self.mesh, any_turn=bool(self.danger.outlines))

    @property
    def places(self) -> FloatArray:
        """See `Network.places`."""
        return self.bends.places

    @cached_property
    def arcs(self) -> Arcs:
        """See `Network.arcs`: between bends that see each other."""
        count = len(self.places)
        pairs = [self._pairs(first, first + EYES) for first in range(0, count, EYES)]
        return Arcs.both_ways(self.places, np.vstack([np.empty((0, 2), dtype=np.intp), *pairs]), self.danger)

    def _pairs(self, first: int, last: int) -> Indices:
        """Pairs of one of some bends and a bend that it sees, where a route can run between them, shape (n, 2)."""
        bends, nobody = self.bends, np.empty(0, dtype=np.intp)
        at, wanted = bends.touches, bends.at_corner >= 0
        looks = (at.place >= first) & (at.place < last)
        eyes = Touches(at.place[looks], at.triangle[looks])
        seen = sights(self.mesh, bends.places, eyes, np.empty((0, 2)), Touches(nobody, nobody), wanted)
        a, b = distinct(seen.corner_eyes, bends.at_corner[seen.corners])
        # A line that leads into the shore at one of its ends is no part of a shortest route, though the two see
        # each other.
        useful = bends.can_be_reached(bends.places[a], b) & bends.can_be_reached(bends.places[b], a)
        return np.column_stack([a, b])[useful]

    def links(self, ends: Ends) -> Links:
        """See `Network.links`: the bends and the other ends that each end sees.

        A place where shores touch is in the water of both sides, but no way leads through it.
        """
        seen = sights(self.mesh, ends.places, ends.at, ends.places, ends.at, self.bends.at_corner >= 0)
        bend = self.bends.at_corner[seen.corners]
        useful = self.bends.can_be_reached(ends.places[seen.corner_eyes], bend)
        bend = bend[useful]
        return Links(seen.corner_eyes[useful], bend, bend, seen.place_eyes, seen.places)


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
    def of(cls, mesh: WaterMesh, *, any_turn: bool) -> Bends:
        """The bends of a mesh: its corners of half a turn or more.

        Parameters
        ----------
        mesh
            The water.
        any_turn
            Whether routes may turn at a bend without being taut there, as danger zones make them.

        Returns
        -------
        Bends
            In the order of the mesh's sectors; none in convex water.
        """
        wide = mesh.angles >= STRAIGHT_RAD
        rank = np.where(wide, np.cumsum(wide) - 1, -1)
        at_corner = rank[mesh.sectors]
        corners = np.flatnonzero(at_corner >= 0)
        places, before, after = np.full((3, np.count_nonzero(wide), 2), np.nan)
        places[at_corner[corners]] = mesh.tails[corners]
        # Without zones a shortest route bends at shores alone, and touches them; round a zone it may bend either
        # way.
        if not any_turn:
            begins, ends = at_corner[mesh.shore], at_corner[following(mesh.shore)]
            after[begins[begins >= 0]] = mesh.heads[mesh.shore[begins >= 0]]
            before[ends[ends >= 0]] = mesh.tails[mesh.shore[ends >= 0]]
        return cls(places, corners, at_corner, before, after)

    @property
    def touches(self) -> Touches:
        """The triangles that bends touch."""
        return Touches(self.at_corner[self.corners], self.corners // 3)

    def can_be_reached(self, starts: FloatArray, bends: Indices) -> Mask:
        """Whether straight lines touch the shore at bends without leading into it.

        Parameters
        ----------
        starts : ndarray, shape (n, 2)
            In metres.
        bends : ndarray of int, shape (n,)
            The bend that each line leads to.

        Returns
        -------
        ndarray of bool, shape (n,)
            True everywhere at bends where routes may take any turn.
        """
        ahead = self.places[bends] - starts
        sides = [_side(ahead, shore[bends] - self.places[bends]) for shore in (self.before, self.after)]
        # Both neighbours on one side: the line touches the shore. On either side: it leads into it.
        return np.asarray(sides[0] * sides[1] >= 0)


def _side(ahead: FloatArray, shore: FloatArray) -> FloatArray:
    """1 where a shore lies to the left of the way ahead, -1 to the right, 0 in line or where there is none."""
    sine = cross(ahead, shore)
    in_line = np.abs(sine) <= IN_LINE * np.hypot(*ahead.T) * np.hypot(*shore.T)
    return np.where(in_line | np.isnan(sine), 0.0, np.sign(sine))
