"""How a vehicle gets to its share of the free space, and home: stage `assignment` finds it, `path` draws it."""

from __future__ import annotations

from shapely import LineString, Polygon

from oxbow.arrays import Place
from oxbow.contracts.message import (
    MOST_LENGTH_M,
    Message,
    require_area,
    require_finite,
    require_line,
    require_place,
)
from oxbow.errors import InvalidRequest

__all__ = ["Approach", "MiddleLine"]


class MiddleLine(Message, frozen=True, kw_only=True):
    """The middle line of a leg, from a place to a gate; legs run beside it.

    Parameters
    ----------
    line
        Its points; from ashore, the second is the berth.
    is_ashore
        Whether the place is on land.
    entry
        The number of the point where the line comes to the free space.
    """

    line: LineString
    is_ashore: bool = False
    entry: int = 0

    def __post_init__(self) -> None:
        require_line(self, "line")
        last = len(self.line.coords) - 1
        if not 0 <= self.entry <= last:
            raise InvalidRequest(f"is {self.entry}; expected the number of a point, 0 to {last}", where="entry")


class Approach(Message, frozen=True, kw_only=True):
    """The legs between a vehicle's places and its share, through water that others survey.

    Parameters
    ----------
    launch, recovery
        Where the path in the share begins and ends: a gate, or the vehicle's own place where that is beside the
        share.
    out, home
        Middle lines of the legs, from the start and from the recovery to the gate; None where the place is reached
        without crossing other shares.
    apart_m
        How far legs may run beside their middle lines.
    water
        What legs keep to: the free space, and what lies between it and the vehicle's own places.
    legs_m
        How long the legs may become, with the steps from and to the gate.
    """

    launch: Place
    recovery: Place
    out: MiddleLine | None = None
    home: MiddleLine | None = None
    apart_m: float = 0.0
    water: tuple[Polygon, ...] = ()
    legs_m: float = 0.0

    def __post_init__(self) -> None:
        require_place(self, "launch", "recovery")
        require_area(self, "water")
        require_finite(self, "apart_m", "legs_m", least=0.0, most=MOST_LENGTH_M)

    @property
    def has_legs(self) -> bool:
        """Whether there is any leg to add to the path in the share."""
        return self.out is not None or self.home is not None
