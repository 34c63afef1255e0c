"""The measures of a completed Mission File, taken as an independent referee would take them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import msgspec
import numpy as np
from shapely import LineString

from oxbow.contracts import Certificate, CertifyRequest, Conformance, Measures, Role, Track
from oxbow.errors import InvalidMission
from oxbow.geometry.frame import Frame, Position, geodesic_length_m, lonlat
from oxbow.mission.file import Mission
from oxbow.mission.plan import PlanCertificate
from oxbow.planning.field_names import FieldNames
from oxbow.site.fleet import Member
from oxbow.site.site import Site
from oxbow_certificate.certify import certify

__all__ = ["Evaluation", "VehicleEvaluation", "certify_request", "evaluate"]


class VehicleEvaluation(Conformance, frozen=True, kw_only=True):
    """Whether one vehicle's path keeps the rules, including those that only the Mission File sets."""

    name: str
    role: Role
    max_length_m: float
    length_ratio: float
    starts_at_launch_m: float
    ends_at_recovery_m: float


class Evaluation(PlanCertificate, frozen=True, kw_only=True):
    """A certificate, with what only the Mission File sets: the length allowed, and where paths should end.

    Lengths are geodesic, on the ellipsoid. The measures are those of the masters' paths, or of the slaves' if
    there are no masters; `length_ratio` and the distances of the ends are the worst of them. `vehicles` has both
    roles.
    """

    max_length_m: float
    length_ratio: float
    starts_at_launch_m: float
    ends_at_recovery_m: float
    vehicles: tuple[VehicleEvaluation, ...]


def certify_request(mission: Mission, site: Site) -> CertifyRequest:
    """The request to the stage `certificate` for a mission's paths as they stand in the file.

    These are the paths of the masters, or those of the slaves if there are no others.

    Parameters
    ----------
    mission
        A Mission File with a path.
    site
        The site of this mission.

    Returns
    -------
    CertifyRequest
        In the site's plane, with each vehicle's own launch and recovery points.

    Raises
    ------
    InvalidMission
        There is no path, or there is one of a vehicle that takes no part.
    """
    paths = list(_paths(mission, site))
    return _request(mission, site, [path for path in paths if path.role is paths[0].role])


def evaluate(mission: Mission) -> Evaluation:
    """Judge a mission's paths as they stand in the file, whoever made them.

    Raises
    ------
    InvalidMission
        There is no path, there is one of a vehicle that takes no part, or the mission's geometry breaks a rule.
    Infeasible
        The zones or the safety distance leave no water to judge on.
    """
    site = Site.of(mission)
    paths = list(_paths(mission, site))
    teams = [[path for path in paths if path.role is role] for role in dict.fromkeys(path.role for path in paths)]
    with FieldNames.of_mission(mission, site).in_errors():
        certificates = [certify(_request(mission, site, team)) for team in teams]
    vehicles = [
        _vehicle(path, conformance)
        for team, certificate in zip(teams, certificates, strict=True)
        for path, conformance in zip(team, certificate.tracks or (certificate,), strict=True)
    ]
    first, certificate = vehicles[: len(teams[0])], certificates[0]
    measures = {name: getattr(certificate, name) for name in Measures.__struct_fields__} | {
        # Geodesic: a plane makes lengths up to 4 parts in 10 000 too long, and what is promised is metres on the
        # Earth.
        "length_m": sum(vehicle.length_m for vehicle in first),
        "duration_s": max(vehicle.duration_s for vehicle in first),
        "worst_gap": _worst_gap(certificate, site.frame),
    }
    return Evaluation(
        **measures,
        max_length_m=sum(vehicle.max_length_m for vehicle in first),
        length_ratio=max(vehicle.length_ratio for vehicle in first),
        starts_at_launch_m=max(vehicle.starts_at_launch_m for vehicle in first),
        ends_at_recovery_m=max(vehicle.ends_at_recovery_m for vehicle in first),
        vehicles=tuple(vehicles),
    )


@dataclass(frozen=True)
class _Path:
    """A vehicle, its path in the plane, and the path's geodesic length."""

    member: Member
    line: LineString
    length_m: float

    @property
    def role(self) -> Role:
        return self.member.vehicle.role

    @property
    def track(self) -> Track:
        vehicle = self.member.vehicle
        return Track(path=self.line, launch=vehicle.start, recovery=vehicle.recovery, speed_mps=vehicle.speed_mps)


def _paths(mission: Mission, site: Site) -> Iterator[_Path]:
    """The paths in the file, those of the first role first."""
    named = {planned.name: planned.path for planned in mission.planned_paths}
    members = {member.vehicle.name: member for member in site.members}
    # Its ends, speed and length are not known, so that there is nothing to judge it by.
    if strangers := named.keys() - members.keys():
        raise InvalidMission(
            f"has a path of {min(strangers)!r}; expected one of {', '.join(members)}, those who take part",
            where="Paths",
        )
    where = "Paths" if mission.vehicles else f"{site.members[0].vehicle.role.capitalize()}_Path"
    if not named:
        raise InvalidMission("has 0 waypoints; expected a path: oxbow plan makes one", where=where)
    for name, member in members.items():
        if (waypoints := named.get(name)) is None:
            continue
        if len(waypoints) < 2:
            raise InvalidMission(
                f"has {len(waypoints)} waypoints; expected a path: oxbow plan makes one", where=where
            )
        # Both lengths: in the plane for what is judged there, along the earth for what a vehicle really travels.
        degrees = lonlat(waypoints)
        yield _Path(member, LineString(site.frame.to_planar(degrees)), geodesic_length_m(degrees))


def _request(mission: Mission, site: Site, paths: list[_Path]) -> CertifyRequest:
    """The request for one team: a survey is judged on all of the free space, a treatment on the hot spots."""
    first, *others = (path.track for path in paths)
    return CertifyRequest(
        **msgspec.structs.asdict(first),
        others=tuple(others),
        outline=site.outline,
        zones=site.zones,
        safety_m=mission.safety_m,
        least_width_m=mission.least_width_m,
        variogram=mission.variogram,
        areas=tuple(spot.area for spot in site.hot_spots) if site.team(paths[0].role).treats else (),
        danger_zones=site.danger_zones,
    )


def _vehicle(path: _Path, conformance: Conformance) -> VehicleEvaluation:
    vehicle = path.member.vehicle
    rules = {name: getattr(conformance, name) for name in Conformance.__struct_fields__}
    own = {"length_m": path.length_m, "duration_s": path.length_m / vehicle.speed_mps}
    return VehicleEvaluation(
        **rules | own,
        name=vehicle.name,
        role=vehicle.role,
        max_length_m=vehicle.length_m,
        length_ratio=path.length_m / vehicle.length_m,
        starts_at_launch_m=math.dist(path.line.coords[0], vehicle.start),
        ends_at_recovery_m=math.dist(path.line.coords[-1], vehicle.recovery),
    )


def _worst_gap(certificate: Certificate, frame: Frame) -> Position | None:
    if certificate.worst_gap is None:
        return None
    long, lat = frame.to_degrees(np.array([certificate.worst_gap])).tolist()[0]
    return Position(lat=lat, long=long)
