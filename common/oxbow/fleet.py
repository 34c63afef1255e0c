"""The vehicles that take part in a mission, in its plane, and what they are planned to do."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import shapely
from shapely import LineString, Point, Polygon

from oxbow.contracts import (
    Assignment,
    Certificate,
    DroppedPart,
    FreeSpace,
    Place,
    Role,
    Vehicle,
)
from oxbow.errors import OxbowError
from oxbow.frame import Position
from oxbow.mission import Mission
from oxbow.vehicles import GivenVehicle

__all__ = ["Member", "TeamPlan", "VehiclePlan", "members", "share_space"]

Locate = Callable[[str, Position], Place]
"""Brings a position to the plane; the text is its field's name, for errors."""

CORRIDOR = 0.1
"""Half the width of the way over land to a point ashore, as a share of its length."""


@dataclass(frozen=True)
class Member:
    """A vehicle that takes part.

    Parameters
    ----------
    vehicle
        Where it starts and ends, in the plane, and how far and fast it goes.
    start, recovery
        The same places as the Mission File has them.
    fields
        The names in the Mission File of what stages call LaunchPoint, RecoveryPoint and Master_length.
    """

    vehicle: Vehicle
    start: Position
    recovery: Position
    fields: dict[str, str]

    @property
    def is_named(self) -> bool:
        """Whether the Mission File names its vehicles."""
        return "LaunchPoint" in self.fields

    @contextmanager
    def named(self) -> Iterator[None]:
        """Say of errors which field of the Mission File they are about, and which vehicle it is."""
        try:
            yield
        except OxbowError as error:
            raise type(error)(error.message, self.fields.get(error.where, error.where)) from error


@dataclass(frozen=True)
class VehiclePlan:
    """What one vehicle is to do.

    Parameters
    ----------
    member
        The vehicle.
    path
        From its start to its recovery, in the plane.
    heading_rad, spacing_m, area_m2
        Of a survey: direction and spacing of its legs, and the area of the vehicle's share of the free space.
    hot_spots
        Of a treatment: what it treats, in order.
    """

    member: Member
    path: LineString
    heading_rad: float | None = None
    spacing_m: float | None = None
    area_m2: float | None = None
    hot_spots: tuple[str, ...] = ()


@dataclass(frozen=True)
class TeamPlan:
    """What the vehicles of one role are to do together, and how good it is.

    Parameters
    ----------
    vehicles
        One a vehicle that leaves its start.
    certificate
        Of all their paths together.
    assignment
        How the work was shared out; None where there was nothing to share.
    """

    vehicles: tuple[VehiclePlan, ...]
    certificate: Certificate
    assignment: Assignment | None = None
    dropped: tuple[DroppedPart, ...] = ()
    warnings: tuple[str, ...] = ()


def members(mission: Mission, locate: Locate) -> tuple[Member, ...]:
    """The vehicles of the roles that a mission's type asks for, those of the first role first."""
    given = mission.vehicles
    if given is None:
        return tuple(_member_of_role(mission, role, locate) for role in mission.mission_type.roles)
    return tuple(
        _given_member(mission, vehicle, f"Vehicles[{index}]", locate)
        for role in mission.mission_type.roles
        for index, vehicle in enumerate(given)
        if vehicle.role is role
    )


def _member_of_role(mission: Mission, role: Role, locate: Locate) -> Member:
    """The one vehicle of its role, which the mission does not name."""
    nameless = GivenVehicle(name=role.value, role=role)
    fields = {"Master_length": f"{role.value.capitalize()}_length"}
    return _member(mission, nameless, ("LaunchPoint", "RecoveryPoint"), fields, locate)


def _given_member(mission: Mission, given: GivenVehicle, where: str, locate: Locate) -> Member:
    start = "LaunchPoint" if given.start is None else f"{where}.Start"
    recovery = "RecoveryPoint" if given.recovery is None else f"{where}.Recovery"
    fields = {"LaunchPoint": start, "RecoveryPoint": recovery, "Master_length": f"{where}.Length"}
    return _member(mission, given, (start, recovery), fields, locate)


def _member(
    mission: Mission, given: GivenVehicle, names: tuple[str, str], fields: dict[str, str], locate: Locate
) -> Member:
    start = given.start or mission.launch
    recovery = given.recovery or mission.recovery or mission.launch
    is_master = given.role is Role.MASTER
    vehicle = Vehicle(
        name=given.name,
        role=given.role,
        speed_mps=given.speed_mps or (mission.master_speed_mps if is_master else mission.slave_speed_mps),
        length_m=given.length_m or (mission.master_length_m if is_master else mission.slave_length_m),
        start=locate(names[0], start),
        recovery=locate(names[1], recovery),
    )
    return Member(vehicle, start, recovery, fields)


def share_space(share: Polygon, space: FreeSpace, ends: Sequence[Place], safety_m: float) -> FreeSpace:
    """The space of a vehicle that covers a share of the free space, and may cross all of it on its legs.

    Legs are long, and keep to the free space: nearer to the shore, only the surroundings of their ends may be
    crossed which the certificate excuses (twice the safety distance, and one and a half times the way to the free
    space). Over land, a leg runs to the nearest water that is free.
    """
    ways = [space.free, *(way for place in ends for way in _ways_to(Point(place), space, safety_m))]
    parts = shapely.get_parts(shapely.union_all(ways))
    within = max(parts, key=lambda part: part.area)
    return FreeSpace(
        free=share,
        water=within,
        tolerance_m=space.tolerance_m,
        compression=space.compression,
        dropped=space.dropped,
    )


def _ways_to(point: Point, space: FreeSpace, safety_m: float) -> Iterator[Polygon]:
    """What is added to the free space so that a point may be reached from it."""
    straight = shapely.shortest_line(point, space.free)
    if straight.length == 0.0:
        return
    if not space.water.covers(point):
        yield straight.buffer(CORRIDOR * straight.length)
    radius_m = 2.0 * safety_m + 1.5 * straight.length
    yield from shapely.get_parts(point.buffer(radius_m).intersection(space.water))
