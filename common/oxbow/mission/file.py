"""The Mission File: its fields, their defaults and checks (Rendas and Li 2016, section 1.1).

The JSON names are the report's; the Python names carry SI units. `docs/mission-file.md` describes the file.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from oxbow.contracts import MAX_REQUEST_BYTES, Role, Variogram
from oxbow.contracts.message import LEAST_LENGTH_M, MOST_LENGTH_M
from oxbow.errors import InvalidInput, InvalidMission, about_mission
from oxbow.geometry.frame import Position, lonlat
from oxbow.mission.danger_zones import GivenDangerZone, require_dangers
from oxbow.mission.files import read_bytes, write_atomically
from oxbow.mission.plan import PlanOptions, PlanRecord
from oxbow.mission.prior import PriorFeature, PriorModel, parse_prior, prior_document
from oxbow.mission.vehicles import GivenVehicle, VehiclePath, require_distinct
from oxbow.tolerances import DEFAULT_LEAST_WIDTH_M, DEFAULT_SHORE_TOLERANCE_M, FARTHEST_M
from oxbow.wire.strict_json import decode_json, document_of, part_with_extra, utf8, with_extra

__all__ = [
    "Bloom",
    "Mission",
    "MissionType",
    "OutlineName",
    "PlanOptions",
    "PlanRecord",
    "Position",
    "mission_json",
    "parse_mission",
    "read_mission",
    "write_mission",
]


class MissionType(enum.StrEnum):
    """What a mission is for, and so which vehicles take part."""

    MAP = "map"
    ADAP = "adap"
    TREAT = "treat"
    MAP_AND_TREAT = "map&treat"
    ADAP_AND_TREAT = "adap&treat"

    @property
    def roles(self) -> tuple[Role, ...]:
        """Who takes part (Rendas and Li 2016, section 1.1)."""
        return _ROLES[self]


_ROLES = {
    MissionType.MAP: (Role.MASTER,),
    MissionType.ADAP: (Role.MASTER,),
    MissionType.TREAT: (Role.SLAVE,),
    MissionType.MAP_AND_TREAT: (Role.MASTER, Role.SLAVE),
    MissionType.ADAP_AND_TREAT: (Role.MASTER, Role.SLAVE),
}
NEEDS_BLOOM = frozenset({MissionType.ADAP, MissionType.MAP_AND_TREAT, MissionType.ADAP_AND_TREAT})


class Bloom(msgspec.Struct, frozen=True, kw_only=True, rename={"sensor": "Sensor", "value": "Value"}):
    """What to look for or treat: water where `sensor` reads more than `value`, in the sensor's own unit."""

    sensor: str
    value: float
    extra: dict[str, Any] = {}


JSON_NAMES = {
    "mission_type": "MissionType",
    "site_name": "SiteName",
    "launch": "LaunchPoint",
    "recovery": "RecoveryPoint",
    "outline": "BoundingBox",
    "forbidden_zones": "ForbiddenZones",
    "danger_zones": "DangerZones",
    "danger_detour_m": "Danger_detour",
    "bloom": "Bloom",
    "master_speed_mps": "Master_speed",
    "slave_speed_mps": "Slave_speed",
    "master_length_m": "Master_length",
    "slave_length_m": "Slave_length",
    "safety_m": "Safety",
    "shore_tolerance_m": "Shore_tolerance",
    "least_width_m": "Least_width",
    "minimal_spatial_rate_m": "Minimal_spatial_rate",
    "swath_m": "Swath",
    "footprint_m": "Footprint",
    "vehicles": "Vehicles",
    "prior_model": "PriorModel",
    "master_path": "Master_Path",
    "slave_path": "Slave_Path",
    "paths": "Paths",
    "plan": "Plan",
}
_TRAVELLED = ("master_speed_mps", "slave_speed_mps", "master_length_m", "slave_length_m")
_WIDTHS = ("minimal_spatial_rate_m", "swath_m", "footprint_m")
_RANGES = {
    **dict.fromkeys(_TRAVELLED, (LEAST_LENGTH_M, MOST_LENGTH_M)),
    **dict.fromkeys(_WIDTHS, (LEAST_LENGTH_M, FARTHEST_M)),
    "danger_detour_m": (0.0, MOST_LENGTH_M),
    "safety_m": (0.0, FARTHEST_M),
    "shore_tolerance_m": (0.0, 10_000.0),
    "least_width_m": (1e-3, 1_000.0),
}
"""Least and greatest values: a seam of rounding width is never water, and nobody carries a boat for hours."""
_PARTS: dict[str, tuple[type[msgspec.Struct], bool]] = {
    "Bloom": (Bloom, False),
    "Vehicles": (GivenVehicle, True),
    "DangerZones": (GivenDangerZone, True),
}
"""Parts of the file that may have unknown fields, and whether the part is a list of such objects."""


class OutlineName(enum.StrEnum):
    """The names that the outline's field may have; `IN_BOX` is the older one."""

    BOUNDING_BOX = "BoundingBox"
    IN_BOX = "InBox"


class Mission(msgspec.Struct, frozen=True, kw_only=True, rename=JSON_NAMES):
    """A Mission File whose values are in range; `oxbow.site.site.Site` checks its geometry.

    Parameters
    ----------
    recovery
        Where the vehicle comes back; the launch point where absent.
    outline
        The water's contour, at least three distinct points, either orientation, closed or not.
    danger_zones
        What may be entered, at a risk.
    danger_detour_m
        The detour that a chance of no harm e times as good is worth; absent: `DANGER_DETOUR_M`.
    outline_name
        The name under which the outline came, and is written.
    safety_m
        Least distance from the outline and the zones.
    shore_tolerance_m
        How far from the water a vehicle may start or be recovered.
    least_width_m
        Water narrower than this is not water.
    minimal_spatial_rate_m
        Least distance between parallel segments of the path; absent: as close as the length allows.
    swath_m
        Width of the water that one pass of a slave treats; absent: the minimal spatial rate.
    footprint_m
        What a master's sensor sees at once, edge to edge: the longest edge of the triangles that shares are made
        of (Balampanis, Maza and Ollero 2016, section IV); absent: a size that suits the water and the fleet.
    vehicles
        Who takes part; absent: one master and one slave, as far as the mission's type needs them.
    prior_model
        What is known of the field beforehand.
    paths
        The path of every vehicle, of a mission that names its vehicles.
    extra
        Unknown fields, kept unchanged.
    """

    mission_type: MissionType
    site_name: str | None = None
    launch: Position
    recovery: Position | None = None
    outline: tuple[Position, ...]
    forbidden_zones: tuple[tuple[Position, ...], ...] = ()
    danger_zones: tuple[GivenDangerZone, ...] | None = None
    danger_detour_m: float | None = None
    bloom: Bloom | None = None
    master_speed_mps: float = 1.0
    slave_speed_mps: float = 0.5
    master_length_m: float = 20_000.0
    slave_length_m: float = 15_000.0
    safety_m: float = 0.0
    shore_tolerance_m: float = DEFAULT_SHORE_TOLERANCE_M
    least_width_m: float = DEFAULT_LEAST_WIDTH_M
    minimal_spatial_rate_m: float | None = None
    swath_m: float | None = None
    footprint_m: float | None = None
    vehicles: tuple[GivenVehicle, ...] | None = None
    prior_model: PriorModel | None = None
    master_path: tuple[Position, ...] | None = None
    slave_path: tuple[Position, ...] | None = None
    paths: tuple[VehiclePath, ...] | None = None
    plan: PlanRecord | None = None
    outline_name: OutlineName = OutlineName.BOUNDING_BOX
    extra: dict[str, Any] = {}

    def __post_init__(self) -> None:
        for field, (least, most) in _RANGES.items():
            value = getattr(self, field)
            if value is not None and not least <= value <= most:
                raise InvalidMission(
                    f"is {value!r}; expected a number from {least:g} to {most:g}", where=JSON_NAMES[field]
                )
        if self.bloom is None and self.mission_type in NEEDS_BLOOM:
            raise InvalidMission(
                f"is missing; a mission of type {self.mission_type} needs its Sensor and Value", where="Bloom"
            )
        if self.bloom is not None and not math.isfinite(self.bloom.value):
            raise InvalidMission(f"is {self.bloom.value!r}; expected a finite number", where="Bloom.Value")
        # Else the file that is written would have the field twice, and its reader would take either.
        if clash := FIELD_NAMES & self.extra.keys():
            raise InvalidMission("is a field of the Mission File, not an extra one", where=min(clash))
        require_dangers(self.danger_zones or ())
        self._check_vehicles()
        self._check_positions()

    @property
    def planned_paths(self) -> tuple[VehiclePath, ...]:
        """The path of every vehicle that has one, under whichever field it stands."""
        own = ((Role.MASTER, self.master_path), (Role.SLAVE, self.slave_path))
        own_roles = self.mission_type.roles
        of_roles = (
            VehiclePath(name=role, role=role, path=path) for role, path in own if path and role in own_roles
        )
        return (*of_roles, *(self.paths or ()))

    @property
    def treated_swath_m(self) -> float | None:
        """Width of the water that one pass treats, where the mission says it."""
        return self.swath_m or self.minimal_spatial_rate_m

    @property
    def hot_features(self) -> tuple[tuple[int, PriorFeature], ...]:
        """What is to be treated, with its index: the prior model's values at or above the threshold."""
        least = -math.inf if self.bloom is None else self.bloom.value
        features = () if self.prior_model is None else self.prior_model.features
        return tuple(
            (index, feature)
            for index, feature in enumerate(features)
            if feature.value is not None and feature.value >= least
        )

    @property
    def variogram(self) -> Variogram | None:
        """How the field varies from place to place, where that is known."""
        return None if self.prior_model is None else self.prior_model.variogram

    def _check_vehicles(self) -> None:
        if self.vehicles is None:
            return
        require_distinct(self.vehicles)
        for role in self.mission_type.roles:
            if all(vehicle.role is not role for vehicle in self.vehicles):
                raise InvalidMission(
                    f"has no {role}; expected one or more for a mission of type {self.mission_type}", "Vehicles"
                )

    def _check_positions(self) -> None:
        _require_degrees("LaunchPoint", (self.launch,), indexed=False)
        if self.recovery is not None:
            _require_degrees("RecoveryPoint", (self.recovery,), indexed=False)
        _require_degrees(self.outline_name, self.outline)
        for index, zone in enumerate(self.forbidden_zones):
            _require_degrees(f"ForbiddenZones[{index}]", zone)
        for index, danger_zone in enumerate(self.danger_zones or ()):
            _require_degrees(f"DangerZones[{index}].Contour", danger_zone.contour)
        _require_degrees("Master_Path", self.master_path or ())
        _require_degrees("Slave_Path", self.slave_path or ())
        for index, vehicle in enumerate(self.vehicles or ()):
            for name, place in (("Start", vehicle.start), ("Recovery", vehicle.recovery)):
                _require_degrees(f"Vehicles[{index}].{name}", (place,) if place else (), indexed=False)
        for index, planned in enumerate(self.paths or ()):
            _require_degrees(f"Paths[{index}].Path", planned.path)


FIELD_NAMES = frozenset(JSON_NAMES.values()) | {name.value for name in OutlineName}
"""Every known field of the Mission File."""


def _require_degrees(name: str, positions: Sequence[Position], *, indexed: bool = True) -> None:
    degrees = lonlat(positions)
    # What is right is asked for, not what is wrong: every comparison with NaN is false.
    wrong = ~((np.abs(degrees[:, 1]) <= 90.0) & (np.abs(degrees[:, 0]) <= 360.0))
    if not wrong.any():
        return
    index = int(np.argmax(wrong))
    position = positions[index]
    where = f"{name}[{index}]" if indexed else name
    if abs(position.lat) <= 90.0:
        raise InvalidMission(f"is {position.long!r}; expected -180 .. 180 degrees", where=f"{where}.long")
    swapped = " (latitude and longitude look swapped)" if abs(position.long) <= 90.0 else ""
    raise InvalidMission(f"is {position.lat!r}; expected -90 .. 90 degrees{swapped}", where=f"{where}.lat")


# --------------------------------------------------------------------------- the file


@about_mission()
def parse_mission(data: bytes) -> Mission:
    """The mission that a Mission File holds.

    Raises
    ------
    InvalidMission
        The bytes are more than `MAX_REQUEST_BYTES`, are not JSON, or break a rule of the Mission File; the
        error names the field with its index, and its value.
    """
    if len(data) > MAX_REQUEST_BYTES:
        raise InvalidMission(f"is {len(data)} bytes; expected at most {MAX_REQUEST_BYTES}", where="Mission File")
    document = with_extra(
        decode_json(utf8(data, "Mission File"), dict[str, msgspec.Raw], "Mission File"), FIELD_NAMES
    )
    # Both names are accepted, and the one that was used is written back: other programs may know only that.
    names = [name for name in OutlineName if name in document]
    # Neither could be preferred without dropping a contour silently.
    if len(names) > 1:
        raise InvalidMission(
            "is given in addition to BoundingBox, its newer name; expected only one of them", where="InBox"
        )
    for name, (kind, is_list) in _PARTS.items():
        if name in document:
            document[name] = part_with_extra(bytes(document[name]), kind, name, is_list=is_list)
    if names:
        document["BoundingBox"] = document.pop(names[0])
        document["outline_name"] = msgspec.Raw(msgspec.json.encode(names[0]))
    # Read apart from the rest: it is GeoJSON, with geometries that msgspec does not know.
    prior = document.pop("PriorModel", None)
    try:
        mission = decode_json(msgspec.json.encode(document), Mission, "Mission File")
    except InvalidInput as error:
        # Errors use the name that the author used.
        if names == [OutlineName.IN_BOX] and error.where.startswith("BoundingBox"):
            raise InvalidMission(error.message, error.where.replace("BoundingBox", "InBox", 1)) from error
        raise
    return mission if prior is None else msgspec.structs.replace(mission, prior_model=parse_prior(bytes(prior)))


def mission_json(mission: Mission) -> bytes:
    """The Mission File of a mission: the input fields, the unknown ones, and last the paths and the plan."""
    given = {json: getattr(mission, field) for field, json in JSON_NAMES.items()}
    outputs = {name: given.pop(name) for name in ("Master_Path", "Slave_Path", "Paths", "Plan")}
    outline = given.pop("BoundingBox")
    if mission.prior_model is not None:
        given["PriorModel"] = prior_document(mission.prior_model)
    if mission.bloom is not None:
        given["Bloom"] = document_of(mission.bloom)
    if mission.vehicles is not None:
        given["Vehicles"] = [document_of(vehicle) for vehicle in mission.vehicles]
    if mission.danger_zones is not None:
        given["DangerZones"] = [document_of(zone) for zone in mission.danger_zones]
    document = given | {mission.outline_name.value: outline} | mission.extra | outputs
    # What is absent is left out; an unknown field that was null stays so.
    present = {name: value for name, value in document.items() if value is not None or name in mission.extra}
    return msgspec.json.format(msgspec.json.encode(present), indent=2) + b"\n"


def read_mission(path: Path | str) -> Mission:
    """The mission in a file; `InvalidMission` where the file cannot be read or is no Mission File."""
    return parse_mission(read_bytes(Path(path), MAX_REQUEST_BYTES))


def write_mission(path: Path | str, mission: Mission) -> None:
    """Replace a Mission File as a whole; on any failure the old one stays as it was (`write_atomically`).

    Parameters
    ----------
    path
        The file, which need not exist.
    mission
        What to write.

    Raises
    ------
    OSError
        The file cannot be written, or is no regular file.
    """
    write_atomically(Path(path), mission_json(mission))
