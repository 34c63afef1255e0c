"""The vehicles of a Mission File, and the paths that are planned for them (the fields `Vehicles` and `Paths`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import msgspec

from oxbow.contracts import Role
from oxbow.contracts.message import LEAST_LENGTH_M, MOST_LENGTH_M
from oxbow.errors import InvalidMission
from oxbow.geometry.frame import Position
from oxbow.ids import MOST_ID_CHARACTERS, excerpt

__all__ = ["GivenVehicle", "VehiclePath", "require_distinct"]

_JSON_NAMES = {
    "name": "Name",
    "role": "Role",
    "speed_mps": "Speed",
    "length_m": "Length",
    "start": "Start",
    "recovery": "Recovery",
    "danger_factor": "Danger_factor",
    "danger_factors": "Danger_factors",
}


class GivenVehicle(msgspec.Struct, frozen=True, kw_only=True, rename=_JSON_NAMES):
    """One vehicle of a mission.

    Parameters
    ----------
    name
        Tells it from the others.
    role
        A master surveys, a slave treats (Rendas and Li 2016, section 1.1).
    speed_mps, length_m
        Its speed and the greatest length of its path; the mission's own for its role where absent.
    start, recovery
        Where its path starts and ends; the mission's launch and recovery points where absent.
    danger_factor
        At least 1, which it is where absent: how much less fit it is for water with danger zones.
    danger_factors
        The same on the way to and from some hot spots, by the names that plans give them.
    extra
        Unknown fields, kept unchanged.
    """

    name: str
    role: Role
    speed_mps: float | None = None
    length_m: float | None = None
    start: Position | None = None
    recovery: Position | None = None
    danger_factor: float | None = None
    danger_factors: dict[str, float] | None = None
    extra: dict[str, Any] = {}


class VehiclePath(
    msgspec.Struct, frozen=True, kw_only=True, rename={"name": "Name", "role": "Role", "path": "Path"}
):
    """The path that is planned for one vehicle."""

    name: str
    role: Role
    path: tuple[Position, ...]


def require_distinct(vehicles: Sequence[GivenVehicle]) -> None:
    """Check that every vehicle has a name of its own, a speed and range in bounds, and a factor of 1 at least."""
    seen: dict[str, int] = {}
    for index, vehicle in enumerate(vehicles):
        where = f"Vehicles[{index}]"
        if not vehicle.name:
            raise InvalidMission("is empty; expected a name for every vehicle", where=f"{where}.Name")
        if len(vehicle.name) > MOST_ID_CHARACTERS:
            raise InvalidMission(
                f"is {excerpt(vehicle.name)}; expected at most {MOST_ID_CHARACTERS} characters", f"{where}.Name"
            )
        # Plans, recordings and errors tell vehicles apart by their names alone.
        if (first := seen.setdefault(vehicle.name, index)) < index:
            raise InvalidMission(
                f"is {vehicle.name!r}, the same as Vehicles[{first}]; expected a different name", f"{where}.Name"
            )
        for field in ("speed_mps", "length_m"):
            value = getattr(vehicle, field)
            if value is not None and not LEAST_LENGTH_M <= value <= MOST_LENGTH_M:
                raise InvalidMission(
                    f"is {value!r}; expected a number from {LEAST_LENGTH_M:g} to {MOST_LENGTH_M:g}",
                    where=f"{where}.{_JSON_NAMES[field]}",
                )
        # A factor below 1 would make danger attractive.
        factors = {"Danger_factor": vehicle.danger_factor}
        factors |= {
            f"Danger_factors[{excerpt(spot)}]": own for spot, own in (vehicle.danger_factors or {}).items()
        }
        for field, factor in factors.items():
            if factor is not None and not 1.0 <= factor < math.inf:
                raise InvalidMission(f"is {factor!r}; expected a finite number >= 1", where=f"{where}.{field}")
