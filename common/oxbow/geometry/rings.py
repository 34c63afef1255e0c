"""Polygons taken apart into rings, and rings into runs of edges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from oxbow.arrays import FloatArray, Geometries

__all__ = ["rings_of", "runs_of"]


def rings_of(polygons: Polygon | Sequence[Polygon | MultiPolygon] | Geometries) -> list[FloatArray]:
    """Closed arrays of shape (n, 2): of each polygon the exterior ring, then the interior ones."""
    rings = shapely.get_rings(shapely.get_parts(np.asarray(polygons, dtype=object)))
    return np.split(shapely.get_coordinates(rings), np.cumsum(shapely.get_num_coordinates(rings))[:-1])


def runs_of(ring: FloatArray, edges: int) -> Geometries:
    """A closed ring as line strings, each of a few of its edges.

    Parameters
    ----------
    ring
        Shape (n, 2), its first vertex repeated at the end.
    edges
        How many edges make up each line string; the last one has what is left.

    Returns
    -------
    ndarray of LineString, shape (m,)
        In the order of the ring.
    """
    first = np.arange(0, len(ring) - 1, edges)
    sizes = np.minimum(first + edges, len(ring) - 1) - first + 1
    offset = np.cumsum(sizes) - sizes
    point = np.arange(sizes.sum()) - np.repeat(offset - first, sizes)
    runs: Geometries = shapely.linestrings(ring[point], indices=np.repeat(np.arange(len(first)), sizes))
    return runs
