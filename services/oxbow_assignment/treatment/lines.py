"""Joining lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import LineString

__all__ = ["chained_line"]


def chained_line(lines: Sequence[LineString]) -> LineString:
    """One line along all lines in turn, without points that repeat the one before."""
    points = np.concatenate([shapely.get_coordinates(line) for line in lines])
    repeated = (points[1:] == points[:-1]).all(axis=1)
    return LineString(points[np.concatenate([[True], ~repeated])])
