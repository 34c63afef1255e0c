"""Axes along a path or a region: in axes that are oblique to it, boxes about long segments are mostly empty."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, MultiLineString
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray

__all__ = ["Paths", "coordinates_along", "long_side", "main_direction", "segment_ends"]

Paths = LineString | MultiLineString
"""One vehicle's path, or those of several, one line each."""


def segment_ends(paths: Paths) -> FloatArray:
    """Both ends of the segments of paths, in order, without those of length 0; shape (n, 2, 2)."""
    xy, path = shapely.get_coordinates(shapely.get_parts(paths), return_index=True)
    ends = np.stack([xy[:-1], xy[1:]], axis=1)
    return np.asarray(ends[(path[:-1] == path[1:]) & (ends[:, 0] != ends[:, 1]).any(axis=1)])


def main_direction(paths: Paths) -> FloatArray:
    """The direction along which most of the length of paths runs, a unit vector of shape (2,)."""
    steps = np.diff(segment_ends(paths), axis=1)[:, 0]
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    # Doubled, opposite headings are one, so that the legs there and back do not cancel out in the mean.
    half = np.angle(np.sum(np.hypot(*steps.T) * np.exp(2j * headings))) / 2
    return np.array([np.cos(half), np.sin(half)])


def long_side(region: BaseGeometry) -> FloatArray:
    """The direction of the longer side of the least rectangle about a region, a unit vector of shape (2,)."""
    corners = shapely.get_coordinates(shapely.oriented_envelope(region))
    sides = np.diff(corners[:3], axis=0)
    longer = sides[np.argmax(np.hypot(*sides.T))]
    return np.asarray(longer / np.hypot(*longer))


def coordinates_along(xy: FloatArray, along: FloatArray) -> FloatArray:
    """Coordinates along a direction and to its left, shape (n, 2).

    Parameters
    ----------
    xy
        Places, shape (n, 2).
    along
        A unit vector, shape (2,).

    Returns
    -------
    ndarray, shape (n, 2)
        In metres, about the same origin.
    """
    east, north = along
    return np.asarray(xy @ np.array([[east, -north], [north, east]]))
