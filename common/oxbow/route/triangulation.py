"""Constrained Delaunay triangulation of water (L. P. Chew 1989), by GEOS."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import FloatArray

__all__ = ["Indices", "triangulated", "twins_of"]

Indices = npt.NDArray[np.intp]


def triangulated(
    water: Polygon | MultiPolygon, outlines: Sequence[BaseGeometry] = ()
) -> tuple[FloatArray, Indices]:
    """The triangles of a region.

    Parameters
    ----------
    water
        A valid region.
    outlines
        Lines that triangles must not straddle, beside the shore.

    Returns
    -------
    vertices : ndarray, shape (m, 2)
    corners : ndarray of int, shape (n, 3)
        The vertices of each triangle, counterclockwise.
    """
    faces = _faces(water, outlines) if outlines else water
    triangles = shapely.get_parts(shapely.get_parts(shapely.constrained_delaunay_triangles(faces)))
    xy = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, 2::-1]
    vertices, index = np.unique(xy.reshape(-1, 2), axis=0, return_inverse=True)
    return vertices, _without_flats(vertices, index.reshape(-1, 3))


def _faces(water: Polygon | MultiPolygon, outlines: Sequence[BaseGeometry]) -> npt.NDArray[np.object_]:
    """The parts into which lines cut a region; neighbours have the vertices of their common border in common."""
    lines = shapely.get_parts(shapely.node(shapely.geometrycollections([water.boundary, *outlines])))
    faces = shapely.get_parts(shapely.polygonize(lines))
    shapely.prepare(water)
    return np.asarray(faces[shapely.contains(water, shapely.point_on_surface(faces))])


def twins_of(corners: Indices) -> Indices:
    """The same side as it is seen from the neighbouring triangle, or -1 at a shore; shape (n, 3).

    Side j of a triangle runs from its corner j to its corner j + 1; sides are numbered 3 t + j.
    """
    ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    key = ends[:, 0] * (corners.max(initial=0) + 1) + ends[:, 1]
    order = np.argsort(key, kind="stable")
    pairs = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    twins = np.full(len(key), -1, dtype=np.intp)
    twins[order[pairs]] = order[pairs + 1]
    twins[order[pairs + 1]] = order[pairs]
    return twins.reshape(-1, 3)


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
