"""Routes over a lattice of equilateral triangles with the obstacles' vertices in it.

M. Innocenti, L. Pollini and A. Bracci (2006), section 2.2, way c: lattice vertices in the water, joined where
no shore lies between; each obstacle vertex joined to lattice vertices near it. Along the sides of triangles a way
is up to 15.5 % longer than the straight line, with "cuts" 1.5 %: cuts to the second and third ring of neighbours
make 24 directions, at most 19.1 degrees apart, and 1 / cos(19.1 / 2 degrees) = 1.014. The way found is then
reduced: to the cheapest along the lines of sight between its own vertices.

Departure: obstacle vertices are also joined along the sides of a constrained Delaunay triangulation, so that arms
too narrow for the lattice are not lost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from oxbow.contracts import FloatArray
from oxbow.errors import InvalidMission
from oxbow.route.danger import NO_DANGER, Danger
from oxbow.route.mesh import ROUNDING_M, Mesh, Touches
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
from oxbow.route.sights import sights
from oxbow.triangles import Indices, following

__all__ = ["RINGS", "TessellationRouter", "lattice"]

SIDES_ACROSS = 60
"""How many sides of the lattice fit the longer side of the water's box, where nothing else is asked for."""

MOST_SIDES_ACROSS = 1_000
"""How many may be asked for: the lattice fills the box."""

RINGS = (
    ((1, 0), (0, 1), (-1, 1)),
    ((1, 1), (-1, 2), (-2, 1)),
    ((2, 1), (1, 2), (-1, 3), (-2, 3), (-3, 2), (-3, 1)),
)
"""Half of the neighbours at distances 1, sqrt(3) and sqrt(7), in steps along the row and to the row above (leaning
right); the other half are their opposites."""

REACH = math.sqrt(3.0)
"""In sides: obstacle vertices and the ends of routes are joined to the lattice this far away."""

SHORT = 1e-9
"""A line to a vertex of the shore is tested without this share of its end."""


def lattice(
    low: FloatArray, high: FloatArray, side_m: float, rings: tuple[tuple[tuple[int, int], ...], ...] = RINGS
) -> tuple[FloatArray, Indices]:
    """A lattice of equilateral triangles over a rectangle, and the pairs of neighbours on some rings.

    Parameters
    ----------
    low, high : ndarray, shape (2,)
        Opposite corners of the rectangle, in metres.
    side_m
        Of the triangles.
    rings
        Which neighbours are joined.

    Returns
    -------
    places : ndarray, shape (n, 2)
    pairs : ndarray of int, shape (m, 2)
    """
    rows = math.ceil((high[1] - low[1]) / (side_m * math.sqrt(0.75))) + 1
    columns = math.ceil((high[0] - low[0]) / side_m) + 2
    row, column = np.divmod(np.arange(rows * columns), columns)
    places = low + side_m * np.column_stack([column - 0.5 * (row % 2), row * math.sqrt(0.75)])
    pairs = []
    for along, up in (step for ring in rings for step in ring):
        # Odd rows lie half a side to the left.
        above = row + up
        beside = column + along + (above % 2 - row % 2 + up) // 2
        inside = (above < rows) & (beside >= 0) & (beside < columns)
        pairs.append(np.column_stack([np.arange(len(row)), above * columns + beside])[inside])
    return places, np.vstack(pairs)


class TessellationRouter:
    """Routes over a lattice, reduced.

    Parameters
    ----------
    mesh
        The water; zones' outlines are among its sides.
    danger
        What danger there is.
    side_m
        Of the lattice's triangles; by default a sixtieth of the longer side of the water's box.

    Raises
    ------
    InvalidMission
        `side_m` is not a length, or less than a thousandth of the longer side of the water's box.
    """

    def __init__(self, mesh: Mesh, danger: Danger = NO_DANGER, *, side_m: float | None = None) -> None:
        across_m = float(np.ptp(mesh.points, axis=0).max())
        least_m = across_m / MOST_SIDES_ACROSS
        if side_m is not None and not least_m <= side_m < math.inf:
            raise InvalidMission(f"is {side_m!r}; expected a finite number >= {least_m:.3g}", where="side_m")
        self.mesh = mesh
        self.danger = danger
        self.side_m = across_m / SIDES_ACROSS if side_m is None else side_m

    def route(self, start: npt.ArrayLike, goal: npt.ArrayLike) -> Route:
        """The reduced route; see `Router.route`."""
        ends = checked_ends(start, goal)
        network = self._network(ends, ["start", "goal"])
        require_way(network.ways.costs[0, network.arrival + 1], ends)
        return judged(self._reduced(network, 0, 1), self.mesh, self.danger, RouteMethod.TESSELLATION)

    def distances(self, points: npt.ArrayLike) -> FloatArray:
        """Costs of the reduced routes from each place to those after it; see `Router.distances`."""
        points = checked_places(points)
        network = self._network(points, place_names(len(points)))
        costs = np.full((len(points), len(points)), np.inf)
        for i, j in combinations(range(len(points)), 2):
            if np.isfinite(network.ways.costs[i, network.arrival + j]):
                line = self._reduced(network, i, j)
                costs[i, j] = self.danger.costs(line[:-1], line[1:]).sum()
        return as_matrix(costs, points, self.danger)

    @cached_property
    def _lattice(self) -> tuple[FloatArray, Touches, Indices]:
        """The lattice in the water: its places, their triangles, and pairs that no shore parts."""
        places, pairs = lattice(self.mesh.points.min(axis=0), self.mesh.points.max(axis=0), self.side_m)
        touches = self.mesh.holding(places)
        wet = np.unique(touches.place)
        rank = np.full(len(places), -1)
        rank[wet] = np.arange(len(wet))
        pairs = rank[pairs[(rank[pairs] >= 0).all(axis=1)]]
        places = places[wet]
        clear = self.mesh.is_clear(places[pairs[:, 0]], places[pairs[:, 1]])
        return places, touches.among(wet), pairs[clear]

    @cached_property
    def _index(self) -> KDTree:
        return KDTree(self._lattice[0])

    @cached_property
    def _base(self) -> _Base:
        """What does not depend on the ends of routes: the water's vertices, then the lattice."""
        mesh = self.mesh
        vertices = np.empty((mesh.sectors.max() + 1, 2))
        vertices[mesh.sectors] = mesh.tails
        places, touches, pairs = self._lattice
        sides = np.arange(len(mesh.sectors))
        along_sides = np.column_stack([mesh.sectors, mesh.sectors[following(sides)]])
        vertex, near = self._links(vertices)
        # Where shores touch, a line that ends there does not tell from which side.
        alone = KDTree(vertices).query_ball_point(vertices, ROUNDING_M, return_length=True) == 1
        links = np.column_stack([vertex, len(vertices) + near])[alone[vertex]]
        all_places = np.vstack([vertices, places])
        all_pairs = np.vstack([along_sides, links, len(vertices) + pairs])
        return _Base(
            places=all_places,
            touches=Touches(mesh.sectors, sides // 3) + Touches(len(vertices) + touches.place, touches.triangle),
            arcs=Arcs.both_ways(all_places, all_pairs, self.danger),
        )

    def _links(self, places: FloatArray) -> tuple[Indices, Indices]:
        """Pairs of a place and a lattice vertex near it with no shore between, but for one at the place itself."""
        near = KDTree(places).sparse_distance_matrix(self._index, REACH * self.side_m, output_type="ndarray")
        owner, vertex = near["i"], near["j"]
        from_lattice = self._lattice[0][vertex]
        clear = self.mesh.is_clear(from_lattice, places[owner] + SHORT * (from_lattice - places[owner]))
        return owner[clear], vertex[clear]

    def _network(self, points: FloatArray, names: list[str]) -> _Network:
        """The base and some points: those to depart from, then those to arrive at."""
        mesh, base = self.mesh, self._base
        at = mesh.touches(points, names)
        departure = len(base.places)
        arrival = departure + len(points)
        lattice_from = departure - len(self._lattice[0])
        linked, near = self._links(points)
        corner = (3 * at.triangle[:, None] + np.arange(3)).ravel()
        point = np.concatenate([linked, np.repeat(at.place, 3)])
        point, beside = distinct(point, np.concatenate([lattice_from + near, mesh.sectors[corner]]))
        first, second = at.companions()
        places = np.vstack([base.places, points, points])
        arcs = base.arcs
        for tails, heads in (
            (departure + point, beside),
            (beside, arrival + point),
            distinct(departure + first, arrival + second),
        ):
            arcs += Arcs.one_way(places, tails, heads, self.danger)
        touches = base.touches
        for own in (departure, arrival):
            touches += Touches(own + at.place, at.triangle)
        ways = cheapest_ways(len(places), arcs, np.arange(departure, arrival))
        return _Network(places, touches, arrival, ways)

    def _reduced(self, network: _Network, start: int, goal: int) -> FloatArray:
        """The cheapest polyline along the lines of sight between the vertices of the way found."""
        way = np.array(network.ways.way(start, network.arrival + goal))
        places, touches = network.places[way], network.touches.among(way)
        nothing = np.zeros(self.mesh.tails.shape[0], dtype=np.bool_)
        seen = sights(self.mesh, places, touches, places, touches, nothing)
        pairs = np.column_stack([seen.place_eyes, seen.places])
        ways = cheapest_ways(len(way), Arcs.both_ways(places, pairs, self.danger), np.array([0]))
        return np.asarray(places[ways.way(0, len(way) - 1)])


@dataclass(frozen=True)
class _Base:
    """Vertices of the water and the lattice, joined."""

    places: FloatArray
    touches: Touches
    arcs: Arcs


@dataclass(frozen=True)
class _Network:
    """What a search between points found; arrivals are numbered from `arrival`."""

    places: FloatArray
    touches: Touches
    arrival: int
    ways: Ways
