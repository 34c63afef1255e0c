"""Erosion of polygons by a distance: conservative, at a cost that grows with their vertices alone."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from oxbow.arrays import FloatArray, Geometries
from oxbow.geometry.rings import rings_of, runs_of

__all__ = ["erode"]

RUN = 8
"""Edges of the shore that are dilated together."""

CHORDS, MOST_CHORDS = 16, 128
"""Chords that stand for a quarter of a circle: the fewest, and the most that a small excess can ask for."""


def erode(water: Sequence[Polygon | MultiPolygon], distance_m: float, excess_m: float = math.inf) -> list[Polygon]:
    """Connected parts of the water at least `distance_m` away from its contours, largest first.

    The water minus its shore, dilated a few edges at a time. On paper that is a negative buffer of the whole, but
    GEOS's takes time and memory without bound on a ragged shore, whose edges are much shorter than the distance.

    Parameters
    ----------
    water
        Valid polygons with disjoint interiors, in metres.
    distance_m
        Least distance to keep, positive.
    excess_m
        How much farther away corners of the shore may be kept, as their circles are made of chords. No more than
        0.3 % of the distance in any case, and no less than 0.005 % of it.

    Returns
    -------
    list of Polygon
        None where nothing is left. Parts of one size are ordered by position.
    """
    rings = rings_of(water)
    shore = shapely.union_all(_dilated(rings, distance_m, _chords(distance_m, excess_m)))
    parts = shapely.get_parts(shapely.difference(np.array(water, dtype=object), shore))
    return sorted((part for part in parts if part.area > 0), key=lambda part: (-part.area, part.bounds))


def _dilated(rings: Sequence[FloatArray], distance_m: float, chords: int) -> Geometries:
    """What is near the rings, in parts whose union it is: all of it, and up to the chords' excess more.

    GEOS straightens a line before it dilates it, and so leaves out some of the distance where short edges lie
    beside long ones: by more than the chords' excess now and then. Such runs are dilated edge by edge.
    """
    runs = np.concatenate([runs_of(ring, RUN) for ring in rings])
    # Larger by so much that the middles of the chords, too, keep the distance.
    radius_m = distance_m / _nearest(chords)
    bands: Geometries = shapely.buffer(runs, radius_m, quad_segs=chords)
    # Measured rather than trusted: whatever GEOS did to the line, its band must reach the distance all around it.
    is_short = shapely.distance(shapely.boundary(bands), runs) < distance_m
    edges = [runs_of(shapely.get_coordinates(run), 1) for run in runs[is_short]]
    return np.concatenate([bands, *(shapely.buffer(each, radius_m, quad_segs=chords) for each in edges)])


def _chords(distance_m: float, excess_m: float) -> int:
    """The fewest chords a quarter circle, as a power of two, that keep to the excess."""
    chords = CHORDS
    while chords < MOST_CHORDS and distance_m / _nearest(chords) - distance_m > excess_m:
        chords *= 2
    return chords


def _nearest(chords: int) -> float:
    """The distance of a chord's middle from the centre, in radii.

    GEOS lets a chord of a round corner span up to 1.5 times its share.
    """
    return math.cos(1.5 * math.pi / 2 / chords / 2)
