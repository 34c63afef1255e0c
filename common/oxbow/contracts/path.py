"""Stage `path`: from cells to a path."""

from __future__ import annotations

import enum
import math

from shapely import LineString, Polygon

from oxbow.arrays import Place
from oxbow.contracts.approach import Approach
from oxbow.contracts.contour import DroppedPart, FreeSpace
from oxbow.contracts.decomposition import Decomposition
from oxbow.contracts.message import (
    MOST_LENGTH_M,
    MOST_SEED,
    Message,
    require_area,
    require_finite,
    require_line,
    require_place,
)
from oxbow.contracts.missions import MOST_DEADLINE_S
from oxbow.errors import InvalidRequest

__all__ = ["Draw", "Method", "PathPlan", "PathRequest", "SpacingStep", "WeightedArea"]


class Method(enum.StrEnum):
    """A way to generate a path; the names are the report's (Rendas and Li 2016, section 1.1)."""

    SPACE_FILLING_CURVE = "SpaceFillingCurve"
    TOUR = "Tour"
    TRANSECT = "Transect"
    WATERSHED = "Watershed"


class Draw(enum.StrEnum):
    """How the inputs of the space-filling curve's network are drawn (Rendas and Li 2016, section 1.2.1.4)."""

    LOW_DISCREPANCY = "low-discrepancy"
    CONVEX_COMBINATION = "convex-combination"


MOST_WEIGHT = 1e6
"""Water of a greater weight would leave nothing for the rest."""


class WeightedArea(Message, frozen=True, kw_only=True):
    """Where sampling is `weight` times as important as elsewhere, where the weight is 1."""

    area: Polygon
    weight: float

    def __post_init__(self) -> None:
        require_area(self, "area")
        require_finite(self, "weight", least=0.0, most=MOST_WEIGHT)


class PathRequest(Message, frozen=True, kw_only=True):
    """The constraints on a path: the water, its cells, the greatest length, the least spacing.

    `weighted_areas` do not overlap, and may reach beyond the water. `time_limit_s` is what may be spent on
    improving the path; without it the work is fixed, and the same request gives the same path everywhere.
    `smooth` asks for rounded corners. Only the space-filling curve uses `draw`. Where there is an `approach`, the
    free space is a share, and the path has legs to it and home through the water around.
    """

    method: Method = Method.SPACE_FILLING_CURVE
    space: FreeSpace
    decomposition: Decomposition
    launch: Place
    recovery: Place
    length_m: float
    approach: Approach | None = None
    min_spacing_m: float = 0.0
    seed: int = 0
    weighted_areas: tuple[WeightedArea, ...] = ()
    time_limit_s: float | None = None
    smooth: bool = False
    draw: Draw = Draw.LOW_DISCREPANCY

    def __post_init__(self) -> None:
        require_finite(self, "length_m", above=0.0, most=MOST_LENGTH_M)
        require_finite(self, "time_limit_s", above=0.0, most=MOST_DEADLINE_S)
        require_finite(self, "min_spacing_m", least=0.0, most=MOST_LENGTH_M)
        x0, y0, x1, y1 = self.space.free.bounds
        extent_m = math.hypot(x1 - x0, y1 - y0)
        if self.min_spacing_m > extent_m:
            raise InvalidRequest(
                f"is {self.min_spacing_m:g} m; expected at most the extent of the water, {extent_m:.0f} m",
                where="min_spacing_m",
            )
        require_finite(self, "seed", least=0, most=MOST_SEED)
        require_place(self, "launch", "recovery")
        if self.approach is not None and self.approach.legs_m >= self.length_m:
            raise InvalidRequest(
                f"is {self.length_m:g} m; expected more than its legs take, {self.approach.legs_m:g} m",
                where="length_m",
            )


class SpacingStep(Message, frozen=True, kw_only=True):
    """One turn of the spacing loop (report, steps 5 to 8): the spacing tried and the length it gave."""

    spacing_m: float
    length_m: float

    def __post_init__(self) -> None:
        require_finite(self, "spacing_m", "length_m", least=0.0)


class PathPlan(Message, frozen=True, kw_only=True):
    """A path from launch to recovery, simple and inside the free space (legs in the water)."""

    path: LineString
    spacing_m: float
    steps: tuple[SpacingStep, ...]
    dropped: tuple[DroppedPart, ...] = ()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_line(self, "path")
        require_finite(self, "spacing_m", least=0.0)
