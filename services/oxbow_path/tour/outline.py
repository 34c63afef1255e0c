"""The outline of a tour: a closed path that cannot cross itself, whatever the tour.

A tour of shortest ways may touch itself, and run twice along one way: at the corners of the shore that several
legs turn round, and wherever the way in is the way out. A heuristic's tour may cross itself, too. So the path is
not the tour but the boundary of the region that the tour encloses by the even-odd rule. Ways travelled twice
become lanes: added to the region outside it, taken from it inside unless that parts it. Where parts of it only
touch, a disc joins them. So it is in one piece, as the tour is. Holes are opened as those of a walk round a tree
are (`oxbow_path.walk`). What results is one region without holes, inside the water, whose boundary is simple by
construction.
"""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, Point, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Geometries, Mask
from oxbow.tolerances import ROUNDING_M
from oxbow_path.tour.slits import GRID_M, slit
from oxbow_path.walk.region import largest

__all__ = ["enclosed_region"]

QUAD_SEGS = 2
"""Lanes have ends of few corners: every corner is a waypoint."""

PARTING = 3
"""Where this many stretches of a tour end, it meets itself."""


def enclosed_region(way: FloatArray, free: Polygon, lane_m: float) -> Polygon:
    """The region that a closed way encloses, in one piece, perhaps with holes.

    Parameters
    ----------
    way : array, shape (n, 2)
        A way inside `free` that ends where it starts, perhaps without leaving that place.
    free
        The water.
    lane_m
        Half the width of a lane, and of the joints between parts that only touch.

    Returns
    -------
    Polygon
        Inside `free`, except for islands that it encloses.
    """
    # A tour of one site, or of sites in one place: a small disc is its region.
    if (way == way[0]).all():
        return largest(Point(way[0]).buffer(lane_m).intersection(free))
    stretches = shapely.get_parts(shapely.union_all([LineString(way)], grid_size=GRID_M))
    faces = shapely.get_parts(shapely.polygonize(stretches))
    region = shapely.union_all(faces[_is_odd(faces, way)])
    boundary = region.boundary
    shapely.prepare([region, boundary])
    twice = stretches[~shapely.covers(boundary, stretches)]
    inside = shapely.covers(region, twice)
    added = shapely.buffer([*twice[~inside], *_meetings(stretches)], lane_m, quad_segs=QUAD_SEGS)
    region = largest(region.union(shapely.union_all(added).intersection(free)))
    region = largest(region.union(_moats(region, free, lane_m)))
    return slit(region, shapely.buffer(twice[inside], lane_m, quad_segs=QUAD_SEGS))


def _moats(region: Polygon, free: Polygon, width_m: float) -> BaseGeometry:
    """The enclosed islands that a tour turns round or passes by a hair, and the water about them.

    Their corners could reach through the region's boundary by rounding, and would open it all round the island.
    """
    islands = np.array([Polygon(ring) for ring in free.interiors], dtype=object)
    enclosed_ones = islands[shapely.contains(region, shapely.point_on_surface(islands))]
    touching = enclosed_ones[shapely.dwithin(enclosed_ones, region.exterior, ROUNDING_M)]
    water = shapely.union_all(shapely.buffer(touching, width_m, quad_segs=QUAD_SEGS)).intersection(free)
    return shapely.union_all([water, *touching])


def _is_odd(faces: Geometries, way: FloatArray) -> Mask:
    """Whether a line from a face to infinity crosses the way an odd number of times."""
    inner = shapely.get_coordinates(shapely.point_on_surface(faces))
    ray = np.stack([inner, np.column_stack([np.full(len(inner), way[:, 0].max()), inner[:, 1]])], axis=1)
    edges = STRtree(np.asarray(shapely.linestrings(np.stack([way[:-1], way[1:]], axis=1))))
    face, edge = edges.query(shapely.linestrings(ray))
    (x, y), (x0, y0), (x1, y1) = inner[face].T, way[edge].T, way[edge + 1].T
    # Half open, so that a ray through a vertex counts its two edges once or twice, as it should.
    spans = (y0 > y) != (y1 > y)
    # Level edges span no ray; the 1 only avoids a division by zero.
    rise = np.where(y1 == y0, 1.0, y1 - y0)
    right = x0 + (y - y0) / rise * (x1 - x0) > x
    return np.asarray(np.bincount(face, spans & right, len(faces)) % 2 == 1)


def _meetings(stretches: Geometries) -> Geometries:
    """The places at which a tour meets itself."""
    ends = np.vstack([shapely.get_point(stretches, k) for k in (0, -1)]).ravel()
    places, count = np.unique(shapely.get_coordinates(ends), axis=0, return_counts=True)
    return np.asarray(shapely.points(places[count >= PARTING]))
