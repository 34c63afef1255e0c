"""Types of arrays that algorithms exchange, beside `oxbow.contracts.FloatArray`, which messages carry too."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["Geometries", "Indices", "Mask"]

Indices = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]
Geometries = npt.NDArray[np.object_]
