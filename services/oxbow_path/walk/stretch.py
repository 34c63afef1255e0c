"""Stretches of lines. `shapely.ops.substring` makes a Python object of every vertex, which takes long."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString

from oxbow.arrays import FloatArray

__all__ = ["stretch"]


def stretch(line: LineString, start_m: float, end_m: float) -> FloatArray:
    """The vertices (n, 2) of a line from one distance along it to another, or the place alone where these are one.

    Distances beyond the line's ends are those of its ends.

    Parameters
    ----------
    line
        Of any length.
    start_m, end_m
        Distances along it, in rising order.

    Returns
    -------
    ndarray, shape (n, 2)
        In metres; the two ends are interpolated, all else are vertices of the line.
    """
    points = shapely.get_coordinates(line)
    at_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    start_m, end_m = max(start_m, 0.0), min(end_m, line.length)
    ends = shapely.get_coordinates(shapely.line_interpolate_point(line, [start_m, end_m]))
    if end_m <= start_m:
        return np.asarray(ends[:1])
    return np.vstack([ends[:1], points[(at_m > start_m) & (at_m < end_m)], ends[1:]])
