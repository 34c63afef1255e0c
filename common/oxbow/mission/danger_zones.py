"""The danger zones of a Mission File (the field `DangerZones`): what may be entered, at a risk."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec

from oxbow.contracts import Per
from oxbow.errors import InvalidMission
from oxbow.geometry.frame import Position

__all__ = ["GivenDangerZone", "require_dangers"]

_JSON_NAMES = {"name": "Name", "contour": "Contour", "danger": "Danger", "per": "Per"}


class GivenDangerZone(msgspec.Struct, frozen=True, kw_only=True, rename=_JSON_NAMES):
    """One danger zone of a mission.

    Parameters
    ----------
    name
        What a plan calls it; its place in the list where absent.
    contour
        Its outline, as those of forbidden zones.
    danger
        The probability of harm, 0 <= danger < 1.
    per
        What the probability refers to.
    extra
        Unknown fields, kept unchanged.
    """

    name: str | None = None
    contour: tuple[Position, ...]
    danger: float
    per: Per = Per.CROSSING
    extra: dict[str, Any] = {}


def require_dangers(zones: Sequence[GivenDangerZone]) -> None:
    """Check that every danger is a probability less than 1."""
    for index, zone in enumerate(zones):
        if not 0.0 <= zone.danger < 1.0:
            raise InvalidMission(
                f"is {zone.danger!r}; expected 0 <= danger < 1 (what must not be entered belongs in"
                " ForbiddenZones)",
                where=f"DangerZones[{index}].Danger",
            )
