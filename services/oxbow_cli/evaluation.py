"""The measures of a completed Mission File, as an independent referee would take them."""

from __future__ import annotations

import math

import numpy as np
from shapely import LineString

from oxbow.contracts import Certificate, CertifyRequest, Measures
from oxbow.errors import InvalidMission
from oxbow.frame import Frame, Position, geodesic_length_m, lonlat
from oxbow.mission import Mission
from oxbow.plan import PlanCertificate
from oxbow.site import Site
from oxbow_certificate.certify import certify

__all__ = ["Evaluation", "certify_request", "evaluate"]


class Evaluation(PlanCertificate, frozen=True, kw_only=True):
    """A certificate with what only the Mission File can tell: the length allowed, and where the path should end.

    `length_m` is geodesic, on the ellipsoid.
    """

    max_length_m: float
    length_ratio: float
    starts_at_launch_m: float
    ends_at_recovery_m: float


def certify_request(mission: Mission, site: Site) -> CertifyRequest:
    """What the stage `certificate` is asked about a mission's path as it stands in the file.

    Raises
    ------
    InvalidMission
        There is no path.
    """
    waypoints = mission.master_path or ()
    if len(waypoints) < 2:
        raise InvalidMission(
            f"has {len(waypoints)} waypoints; expected a path: `oxbow plan` makes one", where="Master_Path"
        )
    return CertifyRequest(
        outline=site.outline,
        zones=site.zones,
        safety_m=mission.safety_m,
        path=LineString(site.frame.to_planar(lonlat(waypoints))),
        launch=site.launch,
        recovery=site.recovery,
        speed_mps=mission.master_speed_mps,
        variogram=mission.variogram,
    )


def evaluate(mission: Mission) -> Evaluation:
    """Judge a mission's path as it stands in the file, whoever made it.

    Raises
    ------
    InvalidMission
        There is no path, or the mission's geometry breaks a rule.
    Infeasible
        The zones or the safety distance leave no water to judge on.
    """
    site = Site.of(mission)
    request = certify_request(mission, site)
    certificate = certify(request)
    length_m = geodesic_length_m(lonlat(mission.master_path or ()))
    measures = {name: getattr(certificate, name) for name in Measures.__struct_fields__} | {
        "length_m": length_m,
        "duration_s": length_m / mission.master_speed_mps,
        "worst_gap": _worst_gap(certificate, site.frame),
    }
    return Evaluation(
        **measures,
        max_length_m=mission.master_length_m,
        length_ratio=length_m / mission.master_length_m,
        starts_at_launch_m=math.dist(request.path.coords[0], site.launch),
        ends_at_recovery_m=math.dist(request.path.coords[-1], site.recovery),
    )


def _worst_gap(certificate: Certificate, frame: Frame) -> Position | None:
    if certificate.worst_gap is None:
        return None
    long, lat = frame.to_degrees(np.array([certificate.worst_gap])).tolist()[0]
    return Position(lat=lat, long=long)
