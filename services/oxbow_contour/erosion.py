"""Erosion of polygons by a distance: conservative, at a cost that grows with their vertices alone."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from oxbow_contour.rings import rings_of, runs_of

__all__ = ["erode"]

RUN = 8
"""Edges of the shore that are dilated together."""

QUAD_SEGS = 16
"""Chords that stand for a quarter of a circle."""

# GEOS lets a chord of a round corner span up to 1.5 times its share; its middle is nearer by this factor.
CHORD = math.cos(1.5 * math.pi / 2 / QUAD_SEGS / 2)


def erode(water: Sequence[Polygon | MultiPolygon], distance_m: float) -> list[Polygon]:
    """Connected parts of the water at least `distance_m` away from its contours, largest first.

    The water minus its shore, dilated a few edges at a time. On paper that is a negative buffer of the whole, but
    GEOS's takes time and memory without bound on a ragged shore, whose edges are much shorter than the distance.

    Parameters
    ----------
    water
        Valid polygons with disjoint interiors, in metres.
    distance_m
        Least distance to keep, positive; corners of the shore are kept up to 0.3 % farther away.
    """
    runs = np.concatenate([runs_of(ring, RUN) for ring in rings_of(water)])
    shore = shapely.union_all(shapely.buffer(runs, distance_m / CHORD, quad_segs=QUAD_SEGS))
    parts = shapely.get_parts(shapely.difference(np.array(water, dtype=object), shore))
    return sorted((part for part in parts if part.area > 0), key=lambda part: (-part.area, part.bounds))
