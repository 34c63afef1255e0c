"""Slits in a region: as many as leave it in one piece.

A region is in one piece if and only if nothing outside it, slits included, runs round a part of it. So a slit is
tested where it lies, without a look at the rest of the region: the places where it meets what is outside must
belong to as many parts of that. The rings of the region and of the slits divide it into corners, edges and faces.
What these make up runs round nothing if and only if corners less edges plus faces are as many as the parts in
which it is connected (Euler's formula), so that only what is added is counted. Faces with holes need no care:
nothing but the face joins its rings, so that they are taken for parts of their own, and the face for one without
holes.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TypeGuard

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import Geometries, Indices, Mask
from oxbow.tolerances import ROUNDING_M
from oxbow_path.walk.region import largest

__all__ = ["GRID_M", "slit", "slit_in_turn"]

GRID_M = 1e-7
"""What comes nearer to itself than this touches itself."""


def slit(region: Polygon, slits: Geometries) -> Polygon:
    """The region less the slits that do not part it.

    Parameters
    ----------
    region
        The region, perhaps with holes, in metres.
    slits : array of Polygon, shape (n,)
        Areas that may reach beyond it, and overlap one another.

    Returns
    -------
    Polygon
        In one piece; the region itself without slits.
    """
    if len(slits) == 0:
        return region
    rest = region.difference(shapely.union_all(slits))
    if _is_whole(rest):
        return rest
    # Slits that together part it, except for those that join the parts again.
    joining = _joining(shapely.get_parts(rest), slits)
    rest = region.difference(shapely.union_all(slits[~joining]))
    if _is_whole(rest):
        return rest
    # What still parts it lies about the lesser parts: all else is slit at once.
    parts = shapely.get_parts(rest)
    parting = _touching(slits, np.delete(parts, np.argmax(shapely.area(parts))))
    parting = _touching(slits, slits[parting])
    rest = region.difference(shapely.union_all(slits[~joining & ~parting]))
    return slit_in_turn(rest, slits[parting]) if _is_whole(rest) else slit_in_turn(region, slits)


def slit_in_turn(region: Polygon, slits: Geometries) -> Polygon:
    """The region less as many slits as leave it in one piece, first come, first served.

    All are tried at once, and where that parts it, one half of them after the other.

    Parameters
    ----------
    region
        The region, in one piece, perhaps with holes, in metres.
    slits : array of Polygon, shape (n,)
        Areas that may reach beyond it, and overlap one another; at least one.

    Returns
    -------
    Polygon
        In one piece, to within the grid.
    """
    outside, cut = _Outside(region, slits), np.zeros(len(slits), dtype=bool)
    untried = [np.arange(len(slits))]
    while untried:
        numbers = untried.pop()
        if outside.is_extended(numbers):
            cut[numbers] = True
        elif len(numbers) > 1:
            half = len(numbers) // 2
            # The first half is on top of the stack: earlier slits take precedence.
            untried += [numbers[half:], numbers[:half]]
    # On the grid it is in one piece: what else a difference leaves is thinner than that, or nothing but lines.
    return largest(region.difference(shapely.union_all(slits[cut])))


class _Outside:
    """What is outside a region: at first all beyond its rings, to which slits are added.

    Parameters
    ----------
    region
        A region in one piece.
    slits : array of Polygon, shape (n,)
        Areas that may be added.
    """

    def __init__(self, region: Polygon, slits: Geometries) -> None:
        faces = _faces(region, slits)
        steps, face = _steps(faces)
        self._edges, edge, sides = np.unique(steps, axis=0, return_inverse=True, return_counts=True)
        self._edges_of = _grouped(edge, face, len(faces))
        slit, face_in = STRtree(shapely.point_on_surface(faces)).query(slits, predicate="contains")
        self._faces_of = _grouped(face_in, slit, len(slits))
        rim = sides == 1
        corners_count = int(steps.max()) + 1
        self._has_face = np.zeros(len(faces), dtype=bool)
        self._has_edge = rim
        self._has_corner = np.zeros(corners_count, dtype=bool)
        self._has_corner[self._edges[rim]] = True
        self._part = _parts(corners_count, self._edges[rim])
        """The part of what is outside that each corner belongs to; every other corner is a part of its own."""

    def is_extended(self, numbers: Indices) -> bool:
        """Add some slits, unless they part the region or leave none of it; whether they are added.

        Were none of it left, what is outside would be a sphere, whose characteristic is more than its parts.
        """
        faces = _union(self._faces_of, numbers)
        faces = faces[~self._has_face[faces]]
        if len(faces) == 0:
            return True
        edges = _union(self._edges_of, faces)
        corners = np.unique(self._edges[edges])
        old_corners = corners[self._has_corner[corners]]
        parts, part = np.unique(self._part[corners], return_inverse=True)
        joined = _parts(len(parts), part[np.searchsorted(corners, self._edges[edges])])
        more_parts = joined.max() + 1 - len(np.unique(self._part[old_corners]))
        more_edges = np.count_nonzero(~self._has_edge[edges])
        # Euler's formula for what is added: a difference means that it runs round something.
        if more_parts != len(corners) - len(old_corners) - more_edges + len(faces):
            return False
        self._has_face[faces] = self._has_edge[edges] = self._has_corner[corners] = True
        name = np.arange(len(self._part))
        name[parts] = parts[np.unique(joined, return_index=True)[1]][joined]
        self._part = name[self._part]
        return True


def _faces(region: Polygon, slits: Geometries) -> Geometries:
    """What the rings of the slits divide a region into."""
    lines = shapely.union_all([region.boundary, *shapely.boundary(slits)], grid_size=GRID_M)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(lines)))
    shapely.prepare(region)
    return np.asarray(faces[shapely.contains(region, shapely.point_on_surface(faces))])


def _steps(faces: Geometries) -> tuple[Indices, Indices]:
    """The steps from corner to corner round every face, and the face of each."""
    rings, owner = shapely.get_rings(faces, return_index=True)
    places, ring = shapely.get_coordinates(rings, return_index=True)
    corner = np.unique(places, axis=0, return_inverse=True)[1]
    same = ring[1:] == ring[:-1]
    return np.sort(np.column_stack([corner[:-1], corner[1:]])[same], axis=1), owner[ring[1:][same]]


def _parts(count: int, pairs: Indices) -> Indices:
    """The part of each of `count` things, shape (count,), where pairs (m, 2) join things into parts."""
    joined = np.ones(len(pairs), dtype=bool)
    graph = coo_array((joined, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def _grouped(values: Indices, group: Indices, count: int) -> Sequence[Indices]:
    """The values of each of `count` groups."""
    order = np.argsort(group, kind="stable")
    bounds = np.searchsorted(group[order], np.arange(count + 1))
    return [values[order[first:last]] for first, last in pairwise(bounds)]


def _union(groups: Sequence[Indices], numbers: Indices) -> Indices:
    return np.unique(np.concatenate([groups[number] for number in numbers]))


def _touching(slits: Geometries, areas: Geometries) -> Mask:
    touching = np.zeros(len(slits), dtype=bool)
    touching[STRtree(slits).query(areas, predicate="dwithin", distance=ROUNDING_M)[1]] = True
    return touching


def _is_whole(rest: BaseGeometry) -> TypeGuard[Polygon]:
    return isinstance(rest, Polygon) and not rest.is_empty


def _joining(parts: Geometries, slits: Geometries) -> Mask:
    """Fewest slits that join all parts that they touch: chosen from the last to the first (Kruskal 1956)."""
    slit, part = STRtree(parts).query(slits, predicate="dwithin", distance=ROUNDING_M)
    joined, joining = np.arange(len(parts)), np.zeros(len(slits), dtype=bool)
    for number in np.unique(slit)[::-1]:
        together = np.unique(joined[part[slit == number]])
        if len(together) > 1:
            joining[number] = True
            joined[np.isin(joined, together)] = together[0]
    return joining
