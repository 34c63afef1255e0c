"""What every message between the processes is, and the checks that messages have in common."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator

import msgspec
import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import Place
from oxbow.errors import InvalidMission
from oxbow.tolerances import FARTHEST_M

__all__ = [
    "MOST_LENGTH_M",
    "MOST_SEED",
    "Message",
    "require_area",
    "require_finite",
    "require_line",
    "require_place",
    "require_places",
]

MOST_SEED = 2**53
"""JSON readers keep whole numbers up to this exactly."""

LEAST_LENGTH_M = 1e-3
"""Of lengths and speeds in a mission: what is less is as good as nothing, and shorter than rounding."""

MOST_LENGTH_M = 1e9
"""More than any vehicle travels: 25 times round the Earth."""

MOST_SHOWN_BITS = 64


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """Base of every message on the bus between Oxbow's own processes."""


def require_finite(
    message: Message,
    *fields: str,
    least: float = -math.inf,
    above: float = -math.inf,
    most: float = sys.float_info.max,
) -> None:
    """Check numeric fields of a message: finite, `least` to `most`, strictly above `above`."""
    for field in fields:
        value = getattr(message, field)
        # An integer may be too large to become a float, but it compares.
        if value is not None and not (least <= value <= most and value > above):
            accepted = f"> {above}" if above > -math.inf else f">= {least}" if least > -math.inf else "any"
            bound = "" if most == sys.float_info.max else f", at most {most:g}"
            raise InvalidMission(f"is {_shown(value)}; expected a finite number, {accepted}{bound}", where=field)


def _shown(value: float) -> str:
    """A number in an error message; integers may be of any length."""
    if isinstance(value, int) and value.bit_length() > MOST_SHOWN_BITS:
        return f"an integer of {value.bit_length()} bits"
    return repr(value)


def require_area(message: Message, *fields: str) -> None:
    """Check fields that hold a polygon, several or none: valid, with an area, and within the plane."""
    for where, polygon in _geometries(message, fields):
        _require_kind(polygon, Polygon, where)
        if polygon.is_empty or not shapely.is_valid(
            polygon
        ):  # not the property, which keeps the interpreter's lock
            raise InvalidMission("is empty or not a valid polygon", where=where)


def require_line(message: Message, *fields: str) -> None:
    """Check fields that hold a line: not empty, and within the plane."""
    for where, line in _geometries(message, fields):
        _require_kind(line, LineString, where)
        if line.is_empty:
            raise InvalidMission("is empty; expected a line", where=where)


def require_place(message: Message, *fields: str) -> None:
    """Check fields that hold a place or none: within the plane."""
    for field in fields:
        if (place := getattr(message, field)) is not None:
            _require_in_plane(place, field)


def require_places(message: Message, *fields: str) -> None:
    """Check fields that hold places: each within the plane."""
    for field in fields:
        for index, place in enumerate(getattr(message, field)):
            _require_in_plane(place, f"{field}[{index}]")


def _require_in_plane(place: Place, where: str) -> None:
    if not all(abs(coordinate) <= FARTHEST_M for coordinate in place):
        raise InvalidMission(
            f"is {tuple(place)!r}; expected two finite numbers within {FARTHEST_M:g} m", where=where
        )


def _geometries(message: Message, fields: Iterable[str]) -> Iterator[tuple[str, BaseGeometry]]:
    """The geometries in fields of a message, and what errors call them."""
    for field in fields:
        value = getattr(message, field)
        if isinstance(value, tuple):
            yield from ((f"{field}[{number}]", geometry) for number, geometry in enumerate(value))
        elif value is not None:
            yield field, value


def _require_kind(geometry: BaseGeometry, kind: type[BaseGeometry], where: str) -> None:
    if not isinstance(geometry, kind):
        raise InvalidMission(f"is a {type(geometry).__name__}; expected a {kind.__name__}", where=where)
    if not (np.abs(shapely.get_coordinates(geometry)) <= FARTHEST_M).all():
        raise InvalidMission(f"has coordinates that are not finite, or beyond {FARTHEST_M:g} m", where=where)
