"""Erosion of water by a distance, for shores of any detail."""

from __future__ import annotations

import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.geometry.erosion import eroded

__all__ = ["eroded_water", "polygons"]

QUAD_SEGS = 16
"""Segments per quarter circle of an eroded contour: their chords come nearer by 0.12 % of the distance."""

_STEP_QUAD_SEGS = 4
"""The same in the steps before the last: the next step smooths their result."""


def eroded_water(water: Polygon | MultiPolygon, depth_m: float, tolerance_m: float) -> BaseGeometry:
    """The places of `water` that are `depth_m` or more from its shore, to within about `tolerance_m`.

    Erosions by discs compose (Serra 1982). If the shore has edges much shorter than `depth_m`, whose offset arcs
    would all intersect, it is eroded in steps that double, each of which smooths away detail before the next.
    Shores of longer edges are eroded at once.

    Parameters
    ----------
    water
        What is eroded.
    depth_m
        The least distance from the shore, >= 0.
    tolerance_m
        How far the result may lie from the exact one, > 0.

    Returns
    -------
    geometry
        Polygonal, in any number of parts; maybe empty.
    """
    shore = water.simplify(tolerance_m)
    if depth_m == 0:
        return shore
    # Steps from the scale of the shore's own detail on: a first step of 1/64 at least bounds their number to
    # seven.
    mean_edge_m = shore.length / shapely.get_num_coordinates(shore)
    done_m = 0.0
    step_m = max(depth_m / 64, mean_edge_m / 2)
    while done_m + step_m < depth_m:
        shore = eroded(shore, step_m, quad_segs=_STEP_QUAD_SEGS).simplify(tolerance_m / 4)
        done_m += step_m
        step_m = done_m
    return eroded(shore, depth_m - done_m, quad_segs=QUAD_SEGS)


def polygons(geometry: BaseGeometry) -> list[Polygon]:
    """The polygons of `geometry` that have an area."""
    return [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon) and part.area > 0]
