"""Axes that lie along a path or a region: boxes about long oblique segments are mostly empty."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, MultiLineString
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray

__all__ = ["Paths", "long_side", "main_direction", "segment_ends", "turned"]

Paths = LineString | MultiLineString
"""One vehicle's path, or those of several, one line each."""


def segment_ends(paths: Paths) -> FloatArray:
    """Both ends (n, 2, 2) of the segments of paths, in order, without those of no length."""
    xy, path = shapely.get_coordinates(shapely.get_parts(paths), return_index=True)
    ends = np.stack([xy[:-1], xy[1:]], axis=1)
    return np.asarray(ends[(path[:-1] == path[1:]) & (ends[:, 0] != ends[:, 1]).any(axis=1)])


def main_direction(paths: Paths) -> FloatArray:
    """The direction (2,) that most of the length of paths runs in: the mean of doubled headings, halved."""
    steps = np.diff(segment_ends(paths), axis=1)[:, 0]
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    half = np.angle(np.sum(np.hypot(*steps.T) * np.exp(2j * headings))) / 2
    return np.array([np.cos(half), np.sin(half)])


def long_side(region: BaseGeometry) -> FloatArray:
    """The direction (2,) of the longer side of the least rectangle about a region."""
    corners = shapely.get_coordinates(shapely.oriented_envelope(region))
    sides = np.diff(corners[:3], axis=0)
    longer = sides[np.argmax(np.hypot(*sides.T))]
    return np.asarray(longer / np.hypot(*longer))


def turned(xy: FloatArray, along: FloatArray) -> FloatArray:
    """Coordinates (n, 2) along a direction (2,), and to its left."""
    east, north = along
    return np.asarray(xy @ np.array([[east, -north], [north, east]]))
