"""Degrees to local planar metres and back: the only place that knows map projections (and pyproj).

No point of a site is farther than 300 km from its frame's origin, so one azimuthal-equidistant plane serves
all of it: distances from the origin are exact, others too long by less than 4 parts in 10 000 at the rim of the
largest site, and never too short. A path that fits its length in the plane therefore fits it on the ellipsoid.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from oxbow.arrays import FloatArray

if TYPE_CHECKING:
    import pyproj

__all__ = ["Frame", "Position", "geodesic_length_m", "lonlat"]


class Position(msgspec.Struct, frozen=True, forbid_unknown_fields=True, gc=False):
    """A place in WGS84 degrees; its range is checked by the mission that it belongs to."""

    lat: float
    long: float


def lonlat(positions: Sequence[Position]) -> FloatArray:
    """Longitudes and latitudes in degrees, shape (n, 2)."""
    return np.array([(position.long, position.lat) for position in positions], dtype=np.float64).reshape(-1, 2)


@dataclass(frozen=True)
class Frame:
    """A local azimuthal-equidistant plane on WGS84: x east, y north, in metres from the origin.

    Parameters
    ----------
    lat, long
        The origin, in degrees.
    """

    lat: float
    long: float

    @classmethod
    def around(cls, lonlat: FloatArray) -> Frame:
        """The frame whose origin is the mean of points.

        Parameters
        ----------
        lonlat : ndarray of shape (n, 2)
            Longitudes and latitudes in degrees; points on both sides of the antimeridian are fine.
        """
        # Longitudes are averaged as wrapped differences, which are small across the antimeridian too.
        west = lonlat[:, 0].min()
        # Correctly rounded sums: the same points in another order have the same frame.
        long = west + math.fsum(_wrapped(lonlat[:, 0] - west)) / len(lonlat)
        return cls(lat=math.fsum(lonlat[:, 1]) / len(lonlat), long=float(_wrapped(long)))

    def to_planar(self, lonlat: FloatArray) -> FloatArray:
        """Planar metres, shape (n, 2), of longitudes and latitudes in degrees, shape (n, 2)."""
        return np.column_stack(_projection(self.lat, self.long).transform(lonlat[:, 0], lonlat[:, 1]))

    def to_degrees(self, xy: FloatArray) -> FloatArray:
        """Longitudes (-180 .. 180) and latitudes in degrees, shape (n, 2), of planar metres, shape (n, 2)."""
        projection = _projection(self.lat, self.long)
        return np.column_stack(projection.transform(xy[:, 0], xy[:, 1], direction="INVERSE"))


def geodesic_length_m(lonlat: FloatArray) -> float:
    """Length in metres, on the WGS84 ellipsoid, of the line through points in degrees, shape (n, 2)."""
    import pyproj  # noqa: PLC0415 - a process that never converts does not pay 0.1 s for it

    return float(pyproj.Geod(ellps="WGS84").line_length(lonlat[:, 0], lonlat[:, 1]))


def _wrapped(degrees: FloatArray) -> FloatArray:
    # From -180 inclusive to 180 exclusive.
    return (degrees + 180.0) % 360.0 - 180.0


@lru_cache(maxsize=64)
def _projection(lat: float, long: float) -> pyproj.Transformer:
    import pyproj  # noqa: PLC0415 - as above

    return pyproj.Transformer.from_pipeline(
        "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad "
        f"+step +proj=aeqd +lat_0={lat!r} +lon_0={long!r} +ellps=WGS84"
    )
