"""Stage `contour`: from the site to where a vehicle may go."""

from __future__ import annotations

from shapely import Polygon

from oxbow.contracts.message import Message, Place, require_area, require_finite

__all__ = ["ContourRequest", "DroppedPart", "FreeSpace"]


class DroppedPart(Message, frozen=True, kw_only=True):
    """Water that a stage leaves out, and why."""

    area_m2: float
    reason: str
    place: Place
    outline: Polygon


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
        require_area(self, "outline")
        require_finite(self, "safety_m", "tolerance_m", least=0.0)
        require_finite(self, "spacing_m", above=0.0)


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
        require_area(self, "free")
