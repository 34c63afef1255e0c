"""Rasters of weights, and the polygons of their cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon

from oxbow.arrays import FloatArray
from oxbow.errors import InvalidMission
from oxbow.mission.prior import PriorFeature

__all__ = ["Raster", "require_size"]

MAX_CELLS = 250_000
"""Every cell may become a polygon of its own."""
DIGITS = 3
"""Weights are rounded to this many significant digits, so that cells of nearly the same weight unite."""
DECIMALS = 9
"""Of degrees: a tenth of a millimetre."""


@dataclass(frozen=True)
class Raster:
    """Weights on a grid of degrees.

    Parameters
    ----------
    name
        What errors call it.
    weights : ndarray of shape (rows, columns)
        The weight of each cell; NaN where there is none.
    west, north
        The outer corner of the first cell, in degrees.
    step_long, step_lat
        From one column, and from one row, to the next, in degrees; rows from north to south have a negative step.
    """

    name: str
    weights: FloatArray
    west: float
    north: float
    step_long: float
    step_lat: float

    def __post_init__(self) -> None:
        wrong = np.argwhere((self.weights < 0) | np.isinf(self.weights))
        if len(wrong):
            row, column = wrong[0]
            raise InvalidMission(
                f"is {self.weights[row, column]:g}; expected a finite weight >= 0, or the no-data value",
                where=f"{self.name}: row {row}, column {column}",
            )
        if np.isnan(self.weights).all():
            raise InvalidMission("has no cell with a weight", where=self.name)
        corners = self._degrees(np.array([(0.0, 0.0), self.weights.shape[::-1]]))
        if not (np.abs(corners) <= (360.0, 90.0)).all():
            raise InvalidMission(
                f"reaches from {corners[0].tolist()} to {corners[1].tolist()}; expected longitudes and latitudes"
                " in WGS84 degrees (projected metres?)",
                where=self.name,
            )

    def features(self) -> tuple[PriorFeature, ...]:
        """The cells of each weight, united; cells without one are left out."""
        # Rounded by text, which is slow: so only the distinct weights are, not those of all 250 000 cells.
        rows, columns = np.nonzero(~np.isnan(self.weights))
        values, value_of_cell = np.unique(self.weights[rows, columns], return_inverse=True)
        rounded = [float(f"{value:.{DIGITS}g}") for value in values.tolist()]
        weights, weight_of_value = np.unique(rounded, return_inverse=True)
        weight_of_cell = weight_of_value[value_of_cell]
        cells = shapely.box(columns, rows, columns + 1, rows + 1)[np.argsort(weight_of_cell, kind="stable")]
        shares = np.split(cells, np.cumsum(np.bincount(weight_of_cell))[:-1])
        return tuple(
            PriorFeature(geometry=self._united(share), weight=weight)
            for share, weight in zip(shares, weights.tolist(), strict=True)
        )

    def _united(self, cells: npt.NDArray[Any]) -> MultiPolygon:
        # Simplified in whole numbers of cells, where points in line are so exactly.
        parts = shapely.simplify(shapely.get_parts(shapely.coverage_union_all(cells)), 0.0)
        return shapely.orient_polygons(shapely.transform(MultiPolygon(parts), self._degrees))

    def _degrees(self, columns_rows: FloatArray) -> FloatArray:
        degrees = (self.west, self.north) + columns_rows * (self.step_long, self.step_lat)
        # Rounded alike, cells that share a corner share it exactly, whatever the multiplication left in the last
        # digits.
        return np.round(degrees, DECIMALS)


def require_size(name: str, rows: int, columns: int) -> None:
    """Refuse a raster of no cells, or of more than can be planned with, before its cells are read.

    Parameters
    ----------
    name
        What errors call the raster.
    rows, columns
        Its size.

    Raises
    ------
    InvalidMission
        It has no cell, or more than `MAX_CELLS`.
    """
    if not 0 < rows * columns <= MAX_CELLS:
        raise InvalidMission(
            f"has {rows} x {columns} cells; expected 1 to {MAX_CELLS} (cut it to the site, or take larger cells)",
            where=name,
        )
