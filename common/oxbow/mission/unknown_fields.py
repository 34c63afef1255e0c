"""Warnings about unknown fields of a Mission File that look like a known one: most likely misspelt."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence

import msgspec

from oxbow.mission.danger_zones import GivenDangerZone
from oxbow.mission.file import FIELD_NAMES, Bloom, Mission
from oxbow.mission.vehicles import GivenVehicle
from oxbow.wire.strict_json import json_names

__all__ = ["misspelt"]

ALIKE = 0.75
"""The least similarity of two names, of 1 (Ratcliff and Metzener 1988, as `difflib` has it)."""


def misspelt(mission: Mission) -> tuple[str, ...]:
    """A warning for each field that is kept without a meaning, though its name is much like a known one."""
    bloom = () if mission.bloom is None else (mission.bloom,)
    warnings = list(_like(mission.extra, FIELD_NAMES, ""))
    warnings += _in_parts(bloom, Bloom, "Bloom")
    warnings += _in_parts(mission.vehicles or (), GivenVehicle, "Vehicles[{}]")
    warnings += _in_parts(mission.danger_zones or (), GivenDangerZone, "DangerZones[{}]")
    return tuple(warnings)


def _in_parts(
    parts: Sequence[Bloom | GivenVehicle | GivenDangerZone], kind: type[msgspec.Struct], where: str
) -> Iterator[str]:
    for index, part in enumerate(parts):
        yield from _like(part.extra, json_names(kind).values(), f"{where.format(index)}.")


def _like(unknown: Iterable[str], known: Iterable[str], prefix: str) -> Iterator[str]:
    # Without regard to capitals: `Least_Width` differs from `Least_width` in nothing else.
    names = {name.lower(): name for name in known}
    for field in unknown:
        close = difflib.get_close_matches(field.lower(), names, n=1, cutoff=ALIKE)
        if close:
            yield f"{prefix}{field} is not a known field and is kept unchanged; did you mean {names[close[0]]}?"
