"""Constrained Delaunay triangulation of water (L. P. Chew 1989), by GEOS."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import FloatArray

__all__ = ["Geometries", "Indices", "paired", "parted", "triangulated", "twins_of"]

Indices = npt.NDArray[np.intp]
Geometries = npt.NDArray[np.object_]


def triangulated(faces: BaseGeometry | Geometries) -> tuple[FloatArray, Indices]:
    """The triangles of polygons.

    Parameters
    ----------
    faces
        One valid region or an array of such. Where they border, they have the border's vertices in common.

    Returns
    -------
    vertices : ndarray, shape (m, 2)
    corners : ndarray of int, shape (n, 3)
        The vertices of each triangle, counterclockwise.
    """
    triangles = shapely.get_parts(shapely.get_parts(shapely.constrained_delaunay_triangles(faces)))
    xy = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, 2::-1]
    vertices, index = np.unique(xy.reshape(-1, 2), axis=0, return_inverse=True)
    return vertices, _without_flats(vertices, index.reshape(-1, 3))


def parted(water: Polygon | MultiPolygon, outlines: Sequence[BaseGeometry]) -> Geometries:
    """The parts into which lines cut a region; neighbours have the vertices of their common border in common."""
    lines = shapely.get_parts(shapely.node(shapely.geometrycollections([water.boundary, *outlines])))
    faces = shapely.get_parts(shapely.polygonize(lines))
    shapely.prepare(water)
    return np.asarray(faces[shapely.contains(water, shapely.point_on_surface(faces))])


def twins_of(corners: Indices) -> Indices:
    """The same side as it is seen from the neighbouring triangle, or -1 at a shore; shape (n, 3).

    Side j of a triangle runs from its corner j to its corner j + 1; sides are numbered 3 t + j.
    """
    one, other = paired(corners.ravel(), np.roll(corners, -1, axis=1).ravel())
    twins = np.full(corners.size, -1, dtype=np.intp)
    twins[one], twins[other] = other, one
    return twins.reshape(-1, 3)


def paired(tails: Indices, heads: Indices) -> tuple[Indices, Indices]:
    """Which sides run between the same two vertices: indices of the one and of the other."""
    low, high = np.minimum(tails, heads), np.maximum(tails, heads)
    key = low * (high.max(initial=0) + 1) + high
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    return order[same], order[same + 1]


def _without_flats(vertices: FloatArray, corners: Indices) -> Indices:
    """Triangles without those that have no height: vertices in line make such.

    A flat triangle's longest side is exchanged for the other diagonal of the quadrangle that it makes with its
    neighbour there; one with its longest side on the shore holds no water.
    """
    corners = corners.copy()
    for _ in range(len(corners)):
        side = _longest_side_of_a_flat(vertices, corners)
        if side is None:
            break
        t, j = divmod(side, 3)
        twin = int(twins_of(corners).ravel()[side])
        if twin < 0:
            corners = np.delete(corners, t, axis=0)
            continue
        u, k = divmod(twin, 3)
        tail, head, middle, far = corners[t, j], corners[t, j - 2], corners[t, j - 1], corners[u, k - 1]
        corners[t], corners[u] = (tail, far, middle), (far, head, middle)
    return corners


def _longest_side_of_a_flat(vertices: FloatArray, corners: Indices) -> int | None:
    """One flat triangle's longest side: that of the flat triangle whose longest side is shortest."""
    xy = vertices[corners]
    along = np.roll(xy, -1, axis=1) - xy
    double_area = along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0]
    length = np.hypot(along[..., 0], along[..., 1])
    flat = np.flatnonzero(double_area <= np.finfo(float).eps * length.max(axis=1) ** 2)
    if not len(flat):
        return None
    t = flat[np.argmin(length[flat].max(axis=1))]
    return int(3 * t + np.argmax(length[t]))
