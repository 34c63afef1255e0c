"""The base of all messages between processes, and the checks that they have in common."""

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
from oxbow.errors import InvalidRequest
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
"""JSON readers keep integers up to this exactly."""

LEAST_LENGTH_M = 1e-3
"""The least length or speed in a mission: anything less is practically zero."""

MOST_LENGTH_M = 1e9
"""More than any vehicle travels: 25 times round the Earth."""

MOST_SHOWN_BITS = 64


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """Base of every message on the bus between Oxbow's own processes.

    A message checks its invariants when it is made, and raises `InvalidRequest` with the name of the field.
    """


def require_finite(
    message: Message,
    *fields: str,
    least: float = -math.inf,
    above: float = -math.inf,
    most: float = sys.float_info.max,
) -> None:
    """Check that numeric fields of a message are finite and within bounds.

    Parameters
    ----------
    message
        The message to check.
    fields
        Names of numeric fields; a field that is None passes.
    least, most
        The bounds, themselves accepted.
    above
        A lower bound, itself not accepted.

    Raises
    ------
    InvalidRequest
        A field is not finite or out of bounds; names the field.
    """
    for field in fields:
        value = getattr(message, field)
        # `not`, since NaN compares false. An integer may be too large for `math.isfinite`, but it compares.
        if value is not None and not (least <= value <= most and value > above):
            accepted = f"> {above}" if above > -math.inf else f">= {least}" if least > -math.inf else "any"
            bound = "" if most == sys.float_info.max else f", at most {_bound(most)}"
            raise InvalidRequest(f"is {_shown(value)}; expected a finite number, {accepted}{bound}", where=field)


def _bound(most: float) -> str:
    """A bound in an error message; one for integers with all of its digits."""
    return str(most) if isinstance(most, int) else f"{most:g}"


def _shown(value: float) -> str:
    """A number in an error message; integers may be of any length."""
    if isinstance(value, int) and value.bit_length() > MOST_SHOWN_BITS:
        return f"an integer of {value.bit_length()} bits"
    return repr(value)


def require_area(message: Message, *fields: str) -> None:
    """Check fields that hold a polygon, several or none: valid, with an area, and within the plane.

    Parameters
    ----------
    message
        The message to check.
    fields
        Names of fields.

    Raises
    ------
    InvalidRequest
        A polygon is not of that kind, or a coordinate is not finite or beyond `FARTHEST_M`; names the field.
    """
    for where, polygon in _geometries(message, fields):
        _require_kind(polygon, Polygon, where)
        # The ufunc, not the property: it releases the interpreter's lock while it works.
        if polygon.is_empty or not shapely.is_valid(polygon):
            raise InvalidRequest("is empty or not a valid polygon", where=where)


def require_line(message: Message, *fields: str) -> None:
    """Check fields that hold a line: not empty, and within the plane.

    Parameters
    ----------
    message
        The message to check.
    fields
        Names of fields.

    Raises
    ------
    InvalidRequest
        A line is empty, or a coordinate is not finite or beyond `FARTHEST_M`; names the field.
    """
    for where, line in _geometries(message, fields):
        _require_kind(line, LineString, where)
        if line.is_empty:
            raise InvalidRequest("is empty; expected a line", where=where)


def require_place(message: Message, *fields: str) -> None:
    """Check fields that hold a place or none: within the plane.

    Parameters
    ----------
    message
        The message to check.
    fields
        Names of fields.

    Raises
    ------
    InvalidRequest
        A coordinate is not finite or beyond `FARTHEST_M`; names the field.
    """
    for field in fields:
        if (place := getattr(message, field)) is not None:
            _require_in_plane(place, field)


def require_places(message: Message, *fields: str) -> None:
    """Check fields that hold places: each within the plane.

    Parameters
    ----------
    message
        The message to check.
    fields
        Names of fields.

    Raises
    ------
    InvalidRequest
        A coordinate is not finite or beyond `FARTHEST_M`; names the field and the place.
    """
    for field in fields:
        for index, place in enumerate(getattr(message, field)):
            _require_in_plane(place, f"{field}[{index}]")


def _require_in_plane(place: Place, where: str) -> None:
    # Not `any(... > FARTHEST_M)`, which NaN would pass.
    if not all(abs(coordinate) <= FARTHEST_M for coordinate in place):
        raise InvalidRequest(
            f"is {tuple(place)!r}; expected two finite numbers within {FARTHEST_M:g} m", where=where
        )


def _geometries(message: Message, fields: Iterable[str]) -> Iterator[tuple[str, BaseGeometry]]:
    """The geometries in fields of a message, each with its name in errors."""
    for field in fields:
        value = getattr(message, field)
        if isinstance(value, tuple):
            yield from ((f"{field}[{number}]", geometry) for number, geometry in enumerate(value))
        elif value is not None:
            yield field, value


def _require_kind(geometry: BaseGeometry, kind: type[BaseGeometry], where: str) -> None:
    if not isinstance(geometry, kind):
        raise InvalidRequest(f"is a {type(geometry).__name__}; expected a {kind.__name__}", where=where)
    if not (np.abs(shapely.get_coordinates(geometry)) <= FARTHEST_M).all():
        raise InvalidRequest(f"has coordinates that are not finite, or beyond {FARTHEST_M:g} m", where=where)
