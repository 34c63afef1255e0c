"""What every message between the processes is, and the checks that messages have in common."""

from __future__ import annotations

import math
import sys

import msgspec
import numpy as np
import numpy.typing as npt

from oxbow.errors import InvalidMission

__all__ = ["FloatArray", "Message", "Place", "require_area", "require_finite"]

FloatArray = npt.NDArray[np.float64]
Place = tuple[float, float]
"""A planar position (x east, y north) in metres."""


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
            raise InvalidMission(f"is {value!r}; expected a finite number, {accepted}{bound}", where=field)


def require_area(message: Message, *fields: str) -> None:
    """Check polygon fields of a message: valid, with an area."""
    for field in fields:
        polygon = getattr(message, field)
        if polygon.is_empty or not polygon.is_valid:
            raise InvalidMission("is empty or not a valid polygon", where=field)
