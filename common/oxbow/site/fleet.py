"""The vehicles that take part in a mission, in its plane, and what they are planned to do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from shapely import LineString

from oxbow.arrays import Place
from oxbow.contracts import Assignment, Certificate, DroppedPart, Role, Vehicle
from oxbow.geometry.frame import Position
from oxbow.mission.file import Mission
from oxbow.mission.vehicles import GivenVehicle

__all__ = ["Member", "Team", "TeamPlan", "VehiclePlan", "members"]

Locate = Callable[[str, Position], Place]
"""Brings a position to the plane; the text is its field's name, for errors."""


@dataclass(frozen=True)
class MemberFields:
    """The fields of the Mission File that say where a vehicle starts and ends, and how far it goes."""

    start: str
    recovery: str
    length: str


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
        Which fields of the Mission File say so.
    is_named
        Whether the Mission File names its vehicles.
    """

    vehicle: Vehicle
    start: Position
    recovery: Position
    fields: MemberFields
    is_named: bool

    def with_name(self, warning: str) -> str:
        """A warning, with the name of the vehicle where the Mission File names its vehicles."""
        return f"{self.vehicle.name}: {warning}" if self.is_named else warning


@dataclass(frozen=True)
class Team:
    """The vehicles of one role.

    Parameters
    ----------
    role
        Their role.
    members
        The vehicles.
    treats
        Whether they treat hot spots; else they survey.
    """

    role: Role
    members: tuple[Member, ...]
    treats: bool


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
    dropped, warnings
        What the path leaves out, and warnings about it.
    """

    member: Member
    path: LineString
    heading_rad: float | None = None
    spacing_m: float | None = None
    area_m2: float | None = None
    hot_spots: tuple[str, ...] = ()
    dropped: tuple[DroppedPart, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class TeamPlan:
    """What the vehicles of one role are to do together, and how good it is.

    Parameters
    ----------
    vehicles
        One per vehicle that leaves its start.
    certificate
        Of all their paths together.
    assignment
        How the work was shared out; None where there was nothing to share.
    treats
        Whether they treat hot spots; else they survey.
    """

    vehicles: tuple[VehiclePlan, ...]
    certificate: Certificate
    assignment: Assignment | None = None
    treats: bool = False

    @property
    def dropped(self) -> tuple[DroppedPart, ...]:
        """What the paths leave out."""
        of_all = () if self.assignment is None else self.assignment.dropped
        return of_all + tuple(part for plan in self.vehicles for part in plan.dropped)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the paths, with the vehicle's name where the Mission File names its vehicles."""
        of_all = () if self.assignment is None else self.assignment.warnings
        return of_all + tuple(plan.member.with_name(text) for plan in self.vehicles for text in plan.warnings)


def members(mission: Mission, locate: Locate) -> tuple[Member, ...]:
    """The vehicles of the roles that a mission's type asks for, those of the first role first.

    Parameters
    ----------
    mission
        The mission.
    locate
        Brings the start and the recovery of each to the site's plane.

    Returns
    -------
    tuple of Member
        At least one for each role that takes part; within a role, in the order of the mission.
    """
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
    fields = MemberFields("LaunchPoint", "RecoveryPoint", f"{role.value.capitalize()}_length")
    return _member(mission, nameless, fields, locate, is_named=False)


def _given_member(mission: Mission, given: GivenVehicle, where: str, locate: Locate) -> Member:
    fields = MemberFields(
        start="LaunchPoint" if given.start is None else f"{where}.Start",
        recovery="RecoveryPoint" if given.recovery is None else f"{where}.Recovery",
        length=f"{where}.Length",
    )
    return _member(mission, given, fields, locate, is_named=True)


def _member(
    mission: Mission, given: GivenVehicle, fields: MemberFields, locate: Locate, *, is_named: bool
) -> Member:
    start = given.start or mission.launch
    recovery = given.recovery or mission.recovery or mission.launch
    is_master = given.role is Role.MASTER
    vehicle = Vehicle(
        name=given.name,
        role=given.role,
        speed_mps=given.speed_mps or (mission.master_speed_mps if is_master else mission.slave_speed_mps),
        length_m=given.length_m or (mission.master_length_m if is_master else mission.slave_length_m),
        start=locate(fields.start, start),
        recovery=locate(fields.recovery, recovery),
        danger_factor=given.danger_factor or 1.0,
        danger_factors=given.danger_factors or {},
    )
    return Member(vehicle, start, recovery, fields, is_named)
