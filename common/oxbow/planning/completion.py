"""The last step of a mission: its paths in degrees and the record of the plan, in the Mission File."""

from __future__ import annotations

import importlib.metadata
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import shapely
from shapely import LineString

from oxbow.arrays import FloatArray, Place
from oxbow.contracts import Certificate, Conformance, DroppedPart, FreeSpace, Measures, Role
from oxbow.errors import Internal
from oxbow.geometry.frame import Frame, Position, geodesic_length_m, lonlat
from oxbow.mission.file import Mission
from oxbow.mission.plan import (
    DroppedWater,
    FleetRecord,
    FurtherSortie,
    PlanCertificate,
    PlanOptions,
    PlanRecord,
    TreatedSpot,
    TreatmentRecord,
    VehicleRecord,
)
from oxbow.mission.vehicles import VehiclePath
from oxbow.site.fleet import Member, TeamPlan, VehiclePlan
from oxbow.site.site import Site

__all__ = ["completed_mission"]

SAME_PLACE_M = 1e-3
"""A path ends where it should if it ends no farther than this from there: a millimetre."""

LONG_LEG = 2.0
"""A leg with more than this many safety distances within Safety is warned about: it does not lead straight off."""


def completed_mission(
    mission: Mission, options: PlanOptions, site: Site, space: FreeSpace, teams: Sequence[TeamPlan]
) -> Mission:
    """The mission with its paths and its `Plan`; older paths and an older plan are replaced.

    The first and the last waypoint of a path are the positions of its start and recovery exactly as given.

    Parameters
    ----------
    mission
        The mission as it was handed in.
    options
        How it was planned.
    site
        The mission in planar metres.
    space
        The free space that the contour stage gave.
    teams
        The plan of each role, in the order of the mission type's roles.

    Returns
    -------
    Mission
        A new one; that given is unchanged. The survey of a single vehicle has no record of a fleet.

    Raises
    ------
    Internal
        A path does not start or end where it should, or its waypoints as written are longer than its vehicle
        may go.
    """
    # In degrees first: what the record says of lengths is what the waypoints as written have.
    written = [[_Written.of(plan, site.frame) for plan in team.vehicles] for team in teams]
    record = PlanRecord(
        method=options.method,
        seed=options.seed,
        time_limit_s=options.time_limit_s,
        **_figures(mission, written[0]),
        tolerance_m=space.tolerance_m,
        compression=space.compression,
        certificate=_in_degrees(teams[0].certificate, site.frame),
        warnings=site.warnings
        + space.warnings
        + tuple(text for team in teams for text in _team_warnings(mission, options, team)),
        dropped=tuple(
            _dropped(part, site.frame) for part in space.dropped + tuple(p for team in teams for p in team.dropped)
        ),
        versions=_versions(),
        fleet=_fleet(teams, written),
        treatment=_treatment(mission, options, site, teams[-1]),
        slave_certificate=_in_degrees(teams[-1].certificate, site.frame) if len(teams) > 1 else None,
    )
    return msgspec.structs.replace(mission, **_paths(mission, written), plan=record)


@dataclass(frozen=True)
class _Written:
    """A vehicle's plan, its waypoints as they are written, and their geodesic length."""

    plan: VehiclePlan
    waypoints: tuple[Position, ...]
    length_m: float

    @classmethod
    def of(cls, plan: VehiclePlan, frame: Frame) -> _Written:
        waypoints = _waypoints(plan.member, plan.path, frame)
        # The plane distorts lengths a little: it is the geodesic length that a vehicle's range has to cover.
        length_m = geodesic_length_m(lonlat(waypoints))
        if length_m > plan.member.vehicle.length_m:
            raise Internal(
                f"is {length_m!r} m long; expected at most {plan.member.vehicle.length_m!r} m",
                where=_field(plan.member),
            )
        return cls(plan, waypoints, length_m)

    @property
    def duration_s(self) -> float:
        return self.length_m / self.plan.member.vehicle.speed_mps


def _paths(mission: Mission, written: Sequence[Sequence[_Written]]) -> dict[str, object]:
    """The fields that hold the paths: one per role, or `Paths` where the mission names its vehicles."""
    planned = [each for team in written for each in team]
    if mission.vehicles is None:
        own = {each.plan.member.vehicle.role: each.waypoints for each in planned}
        return {"master_path": own.get(Role.MASTER), "slave_path": own.get(Role.SLAVE), "paths": None}
    vehicles = [(each.plan.member.vehicle, each.waypoints) for each in planned]
    paths = tuple(VehiclePath(name=vehicle.name, role=vehicle.role, path=path) for vehicle, path in vehicles)
    return {"master_path": None, "slave_path": None, "paths": paths}


def _figures(mission: Mission, written: Sequence[_Written]) -> dict[str, Any]:
    """What the record says of one team as a whole."""
    # Shares may have a heading each: only one that all have in common is the plan's.
    headings = {each.plan.heading_rad for each in written}
    heading_rad = headings.pop() if len(headings) == 1 else None
    # A treatment has no spacing: its passes are a swath apart.
    spacings_m = [each.plan.spacing_m or mission.treated_swath_m or 0.0 for each in written]
    return {
        "heading_deg": None if heading_rad is None else math.degrees(heading_rad),
        "spacing_m": max(spacings_m),
        "length_m": sum(each.length_m for each in written),
        "max_length_m": sum(each.plan.member.vehicle.length_m for each in written),
        "duration_s": max(each.duration_s for each in written),
    }


def _fleet(teams: Sequence[TeamPlan], written: Sequence[Sequence[_Written]]) -> FleetRecord | None:
    vehicles = [
        _vehicle(each, conformance)
        for team, own in zip(teams, written, strict=True)
        for each, conformance in zip(own, team.certificate.tracks or (team.certificate,), strict=True)
    ]
    if len(vehicles) == 1 and not teams[0].treats:
        return None
    return FleetRecord(
        makespan_s=max(vehicle.duration_s for vehicle in vehicles),
        imbalance=max(team.assignment.imbalance if team.assignment else 0.0 for team in teams),
        vehicles=tuple(vehicles),
    )


def _team_warnings(mission: Mission, options: PlanOptions, team: TeamPlan) -> tuple[str, ...]:
    warnings = (*_unsafe_legs(mission, team), *team.warnings)
    if not team.treats:
        return warnings + _near_legs(mission, team)
    if options.smooth:
        return (*warnings, "passes over hot spots keep their corners: only surveys are smoothed")
    return warnings


def _unsafe_legs(mission: Mission, team: TeamPlan) -> Iterator[str]:
    """Warnings about legs that launch and recovery points make necessary: over land, or far within Safety."""
    # The certificate of a single path has no tracks: it is itself that of the path.
    tracks = team.certificate.tracks or (team.certificate,)
    for plan, track in zip(team.vehicles, tracks, strict=True):
        vehicle = plan.member.vehicle
        fields = plan.member.fields
        # Where a vehicle comes back to its start, the leg home is that from the start.
        ends = (fields.start,) if vehicle.recovery == vehicle.start else (fields.start, fields.recovery)
        for field, leg in zip(ends, track.legs, strict=False):
            where = plan.member.with_name(field)
            if leg.ashore_m > 0.0:
                yield f"{where} lies ashore: {leg.ashore_m:.3g} m of its leg lead over land"
            if leg.unsafe_m > LONG_LEG * mission.safety_m + leg.ashore_m:
                yield f"{where} lies in narrow water: {leg.unsafe_m:.0f} m of its leg are within Safety"


def _near_legs(mission: Mission, team: TeamPlan) -> tuple[str, ...]:
    """A warning where legs of a survey come nearer than Minimal_spatial_rate: covering the water comes first."""
    wanted_m, least_m = mission.minimal_spatial_rate_m, team.certificate.least_leg_distance_m
    if wanted_m is None or least_m is None or least_m >= wanted_m:
        return ()
    return (
        f"legs come as near as {least_m:.3g} m to one another, in narrow water or beside a bend;"
        f" Minimal_spatial_rate is {wanted_m:g} m, which the spacing of legs keeps, and single legs may not",
    )


def _vehicle(written: _Written, certificate: Conformance) -> VehicleRecord:
    plan, vehicle = written.plan, written.plan.member.vehicle
    return VehicleRecord(
        name=vehicle.name,
        role=vehicle.role,
        length_m=written.length_m,
        max_length_m=vehicle.length_m,
        duration_s=written.duration_s,
        heading_deg=None if plan.heading_rad is None else math.degrees(plan.heading_rad),
        spacing_m=plan.spacing_m,
        area_m2=plan.area_m2,
        hot_spots=plan.hot_spots,
        certificate=Conformance(**{name: getattr(certificate, name) for name in Conformance.__struct_fields__}),
    )


def _treatment(mission: Mission, options: PlanOptions, site: Site, team: TeamPlan) -> TreatmentRecord | None:
    assignment = team.assignment
    if assignment is None or not assignment.sorties:
        return None
    team_by_name = {member.vehicle.name: member for member in site.members}
    further = tuple(
        FurtherSortie(
            vehicle=sortie.vehicle,
            hot_spots=sortie.hot_spots,
            length_m=sortie.length_m,
            duration_s=sortie.duration_s,
            path=_waypoints(team_by_name[sortie.vehicle], sortie.path, site.frame),
        )
        for sortie in assignment.further
    )
    spots = zip(site.hot_spots, assignment.treated_share, strict=True)
    return TreatmentRecord(
        swath_m=mission.treated_swath_m or 0.0,
        hot_spots=tuple(
            TreatedSpot(hot_spot=spot.name, value=spot.value, treated_share=share) for spot, share in spots
        ),
        further=further,
        left=assignment.left,
        joint_gap=assignment.joint_gap,
        router=options.router,
    )


def _field(member: Member) -> str:
    """Where the Mission File has a member's path."""
    return f"Paths of {member.vehicle.name!r}" if member.is_named else f"{member.vehicle.role.capitalize()}_Path"


def _waypoints(member: Member, path: LineString, frame: Frame) -> tuple[Position, ...]:
    xy = shapely.get_coordinates(path)
    _require_same("starts", xy[0], member.vehicle.start, member)
    _require_same("ends", xy[-1], member.vehicle.recovery, member)
    between = (Position(lat=lat, long=long) for long, lat in frame.to_degrees(xy[1:-1]).tolist())
    return (member.start, *between, member.recovery)


def _require_same(what: str, end: FloatArray, place: Place, member: Member) -> None:
    distance_m = float(np.hypot(*(end - place)))
    if distance_m > SAME_PLACE_M:
        raise Internal(f"{what} {distance_m:.3f} m from where it should", where=_field(member))


def _position(place: Place, frame: Frame) -> Position:
    long, lat = frame.to_degrees(np.array([place])).tolist()[0]
    return Position(lat=lat, long=long)


def _dropped(part: DroppedPart, frame: Frame) -> DroppedWater:
    return DroppedWater(area_m2=part.area_m2, reason=part.reason, place=_position(part.place, frame))


def _in_degrees(certificate: Certificate, frame: Frame) -> PlanCertificate:
    gap = None if certificate.worst_gap is None else _position(certificate.worst_gap, frame)
    measures = {name: getattr(certificate, name) for name in Measures.__struct_fields__}
    return PlanCertificate(**measures, worst_gap=gap)


def _versions() -> dict[str, str]:
    """What a plan depends on beside its input."""
    return {
        "oxbow": importlib.metadata.version("oxbow"),
        "geos": ".".join(map(str, shapely.geos_version)),
        "numpy": np.__version__,
        "shapely": shapely.__version__,
    }
