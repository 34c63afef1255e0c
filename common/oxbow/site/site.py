"""The site of a mission in planar metres, its geometry checked once, at the edge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np
import shapely
from shapely import MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Place
from oxbow.contracts import DANGER_DETOUR_M, DangerZone, HotSpot, Role, WeightedArea
from oxbow.contracts.budget import nominal_spacing_m
from oxbow.errors import Infeasible, InvalidMission, about_mission
from oxbow.geometry.frame import Frame, Position, lonlat
from oxbow.mission.file import Mission, MissionType
from oxbow.mission.unknown_fields import misspelt
from oxbow.site.contours import MAX_RADIUS_M, Contour, Zone, danger_zones, forbidden_zones, require_points
from oxbow.site.fleet import Member, Team, members
from oxbow.site.hot_spots import HotSpots, hot_spots
from oxbow.site.weights import weighted_areas

__all__ = ["Site"]


@dataclass(frozen=True)
class Site:
    """Where a mission takes place, in the planar metres of its `frame`.

    Parameters
    ----------
    outline
        The water's contour: valid, without holes, in normal form, so that the same contour gives the same
        site whatever its orientation, first point and repeated points.
    zones
        The forbidden zones that meet the outline; they may overlap one another and cross the outline.
    water
        The outline less the zones.
    launch, recovery
        The mission's own points.
    members
        The vehicles that take part, those of the first role first.
    area_m2
        Area of the water: the outline less the zones.
    nominal_spacing_m
        That of those who survey (`oxbow.contracts.budget`), with the greatest length they may travel; the swath
        where nobody surveys.
    weighted_areas
        Where sampling is more or less important than elsewhere.
    hot_spots
        What is to be treated.
    danger_zones
        The danger zones that meet the outline, one per polygon.
    danger_detour_m
        The detour that a chance of no harm e times as good is worth.
    warnings
        What the mission's author should look at.
    """

    frame: Frame
    outline: Polygon
    zones: tuple[Polygon, ...]
    water: Polygon | MultiPolygon
    launch: Place
    recovery: Place
    members: tuple[Member, ...]
    area_m2: float
    nominal_spacing_m: float
    weighted_areas: tuple[WeightedArea, ...] = ()
    hot_spots: tuple[HotSpot, ...] = ()
    danger_zones: tuple[DangerZone, ...] = ()
    danger_detour_m: float = DANGER_DETOUR_M
    warnings: tuple[str, ...] = ()

    @cached_property
    def teams(self) -> tuple[Team, ...]:
        """The vehicles of each role, those who survey first. Without hot spots to treat, slaves survey too."""
        return tuple(
            Team(role, tuple(own), treats=role is Role.SLAVE and bool(self.hot_spots))
            for role, own in groupby(self.members, key=lambda member: member.vehicle.role)
        )

    def team(self, role: Role) -> Team:
        """The vehicles of one role, which is one of the mission's."""
        return next(team for team in self.teams if team.role is role)

    @property
    def ends(self) -> dict[str, Place]:
        """Where vehicles start and are recovered, by the fields that say so; the starts come first."""
        return _ends(self.members)

    @classmethod
    @about_mission()
    def of(cls, mission: Mission) -> Site:
        """Check a mission's geometry and bring it to planar metres.

        Raises
        ------
        InvalidMission
            A contour has no area, the outline meets itself or reaches farther than 300 km from its mean
            point, a point lies farther than that from the water, a vehicle starts or is recovered farther ashore
            than the mission's tolerance, the least spacing exceeds the water, or what is to be treated is
            missing, on land or overlaps; the error names field, index and value.
        Infeasible
            The forbidden zones cover all of the water.
        """
        # 1. The plane and the outline in it.
        require_points(mission)
        contour = Contour.of(mission.outline_name, mission.outline)
        # About the mean of all points: the same contour gives the same plane wherever it begins.
        frame = Frame.around(contour.degrees)
        outline = contour.outline(frame)
        shapely.prepare(outline)
        # 2. The water: what is left of the outline.
        forbidden = forbidden_zones(mission, frame, outline)
        zones = tuple(part for zone in forbidden for part in zone.parts)
        water = _water(outline, zones)
        if water.is_empty:
            raise Infeasible("cover all of the water; nothing is left to plan on", where="ForbiddenZones")
        # 3. What the prior model says of it: where to survey more, what to treat, where harm threatens.
        areas = () if mission.prior_model is None else weighted_areas(mission.prior_model, frame, outline)
        if mission.mission_type is not MissionType.TREAT:
            # Of a treatment, the rate may stand in for the swath, which may be wider than any hot spot.
            _require_rate_within(mission.minimal_spatial_rate_m, water)
        spots = _hot_spots(mission, frame, outline, water)
        dangers = danger_zones(mission, frame, outline)

        # 4. The vehicles, each at a place from which it can take to the water.
        def locate(name: str, position: Position) -> Place:
            return _place(name, position, frame, outline)

        fleet = members(mission, locate)
        for name, place in _ends(fleet).items():
            _require_near(name, place, water, mission.shore_tolerance_m)
        return cls(
            frame=frame,
            outline=outline,
            zones=zones,
            water=water,
            launch=locate("LaunchPoint", mission.launch),
            recovery=locate("RecoveryPoint", mission.recovery or mission.launch),
            members=fleet,
            area_m2=water.area,
            nominal_spacing_m=_nominal_spacing_m(mission, fleet, water.area),
            weighted_areas=areas,
            hot_spots=spots.spots,
            danger_zones=_dangerous(mission, dangers),
            danger_detour_m=DANGER_DETOUR_M if mission.danger_detour_m is None else mission.danger_detour_m,
            warnings=tuple(text for zone in (*forbidden, *dangers) for text in zone.warnings)
            + _prior_warnings(mission, areas)
            + spots.warnings
            + _idle_warnings(mission)
            + misspelt(mission),
        )


def _water(outline: Polygon, zones: Sequence[Polygon]) -> Polygon | MultiPolygon:
    """The outline less the zones, without the points and lines that a difference may leave."""
    if not zones:
        return outline
    parts = shapely.get_parts(outline.difference(shapely.union_all(zones)))
    water = [part for part in parts if isinstance(part, Polygon) and part.area > 0.0]
    return water[0] if len(water) == 1 else MultiPolygon(water)


def _dangerous(mission: Mission, zones: Sequence[Zone]) -> tuple[DangerZone, ...]:
    """The danger zones as requests to stages have them, one per polygon."""
    return tuple(
        DangerZone(name=given.name or f"DangerZones[{index}]", area=area, probability=given.danger, per=given.per)
        for index, (given, zone) in enumerate(zip(mission.danger_zones or (), zones, strict=True))
        for area in zone.parts
    )


def _prior_warnings(mission: Mission, areas: tuple[WeightedArea, ...]) -> tuple[str, ...]:
    features = () if mission.prior_model is None else mission.prior_model.features
    if areas or all(feature.weight is None for feature in features):
        return ()
    return (f"PriorModel has no weight other than 1 inside {mission.outline_name}: its weights have no effect",)


def _hot_spots(mission: Mission, frame: Frame, outline: Polygon, water: BaseGeometry) -> HotSpots:
    """What the slaves are to treat, where the mission has any."""
    if Role.SLAVE not in mission.mission_type.roles:
        return HotSpots()
    features = mission.hot_features
    if features and mission.treated_swath_m is None:
        raise InvalidMission(
            "is missing; expected the width in metres that one pass treats, or Minimal_spatial_rate in its place",
            where="Swath",
        )
    found = hot_spots(features, frame, outline, water, mission.treated_swath_m or 0.0)
    if mission.mission_type is MissionType.TREAT and not found.spots:
        least = "" if mission.bloom is None else f" of {mission.bloom.value:g} or more"
        raise InvalidMission(
            f"has no hot spot in the water; a mission of type {mission.mission_type} needs a feature with a value"
            f"{least}",
            where="PriorModel",
        )
    return found


def _require_rate_within(rate_m: float | None, water: BaseGeometry) -> None:
    """Check that the water is as wide as the least spacing, before any stage plans ways that far apart."""
    x0, y0, x1, y1 = water.bounds
    extent_m = float(np.hypot(x1 - x0, y1 - y0))
    if rate_m is not None and rate_m > extent_m:
        raise InvalidMission(
            f"is {rate_m:g} m; expected at most the extent of the water, {extent_m:.0f} m",
            where="Minimal_spatial_rate",
        )


def _nominal_spacing_m(mission: Mission, fleet: Sequence[Member], area_m2: float) -> float:
    least_m = mission.minimal_spatial_rate_m or 0.0
    lengths_m = [member.vehicle.length_m for member in fleet if member.vehicle.role is Role.MASTER]
    if not lengths_m:
        return mission.treated_swath_m or least_m
    return nominal_spacing_m(area_m2, sum(lengths_m), least_m)


def _idle_warnings(mission: Mission) -> tuple[str, ...]:
    idle = [vehicle.name for vehicle in mission.vehicles or () if vehicle.role not in mission.mission_type.roles]
    if not idle:
        return ()
    return (f"Vehicles: {', '.join(idle)} take no part in a mission of type {mission.mission_type}",)


def _ends(fleet: Sequence[Member]) -> dict[str, Place]:
    starts = {member.fields.start: member.vehicle.start for member in fleet}
    return starts | {member.fields.recovery: member.vehicle.recovery for member in fleet}


def _require_near(name: str, place: Place, water: BaseGeometry, tolerance_m: float) -> None:
    distance_m = float(shapely.distance(water, Point(place)))
    if distance_m > tolerance_m:
        raise InvalidMission(
            f"lies {distance_m:.3g} m from the water, on land or in a forbidden zone; expected a place in the"
            f" water or at most Shore_tolerance = {tolerance_m:g} m from it, or a greater Shore_tolerance",
            where=name,
        )


def _place(name: str, position: Position, frame: Frame, outline: Polygon) -> Place:
    degrees = lonlat([position])
    x, y = map(float, frame.to_planar(degrees)[0])
    if _is_near(degrees, frame, outline):
        return x, y
    swapped = " (latitude and longitude look swapped)" if _is_near(degrees[:, ::-1], frame, outline) else ""
    raise InvalidMission(
        f"is lat {position.lat!r}, long {position.long!r}, {np.hypot(x, y) / 1000:.0f} km from the middle of the"
        f" site; expected a place within {MAX_RADIUS_M / 1000:.0f} km of the water{swapped}",
        where=name,
    )


def _is_near(degrees: FloatArray, frame: Frame, outline: Polygon) -> bool:
    xy = frame.to_planar(degrees)
    return bool(np.isfinite(xy).all()) and bool(shapely.distance(outline, Point(xy[0])) <= MAX_RADIUS_M)
