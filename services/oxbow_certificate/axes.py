"""Axes that lie along a path or a region: boxes about long oblique segments are mostly empty."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import FloatArray

__all__ = ["long_side", "main_direction", "turned"]


def main_direction(path: LineString) -> FloatArray:
    """The direction (2,) that most of a path's length runs in: the mean of its doubled headings, halved."""
    steps = np.diff(shapely.get_coordinates(path), axis=0)
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
