"""The flow of one mission, from the Mission File to the plan: read this first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import msgspec
from shapely import Polygon

from oxbow.completion import completed
from oxbow.contracts import (
    ASSIGN,
    CERTIFY,
    CONTOUR,
    DECOMPOSE,
    PATH,
    Assignment,
    AssignRequest,
    Certificate,
    CertifyRequest,
    ContourRequest,
    DecomposeRequest,
    Decomposition,
    Endpoint,
    FreeSpace,
    Message,
    PathPlan,
    PathRequest,
    Role,
    Track,
)
from oxbow.errors import Infeasible
from oxbow.fleet import Member, TeamPlan, VehiclePlan, share_space
from oxbow.mission import Mission, PlanOptions
from oxbow.site import Site

__all__ = ["Call", "expected_calls", "plan_mission"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)


class Call(Protocol):
    """Ask a stage: over the bus (`oxbow.bus.BusCall`) or in this process (`oxbow.local.LocalCall`)."""

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /) -> R: ...


@dataclass(frozen=True)
class Task:
    """What every step of a mission works with."""

    mission: Mission
    options: PlanOptions
    site: Site
    space: FreeSpace
    call: Call


def plan_mission(mission: Mission, options: PlanOptions | None = None, *, call: Call) -> Mission:
    """Plan a mission's nominal paths and certify them (Rendas and Li 2016, section 1.1).

    Masters survey. Slaves treat the hot spots that the prior model tells; where it tells none, they survey too, as
    far as their own length goes.

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
        Whatever a stage raised: nothing is planned by half.
    """
    options = options or PlanOptions()
    site = Site.of(mission)
    contour = ContourRequest(
        outline=site.outline,
        zones=site.zones,
        safety_m=mission.safety_m,
        spacing_m=site.nominal_spacing_m,
        tolerance_m=options.tolerance_m,
    )
    task = Task(mission, options, site, call(CONTOUR, contour), call)
    teams = [
        treatment(task) if role is Role.SLAVE and site.hot_spots else survey(task, site.team(role))
        for role in mission.mission_type.roles
    ]
    return completed(mission, options, site, task.space, teams)


def survey(task: Task, team: Sequence[Member]) -> TeamPlan:
    """Cover the free space: one vehicle all of it, several a share each."""
    if len(team) == 1:
        assignment, spaces, waters_m2 = None, [task.space], [task.site.area_m2]
    else:
        assignment = _shared(task, team)
        areas = {share.vehicle: share.area for share in assignment.shares}
        spaces = [_share_space(task, member, areas[member.vehicle.name]) for member in team]
        waters_m2 = [space.free.area for space in spaces]
    vehicles, paths = [], []
    for member, space, water_m2 in zip(team, spaces, waters_m2, strict=True):
        with member.named():
            decomposition = _decomposed(task, member, space, water_m2)
            path = _path(task, member, space, decomposition)
        paths.append(path)
        vehicles.append(
            VehiclePlan(
                member=member,
                path=path.path,
                heading_rad=decomposition.heading_rad,
                spacing_m=path.spacing_m,
                area_m2=space.free.area,
            )
        )
    return TeamPlan(
        vehicles=tuple(vehicles),
        certificate=_certified(task, vehicles),
        assignment=assignment,
        dropped=tuple(part for path in paths for part in path.dropped),
        warnings=(() if assignment is None else assignment.warnings)
        + tuple(_named(member, text) for member, path in zip(team, paths, strict=True) for text in path.warnings),
    )


def treatment(task: Task) -> TeamPlan:
    """Treat the hot spots: a sortie for each slave, as far as its length goes."""
    team = {member.vehicle.name: member for member in task.site.team(Role.SLAVE)}
    assignment = task.call(
        ASSIGN,
        AssignRequest(
            free=task.space.free,
            vehicles=tuple(member.vehicle for member in team.values()),
            hot_spots=task.site.hot_spots,
            swath_m=task.mission.treated_swath_m,
            seed=task.options.seed,
        ),
    )
    if not assignment.sorties:
        reasons = "; ".join(f"{left.hot_spot}: {left.reason}" for left in assignment.left)
        raise Infeasible(f"has no hot spot that can be treated ({reasons})", where="PriorModel")
    vehicles = [
        VehiclePlan(member=team[sortie.vehicle], path=sortie.path, hot_spots=sortie.hot_spots)
        for sortie in assignment.sorties
    ]
    treated = {name for sortie in assignment.sorties for name in sortie.hot_spots}
    areas = tuple(spot.area for spot in task.site.hot_spots if spot.name in treated)
    return TeamPlan(
        vehicles=tuple(vehicles),
        certificate=_certified(task, vehicles, areas),
        assignment=assignment,
        warnings=assignment.warnings,
    )


def expected_calls(mission: Mission) -> int:
    """How many times stages are called to plan a mission."""
    vehicles = [vehicle.role for vehicle in mission.vehicles or ()]
    counts = {role: max(vehicles.count(role), 1) for role in Role}
    calls = 1
    for role in mission.mission_type.roles:
        treats = role is Role.SLAVE and mission.hot_features
        calls += 2 if treats else 2 * counts[role] + (2 if counts[role] > 1 else 1)
    return calls


# --------------------------------------------------------------------------- one question to a stage each


def _shared(task: Task, team: Sequence[Member]) -> Assignment:
    """Who surveys does a master's work, and has a share, whatever its role."""
    vehicles = tuple(msgspec.structs.replace(member.vehicle, role=Role.MASTER) for member in team)
    request = AssignRequest(free=task.space.free, vehicles=vehicles, share_free=True, seed=task.options.seed)
    return task.call(ASSIGN, request)


def _share_space(task: Task, member: Member, share: Polygon) -> FreeSpace:
    ends = (member.vehicle.start, member.vehicle.recovery)
    return share_space(share, task.space, ends, task.mission.safety_m)


def _decomposed(task: Task, member: Member, space: FreeSpace, water_m2: float) -> Decomposition:
    spacing_m = max(water_m2 / member.vehicle.length_m, task.mission.minimal_spatial_rate_m or 0.0)
    heading_rad = task.options.heading_rad
    return task.call(DECOMPOSE, DecomposeRequest(free=space.free, spacing_m=spacing_m, heading_rad=heading_rad))


def _path(task: Task, member: Member, space: FreeSpace, decomposition: Decomposition) -> PathPlan:
    options = task.options
    return task.call(
        PATH,
        PathRequest(
            method=options.method,
            space=space,
            decomposition=decomposition,
            launch=member.vehicle.start,
            recovery=member.vehicle.recovery,
            length_m=member.vehicle.length_m,
            min_spacing_m=task.mission.minimal_spatial_rate_m or 0.0,
            seed=options.seed,
            weighted_areas=task.site.weighted_areas,
            time_limit_s=options.time_limit_s,
            smooth=options.smooth,
            draw=options.draw,
        ),
    )


def _certified(task: Task, vehicles: Sequence[VehiclePlan], areas: tuple[Polygon, ...] = ()) -> Certificate:
    first, *others = (_track(plan) for plan in vehicles)
    return task.call(
        CERTIFY,
        CertifyRequest(
            **msgspec.structs.asdict(first),
            others=tuple(others),
            outline=task.site.outline,
            zones=task.site.zones,
            safety_m=task.mission.safety_m,
            variogram=task.mission.variogram,
            areas=areas,
        ),
    )


def _track(plan: VehiclePlan) -> Track:
    vehicle = plan.member.vehicle
    return Track(path=plan.path, launch=vehicle.start, recovery=vehicle.recovery, speed_mps=vehicle.speed_mps)


def _named(member: Member, warning: str) -> str:
    """A warning, with the vehicle that it is about where the mission names its vehicles."""
    return f"{member.vehicle.name}: {warning}" if member.is_named else warning
