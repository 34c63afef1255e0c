"""Stage `contour`: from the site to where a vehicle may go."""

from __future__ import annotations

from collections.abc import Sequence

from shapely import Polygon

from oxbow.arrays import Place
from oxbow.contracts.message import (
    MOST_LENGTH_M,
    Message,
    require_area,
    require_finite,
    require_place,
    require_places,
)
from oxbow.tolerances import DEFAULT_SHORE_TOLERANCE_M, FARTHEST_M

__all__ = ["ContourRequest", "DroppedPart", "FreeSpace", "dropped_warnings"]

MUCH_DROPPED = 0.05
"""A plan that leaves out more than this share of the water says so in a warning."""


class DroppedPart(Message, frozen=True, kw_only=True):
    """Water that a stage leaves out, and why."""

    area_m2: float
    reason: str
    place: Place
    outline: Polygon

    def __post_init__(self) -> None:
        require_finite(self, "area_m2", least=0.0)
        require_place(self, "place")
        require_area(self, "outline")


def dropped_warnings(parts: Sequence[DroppedPart], area_m2: float, whose: str) -> tuple[str, ...]:
    """A warning where much water is left out: a list of parts is easily overlooked.

    Parameters
    ----------
    parts
        What is left out.
    area_m2
        The area of all water, > 0.
    whose
        What that water is called.

    Returns
    -------
    tuple of str
        One text, with the reason of the largest part; none up to a twentieth of the water.
    """
    share = sum(part.area_m2 for part in parts) / area_m2
    if share <= MUCH_DROPPED:
        return ()
    largest = max(parts, key=lambda part: part.area_m2)
    return (f"{share:.1%} of {whose} is left out, most of it {largest.reason}",)


class ContourRequest(Message, frozen=True, kw_only=True):
    """The site as the mission describes it: the valid outline (no holes) and the forbidden zones.

    `spacing_m` is the nominal spacing of transects, area / length: the scale of detail that matters.
    `tolerance_m` is the half width of the strip a simplified edge may stand for; by default it is
    derived from `safety_m` and `spacing_m`.

    `places` are the starts and recoveries of all vehicles. The first decides which water is planned on; without
    any, it is the largest. Each lies at most `shore_tolerance_m` from water that can be planned on. Water narrower
    than `least_width_m` does not count; by default all water counts.
    """

    outline: Polygon
    zones: tuple[Polygon, ...] = ()
    safety_m: float = 0.0
    spacing_m: float
    tolerance_m: float | None = None
    places: tuple[Place, ...] = ()
    shore_tolerance_m: float = DEFAULT_SHORE_TOLERANCE_M
    least_width_m: float = 0.0

    def __post_init__(self) -> None:
        require_area(self, "outline", "zones")
        lengths = "safety_m", "tolerance_m", "shore_tolerance_m", "least_width_m"
        require_finite(self, *lengths, least=0.0, most=FARTHEST_M)
        require_finite(self, "spacing_m", above=0.0, most=MOST_LENGTH_M)
        require_places(self, "places")


class FreeSpace(Message, frozen=True, kw_only=True):
    """Where a vehicle may go.

    `free` is one polygon (islands are holes), valid, and inside the true outline eroded by the safety
    distance. `water` is the connected true water around it, not eroded and without narrows, which launch and
    recovery legs may cross.
    """

    free: Polygon
    water: Polygon
    tolerance_m: float
    compression: float
    dropped: tuple[DroppedPart, ...] = ()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_area(self, "free", "water")
        require_finite(self, "tolerance_m", least=0.0, most=FARTHEST_M)
        require_finite(self, "compression", least=0.0)
