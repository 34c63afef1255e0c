"""Stage `contour`: from the site to where a vehicle may go."""

from __future__ import annotations

from shapely import Polygon

from oxbow.contracts.message import MOST_LENGTH_M, Message, Place, require_area, require_finite, require_place
from oxbow.tolerances import FARTHEST_M

__all__ = ["ContourRequest", "DroppedPart", "FreeSpace"]


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


class ContourRequest(Message, frozen=True, kw_only=True):
    """The site as the mission describes it: the valid outline (no holes) and the forbidden zones.

    `spacing_m` is the nominal spacing of transects, area / length: the scale of detail that matters.
    `tolerance_m` is the half width of the strip a simplified edge may stand for; by default it is
    derived from `safety_m` and `spacing_m`.
    """

    outline: Polygon
    zones: tuple[Polygon, ...] = ()
    safety_m: float = 0.0
    spacing_m: float
    tolerance_m: float | None = None

    def __post_init__(self) -> None:
        require_area(self, "outline", "zones")
        require_finite(self, "safety_m", "tolerance_m", least=0.0, most=FARTHEST_M)
        require_finite(self, "spacing_m", above=0.0, most=MOST_LENGTH_M)


class FreeSpace(Message, frozen=True, kw_only=True):
    """Where a vehicle may go.

    `free` is one polygon (islands are holes), valid, and inside the true outline eroded by the safety
    distance. `water` is the true water, not eroded, that launch and recovery legs may cross.
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
