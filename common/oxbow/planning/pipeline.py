"""The flow of one mission, from the Mission File to the plan: read this first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import msgspec
from shapely import Polygon

from oxbow.contracts import (
    ASSIGN,
    CERTIFY,
    CONTOUR,
    DECOMPOSE,
    PATH,
    Approach,
    Assignment,
    AssignRequest,
    Call,
    Certificate,
    CertifyRequest,
    ContourRequest,
    DecomposeRequest,
    Decomposition,
    FreeSpace,
    PathPlan,
    PathRequest,
    Role,
    Share,
    Track,
)
from oxbow.contracts.budget import nominal_spacing_m
from oxbow.errors import Infeasible
from oxbow.geometry.conformance import Shore
from oxbow.mission.file import Mission, PlanOptions
from oxbow.planning.completion import completed_mission
from oxbow.planning.field_names import FieldNames, NamedCall
from oxbow.planning.verification import CheckedCall, require_faultless, require_fit_to_follow
from oxbow.site.fleet import Member, Team, TeamPlan, VehiclePlan
from oxbow.site.site import Site

__all__ = ["expected_calls", "plan_mission"]

FAR = 0.25
"""Legs that take more than this share of a range are warned about: that length is missing from the survey."""


@dataclass(frozen=True)
class MissionTask:
    """What every step of a mission works with."""

    mission: Mission
    options: PlanOptions
    site: Site
    space: FreeSpace
    call: Call

    @cached_property
    def shore(self) -> Shore:
        """What paths are judged by before they leave."""
        return Shore(self.site.water, self.mission.safety_m, self.mission.least_width_m)

    def part(self, member: Member) -> str:
        """Which part of the mission a vehicle is, where there are several."""
        return member.vehicle.name if len(self.site.members) > 1 else ""


def plan_mission(
    mission: Mission, options: PlanOptions | None = None, *, call: Call, site: Site | None = None
) -> Mission:
    """Plan a mission's nominal paths and certify them (Rendas and Li 2016, section 1.1).

    Masters survey. Slaves treat the hot spots of the prior model; where it has none, they survey too, as far as
    their own length goes.

    Parameters
    ----------
    mission
        A checked mission.
    options
        Method, seed and the like; the defaults of `PlanOptions` where absent.
    call
        How the stages are reached.
    site
        The mission's site, where the caller has it already.

    Returns
    -------
    Mission
        The mission with its paths and the `Plan` object filled in.

    Raises
    ------
    OxbowError
        Whatever a stage raised: there is no partial plan. `Internal` where a reply does not belong to its
        request, or a path breaks a rule of the water: it is not handed out.

    Examples
    --------
    A pond of about 300 m by 220 m, planned in this process:

    >>> from oxbow.mission.file import parse_mission
    >>> from oxbow_cli.local import local_call
    >>> corners = [[46.0, 2.0], [46.0, 2.004], [46.002, 2.004], [46.002, 2.0]]
    >>> pond = {
    ...     "MissionType": "map",
    ...     "LaunchPoint": {"lat": 46.0002, "long": 2.0005},
    ...     "BoundingBox": [{"lat": lat, "long": long} for lat, long in corners],
    ...     "Safety": 5.0,
    ...     "Master_length": 2000.0,
    ... }
    >>> planned = plan_mission(parse_mission(msgspec.json.encode(pond)), call=local_call())
    >>> planned.plan.certificate.crossings, planned.plan.certificate.outside_m
    (0, 0.0)
    >>> 0.95 * 2000.0 < planned.plan.length_m <= 2000.0
    True
    """
    options = options or PlanOptions()
    site = site or Site.of(mission)
    names = FieldNames.of_mission(mission, site)
    with names.in_errors():
        return _planned(mission, options, site, NamedCall(CheckedCall(call), names))


def _planned(mission: Mission, options: PlanOptions, site: Site, call: Call) -> Mission:
    # 1. The water to plan on, at the safety distance from every shore.
    contour = ContourRequest(
        outline=site.outline,
        zones=site.zones,
        safety_m=mission.safety_m,
        spacing_m=site.nominal_spacing_m,
        tolerance_m=options.tolerance_m,
        places=tuple(site.ends.values()),
        shore_tolerance_m=mission.shore_tolerance_m,
        least_width_m=mission.least_width_m,
    )
    task = MissionTask(mission, options, site, call(CONTOUR, contour), call)
    # 2. The paths of each team, one team after the other: every role has a task of its own.
    teams = [treatment(task, team) if team.treats else survey(task, team) for team in site.teams]
    # 3. The record of all of it, in degrees.
    return completed_mission(mission, options, site, task.space, teams)


def survey(task: MissionTask, team: Team) -> TeamPlan:
    """Cover the free space: one vehicle all of it, several a share each.

    Parameters
    ----------
    task
        The mission, its site and its free space.
    team
        The vehicles that survey.

    Returns
    -------
    TeamPlan
        One path per vehicle, certified together.
    """
    # One vehicle needs no share, and its legs are the path method's own.
    if len(team.members) == 1:
        (member,) = team.members
        alone = (_covered(task, member, task.space.free),)
        return TeamPlan(alone, _certified(task, alone))
    # Several: what each has to itself, how it gets there across the shares of others, and its path in there.
    assignment = _shared(task, team)
    shares = {share.vehicle: share for share in assignment.shares}
    vehicles = tuple(_shared_part(task, member, shares[member.vehicle.name]) for member in team.members)
    return TeamPlan(vehicles, _certified(task, vehicles), assignment)


def treatment(task: MissionTask, team: Team) -> TeamPlan:
    """Treat the hot spots: a sortie for each vehicle, as far as its length goes.

    Parameters
    ----------
    task
        The mission, its site and its free space.
    team
        The vehicles that treat.

    Returns
    -------
    TeamPlan
        One path per vehicle that has a sortie, certified together.
    """
    members = {member.vehicle.name: member for member in team.members}
    request = AssignRequest(
        free=task.space.free,
        water=task.space.water,
        vehicles=tuple(member.vehicle for member in team.members),
        hot_spots=task.site.hot_spots,
        swath_m=task.mission.treated_swath_m,
        danger_zones=task.site.danger_zones,
        danger_detour_m=task.site.danger_detour_m,
        router=task.options.router,
        seed=task.options.seed,
    )
    assignment = task.call(ASSIGN, request)
    if not assignment.sorties:
        reasons = "; ".join(f"{left.hot_spot}: {left.reason}" for left in assignment.left)
        raise Infeasible(f"has no hot spot that can be treated ({reasons})", where="PriorModel")
    # Sorties that are made now, and those that come after them: both become paths in the same way.
    vehicles, further = (
        tuple(
            VehiclePlan(member=members[sortie.vehicle], path=sortie.path, hot_spots=sortie.hot_spots)
            for sortie in sorties
        )
        for sorties in (assignment.sorties, assignment.further)
    )
    # Further sorties are in no certificate, and this is the only check that they get.
    require_fit_to_follow(task.shore, task.site.frame, further)
    treated = {name for sortie in assignment.sorties for name in sortie.hot_spots}
    areas = tuple(spot.area for spot in task.site.hot_spots if spot.name in treated)
    return TeamPlan(vehicles, _certified(task, vehicles, areas), assignment, treats=True)


def expected_calls(site: Site) -> int:
    """How many times stages are called to plan a mission, for progress."""
    contour = 1
    return contour + sum(_expected_calls_of(team) for team in site.teams)


def _expected_calls_of(team: Team) -> int:
    certificate = assignment = 1
    if team.treats:
        return assignment + certificate
    cells_and_path = 2 * len(team.members)
    return cells_and_path + certificate + (assignment if len(team.members) > 1 else 0)


# --------------------------------------------------------------------------- one question to a stage each


def _shared(task: MissionTask, team: Team) -> Assignment:
    """Share the free space out. A vehicle that surveys does a master's work, whatever its role."""
    vehicles = tuple(msgspec.structs.replace(member.vehicle, role=Role.MASTER) for member in team.members)
    request = AssignRequest(
        free=task.space.free,
        water=task.space.water,
        vehicles=vehicles,
        share_free=True,
        spacing_m=task.site.nominal_spacing_m,
        footprint_m=task.mission.footprint_m,
        seed=task.options.seed,
    )
    return task.call(ASSIGN, request)


def _shared_part(task: MissionTask, member: Member, share: Share) -> VehiclePlan:
    """A path over a share, with the legs to it and home."""
    plan = _covered(task, member, share.area, share.approach)
    range_m, legs_m = member.vehicle.length_m, share.approach.legs_m
    if legs_m <= FAR * range_m:
        return plan
    text = (
        f"the way to its share and home takes {legs_m / range_m:.0%} of its {range_m:.0f} m: start it nearer, or"
        " give it more length"
    )
    return replace(plan, warnings=(text, *plan.warnings))


def _covered(task: MissionTask, member: Member, free: Polygon, approach: Approach | None = None) -> VehiclePlan:
    """A path over a part of the free space, or all of it."""
    space = msgspec.structs.replace(task.space, free=free)
    with FieldNames.of_member(member).in_errors():
        decomposition = _decomposed(task, member, free, approach)
        plan = _path(task, member, space, decomposition, approach)
    return VehiclePlan(
        member=member,
        path=plan.path,
        heading_rad=decomposition.heading_rad,
        spacing_m=plan.spacing_m,
        area_m2=free.area,
        dropped=plan.dropped,
        warnings=plan.warnings,
    )


def _decomposed(task: MissionTask, member: Member, free: Polygon, approach: Approach | None) -> Decomposition:
    # A share is planned for its own water; alone, a vehicle is to cover all water, though only some of it is free.
    water_m2 = task.site.area_m2 if approach is None else free.area
    length_m = member.vehicle.length_m - (0.0 if approach is None else approach.legs_m)
    spacing_m = nominal_spacing_m(water_m2, length_m, task.mission.minimal_spatial_rate_m or 0.0)
    request = DecomposeRequest(free=free, spacing_m=spacing_m, heading_rad=task.options.heading_rad)
    return task.call(DECOMPOSE, request, part=task.part(member))


def _path(
    task: MissionTask,
    member: Member,
    space: FreeSpace,
    decomposition: Decomposition,
    approach: Approach | None,
) -> PathPlan:
    options = task.options
    request = PathRequest(
        method=options.method,
        space=space,
        decomposition=decomposition,
        launch=member.vehicle.start,
        recovery=member.vehicle.recovery,
        approach=approach,
        length_m=member.vehicle.length_m,
        min_spacing_m=task.mission.minimal_spatial_rate_m or 0.0,
        seed=options.seed,
        weighted_areas=task.site.weighted_areas,
        time_limit_s=options.time_limit_s,
        smooth=options.smooth,
        draw=options.draw,
    )
    return task.call(PATH, request, part=task.part(member))


def _certified(task: MissionTask, vehicles: Sequence[VehiclePlan], areas: tuple[Polygon, ...] = ()) -> Certificate:
    """The certificate of a team's paths, none of which breaks a rule of the water."""
    first, *others = (_track(plan) for plan in vehicles)
    certificate = task.call(
        CERTIFY,
        CertifyRequest(
            **msgspec.structs.asdict(first),
            others=tuple(others),
            outline=task.site.outline,
            zones=task.site.zones,
            safety_m=task.mission.safety_m,
            least_width_m=task.mission.least_width_m,
            variogram=task.mission.variogram,
            areas=areas,
            danger_zones=task.site.danger_zones,
        ),
        part=vehicles[0].member.vehicle.role if len(task.mission.mission_type.roles) > 1 else "",
    )
    # Judged twice: a replica that is old or wrong may certify a path that breaks a rule of this mission's water.
    require_faultless(certificate.faults, task.site.frame, vehicles)
    require_fit_to_follow(task.shore, task.site.frame, vehicles)
    return certificate


def _track(plan: VehiclePlan) -> Track:
    vehicle = plan.member.vehicle
    return Track(path=plan.path, launch=vehicle.start, recovery=vehicle.recovery, speed_mps=vehicle.speed_mps)
