"""Vehicles, and who they are."""

from __future__ import annotations

import enum
import math

from oxbow.contracts import Message, Place
from oxbow.errors import InvalidMission

__all__ = ["Role", "Vehicle"]


class Role(enum.StrEnum):
    """What a vehicle is for: a master surveys, a slave treats (Rendas and Li 2016, section 1.1)."""

    MASTER = "master"
    SLAVE = "slave"


class Vehicle(Message, frozen=True, kw_only=True):
    """One vehicle of the fleet.

    Parameters
    ----------
    name
        What the mission calls it.
    role
        What it is for.
    speed_mps
        Its speed along a route, in m/s.
    length_m
        The longest route that it may travel, from start to recovery: its range.
    start, recovery
        Where it is now and where it ends; planar places in metres.

    Raises
    ------
    InvalidMission
        A vehicle without a name, a speed, a range or a place; the error names the vehicle.
    """

    name: str
    role: Role = Role.SLAVE
    speed_mps: float = 1.0
    length_m: float
    start: Place
    recovery: Place

    def __post_init__(self) -> None:
        if not self.name:
            raise InvalidMission("is empty; expected a name for every vehicle", where="name")
        for field, unit in (("speed_mps", "m/s"), ("length_m", "m")):
            value = getattr(self, field)
            if not (math.isfinite(value) and value > 0.0):
                raise InvalidMission(
                    f"is {value!r} {unit}; expected a finite number > 0", where=f"vehicle {self.name!r}: {field}"
                )
        for field in ("start", "recovery"):
            if not all(map(math.isfinite, getattr(self, field))):
                raise InvalidMission(
                    f"is {getattr(self, field)!r}; expected two finite numbers",
                    where=f"vehicle {self.name!r}: {field}",
                )
