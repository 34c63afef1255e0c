"""The path stage: cells and a longest length in, a path out."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import shapely
from shapely import LineString

from oxbow.contracts import Method, PathPlan, PathRequest, dropped_warnings
from oxbow.contracts.budget import WELL_USED
from oxbow.wire.recording import Show
from oxbow_path.approach import plan_with_legs, within_share
from oxbow_path.conformance import require_conforming
from oxbow_path.course import best_plan
from oxbow_path.dropped import dropped_parts
from oxbow_path.refinement import Polyline, smoothed_path
from oxbow_path.space_filling_curve import space_filling_curve
from oxbow_path.task import Display, MethodPlan, PathMethod, Stop, Task, finest_spacing_m
from oxbow_path.tour import tour
from oxbow_path.transect import transects
from oxbow_path.watershed import watershed

__all__ = ["METHODS", "handle", "planned_path"]

METHODS: dict[Method, PathMethod] = {
    Method.SPACE_FILLING_CURVE: space_filling_curve,
    Method.TOUR: tour,
    Method.TRANSECT: transects,
    Method.WATERSHED: watershed,
}

WIDEST = 2.0
"""Widest spacing that a plan claims, in nominal ones: what it leaves farther away is named as dropped."""


def handle(request: PathRequest, show: Show) -> PathPlan:
    """Plan a path by the requested method, check it, and show how it came about.

    Parameters
    ----------
    request
        The water, its cells, the method and the longest length.
    show
        Receives the layers of the method, and the path.

    Returns
    -------
    PathPlan
        A path that keeps to the rules of `require_conforming`, and the water that it leaves far away.
    """
    stop = _stop(request.time_limit_s)
    approach = request.approach
    if approach is None or not approach.has_legs:
        return planned_path(request, stop, show)
    plan = planned_path(within_share(request, approach), stop, show, spent_m=approach.legs_m)
    return plan_with_legs(plan, request, approach)


def planned_path(request: PathRequest, stop: Stop, show: Show, spent_m: float = 0.0) -> PathPlan:
    """Plan as `handle` does, with a clock of the caller's.

    Parameters
    ----------
    request
        The water, its cells, the method and the longest length.
    stop
        Whether time is up; it replaces the request's time limit.
    show
        Receives the layers of the method, and the path.

    Returns
    -------
    PathPlan
        In the planar frame, from the launch to the recovery point exactly.

    Raises
    ------
    Infeasible
        No path is short enough, or no water leads from a point to the free space.
    Internal
        The path broke a rule: a fault of the planner.
    """
    task = Task.of(request, stop, spent_m)
    # Methods work in the sweep frame; what is shown and returned is turned back.
    display = Display(show, request.decomposition.heading_rad)
    plan = best_plan(METHODS[request.method], task, display)
    claimed_m = min(plan.spacing_m, WIDEST * task.spacing_m)
    found = _smoothed(plan.path, task) if request.smooth else plan.path
    display.lines("path", [found])
    path = _from_launch_to_recovery(shapely.transform(found, display.back), request)
    # After the last change to the path: turned back, and with its ends set.
    require_conforming(path, request)
    free = request.space.free
    dropped = dropped_parts(
        path,
        free,
        plan.reach_m * claimed_m / plan.spacing_m,
        is_spent=path.length >= WELL_USED * request.length_m,
    )
    return PathPlan(
        path=path,
        spacing_m=claimed_m,
        steps=plan.steps,
        dropped=dropped,
        warnings=(*_length_warnings(plan, task), *dropped_warnings(dropped, free.area, "its water")),
    )


def _smoothed(path: LineString, task: Task) -> LineString:
    polyline = Polyline.of(path, task.waters.passable.free_and_rounding)
    return smoothed_path(polyline, task.waters.free, task.spacing_m)


def _stop(limit_s: float | None) -> Stop:
    """Whether the time is up, counted from now; without a limit it never is."""
    if limit_s is None:
        return lambda: False
    end_s = time.monotonic() + limit_s
    return lambda: time.monotonic() >= end_s


def _from_launch_to_recovery(path: LineString, request: PathRequest) -> LineString:
    """The path with its ends exactly on the given points: turning there and back leaves a rounding error."""
    points = np.array(path.coords)
    points[0], points[-1] = request.launch, request.recovery
    return LineString(points)


def _length_warnings(plan: MethodPlan, task: Task) -> Iterator[str]:
    request = task.request
    share = plan.path.length / request.length_m
    if share < WELL_USED:
        if plan.spacing_m <= request.min_spacing_m:
            reason = f"`min_spacing_m` keeps the spacing at {request.min_spacing_m:g} m"
        elif min(plan.spacing_m, task.spacing_m) <= finest_spacing_m(request.space):
            finest_m = finest_spacing_m(request.space)
            reason = f"no spacing below {finest_m:.2g} m is planned in water of this size and shore"
        elif task.stop():
            reason = f"its improvement ended after {request.time_limit_s:g} s"
        else:
            reason = "no spacing between those tried fits better"
        yield f"the path uses {share:.1%} of the longest length: {reason}"
