"""Erosion of polygons by a distance, conservative and at a cost that grows with their vertices alone."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from oxbow.contracts import FloatArray
from oxbow_contour.rings import GeometryArray, rings_of

__all__ = ["erode"]

LEAST_TURN_RAD = math.radians(3)
"""The finest that round corners are cut, however small the excess: 1 / cos(1.5°) is 1.0003."""
OVERLAP = 0.01
"""How far a band reaches back and ashore, of its width: where it met an edge it overlaps, and no crack stays."""


def erode(water: Sequence[Polygon | MultiPolygon], distance_m: float, excess_m: float) -> list[Polygon]:
    """Connected parts of the water at least `distance_m` away from its contours, largest first.

    The water minus the union of its shore bands: on the water's side of each edge a rectangle of that width, and
    where the shore bends away at its end, a polygon about the circle of that radius. On paper that is a negative
    buffer. GEOS's, however, has round corners of chords, which are nearer to the shore than asked, and on
    a ragged shore with edges much shorter than the distance its time and memory grow without bound.

    Parameters
    ----------
    water
        Valid polygons with disjoint interiors, in metres.
    distance_m
        Least distance to keep, positive.
    excess_m
        How much farther than that from a corner of the shore the result may keep: less of it, more vertices.
    """
    turn_rad = max(2 * math.acos(distance_m / (distance_m + excess_m)), LEAST_TURN_RAD)
    oriented = shapely.orient_polygons(np.array(water, dtype=object))
    bands = [_bands(ring, distance_m, turn_rad) for ring in rings_of(oriented)]
    shore = shapely.union_all(np.concatenate(bands))
    parts = [part for part in shapely.get_parts(shapely.difference(oriented, shore)) if part.area > 0]
    return sorted(parts, key=lambda part: (-part.area, part.bounds))


def _bands(ring: FloatArray, distance_m: float, turn_rad: float) -> GeometryArray:
    """One polygon an edge: what lies to the left of it, and about its end where the ring turns right.

    `ring` is an array of shape (n, 2), closed, with the water on its left.
    """
    start, end = ring[:-1], ring[1:]
    along = end - start
    normal_rad = np.arctan2(along[:, 0], -along[:, 1])
    turn = np.remainder(normal_rad - np.roll(normal_rad, -1), 2 * math.pi)
    turns_right = turn < math.pi
    turn[~turns_right] = 0  # where it turns left, the next edge's rectangle covers the corner
    tips = np.maximum(np.ceil(turn / turn_rad), 1).astype(np.intp)
    left = distance_m * np.column_stack([np.cos(normal_rad), np.sin(normal_rad)])
    last = np.where(turns_right[:, None], np.roll(left, -1, axis=0), left)

    edge = np.repeat(np.arange(len(start)), tips)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(tips) - tips, tips)
    share = (turn / tips)[edge]
    tip_rad = normal_rad[edge] - (step + 0.5) * share
    reach = distance_m / np.cos(share / 2)
    tip = end[edge] + reach[:, None] * np.column_stack([np.cos(tip_rad), np.sin(tip_rad)])

    every = np.arange(len(start))
    ashore = OVERLAP * left
    before = start - OVERLAP * np.column_stack([left[:, 1], -left[:, 0]])
    corners = np.concatenate([before - ashore, before + left, tip, end + last, end, end - ashore])
    owner = np.concatenate([every, every, edge, every, every, every])
    order = np.argsort(owner, kind="stable")
    bands = np.asarray(shapely.polygons(shapely.linearrings(corners[order], indices=owner[order])))
    is_valid = shapely.is_valid(bands)
    bands[~is_valid] = shapely.make_valid(bands[~is_valid])
    return bands
