"""The last step of a mission: its path in degrees and the record of the plan, in the Mission File."""

from __future__ import annotations

import importlib.metadata
import math

import msgspec
import numpy as np
import shapely
from shapely import LineString

from oxbow.contracts import (
    Certificate,
    Decomposition,
    DroppedPart,
    FloatArray,
    FreeSpace,
    Measures,
    PathPlan,
    Place,
)
from oxbow.errors import Internal
from oxbow.frame import Frame, Position, geodesic_length_m, lonlat
from oxbow.mission import Mission
from oxbow.plan import DroppedWater, PlanCertificate, PlanOptions, PlanRecord
from oxbow.site import Site

__all__ = ["completed"]

SAME_PLACE_M = 1e-3


def completed(
    mission: Mission,
    options: PlanOptions,
    site: Site,
    space: FreeSpace,
    decomposition: Decomposition,
    plan: PathPlan,
    certificate: Certificate,
) -> Mission:
    """The mission with its path and its `Plan`; an older path and plan are replaced.

    The first and the last waypoint are the launch and recovery positions exactly as given.

    Raises
    ------
    Internal
        The path does not start or end where it should, or its waypoints as written are longer than the
        mission allows.
    """
    waypoints = _waypoints(mission, site, plan.path)
    length_m = geodesic_length_m(lonlat(waypoints))
    if length_m > mission.master_length_m:
        raise Internal(
            f"is {length_m!r} m long; expected at most {mission.master_length_m!r} m", where="Master_Path"
        )
    record = PlanRecord(
        method=options.method,
        seed=options.seed,
        time_limit_s=options.time_limit_s,
        heading_deg=math.degrees(decomposition.heading_rad),
        spacing_m=plan.spacing_m,
        length_m=length_m,
        max_length_m=mission.master_length_m,
        duration_s=length_m / mission.master_speed_mps,
        tolerance_m=space.tolerance_m,
        compression=space.compression,
        certificate=_in_degrees(certificate, site.frame),
        warnings=site.warnings + space.warnings + plan.warnings,
        dropped=tuple(_dropped(part, site.frame) for part in space.dropped + plan.dropped),
        versions=_versions(),
    )
    return msgspec.structs.replace(mission, master_path=waypoints, slave_path=None, plan=record)


def _waypoints(mission: Mission, site: Site, path: LineString) -> tuple[Position, ...]:
    xy = shapely.get_coordinates(path)
    _require_same("starts", xy[0], site.launch)
    _require_same("ends", xy[-1], site.recovery)
    between = (Position(lat=lat, long=long) for long, lat in site.frame.to_degrees(xy[1:-1]).tolist())
    return (mission.launch, *between, mission.recovery or mission.launch)


def _require_same(what: str, end: FloatArray, place: Place) -> None:
    distance_m = float(np.hypot(*(end - place)))
    if distance_m > SAME_PLACE_M:
        raise Internal(f"{what} {distance_m:.3f} m from where it should", where="Master_Path")


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
