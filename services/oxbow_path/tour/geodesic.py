"""Geodesic distances: the lengths of shortest ways inside the water.

A shortest way in a polygon is straight but for corners of the shore (Lee and Preparata 1984). The graph over sites
and corners joins those that see each other nearby, and the corners of every triangle of a constrained Delaunay
triangulation, so that it is connected wherever the water is, however narrow. Its ways are inside the water; one
that passes far from any corner that it could turn at may be a little longer than the shortest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_array, csr_array, vstack
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree
from shapely import Polygon

from oxbow.contracts import FloatArray

__all__ = ["Geodesics", "Indices", "Shore"]

Indices = npt.NDArray[np.intp]

SITES_IN_SIGHT = 12
"""How many of the nearest sites a site looks for."""

CORNERS_IN_SIGHT = 8
"""How many of the nearest corners of the shore a site or corner looks for."""

TOUCH_M = 1e-6
"""Lines that come so near to where rings touch do not pass it."""

LEAST_STEP_M = 1e-9
"""A sparse matrix drops zeros."""

CHUNK = 256
"""So many sites are sources of one search, to bound its memory."""


class Shore:
    """The shore of a polygon of water: its triangulation, and which of its corners see each other nearby.

    Where rings touch one another, the water on either side has a corner of its own: no way leads through.
    """

    def __init__(self, free: Polygon) -> None:
        shapely.prepare(free)
        self.free = free
        triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(free))
        vertices = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
        places, index = np.unique(vertices, axis=0, return_inverse=True)
        self._triangles = shapely.STRtree(triangles)
        self._sides = _fans(index.reshape(-1, 3))
        self._corners = np.empty((self._sides.max() + 1, 2))
        self._corners[self._sides.ravel()] = vertices
        at = np.empty(len(self._corners), dtype=np.intp)
        at[self._sides.ravel()] = index.ravel()
        touches = np.bincount(at) > 1
        self._touches = shapely.multipoints(places[touches])
        self._open = np.flatnonzero(~touches[at])
        near = self._open[_nearest(self._corners[self._open], self._corners[self._open], CORNERS_IN_SIGHT)]
        around = [self._sides[:, [k, k - 1]] for k in range(3)]
        self._pairs = np.vstack([self._in_sight(self._corners, near), *around])

    def geodesics(self, sites: FloatArray) -> Geodesics:
        """The ways between some sites, shape (n, 2), of the water."""
        n, places = len(sites), np.vstack([sites, self._corners])
        _, triangle = self._triangles.query_nearest(shapely.points(sites), all_matches=False)
        around = np.column_stack([np.repeat(np.arange(n), 3), n + self._sides[triangle].ravel()])
        site, corner = _nearest(sites, self._corners[self._open], CORNERS_IN_SIGHT).T
        looks = [_nearest(sites, sites, SITES_IN_SIGHT), np.column_stack([site, n + self._open[corner]])]
        pairs = np.vstack([self._in_sight(places, np.vstack(looks)), around, n + self._pairs])
        return Geodesics(n, places, _graph(places, pairs))

    def _graph(places: FloatArray, pairs: Indices) -> csr_array[np.float64]:
    """The symmetric graph of some pairs, with the distances of their ends."""
    a, b = np.unique(np.sort(pairs, axis=1), axis=0).T
    weight = np.hypot(*(places[a] - places[b]).T) + LEAST_STEP_M
    both = (np.concatenate([a, b]), np.concatenate([b, a]))
    n = len(places)
    return csr_array(coo_array((np.concatenate([weight, weight]), both), shape=(n, n)))
