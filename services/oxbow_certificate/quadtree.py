"""One level of a quadtree: equal squares that together cover a region (Finkel and Bentley 1974)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Mask

__all__ = ["Squares"]

_QUADRANTS = np.array([(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)])


@dataclass(frozen=True)
class Squares:
    """Squares of one size; `centres` is of shape (n, 2), `half_m` half the length of a side."""

    centres: FloatArray
    half_m: float

    @classmethod
    def around(cls, region: BaseGeometry) -> Squares:
        """The single square about the bounds of `region`."""
        west, south, east, north = region.bounds
        return cls(np.array([[(west + east) / 2, (south + north) / 2]]), max(east - west, north - south) / 2)

    def __len__(self) -> int:
        return len(self.centres)

    @property
    def circumradius_m(self) -> float:
        """The distance from a square's centre to its corners."""
        return self.half_m * math.sqrt(2.0)

    def where(self, keep: Mask) -> Squares:
        """The squares chosen by a mask of shape (n,)."""
        return Squares(self.centres[keep], self.half_m)

    def meeting(self, region: BaseGeometry) -> Squares:
        """The squares that intersect `region`."""
        low, high = self.centres - self.half_m, self.centres + self.half_m
        return self.where(shapely.intersects(region, shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])))

    def quarters(self) -> Squares:
        """Each square's four quarters."""
        half_m = self.half_m / 2
        return Squares((self.centres[:, None, :] + half_m * _QUADRANTS).reshape(-1, 2), half_m)
