"""The sweep frame: planar coordinates turned so that transects stand upright.

u runs across the transects (the direction in which the sweep line moves), v along them.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from oxbow.arrays import FloatArray

__all__ = ["from_sweep", "to_sweep"]


def _turned(points: npt.ArrayLike, angle_rad: float) -> FloatArray:
    # Not a matrix product: BLAS may round equal points differently at different places of an array.
    first, second = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return np.stack([first * cos - second * sin, first * sin + second * cos], axis=-1)


def to_sweep(xy: npt.ArrayLike, heading_rad: float) -> FloatArray:
    """Planar positions in the sweep frame of a heading.

    Parameters
    ----------
    xy : array_like, shape (..., 2)
        Positions (x east, y north) in metres.
    heading_rad
        Direction of the transects, clockwise from north.

    Returns
    -------
    ndarray, shape (..., 2)
        u = x cos h - y sin h and v = x sin h + y cos h, in metres.
    """
    return _turned(xy, heading_rad)


def from_sweep(uv: npt.ArrayLike, heading_rad: float) -> FloatArray:
    """Positions of the sweep frame of a heading in the planar frame: the inverse of `to_sweep`.

    Parameters
    ----------
    uv : array_like, shape (..., 2)
        Positions (u across the transects, v along them) in metres.
    heading_rad
        Direction of the transects, clockwise from north.

    Returns
    -------
    ndarray, shape (..., 2)
        Positions (x east, y north) in metres.
    """
    return _turned(uv, -heading_rad)
