"""Types of arrays and places that algorithms and messages exchange."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["FloatArray", "Geometries", "Indices", "Mask", "Place"]

FloatArray = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]
Geometries = npt.NDArray[np.object_]

Place = tuple[float, float]
"""A planar position (x east, y north) in metres."""
