"""The path stage: cells and a longest length in, a path out."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
import shapely
from shapely import LineString

from oxbow.contracts import PathPlan, PathRequest, SpacingStep
from oxbow.recording import Show
from oxbow.sweep import from_sweep
from oxbow_path.conformance import require_conforming
from oxbow_path.dropped import dropped_parts
from oxbow_path.legs import Access
from oxbow_path.planner import ACCEPTED, TransectPlan, finest_spacing_m, plan_transects
from oxbow_path.show import show_plan

__all__ = ["handle"]


def handle(request: PathRequest, show: Show) -> PathPlan:
    """Plan a path by the requested method, check it, and show how it came about."""
    plan = plan_transects(request)
    back = partial(from_sweep, heading_rad=request.decomposition.heading_rad)
    show_plan(plan, back, show)
    path = _from_launch_to_recovery(shapely.transform(plan.chosen.path, back), request)
    require_conforming(path, request)
    dropped = dropped_parts(path, request.space.free, plan.chosen.pattern.reach_m)
    return PathPlan(
        path=path,
        spacing_m=plan.chosen.pattern.spacing_m,
        steps=tuple(
            SpacingStep(spacing_m=trial.pattern.spacing_m, length_m=trial.length_m) for trial in plan.trials
        ),
        dropped=dropped,
        warnings=_warnings(plan, request),
    )


def _from_launch_to_recovery(path: LineString, request: PathRequest) -> LineString:
    """The path with its ends exactly on the given points: turning there and back leaves a rounding error."""
    points = np.array(path.coords)
    points[0], points[-1] = request.launch, request.recovery
    return LineString(points)


def _warnings(plan: TransectPlan, request: PathRequest) -> tuple[str, ...]:
    legs = {"LaunchPoint": plan.waters.launch, "RecoveryPoint": plan.waters.recovery}
    return (*_leg_warnings(legs), *_length_warnings(plan, request))


def _leg_warnings(legs: dict[str, Access]) -> Iterator[str]:
    for where, leg in legs.items():
        if leg.ashore:
            yield f"{where} lies ashore: its leg of {leg.line.length:.0f} m begins over land"
        elif len(leg.leg) > 2:
            yield (
                f"{where} is out of sight of the free space: its leg leads {leg.line.length:.0f} m"
                " through water nearer to the shore than Safety"
            )


def _length_warnings(plan: TransectPlan, request: PathRequest) -> Iterator[str]:
    share = plan.chosen.length_m / request.length_m
    if share < ACCEPTED:
        if plan.chosen.pattern.spacing_m <= request.min_spacing_m:
            reason = f"Minimal_spatial_rate keeps the spacing at {request.min_spacing_m:g} m"
        elif plan.chosen.pattern.spacing_m <= finest_spacing_m(request.space):
            reason = f"the water is small, and no spacing below {finest_spacing_m(request.space):.2g} m is planned"
        else:
            reason = "no spacing between those tried fits better"
        yield f"the path uses {share:.1%} of the longest length: {reason}"
