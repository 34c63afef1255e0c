"""Which course to follow: the method's own path, the shortest way with detours, or a loop round islands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import shapely
from shapely import LineString, Polygon

from oxbow.contracts import SpacingStep
from oxbow.errors import Infeasible, Internal
from oxbow.geometry.route import RouteMethod, make_router
from oxbow.tolerances import ROUNDING_M
from oxbow_path.course.detours import with_detour, with_detours
from oxbow_path.course.loops import Middles
from oxbow_path.improvement import improved_line
from oxbow_path.refinement import Polyline
from oxbow_path.task import Display, MethodPlan, PathMethod, Task
from oxbow_path.walk.legs import path_with_legs
from oxbow_path.walk.pattern import try_transects
from oxbow_path.walk.trial import CUT, Pattern

__all__ = ["best_plan"]

WAYS = 4.0
"""A walk from launch to recovery goes there, back and there again: the shortest way alone is tried, too, where the
length is less than this many of it."""

REACH = 0.5
"""Water nearer to the course than this, in spacings, needs no detour."""

FAR = 0.75
"""Where length is plentiful, water farther from a path than this, in spacings, gets a detour."""

EVENNESS_QUANTILE = 0.95
"""The share of the water whose distance counts in a score, besides the largest one."""

GOOD = 1.6
"""A plan whose `_score_m` is no more spacings than this is taken at once: the other would hardly do better."""

SPENT = 0.95
"""A plan that uses less than this share of what is enough has length left for detours."""

MANY = 30_000
"""A plan of more waypoints than this is taken at once: to refine another as long would take a minute."""

NARROW = 2.65
"""In water of no more mean width than this, in spacings, no method's pattern has room: courses are tried first."""


def best_plan(method: PathMethod, task: Task, display: Display) -> MethodPlan:
    """The plan of a method, or along a course where that leaves less water far away.

    Parameters
    ----------
    method
        Plans by its own pattern.
    task
        The request made ready.
    display
        Shows what is tried.

    Returns
    -------
    MethodPlan
        The one of least `_score_m` of those tried, perhaps with detours to water that it left far away.

    Raises
    ------
    Infeasible
        Even the shortest way from launch to recovery is longer than the vehicle can go.
    """
    # Only the lines so far: to refine one takes as long as a method does, and may not be needed.
    courses = list(_courses(task))
    fitting = [course for course in courses if task.budget.fits(course.length)]
    by_method, by_course = partial(method, task, display), partial(_along, fitting, task, display)
    ways = ([by_course, by_method] if _is_narrow(task) else [by_method, by_course]) if fitting else [by_method]
    plans: list[MethodPlan] = []
    for way in ways:
        try:
            plans.append(way())
        except Infeasible as refusal:
            # Where a course fits, it stands in for the method that refuses.
            if not fitting:
                plans.append(_at_least(task, display, courses, refusal))
        # Mostly the first plan is good, and the second, which would double the time, is not made.
        if plans and (task.stop() or _is_good(plans[-1].path, task)):
            break
    best = _reaching(min(plans, key=lambda plan: _score_m(plan.path, task)), task)
    return _spent(best, task, display) if best.path.length < SPENT * task.budget.enough_m else best


def _is_good(path: LineString, task: Task) -> bool:
    return len(path.coords) > MANY or _score_m(path, task) <= GOOD * task.spacing_m


def _reaching(plan: MethodPlan, task: Task) -> MethodPlan:
    """A plan that leaves no water far away that a detour reaches, where length is plentiful.

    The refinement cannot see round a headland, and takes many steps to the end of a long arm.
    """
    if task.enough_m == 0.0:
        return plan
    path = with_detours(plan.path, task.waters, task.budget.most_m, reach_m=FAR * task.spacing_m)
    return replace(plan, path=path)


def _spent(plan: MethodPlan, task: Task, display: Display) -> MethodPlan:
    """A plan with much length left, which is spent on detours to what is far from it, and refined once more."""
    path = with_detours(plan.path, task.waters, task.budget.most_m, reach_m=FAR * task.spacing_m)
    if path.length == plan.path.length or task.stop():
        return replace(plan, path=path)
    return replace(
        plan, path=improved_line(Polyline.of(path, task.waters.passable.free_and_rounding), task, display)
    )


def _is_narrow(task: Task) -> bool:
    free = task.waters.free
    return 2 * free.area <= NARROW * task.spacing_m * free.length


def _at_least(task: Task, display: Display, courses: Sequence[LineString], refusal: Infeasible) -> MethodPlan:
    """A plan along the shortest way, where a method finds none though the length suffices for that.

    Raises
    ------
    Infeasible
        It does not suffice, the shortest way is not simple, or launch and recovery are one place.
    """
    if task.waters.launch.place == task.waters.recovery.place:
        raise _too_short(task, courses) or refusal
    way = _shortest_way(task)
    if not way.is_simple:
        raise refusal
    if not task.budget.fits(way.length):
        raise _too_short(task, [way]) or refusal
    return _along([way], task, display)


def _too_short(task: Task, courses: Sequence[LineString]) -> Infeasible | None:
    """The refusal with the true figure: a course is shorter than any walk from one place to another."""
    if not courses:
        return None
    shortest_m = min(course.length for course in courses)
    return task.budget.too_short(shortest_m)


def _along(courses: Sequence[LineString], task: Task, display: Display) -> MethodPlan:
    """The best of some courses with detours, refined."""
    waters = task.waters
    longer = [
        with_detours(course, waters, task.useful_length_m, reach_m=REACH * task.spacing_m) for course in courses
    ]
    best = min(longer, key=lambda course: _score_m(course, task))
    display.lines("course", [best])
    path = improved_line(Polyline.of(best, waters.passable.free_and_rounding), task, display)
    steps = (SpacingStep(spacing_m=task.spacing_m, length_m=best.length),)
    return MethodPlan(path, task.spacing_m, task.spacing_m, steps)


def _score_m(path: LineString, task: Task) -> float:
    """How far the water is from a path, the worst of it and nearly all of it: what the refinement makes small."""
    distance_m = task.waters.probe.distances(path)
    return float(distance_m.max() + np.quantile(distance_m, EVENNESS_QUANTILE))


def _courses(task: Task) -> Iterator[LineString]:
    """Courses from launch to recovery that a walk round a tree cannot make, or no method need make otherwise."""
    waters = task.waters
    if waters.free.area <= task.enough_m * waters.free.length:
        # Water whose mean width is no more than the least spacing has no room for a pattern: a walk that leaves no
        # gap of half the least spacing is enough.
        yield try_transects(waters, Pattern(task.enough_m)).path
    if waters.launch.place != waters.recovery.place:
        way = _shortest_way(task)
        if task.budget.limit_m < WAYS * way.length and way.is_simple:
            yield way
    elif waters.free.interiors:
        yield from _loops(task)


def _shortest_way(task: Task) -> LineString:
    """From launch to recovery, with their legs."""
    waters = task.waters
    router = make_router(RouteMethod.VISIBILITY, waters.free)
    ends = (shapely.get_coordinates(entry)[0] for entry in waters.entries)
    way = router.route(*ends).polyline
    whole = np.vstack([waters.launch.leg[:-1], way, waters.recovery.leg[-2::-1]])
    return LineString(shapely.get_coordinates(shapely.remove_repeated_points(LineString(whole), ROUNDING_M)))


def _loops(task: Task) -> Iterator[LineString]:
    """Loops round islands, from the launch point and back."""
    waters = task.waters
    for loop in Middles.of(waters.routes.mesh).loops(task.spacing_m, task.budget.most_m):
        course = _from_home(LineString(loop), task)
        if course is not None:
            yield course


def _from_home(loop: LineString, task: Task) -> LineString | None:
    """A loop that begins and ends at the launch point; None where no way leads there, or the legs do not fit."""
    waters = task.waters
    home = waters.launch.entry
    sight = shapely.shortest_line(home, loop)
    if not shapely.covers(waters.passable.free_and_rounding, sight):
        away = loop.project(home) + loop.length / 2
        # Begun at its far side: a detour leaves the ends of a path where they are.
        turned = _turned(loop, away % loop.length)
        found = with_detour(turned, waters, shapely.get_coordinates(home)[0], task.budget.most_m - loop.length)
        if found is None:
            return None
        loop = found
    try:
        return path_with_legs(
            Polygon(loop),
            waters.launch,
            waters.recovery,
            waters.passable,
            opening_m=CUT * waters.spacing_m,
            detail_m=waters.spacing_m,
        )
    # A loop is one offer among others: where it does not work out, the method's own plan stands.
    except (Infeasible, Internal):
        return None


def _turned(loop: LineString, start_m: float) -> LineString:
    """A closed line that starts elsewhere."""
    points = shapely.get_coordinates(loop)
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    first = int(np.searchsorted(at, start_m)) % (len(points) - 1)
    turned = np.roll(points[:-1], -first, axis=0)
    return LineString(np.vstack([turned, turned[:1]]))
