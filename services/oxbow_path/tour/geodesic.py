"""Geodesic distances: the lengths of shortest ways inside the water.

A shortest way in a polygon turns only at corners of the shore (Lee and Preparata 1984). The graph over sites
and corners joins those that see each other nearby, and the corners of every triangle of a constrained Delaunay
triangulation, so that it is connected wherever the water is, however narrow. Its ways are inside the water; one
that passes far from any corner that it could turn at may be a little longer than the shortest.

A `Router` finds the costs of all pairs of places. A tour of thousands of sites needs those of near ones alone, and
the least tree over all, which one search over this graph finds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from scipy.sparse import coo_array, csr_array, vstack
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree
from shapely import MultiPoint, Polygon

from oxbow.arrays import FloatArray, Indices
from oxbow.geometry.route.mesh import Touches, WaterMesh
from oxbow.geometry.triangles import following
from oxbow_path.tour.sight import Sight

__all__ = ["Geodesics", "ShoreSights"]

SITES_IN_SIGHT = 12
"""How many of the nearest sites are tried for sight from a site."""

CORNERS_IN_SIGHT = 8
"""How many of the nearest corners of the shore are tried for sight from a site or corner."""

TOUCH_M = 1e-6
"""A line that comes this near to where rings touch does not pass there."""

LEAST_STEP_M = 1e-9
"""Added to every step, as a sparse matrix drops zeros."""

FIRST_REACH = 1.5
"""A search for a way first goes this many times as far as the straight line, and each failure doubles that."""

DOUBLINGS = 7
"""After this many a search goes everywhere."""

TOGETHER = 64
"""At most this many ways are searched for at once: each search copies the graph."""

CHUNK = 256
"""At most this many sites are sources of one search, to bound its memory."""


class ShoreSights:
    """The shore of a polygon of water: its triangulation, and which of its corners see each other nearby.

    Where rings touch one another, the water on either side has a corner of its own: no way leads through.
    """

    def __init__(self, free: Polygon) -> None:
        shapely.prepare(free)
        self.free = free
        self._mesh = WaterMesh.of(free)
        self._sight = Sight(free)
        self._corners, sectors = self._mesh.sector_places, self._mesh.sectors
        places, place, count = np.unique(self._corners, axis=0, return_inverse=True, return_counts=True)
        self._touches = MultiPoint(places[count > 1])
        # A corner where rings touch belongs to several sectors, and sight does not say to which: it is joined by
        # triangles only.
        self._plain = np.flatnonzero(count[place] == 1)
        plain = self._corners[self._plain]
        near = self._plain[_nearest(plain, plain, CORNERS_IN_SIGHT)]
        around = np.column_stack([sectors, sectors[following(np.arange(len(sectors)))]])
        self._pairs = np.vstack([self._in_sight(self._corners, near), around])

    def geodesics(self, sites: FloatArray) -> Geodesics:
        """The ways between some sites, shape (n, 2), of the water."""
        n, places = len(sites), np.vstack([sites, self._corners])
        site, side = Touches(np.arange(n), self._mesh.located(sites)).sides()
        around = np.column_stack([site, n + self._mesh.sectors[side]])
        site, corner = _nearest(sites, self._corners[self._plain], CORNERS_IN_SIGHT).T
        looks = [_nearest(sites, sites, SITES_IN_SIGHT), np.column_stack([site, n + self._plain[corner]])]
        pairs = np.vstack([self._in_sight(places, np.vstack(looks)), around, n + self._pairs])
        return Geodesics(n, places, _graph(places, pairs))

    def _in_sight(self, places: FloatArray, pairs: Indices) -> Indices:
        """Those pairs of places between which a straight line stays in the water, and passes no touch."""
        pairs = np.unique(np.sort(pairs, axis=1), axis=0)
        lines = np.asarray(shapely.linestrings(places[pairs]))
        seen = self._sight.along(places, pairs, lines)
        if not self._touches.is_empty:
            seen &= ~shapely.dwithin(lines, self._touches, TOUCH_M)
        return np.asarray(pairs[seen])


@dataclass(frozen=True)
class Geodesics:
    """Shortest ways between sites inside the water.

    `places` are the sites, then the corners of the shore; `graph` holds the distances of places in sight.
    """

    count: int
    places: FloatArray
    graph: csr_array[np.float64]
    _known: dict[tuple[int, int], _Leg] = field(default_factory=dict, repr=False, compare=False)

    def near(self, limit_m: float) -> csr_array[np.float64]:
        """Distances of all pairs of sites no farther apart than the limit, shape (n, n)."""
        rows = []
        for first in range(0, self.count, CHUNK):
            sources = np.arange(first, min(first + CHUNK, self.count))
            # The limit makes each search local; without it, all pairs of thousands of sites would be searched for.
            distance = dijkstra(self.graph, indices=sources, limit=limit_m)[:, : self.count]
            row, column = np.nonzero(np.isfinite(distance) & (distance > 0.0))
            rows.append(coo_array((distance[row, column], (row, column)), shape=distance.shape))
        return csr_array(vstack(rows))

    def spanning_tree(self) -> csr_array[np.float64]:
        """The least tree over all sites, shape (n, n), each leg one way.

        Two sites that the tree joins have neighbouring cells in the graph's Voronoi diagram (Mehlhorn 1988): one
        search from all sites finds it.
        """
        sites = np.arange(self.count)
        distance, _, nearest = dijkstra(self.graph, indices=sites, min_only=True, return_predecessors=True)
        steps = coo_array(self.graph)
        a, b = nearest[steps.row], nearest[steps.col]
        length = distance[steps.row] + steps.data + distance[steps.col]
        shortest_first = np.lexsort((b, a, length))
        shortest_first = shortest_first[a[shortest_first] < b[shortest_first]]
        a, b, length = a[shortest_first], b[shortest_first], length[shortest_first]
        # Of legs between the same two sites `unique` keeps the first: the shortest, in this order.
        _, first = np.unique(a.astype(np.int64) * self.count + b, return_index=True)
        shape = (self.count, self.count)
        return csr_array(minimum_spanning_tree(coo_array((length[first], (a[first], b[first])), shape=shape)))

    def from_site(self, site: int) -> FloatArray:
        """Distances from one site to all, shape (n,)."""
        return np.asarray(dijkstra(self.graph, indices=np.array([site]))[0, : self.count])

    def between_m(self, starts: Indices, goals: Indices) -> FloatArray:
        """The distances of pairs of sites, shape (n,), found without searching much farther than these.

        Parameters
        ----------
        starts, goals
            The numbers of the sites, shape (n,).

        Returns
        -------
        ndarray, shape (n,)
            In metres, in the order of the pairs.
        """
        return np.array([leg.length_m for leg in self._legs(starts, goals)])

    def way(self, order: Sequence[int] | Indices) -> FloatArray:
        """The closed way through the sites in that order, shape (m, 2), its end equal to its start."""
        starts, goals = np.asarray(order), np.roll(order, -1)
        # Two in sight of each other need no search: the straight line is the shortest.
        seen = (np.asarray(self.graph[starts, goals]).ravel() > 0.0) | (starts == goals)
        winding = iter(self._legs(starts[~seen], goals[~seen]))
        parts = [
            (start,) if straight else next(winding).nodes[:-1]
            for start, straight in zip(starts.tolist(), seen.tolist(), strict=True)
        ]
        parts.append((int(starts[0]),))
        return self.places[np.concatenate(parts).astype(np.intp)]

    def _legs(self, starts: Indices, goals: Indices) -> list[_Leg]:
        """The shortest ways of pairs of sites, each searched for once: a tour keeps legs of its start."""
        pairs = list(zip(starts.tolist(), goals.tolist(), strict=True))
        fresh = np.array(sorted({pair for pair in pairs if pair not in self._known}), dtype=np.intp).reshape(-1, 2)
        apart_m = np.hypot(*(self.places[fresh[:, 1]] - self.places[fresh[:, 0]]).T) + LEAST_STEP_M
        nearest_first = np.argsort(apart_m, kind="stable")
        # Those of like distance are searched for together: the farthest of them sets the limit for all.
        for first in range(0, len(fresh), TOGETHER):
            chosen = nearest_first[first : first + TOGETHER]
            for leg in self._search(fresh[chosen], FIRST_REACH * float(apart_m[chosen].max())):
                start, goal = leg.nodes[0], leg.nodes[-1]
                self._known[start, goal], self._known[goal, start] = leg, leg.back()
        return [self._known[pair] for pair in pairs]

    def _search(self, pairs: Indices, reach_m: float) -> Iterator[_Leg]:
        """The shortest ways of pairs, shape (n, 2), searched for together, at first within a distance."""
        for limit_m in (*(reach_m * 2.0**doubling for doubling in range(DOUBLINGS + 1)), np.inf):
            starts, goals = pairs.T
            distance, previous = dijkstra(self.graph, indices=starts, return_predecessors=True, limit=limit_m)
            reached = np.isfinite(distance[np.arange(len(pairs)), goals])
            for row in np.flatnonzero(reached).tolist():
                yield _Leg.of(distance[row], previous[row], int(starts[row]), int(goals[row]))
            pairs = pairs[~reached]
            if len(pairs) == 0:
                break


@dataclass(frozen=True)
class _Leg:
    """A way between two sites: its length, and the places that it passes, both sites included."""

    length_m: float
    nodes: tuple[int, ...]

    @classmethod
    def of(cls, distance_m: FloatArray, previous: Indices, start: int, goal: int) -> _Leg:
        nodes = [goal]
        while nodes[-1] != start:
            nodes.append(int(previous[nodes[-1]]))
        return cls(float(distance_m[goal]), tuple(nodes[::-1]))

    def back(self) -> _Leg:
        """The same way from its goal to its start."""
        return _Leg(self.length_m, self.nodes[::-1])


def _nearest(points: FloatArray, others: FloatArray, count: int) -> Indices:
    """Pairs of every point with the others nearest to it, shape (m, 2)."""
    count = min(count + 1, len(others))
    _, nearest = cKDTree(others).query(points, k=np.arange(1, count + 1))
    pairs = np.column_stack([np.repeat(np.arange(len(points)), count), nearest.ravel()])
    apart = (points[pairs[:, 0]] != others[pairs[:, 1]]).any(axis=1)
    return np.asarray(pairs[apart])


def _graph(places: FloatArray, pairs: Indices) -> csr_array[np.float64]:
    """The symmetric graph of some pairs, with the distances of their ends."""
    a, b = np.unique(np.sort(pairs, axis=1), axis=0).T
    weight = np.hypot(*(places[a] - places[b]).T) + LEAST_STEP_M
    both = (np.concatenate([a, b]), np.concatenate([b, a]))
    n = len(places)
    return csr_array(coo_array((np.concatenate([weight, weight]), both), shape=(n, n)))
