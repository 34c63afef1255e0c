"""The flow of one mission, from the Mission File to the plan: read this first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import msgspec
from shapely import LineString, Polygon

from oxbow.contracts import (
    ASSIGN,
    CERTIFY,
    CONTOUR,
    DECOMPOSE,
    PATH,
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
    Track,
)
from oxbow.contracts.budget import WELL_USED, nominal_spacing_m
from oxbow.errors import Infeasible, renamed
from oxbow.geometry.conformance import Shore
from oxbow.mission.file import Mission, PlanOptions
from oxbow.planning.approach import Approach, Harbour
from oxbow.planning.completion import completed_mission
from oxbow.planning.verification import CheckedCall, require_faultless, require_fit_to_follow
from oxbow.site.fleet import Member, TeamPlan, VehiclePlan
from oxbow.site.site import Site

__all__ = ["expected_calls", "plan_mission"]


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


def plan_mission(mission: Mission, options: PlanOptions | None = None, *, call: Call) -> Mission:
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
    # 1. The water to plan on, at the safety distance from every shore.
    options = options or PlanOptions()
    call = CheckedCall(call)
    site = Site.of(mission)
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
    # Stages know places by number only: their errors are given the names of the author's fields.
    fields = {f"places[{index}]": field for index, field in enumerate(site.ends)}
    with renamed(fields | {"least_width_m": "Least_width"}):
        space = call(CONTOUR, contour)
    # 2. The paths of each team, one team after the other: every role has a task of its own.
    task = MissionTask(mission, options, site, space, call)
    teams = [
        treatment(task) if role is Role.SLAVE and site.hot_spots else survey(task, site.team(role))
        for role in mission.mission_type.roles
    ]
    # 3. The record of all of it, in degrees.
    return completed_mission(mission, options, site, task.space, teams)


def survey(task: MissionTask, team: Sequence[Member]) -> TeamPlan:
    """Cover the free space: one vehicle all of it, several a share each.

    Parameters
    ----------
    task
        The mission, its site and its free space.
    team
        The vehicles that survey, at least one.

    Returns
    -------
    TeamPlan
        One path per vehicle, certified together.
    """
    # One vehicle needs no share, and its legs are the path method's own.
    if len(team) == 1:
        (member,) = team
        vehicle = member.vehicle
        whole = Approach(task.space, vehicle.start, vehicle.recovery)
        alone = (_covered(task, member, whole, task.site.area_m2),)
        return TeamPlan(alone, _certified(task, alone))
    # Several: what each has to itself, how it gets there across the shares of others, and its path in there.
    assignment = _shared(task, team)
    areas = {share.vehicle: share.area for share in assignment.shares}
    harbour = Harbour(task.space, task.site.nominal_spacing_m)
    vehicles = tuple(_shared_part(task, member, harbour, areas[member.vehicle.name]) for member in team)
    return TeamPlan(vehicles, _certified(task, vehicles), assignment)


def treatment(task: MissionTask) -> TeamPlan:
    """Treat the hot spots: a sortie for each slave, as far as its length goes."""
    team = {member.vehicle.name: member for member in task.site.team(Role.SLAVE)}
    request = AssignRequest(
        free=task.space.free,
        water=task.space.water,
        vehicles=tuple(member.vehicle for member in team.values()),
        hot_spots=task.site.hot_spots,
        swath_m=task.mission.treated_swath_m,
        danger_zones=task.site.danger_zones,
        danger_detour_m=task.site.danger_detour_m,
        router=task.options.router,
        seed=task.options.seed,
    )
    with renamed({"swath_m": "Swath" if task.mission.swath_m else "Minimal_spatial_rate"}):
        assignment = task.call(ASSIGN, request)
    if not assignment.sorties:
        reasons = "; ".join(f"{left.hot_spot}: {left.reason}" for left in assignment.left)
        raise Infeasible(f"has no hot spot that can be treated ({reasons})", where="PriorModel")
    # Sorties that are made now, and those that come after them: both become paths in the same way.
    vehicles, further = (
        tuple(
            VehiclePlan(member=team[sortie.vehicle], path=sortie.path, hot_spots=sortie.hot_spots)
            for sortie in sorties
        )
        for sorties in (assignment.sorties, assignment.further)
    )
    # Further sorties are in no certificate, and this is the only check that they get.
    require_fit_to_follow(task.shore, task.site.frame, further)
    treated = {name for sortie in assignment.sorties for name in sortie.hot_spots}
    areas = tuple(spot.area for spot in task.site.hot_spots if spot.name in treated)
    return TeamPlan(vehicles, _certified(task, vehicles, areas), assignment)


def expected_calls(mission: Mission) -> int:
    """How many times stages are called to plan a mission."""
    vehicles = [vehicle.role for vehicle in mission.vehicles or ()]
    counts = {role: max(vehicles.count(role), 1) for role in Role}
    # The contour first; then, for each vehicle, a decomposition and a path, for each team its shares and
    # certificate.
    calls = 1
    for role in mission.mission_type.roles:
        treats = role is Role.SLAVE and mission.hot_features
        calls += 2 if treats else 2 * counts[role] + (2 if counts[role] > 1 else 1)
    return calls


# --------------------------------------------------------------------------- one question to a stage each


def _shared(task: MissionTask, team: Sequence[Member]) -> Assignment:
    """Share the free space out. A vehicle that surveys does a master's work, whatever its role."""
    vehicles = tuple(msgspec.structs.replace(member.vehicle, role=Role.MASTER) for member in team)
    request = AssignRequest(
        free=task.space.free,
        water=task.space.water,
        vehicles=vehicles,
        share_free=True,
        footprint_m=task.mission.footprint_m,
        seed=task.options.seed,
    )
    fields = {f"vehicle {each.vehicle.name!r}: length_m": each.fields["Master_length"] for each in team}
    with renamed(fields | {"footprint_m": "Footprint"}):
        return task.call(ASSIGN, request)


def _shared_part(task: MissionTask, member: Member, harbour: Harbour, share: Polygon) -> VehiclePlan:
    with member.naming_fields():
        approach = harbour.approach(share, member.vehicle)
    return _covered(task, member, approach, share.area)


def _covered(task: MissionTask, member: Member, approach: Approach, water_m2: float) -> VehiclePlan:
    """A path over all of a space, with the legs to it."""
    with member.naming_fields():
        # Legs across other shares are paid for first: the path in the share has what they leave.
        length_m = approach.length_m(member.vehicle.length_m)
        decomposition = _decomposed(task, member, approach.space, water_m2, length_m)
        plan = _path(task, member, approach, decomposition, length_m)
        path = approach.with_legs(plan.path)
        return VehiclePlan(
            member=member,
            path=path,
            heading_rad=decomposition.heading_rad,
            spacing_m=plan.spacing_m,
            area_m2=approach.space.free.area,
            dropped=plan.dropped,
            warnings=(
                *approach.warnings(member.vehicle.length_m),
                *plan.warnings,
                *_unused(path, plan, member, length_m),
            ),
        )


def _unused(path: LineString, plan: PathPlan, member: Member, length_m: float) -> tuple[str, ...]:
    """A warning where legs turn out much shorter than the length kept for them, so that some of it is unused."""
    share = path.length / member.vehicle.length_m
    if share >= WELL_USED or plan.path.length < WELL_USED * length_m:
        return ()
    return (f"uses {share:.1%} of its longest length: its legs are shorter than what was kept for them",)


def _decomposed(
    task: MissionTask, member: Member, space: FreeSpace, water_m2: float, length_m: float
) -> Decomposition:
    # Of this vehicle's share and length alone: boats of a team may differ in both.
    spacing_m = nominal_spacing_m(water_m2, length_m, task.mission.minimal_spatial_rate_m or 0.0)
    request = DecomposeRequest(free=space.free, spacing_m=spacing_m, heading_rad=task.options.heading_rad)
    return task.call(DECOMPOSE, request, part=task.part(member))


def _path(
    task: MissionTask, member: Member, approach: Approach, decomposition: Decomposition, length_m: float
) -> PathPlan:
    options = task.options
    with renamed({"min_spacing_m": "Minimal_spatial_rate"}):
        request = PathRequest(
            method=options.method,
            space=approach.space,
            decomposition=decomposition,
            launch=approach.launch,
            recovery=approach.recovery,
            length_m=length_m,
            spent_m=member.vehicle.length_m - length_m,
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
