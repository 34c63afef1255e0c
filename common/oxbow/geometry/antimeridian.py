"""Polygons that were cut at the antimeridian, as RFC 7946 (section 3.1.9) asks, joined again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from oxbow.arrays import FloatArray
from oxbow.geometry.crossings import is_valid

__all__ = ["Joined", "joined_at_antimeridian"]

ANTIMERIDIAN = 180.0
SNAP_DEG = 1e-6
"""Anything this close to the antimeridian, a tenth of a metre, lies on it: cuts are rounded."""
MOST_REACH_DEG = 90.0
"""A polygon that reaches farther than this from the antimeridian was not cut there: it goes round the Earth."""
DECIMALS = 12
"""Degrees are rounded to this many decimals: adding 360 and subtracting it again costs the last digits."""


@dataclass(frozen=True)
class Joined:
    """A polygon's rings, each (n, 2) longitudes and latitudes in degrees, and the indices of its parts."""

    members: tuple[int, ...]
    rings: tuple[FloatArray, ...]


def joined_at_antimeridian(polygons: Sequence[Sequence[FloatArray]]) -> list[Joined]:
    """Polygons as they were before they were cut at the antimeridian.

    Parameters
    ----------
    polygons
        The rings of each, not closed, as longitudes (-180 .. 180, or beyond) and latitudes in degrees.

    Returns
    -------
    list of Joined
        In the order of their first parts. A polygon that shares no stretch of the antimeridian with another is
        returned as given.
    """
    turned = {index: _turned(rings) for index, rings in enumerate(polygons) if _may_be_cut(rings)}
    united = [joined for joined in _united(turned) if len(joined.members) > 1]
    taken = {member for joined in united for member in joined.members}
    alone = [Joined((index,), tuple(rings)) for index, rings in enumerate(polygons) if index not in taken]
    return sorted((*united, *alone), key=lambda joined: joined.members)


def _united(polygons: Mapping[int, Polygon]) -> Iterator[Joined]:
    """The unions of touching polygons, with the keys of the polygons that each is made of."""
    # An invalid polygon could make the union fail; it stays as given, to be refused where its field is known.
    sound = {key: polygon for key, polygon in polygons.items() if is_valid(polygon)}
    wholes = shapely.get_parts(shapely.union_all(list(sound.values())))
    inside = {key: polygon.representative_point() for key, polygon in sound.items()}
    for whole in wholes:
        yield Joined(tuple(key for key, place in inside.items() if whole.contains(place)), _rings(whole))


def _may_be_cut(rings: Sequence[FloatArray]) -> bool:
    """Whether a polygon may have been cut at the antimeridian: it has an edge there, and all of it is near."""
    away = np.abs(_eastward(rings[0][:, 0]) - ANTIMERIDIAN)
    # Two vertices on the antimeridian make an edge there; a single one only touches it.
    return len(away) > 2 and int((away <= SNAP_DEG).sum()) > 1 and bool((away <= MOST_REACH_DEG).all())


def _turned(rings: Sequence[FloatArray]) -> Polygon:
    """A polygon in longitudes of 0 .. 360, in which the antimeridian is no border."""
    shell, *holes = (np.column_stack([_eastward(ring[:, 0]), ring[:, 1]]) for ring in rings)
    return Polygon(shell, [hole for hole in holes if len(hole) > 2])


def _eastward(long: FloatArray) -> FloatArray:
    turned = long % 360.0
    # Snapped, both sides of a cut are one line, and a union dissolves it.
    return np.where(np.abs(turned - ANTIMERIDIAN) <= SNAP_DEG, ANTIMERIDIAN, turned)


def _rings(polygon: Polygon) -> tuple[FloatArray, ...]:
    """A polygon's rings, not closed, in longitudes of -180 .. 180."""
    return tuple(_westward(shapely.get_coordinates(ring)[:-1]) for ring in (polygon.exterior, *polygon.interiors))


def _westward(degrees: FloatArray) -> FloatArray:
    long, lat = degrees.T
    # Exactly 180 stays 180, so that a vertex on the antimeridian has the same sign on both sides of a former cut.
    return np.round(np.column_stack([np.where(long > ANTIMERIDIAN, long - 360.0, long), lat]), DECIMALS)
