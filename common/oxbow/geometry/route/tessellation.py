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

import numpy as np
from scipy.spatial import KDTree

from oxbow.arrays import FloatArray, Indices
from oxbow.errors import InvalidRequest
from oxbow.geometry.lattice import joined_lattice
from oxbow.geometry.route.danger import NO_DANGER, Danger
from oxbow.geometry.route.mesh import Touches, WaterMesh
from oxbow.geometry.route.network import Ends, Links, Way
from oxbow.geometry.route.search import Arcs, cheapest_ways
from oxbow.geometry.route.sights import sights
from oxbow.geometry.triangles import following
from oxbow.tolerances import ROUNDING_M

__all__ = ["Tessellation"]

SIDES_ACROSS = 60
"""How many sides of the lattice fit the longer side of the water's bounding box, by default."""

MOST_SIDES_ACROSS = 1_000
"""The most that may be requested: memory grows with the square, since the lattice fills the box."""

REACH = math.sqrt(3.0)
"""In sides: obstacle vertices and the ends of routes are joined to the lattice this far away."""

SHORT = 1e-9
"""A line to a vertex of the shore is tested without this share of its end."""


class Tessellation:
    """The network of the water's vertices and a lattice, and how ways over it are reduced.

    Parameters
    ----------
    mesh
        The water; zones' outlines are among its sides.
    danger
        The danger zones, as they count for one vehicle.
    side_m
        Side of the lattice's triangles; by default a sixtieth of the longer side of the water's box.

    Raises
    ------
    InvalidRequest
        `side_m` is not a length, or less than a thousandth of the longer side of the water's box.
    """

    def __init__(self, mesh: WaterMesh, danger: Danger = NO_DANGER, *, side_m: float | None = None) -> None:
        across_m = float(np.ptp(mesh.points, axis=0).max())
        least_m = across_m / MOST_SIDES_ACROSS
        if side_m is not None and not least_m <= side_m < math.inf:
            raise InvalidRequest(f"is {side_m!r}; expected a finite number >= {least_m:.3g}", where="side_m")
        self.mesh = mesh
        self.danger = danger
        self.side_m = across_m / SIDES_ACROSS if side_m is None else side_m

    @cached_property
    def places(self) -> FloatArray:
        """See `Network.places`: the vertices, once for each sector, then the lattice."""
        return np.vstack([self.mesh.sector_places, self._lattice.places])

    @cached_property
    def arcs(self) -> Arcs:
        """See `Network.arcs`: along the sides of triangles, from vertices to the lattice, and within that."""
        vertices, sectors = self.mesh.sector_places, self.mesh.sectors
        along_sides = np.column_stack([sectors, sectors[following(np.arange(len(sectors)))]])
        # Obstacle vertices are joined to the lattice around them, as the report has it.
        vertex, near = self._near(vertices)
        # Where shores touch, a line that ends there could arrive from either side.
        alone = KDTree(vertices).query_ball_point(vertices, ROUNDING_M, return_length=True) == 1
        links = np.column_stack([vertex, near])[alone[vertex]]
        pairs = np.vstack([along_sides, links, len(vertices) + self._lattice.pairs])
        return Arcs.both_ways(self.places, pairs, self.danger)

    def links(self, ends: Ends) -> Links:
        """See `Network.links`: to the lattice near, and to the corners of the triangles that ends touch."""
        (near_end, near), (end, corner) = self._near(ends.places), ends.at.sides()
        beside = np.concatenate([near, self.mesh.sectors[corner]])
        return Links(np.concatenate([near_end, end]), beside, beside, *ends.at.companions())

    def reduced(self, way: Way) -> FloatArray:
        """The cheapest polyline along the lines of sight between the places of a way."""
        # As a small visibility graph of the way's own places: the search over it is exact.
        places = np.vstack([way.start, self.places[way.nodes], way.goal])
        ends, inner = way.ends.at, self._touches.among(way.nodes)
        last = len(places) - 1
        touches = Touches(last * ends.place, ends.triangle) + Touches(1 + inner.place, inner.triangle)
        # No corner is asked for: a reduced way bends only where the way found did.
        nothing = np.zeros(len(self.mesh.tails), dtype=np.bool_)
        seen = sights(self.mesh, places, touches, places, touches, nothing)
        pairs = np.column_stack([seen.place_eyes, seen.places])
        arcs = Arcs.both_ways(places, pairs, self.danger)
        ways = cheapest_ways(arcs.graph(len(places)), np.array([0]))
        return np.asarray(places[ways.way(0, last)])

    @cached_property
    def _lattice(self) -> _Lattice:
        """The lattice in the water."""
        # The lattice fills the box, land included: what is not in the water, or leads over land, is dropped
        # afterwards.
        places, pairs = joined_lattice(self.mesh.points.min(axis=0), self.mesh.points.max(axis=0), self.side_m)
        touches = self.mesh.holding(places)
        wet = np.unique(touches.place)
        rank = np.full(len(places), -1)
        rank[wet] = np.arange(len(wet))
        pairs = rank[pairs[(rank[pairs] >= 0).all(axis=1)]]
        places = places[wet]
        clear = self.mesh.is_clear(places[pairs[:, 0]], places[pairs[:, 1]])
        return _Lattice(places, touches.among(wet), pairs[clear])

    @cached_property
    def _index(self) -> KDTree:
        return KDTree(self._lattice.places)

    @cached_property
    def _touches(self) -> Touches:
        """The triangles that the network's places touch."""
        sectors, touches = self.mesh.sectors, self._lattice.touches
        on_lattice = Touches(len(self.mesh.sector_places) + touches.place, touches.triangle)
        return Touches(sectors, np.arange(len(sectors)) // 3) + on_lattice

    def _near(self, points: FloatArray) -> tuple[Indices, Indices]:
        """Pairs of a point and a place of the lattice near it with no shore between, except at the point."""
        near = KDTree(points).sparse_distance_matrix(self._index, REACH * self.side_m, output_type="ndarray")
        owner, place = near["i"], near["j"]
        from_lattice = self._lattice.places[place]
        clear = self.mesh.is_clear(from_lattice, points[owner] + SHORT * (from_lattice - points[owner]))
        return owner[clear], len(self.mesh.sector_places) + place[clear]


@dataclass(frozen=True)
class _Lattice:
    """Places of the lattice in the water, the triangles that they touch, and pairs with no shore between."""

    places: FloatArray
    touches: Touches
    pairs: Indices
