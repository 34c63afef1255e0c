"""Danger zones, which more than one stage receives: routes avoid them, and paths are judged by them."""

from __future__ import annotations

import enum
import math

from shapely import Polygon

from oxbow.contracts.message import Message, require_area
from oxbow.errors import InvalidRequest, renamed

__all__ = ["DANGER_DETOUR_M", "DangerZone", "Per"]

DANGER_DETOUR_M = 1_000.0
"""The detour that raising the chance of no harm by a factor of e is worth, by default."""


class Per(enum.StrEnum):
    """What a zone's probability refers to."""

    METRE = "metre"
    CROSSING = "crossing"


class DangerZone(Message, frozen=True, kw_only=True):
    """An area that may be travelled, at a risk.

    Parameters
    ----------
    name
        Its name in errors.
    area
        Its outline; a boat on the outline is outside.
    probability
        Of harm, 0 <= probability < 1, for each metre inside or for each crossing.
    per
        Which of these two. A crossing lasts from where a route enters the area, or starts in it, to where it
        leaves.

    Raises
    ------
    InvalidRequest
        The probability is out of range, or the area is empty or not valid; names the zone.
    """

    name: str
    area: Polygon
    probability: float
    per: Per = Per.CROSSING

    def __post_init__(self) -> None:
        if not 0.0 <= self.probability < 1.0:
            raise InvalidRequest(
                f"has danger {self.probability!r}; expected 0 <= danger < 1 (what must not be entered is a"
                " forbidden zone)",
                where=self.name,
            )
        with renamed({"area": self.name}):
            require_area(self, "area")

    @property
    def hazard(self) -> float:
        """-log(1 - probability): hazards add up where probabilities of no harm multiply."""
        # Not log(1 - p), which is 0 for probabilities below 1e-16: a zone of small danger per metre would be free.
        return -math.log1p(-self.probability)
